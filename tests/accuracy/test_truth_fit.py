"""The part fit of the report truth on few pads: its keys are there, repeatable, and as good as the fit is meant to be.

usage: test_truth_fit.py BUILD
"""

import argparse
import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / folder) for folder in ("report/truth", "report/measure", "report/shared", "python")]
import one_press  # noqa: E402
from fingertip.files import InputError  # noqa: E402
from measure import Measure  # noqa: E402

FIRMWARE = Measure(sys.argv.pop())
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


def run(pads, seed, parts=one_press.PARTS):
    return one_press.figures(FIRMWARE, argparse.Namespace(pads=pads, seed=seed), parts)


class TruthFit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = run(150, 3)

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

    def test_a_seed_decides_what_is_drawn(self):
        parts = (one_press.coverage, one_press.few_sensors)  # all kinds of draws
        once = run(4, 3, parts)
        self.assertEqual(run(4, 3, parts), once)
        self.assertNotEqual(run(4, 4, parts), once)

    def test_no_pads_are_refused(self):
        with self.assertRaises(InputError):
            run(0, 3)


if __name__ == "__main__":
    unittest.main()
