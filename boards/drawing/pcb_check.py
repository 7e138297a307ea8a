"""Whether a circuit board is what its descriptor says: nets of all pads, values, places, holes, order numbers. Reads the KiCad file as text.

That the copper connects what the nets say, and nothing else, is for KiCad's design rule check (checks.pcb_copper).
"""

import collections
import csv
import math
import re

import mould
import pico
from wiring import ohms

VIA_FREE_mm, VIA_mm = 1.95, 0.3  # around a sensor's middle, each way; a via's radius
NEAR_mm = 4  # a capacitor to its part, from pad to pad
PIN_pF, TRACK_pF_mm = 10, 0.1  # a pin, as UM10204 allows at most; a track over a plane 1.6 mm below (a guess: none was measured)
PADS_mm = {"1": (-1, -1), "2": (-1, 1), "3": (1, 1), "4": (1, -1)}  # of a sensor, from its middle; y down
PICO_mm = 17.78 / 2 + 0.9, 2.54  # its pads' rows on the back, USB at the top: from its middle, and pitch
SIZES_mm = {"U": (1.3, 1.3), "A": (3.5, 1.7)}  # of the pads of these
# Order numbers: what the name of the part's land has, and its value.
ORDERS = {
    "MS5840-02BA01": ("MS5837-xxBA", "MS5840-02BA"),
    "MS583730BA01-50": ("MS5837-xxBA", "MS5837-30BA"),
    "TCA9548APWR": ("TSSOP-24_4.4x7.8mm_P0.65mm", "TCA9548A"),
    "SM08B-SRSS-TB": ("SM08B-SRSS-TB", "JST SH 8"),
    r"GRM188\w{4}104\w*": ("C_0603_1608Metric", "100 nF"),
    "SC0915": ("pico", "Raspberry Pi Pico"),
}
RESISTOR = r"RC0603FR-07(\d+)([RK])(\d*)L"
LEGS_mm = (2.725, -24, 2.2), (2.425, -20.97, 1.85)  # holes for those of its USB socket, on both sides of its middle


def parsed(text):
    """Of "(name words (name ...))": {"": words, name: [the same of each such list]}."""
    nodes = [collections.defaultdict(list)]
    for name, end, word in re.findall(r'\((\w+)|(\))|("[^"]*"|[^\s()]+)', text):
        if name:
            nodes.append(collections.defaultdict(list))
            nodes[-2][name].append(nodes[-1])
        elif end:
            nodes.pop()
        else:
            nodes[-1][""].append(word.strip('"'))
    return nodes[0]


numbers = lambda node, name: [float(word) for word in node[name][0][""]]


class Board:
    """Millimetres from the board's middle, x to the right and y down, seen from the front. pads: {(part, pad): (x, y, width, height, net or None)};
    parts: {name: (x, y, turn in degrees, whether on the back, value)}; lands: {name: KiCad's}; dots: {name: (x, y)} of a mark on its part's side;
    tracks: [(x0, y0, x1, y1, width, net, layer)]; vias, picos: [(x, y)]; holes: [(x, y, diameter)]; outline: two corners."""

    def __init__(self, text):
        (tree,) = parsed(text)["kicad_pcb"]
        self.middle = numbers(tree["setup"][0], "aux_axis_origin")
        self.pads, self.parts, self.lands, self.dots, self.holes = {}, {}, {}, {}, []
        for part in tree["footprint"]:
            self.read_part(part)
        self.picos = [place[:2] for name, place in self.parts.items() if name == "A0"]
        nets, at = dict(net[""] for net in tree["net"]), self.place
        ends = lambda track: (*at(track, "start"), *at(track, "end"), *numbers(track, "width"))
        self.tracks = [(*ends(track), nets[track["net"][0][""][0]], *track["layer"][0][""]) for track in tree["segment"]]
        self.vias = [at(via, "at") for via in tree["via"]]
        self.outline = next(((at(line, "start"), at(line, "end")) for line in tree["gr_rect"]), None)

    def place(self, node, name):
        x, y, *_ = numbers(node, name)
        return round(x - self.middle[0], 6), round(y - self.middle[1], 6)

    def read_part(self, part):
        (x, y), turns = self.place(part, "at"), int(sum(numbers(part, "at")[2:])) // 90
        texts = dict(text[""] for text in part["fp_text"])
        name = texts["reference"]
        self.parts[name] = (x, y, 90 * turns, part["layer"][0][""] == ["B.Cu"], texts["value"])
        (self.lands[name],) = part[""]
        turned = lambda dx, dy, *_: [(x + dx, y + dy), (x + dy, y - dx), (x - dx, y - dy), (x - dy, y + dx)][turns]
        shown = [dot for dot in part["fp_circle"] if (dot["layer"][0][""] == ["B.SilkS"]) == self.parts[name][3]]
        self.dots |= {name: turned(*numbers(dot, "center")) for dot in shown}
        for pad in part["pad"]:
            place, size = turned(*numbers(pad, "at")), numbers(pad, "size")[:: -1 if turns % 2 else 1]
            number, kind, _ = pad[""]
            if kind == "np_thru_hole":
                self.holes.append((*place, *numbers(pad, "drill")))
            else:
                again = "+" * ((name, number) in self.pads)
                self.pads[name, number + again] = (*place, *size, pad["net"][0][""][1] if pad["net"] else None)


def expected(descriptor):
    """{(part, pad): net}, without resistors and capacitors, whose names are free; and what pulls which net up, in ohms."""
    w, of = descriptor["wiring"], of_parallel if descriptor["bus"] == "parallel" else of_multiplexed
    wires, pulls = of(w, descriptor["pull_ups_ohm"], range(w["sensor_count"]))
    if "strip_mm" in descriptor:
        wires = {"X0": dict(enumerate(("GND", "3V3", *pulls), 1))}
    for k in range(w["sensor_count"]):
        wires[f"U{k}"] = {1: "GND", 2: "3V3", 3: f"SCL{k}" if f"SCL{k}" in pulls else "SCL", 4: f"SDA{k}"}
    return {(part, str(pad)): net for part, own in wires.items() for pad, net in own.items()}, pulls


def of_parallel(w, ohm, sensors):
    pins = {"3V3": "3V3", "AGND": "GND", f"GP{w['pin_scl']}": "SCL", f"GP{w['pin_sync']}": "SYNC"} | {f"GP{k}": f"SDA{k}" for k in sensors}
    wires = {"A0": dict.fromkeys(pico.grounds(), "GND") | {pico.pin(name): net for name, net in pins.items()}, "J0": {1: "SYNC"}}
    return wires, {"SCL": ohm["scl"]} | {f"SDA{k}": ohm["sda"] for k in sensors}


def of_multiplexed(w, ohm, sensors):
    cable = dict.fromkeys((1, 8, "MP", "MP+"), "GND") | {2: "3V3", 3: "SDA", 4: "SCL"}
    wires, pulls = {"X0": cable}, dict.fromkeys(("SDA", "SCL"), ohm["bus"])
    for k in sensors:
        strip, channel = divmod(k, w["sensors_of_strip"])
        reset, address = f"RESET{strip}", int(w["mux_address_0"], 0) + strip
        levels = {pad: "3V3" if address >> bit & 1 else "GND" for bit, pad in enumerate((1, 2, 21))}
        mux = wires.setdefault(f"M{strip}", {3: reset, 12: "GND", 22: "SCL", 23: "SDA", 24: "3V3"} | levels)
        data = 4 + 2 * channel + (channel > 3)  # the eight channels' SD and SC by turns, with GND between
        mux |= {data: f"SDA{k}", data + 1: f"SCL{k}"}
        cable[5 + strip] = reset
        pulls |= {reset: ohm["reset"], f"SDA{k}": ohm["channel"], f"SCL{k}": ohm["channel"]}
    return wires, pulls


def wrong_nets(descriptor, board):
    wires, pulls = expected(descriptor)
    nets = {pad: net for pad, (*_, net) in board.pads.items() if net}
    chips, small = [name for name in board.parts if name[0] in "UM"], [name for name in board.parts if name[0] in "RC"]
    wrong = {pad for pad, _ in wires.items() ^ nets.items() if pad[0] not in small}
    between = collections.Counter((board.parts[name][-1], nets.get((name, "1")), nets.get((name, "2"))) for name in small)
    wanted = collections.Counter({("100 nF", "3V3", "GND"): len(chips)} | {(ohms(ohm), net, "3V3"): 1 for net, ohm in pulls.items()})
    errors = [f"pad {pad} of {part} is on {nets.get((part, pad))}, not {wires.get((part, pad))}" for part, pad in wrong]
    errors += [f"{between[each]} parts are {each}, not {wanted[each]}" for each in between | wanted if between[each] != wanted[each]]
    held = [board.pads[name, "1"][:2] for name in small if name[0] == "C"]
    near = {pad[0] for pad, net in nets.items() if net == "3V3" and any(math.dist(board.pads[pad][:2], place) < NEAR_mm for place in held)}
    return errors + [f"{part} has no capacitor within {NEAR_mm} mm of its supply" for part in chips if part not in near]


def ordered(order):
    """What the name of its land has, and its value."""
    if found := re.fullmatch(RESISTOR, order):
        return "R_0603_1608Metric", ohms(float(f"{found[1]}.{found[3]}") * {"R": 1, "K": 1000}[found[2]])
    return next((part for number, part in ORDERS.items() if re.fullmatch(number, order)), ("nothing", ""))


def wrong_orders(board, bom):
    """Order numbers of other packages or values; parts without one, or with two; marks that are not at pad 1."""
    rows = [(name, order, value) for value, names, _, _, order in csv.reader(bom.splitlines()[1:]) for name in names.split(",")]
    values = {name: value for name, (*_, value) in board.parts.items() if value}
    errors = ["not each part is ordered once"] * (sorted(name for name, *_ in rows) != sorted(values))
    for name, order, value in rows:
        land, of = ordered(order)
        errors += [f"{order} is not {name}"] * (land not in board.lands.get(name, "") or not of == value == values.get(name))
    pads = {part: [pad for pad in board.pads if pad[0] == part] for part in board.parts}
    marked = {part: min(pads[part], key=lambda pad: math.dist(board.pads[pad][:2], dot))[1] for part, dot in board.dots.items()}
    return errors + ["a mark is not at pad 1"] * (marked != {part: "1" for part, own in pads.items() if len(own) > 2})


def rises_ns(descriptor, board):
    """{net: its rise from 0.3 to 0.7 VDD} by pins and tracks, of a board that carries its Pico. Of others the cable is not known."""
    pulls = expected(descriptor)[1] if board.picos else {}
    pins, mm = collections.Counter(net for (part, _), (*_, net) in board.pads.items() if part[0] in "UA"), collections.Counter()
    for x0, y0, x1, y1, _, net, _ in board.tracks:
        mm[net] += math.dist((x0, y0), (x1, y1))
    return {net: round(0.847e-3 * ohm * (PIN_pF * pins[net] + TRACK_pF_mm * mm[net]), 1) for net, ohm in pulls.items()}


def places(board, pad):
    """{(part, pad): where it must be}: of the sensors, and of a Pico on the back, USB at the top, from where its middle is."""
    found = {(f"U{k}", name): (x + dx, dy - y) for k, (x, y) in enumerate(pad.places) for name, (dx, dy) in PADS_mm.items()}
    for x, y in board.picos:
        for first, side in ((1, 1), (21, -1)):
            found |= {("A0", str(first + n)): (x + side * PICO_mm[0], y + side * PICO_mm[1] * (n - 9.5)) for n in range(20)}
    return found


def wrong_places(board, pad):
    right = {key: place + SIZES_mm[key[0][0]] for key, place in places(board, pad).items()}
    off = {key: math.dist(board.pads.get(key, [math.inf] * 4)[:4], place) for key, place in right.items()}
    errors = [f"pad {name} of {part} is {mm:.3f} mm off, or as much wider or longer" for (part, name), mm in off.items() if mm > 0.001]
    for k, (x, y) in enumerate(pad.places):
        errors += [f"a via under sensor {k}" for vx, vy in board.vias if max(abs(vx - x), abs(vy + y)) < VIA_FREE_mm]
    for (part, name), (x, y, w, h, _) in board.pads.items():
        beside = lambda via: math.hypot(max(abs(via[0] - x) - w / 2, 0), max(abs(via[1] - y) - h / 2, 0))
        errors += [f"a via on pad {name} of {part}"] * (min(map(beside, board.vias)) < VIA_mm)
    measures = mould.measures(pad)
    holes = [(x, -y, mould.SCREW_mm) for x, y in measures.screws]
    holes += [(x + side * dx, y + dy, mm) for x, y in board.picos for dx, dy, mm in LEGS_mm for side in (-1, 1)]
    errors += ["the holes are not those of the base plate and of the Pico"] * (sorted(board.holes) != sorted(holes))
    outline = tuple(tuple(sign * mm / 2 for mm in measures.outside) for sign in (-1, 1))
    errors += [f"the outline is {board.outline}, not {outline}"] * (board.outline != outline)
    tracks = [tuple(sorted((track[:2], track[2:4]))) + track[4:] for track in board.tracks]
    return errors + [f"two tracks lie on each other at {track[0]}" for track in sorted(set(tracks)) if tracks.count(track) > 1]


def wrong(text, bom, descriptor, pad):
    """What is wrong, a line each."""
    board = Board(text)
    slow = [(net, ns) for net, ns in rises_ns(descriptor, board).items() if ns > descriptor["rise_ns"][net[:3].lower()]]
    errors = [f"{net} rises in {ns:.0f} ns, more than its rise_ns" for net, ns in slow]
    areas = collections.Counter(re.findall(r'net_name "(\w*)"\) \(layers (.*)\) \(hatch.*(fill yes|copperpour not)', text))
    both, screws = '"F.Cu" "B.Cu"', len(mould.measures(pad).screws)
    free = {("", '"B.Cu"', "copperpour not"): 4 * len(board.picos), ("", both, "copperpour not"): screws, ("GND", both, "fill yes"): 1}
    errors += [f"zones are {areas}, not {free}"] * (areas != collections.Counter(free))
    errors += ["print is not 1 mm high in lines of 0.15 mm"] * bool(re.search(r"SilkS.*\(font .(?!size 1 1. .thickness 0.15\))", text))
    errors += [f"{name} is {part[-1]}, not {pad.part}" for name, part in board.parts.items() if name[0] == "U" and part[-1] != pad.part]
    return errors + wrong_nets(descriptor, board) + wrong_places(board, pad) + wrong_orders(board, bom)
