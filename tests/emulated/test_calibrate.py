"""A fingertip calibrated by its user: the tool on the port of the release image, a weight set down on the twin's pad, and what is measured after;
on simulated time.

The image keeps 50 frames/s in its flash first, so that three minutes of placements take seconds.

usage: test_calibrate.py --build BUILD --image FILE.bin --node NODE
"""

import argparse
import pathlib
import re
import subprocess
import tempfile
import unittest

import numpy as np
from emulation import files, main, options
from world import World

OPTIONS = argparse.Namespace()
PATIENCE_s = 600  # of the world's time
CALIBRATED = 1 << 19
FORCE_N = 3.0


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.scenario = cls.folder / "placements.csv"
        twin = [f"{OPTIONS.build}/host_tools/simulation/twin/twin", "scenario", "placements", "-o", cls.scenario]
        pad = options(effects="gain=10", seed=41, pad=7, cache=f"{OPTIONS.build}/contact_tables")
        subprocess.run([*twin, *pad], check=True, stdout=subprocess.DEVNULL)

    def start(self):
        """The image, powered on when its port is opened."""
        kept = {"flash": self.folder / "flash.bin"}
        return self.world.emulator(self.port, *options(board="pico_parallel", image=OPTIONS.image, scenario=self.scenario, **kept))

    def end(self, process):
        """What the flash holds is written when the run ends."""
        process.terminate()
        process.wait(PATIENCE_s)
        self.assertEqual(process.returncode, 0, process.read("stderr"))

    def tool(self, *arguments):
        return self.world.tool(*arguments, "--port", self.port, limit_s=PATIENCE_s)

    def test_a_weight_finds_the_gains_and_they_act(self):
        self.world = self.enterContext(World(f"{OPTIONS.build}/tests/support", OPTIONS.node, self.folder))
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
    main(OPTIONS, "build", "image", "node")
