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
OPTIONS = argparse.Namespace()
PYTHON = ROOT / "host_tools/python"


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True)


def must(*command):
    done = run(*command)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class Player(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.scenario = cls.folder / "demo.csv"
        must(sys.executable, PYTHON / "scenario.py", "demo", "-o", cls.scenario)

    def play(self, name, *more, scenario=None):
        recording = self.folder / name
        must(OPTIONS.player, "play", scenario or self.scenario, "-o", recording, *more)
        return recording

    def evaluated(self, recording):
        summary = self.folder / "summary.json"
        summary.unlink(missing_ok=True)
        must(sys.executable, PYTHON / "evaluate.py", recording, self.scenario, "-o", summary)
        return json.loads(summary.read_text())

    def refused(self, *arguments):
        done = run(OPTIONS.player, *arguments)
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

    def test_a_recording_stays(self):
        recording = self.play("kept.csv", "--seconds", "1")
        before = recording.read_bytes()
        self.assertIn("kept.csv", self.refused("play", self.scenario, "-o", recording))
        self.assertEqual(recording.read_bytes(), before)

    def test_bad_scenarios_are_refused_with_their_place(self):
        good = self.scenario.read_text().splitlines(keepends=True)
        rows = [i for i, line in enumerate(good) if line[0].isdigit()]
        cases = {
            "no scenario": (["t_s,contact\n"], ":1: not a scenario"),
            "cut off": (good[:rows[3]] + [good[rows[3]][:20]], "ends within a line"),
            "no number": (good[:rows[3]] + [good[rows[3]].replace(",", ",x", 1)], f":{rows[3] + 1}: column"),
            "time goes back": (good[:rows[3]] + [good[rows[0]]], "does not increase"),
            "no rows": (good[:rows[0]], "no rows"),
            "too far": (good[:rows[3]] + [",".join(good[rows[3]].split(",")[:8] + ["2e7"] * 15) + "\n"], "at most 1e7"),
        }
        for name, (lines, message) in cases.items():
            with self.subTest(name):
                path = self.folder / "bad.csv"
                path.write_text("".join(lines))
                self.assertIn(message, self.refused("play", path, "-o", self.folder / "never.csv"))
                self.assertFalse((self.folder / "never.csv").exists())
        self.assertIn("check the path", self.refused("play", self.folder / "missing.csv", "-o", self.folder / "never.csv"))

    def test_wrong_options(self):
        out = ("-o", self.folder / "never.csv")
        self.assertIn("256", self.refused("play", self.scenario, *out, "--osr", "300"))
        self.assertIn("belong together", self.refused("play", self.scenario, *out, "--prior-sigma", "3"))
        self.assertIn("belong together", self.refused("play", self.scenario, *out, "--slip-window", "50"))

    def capture(self, name, *commands):
        if not OPTIONS.image:
            self.skipTest("no firmware image in this build")
        script = self.folder / "host.txt"
        words = [must(OPTIONS.fingertip, "encode", *command.split()).strip() for command in commands]
        script.write_text("0.5 dtr 1\n" + "".join(f"{0.52 + 0.01 * i:.2f} {word}\n" for i, word in enumerate(words)))
        path = self.folder / name
        must(OPTIONS.node, ROOT / "host_tools/emulator/main.mjs", "--board", "pico_mux", "--image", OPTIONS.image,
             "--scenario", self.scenario, "--host-script", script, "--capture", path, "--seconds", "1.6", "--fast-enumeration")
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
    parser.add_argument("--node")
    parser.add_argument("--image")
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
