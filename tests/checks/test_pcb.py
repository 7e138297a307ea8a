"""Every kind of error that is planted in a circuit board is found, by the check of nets and places (Pcb) or by KiCad (Copper; exit status 77 without it)."""

import collections
import csv
import importlib.util
import math
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "boards/drawing"), str(ROOT / "tests/support")]
import figures  # noqa: E402
import geometry  # noqa: E402
import pcb_check  # noqa: E402

if importlib.util.find_spec("pcbnew"):  # of KiCad's Python
    import fabricate

PART = r'  \(footprint "[^"]*" \(layer "[FB].Cu"\) \(at [^)]*\) \(attr [^)]*\)\n    \(fp_text reference "%s".*?\n  \)\n'
part = lambda name, change: lambda text: re.sub(PART % name, lambda found: change(found[0]), text, flags=re.DOTALL)
exchanged = lambda a, b: lambda text: text.replace(f'"{a}"', '"@"').replace(f'"{b}"', f'"{a}"').replace('"@"', f'"{b}"')
replaced = lambda old, new, count=1: lambda text: re.sub(old, new, text, count=count)
added = lambda line: lambda text: text.rstrip()[:-1] + f"  {line}\n)\n"


def described(**others):
    """Other figures in board.json, one at a time."""
    changed = lambda section, own: lambda right: right | {section: right[section] | own}
    return {f"{name}: {key}": changed(name, {key: other}) for name, own in others.items() for key, other in own.items()}


TRACK = '(segment (start %s) (end %s) (width %g) (layer "%s.Cu") (net %d))'
VIA = '(via (at %s) (size 0.6) (drill %g) (layers "F.Cu" "B.Cu") (net 2))'
MIRRORED = lambda text: re.sub(r"(\(pad .*?\(at )(-?[\d.]+)", lambda at: f"{at[1]}{-float(at[2]):g}", text)
PLANTS = {
    ("pico_parallel", "text"): {
        "a sensor moved by 2 um": part("U3", replaced("at 91 91", "at 91 91.002")),
        "a sensor mirrored": part("U7", MIRRORED),
        "a sensor's mark at pad 3": part("U7", replaced(r"\(center (\S+) (\S+)\) \(end", r"(center 1.35 \2) (end")),
        "a sensor's mark on the back": part("U7", replaced('"F.SilkS"\\) \\(width', '"B.SilkS") (width')),
        "a sensor of another kind": replaced('"MS5840-02BA"', '"MS5837-30BA"', 0),
        "SDA and SCL of a sensor exchanged": part("U2", exchanged("3", "4")),
        "two sensors exchanged": exchanged("U0", "U1"),
        "the Pico mirrored": part("A0", MIRRORED),
        "a pad of the Pico longer by 2 um": part("A0", replaced("3.5 1.7", "3.502 1.7")),
        "print too small": replaced(r'(SilkS"\) \(effects \(font \(size )1 1', r"\g<1>0.9 0.9"),
        "a capacitor missing": part("C4", lambda _: ""),
        "a capacitor 4.01 mm from its sensor": part("C4", replaced("at 87.6", "at 86")),
        "two tracks on each other": replaced(r"(  \(segment .*\n)", r"\1\1"),
        "a via at the corner of a sensor": added(VIA % ("101.9 101.9", 0.3)),
        "a via on a resistor's pad": added(VIA % ("103.4 115.6", 0.3)),
        "a hole elsewhere": part("H1", replaced("at 74 100", "at 74.01 100")),
        "the pour on one side": replaced(r'(net_name "GND"\) \(layers) "F.Cu"', r"\1"),
        "copper under a test point of the Pico": replaced("copperpour not_allowed", "copperpour allowed"),
        "another outline": replaced(r"\(end 129 138\)", "(end 129 137.99)"),
    },
    ("pico_mux", "text"): {"two multiplexers at one address": part("M1", replaced('"3V3"', '"GND"'))},
    ("pico_mux_4x4", "text"): {"a free wire of the connector on GND": part("X0", replaced(r'("7" .*)\)\)', r'\1) (net 1 "GND"))'))},
    ("pico_parallel_strip", "text"): {"two wires of a strip exchanged": part("X0", exchanged("2", "3"))},
    ("pico_parallel", "bom"): {
        "a smaller resistor": replaced("RC0603", "RC0402"),
        "another sensor ordered": replaced("MS5840-02BA01", "MS583730BA01-50"),
        "a part not ordered": replaced("U3,", ""),
    },
    ("pico_parallel", "descriptor"): described(wiring=dict(pin_scl=16, pin_sync=21), pull_ups_ohm=dict(sda=3600), rise_ns=dict(scl=147)),
    ("pico_mux", "descriptor"): described(wiring=dict(mux_address_0="0x71"), pull_ups_ohm=dict(bus=2400, channel=30000, reset=9100)),
}
COPPER = {  # each named by what finds it: a word of KiCad's rule check, or where the files for the house differ
    "pico_parallel": {
        "unconnected_items: a track is missing": replaced(r"  \(segment .*\n", ""),
        "clearance: a track between two lines": added(TRACK % ("91 81", "100 81", 0.25, "F", 3)),
        "items_not_allowed: a track under a screw": added(TRACK % ("122.75 98", "122.75 102", 0.25, "B", 2)),
        "items_not_allowed: a via at the corner of a sensor": added(VIA % ("101.9 101.9", 0.3)),
        "drill_out_of_range: a via too narrow to drill": added(VIA % ("101.9 101.9", 0.2)),
        "courtyards_overlap: a part on another": part("C4", replaced("at 87.6", "at 88.34")),
        "silk_over_copper: print on a pad": part("U7", replaced(r"\(at 0 -2.55\)", "(at 1 -1)")),
        "lands_off: a capacitor turned, but not in the placement file": part("C4", replaced(" 270\\)", " 90)", 0)),
        "files_off: a pad without paste": part("R5", replaced(' "F.Paste"', "")),
        "files_off: half as much paste on a sensor": part("U7", replaced(r"\(attr smd\)", "(attr smd) (solder_paste_margin -0.2)")),
        "files_off: a pad under the mask": part("A0", replaced(r'(pad "5" .*) "B.Mask"', r"\1")),
        "files_off: masks far from their pads": replaced("pad_to_mask_clearance 0.05", "pad_to_mask_clearance 0.1"),
        "files_off: a pad turned in its part": part("R5", replaced(r'(pad "1" .*) 270\)', r"\1)")),
        "files_off: a pad with a hole": part("U7", replaced(r'"1" smd (.*\))\)', r'"1" thru_hole \1 (drill 0.8))')),
        "files_off: the board cut through": added('(gr_circle (center 100 64) (end 101 64) (layer "Edge.Cuts") (width 0.1))'),
    },
    "pico_mux": {
        "copper_edge_clearance: a track 0.48 mm from the edge": added(TRACK % ("71.6 120", "71.6 121", 0.25, "B", 2)),
        "track_width: a thin track": added(TRACK % ("72 120", "72 121", 0.24, "B", 2)),
        "lands_off: the connector mirrored": part("X0", MIRRORED),
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


def lands_off(board, folder):
    """Pads that are elsewhere than those of KiCad's own parts, laid as the placement file has it: from above, or mirrored if on the back."""
    rows = {part: row for part, *row in csv.reader(next(folder.glob("*-placement.csv")).read_text(encoding="utf-8").splitlines())}
    off, origin, mm = 0, board.GetDesignSettings().GetAuxOrigin(), lambda words: float(words.removesuffix("mm"))
    for ours in board.Footprints():
        library = pathlib.Path(f"/usr/share/kicad/footprints/{ours.GetFPID().GetLibNickname()}.pretty")
        if library.is_dir():
            x, y, side, turn = rows[ours.GetReference()]
            other, back = fabricate.pcbnew.FootprintLoad(str(library), str(ours.GetFPID().GetLibItemName())), side == "Bottom"
            other.SetPosition(origin + fabricate.pcbnew.wxPoint(round(1e6 * mm(x)), round(-1e6 * mm(y))))
            other.SetOrientationDegrees(mm(turn))
            mirrored = lambda x, y, sign=1 - 2 * back, middle=other.GetPosition().x: (middle + sign * (x - middle), y)
            right = {(back, pad.GetName(), *mirrored(*pad.GetCenter()), *pad.GetSize()) for pad in other.Pads()}
            off += len(right ^ {(ours.IsFlipped(), pad.GetName(), *pad.GetCenter(), *pad.GetSize()) for pad in ours.Pads()})
    return off


def flashed(text):
    """{(x, y, width, height)} of pads and holes in a Gerber or a drill file, in um."""
    um, sizes = 1000 if "METRIC" in text else 0.001, {}
    for code, kind, words in re.findall(r"^(?:%AD)?([DT]\d+)([A-Za-z]+),?([\d.X-]+)", text, re.MULTILINE):
        one, *two = ([1000 * float(word) for word in words.split("X")] * 3)[:3]
        sizes[code] = [round(2 * (one + abs(mm))) for mm in two] if kind == "RoundRect" else [round(one), round(two[0])]
    blocks = re.findall(r"^([DT]\d+)\*?\n(.*?)(?=^[DT]\d|\Z)", text, re.MULTILINE | re.DOTALL)
    places = lambda block: re.findall(r"^X(-?[\d.]+)Y(-?[\d.]+)(?:D03\*)?$", block, re.MULTILINE)
    return {(*(round(um * float(mm)) for mm in place), *sizes[code]) for code, block in blocks for place in places(block)}


def files_off(texts, board, pad):
    """Pads and holes that differ in the house's files, or lines that are drawn in paste and masks, or beside the outline; how far a sensor's pad is off."""
    wanted = {"PTH": [(x, y, 0.3, 0.3) for x, y in board.vias], "NPTH": [(x, y, mm, mm) for x, y, mm in board.holes], "Edge_Cuts": []}
    for back, side in enumerate("FB"):
        pads = [place[:4] for (part, _), place in board.pads.items() if board.parts[part][3] == back]
        wanted |= {f"{side}_Cu": pads + [(x, y, 0.6, 0.6) for x, y in board.vias], f"{side}_Paste": pads, f"{side}_SilkS": []}
        wanted[f"{side}_Mask"] = [(x, y, w + 0.1, h + 0.1) for x, y, w, h in pads + wanted["NPTH"]]
    found = {name.split("-")[-1].split(".")[0]: text for name, text in texts.items()}
    off = sum(text.count("D01*") for name, text in found.items() if name.endswith(("Mask", "Paste", "Cuts"))) - 4
    for name, own in wanted.items():
        off += len({(*(round(1000 * mm) for mm in (x, -y, w, h)),) for x, y, w, h in own} ^ flashed(found[name]))
    lands = [(1000 * x, -1000 * y) for (part, _), (x, y) in pcb_check.places(board, pad).items() if part[0] == "U"]
    return {"files_off": off, "pad_places_off_um": max(min(math.dist(place, at[:2]) for at in flashed(found["F_Cu"])) for place in lands)}


class Pcb(unittest.TestCase):
    def test_boards_are_what_their_descriptors_say_and_wrong_ones_are_found(self):
        self.assertEqual(ERRORS, [])
        self.assertEqual([name for name, errors in errors_of_plants().items() if not errors], [])


class Copper(unittest.TestCase):
    def judged(self, name, plant=str):
        """{what KiCad finds on this board, with an error planted: how often}"""
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (path,) = shutil.copytree(FOLDERS[name], folder / "pcb").glob("*.kicad_pcb")
        path.write_text(text := plant(BOARDS[name]["text"]), encoding="utf-8")
        board, found = fabricate.judged(path, report := folder / "report")
        kinds = collections.Counter(re.findall(r"^\[(\w+)\]", report.read_text(encoding="utf-8"), re.MULTILINE))
        files = files_off(fabricate.plotted(board, folder / "plots"), pcb_check.Board(text), BOARDS[name]["pad"])
        return found | kinds | files | {"lands_off": lands_off(board, path.parent)}

    def test_wrong_copper_is_found_by_kicad(self):
        right = [self.judged(name) for name in FOLDERS]
        found = errors_of_plants()
        found |= {what: self.judged(name, plant).get(what.split(":")[0]) for name in COPPER for what, plant in COPPER[name].items()}
        one, two = (pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) for _ in range(2))
        self.assertEqual([fabricate.main([folder]) for folder in (one, two)], [0, 0])
        rises = pcb_check.rises_ns(BOARDS["pico_parallel"]["descriptor"], pcb_check.Board(BOARDS["pico_parallel"]["text"]))
        missed = [plant for plant, errors in found.items() if not errors]
        nothing = {key: sum(board[key] for board in right) for key in right[0]} | {
            "netlist_errors": len(ERRORS),
            "vias_under_sensors": sum(line.startswith("a via under") for line in ERRORS),
            "planted_missed": len(missed),
            "bytes_differ": sum(path.read_bytes() != (two / path.relative_to(one)).read_bytes() for path in one.rglob("*.*")),
        }
        figures.add(ROOT / "build/report/board.json", nothing | {"boards": len(BOARDS), "planted": len(found), "rise_ns": rises})
        self.assertEqual((missed, nothing), ([], dict.fromkeys(nothing, 0)), ERRORS)


if __name__ == "__main__":
    if "Copper" in sys.argv and "fabricate" not in globals():
        sys.exit(77)
    unittest.main()
