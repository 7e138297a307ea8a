"""shear_motion on few acts: a lift is no slide, a slide is found soon, and what looks at motion alone cannot tell them apart.

usage: test_shear_motion.py SHEAR_MOTION [unittest arguments]
"""

import json
import subprocess
import sys
import unittest


def run(*options):
    return subprocess.run([PROGRAM, *options], capture_output=True, text=True, check=False)


class ShearMotion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.options = ("--usual", "--pads", "60", "--seed", "5")
        cls.text = run(*cls.options).stdout
        cls.found = json.loads(cls.text)
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

    def test_series_have_a_value_for_each_frame(self):
        for name in ("lift", "slide"):
            series = self.found["motion_series"][name]
            lengths = {len(values) for key, values in series.items() if key != "slips_s"}
            self.assertEqual(len(lengths), 1)
            self.assertGreater(lengths.pop(), 400)
        self.assertNotIn("slips_s", self.found["motion_series"]["lift"])
        self.assertEqual(max(self.found["motion_series"]["slide"]["sliding"]), 1)
        self.assertEqual(max(self.found["motion_series"]["lift"]["sliding"]), 0)

    def test_the_same_seed_gives_the_same_and_another_another(self):
        self.assertEqual(run("--usual", "--pads", "4", "--seed", "6").stdout, run("--usual", "--pads", "4", "--seed", "6").stdout)
        self.assertNotEqual(run("--usual", "--pads", "4", "--seed", "7").stdout, run("--usual", "--pads", "4", "--seed", "6").stdout)

    def test_wrong_usage_is_one_line(self):
        for options in (("--pads", "0"), ("--pads", "x"), ("--what", "1")):
            done = run(*options)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1))


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
