"""The pictures of boards/BRINGUP.md are drawn from the release images, and say of the clock what fast mode allows.

usage: test_traces.py --boards BUILD_OF_IMAGES
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, ROOT / "boards/drawing/traces.py"]
BOARDS = sys.argv.pop()
sys.argv.remove("--boards")
# UM10204 table 10, fast mode; SCL low and period with the rise of the emulator's lines
LEAST_ns = {"low": 1300, "high": 600, "period": 2500}


class Traces(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_both_boards_are_drawn(self):
        for board in ("pico_mux", "pico_parallel"):
            (self.folder / board).mkdir()
        done = subprocess.run([*COMMAND, "--boards", BOARDS, "-o", self.folder], capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        for board in ("pico_mux", "pico_parallel"):
            self.assertEqual((self.folder / board / "traces.png").read_bytes()[:4], b"\x89PNG")
            line = next(line for line in done.stdout.splitlines() if f"/{board}/" in line)
            told = {name: int(value) for name, value in re.findall(r"(low|high|period) (\d+) ns", line)}
            self.assertEqual(set(told), set(LEAST_ns))
            for name, least_ns in LEAST_ns.items():
                self.assertGreaterEqual(told[name], least_ns)
                self.assertLess(told[name], 2 * least_ns)

    def test_an_image_that_is_not_there_is_an_error(self):
        done = subprocess.run([*COMMAND, "--boards", self.folder, "-o", self.folder], capture_output=True, text=True)
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, "is not there; build it")


if __name__ == "__main__":
    unittest.main()
