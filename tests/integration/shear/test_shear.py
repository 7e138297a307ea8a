"""shear.py with figures in the place of its parts: what it merges, judges, writes and refuses."""

import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/report/shear"))
import shear  # noqa: E402
from fingertip.files import InputError  # noqa: E402

ROW = {
    "case": "10 %, calibrated, Q/F 0.3",
    "touches": 10,
    "valid_percent": 100.0,
    "ratio_error_p50": 0.011,
    "ratio_error_p95": 0.04,
    "vector_error_p50": 0.019,
    "vector_error_p95": 0.056,
    "direction_p90_deg": 5.9,
    "location_p50_mm": 0.08,
    "location_p95_mm": 0.25,
    "pad": "10 %, calibrated",
    "load": 0.3,
}
TAP = {
    "pad": "equal gains",
    "load": 0.3,
    "location_without_p50_mm": 1.03,
    "location_without_p95_mm": 1.3,
    "location_p50_mm": 0.0612,
    "location_p95_mm": 0.1,
    "force_without_p50_percent": 9.1,
    "force_p50_percent": 0.2,
    "force_scaled_without_p50_percent": 0.6,
    "force_scaled_p50_percent": 0.1,
    "elongated_percent": 40.0,
}
MISS = {**ROW, "case": "lime, corner", "off_by_0_05_percent": 50.0, "off_by_5_deg_percent": 60.0}
FOUND = {
    "static": {
        "ratio_error_p50": 0.011,
        "vector_error_p95": 0.056,
        "elongated_false_percent": 14.0,
        "screw_ratio": 0.015,
        "by_pad_and_load": [ROW],
        "bounds": [{**{name: ROW[name] for name in ROW if name not in ("pad", "load", "valid_percent")}, "case": "noise; priors"}],
        "taps": [TAP],
        "where_misses_lie": [MISS],
    },
    "motion": {
        "slide_found_percent": 98.5,
        "slide_latency_p95_ms": 30.0,
        "lift_false_slides_100ms": 0,
        "lift_false_slides_1s": 2,
        "slides": [{"speed_mm_s": 20, "found": "all of them"}],
    },
}


class Shear(unittest.TestCase):
    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "out"
        self.enterContext(mock.patch.dict(shear.MEASURE, {part: lambda options, found=found: found for part, found in FOUND.items()}))

    def run_tool(self, *options):
        self.printed = io.StringIO()
        with contextlib.redirect_stdout(self.printed):
            return shear.main(["--build", "nowhere", "--boards", "nowhere", "-o", str(self.out), *options])

    def found(self):
        return json.loads((self.out / "shear.json").read_text())

    def test_parts_are_merged_and_judged(self):
        self.assertEqual(self.run_tool(), 0)
        self.assertIn("not built, so not measured: chip", self.printed.getvalue())
        found = self.found()
        verdicts = {name: goal["met"] for name, goal in found["goals"].items()}
        self.assertTrue(verdicts["ratio_error_p50"] and verdicts["slide_found_percent"] and verdicts["screw_ratio"])
        for missed in ("vector_error_p95", "elongated_false_percent", "slide_latency_p95_ms", "lift_false_slides"):
            self.assertIs(verdicts[missed], False, missed)
        self.assertEqual(found["lift_false_slides"], 2)
        self.assertIsNone(verdicts["optimum_p99_um"])
        self.assertEqual((self.out / "shear.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_tool("--parts", "static", "--check"), 1)

    def test_what_is_written_to_read(self):
        self.run_tool()
        lines = (self.out / "shear.md").read_text().split("\n")
        self.assertIn("| elongated_false_percent | 14 | <= 1 | MISSED |", lines)
        self.assertIn("| noise; priors | 10 | 0.011 | 0.04 | 0.019 | 0.056 | 5.9 | 0.08 | 0.25 |", lines)
        self.assertIn("| equal gains | 0.3 | 1.03 | 1.3 | 0.0612 | 0.1 | 9.1 | 0.2 | 0.6 | 0.1 | 40 |", lines)
        self.assertIn("## Where the misses lie", lines)
        self.assertNotIn("## By oversampling", lines)  # was not measured
        self.assertEqual(lines[lines.index("## slides") :][2:], ["| speed_mm_s | found |", "|---|---|", "| 20 | all of them |", ""])
        for table in "\n".join(lines).split("\n\n"):  # each row has the cells of its header
            if table.startswith("|"):
                self.assertEqual(len({row.count("|") for row in table.strip().split("\n")}), 1, table[:80])

    def test_the_page_has_its_part(self):
        self.run_tool()
        page = (self.out / "index.html").read_text()
        for words in ('<h2 id="shear">Tangential force</h2>', "elongated_false_percent", "Where the misses lie"):
            self.assertIn(words, page)
        self.assertNotIn("(shear.png): <strong>not drawn", page)

    def test_a_part_alone_keeps_what_the_others_found(self):
        self.assertEqual(self.run_tool("--parts", "motion"), 0)
        self.assertIsNone(self.found()["ratio_error_p50"])
        self.assertEqual(self.run_tool("--parts", "static"), 0)
        self.assertEqual((self.found()["slide_found_percent"], self.found()["ratio_error_p50"]), (98.5, 0.011))

    def test_the_optimum_is_read_where_it_was_left(self):
        self.out.mkdir()
        (self.out / "shear_optimum.json").write_text('{"optimum_p99_um": 1.5, "optimum_p99_ratio": 0.002}')
        self.run_tool("--parts", "motion")
        goals = self.found()["goals"]
        self.assertEqual((goals["optimum_p99_um"]["met"], goals["optimum_p99_ratio"]["met"]), (True, False))

    def test_what_goes_wrong_is_an_error(self):
        for part, words in (("chip", "is not there; build it"), ("thumb", "thumb is none of")):
            with self.assertRaisesRegex(InputError, words):
                self.run_tool("--parts", part)


if __name__ == "__main__":
    unittest.main(verbosity=2)
