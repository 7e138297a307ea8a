"""two.py with a program in the place of its touches: what it judges, writes and refuses."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from report_of_programs import ReportOfPrograms  # noqa: E402

CALLED = {"one": 0.0, "pulled": 0.0, "long": 40.0, "two": 60.0, "none": 0.0, "undecided": 0.0}
ROWS = [
    {
        "case": f"two, {apart} mm, {ratio}",
        **CALLED,
        "two_and_right": 59.0,
        "possible": 70.0,
        "possible_rubber_known": 90.0,
        "off_p50_mm": 0.2,
        "off_p95_mm": 0.9,
    }
    for ratio in ("1:1", "3:1")
    for apart in (6, 8, 10, 12, 15, 20)
]


class Two(ReportOfPrograms):
    NAME, FOUND = (
        "two",
        {
            "touches": {
                "two_right_percent_8mm": 59.0,
                "one_called_two_percent": 0.1,
                "touches": ROWS,
                **{
                    f"two_possible_{kind}_{pair}": 61.25
                    for kind in ("percent", "model_halved_percent", "model_quartered_percent", "rubber_known_percent")
                    for pair in ("8mm", "12mm", "10mm_3to1")
                },
            }
        },
    )

    def test_figures_are_judged_and_written(self):
        done = self.run_tool("--parts", "touches")
        self.assertEqual(done.returncode, 0, done.stderr)
        verdicts = {name: goal["met"] for name, goal in self.found()["goals"].items()}
        self.assertTrue(verdicts["one_called_two_percent"])
        self.assertFalse(verdicts["two_right_percent_8mm"])
        self.assertIsNone(verdicts["cycles_core1_max"])
        text = (self.out / "two.md").read_text()
        self.assertIn("| two_right_percent_8mm | 59 | >= 90 | MISSED |", text)
        self.assertIn("| 8 mm, 1:1 | >= 90 | 61.2 | 61.2 | 61.2 | 61.2 | 59 |", text)
        self.assertIn("| two, 12 mm, 3:1 |", text)
        self.assertEqual((self.out / "two.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_tool("--parts", "touches", "--check").returncode, 1)

    def test_options_reach_the_program(self):
        self.program("touches", "import json; print(json.dumps({'said': sys.argv[1:]}))")
        self.assertEqual(self.run_tool("--parts", "touches", "--seed", "3", "--pads", "2").returncode, 0)
        self.assertEqual(self.found()["said"], ["--cache", str(self.out / "contact_tables"), "--seed", "3", "--pads", "2"])

    def test_what_goes_wrong_is_one_line(self):
        self.program("touches", "sys.exit(3)")
        self.fails_in_one_line((("touches", "ended with status 3"), ("cycles", "is not there; build it"), ("thumb", "thumb is none of")))


if __name__ == "__main__":
    unittest.main(verbosity=2)
