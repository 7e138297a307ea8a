"""Every kind of error that is planted in a circuit board is found, by the check of nets and places (Pcb) or by KiCad (Copper; exit status 77 without it)."""

import collections
import dataclasses
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
sys.path[:0] = [str(ROOT / "boards/drawing"), str(ROOT / "tests/support")]
import figures as figures_file  # noqa: E402
import geometry  # noqa: E402
import pcb_check  # noqa: E402

try:
    import fabricate  # noqa: E402
    import pcbnew  # noqa: E402
except ImportError:
    pcbnew = None

PART = r'  \(footprint "[^"]*" \(layer "[FB].Cu"\) \(at [^)]*\) \(attr [^)]*\)\n    \(fp_text reference "%s".*?\n  \)\n'


def part(name, change):
    """Changes one part's text."""
    return lambda text: re.sub(PART % name, lambda found: change(found[0]), text, flags=re.DOTALL)


def moved(dx, dy):
    return lambda text: re.sub(r"\(at ([\d.]+) ([\d.]+)", lambda at: f"(at {float(at[1]) + dx:g} {float(at[2]) + dy:g}", text, count=1)


def exchanged(a, b):
    return lambda text: text.replace(f'"{a}"', '"@"').replace(f'"{b}"', f'"{a}"').replace('"@"', f'"{b}"')


def replaced(old, new, count=1):
    return lambda text: re.sub(old, new, text, count=count)


def added(line):
    return lambda text: text.rstrip()[:-1] + f"  {line}\n)\n"


TRACK = '(segment (start %s) (end %s) (width %g) (layer "%s.Cu") (net %d))'
VIA = '(via (at 101.9 101.9) (size 0.6) (drill %g) (layers "F.Cu" "B.Cu") (net 2))'
MIRRORED = lambda text: re.sub(r"(\(pad .*?\(at )(-?[\d.]+)", lambda at: f"{at[1]}{-float(at[2]):g}", text)
NETS_AND_PLACES = {
    "parallel": {
        "a sensor moved by 2 um": part("U3", moved(0, 0.002)),
        "a sensor mirrored": part("U7", MIRRORED),
        "a sensor's mark at pad 3": part("U7", replaced(r"\(center (\S+) (\S+)\) \(end", r"(center 1.35 \2) (end")),
        "a sensor of another kind": replaced('"MS5840-02BA"', '"MS5837-30BA"', 0),
        "SDA and SCL of a sensor exchanged": part("U2", exchanged("3", "4")),
        "two sensors exchanged": exchanged("U0", "U1"),
        "two sensors on one data line": part("U3", replaced("SDA3", "SDA4")),
        "the Pico mirrored": part("A0", MIRRORED),
        "a capacitor missing": part("C4", lambda _: ""),
        "a capacitor 4.01 mm from its sensor": part("C4", moved(-1.6, 0)),
        "a resistor missing": part("R5", lambda _: ""),
        "a resistor of the next value": part("R5", replaced("3.3 kOhm", "3.6 kOhm")),
        "two tracks on each other": replaced(r"(  \(segment .*\n)", r"\1\1"),
        "a via at the corner of a sensor": added(VIA % 0.3),
        "a hole elsewhere": part("H1", moved(0.01, 0)),
        "another outline": replaced(r"\(end 129 138\)", "(end 129 137.99)"),
    },
    "multiplexed": {
        "SDA and SCL of a multiplexer exchanged": part("M1", exchanged("22", "23")),
        "two multiplexers at one address": part("M1", replaced('"3V3"', '"GND"')),
        "a multiplexer without its capacitor": part("C16", lambda _: ""),
        "two wires of the connector exchanged": part("X0", exchanged("2", "3")),
    },
}
ORDERED = {
    "a smaller resistor": replaced("RC0603", "RC0402"),
    "a resistor of another value ordered": replaced("-073K3L", "-073K6L"),
    "another sensor ordered": replaced("MS5840-02BA01", "MS583730BA01-50"),
    "a part not ordered": replaced("U3,", ""),
}
COPPER = {  # each named by what finds it: a word of KiCad's rule check, or lands_off
    "parallel": {
        "unconnected_items: a track is missing": replaced(r"  \(segment .*\n", ""),
        "clearance: a track between two lines": added(TRACK % ("91 81", "100 81", 0.25, "F", 3)),
        "items_not_allowed: a track under a screw": added(TRACK % ("122.75 98", "122.75 102", 0.25, "B", 2)),
        "items_not_allowed: a track under a test point of the Pico": added(TRACK % ("102.1 93", "102.1 94", 0.25, "B", 2)),
        "items_not_allowed: a via at the corner of a sensor": added(VIA % 0.3),
        "drill_out_of_range: a via too narrow to drill": added(VIA % 0.2),
        "courtyards_overlap: a part on another": part("C4", moved(0.74, 0)),
        "silk_over_copper: print on a pad": part("U7", replaced(r"\(at 0 -2.55\)", "(at 1 -1)")),
        "lands_off: a part of the front mirrored": part("U7", MIRRORED),
        "lands_off: a pad without paste": part("R5", replaced(' "F.Paste"', "")),
    },
    "multiplexed": {
        "copper_edge_clearance: a track 0.48 mm from the edge": added(TRACK % ("71.6 120", "71.6 121", 0.25, "B", 2)),
        "track_width: a thin track": added(TRACK % ("72 120", "72 121", 0.24, "B", 2)),
        "lands_off: the connector mirrored": part("X0", MIRRORED),
        "lands_off: pads of another size": part("X0", replaced(r"\(size 0.6 1.55\)", "(size 0.598 1.55)")),
    },
}
DESCRIPTORS = {
    "parallel": {"wiring": {"pin_scl": 16, "pin_sync": 21}, "pull_ups_ohm": {"sda": 3600, "scl": 1100}, "rise_ns": {"scl": 147}},
    "multiplexed": {"wiring": {"mux_address_0": "0x71"}, "pull_ups_ohm": {"bus": 2400, "channel": 30000, "reset": 9100}},
}
FOLDERS = {json.loads(path.with_name("board.json").read_text(encoding="utf-8"))["bus"]: path for path in ROOT.glob("boards/*/pcb")}
BOARDS = {bus: json.loads(path.with_name("board.json").read_text(encoding="utf-8")) for bus, path in FOLDERS.items()}
TEXTS, BOMS = (
    {bus: next(path.glob(f"*{end}")).read_text(encoding="utf-8") for bus, path in FOLDERS.items()} for end in (".kicad_pcb", "-bom.csv")
)
PAD = geometry.pad(ROOT / "boards/pads/3x5.json")
ERRORS = [line for bus, text in TEXTS.items() for line in pcb_check.wrong(text, BOMS[bus], BOARDS[bus], PAD)]


def errors_of_plants():
    """{what was planted: what the check of nets, places and orders finds}"""
    wider = dataclasses.replace(PAD, places=[(1.0002 * x, y) for x, y in PAD.places])
    found = {"another pitch": pcb_check.wrong(TEXTS["parallel"], BOMS["parallel"], BOARDS["parallel"], wider)}
    for name, plant in ORDERED.items():
        found[name] = pcb_check.wrong(TEXTS["parallel"], plant(BOMS["parallel"]), BOARDS["parallel"], PAD)
    for bus, board in BOARDS.items():
        found |= {name: pcb_check.wrong(plant(TEXTS[bus]), BOMS[bus], board, PAD) for name, plant in NETS_AND_PLACES[bus].items()}
        for section, plants in DESCRIPTORS[bus].items():
            for key, value in plants.items():
                other = board | {section: board[section] | {key: value}}
                found[f"{section}: {key} of {bus}"] = pcb_check.wrong(TEXTS[bus], BOMS[bus], other, PAD)
    return found


def lands_off(board):
    """Pads that differ from those of KiCad's own parts, which KiCad turns and flips: mirrored parts show in nothing else."""
    pads_of = lambda part: {(pad.GetName(), *pad.GetCenter(), *pad.GetSize(), *pad.GetLayerSet().Seq()) for pad in part.Pads()}
    off, scratch = 0, pcbnew.BOARD()  # flipping a part that is on no board crashes
    for ours in board.Footprints():
        library = pathlib.Path(f"/usr/share/kicad/footprints/{ours.GetFPID().GetLibNickname()}.pretty")
        if library.is_dir():
            other = pcbnew.FootprintLoad(str(library), str(ours.GetFPID().GetLibItemName()))
            scratch.Add(other)
            other.SetPosition(ours.GetPosition())
            if ours.IsFlipped():
                other.Flip(ours.GetPosition(), True)
            other.SetOrientation(ours.GetOrientation())
            off += len(pads_of(other) ^ pads_of(ours))
    return off


def off_um(folder, board):
    """How far a pad of a sensor lies off in the Gerber of the front, and a hole in the drill files, at most."""
    (path,) = folder.glob("*.zip")
    with zipfile.ZipFile(path) as files:
        copper, *drills = (files.read(name).decode() for name in sorted(files.namelist()) if name.endswith(("F_Cu.gbr", ".drl")))
    flashes = re.findall(r"%TO\.P,(U\d+),(\d)[^%]*%\n(?:%[^\n]*\n|D\d+\*\n)*X(-?\d+)Y(-?\d+)D03", copper)
    pads = {(part, pad): (int(x) / 1e6, int(y) / 1e6) for part, pad, x, y in flashes}
    pairs = [(pads[pad], (x, -y)) for pad, (x, y) in pcb_check.places(board, PAD).items() if pad[0] != "A0"]
    holes = sorted((float(x), float(y)) for drill in drills for x, y in re.findall(r"^X(-?[\d.]+)Y(-?[\d.]+)$", drill, re.MULTILINE))
    pairs += zip(holes, sorted([(x, -y) for x, y, *_ in board.holes + board.vias]), strict=True)
    return 1000 * max(math.dist(*pair) for pair in pairs)


class Pcb(unittest.TestCase):
    def test_boards_are_what_their_descriptors_say(self):
        self.assertEqual(ERRORS, [])

    def test_wrong_nets_and_places_are_found(self):
        self.assertEqual([name for name, errors in errors_of_plants().items() if not errors], [])


class Copper(unittest.TestCase):
    def judged(self, bus, plant=str):
        """{what KiCad finds on this board, with an error planted: how often}"""
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (path,) = shutil.copytree(FOLDERS[bus], folder / "pcb").glob("*.kicad_pcb")
        path.write_text(plant(TEXTS[bus]), encoding="utf-8")
        board, found = fabricate.judged(path, report := folder / "report")
        kinds = collections.Counter(re.findall(r"^\[(\w+)\]", report.read_text(encoding="utf-8"), re.MULTILINE))
        return found | kinds | {"lands_off": lands_off(board)}

    def test_wrong_copper_is_found_by_kicad(self):
        right = [self.judged(bus) for bus in FOLDERS]
        found = errors_of_plants()
        found |= {name: self.judged(bus, plant).get(name.split(":")[0]) for bus in FOLDERS for name, plant in COPPER[bus].items()}
        one, two = (pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) for _ in range(2))
        self.assertEqual([fabricate.main([folder]) for folder in (one, two)], [0, 0])
        boards = {bus: pcb_check.Board(text) for bus, text in TEXTS.items()}
        differ = [path for path in one.rglob("*.*") if path.read_bytes() != (two / path.relative_to(one)).read_bytes()]
        figures = {key: sum(board[key] for board in right) for key in right[0]} | {
            "boards": len(FOLDERS),
            "netlist_errors": len(ERRORS),
            "vias_under_sensors": sum(line.startswith("a via under") for line in ERRORS),
            "pad_places_off_um": max(off_um(one / path.parent.name, boards[bus]) for bus, path in FOLDERS.items()),
            "rise_ns": {net: round(ns) for net, ns in pcb_check.rises_ns(BOARDS["parallel"], boards["parallel"]).items()},
            "planted": len(found),
            "planted_missed": sum(not errors for errors in found.values()),
            "bytes_differ": len(differ),
        }
        figures_file.add(ROOT / "build/report/board.json", figures)
        self.assertEqual([name for name, errors in found.items() if not errors], [])
        nothing = {name: value for name, value in figures.items() if name not in ("boards", "planted", "rise_ns")}
        self.assertEqual(nothing, dict.fromkeys(nothing, 0), ERRORS)


if __name__ == "__main__":
    if "Copper" in sys.argv and not pcbnew:
        sys.exit(77)
    unittest.main()
