"""Whether a circuit board is what its descriptor says: nets of all pads, values, places, holes. Reads the KiCad file as text.

That the copper connects what the nets say, and nothing else, is for KiCad's design rule check (checks.pcb_copper).
"""

import collections
import math
import re

import mould
import pico

VIA_FREE_mm = 1.95  # around a sensor's middle, each way
NEAR_mm = 4  # a capacitor to its part, from pad to pad
PIN_pF, TRACK_pF_mm = 10, 0.1  # a pin, as UM10204 allows at most; a track over a plane 1.6 mm below (a guess: none was measured)
PADS_mm = {"1": (-1, -1), "2": (-1, 1), "3": (1, 1), "4": (1, -1)}  # of a sensor, from its middle; y down
PICO_mm = 17.78 / 2 + 0.9, 2.54  # its pads' rows on the back, USB at the top: from its middle, and pitch
LEGS_mm = (2.725, -24, 2.2), (2.425, -20.97, 1.85)  # holes for those of its USB socket, on both sides of its middle


def parsed(text):
    """A list of lists of words."""
    stack = [[]]
    for word in re.findall(r'"[^"]*"|[()]|[^\s()]+', text):
        if word == "(":
            stack.append([])
        elif word == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(word.strip('"'))
    return stack[0][0]


def all_of(node, name):
    return [child for child in node if isinstance(child, list) and child[0] == name]


def numbers(node, name):
    return [float(word) for word in all_of(node, name)[0][1:] if re.fullmatch(r"-?[\d.]+", word)]


class Board:
    """Millimetres from the board's middle, x to the right and y down, seen from the front.

    pads: {(part, pad): (x, y, width, height, net or None)}; parts: {name: (x, y, turn in degrees, whether on the back, value)};
    tracks: [(x0, y0, x1, y1, width, net, layer)]; vias: [(x, y)]; holes: [(x, y, diameter)]; outline: two corners.
    """

    def __init__(self, text):
        tree = parsed(text)
        self.middle = numbers(all_of(tree, "setup")[0], "aux_axis_origin")
        self.pads, self.parts, self.holes = {}, {}, []
        for part in all_of(tree, "footprint"):
            self.read_part(part)
        of, nets = self.from_middle, {net[1]: net[2] for net in all_of(tree, "net")}
        self.tracks = []
        for track in all_of(tree, "segment"):
            net, layer = (all_of(track, name)[0][1] for name in ("net", "layer"))
            self.tracks.append((*of(numbers(track, "start")), *of(numbers(track, "end")), *numbers(track, "width"), nets[net], layer))
        self.vias = [of(numbers(via, "at")) for via in all_of(tree, "via")]
        ((self.outline),) = [(of(numbers(line, "start")), of(numbers(line, "end"))) for line in all_of(tree, "gr_rect")]

    def from_middle(self, place):
        return place[0] - self.middle[0], place[1] - self.middle[1]

    def read_part(self, part):
        x, y, *turn = numbers(part, "at")
        (x, y), turns = self.from_middle((x, y)), int(turn[0]) // 90 if turn else 0
        texts = {text[1]: text[2] for text in all_of(part, "fp_text")}
        name = texts["reference"]
        self.parts[name] = (x, y, 90 * turns, all_of(part, "layer")[0][1] == "B.Cu", texts.get("value"))
        for pad in all_of(part, "pad"):
            dx, dy = numbers(pad, "at")[:2]
            w, h = numbers(pad, "size")
            for _ in range(turns):
                dx, dy, w, h = dy, -dx, h, w
            if pad[2] == "np_thru_hole":
                self.holes.append((x + dx, y + dy, w))
            else:
                net = all_of(pad, "net")
                again = "+" * ((name, pad[1]) in self.pads)
                self.pads[name, pad[1] + again] = (x + dx, y + dy, w, h, net[0][2] if net else None)


def expected(descriptor):
    """{net: set of pads}, without resistors and capacitors, whose names are free; and what pulls which net up, in ohms."""
    w, nets = descriptor["wiring"], collections.defaultdict(set)
    wires, pulls = (of_parallel if descriptor["bus"] == "parallel" else of_multiplexed)(w, descriptor["pull_ups_ohm"])
    for k in range(w["sensor_count"]):
        wires += [("GND", f"U{k}", 1), ("3V3", f"U{k}", 2), (f"SDA{k}", f"U{k}", 4)]
    for net, part, pad in wires:
        nets[net].add((part, str(pad)))
    return nets, pulls


def of_parallel(w, ohm):
    count = range(w["sensor_count"])
    pins = {"3V3": "3V3", "AGND": "GND", f"GP{w['pin_scl']}": "SCL"} | {f"GP{k}": f"SDA{k}" for k in count}
    wires = [("GND", "A0", pin) for pin in pico.grounds()] + [(net, "A0", pico.pin(name)) for name, net in pins.items()]
    if "pin_sync" in w:
        wires += [("SYNC", "A0", pico.pin(f"GP{w['pin_sync']}")), ("SYNC", "J0", 1)]
    return wires + [("SCL", f"U{k}", 3) for k in count], {"SCL": ohm["scl"]} | {f"SDA{k}": ohm["sda"] for k in count}


def of_multiplexed(w, ohm):
    wires = [(net, "X0", pad) for pad, net in {1: "GND", 2: "3V3", 3: "SDA", 4: "SCL", 8: "GND", "MP": "GND", "MP+": "GND"}.items()]
    pulls = {"SDA": ohm["bus"], "SCL": ohm["bus"]}
    for strip in range(-(-w["sensor_count"] // w["sensors_of_strip"])):
        mux, reset, address = f"M{strip}", f"RESET{strip}", int(w["mux_address_0"], 0) + strip
        pulls[reset] = ohm["reset"]
        wires += [(reset, "X0", 5 + strip)] + [
            (net, mux, pad) for pad, net in {3: reset, 12: "GND", 22: "SCL", 23: "SDA", 24: "3V3"}.items()
        ]
        wires += [("3V3" if address >> bit & 1 else "GND", mux, pad) for bit, pad in enumerate((1, 2, 21))]
    for k in range(w["sensor_count"]):
        strip, channel = divmod(k, w["sensors_of_strip"])
        data = 4 + 2 * channel + (channel > 3)  # the eight channels' SD and SC by turns, with GND between
        wires += [(f"SDA{k}", f"M{strip}", data), (f"SCL{k}", f"M{strip}", data + 1), (f"SCL{k}", f"U{k}", 3)]
        pulls |= {f"SDA{k}": ohm["channel"], f"SCL{k}": ohm["channel"]}
    return wires, pulls


def ohms(text):
    value, unit = text.split()
    return float(value) * (1000 if unit == "kOhm" else 1)


def wrong_nets(descriptor, board):
    nets, pulls = expected(descriptor)
    found, errors = collections.defaultdict(set), []
    for pad, (*_, net) in board.pads.items():
        found[net].add(pad)
    for net in nets.keys() | found.keys() - {None}:
        own = {pad for pad in found[net] if pad[0][0] not in "RC"}
        if own != nets.get(net, set()):
            errors.append(f"{net} has pads too many or too few: {sorted(own ^ nets.get(net, set()))[:4]}")
    pulled, held = collections.defaultdict(list), set()
    for name, (*_, value) in board.parts.items():
        ends = [board.pads[name, pad][-1] for pad in "12"] if name[0] in "RC" else []
        if name[0] == "R":
            pulled[ends[0]].append(ohms(value) if ends[1] == "3V3" else ends[1])
        elif name[0] == "C":
            if ends != ["3V3", "GND"] or value != "100 nF":
                errors.append(f"{name} of {value} is between {ends}")
            own = board.pads[name, "1"]
            held |= {pad[0] for pad in found["3V3"] if math.dist(board.pads[pad][:2], own[:2]) < NEAR_mm}
    wrong_pulls = {net for net in pulls.keys() | pulled.keys() if pulled[net] != [pulls.get(net)]}
    errors += [f"{net} is pulled up by {pulled[net]}, not {pulls.get(net)} ohms" for net in wrong_pulls]
    alone = [part for part in board.parts if part[0] in "UM" and part not in held]
    return errors + [f"{part} has no capacitor within {NEAR_mm} mm of its supply" for part in alone]


def rises_ns(descriptor, board):
    """{net: its rise from 0.3 to 0.7 VDD} by pins and tracks, of a parallel board. The cable of a multiplexed one is not known."""
    pulls = expected(descriptor)[1] if descriptor["bus"] == "parallel" else {}
    pF = collections.Counter()
    for (part, _), (*_, net) in board.pads.items():
        pF[net] += PIN_pF * (part[0] in "UA")
    for x0, y0, x1, y1, _, net, _ in board.tracks:
        pF[net] += TRACK_pF_mm * math.dist((x0, y0), (x1, y1))
    return {net: 0.847 * ohm * pF[net] / 1000 for net, ohm in pulls.items()}


def places(board, sensors):
    """{(part, pad): where it must be}: of the sensors, and of a Pico on the back, USB at the top, from where its middle is."""
    found = {(f"U{k}", pad): (x + dx, dy - y) for k, (x, y) in enumerate(sensors) for pad, (dx, dy) in PADS_mm.items()}
    for x, y, *_ in [place for name, place in board.parts.items() if name == "A0"]:
        for first, side in ((1, 1), (21, -1)):
            found |= {("A0", str(first + n)): (x + side * PICO_mm[0], y + side * PICO_mm[1] * (n - 9.5)) for n in range(20)}
    return found


def wrong_places(board, sensors):
    errors, measures = [], mould.measures(sensors)
    for pad, place in places(board, sensors).items():
        off = math.dist(board.pads.get(pad, (math.inf, math.inf))[:2], place)
        if off > 0.001:
            errors.append(f"pad {pad[1]} of {pad[0]} is {off:.3f} mm off")
    for k, (x, y) in enumerate(sensors):
        errors += [f"a via under sensor {k}" for vx, vy in board.vias if max(abs(vx - x), abs(vy + y)) < VIA_FREE_mm]
    holes, pico = [(x, -y, mould.SCREW_mm) for x, y in measures.screws], board.parts.get("A0")
    holes += [(pico[0] + side * x, pico[1] + y, mm) for x, y, mm in LEGS_mm for side in (-1, 1) if pico]
    if sorted(board.holes) != sorted(holes):
        errors.append("the holes are not those of the base plate and of the Pico")
    if board.outline != tuple(tuple(sign * mm / 2 for mm in measures.outside) for sign in (-1, 1)):
        errors.append(f"the outline is {board.outline}, not the base plate's")
    tracks = [tuple(sorted((track[:2], track[2:4]))) + track[4:] for track in board.tracks]
    return errors + [f"two tracks lie on each other at {track[0]}" for track in sorted(set(tracks)) if tracks.count(track) > 1]


def wrong(text, descriptor, sensors):
    """What is wrong, a line each."""
    board = Board(text)
    slow = {net: ns for net, ns in rises_ns(descriptor, board).items() if ns > descriptor["rise_ns"][net[:3].lower()]}
    slow = [f"{net} rises in {ns:.0f} ns, more than its rise_ns" for net, ns in slow.items()]
    return slow + wrong_nets(descriptor, board) + wrong_places(board, sensors)
