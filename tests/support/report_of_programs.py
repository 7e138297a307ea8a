"""A report (host_tools/report/NAME/NAME.py) with scripts in the place of the programs that it runs."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class ReportOfPrograms(unittest.TestCase):
    NAME = ""
    FOUND = {}  # part: what its program prints

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.out = self.folder / "out"
        for part, found in self.FOUND.items():
            self.program(part, f"print({json.dumps(found)!r})")

    def program(self, part, body):
        path = self.folder / "host_tools/report" / self.NAME / part / f"{self.NAME}_{part}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!{sys.executable}\nimport sys\n{body}\n")
        path.chmod(0o755)

    def run_tool(self, *options):
        return subprocess.run(
            [
                sys.executable,
                str(ROOT / f"host_tools/report/{self.NAME}/{self.NAME}.py"),
                "--build",
                str(self.folder),
                "--boards",
                str(self.folder),
                "-o",
                str(self.out),
                *options,
            ],
            capture_output=True,
            text=True,
        )

    def found(self):
        return json.loads((self.out / f"{self.NAME}.json").read_text())

    def fails_in_one_line(self, cases):
        """cases: a part, and what is said if it is asked for."""
        for part, words in cases:
            with self.subTest(part):
                done = self.run_tool("--parts", part)
                self.assertEqual(done.returncode, 1)
                self.assertIn(words, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1)
                self.assertFalse((self.out / f"{self.NAME}.json").exists())
