"""Lays tracks: A* on a grid of two layers. A net may cross others at a price; these are taken up and laid again, and where they met it gets dearer.

Inside all is whole micrometres and whole costs: the same pads give the same tracks on every machine. A cell has three nodes: a track on the front,
a track on the back, a via. An edge is (node, higher node) of tracks; from one layer to the other it is a via.
"""

import collections
import heapq
import math

import wiring

GRID_um, TRACK_um, VIA_um, DRILL_um = 250, 250, 600, 300
CLEARANCE_um, EDGE_um = 190, 500  # copper to copper, and to the board's edge
STEP, DIAGONAL, TURN, THROUGH, CROSS, MET = 10, 14, 3, 120, 50, 60  # costs; the last is added where nets met
FRONT, BACK, VIA = 0, 1, 2
TAKEN, FAR, ROUNDS = "", 10**9, 3000


class Grid:
    def __init__(self, width, height):
        self.half = [round(mm * 500) // GRID_um + 4 for mm in (width, height)]  # what is near the edge is on it, too
        self.nx = 2 * self.half[0] + 1
        self.cells = self.nx * (2 * self.half[1] + 1)
        self.fixed = [None] * (3 * self.cells)  # the net whose pads are near, or TAKEN
        self.met = collections.Counter()  # how often nets met at a node
        # Steps to nodes where a track beside a track, a track beside a via, a via beside a via would be too near.
        around = lambda um, *kinds: [3 * (cell - self.cells // 2) + kind for cell in self.near((0, 0, 0, 0), um) for kind in kinds]
        self.beside = around(CLEARANCE_um + TRACK_um, FRONT)
        self.through = around(CLEARANCE_um + (TRACK_um + VIA_um) // 2, FRONT, BACK)
        self.apart = around(CLEARANCE_um + VIA_um, VIA)
        # By layer: (step, cost, nodes that must be free). A via needs what tracks on both layers need, here and around.
        eight = [(3 * (dx + dy * self.nx), 3 * dx, 3 * dy * self.nx) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]
        ways = [(step, DIAGONAL, (step, dx, dy)) if dx and dy else (step, STEP, (step, 0)) for step, dx, dy in eight]
        self.room = [VIA, *(step + side for step in (0, *(way[0] for way in eight)) for side in (FRONT, BACK))]
        self.ways = [[*ways, (BACK, THROUGH, self.room)], [*ways, (-BACK, THROUGH, [step - BACK for step in self.room])]]

    def near(self, rectangle, reach):
        """Cells whose middle is within reach of it. Left, top, right, bottom."""
        left, top, right, bottom = rectangle
        xs, ys = (range(-((reach - low) // GRID_um), (high + reach) // GRID_um + 1) for low, high in ((left, right), (top, bottom)))
        for x, y in ((GRID_um * x, GRID_um * y) for y in ys for x in xs):
            if max(left - x, 0, x - right) ** 2 + max(top - y, 0, y - bottom) ** 2 <= reach**2:
                yield self.cells // 2 + y // GRID_um * self.nx + x // GRID_um

    def place_mm(self, node):
        y, x = divmod(node // 3, self.nx)
        return (x - self.half[0]) * GRID_um / 1000, (y - self.half[1]) * GRID_um / 1000

    def fix(self, rectangle, kinds, net, clearance=CLEARANCE_um):
        for kind in kinds:
            for cell in self.near(rectangle, clearance + (VIA_um if kind == VIA else TRACK_um) // 2):
                owner = self.fixed[3 * cell + kind]
                self.fixed[3 * cell + kind] = net if owner in (None, net) else TAKEN

    def room_of(self, edges):
        """Nodes that must be free; and those where others would be too near."""
        nodes, vias = {node for edge in edges for node in edge}, [a for a, b in edges if b - a == BACK]
        takes = {node + step for node in nodes for step in self.beside} | {via + step for via in vias for step in self.through}
        return nodes | {via + step for via in vias for step in self.room}, takes

    def path(self, begin, goal, price):
        """The cheapest edges from begin to goal, sets of nodes."""
        row, column = divmod(min(goal) // 3, self.nx)

        def rest(node):
            y, x = divmod(node // 3, self.nx)
            dx, dy = abs(x - column), abs(y - row)
            return STEP * max(dx, dy) + (DIAGONAL - STEP) * min(dx, dy)

        paid, came, done = dict.fromkeys(begin, 0), {}, set()
        heap = sorted((rest(node), node) for node in begin)
        while heap:
            _, node = heapq.heappop(heap)
            if node in goal:
                found = []
                while node in came:
                    found.append((min(node, came[node]), max(node, came[node])))
                    node = came[node]
                return found
            if node in done:
                continue
            done.add(node)
            so_far, straight = paid[node], node - came.get(node, node)
            for step, length, room in self.ways[node % 3]:
                to, cost = node + step, so_far + length + TURN * (step != straight)
                for at in room:
                    cost += price[node + at]
                if cost < paid.get(to, FAR):
                    paid[to], came[to] = cost, node
                    heapq.heappush(heap, (cost + rest(to), to))
        raise wiring.Unwired("a pad is walled in")

    def joined(self, net, pads, others):
        """The edges that join a net's pads [((x, y), nodes)], the nearest first. others: nodes that other nets' tracks take."""
        price = [0 if owner in (None, net) else FAR for owner in self.fixed]
        for node in others:
            price[node] += CROSS + self.met[node]
        pads = [(place, {node for node in nodes if price[node] < FAR}) for place, nodes in pads]
        done, left, nodes, edges = pads[:1], pads[1:], set(pads[0][1]), set()
        while left:
            _, nearest = min((min(math.dist(place, other) for other, _ in done), i) for i, (place, _) in enumerate(left))
            done.append(left.pop(nearest))
            way = self.path(nodes, done[-1][1], price)
            edges.update(way)
            nodes.update(done[-1][1], *way)
            for node in (a + step for a, b in way if b - a == BACK for step in self.apart):
                price[node] = FAR
        return edges

    def drawn(self, edges):
        """Tracks [(x0, y0, x1, y1, layer)] and vias [(x, y)] of a net."""
        tracks, vias = [], []
        meet = collections.Counter(node for a, b in edges for node in (a, b) if b - a != BACK)
        for a, b in sorted(edges):
            step = b - a
            if step == BACK:
                vias.append(self.place_mm(a))
            elif (a - step, a) not in edges or meet[a] > 2:
                while (b, b + step) in edges and meet[b] == 2:
                    b += step
                tracks.append((*self.place_mm(a), *self.place_mm(b), a % 3))
        return tracks, vias


def route(size, pads, free):
    """In mm. size: of the board; pads: [(net or None, layer (0 front, 1 back), x, y, w, h)]; free: [(layers without tracks, rectangle without vias)].
    Returns {net: (tracks [(x0, y0, x1, y1, layer)], vias [(x, y)])}."""
    whole = lambda rectangle: [round(1000 * mm) for mm in rectangle]
    grid, (w, h) = Grid(*size), whole(mm / 2 for mm in size)
    for edge in ((-w, -h, w, -h), (-w, h, w, h), (-w, -h, -w, h), (w, -h, w, h)):
        grid.fix(edge, (FRONT, BACK, VIA), TAKEN, EDGE_um)
    for layers, rectangle in free:
        grid.fix(whole(rectangle), (*layers, VIA), TAKEN)
    ends = {net: [] for net in sorted({pad[0] for pad in pads} - {None})}
    for net, layer, x, y, w, h in pads:
        box = whole((x - w / 2, y - h / 2, x + w / 2, y + h / 2))
        grid.fix(box, (layer,), net or TAKEN)
        grid.fix(box, (VIA,), TAKEN, 0)  # it would take the pad's solder
        if net:  # to KiCad, a track that ends on a pad's edge does not end in it
            ends[net].append(((x, y), [3 * cell + layer for cell in grid.near(box, -1)]))
    waiting, laid = sorted(ends, key=lambda net: len(ends[net])), {}
    for _ in range(ROUNDS):
        if not waiting:
            return {net: grid.drawn(laid[net][0]) for net in ends}
        net = waiting.pop(0)
        edges = grid.joined(net, ends[net], set().union(*(taken for _, taken in laid.values())))
        needs, takes = grid.room_of(edges)
        for other in [other for other, (_, taken) in laid.items() if needs & taken]:
            grid.met.update({node: MET for node in needs & laid.pop(other)[1]})
            waiting.append(other)
        laid[net] = edges, takes
    raise wiring.Unwired(f"{len(waiting)} nets still cross others after {ROUNDS} rounds")
