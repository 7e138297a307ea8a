"""Whether a circuit board is what its descriptor says: nets of all pads, values, places, holes, order numbers. Reads the KiCad file as text.

That the copper connects what the nets say, and nothing else, is for KiCad's design rule check (checks.pcb_copper).
"""

import collections
import csv
import json
import math
import re

import mould
import pico
from wiring import ohms

VIA_FREE_mm = 1.95  # around a sensor's middle, each way
NEAR_mm = 4  # a capacitor to its part, from pad to pad
PIN_pF, TRACK_pF_mm = 10, 0.1  # a pin, as UM10204 allows at most; a track over a plane 1.6 mm below (a guess: none was measured)
PADS_mm = {"1": (-1, -1), "2": (-1, 1), "3": (1, 1), "4": (1, -1)}  # of a sensor, from its middle; y down
PICO_mm = 17.78 / 2 + 0.9, 2.54  # its pads' rows on the back, USB at the top: from its middle, and pitch
# Order numbers: what the name of the part's land has, and its value; of a resistor the group has it.
ORDERS = {
    r"MS5840-02BA01": ("MS5837-xxBA", "MS5840-02BA"),
    r"MS583730BA01-50": ("MS5837-xxBA", "MS5837-30BA"),
    r"TCA9548APWR": ("TSSOP-24_4.4x7.8mm_P0.65mm", "TCA9548A"),
    r"SM08B-SRSS-TB": ("SM08B-SRSS-TB", "JST SH 8"),
    r"GRM188\w{4}104\w*": ("C_0603_1608Metric", "100 nF"),
    r"RC0603FR-07(\d+)([RK])(\d*)L": ("R_0603_1608Metric", ""),
    r"SC0915": ("pico", "Raspberry Pi Pico"),
}
LEGS_mm = (2.725, -24, 2.2), (2.425, -20.97, 1.85)  # holes for those of its USB socket, on both sides of its middle


def parsed(text):
    """A list of lists of words."""
    words = re.findall(r'"[^"]*"|[()]|[^\s()]+', text)
    lists = "".join({"(": "[", ")": "],"}.get(word) or json.dumps(word.strip('"')) + "," for word in words)
    return json.loads(lists.replace(",]", "]").rstrip(","))


def all_of(node, name):
    return [child for child in node if isinstance(child, list) and child[0] == name]


def numbers(node, name):
    return [float(word) for word in all_of(node, name)[0][1:] if re.fullmatch(r"-?[\d.]+", word)]


class Board:
    """Millimetres from the board's middle, x to the right and y down, seen from the front.

    pads: {(part, pad): (x, y, width, height, net or None)}; parts: {name: (x, y, turn in degrees, whether on the back, value)}; lands: {name: KiCad's
    name}; dots: {name: (x, y)} of what marks a pad;
    tracks: [(x0, y0, x1, y1, width, net, layer)]; vias: [(x, y)]; holes: [(x, y, diameter)]; outline: two corners.
    """

    def __init__(self, text):
        tree = parsed(text)
        self.middle = numbers(all_of(tree, "setup")[0], "aux_axis_origin")
        self.pads, self.parts, self.lands, self.dots, self.holes = {}, {}, {}, {}, []
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
        self.lands[name] = part[1]
        turned = lambda x, y: [(x, y), (y, -x), (-x, -y), (-y, x)][turns]
        for dot in all_of(part, "fp_circle"):
            dx, dy = turned(*numbers(dot, "center"))
            self.dots[name] = x + dx, y + dy
        for pad in all_of(part, "pad"):
            dx, dy = turned(*numbers(pad, "at")[:2])
            w, h = numbers(pad, "size")[:: -1 if turns % 2 else 1]
            if pad[2] == "np_thru_hole":
                self.holes.append((x + dx, y + dy, w))
            else:
                net = all_of(pad, "net")
                again = "+" * ((name, pad[1]) in self.pads)
                self.pads[name, pad[1] + again] = (x + dx, y + dy, w, h, net[0][2] if net else None)


def expected(descriptor):
    """{(part, pad): net}, without resistors and capacitors, whose names are free; and what pulls which net up, in ohms."""
    w = descriptor["wiring"]
    wires, pulls = (of_parallel if descriptor["bus"] == "parallel" else of_multiplexed)(w, descriptor["pull_ups_ohm"])
    for k in range(w["sensor_count"]):
        wires |= {(f"U{k}", 1): "GND", (f"U{k}", 2): "3V3", (f"U{k}", 4): f"SDA{k}"}
    return {(part, str(pad)): net for (part, pad), net in wires.items()}, pulls


def of_parallel(w, ohm):
    count = range(w["sensor_count"])
    pins = {"3V3": "3V3", "AGND": "GND", f"GP{w['pin_scl']}": "SCL"} | {f"GP{k}": f"SDA{k}" for k in count}
    wires = {("A0", pin): "GND" for pin in pico.grounds()} | {("A0", pico.pin(name)): net for name, net in pins.items()}
    if "pin_sync" in w:
        wires |= {("A0", pico.pin(f"GP{w['pin_sync']}")): "SYNC", ("J0", 1): "SYNC"}
    return wires | {(f"U{k}", 3): "SCL" for k in count}, {"SCL": ohm["scl"]} | {f"SDA{k}": ohm["sda"] for k in count}


def of_multiplexed(w, ohm):
    wires = {("X0", pad): net for pad, net in {1: "GND", 2: "3V3", 3: "SDA", 4: "SCL", 8: "GND", "MP": "GND", "MP+": "GND"}.items()}
    pulls = {"SDA": ohm["bus"], "SCL": ohm["bus"]}
    for strip in range(-(-w["sensor_count"] // w["sensors_of_strip"])):
        mux, reset, address = f"M{strip}", f"RESET{strip}", int(w["mux_address_0"], 0) + strip
        pulls[reset] = ohm["reset"]
        wires |= {("X0", 5 + strip): reset} | {
            (mux, pad): net for pad, net in {3: reset, 12: "GND", 22: "SCL", 23: "SDA", 24: "3V3"}.items()
        }
        wires |= {(mux, pad): "3V3" if address >> bit & 1 else "GND" for bit, pad in enumerate((1, 2, 21))}
    for k in range(w["sensor_count"]):
        strip, channel = divmod(k, w["sensors_of_strip"])
        data = 4 + 2 * channel + (channel > 3)  # the eight channels' SD and SC by turns, with GND between
        wires |= {(f"M{strip}", data): f"SDA{k}", (f"M{strip}", data + 1): f"SCL{k}", (f"U{k}", 3): f"SCL{k}"}
        pulls |= {f"SDA{k}": ohm["channel"], f"SCL{k}": ohm["channel"]}
    return wires, pulls


def wrong_nets(descriptor, board):
    wires, pulls = expected(descriptor)
    nets = {pad: net for pad, (*_, net) in board.pads.items() if net}
    chips, small = [name for name in board.parts if name[0] in "UM"], [name for name in board.parts if name[0] in "RC"]
    wrong = {pad for pad, _ in wires.items() ^ nets.items() if pad[0] not in small}
    between = collections.Counter((board.parts[name][-1], nets.get((name, "1")), nets.get((name, "2"))) for name in small)
    wanted = collections.Counter({("100 nF", "3V3", "GND"): len(chips)} | {(ohms(ohm), net, "3V3"): 1 for net, ohm in pulls.items()})
    errors = [f"pad {pad} of {part} is on {nets.get((part, pad))}, not {wires.get((part, pad))}" for part, pad in wrong]
    errors += [
        f"{between[each]} parts are {each}, not {wanted[each]}" for each in between.keys() | wanted.keys() if between[each] != wanted[each]
    ]
    held = [board.pads[name, "1"][:2] for name in small if name[0] == "C"]
    near = {pad[0] for pad, net in nets.items() if net == "3V3" and any(math.dist(board.pads[pad][:2], place) < NEAR_mm for place in held)}
    return errors + [f"{part} has no capacitor within {NEAR_mm} mm of its supply" for part in chips if part not in near]


def ordered(order):
    """What the name of its land has, and its value."""
    for number, (land, value) in ORDERS.items():
        if found := re.fullmatch(number, order):
            whole, unit, rest = found.groups() or "0R0"
            return land, value or ohms(float(f"{whole}.{rest}") * (1000 if unit == "K" else 1))
    return "nothing", ""


def wrong_orders(board, bom):
    """Order numbers of other packages or values; parts without one, or with two; marks that are not at pad 1."""
    errors, rows = [], list(csv.reader(bom.splitlines()[1:]))
    for value, _, order, names in rows:
        land, of = ordered(order)
        there = [name for name in names.split(",") if name in board.parts]
        errors += [f"{order} is not {name}" for name in there if land not in board.lands[name] or not of == value == board.parts[name][-1]]
    if sorted(name for *_, names in rows for name in names.split(",")) != sorted(
        name for name, (*_, value) in board.parts.items() if value
    ):
        errors.append("not each part is ordered once")
    pads = {part: [pad for pad in board.pads if pad[0] == part] for part in board.parts}
    marked = {part: min(pads[part], key=lambda pad: math.dist(board.pads[pad][:2], dot))[1] for part, dot in board.dots.items()}
    return errors + ["a mark is not at pad 1"] * (marked != {part: "1" for part, own in pads.items() if len(own) > 2})


def rises_ns(descriptor, board):
    """{net: its rise from 0.3 to 0.7 VDD} by pins and tracks, of a parallel board. The cable of a multiplexed one is not known."""
    pulls = expected(descriptor)[1] if descriptor["bus"] == "parallel" else {}
    pF = collections.Counter()
    for (part, _), (*_, net) in board.pads.items():
        pF[net] += PIN_pF * (part[0] in "UA")
    for x0, y0, x1, y1, _, net, _ in board.tracks:
        pF[net] += TRACK_pF_mm * math.dist((x0, y0), (x1, y1))
    return {net: 0.847 * ohm * pF[net] / 1000 for net, ohm in pulls.items()}


def places(board, pad):
    """{(part, pad): where it must be}: of the sensors, and of a Pico on the back, USB at the top, from where its middle is."""
    found = {(f"U{k}", name): (x + dx, dy - y) for k, (x, y) in enumerate(pad.places) for name, (dx, dy) in PADS_mm.items()}
    for x, y, *_ in [place for name, place in board.parts.items() if name == "A0"]:
        for first, side in ((1, 1), (21, -1)):
            found |= {("A0", str(first + n)): (x + side * PICO_mm[0], y + side * PICO_mm[1] * (n - 9.5)) for n in range(20)}
    return found


def wrong_places(board, pad):
    errors, measures = [], mould.measures(pad)
    for (part, name), place in places(board, pad).items():
        off = math.dist(board.pads.get((part, name), (math.inf, math.inf))[:2], place)
        if off > 0.001:
            errors.append(f"pad {name} of {part} is {off:.3f} mm off")
    for k, (x, y) in enumerate(pad.places):
        errors += [f"a via under sensor {k}" for vx, vy in board.vias if max(abs(vx - x), abs(vy + y)) < VIA_FREE_mm]
    holes, pico = [(x, -y, mould.SCREW_mm) for x, y in measures.screws], board.parts.get("A0")
    holes += [(pico[0] + side * x, pico[1] + y, mm) for x, y, mm in LEGS_mm for side in (-1, 1) if pico]
    if sorted(board.holes) != sorted(holes):
        errors.append("the holes are not those of the base plate and of the Pico")
    if board.outline != tuple(tuple(sign * mm / 2 for mm in measures.outside) for sign in (-1, 1)):
        errors.append(f"the outline is {board.outline}, not the base plate's")
    tracks = [tuple(sorted((track[:2], track[2:4]))) + track[4:] for track in board.tracks]
    return errors + [f"two tracks lie on each other at {track[0]}" for track in sorted(set(tracks)) if tracks.count(track) > 1]


def wrong(text, bom, descriptor, pad):
    """What is wrong, a line each."""
    board = Board(text)
    kinds = {value for name, (*_, value) in board.parts.items() if name[0] == "U"}
    slow = {net: ns for net, ns in rises_ns(descriptor, board).items() if ns > descriptor["rise_ns"][net[:3].lower()]}
    slow = [f"{net} rises in {ns:.0f} ns, more than its rise_ns" for net, ns in slow.items()]
    others = [f"the sensors are {value}, not {pad.part}" for value in kinds - {pad.part}]
    return slow + others + wrong_nets(descriptor, board) + wrong_places(board, pad) + wrong_orders(board, bom)
