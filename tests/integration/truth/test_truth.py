"""truth.py with figures in the place of its parts: what it merges, judges, writes and refuses."""

import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/report/truth"))
import truth  # noqa: E402

CASE = {
    "case": "12 mm, calibrated",
    "error_p50_mm": 0.14,
    "cover_1sd": 64.5,
    "cover_2sd": 97.6,
    "warned": 4.1,
    "bad": 0.2,
    "bad_unflagged": 0.01,
}
FOUND = {
    "fit": {
        "cover_1sd_min": 60.0,
        "cover_1sd_max": 76.0,
        "cases": [CASE],
        "iterations": [{"case": "12 mm", "layer_mm": 12, "gain_percent": 0.0, "iterations": k, "error_p50_mm": 0.1} for k in (3, 4)],
    },
    "calibration": {
        "cal_median_mm": 0.12,
        "before_cal_median_mm": 0.4,
        "truth_calibration": {"by_placements": [{"placements": 20, "median_mm": 0.12}]},
    },
}


class Truth(unittest.TestCase):
    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.enterContext(mock.patch.object(truth, "Measure"))
        figures = {part: lambda firmware, options, found=found: found for part, found in FOUND.items()}
        self.enterContext(mock.patch.dict(truth.FIGURES, figures))

    def run_parts(self, *options):
        with contextlib.redirect_stdout(io.StringIO()):
            return truth.main(["--build", "nowhere", "-o", str(self.out), "--parts", *options])

    def found(self):
        return json.loads((self.out / "truth.json").read_text())

    def test_parts_are_merged_and_judged(self):
        (self.out / "fit.json").write_text('{"cold_cycles": 30000, "masked_cycles": 63000}')
        self.assertEqual(self.run_parts("fit,calibration"), 0)
        verdicts = {name: goal["met"] for name, goal in self.found()["goals"].items()}
        self.assertTrue(verdicts["cover_1sd_min"] and verdicts["cal_median_mm"] and verdicts["cold_cycles"])
        self.assertFalse(verdicts["cover_1sd_max"] or verdicts["masked_cycles"])
        self.assertIsNone(verdicts["real_median_mm_worst_test"])
        self.assertIn("| cover_1sd_max | 76 | <= 75 | MISSED |", (self.out / "truth.md").read_text())
        self.assertIn("| 12 mm, calibrated |", (self.out / "truth.md").read_text())
        self.assertEqual((self.out / "truth.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_parts("fit", "--check"), 1)

    def test_a_part_alone_keeps_what_the_others_found(self):
        self.run_parts("calibration")
        self.run_parts("fit")
        self.assertEqual(self.found()["cal_median_mm"], 0.12)

    def test_options_reach_the_parts(self):
        with mock.patch.dict(truth.FIGURES, gate=lambda firmware, options: {"options": [options.seed, options.pads, options.recordings]}):
            self.run_parts("gate", "--seed", "3", "--pads", "2", "--recordings", "strips")
        self.assertEqual(self.found()["options"], [3, 2, "strips"])

    def test_what_goes_wrong_is_named(self):
        with self.assertRaisesRegex(truth.InputError, "thumb is none of"):
            self.run_parts("thumb")
        with mock.patch.object(truth, "Measure", side_effect=truth.MeasureError("build it")):
            with self.assertRaisesRegex(truth.InputError, "build it"):
                self.run_parts("fit")
        self.assertFalse((self.out / "truth.json").exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
