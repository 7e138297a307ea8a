"""Reports whose parts answer at once: what is merged, judged, written and refused. The parts have tests of their own.

usage: test_reports.py shear|truth|two [unittest arguments]
"""

import contextlib
import importlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[3]
NAME = sys.argv.pop(1)
sys.path.insert(0, str(ROOT / "host_tools/report" / NAME))
report = importlib.import_module(NAME)
from fingertip.files import InputError  # noqa: E402

ERRORS = {"ratio_error_p50": 0.011, "ratio_error_p95": 0.04, "vector_error_p50": 0.019, "vector_error_p95": 0.056}
ROW = {"case": "10 %, calibrated, Q/F 0.3", "touches": 10, "valid_percent": 100.0, **ERRORS, "pad": "10 %, calibrated", "load": 0.3}
PAIR = {**dict.fromkeys(("one", "pulled", "none", "undecided"), 0.0), "long": 40.0, "two": 60.0, "two_and_right": 59.0}
PAIR |= {"off_p50_mm": 0.2, "off_p95_mm": 0.9}
CASE = {"case": "12 mm, calibrated", "error_p50_mm": 0.14, "cover_1sd": 64.5, "cover_2sd": 97.6, "warned": 4.1, "bad": 0.2}
ITERATIONS = [{"case": "12 mm", "layer_mm": 12, "gain_percent": 0.0, "iterations": k, "error_p50_mm": 0.1} for k in (3, 4)]
# What the parts of each report find; the goals that these meet, miss, and say nothing of; lines of the text; a part that is not built.
REPORTS = {
    "shear": {
        "found": {
            "static": {
                **{"ratio_error_p50": 0.011, "vector_error_p95": 0.056, "elongated_false_percent": 14.0, "screw_ratio": 0.015},
                "by_pad_and_load": [ROW],
                "where_misses_lie": [{**ROW, "case": "lime, corner", "off_by_0_05_percent": 50.0, "off_by_5_deg_percent": 60.0}],
            },
            "motion": {
                **{"slide_found_percent": 98.5, "slide_latency_p95_ms": 30.0, "lift_false_slides_100ms": 0, "lift_false_slides_1s": 2},
                "slides": [{"speed_mm_s": 20, "found": "all of them"}],
            },
        },
        "kept": {"truth.json": {"pulled_vector_error_p95": 0.079}},
        "met": ("ratio_error_p50", "slide_found_percent", "screw_ratio", "pulled_error_p95"),
        "missed": ("vector_error_p95", "elongated_false_percent", "slide_latency_p95_ms", "lift_false_slides"),
        "open": "optimum_p99_um",
        "lines": ("| elongated_false_percent | 14 | <= 1 | MISSED |",),
    },
    "truth": {
        "found": {
            "fit": {"cover_1sd_min": 60.0, "cover_1sd_max": 76.0, "cases": [{**CASE, "bad_unflagged": 0.01}], "iterations": ITERATIONS},
            "calibration": {
                **{"cal_median_mm": 0.12, "before_cal_median_mm": 0.4},
                "truth_calibration": {"by_placements": [{"placements": 20, "median_mm": 0.12}]},
            },
            "over_time": {"plain_cover_1sd_percent": 92.0, "thin_cover_1sd_percent": 80.0, "over_time": [{"pad": "plain", "pads": 3}]},
        },
        "kept": {"reliability.json": {"flash_lost": 0, "flash_frames_skipped": 2}},
        "met": ("cover_1sd_min", "cal_median_mm", "flash_lost", "thin_cover_1sd_percent"),
        "missed": ("cover_1sd_max", "flash_frames_skipped", "plain_cover_1sd_percent"),
        "open": "real_median_mm_worst_test",
        "lines": (
            "| plain_cover_1sd_percent | 92 | 55 to 80 | MISSED |",
            "| plain | 3 |",
            "| 12 mm, calibrated | 0.14 | 64.5 | 97.6 | 4.1 | 0.2 | 0.01 |",
        ),
    },
    "two": {
        "found": {
            "touches": {
                **{"two_right_percent_8mm": 59.0, "one_called_two_percent": 0.1},
                "touches": [{"case": f"two, {apart} mm, {ratio}", **PAIR} for ratio in ("1:1", "3:1") for apart in (6, 8, 10, 12, 15, 20)],
            }
        },
        "met": ("one_called_two_percent",),
        "missed": ("two_right_percent_8mm",),
        "open": "cycles_core1_max",
        "lines": ("| two_right_percent_8mm | 59 | >= 90 | MISSED |", "| two, 12 mm, 3:1 | 0 | 0 | 0 | 0 | 40 | 60 | 59 | 0.2 | 0.9 |"),
        "not_built": "cycles",
    },
}
FOUND, PARTS, EXPECTED = REPORTS[NAME]["found"], ",".join(REPORTS[NAME]["found"]), REPORTS[NAME]


class Folder(unittest.TestCase):
    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.enterContext(mock.patch.dict(report.MEASURE, {part: lambda options, found=found: found for part, found in FOUND.items()}))

    def run_parts(self, parts, *options):
        with contextlib.redirect_stdout(io.StringIO()):
            return report.main(["--build", "nowhere", "-o", str(self.out), "--parts", parts, *options])

    def verdicts(self):
        return {name: goal["met"] for name, goal in json.loads((self.out / f"{NAME}.json").read_text())["goals"].items()}


class Report(Folder):
    def test_parts_are_merged_judged_and_written(self):
        for name, figures in EXPECTED.get("kept", {}).items():
            (self.out / name).write_text(json.dumps(figures))
        self.assertEqual(self.run_parts(PARTS), 0)
        verdicts = self.verdicts()
        for wanted, names in ((True, EXPECTED["met"]), (False, EXPECTED["missed"]), (None, (EXPECTED["open"],))):
            for name in names:
                self.assertIs(verdicts[name], wanted, name)
        lines = (self.out / f"{NAME}.md").read_text().split("\n")
        for line in EXPECTED["lines"]:
            self.assertIn(line, lines)
        for table in "\n".join(lines).split("\n\n"):  # each row has the cells of its header
            if table.startswith("|"):
                self.assertEqual(len({row.count("|") for row in table.strip().split("\n")}), 1, table[:80])
        self.assertEqual((self.out / f"{NAME}.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        page = (self.out / "index.html").read_text()
        self.assertIn(f'<h2 id="{NAME}">', page)
        self.assertNotIn(f"({NAME}.png): <strong>not drawn", page)
        self.assertEqual(self.run_parts(PARTS, "--check"), 1)

    def test_a_part_alone_keeps_what_the_others_found(self):
        self.run_parts(PARTS)
        before = self.verdicts()
        self.run_parts(PARTS.split(",")[0])
        self.assertEqual(self.verdicts(), before)

    def test_what_goes_wrong_is_an_error_and_writes_nothing(self):
        wrong = [("thumb", "thumb is none of")] + [(part, "is not there; build it") for part in [EXPECTED.get("not_built")] if part]
        for part, words in wrong:
            with self.assertRaisesRegex(InputError, words):
                self.run_parts(part, *(("--boards", "nowhere") if NAME == "two" else ()))
            self.assertFalse((self.out / f"{NAME}.json").exists())


if NAME == "shear":

    class Shear(Folder):
        def test_text_has_sections_of_what_was_measured_and_the_optimum_where_it_was_left(self):
            (self.out / "shear_optimum.json").write_text('{"optimum_p99_um": 1.5, "optimum_p99_ratio": 0.002}')
            self.run_parts(PARTS)
            self.assertEqual((self.verdicts()["optimum_p99_um"], self.verdicts()["optimum_p99_ratio"]), (True, False))
            lines = (self.out / "shear.md").read_text().split("\n")
            self.assertIn("## Where the misses lie", lines)
            self.assertNotIn("## By oversampling", lines)
            self.assertEqual(lines[lines.index("## slides") :][2:], ["| speed_mm_s | found |", "|---|---|", "| 20 | all of them |", ""])


if NAME == "truth":

    class Truth(Folder):
        def test_options_reach_the_parts_and_a_missing_build_is_an_error(self):
            figures = lambda firmware, options: {"options": [options.seed, options.pads, options.recordings]}
            with mock.patch.object(report.zero_and_gate, "figures", figures):
                with mock.patch.object(report, "Measure"):
                    self.run_parts("gate", "--seed", "3", "--pads", "2", "--recordings", "strips")
                self.assertEqual(json.loads((self.out / "truth.json").read_text())["options"], [3, 2, "strips"])
                with self.assertRaisesRegex(InputError, "build it"):
                    self.run_parts("gate")


if NAME == "two":

    class Nightly(unittest.TestCase):
        def test_a_figure_that_was_not_measured_is_missed(self):
            sys.path.insert(0, str(ROOT / "tests/nightly"))
            nightly, found = importlib.import_module("nightly"), {"lost": None, "found": 0, "answer_s": 9}
            with tempfile.TemporaryDirectory() as folder, mock.patch.object(nightly, "REPORT", pathlib.Path(folder)):
                self.assertEqual(nightly.keep("tools", found, [(name, "<=", 1) for name in found]), ["lost"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
