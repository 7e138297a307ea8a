"""The firmware's code played on this machine: against the truth of a scenario, against itself, and against the image on the
emulated chip byte by byte.

usage: test_player.py --player PROGRAM --fingertip PROGRAM [--node PROGRAM --image FILE.bin]
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from called import run as must  # noqa: E402
from fingertip import files  # noqa: E402

OPTIONS = argparse.Namespace()
PYTHON = ROOT / "host_tools/python"


class Player(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.scenario = cls.folder / "demo.csv"
        must(sys.executable, PYTHON, "scenario", "demo", "-o", cls.scenario)

    def play(self, name, *more, scenario=None):
        recording = self.folder / name
        must(OPTIONS.player, "play", scenario or self.scenario, "-o", recording, *more)
        return recording

    def evaluated(self, recording):
        summary = self.folder / "summary.json"
        must(sys.executable, PYTHON, "evaluate", recording, self.scenario, "-o", summary, "--overwrite")
        return json.loads(summary.read_text())

    def refused(self, *arguments):
        done = subprocess.run([OPTIONS.player, *map(str, arguments)], capture_output=True, text=True)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        return done.stderr

    def test_the_demo_is_felt_as_it_is(self):
        found = self.evaluated(self.play("demo_recording.csv"))
        self.assertGreater(found["frames_per_s"], 150)
        self.assertLess(found["localisation_median_mm"], 0.01)
        self.assertLess(found["force_mape_percent"], 0.2)
        self.assertEqual((found["slip_found"], found["slip_missed"], found["slip_false"]), (3, 0, 0))
        self.assertEqual((found["contact_missed"], found["contact_false"], found["dropped_packets"]), (0, 0, 0))

    def test_rate_and_oversampling_are_obeyed(self):
        found = self.evaluated(self.play("slow.csv", "--rate", "20", "--osr", "8192"))
        self.assertAlmostEqual(found["frames_per_s"], 20, delta=0.5)
        self.assertLess(found["localisation_median_mm"], 0.05)  # a conversion takes 17 ms of motion

    def test_the_same_seed_gives_the_same_bytes(self):
        first = self.play("first.csv", "--seconds", "2").read_bytes()
        self.assertEqual(first, self.play("second.csv", "--seconds", "2").read_bytes())
        self.assertNotEqual(first, self.play("third.csv", "--seconds", "2", "--seed", "2").read_bytes())

    def test_noise_is_what_it_says(self):
        quiet = self.evaluated(self.play("quiet.csv", "--noise", "0"))["localisation_median_mm"]
        loud = self.evaluated(self.play("loud.csv", "--noise", "10"))["localisation_median_mm"]
        self.assertLess(quiet, 2e-3)  # what the zero has followed before the first press
        self.assertGreater(loud, 5 * quiet)

    def test_a_pad_lets_it_tell_tangential_force(self):
        """How well is integration.host.calibrate's, of drags."""
        for more, from_touch in ((), False), (("--from-touch",), True):
            recording = files.read_recording(self.play(f"pad{from_touch}.csv", "--pad", "12", *more))
            self.assertEqual([recording.metadata[f"pad_{key}"] for key in ("thickness_mm", "from_touch")], ["12", str(int(from_touch))])
            told = recording.flag(files.TANGENTIAL_VALID)
            self.assertGreater(told.sum(), 300)
            self.assertEqual(set(recording.flag(files.TANGENTIAL_FROM_TOUCH)[told]), {from_touch})
        plain = files.read_recording(self.play("plain.csv", "--set", "slip_threshold=0.5"))
        self.assertEqual([plain.metadata[f"slip_{key}"] for key in ("threshold_mm", "window_ms")], ["0.5", "100"])
        self.assertFalse(plain.flag(files.TANGENTIAL_VALID).any())

    def test_a_recording_stays(self):
        recording = self.play("kept.csv", "--seconds", "1")
        before = recording.read_bytes()
        self.assertIn("kept.csv", self.refused("play", self.scenario, "-o", recording))
        self.assertEqual(recording.read_bytes(), before)

    def test_bad_scenarios_are_refused_with_their_place(self):
        good = self.scenario.read_text().splitlines(keepends=True)
        rows = [i for i, line in enumerate(good) if line[0].isdigit()]
        head, third = good[: rows[0]], good[rows[3]]
        begin, later = good[: rows[3]], good[rows[0] - 1 : rows[3]]
        hot_rows = [line.rstrip("\n") + {"t": ",temperature_degC\n", "#": "\n"}.get(line[0], ",1e300\n") for line in begin]
        for lines, message in (
            (["t_s,contact\n"], ":1: not a scenario"),
            ([*begin, third[:20]], "ends within a line"),
            ([*begin, third.replace(",", ",x", 1)], f":{rows[3] + 1}: column"),
            ([*begin, good[rows[0]]], "does not increase"),
            (head, "no rows"),
            ([*begin, ",".join(third.split(",")[:8] + ["2e7"] * 15) + "\n"], "at most 1e7"),
            ([*head[:-1], "# ambient_Pa: 1e300\n", *later], "at most 1e7"),
            ([*head[:-1], "# temperature_degC: 1e300\n", *later], "at most 1000 degC"),
            (hot_rows, "at most 1000 degC"),
        ):
            with self.subTest(message):
                path = self.folder / "bad.csv"
                path.write_text("".join(lines))
                self.assertIn(message, self.refused("play", path, "-o", self.folder / "never.csv"))
                self.assertFalse((self.folder / "never.csv").exists())
        self.assertIn("check the path", self.refused("play", self.folder / "missing.csv", "-o", self.folder / "never.csv"))

    def test_wrong_options(self):
        for options, reason in (("--osr 300", "256"), ("--pad 3", "5 to 20 mm"), ("--set slip_window=5000", "1000")):
            self.assertIn(reason, self.refused("play", self.scenario, "-o", self.folder / "never.csv", *options.split()))

    def test_what_calibrates_nothing_is_refused(self):
        out = ("--force", "3", "-o", self.folder / "found.commands")
        self.assertIn("has no pressures to calibrate from", self.refused("calibrate", self.play("contact.csv", "--seconds", "2"), *out))
        self.assertIn("not calibrated: ", self.refused("calibrate", self.play("pressures.csv", "--seconds", "2", "--raw"), *out))
        self.assertIn(
            "holds no commands; make it with fingertip_player calibrate",
            self.refused("play", self.scenario, "-o", self.folder / "never.csv", "--first", self.scenario),
        )
        for path in (out[-1], self.folder / "never.csv"):
            self.assertFalse(path.exists())

    def capture(self, name, *commands):
        if not OPTIONS.image:
            self.skipTest("no firmware image in this build")
        script = self.folder / "host.txt"
        words = [must(OPTIONS.command_frame, *command.split()).strip() for command in commands]
        script.write_text("0.5 dtr 1\n" + "".join(f"{0.52 + 0.01 * i:.2f} {word}\n" for i, word in enumerate(words)))
        path = self.folder / name
        emulate = [OPTIONS.node, ROOT / "host_tools/simulation/emulator/main.mjs", "--board", "pico_mux", "--image", OPTIONS.image]
        options = ["--host-script", script, "--capture", path, "--seconds", "1.6", "--fast-enumeration"]
        must(*emulate, "--scenario", self.scenario, *options)
        return path

    def test_the_chip_sends_what_this_machine_computes(self):
        capture = self.capture("equal.bin", "stream contact,raw", "info", "tare")
        found = json.loads(must(OPTIONS.player, "repeat", capture))
        self.assertGreater(found["frames"], 150)
        self.assertGreater(found["in_contact"], 50)
        self.assertEqual(found["equal"], found["frames"])

        damaged = bytearray(capture.read_bytes())
        damaged[len(damaged) // 2] ^= 0x10
        capture.write_bytes(damaged)
        self.assertIn("packets are missing", self.refused("repeat", capture))

    def test_a_capture_without_a_tare_is_refused(self):
        self.assertIn("no tare", self.refused("repeat", self.capture("untared.bin", "stream contact,raw", "info")))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--player", required=True)
    parser.add_argument("--fingertip", required=True)
    parser.add_argument("--command-frame", required=True)
    parser.add_argument("--node")
    parser.add_argument("--image")
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
