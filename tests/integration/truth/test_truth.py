"""truth.py with programs in the place of its parts: what it merges, judges, writes and refuses."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from report_of_programs import ReportOfPrograms  # noqa: E402

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


class Truth(ReportOfPrograms):
    NAME, FOUND = "truth", FOUND

    def test_parts_are_merged_and_judged(self):
        self.out.mkdir()
        (self.out / "fit.json").write_text('{"cold_cycles": 30000, "masked_cycles": 63000}')
        done = self.run_tool("--parts", "fit,calibration")
        self.assertEqual(done.returncode, 0, done.stderr)
        verdicts = {name: goal["met"] for name, goal in self.found()["goals"].items()}
        self.assertTrue(verdicts["cover_1sd_min"] and verdicts["cal_median_mm"] and verdicts["cold_cycles"])
        self.assertFalse(verdicts["cover_1sd_max"] or verdicts["masked_cycles"])
        self.assertIsNone(verdicts["real_median_mm_worst_test"])
        self.assertIn("| cover_1sd_max | 76 | <= 75 | MISSED |", (self.out / "truth.md").read_text())
        self.assertIn("| 12 mm, calibrated |", (self.out / "truth.md").read_text())
        self.assertEqual((self.out / "truth.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_tool("--parts", "fit", "--check").returncode, 1)

    def test_a_part_alone_keeps_what_the_others_found(self):
        self.assertEqual(self.run_tool("--parts", "calibration").returncode, 0)
        self.assertEqual(self.run_tool("--parts", "fit").returncode, 0)
        self.assertEqual(self.found()["cal_median_mm"], 0.12)

    def test_options_reach_the_parts(self):
        self.program("gate", "import json; print(json.dumps({'said': sys.argv[1:]}))")
        self.assertEqual(self.run_tool("--parts", "gate", "--seed", "3", "--pads", "2", "--recordings", "strips").returncode, 0)
        self.assertEqual(self.found()["said"], ["--seed", "3", "--pads", "2", "--recordings", "strips"])

    def test_what_goes_wrong_is_one_line(self):
        self.program("fit", "sys.exit(3)")
        self.program("calibration", "print('no figures')")
        self.fails_in_one_line(
            (
                ("fit", "ended with status 3"),
                ("calibration", "wrote no JSON"),
                ("gate", "is not there; build it"),
                ("thumb", "thumb is none of"),
            )
        )


if __name__ == "__main__":
    unittest.main(verbosity=2)
