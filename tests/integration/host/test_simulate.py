"""fingertip simulate, and the command that finds what it simulates, on simulated time.

usage: test_simulate.py FINGERTIP SIMULATE TIME_KEEPER TABLES [unittest arguments]
"""

import contextlib
import csv
import json
import os
import re
import signal
import sys
import unittest

import numpy as np
from cli_case import FAKE_DEVICE as SIMULATE
from cli_case import CliTest
from fingertip import files, grip_file

TABLES = os.path.abspath(sys.argv[4])
LEFT, RIGHT = "00000000000CE110", "00000000000CE111"
WEIGHT_N = 0.3 * 9.80665


class SimulateTest(CliTest):
    @contextlib.contextmanager
    def simulated(self, *options, says=""):
        process = self.world.start([SIMULATE, "--cache", TABLES, *options], env=self.environment)
        ready = process.readline()
        self.assertTrue(ready.startswith("ready: "), process.read("stderr") if not ready else ready)
        yield
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
        self.assertEqual(process.returncode, 0, err)
        self.assertRegex(err, f"^{says}$")
        self.assertEqual(os.listdir(os.path.join(self.folder, "fingertip/simulated")), [])

    def run_simulate(self, *options, status):
        process = self.world.start([SIMULATE, *options], env=self.environment)
        out, err = process.communicate()
        self.assertEqual(process.returncode, status, err)
        return out, err


class Presses(SimulateTest):
    def test_what_is_felt_is_what_is_true(self):
        truth_csv = os.path.join(self.folder, "truth.csv")
        with self.simulated("--fingertips", "2", "--truth", truth_csv):
            self.run_cli("record", self.csv, "--all", "--seconds", "12")
        with open(truth_csv, encoding="ascii") as file:
            lines = [line for line in file if not line.startswith("#")]
        zero_us = int(files.read_recording(self.csv, serial=LEFT).metadata["host_zero_us"])
        for side, serial in (("left", LEFT), ("right", RIGHT)):
            names = ("time_us", f"{side}_x_mm", f"{side}_y_mm", f"{side}_force_N")
            time_us, x_mm, y_mm, force_N = np.array([[float(row[name] or "nan") for name in names] for row in csv.DictReader(lines)]).T
            felt = files.read_recording(self.csv, serial=serial)
            # of the time that it stood, and of the time that nothing touched, what lies 0.2 s within
            at = np.searchsorted(time_us, felt.time_us + zero_us).clip(100, len(time_us) - 101)
            for truth_N, wanted in ((WEIGHT_N, True), (0, False)):
                there = np.isclose(force_N, truth_N, rtol=1e-4)
                at_rest = there[at] & there[at - 100] & there[at + 100]
                self.assertGreater(np.count_nonzero(at_rest), 500)
                if wanted:
                    off_mm = np.hypot(felt["x_mm"] - x_mm[at], felt["y_mm"] - y_mm[at])[at_rest]
                    self.assertLess(np.median(off_mm), 1.0)
                    # never calibrated: the gains of the sensors near it, and the tails of a contact that is no Gaussian
                    self.assertLess(abs(np.median(felt["force_N"][at_rest]) / WEIGHT_N - 1), 0.15)
                else:
                    # what rubber keeps of the press before is not taken for a force
                    left = at_rest & ~np.isnan(felt["force_N"])
                    self.assertTrue((felt["flags"][left].astype(int) & files.Flag.ZERO_DOUBTFUL).all())

    def test_every_command_finds_them(self):
        with self.simulated("--fingertips", "2", "--gain-spread", "0"):
            lines = self.run_cli("list")[0].splitlines()
            self.assertEqual([line.split("\t")[:2] for line in lines], [[LEFT, "native"], [RIGHT, "native"]])
            self.assertRegex(self.error("info"), f"several fingertips found: {LEFT}, {RIGHT}")
            self.assertNotIn("its firmware is of version", self.run_cli("info", "--port", "sim:")[0])  # the same tree's
            for name, serial in (("sim:", LEFT), ("sim:left", LEFT), ("sim:right", RIGHT)):
                self.assertRegex(self.run_cli("info", "--port", name)[0], rf"(?m)^serial +{serial}$")
            self.assertIn("sim:up: nothing is simulated there; start `fingertip simulate`", self.error("info", "--port", "sim:up"))
            process = self.start("doctor", "--port", "sim:", "--json", "--seconds", "2")
            found = json.loads(process.communicate()[0])["findings"]
            self.assertEqual([one for one in found if one["verdict"] == "bad"], [])
            self.assertLessEqual({one["check"] for one in found if one["verdict"] == "warn"}, {"zero"})  # of a weight

    def test_calibrating_finds_the_gains(self):
        truth_csv = os.path.join(self.folder, "truth.csv")
        with self.simulated("--truth", truth_csv):
            process = self.start("calibrate", "--weight", "300", "--yes")
            _, err = process.communicate(limit_s=200)
            self.assertEqual(process.returncode, 0, err)
            shown = self.run_cli("calibrate", "--show")[0]
        with open(truth_csv, encoding="ascii") as file:
            true = np.array(next(line for line in file if line.startswith("# gain_left:")).split()[2:], float)
        found = np.array(re.findall(r"(?m)^ +\d+ +(\d\.\d+) ", shown), float)
        self.assertEqual(len(found), 15, shown)
        # What the rubber over a sensor keeps of a hold counts as gain; the mean belongs to the scale of force.
        self.assertGreater(np.std(true), 0.06)
        self.assertLess(np.std(found / np.mean(found) - true / np.mean(true)), 0.5 * np.std(true))

    def test_nothing_is_made_where_another_decides(self):
        shared, elsewhere = os.path.join(self.folder, "fingertip"), os.path.join(self.folder, "elsewhere")
        os.mkdir(elsewhere)
        for link, target in ((shared, elsewhere), (f"{shared}/simulated", elsewhere), (f"{shared}/simulated/lock", f"{elsewhere}/lock")):
            os.makedirs(os.path.dirname(link), exist_ok=True)
            os.symlink(target, link)
            _, err = self.run_simulate("--cache", TABLES, status=1)
            self.assertRegex(err, "is no folder of this user|simulated: Too many levels of symbolic links")
            self.assertEqual(os.listdir(elsewhere), [])
            os.unlink(link)

    def test_one_at_a_time(self):
        with self.simulated():
            process = self.world.start([SIMULATE, "--cache", TABLES], env=self.environment)
            _, err = process.communicate()
            self.assertEqual(process.returncode, 1)
            self.assertRegex(
                err, r"/fingertip/simulated: another simulation has its ports there; end that one, or .* folder \(--ports\)\n$"
            )
        self.assertIn("sim:: nothing is simulated there; start `fingertip simulate`", self.error("info", "--port", "sim:"))
        with self.simulated():  # what was left is in nobody's way
            pass


class Usage(SimulateTest):
    def test_help_fits_into_80_columns(self):
        page = self.run_simulate("--help", status=0)[0]
        self.assertIn("Usage: fingertip simulate", page)
        self.assertNotRegex(page, r"FLOAT|INT|TEXT| in \[")
        self.assertIn("--mass KG Its mass (0.001 to 10 kg; default 0.3; only with --lift; not with --kind)", " ".join(page.split()))
        self.assertLessEqual(max(map(len, page.splitlines())), 80)

    def test_wrong_usage(self):
        for options, problem in (
            (["--bogus"], '"--bogus" is no option of it'),
            (["--lift", "--press"], "--press excludes --lift"),
            (["--mass", "1"], "--mass requires --lift"),
            (["--fingertips", "3"], '--fingertips takes 1 to 2, not "3"'),
            (["--lift", "--mass", "x"], '--mass takes 0.001 to 10 kg, not "x"'),
            (["--lift", "--crushes", "0"], '--crushes takes 0.1 to 1000000 newtons, not "0"'),
            (["--lift", "--gripper", "hand"], '--gripper takes 2f85, 2f140, hande or sts3215, not "hand"'),
        ):
            self.assertEqual(self.run_simulate(*options, status=2), ("", f"fingertip: {problem}; see fingertip simulate --help\n"))


class Lifts(SimulateTest):
    def test_grasp_finds_two_and_the_gripper(self):
        with self.simulated("--lift", says=r"[0-9.]+ s: lift\n"):
            self.run_cli("grasp", "--gripper", "2f85", "--gripper-port", "sim:gripper", "--seconds", "8", "-o", self.csv)
        self.assertIn("holding", set(grip_file.read_grip(self.csv)["state"]))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]], verbosity=2)
