"""Every kind of error that is planted in a circuit board is found, by the check of nets and places (Pcb) or by KiCad (Copper; exit status 77 without it)."""

import collections
import dataclasses
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
import figures  # noqa: E402
import geometry  # noqa: E402
import pcb_check  # noqa: E402

try:
    import fabricate  # noqa: E402, by KiCad's Python
except ImportError:
    fabricate = None

PART = r'  \(footprint "[^"]*" \(layer "[FB].Cu"\) \(at [^)]*\) \(attr [^)]*\)\n    \(fp_text reference "%s".*?\n  \)\n'
part = lambda name, change: lambda text: re.sub(PART % name, lambda found: change(found[0]), text, flags=re.DOTALL)
exchanged = lambda a, b: lambda text: text.replace(f'"{a}"', '"@"').replace(f'"{b}"', f'"{a}"').replace('"@"', f'"{b}"')
replaced = lambda old, new, count=1: lambda text: re.sub(old, new, text, count=count)
added = lambda line: lambda text: text.rstrip()[:-1] + f"  {line}\n)\n"


def described(section, **others):
    """Other figures in board.json, one at a time."""
    return {f"{section}: {key}": lambda right, own={key: other}: right | {section: right[section] | own} for key, other in others.items()}


TRACK = '(segment (start %s) (end %s) (width %g) (layer "%s.Cu") (net %d))'
VIA = '(via (at 101.9 101.9) (size 0.6) (drill %g) (layers "F.Cu" "B.Cu") (net 2))'
MIRRORED = lambda text: re.sub(r"(\(pad .*?\(at )(-?[\d.]+)", lambda at: f"{at[1]}{-float(at[2]):g}", text)
PLANTS = {
    ("pico_parallel", "text"): {
        "a sensor moved by 2 um": part("U3", replaced("at 91 91", "at 91 91.002")),
        "a sensor mirrored": part("U7", MIRRORED),
        "a sensor's mark at pad 3": part("U7", replaced(r"\(center (\S+) (\S+)\) \(end", r"(center 1.35 \2) (end")),
        "a sensor of another kind": replaced('"MS5840-02BA"', '"MS5837-30BA"', 0),
        "SDA and SCL of a sensor exchanged": part("U2", exchanged("3", "4")),
        "two sensors exchanged": exchanged("U0", "U1"),
        "two sensors on one data line": part("U3", replaced("SDA3", "SDA4")),
        "the Pico mirrored": part("A0", MIRRORED),
        "a pad of the Pico longer by 2 um": part("A0", replaced("3.5 1.7", "3.502 1.7")),
        "print too small": replaced(r'(SilkS"\) \(effects \(font \(size )1 1', r"\g<1>0.9 0.9"),
        "a capacitor missing": part("C4", lambda _: ""),
        "a capacitor 4.01 mm from its sensor": part("C4", replaced("at 87.6", "at 86")),
        "a resistor missing": part("R5", lambda _: ""),
        "a resistor of the next value": part("R5", replaced("3.3 kOhm", "3.6 kOhm")),
        "two tracks on each other": replaced(r"(  \(segment .*\n)", r"\1\1"),
        "a via at the corner of a sensor": added(VIA % 0.3),
        "a hole elsewhere": part("H1", replaced("at 74 100", "at 74.01 100")),
        "a smaller drill": part("H1", replaced(r"\(drill 3.2\)", "(drill 3)")),
        "a pad of the Pico under the mask": part("A0", replaced(r'(pad "5" .*) "B.Mask"', r"\1")),
        "a mask far from its pads": replaced("pad_to_mask_clearance 0.05", "pad_to_mask_clearance 0.3"),
        "the pour on one side": replaced(r'(net_name "GND"\) \(layers) "F.Cu"', r"\1"),
        "a pour of 3V3": replaced(r'\(zone \(net 2\) \(net_name "GND"', '(zone (net 1) (net_name "3V3"'),
        "copper under a test point of the Pico": replaced(r'  \(zone \(net 0\) \(net_name ""\) \(layers "B.Cu"\).*\n', ""),
        "copper under a screw": replaced(r'  \(zone \(net 0\) \(net_name ""\) \(layers "F.Cu" "B.Cu"\).*\n', ""),
        "another outline": replaced(r"\(end 129 138\)", "(end 129 137.99)"),
    },
    ("pico_mux", "text"): {
        "SDA and SCL of a multiplexer exchanged": part("M1", exchanged("22", "23")),
        "two multiplexers at one address": part("M1", replaced('"3V3"', '"GND"')),
        "a multiplexer without its capacitor": part("C16", lambda _: ""),
        "two wires of the connector exchanged": part("X0", exchanged("2", "3")),
    },
    ("pico_mux_4x4", "text"): {"a free wire of the connector on GND": part("X0", replaced(r'("7" .*)\)\)', r'\1) (net 1 "GND"))'))},
    ("pico_parallel_strip", "text"): {"two wires of a strip exchanged": part("X0", exchanged("2", "3"))},
    ("pico_parallel", "bom"): {
        "a smaller resistor": replaced("RC0603", "RC0402"),
        "a resistor of another value ordered": replaced("-073K3L", "-073K6L"),
        "another sensor ordered": replaced("MS5840-02BA01", "MS583730BA01-50"),
        "a part not ordered": replaced("U3,", ""),
    },
    ("pico_parallel", "descriptor"): described("wiring", pin_scl=16, pin_sync=21)
    | described("pull_ups_ohm", sda=3600, scl=1100)
    | described("rise_ns", scl=147),
    ("pico_mux", "descriptor"): described("wiring", mux_address_0="0x71") | described("pull_ups_ohm", bus=2400, channel=30000, reset=9100),
    ("pico_parallel", "pad"): {"another pitch": lambda pad: dataclasses.replace(pad, places=[(1.0002 * x, y) for x, y in pad.places])},
}
COPPER = {  # each named by what finds it: a word of KiCad's rule check, or lands_off
    "pico_parallel": {
        "unconnected_items: a track is missing": replaced(r"  \(segment .*\n", ""),
        "clearance: a track between two lines": added(TRACK % ("91 81", "100 81", 0.25, "F", 3)),
        "items_not_allowed: a track under a screw": added(TRACK % ("122.75 98", "122.75 102", 0.25, "B", 2)),
        "items_not_allowed: a track under a test point of the Pico": added(TRACK % ("102.1 93", "102.1 94", 0.25, "B", 2)),
        "items_not_allowed: a via at the corner of a sensor": added(VIA % 0.3),
        "drill_out_of_range: a via too narrow to drill": added(VIA % 0.2),
        "courtyards_overlap: a part on another": part("C4", replaced("at 87.6", "at 88.34")),
        "silk_over_copper: print on a pad": part("U7", replaced(r"\(at 0 -2.55\)", "(at 1 -1)")),
        "lands_off: a part of the front mirrored": part("U7", MIRRORED),
        "lands_off: a pad without paste": part("R5", replaced(' "F.Paste"', "")),
    },
    "pico_mux": {
        "copper_edge_clearance: a track 0.48 mm from the edge": added(TRACK % ("71.6 120", "71.6 121", 0.25, "B", 2)),
        "track_width: a thin track": added(TRACK % ("72 120", "72 121", 0.24, "B", 2)),
        "lands_off: the connector mirrored": part("X0", MIRRORED),
        "lands_off: pads of another size": part("X0", replaced(r"\(size 0.6 1.55\)", "(size 0.598 1.55)")),
    },
}
FOLDERS = {path.stem.removeprefix("fingertip-"): path.parent for path in ROOT.glob("boards/*/pcb*/*.kicad_pcb")}


def board_in(folder):
    """What pcb_check.wrong takes."""
    text, bom = (next(folder.glob(f"*{end}")).read_text(encoding="utf-8") for end in (".kicad_pcb", "-bom.csv"))
    descriptor = geometry.descriptor(folder)
    return {"text": text, "bom": bom, "descriptor": descriptor, "pad": geometry.pads_of(descriptor)[0]}


BOARDS = {name: board_in(folder) for name, folder in FOLDERS.items()}
ERRORS = [line for board in BOARDS.values() for line in pcb_check.wrong(**board)]


def errors_of_plants():
    """{what was planted: what the check of nets, places and orders finds}"""
    wrong = lambda name, what, change: pcb_check.wrong(**BOARDS[name] | {what: change(BOARDS[name][what])})
    return {plant: wrong(*where, change) for where, plants in PLANTS.items() for plant, change in plants.items()}


def lands_off(board):
    """Pads that differ from those of KiCad's own parts, which KiCad turns and flips: mirrored parts show in nothing else."""
    pads_of = lambda part: {(pad.GetName(), *pad.GetCenter(), *pad.GetSize(), *pad.GetLayerSet().Seq()) for pad in part.Pads()}
    off, scratch = 0, fabricate.pcbnew.BOARD()  # flipping a part that is on no board crashes
    for ours in board.Footprints():
        library = pathlib.Path(f"/usr/share/kicad/footprints/{ours.GetFPID().GetLibNickname()}.pretty")
        if library.is_dir():
            other = fabricate.pcbnew.FootprintLoad(str(library), str(ours.GetFPID().GetLibItemName()))
            scratch.Add(other)
            other.SetPosition(ours.GetPosition())
            if ours.IsFlipped():
                other.Flip(ours.GetPosition(), True)
            other.SetOrientation(ours.GetOrientation())
            off += len(pads_of(other) ^ pads_of(ours))
    return off


def off_um(folder, board, pad):
    """How far a pad of a sensor lies off in the Gerber of the front, and a hole in the drill files, at most."""
    with zipfile.ZipFile(next(folder.glob("*.zip"))) as files:
        back, copper, front, *drills = (files.read(name).decode() for name in sorted(files.namelist()) if re.search("F_Cu|Silk|drl", name))
    assert "D03" not in back + front, "holes are printed"
    flashes = re.findall(r"%TO\.P,(U\d+),(\d)[^%]*%\n(?:%[^\n]*\n|D\d+\*\n)*X(-?\d+)Y(-?\d+)D03", copper)
    pads = {(part, pad): (int(x) / 1e6, int(y) / 1e6) for part, pad, x, y in flashes}
    pairs = [(pads[pad], (x, -y)) for pad, (x, y) in pcb_check.places(board, pad).items() if pad[0] != "A0"]
    holes = sorted((float(x), float(y)) for drill in drills for x, y in re.findall(r"^X(-?[\d.]+)Y(-?[\d.]+)$", drill, re.MULTILINE))
    pairs += zip(holes, sorted([(x, -y) for x, y, *_ in board.holes + board.vias]), strict=True)
    return 1000 * max(math.dist(*pair) for pair in pairs)


class Pcb(unittest.TestCase):
    def test_boards_are_what_their_descriptors_say_and_wrong_ones_are_found(self):
        self.assertEqual(ERRORS, [])
        self.assertEqual([name for name, errors in errors_of_plants().items() if not errors], [])


class Copper(unittest.TestCase):
    def judged(self, name, plant=str):
        """{what KiCad finds on this board, with an error planted: how often}"""
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (path,) = shutil.copytree(FOLDERS[name], folder / "pcb").glob("*.kicad_pcb")
        path.write_text(plant(BOARDS[name]["text"]), encoding="utf-8")
        board, found = fabricate.judged(path, report := folder / "report")
        kinds = collections.Counter(re.findall(r"^\[(\w+)\]", report.read_text(encoding="utf-8"), re.MULTILINE))
        return found | kinds | {"lands_off": lands_off(board)}

    def test_wrong_copper_is_found_by_kicad(self):
        right = [self.judged(name) for name in FOLDERS]
        found = errors_of_plants()
        found |= {what: self.judged(name, plant).get(what.split(":")[0]) for name in COPPER for what, plant in COPPER[name].items()}
        one, two = (pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) for _ in range(2))
        self.assertEqual([fabricate.main([folder]) for folder in (one, two)], [0, 0])
        read = {name: pcb_check.Board(board["text"]) for name, board in BOARDS.items()}
        rises = collections.ChainMap(*(pcb_check.rises_ns(board["descriptor"], read[name]) for name, board in BOARDS.items()))
        missed = [plant for plant, errors in found.items() if not errors]
        nothing = {key: sum(board[key] for board in right) for key in right[0]} | {
            "netlist_errors": len(ERRORS),
            "vias_under_sensors": sum(line.startswith("a via under") for line in ERRORS),
            "pad_places_off_um": max(off_um(one / name, read[name], board["pad"]) for name, board in BOARDS.items()),
            "planted_missed": len(missed),
            "bytes_differ": sum(path.read_bytes() != (two / path.relative_to(one)).read_bytes() for path in one.rglob("*.*")),
        }
        figures.add(ROOT / "build/report/board.json", nothing | {"boards": len(BOARDS), "planted": len(found), "rise_ns": dict(rises)})
        self.assertEqual((missed, nothing), ([], dict.fromkeys(nothing, 0)), ERRORS)


if __name__ == "__main__":
    if "Copper" in sys.argv and not fabricate:
        sys.exit(77)
    unittest.main()
