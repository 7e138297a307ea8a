"""Every kind of error that is planted in a circuit board is found, by the check of nets and places (Pcb) or by KiCad (Copper; exit status 77 without it)."""

import copy
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "boards/drawing"))
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


def track(x0, y0, x1, y1, side, net):
    return added(f'(segment (start {x0} {y0}) (end {x1} {y1}) (width 0.2) (layer "{side}.Cu") (net {net}))')


VIA = '(via (at 100 100) (size 0.6) (drill 0.3) (layers "F.Cu" "B.Cu") (net 2))'
NETS_AND_PLACES = {
    "a sensor moved by 0.1 mm": part("U3", moved(0.1, 0)),
    "a sensor moved by 2 um": part("U3", moved(0, 0.002)),
    "a sensor turned": part("U7", pads_at(lambda x, y: f"{y:g} {-x:g}")),
    "a sensor mirrored": part("U7", pads_at(lambda x, y: f"{-x:g} {y:g}")),
    "SDA and SCL of a sensor exchanged": part("U2", exchanged("3", "4")),
    "supply and ground of a sensor exchanged": part("U2", exchanged("1", "2")),
    "two sensors exchanged": exchanged("U0", "U1"),
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
DESCRIPTORS = {
    "another pin of SCL": lambda board: board["wiring"].update(pin_scl=16),
    "another sync pin": lambda board: board["wiring"].update(pin_sync=21),
    "another pull-up of SDA": lambda board: board["pull_ups_ohm"].update(sda=4700),
    "another pull-up of SCL": lambda board: board["pull_ups_ohm"].update(scl=2200),
}
COPPER = {
    "a track is missing": replaced(r"  \(segment .*\n", ""),
    "a via is missing": replaced(r"  \(via .*\n", ""),
    "a track between two lines": track(91, 81, 100, 81, "F", 3),
    "a track at the edge": track(71.1, 100, 71.1, 110, "F", 2),
    "wide tracks": replaced(r"\(width 0.2\)", "(width 0.35)", 0),
    "a via under a sensor": added(VIA),
    "a part on another": part("C4", moved(2, 0)),
    "a part mirrored": part("U7", pads_at(lambda x, y: f"{-x:g} {y:g}")),
}


(FOLDER,) = ROOT.glob("boards/*/pcb")
TEXT = next(FOLDER.glob("*.kicad_pcb")).read_text(encoding="utf-8")


class Pcb(unittest.TestCase):
    def test_boards_are_what_their_descriptors_say(self):
        self.assertEqual(pcb_check.main(), 0)

    def test_wrong_nets_and_places_are_found(self):
        sensors, board = geometry.places(), json.loads((FOLDER.parent / "board.json").read_text(encoding="utf-8"))
        found = {name: pcb_check.wrong(plant(TEXT), board, sensors) for name, plant in NETS_AND_PLACES.items()}
        for name, plant in DESCRIPTORS.items():
            plant(spoilt := copy.deepcopy(board))
            found[name] = pcb_check.wrong(TEXT, spoilt, sensors)
        found["another pitch"] = pcb_check.wrong(TEXT, board, [(1.02 * x, y) for x, y in sensors])
        self.assertEqual([name for name, errors in found.items() if not errors], [])


class Copper(unittest.TestCase):
    def test_wrong_copper_is_found_by_kicad(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        for i, plant in enumerate([lambda text: text, *COPPER.values()]):
            shutil.copytree(FOLDER, folder / str(i))
            next((folder / str(i)).glob("*.kicad_pcb")).write_text(plant(TEXT), encoding="utf-8")
        boards = sorted(folder.glob("*/*.kicad_pcb"), key=lambda path: int(path.parent.name))
        run = subprocess.run(["/usr/bin/python3", pathlib.Path(__file__).with_name("kicad.py"), *boards], capture_output=True, text=True)
        right, *found = (int(line) for line in run.stdout.splitlines())
        self.assertEqual((right, len(found)), (0, len(COPPER)), run.stderr)
        self.assertEqual([name for name, errors in zip(COPPER, found, strict=True) if not errors], [])


if __name__ == "__main__":
    if "Copper" in sys.argv and not pathlib.Path("/usr/lib/python3/dist-packages/pcbnew.py").exists():
        sys.exit(77)
    unittest.main()
