"""The report's lifts and slides on few runs: a lift is no slide, a slide is found soon, and motion alone cannot distinguish them.

usage: test_shear_motion.py BUILD [unittest arguments]
"""

import pathlib
import sys
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "report/shear", "python")]
import motion  # noqa: E402
from contacts import Contacts  # noqa: E402


def figures(seed, pads):
    return motion.figures(Contacts(BUILD), seed, pads, motion.CASES[:1])


class ShearMotion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = figures(seed=5, pads=60)
        (cls.case,) = cls.found["motion_cases"]

    def test_no_lift_is_a_slide(self):
        for duration in ("100ms", "300ms", "1s"):
            self.assertEqual(self.case[f"lifts_{duration}"], 60)
            self.assertEqual(self.found[f"lift_false_slides_{duration}"], 0)
        self.assertEqual(self.case["sliding_false_in_slides"], 0)

    def test_motion_alone_takes_brisk_lifts_for_slides(self):
        self.assertGreater(self.case["eq7_false_100ms"], 15)
        self.assertGreater(self.case["moving_false_100ms"], 10)

    def test_slides_are_found_soon(self):
        self.assertGreater(self.case["slips"], 30)
        self.assertGreaterEqual(self.found["slide_found_percent"], 97)
        self.assertLess(self.found["slide_latency_p95_ms"], 40)  # a full run: 32
        self.assertLess(self.found["slide_since_shown_p95_ms"], 20)  # 15
        self.assertLess(self.case["sliding_lasts_p95_ms"], 70)  # 58
        self.assertGreaterEqual(self.case["sliding_found_percent"], self.case["eq7_found_percent"])

    def test_slow_slides_are_found(self):
        self.assertGreaterEqual(self.case["slow_slips"], 1)
        self.assertEqual(self.case["sliding_slow_found_percent"], 100)
        self.assertEqual(self.case["moving_slow_found_percent"], 0)

    def test_the_same_seed_gives_the_same_and_another_another(self):
        with mock.patch.object(motion, "CALIBRATIONS", 2):
            once, again, other = (figures(seed, pads=1)["motion_cases"] for seed in (6, 6, 7))
        self.assertEqual(once, again)
        self.assertNotEqual(once, other)


if __name__ == "__main__":
    BUILD = sys.argv.pop(1)
    unittest.main()
