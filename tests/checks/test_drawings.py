"""What boards/drawing draws: it follows the descriptor and the geometry, as the firmware does, and refuses what cannot be wired.

usage: test_drawings.py HEADERS [unittest arguments]; HEADERS: folder where the build has written <board>/board.h
"""

import contextlib
import copy
import dataclasses
import io
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
import draw  # noqa: E402
import geometry  # noqa: E402
import mould  # noqa: E402
import wiring  # noqa: E402

HEADERS = pathlib.Path(sys.argv[1])
DESCRIPTORS = {path.parent.name: json.loads(path.read_text(encoding="utf-8")) for path in sorted(ROOT.glob("boards/*/board.json"))}
PROJECT = f"cmake_minimum_required(VERSION 3.25)\nproject(boards NONE)\ninclude({ROOT}/cmake/boards.cmake)\n"
OWN_PAD = geometry.pad(ROOT / "boards/pads/3x5.json")
BY_BUS = {descriptor["bus"]: (name, descriptor) for name, descriptor in DESCRIPTORS.items()}


def wired(bus, **wires):
    name, descriptor = copy.deepcopy(BY_BUS[bus])
    descriptor["wiring"] |= wires
    return wiring.board_of(name, descriptor)


def pins_drawn(board):
    """[(GPIO, pin)] of the picture."""
    return [tuple(map(int, wire)) for wire in re.findall(r">GP(\d+)[^<]*</text>\s*<text[^>]*>pin (\d+)<", wiring.drawn(board))]


class Wiring(unittest.TestCase):
    def test_picture_and_table_have_every_wire_of_the_descriptor(self):
        for bus in BY_BUS:
            board = wired(bus)
            drawn = pins_drawn(board)
            self.assertEqual([gpio for gpio, _ in drawn], wiring.gpios(board), bus)
            table = wiring.table(board)
            for gpio, pin in drawn:
                self.assertIn(f"GP{gpio} (pin {pin})", table)

    def test_the_firmware_has_the_pins_that_are_drawn(self):
        for bus, (name, _) in BY_BUS.items():
            board = wired(bus)
            found = re.findall(r"BOARD_(\w+) = (\w+),", (HEADERS / name / "board.h").read_text(encoding="utf-8"))
            told = {key.lower(): int(value, 0) for key, value in found}
            self.assertEqual({key: value if isinstance(value, int) else int(value, 0) for key, value in board.wiring.items()}, told)
            pins = [gpio for gpio, _ in pins_drawn(board)]
            for key, gpio in told.items():
                if key.startswith("pin_"):
                    self.assertIn(gpio, pins, (name, key))

    def test_a_wire_that_moves_in_the_descriptor_moves_in_both(self):
        board = wired("multiplexed", pin_sda=12, pin_scl=13, pin_mux_reset_0=18, mux_address_0="0x74")
        self.assertEqual(pins_drawn(board), [(12, 16), (13, 17), (18, 24), (19, 25), (20, 26), (22, 29)])
        for text in ("GP12 (pin 16) | SDA", "GP20 (pin 26) | RESET of the TCA9548A of strip 2", "| 1 | 0x75 | 3V3, GND, 3V3 | 0 to 4"):
            self.assertIn(text, wiring.table(board))
        self.assertIn("0x76, A2 to A0: 3V3 3V3 GND", wiring.drawn(board))
        board = wired("parallel", pin_scl=17, pin_sync=28)
        self.assertEqual(pins_drawn(board)[-2:], [(17, 22), (28, 34)])

    def test_other_counts_of_sensors(self):
        board = wired("multiplexed", sensor_count=8, sensors_of_strip=4)
        self.assertEqual(board.strips, 2)
        self.assertEqual(wiring.drawn(board).count(">MS5840 "), 8)
        self.assertEqual([count for count, part, _ in wiring.parts(board) if part in ("MS5840-02BA", "TCA9548A", "100 nF")], [8, 2, 10])

    def test_what_it_refuses(self):
        with self.assertRaisesRegex(wiring.Unwired, "943 Ohm pull a line up, all channels open"):
            wired("multiplexed", sensor_count=20)
        name, descriptor = copy.deepcopy(BY_BUS["parallel"])
        del descriptor["pull_ups_ohm"]["scl"]
        with self.assertRaisesRegex(wiring.Unwired, "pull_ups_ohm has no scl; add its resistance"):
            wiring.board_of(name, descriptor)
        with self.assertRaisesRegex(wiring.Unwired, "no drawing knows the bus semaphore"):
            wiring.board_of(name, {**descriptor, "bus": "semaphore"})

    def test_what_the_build_refuses(self):
        for bus, key, value, why in (
            ("multiplexed", "pin_sda", 44, "a Pico leads out GPIO 0 to 22"),
            ("multiplexed", "pin_sda", 6, "I2C0 has SDA on"),
            ("multiplexed", "pin_scl", "4", "I2C0 has SDA on"),
            ("multiplexed", "pin_mux_reset_0", 5, "GPIO 5 is pin_scl already"),
            ("multiplexed", "pin_mux_reset_0", 21, "GPIO 22 is pin_sync already"),
            ("multiplexed", "pin_mux_reset_0", 27, "does not lead out GPIO 29"),
            ("multiplexed", "pin_sync", 25, "does not lead out GPIO 25"),
            ("multiplexed", "mux_address_0", "0x6F", "3 TCA9548A from there on must be within"),
            ("multiplexed", "mux_address_0", "0x76", "3 TCA9548A from there on must be within"),
            ("multiplexed", "mux_address_0", "0x74", "has the address of the sensors"),
            ("multiplexed", "sensors_of_strip", 9, "a TCA9548A has eight channels"),
            ("multiplexed", "sensors_of_strip", 4, "15 sensors do not make whole strips"),
            ("parallel", "sensors_of_strip", 0, "a strip has 1 to 15"),
            ("parallel", "sensor_address", "0x40", "have the address 0x76 or 0x77"),
            ("parallel", "sensor_count", "", "1 to 36 sensors are read"),
            ("parallel", "pin_scl", 14, "SCL is above the data lines"),
            ("parallel", "pin_sync", 15, "GPIO 15 is pin_scl already"),
            ("parallel", "pin_sda", 3, "GPIO 3 is the data line of sensor 3 already"),
            ("parallel", "overhead_us", "", "the time beside a conversion"),
            ("multiplexed", "pin_sync", "026", "a Pico leads out GPIO 0 to 22"),
            ("multiplexed", "mux_address_0", 112, "3 TCA9548A from there on must be within"),
            ("multiplexed", "bus", "Multiplexed", "known are parallel and multiplexed"),
        ):
            with tempfile.TemporaryDirectory() as folder, self.subTest(bus=bus, key=key, value=value):
                name, descriptor = copy.deepcopy(BY_BUS[bus])
                (descriptor if key in descriptor else descriptor["wiring"])[key] = value
                board = pathlib.Path(folder, "boards", name)
                board.mkdir(parents=True)
                (board / "board.json").write_text(json.dumps(descriptor), encoding="utf-8")
                pathlib.Path(folder, "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")
                done = subprocess.run(["cmake", "-S", folder, "-B", f"{folder}/build"], capture_output=True, text=True)
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(f'boards/{name}/board.json: {key} is "{value}": ', " ".join(done.stderr.split()))
                self.assertIn(why, " ".join(done.stderr.split()))

    def test_numbers_of_resistors(self):
        self.assertEqual([draw.yageo(wiring.ohms(ohm)) for ohm in (33, 4.7, 1000, 2200, 10000)], ["33R", "4R7", "1K", "2K2", "10K"])


class Pad(unittest.TestCase):
    def test_the_measures_follow_the_places(self):
        twice = dataclasses.replace(OWN_PAD, places=[(x * 2, y) for x, y in OWN_PAD.places])
        m, wider = mould.measures(OWN_PAD), mould.measures(twice)
        reach = max(x for x, _ in OWN_PAD.places)
        for name in ("skin", "flange", "outside", "opening"):
            self.assertAlmostEqual(getattr(wider, name)[0] - getattr(m, name)[0], 2 * reach)
            self.assertEqual(getattr(wider, name)[1], getattr(m, name)[1])
        self.assertNotEqual(mould.drawn(OWN_PAD), mould.drawn(twice))

    def test_nothing_is_where_a_screw_is(self):
        m = mould.measures(OWN_PAD)
        for x, y in m.screws:
            radius = mould.SCREW_mm / 2
            self.assertTrue(any(abs(at) - radius > flange / 2 + mould.FRAME_PLAY_mm for at, flange in zip((x, y), m.flange)))
            self.assertTrue(all(abs(at) + radius < size / 2 for at, size in zip((x, y), m.outside)))


class Tree(unittest.TestCase):
    def setUp(self):
        self.tree = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        for folder in ("boards", "firmware"):
            shutil.copytree(ROOT / folder, self.tree / folder)

    def told(self, *argv):
        err = io.StringIO()
        with contextlib.redirect_stderr(err):
            status = draw.main(list(argv), self.tree)
        return status, err.getvalue()

    def test_says_what_was_not_drawn_again(self):
        self.assertEqual(self.told("--check"), (0, ""))
        name, descriptor = copy.deepcopy(BY_BUS["multiplexed"])
        descriptor["wiring"]["pin_sync"] = 21
        (self.tree / "boards" / name / "board.json").write_text(json.dumps(descriptor))
        status, err = self.told("--check")
        self.assertEqual(status, 1)
        self.assertEqual([line.split()[0] for line in err.splitlines()], [f"boards/{name}/wiring.svg", f"boards/{name}/README.md"])
        self.assertEqual(self.told(), (0, ""))
        self.assertEqual(self.told("--check"), (0, ""))
        source = self.tree / "boards/pads/3x5.json"
        source.write_text(source.read_text().replace('"pitch_mm": 9', '"pitch_mm": 9.5', 1))
        status, err = self.told("--check")
        self.assertEqual([line.split()[0] for line in err.splitlines()], ["boards/pads/3x5.scad", "boards/pads/3x5.svg", "boards/BUILD.md"])

    def test_a_page_without_a_place(self):
        page = self.tree / "boards/BUILD.md"
        page.write_text(page.read_text().replace("<!-- /measures -->", ""))
        status, err = self.told("--check")
        self.assertEqual(status, 1)
        self.assertIn('no place for "measures"', err)
        self.assertEqual(self.told("--chekc")[0], 2)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
