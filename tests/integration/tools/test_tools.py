"""A short run of the tools' report: usage test_tools.py BUILD [unittest arguments]."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
BUILD = sys.argv[1]
sys.path[:0] = [str(ROOT / "host_tools/report" / folder) for folder in ("tools", "shared")]
import tools  # noqa: E402


def run(*arguments):
    return subprocess.run(
        [sys.executable, str(ROOT / "host_tools/report/tools/tools.py"), "--build", BUILD, *arguments], capture_output=True, text=True
    )


class Tools(unittest.TestCase):
    SECONDS = 3

    def test_every_packet_to_every_client_and_every_command_answered(self):
        with tempfile.TemporaryDirectory() as folder:
            done = run("-o", folder, "--seconds", str(self.SECONDS))
            self.assertEqual(done.returncode, 0, done.stderr)
            found = json.loads(pathlib.Path(folder, "tools.json").read_text(encoding="utf-8"))
            said = pathlib.Path(folder, "tools.md").read_text(encoding="utf-8")
        self.assertEqual((found["serve_clients"], found["serve_fingertips"]), (8, 2))
        self.assertEqual((found["serve_lost"], found["serve_gaps"], found["serve_unanswered"]), (0, 0, 0))
        # seven that are not stopped; each came before the middle
        self.assertGreater(found["serve_packets"], 7 * 2 * tools.RATE_Hz * self.SECONDS / 2)
        self.assertGreater(found["serve_commands"], 7 * 10 * self.SECONDS / 2)
        for name, _, _ in tools.GOALS:
            self.assertIn(f"| {name} |", said)
        self.assertLess(found["serve_added_median_us"], found["serve_added_p99_us"])

    def test_what_is_added(self):
        direct = np.array([[1, 100], [2, 200], [3, 300], [5, 500]])
        through = np.array([[2, 250], [3, 290], [4, 420], [5, 600]])
        self.assertEqual(list(tools.added(direct, through)), [50, -10, 100])

    def test_wrong_calls(self):
        with tempfile.TemporaryDirectory() as folder:
            done = run("-o", folder, "--seconds", "0")
            self.assertEqual((done.returncode, done.stderr), (1, "tools.py: --seconds 0 is out of range; give 1 to 3600\n"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
