"""A fingertip calibrated by its user: the tool on the port of the release image, a weight set down on the twin's pad, and what is measured after;
on simulated time.

The image keeps 50 frames/s in its flash first, so that three minutes of placements take seconds.

usage: test_calibrate.py --build BUILD --image FILE.bin --node NODE
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip import files  # noqa: E402
from world import World  # noqa: E402

OPTIONS = argparse.Namespace()
PATIENCE_s = 600  # of the world's time
CALIBRATED = 1 << 19
FORCE_N = 3.0


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.scenario = cls.folder / "placements.csv"
        subprocess.run(
            [
                OPTIONS.build / "host_tools/simulation/twin/twin",
                "scenario",
                "placements",
                "-o",
                cls.scenario,
                "--gain",
                "10",
                "--seed",
                "41",
                "--pad",
                "7",
                "--cache",
                OPTIONS.build / "contact_tables",
            ],
            check=True,
            stdout=subprocess.DEVNULL,
        )

    def start(self, *options):
        """The image, powered on when its port is opened."""
        return self.world.emulator(
            self.port,
            "--board",
            "pico_parallel",
            "--image",
            OPTIONS.image,
            "--scenario",
            self.scenario,
            "--flash",
            self.folder / "flash.bin",
            *options,
        )

    def end(self, process):
        """What the flash holds is written when the run ends."""
        process.terminate()
        process.wait(PATIENCE_s)
        self.assertEqual(process.returncode, 0, process.read("stderr"))

    def tool(self, *arguments):
        return self.world.tool(*arguments, "--port", self.port, limit_s=PATIENCE_s)

    def test_a_weight_finds_the_gains_and_they_act(self):
        self.world = self.enterContext(World(OPTIONS.build / "tests/support", OPTIONS.node, self.folder))
        self.port = self.folder / "port"
        process = self.start()
        self.assertIn("kept", self.tool("set", "rate=50", "--keep"))
        self.end(process)

        process = self.start()
        said = self.tool("calibrate", "--force", FORCE_N, "--yes", "--colour", "plain")
        self.assertIn("calibrated: it applies from now on", said)
        before_mm, after_mm = map(float, re.search(r"location off by +([\d.]+) mm +([\d.]+) mm", said).groups())
        self.assertGreater(before_mm, 0.3)
        self.assertLess(after_mm, 0.15)
        self.end(process)

        process = self.start()
        shown = self.tool("calibrate", "--show")
        recording_path = self.folder / "after.csv"
        self.tool("record", recording_path, "--seconds", 10)
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
