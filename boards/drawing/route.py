"""Lays tracks: A* on a grid of two layers. A track may cross those of other nets at a price; these are taken up and laid again, and where they met it gets dearer.

All in whole micrometres and whole costs: the same pads give the same tracks on every machine. A node is a cell of the front, or `cells` more: of the back.
An edge is (node, higher node); from one layer to the other it is a via.
"""

import collections
import heapq

import wiring

GRID_um, TRACK_um, VIA_um, DRILL_um = 250, 250, 600, 300
CLEARANCE_um, EDGE_um = 190, 500  # copper to copper, and to the board's edge
STEP, DIAGONAL, TURN, THROUGH, CROSS, MET = 10, 14, 3, 120, 50, 15  # costs; the last is added where nets met
TAKEN, FAR, ROUNDS = -1, 10**9, 3000
EIGHT = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]


class Grid:
    def __init__(self, width, height):
        self.half = [round(mm * 500) // GRID_um for mm in (width, height)]
        self.nx = 2 * self.half[0] + 1
        self.cells = self.nx * (2 * self.half[1] + 1)
        # Nets whose pads are near, or TAKEN, and how many tracks are near: for tracks by node, for vias by cell.
        self.fixed = {TRACK_um: [0] * (2 * self.cells), VIA_um: [0] * self.cells}
        self.crowd = {kind: [0] * len(nets) for kind, nets in self.fixed.items()}
        self.met = [0] * (2 * self.cells)
        self.steps = [(dx + dy * self.nx, DIAGONAL if dx and dy else STEP, dx, dy * self.nx) for dx, dy in EIGHT]
        # How far a cell is from one where a track beside a track, a track beside a via, a via beside a via would be too near.
        reach = (CLEARANCE_um + (a + b) // 2 for a, b in ((TRACK_um, TRACK_um), (TRACK_um, VIA_um), (VIA_um, VIA_um)))
        self.around = [[cell - self.cells // 2 for cell in self.near((0, 0, 0, 0), um)] for um in reach]

    def near(self, rectangle, reach):
        """Cells whose middle is within reach of it. Left, top, right, bottom."""
        left, top, right, bottom = rectangle
        xs, ys = (
            [GRID_um * i for i in range(max(-((reach - low) // GRID_um), -half), min((high + reach) // GRID_um, half) + 1)]
            for low, high, half in ((left, right, self.half[0]), (top, bottom, self.half[1]))
        )
        for x, y in ((x, y) for y in ys for x in xs):
            if max(left - x, 0, x - right) ** 2 + max(top - y, 0, y - bottom) ** 2 <= reach**2:
                yield self.cells // 2 + y // GRID_um * self.nx + x // GRID_um

    def place(self, node):
        y, x = divmod(node % self.cells, self.nx)
        return (x - self.half[0]) * GRID_um, (y - self.half[1]) * GRID_um

    def fix(self, rectangle, layers, net, clearance=CLEARANCE_um):
        """layers: of the tracks for which it is in the way; it always is for vias."""
        for kind, planes in ((TRACK_um, layers), (VIA_um, (0,))):
            fixed = self.fixed[kind]
            for cell in self.near(rectangle, kind // 2 + clearance):
                for node in (cell + plane * self.cells for plane in planes):
                    fixed[node] = net if fixed[node] in (0, net) else TAKEN

    def takes(self, nodes, vias):
        """{kind: where it would be too near}"""
        beside, through, apart = self.around
        both = [step + back for step in through for back in (0, self.cells)]
        tracks = {node + step for node in nodes for step in beside} | {via + step for via in vias for step in both}
        holes = {node % self.cells + step for node in nodes for step in through} | {via + step for via in vias for step in apart}
        return {TRACK_um: tracks, VIA_um: holes}

    def count(self, taken, by):
        for kind, nodes in taken.items():
            for node in nodes:
                self.crowd[kind][node] += by

    def path(self, net, begin, goal, edges, own):
        """The cheapest edges from begin to goal, sets of nodes. edges: those that the net has; own: its part of the crowd."""
        cells, nx = self.cells, self.nx
        gy, gx = divmod(min(goal, default=0) % cells, nx)
        too_near = {a + step for a, b in edges if b - a == cells for step in self.around[2]}

        def rest(node):
            y, x = divmod(node % cells, nx)
            dx, dy = abs(x - gx), abs(y - gy)
            return STEP * max(dx, dy) + (DIAGONAL - STEP) * min(dx, dy)

        def price(node, kind=TRACK_um):
            if self.fixed[kind][node] not in (0, net):
                return FAR
            return CROSS + self.met[node] if self.crowd[kind][node] > own[kind][node] else 0

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
            straight, here, other = node - came.get(node, node), price(node), (node + cells) % (2 * cells)
            for step, length, dx, dy in [*self.steps, (other - node, THROUGH, 0, 0)]:
                to, cost = node + step, paid[node] + length
                if (min(node, to), max(node, to)) in edges:
                    cost += 1 - length
                elif to == other:
                    cost += price(other) + (FAR if node % cells in too_near else price(node % cells, VIA_um))
                else:
                    cost += TURN * (step != straight) + price(to) + (price(node + dx) + price(node + dy) if dx and dy else here)
                if cost < paid.get(to, FAR):
                    paid[to], came[to] = cost, node
                    heapq.heappush(heap, (cost + rest(to), to))
        raise wiring.Unwired(f"a pad of net {net} is walled in")

    def drawn(self, edges):
        """Tracks [(x0, y0, x1, y1, layer)] and vias [(x, y)] of a net."""
        tracks, vias = [], []
        meet = collections.Counter(node for a, b in edges for node in (a, b) if b - a != self.cells)
        for a, b in sorted(edges):
            step = b - a
            if step == self.cells:
                vias.append(self.place(a))
            elif (a - step, a) not in edges or meet[a] > 2:
                while (b, b + step) in edges and meet[b] == 2:
                    b += step
                tracks.append((*self.place(a), *self.place(b), a // self.cells))
        return tracks, vias


def whole(rectangle):
    return [round(1000 * mm) for mm in rectangle]


def tree(pads):
    """The shortest [(length squared, begin, goal)] that join a net's pads [((x, y), nodes)]."""
    joined, left, found = pads[:1], pads[1:], []
    while left:
        length, i, j = min(
            ((a[0][0] - b[0][0]) ** 2 + (a[0][1] - b[0][1]) ** 2, i, j) for i, a in enumerate(joined) for j, b in enumerate(left)
        )
        found.append((length, joined[i][1], left[j][1]))
        joined.append(left.pop(j))
    return found


def route(size, pads, free):
    """In mm. size: of the board; pads: [(net or None, layer (0 front, 1 back), x, y, w, h)]; free: [(layers without tracks, rectangle without vias)].
    Returns {net: (tracks [(x0, y0, x1, y1, layer)], vias [(x, y)])} in um."""
    grid, (w, h) = Grid(*size), whole(mm / 2 for mm in size)
    for edge in ((-w, -h, w, -h), (-w, h, w, h), (-w, -h, -w, h), (w, -h, w, h)):
        grid.fix(edge, (0, 1), TAKEN, EDGE_um)
    for layers, rectangle in free:
        grid.fix(whole(rectangle), layers, TAKEN)
    ends = {net: [] for net in sorted({pad[0] for pad in pads} - {None})}
    numbers = {None: TAKEN} | {net: n + 1 for n, net in enumerate(ends)}
    boxes = [(net, layer, whole((x - w / 2, y - h / 2, x + w / 2, y + h / 2))) for net, layer, x, y, w, h in pads]
    for net, layer, box in boxes:
        grid.fix(box, (layer,), numbers[net])
        grid.fix(box, (), TAKEN, 0)  # a via in a pad takes its solder
    for net, layer, box in boxes:
        if net:
            nodes = {layer * grid.cells + cell for cell in grid.near(box, 0)}
            ends[net].append(((box[0] + box[2], box[1] + box[3]), {n for n in nodes if grid.fixed[TRACK_um][n] == numbers[net]}))
    links = sorted((length, numbers[net], i, *link) for net in ends for i, (length, *link) in enumerate(tree(ends[net])))
    waiting, laid, taken = [link[1:] for link in links], {}, {}
    for _ in range(ROUNDS):
        if not waiting:
            return {net: grid.drawn({edge for link, way in laid.values() if link[0] == numbers[net] for edge in way}) for net in ends}
        net, i, begin, goal = waiting[0]
        keys = [key for key in laid if key[0] == net]
        own = {kind: collections.Counter(node for key in keys for node in taken[key][kind]) for kind in grid.crowd}
        way = grid.path(net, begin, goal, {edge for key in keys for edge in laid[key][1]}, own)
        nodes, vias = {node for edge in way for node in edge}, {a for a, b in way if b - a == grid.cells}
        laid[net, i], taken[net, i] = (waiting.pop(0), way), grid.takes(nodes, vias)
        grid.count(taken[net, i], 1)
        for key in [key for key in laid if key[0] != net]:
            meets = nodes & taken[key][TRACK_um] | vias & taken[key][VIA_um]
            for node in meets:
                grid.met[node] += MET
            if meets:
                grid.count(taken.pop(key), -1)
                waiting.append(laid.pop(key)[0])
    raise wiring.Unwired(f"{len(waiting)} connections still cross others after {ROUNDS} rounds")
