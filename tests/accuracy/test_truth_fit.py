"""truth_fit on few pads: its keys are there, repeatable, and as good as the fit is meant to be.

usage: test_truth_fit.py TRUTH_FIT [unittest arguments]
"""

import json
import subprocess
import sys
import unittest

# (key, least, most): what a full run is held to, with room for a tenth of its pads.
GOALS = (
    ("cover_1sd_min", 54, 100),
    ("cover_1sd_max", 0, 77),
    ("cover_2sd_min", 92, 100),
    ("cal_warned_percent", 0, 6),
    ("cal_bad_unflagged_percent", 0, 0.2),
    ("raw_warned_percent", 0, 36),
    ("raw_bad_unflagged_percent", 0, 2),
    ("raw_20_bad_unflagged_percent", 0, 4),
    ("loaded_silent_percent", 0, 1),
    ("raw_loaded_silent_percent", 0, 4),
    ("unloaded_warned_percent", 0, 6),
    ("elongated_bad_unflagged_percent", 0, 3),
    ("round_elongated_percent", 0, 1),
)


def run(*options):
    return subprocess.run([PROGRAM, *options], capture_output=True, text=True, check=False)


class TruthFit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.options = ("--pads", "150", "--seed", "3")
        cls.text = run(*cls.options).stdout
        cls.found = json.loads(cls.text)

    def test_goals(self):
        for key, least, most in GOALS:
            with self.subTest(key):
                self.assertGreaterEqual(self.found[key], least)
                self.assertLessEqual(self.found[key], most)

    def test_four_iterations_do_what_more_do(self):
        medians = {}
        for row in self.found["iterations"]:
            medians.setdefault((row["layer_mm"], row["gain_percent"]), {})[row["iterations"]] = row["error_p50_mm"]
        self.assertEqual(len(medians), 4)
        for median in medians.values():
            self.assertEqual(sorted(median), [3, 4, 5, 6, 7, 8])
            self.assertLess(median[4], 1.03 * median[8])

    def test_calibration_helps(self):
        rows = {row["case"]: row for row in self.found["cases"]}
        self.assertLess(rows["12 mm, calibrated"]["error_p50_mm"], 0.5 * rows["12 mm, gains 10 %"]["error_p50_mm"])
        self.assertLess(rows["noise only"]["error_p50_mm"], 0.01)

    def test_the_same_seed_gives_the_same(self):
        self.assertEqual(run("--pads", "15", "--seed", "3").stdout, run("--pads", "15", "--seed", "3").stdout)

    def test_another_seed_gives_another(self):
        self.assertNotEqual(run("--pads", "15", "--seed", "4").stdout, run("--pads", "15", "--seed", "3").stdout)

    def test_wrong_usage_is_one_line(self):
        for options in (("--pads", "0"), ("--pads", "x"), ("--what", "1")):
            done = run(*options)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1))


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
