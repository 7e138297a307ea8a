"""The page's WebAssembly, run by node: the firmware byte by byte against the native player, the simulated fingertip in real time, the
judges against the tool.

usage: test_web_wasm.py --build DIR --node PROGRAM
"""

import argparse
import json
import math
import pathlib
import re
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
import wasm_parity  # noqa: E402
import numpy as np  # noqa: E402
from called import run as must  # noqa: E402
from fingertip.files import read_recording  # noqa: E402

OPTIONS = argparse.Namespace()
STORED_PAD = 1 << 4  # wire_stored


class WebWasm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.build = pathlib.Path(OPTIONS.build)
        cls.web = cls.build / "host_tools/web/wasm"

    def scenario(self, kind, *more):
        path = self.folder / f"{kind}.csv"
        twin = self.build / "host_tools/simulation/twin/twin"
        must(twin, "scenario", kind, "--cache", self.build / "contact_tables", "-o", path, "--overwrite", *more)
        return path

    def fingertip(self, *arguments):
        return must(self.build / "host_tools/tool/cli/fingertip", *arguments)

    def captured(self, scenario, *options):
        capture, player = self.folder / "felt.ftr", self.build / "host_tools/simulation/player/fingertip_player"
        output = ("-o", self.folder / "measured.csv", "--raw-bytes", capture, "--overwrite", "--quiet")
        must(player, "play", scenario, *output, "--raw", *options)
        return capture

    def judged(self, *arguments):
        return json.loads(must(OPTIONS.node, HERE / "judge.mjs", self.web / "judges.wasm", *arguments))

    def commands(self, name, *texts):
        path, frame = self.folder / name, self.build / "tests/support/command_frame"
        path.write_bytes(b"".join(bytes.fromhex(must(frame, "--sequence", n, *text.split())) for n, text in enumerate(texts)))
        return path

    def recording_of(self, capture, used):
        """Of the first bytes of a capture."""
        cut, recording = self.folder / "used.ftr", self.folder / "used.csv"
        cut.write_bytes(capture.read_bytes()[:used])
        self.fingertip("convert", cut, recording, "--overwrite")
        return recording


class Parity(WebWasm):
    """All scenes are a nightly test (web.parity)."""

    def same(self, scenario, *options, pad=False, least_Hz=100):
        packets, different, told = wasm_parity.play(self.build, scenario, self.folder, *options, pad=pad)
        self.assertEqual(different, 0, "build web_wasm and fingertip_player again first: their info packets name their commit")
        self.assertGreater(packets, least_Hz * told["seconds"])

    def test_taps_with_all_errors(self):
        self.same(self.scenario("taps", "--seconds", "15", "--effects", "all"), "--osr", "256", "--raw")

    def test_tangential_load(self):
        self.same(self.scenario("lift", "--seconds", "15"), pad=True)

    def test_a_slide_seldom_looked_at(self):
        slip = ("--set", "slip_threshold=0.5", "--set", "slip_window=100")
        self.same(self.scenario("slide", "--seconds", "15"), "--rate", "50", *slip, least_Hz=50)

    def test_a_difference_is_seen(self):
        whole = bytes(range(1, 200)) + b"\0" + bytes(range(1, 100)) + b"\0"
        changed = bytearray(whole)
        changed[150] ^= 1
        self.assertEqual(wasm_parity.compared(whole, whole), (2, 0))
        self.assertEqual(wasm_parity.compared(whole, bytes(changed)), (2, 1))
        self.assertEqual(wasm_parity.compared(whole, whole[:200]), (2, 1))


class Simulated(WebWasm):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        commands = cls().commands("commands", "osr 256", "rate max", "stream contact,raw,health", "info")
        cls().commands("commands.loader", "loader")
        cls.capture = cls.folder / "scene.ftr"
        call = (OPTIONS.node, HERE / "scene.mjs", cls.web / "simulated.wasm", cls.web / "objects.bin", commands, cls.capture)
        cls.seen = json.loads(must(*call))
        cls.truth = {truth["name"]: truth for truth in cls.seen["truths"]}
        cls.told = must(cls.build / "host_tools/tool/cli/fingertip", "convert", cls.capture, cls.folder / "scene.csv")
        cls.scene = read_recording(cls.folder / "scene.csv")

    def near(self, name):
        """Means of the fits in the tenth of a second before a truth was noted."""
        end_us = self.truth[name]["t_us"]
        now = (self.scene["t_us"] >= end_us - 1e5) & (self.scene["t_us"] < end_us) & np.isfinite(self.scene["force_N"])
        self.assertGreater(np.count_nonzero(now), 100)
        return {key: np.mean(self.scene[key][now]) for key in ("x_mm", "y_mm", "force_N", "qx_N", "qy_N")}

    def test_no_packet_is_lost_at_the_highest_rate(self):
        for count in ("dropped_packets=0", "crc_errors=0", "format_errors=0", "out_of_order=0"):
            self.assertIn(count, self.told)
        self.assertGreater(1e6 / np.mean(np.diff(self.scene["t_us"])), 1300)

    def test_says_who_it_is_and_knows_its_pad(self):
        head = self.scene.metadata
        self.assertEqual((head["serial"], head["scene"]), ("00000000C0FFEE00", "grasp"))
        self.assertTrue(int(head["stored"]) & STORED_PAD)

    def test_what_is_pressed_is_felt(self):
        truth, felt = self.truth["press"], self.near("press")
        self.assertEqual((truth["contact"], truth["slips"]), (True, False))
        self.assertLess(math.hypot(felt["x_mm"] - truth["x_mm"], felt["y_mm"] - truth["y_mm"]), 0.3)
        self.assertLess(abs(felt["force_N"] / truth["force_N"] - 1), 0.03)
        self.assertLess(math.hypot(felt["qx_N"], felt["qy_N"]), 0.2)

    def test_what_is_dragged_pulls_and_slips(self):
        truth, felt = self.truth["drag"], self.near("drag")
        self.assertTrue(truth["slips"])
        self.assertLess(math.hypot(felt["qx_N"] - truth["qx_N"], felt["qy_N"] - truth["qy_N"]), 0.3)
        self.assertGreater(truth["qy_N"], 2)

    def test_what_is_held_carries_its_load(self):
        truth, felt = self.truth["hold"], self.near("hold")
        self.assertFalse(truth["slips"])
        self.assertAlmostEqual(truth["qy_N"], 2, delta=0.01)
        self.assertLess(abs(felt["qy_N"] - 2), 0.2)

    def test_what_is_dropped_weighs(self):
        truth, felt = self.truth["drop"], self.near("drop")
        self.assertAlmostEqual(truth["force_N"], 0.3 * 9.80665, delta=0.01)
        self.assertLess(abs(felt["force_N"] / truth["force_N"] - 1), 0.05)
        self.assertFalse(self.truth["lift"]["contact"])

    def test_a_sleep_is_skipped_and_nothing_comes_while_it_is_closed(self):
        self.assertAlmostEqual(self.seen["after_sleep_s"], 0.2, delta=0.05)
        self.assertEqual(self.seen["bytes_closed"], 0)

    def test_the_loader_and_the_plug(self):
        self.assertEqual(len(self.seen["left"]), 1)
        self.assertIn("loader", self.seen["left"][0])
        self.assertIn("connect again", self.seen["left"][0])
        again = (self.folder / "scene.ftr.again").rename(self.folder / "again.ftr")
        self.fingertip("convert", again, self.folder / "again.csv")
        again = read_recording(self.folder / "again.csv")
        self.assertTrue(int(again.metadata["stored"]) & STORED_PAD)
        self.assertLess(again["t_us"][0], 2e6)

    def test_bad_input_is_told(self):
        effect, value, torn = self.seen["errors"]
        self.assertIn('there is no effect "rust"', effect)
        self.assertIn('effect gain is "1e9"; give', value)
        self.assertIn("load the page again", torn)


class Judges(WebWasm):
    def test_gains_are_the_tools(self):
        # Of a fingertip without a profile, the tool finds the scale for the one that it gives it; the page gives none.
        capture = self.captured(self.scenario("placements", "--effects", "gain", "--seconds", "100"), "--pad", "12")
        found = self.judged("gains", capture, "3")
        told = self.fingertip("calibrate", "--from", self.recording_of(capture, found["used"]), "--dry-run", "--force", "3")
        self.assertEqual(found["status"]["state"], "good")
        self.assertIn(found["status"]["text"], told)
        gains = [float(line.split()[1]) for line in told.splitlines() if re.fullmatch(r" +\d+ +[\d.]+ +[\d.]+ .*", line)]
        result = found["result"]
        self.assertEqual([f"{gain:.3f}" for gain in result["calibration"]["gain"]], [f"{gain:.3f}" for gain in gains])
        scale = re.search(r"force scale +1.000 +([\d.]+) +sd ([\d.]+)", told)
        self.assertEqual(scale.groups(), tuple(f"{result['calibration'][key]:.3f}" for key in ("force_scale", "force_scale_sd")))
        location = re.search(r"location off by +([\d.]+) mm +([\d.]+) mm", told)
        self.assertEqual(location.groups(), tuple(f"{result[key]['location_mm']:.2f}" for key in ("before", "after")))
        self.assertEqual(result["calibration"]["calibration_date_s"], 1700000000)
        self.assertEqual(found["left"], len(found["status"]["placements"]) - 1)
        self.assertEqual(found["advice"][0], "set the weight down on its round foot, best near x 0 y 0 mm")
        self.assertIn("taken: lift it", found["advice"])
        # Not the weight that was on it.
        self.assertIn("give the weight that was on the pad", self.judged("gains", capture, "0.01")["error"])

    def test_the_tangential_scale_is_the_tools(self):
        # Its zero lies before anything touches; 0.9 N of 3 N on the string.
        capture = self.captured(self.scenario("drag", "--seconds", "80", "--effects", "gain=2"), "--pad", "12")
        found = self.judged("pulls", capture, "0.9")
        told = self.fingertip("calibrate", "--drag", "--force", "0.9", "--from", self.recording_of(capture, found["used"]), "--dry-run")
        self.assertEqual(found["status"]["state"], "good")
        scale = re.search(r"([\d.]+) sd ([\d.]+) now", told)
        self.assertEqual(scale.groups(), tuple(f"{found['result'][key]:.3f}" for key in ("tangential_scale", "tangential_scale_sd")))
        self.assertIn(found["status"]["text"], told)
        # Without a pad's profile there is nothing to scale.
        self.assertIn("no pad profile", self.judged("pulls", self.captured(self.scenario("taps", "--seconds", "6")), "0.9")["thrown"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", required=True)
    parser.add_argument("--node", required=True)
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
