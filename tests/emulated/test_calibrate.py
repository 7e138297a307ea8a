"""A fingertip calibrated by its user: the tool on the port of the release image, a weight set down on the twin's pad, and what is measured after.

The image keeps 50 frames/s in its flash first, so that three minutes of placements take seconds.

usage: test_calibrate.py --build BUILD --image FILE.bin --node NODE
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip import files  # noqa: E402

OPTIONS = argparse.Namespace()
PATIENCE_s = 240
CALIBRATED = 1 << 19
FORCE_N = 3.0


def run(*call):
    done = subprocess.run([str(part) for part in call], capture_output=True, text=True, timeout=PATIENCE_s)
    if done.returncode != 0:
        raise AssertionError(f"{call}: {done.stdout}{done.stderr}")
    return done.stdout


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.tool = OPTIONS.build / "host_tools/cli/fingertip"
        cls.scenario = cls.folder / "placements.csv"
        run(OPTIONS.build / "host_tools/twin/twin", "scenario", "placements", "-o", cls.scenario, "--gain", 10, "--seed", 41, "--pad", 7,
            "--cache", OPTIONS.build / "contact_tables")

    def start(self, name, *options):
        """The image, powered on when its port is opened; the port."""
        port = self.folder / name
        process = subprocess.Popen(
            [str(part) for part in (OPTIONS.node, ROOT / "host_tools/emulator/main.mjs", "--board", "pico_parallel", "--image", OPTIONS.image,
                                    "--scenario", self.scenario, "--flash", self.folder / "flash.bin", "--pace", "fast", "--pty", port,
                                    "--wait-open", *options)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        end_s = time.monotonic() + PATIENCE_s
        while not port.exists():
            self.assertIsNone(process.poll(), "the emulator ended")
            self.assertLess(time.monotonic(), end_s)
            time.sleep(0.05)
        return process, port

    def end(self, process):
        """What the flash holds is written when the run ends."""
        self.assertEqual(process.wait(PATIENCE_s), 0, process.stderr.read())

    def test_a_weight_finds_the_gains_and_they_act(self):
        process, port = self.start("first", "--seconds", 3)
        self.assertIn("kept", run(self.tool, "set", "rate=50", "--keep", "--port", port))
        self.end(process)

        process, port = self.start("second")
        said = run(self.tool, "calibrate", "--force", FORCE_N, "--yes", "--colour", "plain", "--port", port)
        self.assertIn("calibrated: it acts from now on", said)
        before_mm, after_mm = map(float, re.search(r"location off by +([\d.]+) mm +([\d.]+) mm", said).groups())
        self.assertGreater(before_mm, 0.3)
        self.assertLess(after_mm, 0.15)
        self.end(process)

        process, port = self.start("third", "--seconds", 20)
        shown = run(self.tool, "calibrate", "--show", "--port", port)
        recording_path = self.folder / "after.csv"
        run(self.tool, "record", recording_path, "--seconds", 10, "--port", port)
        self.end(process)

        found = np.array([float(gain) for gain in re.findall(r"(?m)^ +\d+ +(\d\.\d+) ", shown)])
        line = next(line for line in self.scenario.read_text().splitlines() if line.startswith("# gain_errors_percent: "))
        true = 1 + np.array([float(text) for text in line.partition(": ")[2].split()]) / 100
        self.assertEqual(len(found), len(true))
        self.assertLess(np.std(found / true), 0.015)
        self.assertGreater(np.std(true), 0.1)

        recording = files.read_recording(recording_path)
        flags = recording["flags"].astype(np.int64)
        self.assertTrue((flags[recording.has_contact] & CALIBRATED).all())
        held_N = recording["force_N"][recording.has_contact & (recording["force_N"] > 0.9 * FORCE_N)]
        self.assertGreater(len(held_N), 50)
        self.assertLess(abs(np.median(held_N) / FORCE_N - 1), 0.02)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path)
    parser.add_argument("--image", required=True, type=pathlib.Path)
    parser.add_argument("--node", required=True)
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
