"""fingertip gripper by hand, with simulated grippers on simulated time.

usage: test_gripper.py FINGERTIP GRIPPER TIME_KEEPER [unittest's]
"""

import contextlib
import os
import pathlib
import re
import signal
import sys
import tempfile
import unittest

FINGERTIP, GRIPPER, TIME_KEEPER = (os.path.abspath(path) for path in sys.argv[1:4])
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from simulated_time import SimulatedTime  # noqa: E402


class Tool(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-"))
        self.world = self.enterContext(SimulatedTime(TIME_KEEPER, self.folder))

    @contextlib.contextmanager
    def simulated(self, *options):
        """A simulated gripper's port."""
        port = f"{self.folder}/gripper"
        gripper = self.world.start([GRIPPER, "--link", port, *options])
        try:
            self.assertEqual(gripper.readline(), f"{port}\n")
            yield port
        finally:
            gripper.terminate()
            self.assertEqual(gripper.wait(), 0)

    def tool(self, *arguments, expect=0):
        status, out, err = self.world.run([FINGERTIP, "gripper", *arguments])
        self.assertEqual(status, expect, (arguments, out, err))
        return out if expect == 0 else err

    def test_by_hand(self):
        for model in ("2f85", "2f140", "hande", "sts3215"):
            with self.subTest(model), self.simulated("--model", model, "--object", "30", "--stiffness", "5") as port:
                options = ("--model", model, "--port", port)
                self.assertRegex(self.tool("info", *options), r"(?m)^active +no$")
                self.assertIn("is not active", self.tool("open", *options, expect=1))
                self.assertRegex(self.tool("open", "--activate", *options), r"^activated at [\d.]+ mm\nat [\d.]+ mm, without an object\n$")
                said = re.fullmatch(r"holds an object at ([\d.]+) mm, asked for 0.0 mm\n", self.tool("close", *options))
                self.assertTrue(said)
                self.assertLess(float(said[1]), 30)
                self.assertRegex(self.tool("info", *options), r"(?m)^object +yes$")
                self.assertRegex(self.tool("move", "40", *options), r"^at (39|40)\.\d mm, without an object\n$")

    def test_an_interrupt_stops_it(self):
        with self.simulated("--model", "2f85") as port:
            options = ("--model", "2f85", "--port", port)
            self.tool("open", "--activate", *options)
            closing = self.world.start([FINGERTIP, "gripper", "close", "--speed", "20", *options])
            self.world.sleep(1)
            self.assertIsNone(closing.poll())
            closing.send_signal(signal.SIGINT)
            _, err = closing.communicate()
            self.assertEqual((closing.returncode, err), (1, "fingertip: interrupted\n"))
            self.world.sleep(0.1)  # until its motor has heard it
            stands = self.tool("info", *options)
            self.assertRegex(stands, r"(?m)^moving +no$")
            width_mm = float(re.search(r"(?m)^width_mm +([\d.]+) of 85.0$", stands)[1])
            self.assertAlmostEqual(width_mm, 85 - 20, delta=2)
            self.world.sleep(1)
            self.assertEqual(self.tool("info", *options), stands)

    def test_what_is_wrong_is_said(self):
        usual = ("--model", "2f85")
        for fault, said in (
            ("silent", "no answer from slave 9 within 50 ms; is it powered"),
            ("garbage", "look for a second program"),
            ("damaged", "an answer is damaged \\(checksum\\)"),
            ("other_slave", "another slave answers"),
            ("refused", "refused with Modbus exception 1"),
        ):
            with self.subTest(fault), self.simulated("--model", "2f85", "--line", fault) as port:
                self.assertRegex(self.tool("info", *usual, "--port", port, expect=1), said)
        with self.simulated("--model", "2f85", "--fault", "14") as port:
            self.assertIn("fault 14 (too much current; needs activation)", self.tool("open", *usual, "--port", port, expect=1))

    def test_usage(self):
        for arguments, said in (
            (("fold",), 'there is no "fold"'),
            (("open",), "--model is missing"),
            (("move", "--model", "2f85"), "WIDTH is missing"),
            (("open", "3", "--model", "2f85"), "only move takes a WIDTH"),
            (("open", "--model", "3f"), "there are 2f85, 2f140, hande, sts3215"),
            (("open", "--model", "2f85", "--port", "x", "--slave", "300"), "a slave is a number from 1 to 247"),
            (("open", "--model", "2f85", "--port", "x", "--closed", "2"), "grows while it closes"),
        ):
            self.assertIn(said, self.tool(*arguments, expect=2))
        self.assertIn("no such port; plug its adapter in", self.tool("open", "--model", "2f85", "--port", "/dev/none", expect=1))
        with self.simulated("--model", "2f85") as port:
            for arguments, said in (
                (("move", "90"), "WIDTH goes from 0 to 85 mm"),
                (("open", "--speed", "1"), "--speed goes from 20 to 150 mm/s"),
                (("open", "--force", "300"), "--force goes from 20 to 235 N"),
            ):
                self.assertIn(said, self.tool(*arguments, "--model", "2f85", "--port", port, expect=2))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
