"""Every kind of error that is planted in a circuit board is found, by the check of nets and places (Pcb) or by KiCad (Copper; exit status 77 without it)."""

import copy
import json
import math
import pathlib
import re
import shutil
import sys
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "boards/drawing"))
sys.path.insert(0, str(ROOT / "tests/support"))
import called  # noqa: E402
import draw  # noqa: E402
import figures as figures_file  # noqa: E402
import geometry  # noqa: E402
import pcb_check  # noqa: E402

PART = r'  \(footprint "[^"]*" \(layer "[FB].Cu"\) \(at [^)]*\) \(attr smd\)\n    \(fp_text reference "%s".*?\n  \)\n'


def part(name, change):
    """Changes one part's text."""
    return lambda text: re.sub(PART % name, lambda found: change(found[0]), text, flags=re.DOTALL)


def moved(dx, dy):
    return lambda text: re.sub(r"\(at ([\d.]+) ([\d.]+)", lambda at: f"(at {float(at[1]) + dx:g} {float(at[2]) + dy:g}", text, count=1)


def exchanged(a, b):
    return lambda text: text.replace(f'"{a}"', '"@"').replace(f'"{b}"', f'"{a}"').replace('"@"', f'"{b}"')


def pads_at(place):
    return lambda text: re.sub(r"(\(pad .*?\(at )(-?[\d.]+) (-?[\d.]+)", lambda at: f"{at[1]}{place(float(at[2]), float(at[3]))}", text)


def replaced(old, new, count=1):
    return lambda text: re.sub(old, new, text, count=count)


def added(line):
    return lambda text: text.rstrip()[:-1] + f"  {line}\n)\n"


TRACK = '(segment (start %s) (end %s) (width 0.25) (layer "%s.Cu") (net %d))'
VIA = '(via (at 100 100) (size 0.6) (drill 0.3) (layers "F.Cu" "B.Cu") (net 2))'
NETS_AND_PLACES = {
    "a sensor moved by 2 um": part("U3", moved(0, 0.002)),
    "a sensor turned": part("U7", pads_at(lambda x, y: f"{y:g} {-x:g}")),
    "a sensor mirrored": part("U7", pads_at(lambda x, y: f"{-x:g} {y:g}")),
    "SDA and SCL of a sensor exchanged": part("U2", exchanged("3", "4")),
    "supply and ground of a sensor exchanged": part("U2", exchanged("1", "2")),
    "two sensors exchanged": exchanged("U0", "U1"),
    "the Pico's rows too near": part("A0", pads_at(lambda x, y: f"{0.98 * x:g} {y:g}")),
    "two pins of the Pico exchanged": part("A0", exchanged("1", "2")),
    "a capacitor missing": part("C4", lambda _: ""),
    "a capacitor far away": part("C4", moved(-30, 0)),
    "a capacitor of another value": part("C4", replaced("100 nF", "10 nF")),
    "a resistor missing": part("R5", lambda _: ""),
    "a resistor of another value": part("R5", replaced("3.3 kOhm", "33 kOhm")),
    "a resistor on another line": part("R5", replaced("SDA5", "SDA6")),
    "the sync pad missing": part("J0", lambda _: ""),
    "two tracks on each other": replaced(r"(  \(segment .*\n)", r"\1\1"),
    "a via under a sensor": added(VIA),
    "a hole elsewhere": replaced(r"\(at 126 100\) \(attr exclude", "(at 125 100) (attr exclude"),
    "another outline": replaced(r"\(end 129 138\)", "(end 129 137)"),
}
MULTIPLEXED = {
    "SD and SC of a channel exchanged": part("M1", exchanged("4", "5")),
    "two multiplexers exchanged": exchanged("M0", "M1"),
    "an address pin on another level": part("M1", replaced('"3V3"', '"GND"')),
    "a multiplexer without its capacitor": part("C16", lambda _: ""),
    "two wires of the connector exchanged": part("X0", exchanged("2", "3")),
    "a pull-up of a channel missing": part("R7", lambda _: ""),
}
DESCRIPTORS = {
    "another pin of SCL": ("parallel", lambda board: board["wiring"].update(pin_scl=16)),
    "another sync pin": ("parallel", lambda board: board["wiring"].update(pin_sync=21)),
    "another pull-up of SDA": ("parallel", lambda board: board["pull_ups_ohm"].update(sda=4700)),
    "another pull-up of SCL": ("parallel", lambda board: board["pull_ups_ohm"].update(scl=2200)),
    "faster edges of SCL than the tracks allow": ("parallel", lambda board: board["rise_ns"].update(scl=140)),
    "another address": ("multiplexed", lambda board: board["wiring"].update(mux_address_0="0x74")),
    "another pull-up of the bus": ("multiplexed", lambda board: board["pull_ups_ohm"].update(bus=3300)),
    "another pull-up of a channel": ("multiplexed", lambda board: board["pull_ups_ohm"].update(channel=22000)),
    "another pull-up of RESET": ("multiplexed", lambda board: board["pull_ups_ohm"].update(reset=4700)),
}
COPPER = {
    "a track is missing": ("parallel", replaced(r"  \(segment .*\n", "")),
    "a via is missing": ("multiplexed", replaced(r"  \(via .*\n", "")),
    "a track between two lines": ("parallel", added(TRACK % ("91 81", "100 81", "F", 3))),
    "a track at the edge": ("multiplexed", added(TRACK % ("71.1 100", "71.1 110", "B", 2))),
    "a track under a screw": ("parallel", added(TRACK % ("123.5 98", "123.5 102", "B", 2))),
    "wide tracks": ("multiplexed", replaced(r"\(width 0.25\)", "(width 0.5)", 0)),
    "a via under a sensor": ("parallel", added(VIA)),
    "a part on another": ("parallel", part("C4", moved(2, 0))),
    "a part of the front mirrored": ("parallel", part("U7", pads_at(lambda x, y: f"{-x:g} {y:g}"))),
    "a part of the back mirrored": ("multiplexed", part("M1", pads_at(lambda x, y: f"{-x:g} {y:g}"))),
    "pads of another size": ("multiplexed", part("X0", replaced(r"\(size 0.6 1.55\)", "(size 0.5 1.55)"))),
}
FOLDERS = {json.loads(path.with_name("board.json").read_text(encoding="utf-8"))["bus"]: path for path in ROOT.glob("boards/*/pcb")}
BOARDS = {bus: json.loads(folder.with_name("board.json").read_text(encoding="utf-8")) for bus, folder in FOLDERS.items()}
TEXTS = {bus: next(folder.glob("*.kicad_pcb")).read_text(encoding="utf-8") for bus, folder in FOLDERS.items()}


def errors_of_boards():
    return [line for bus, text in TEXTS.items() for line in pcb_check.wrong(text, BOARDS[bus], geometry.places())]


def errors_of_plants():
    """{what was planted: what the check of nets and places finds}"""
    sensors, found = geometry.places(), {}
    for bus, plants in (("parallel", NETS_AND_PLACES), ("multiplexed", MULTIPLEXED)):
        found |= {name: pcb_check.wrong(plant(TEXTS[bus]), BOARDS[bus], sensors) for name, plant in plants.items()}
    for name, (bus, plant) in DESCRIPTORS.items():
        plant(spoilt := copy.deepcopy(BOARDS[bus]))
        found[name] = pcb_check.wrong(TEXTS[bus], spoilt, sensors)
    return found | {"another pitch": pcb_check.wrong(TEXTS["parallel"], BOARDS["parallel"], [(1.02 * x, y) for x, y in sensors])}


def laid_otherwise():
    return [path.name for path, text in draw.laid(ROOT).items() if path.read_text(encoding="utf-8") != text]


def differing(one, other):
    return [path for path in sorted(one.rglob("*.*")) if path.read_bytes() != (other / path.relative_to(one)).read_bytes()]


def off_um(folder, board, sensors):
    """How far a pad of a sensor lies off in the Gerber of the front, and a hole in the drill files, at most."""
    (path,) = folder.glob("*.zip")
    with zipfile.ZipFile(path) as files:
        copper, *drills = (files.read(name).decode() for name in sorted(files.namelist()) if name.endswith(("F_Cu.gbr", ".drl")))
    flashes = re.findall(r"%TO\.P,(U\d+),(\d)[^%]*%\n(?:%[^\n]*\n|D\d+\*\n)*X(-?\d+)Y(-?\d+)D03", copper)
    pads = {(part, pad): (int(x) / 1e6, int(y) / 1e6) for part, pad, x, y in flashes}
    wanted = {(f"U{k}", pad): (x + dx, y - dy) for k, (x, y) in enumerate(sensors) for pad, (dx, dy) in pcb_check.PADS_mm.items()}
    pairs = [(pads[pad], place) for pad, place in wanted.items()]
    holes = sorted((float(x), float(y)) for drill in drills for x, y in re.findall(r"^X(-?[\d.]+)Y(-?[\d.]+)$", drill, re.MULTILINE))
    pairs += zip(holes, sorted([(x, -y) for x, y, *_ in board.holes + board.vias]), strict=True)
    return 1000 * max(math.dist(*pair) for pair in pairs)


class Pcb(unittest.TestCase):
    def test_boards_are_what_their_descriptors_say(self):
        self.assertEqual(errors_of_boards(), [])

    def test_wrong_nets_and_places_are_found(self):
        self.assertEqual([name for name, errors in errors_of_plants().items() if not errors], [])


class Written(unittest.TestCase):
    def test_descriptors_give_these_bytes(self):
        self.assertEqual(laid_otherwise(), [])


class Copper(unittest.TestCase):
    def test_wrong_copper_is_found_by_kicad(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        plants = {f"none, {bus}": (bus, lambda text: text) for bus in FOLDERS} | COPPER
        for name, (bus, plant) in plants.items():
            shutil.copytree(FOLDERS[bus], folder / name)
            next((folder / name).glob("*.kicad_pcb")).write_text(plant(TEXTS[bus]), encoding="utf-8")
        boards = [next((folder / name).glob("*.kicad_pcb")) for name in plants]
        lines = called.run("/usr/bin/python3", ROOT / "tests/checks/kicad.py", *boards).splitlines()
        judged = dict(zip(plants, map(json.loads, lines), strict=True))
        right = [judged.pop(f"none, {bus}") for bus in FOLDERS]
        found = errors_of_plants() | {name: sum(figures.values()) for name, figures in judged.items()}
        for run in ("one", "two"):
            called.run("/usr/bin/python3", ROOT / "boards/drawing/fabricate.py", folder / run)
        sensors, boards = geometry.places(), {bus: pcb_check.Board(text) for bus, text in TEXTS.items()}
        errors = errors_of_boards()
        off = [off_um(folder / "one" / path.parent.name, boards[bus], sensors) for bus, path in FOLDERS.items()]
        figures = {key: sum(board[key] for board in right) for key in right[0]} | {
            "boards": len(FOLDERS),
            "netlist_errors": len(errors),
            "vias_under_sensors": sum(line.startswith("a via under") for line in errors),
            "pad_places_off_um": max(off),
            "rise_ns": {net: round(ns) for net, ns in pcb_check.rises_ns(BOARDS["parallel"], boards["parallel"]).items()},
            "planted": len(found),
            "planted_missed": sum(not errors for errors in found.values()),
            "bytes_differ": len(differing(folder / "one", folder / "two")) + len(laid_otherwise()),
        }
        figures_file.add(ROOT / "build/report/board.json", figures)
        self.assertEqual([name for name, errors in found.items() if not errors], [])
        nothing = {name: value for name, value in figures.items() if name not in ("boards", "planted", "rise_ns")}
        self.assertEqual(nothing, dict.fromkeys(nothing, 0), errors)
        self.assertGreaterEqual((figures["boards"], figures["planted"]), (2, 24))


if __name__ == "__main__":
    if "Copper" in sys.argv and not pathlib.Path("/usr/lib/python3/dist-packages/pcbnew.py").exists():
        sys.exit(77)
    unittest.main()
