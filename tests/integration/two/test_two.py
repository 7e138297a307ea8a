"""two.py with figures in the place of its parts: what it judges, writes and refuses."""

import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/report/two"))
import two  # noqa: E402
from fingertip.files import InputError  # noqa: E402

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


FOUND = {
    "two_right_percent_8mm": 59.0,
    "one_called_two_percent": 0.1,
    "touches": ROWS,
}


class Two(unittest.TestCase):
    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.enterContext(mock.patch.dict(two.MEASURE, {"touches": lambda options: FOUND}))

    def run_parts(self, *options):
        with contextlib.redirect_stdout(io.StringIO()):
            return two.main(["--build", "nowhere", "--boards", "nowhere", "-o", str(self.out), "--parts", *options])

    def test_figures_are_judged_and_written(self):
        self.assertEqual(self.run_parts("touches"), 0)
        found = json.loads((self.out / "two.json").read_text())
        verdicts = {name: goal["met"] for name, goal in found["goals"].items()}
        self.assertTrue(verdicts["one_called_two_percent"])
        self.assertFalse(verdicts["two_right_percent_8mm"])
        self.assertIsNone(verdicts["cycles_core1_max"])
        text = (self.out / "two.md").read_text()
        self.assertIn("| two_right_percent_8mm | 59 | >= 90 | MISSED |", text)
        self.assertIn("| two, 12 mm, 3:1 |", text)
        self.assertEqual((self.out / "two.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_parts("touches", "--check"), 1)

    def test_what_is_wrong_is_an_error_and_writes_nothing(self):
        for part, words in (("cycles", "is not there; build it"), ("thumb", "thumb is none of")):
            with self.assertRaisesRegex(InputError, words):
                self.run_parts(part)
            self.assertFalse((self.out / "two.json").exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
