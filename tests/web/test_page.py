"""The page in a browser: what its user does, against emulated release images on the browser's serial ports.

usage: test_page.py --build BUILD --image FILE.bin --node NODE [--pictures FOLDER] [unittest arguments]

--pictures: only writes the reference pictures anew. Exit status 77: there is no such browser here, or nobody may give it ports.
"""
import argparse
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/web")]
import driven  # noqa: E402
import pictures  # noqa: E402
from browser import Browser, CannotRun  # noqa: E402
from fingertip import files  # noqa: E402
from fingertips import Bench  # noqa: E402

OPTIONS = argparse.Namespace()
SKIPPED = 77
PATIENCE_s = 120
SERIALS = ("E660583883265A01", "E660583883265A02")
FORCE_N = 3.0
NO_SAVE_DIALOG = "delete window.showSaveFilePicker; delete window.showOpenFilePicker;"


def run(*call):
    done = subprocess.run([str(part) for part in call], capture_output=True, text=True, timeout=PATIENCE_s)
    if done.returncode:
        raise AssertionError(f"{call}: {done.stdout}{done.stderr}")
    return done.stdout


class PageTest(unittest.TestCase):
    POLICY = {"SerialAllowAllPortsForUrls"}

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-")))
        cls.tool = OPTIONS.build / "host_tools/cli/fingertip"
        cls.server = cls.enterClassContext(Bench(OPTIONS))
        cls.url = cls.server.served()
        cls.browser = cls.enterClassContext(Browser(cls.folder, OPTIONS.build / "tests/web/libweb_test_ports.so", cls.policy()))

    @classmethod
    def policy(cls):
        return {"SerialAllowAllPortsForUrls": [cls.url]}

    def setUp(self):
        self.bench = self.enterContext(Bench(OPTIONS))

    def open(self, **options):
        page = self.browser.page(self.url + "/", before=options.pop("before", NO_SAVE_DIALOG), **options)
        self.addCleanup(page.close)
        self.addCleanup(self.nothing_else_happened, page)
        return page

    def nothing_else_happened(self, page):
        """Whatever was done: no request to elsewhere, nothing that its policy refused, no error that nobody caught."""
        self.assertEqual(page.foreign(), [])
        self.assertEqual([each["exceptionDetails"].get("exception", {}).get("description") for each in page.of("Runtime.exceptionThrown")], [])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path)
    parser.add_argument("--image", required=True, type=pathlib.Path)
    parser.add_argument("--node", required=True)
    _, rest = parser.parse_known_args(namespace=OPTIONS)
    try:
        with tempfile.TemporaryDirectory(prefix="fingertip-") as folder, Browser(folder, OPTIONS.build / "tests/web/libweb_test_ports.so"):
            pass
    except CannotRun as why:
        print(f"skipped: {why}")
        sys.exit(SKIPPED)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
