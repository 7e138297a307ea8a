"""What the tests of the long reports share: one report is made in its short form, then asked what it found.

usage of such a test: test_NAME.py --build BUILD --boards BOARDS [unittest arguments]
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
OPTIONS = argparse.Namespace()


class ReportCase(unittest.TestCase):
    NAME = ""  # of its folder, its program and its figures

    @classmethod
    def report(cls, folder, *more, build=None, boards=None):
        program = ROOT / f"host_tools/report/{cls.NAME}/{cls.NAME}.py"
        words = [program, "--build", build or OPTIONS.build, "--boards", boards or OPTIONS.boards, "-o", folder, *more]
        return subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True)

    @classmethod
    def make(cls, *short):
        """The report, whose figures are in cls.found and whose files are in cls.folder."""
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        done = cls.report(cls.folder, *short)
        if done.returncode != 0:
            raise AssertionError(done.stdout + done.stderr)
        cls.printed, cls.found = done.stdout, json.loads((cls.folder / f"{cls.NAME}.json").read_text())

    def assert_refused(self, words, *more, **where):
        """With one line that has these words."""
        done = self.report(self.folder / "other", *more, **where)
        self.assertEqual((done.returncode, done.stderr.strip().count("\n")), (1, 0), done.stderr)
        self.assertIn(words, done.stderr)


def main():
    parser = argparse.ArgumentParser()
    for option in ("build", "boards"):
        parser.add_argument(f"--{option}", required=True)
    _, rest = parser.parse_known_args(namespace=OPTIONS)
    unittest.main("__main__", argv=[sys.argv[0], *rest], verbosity=2)
