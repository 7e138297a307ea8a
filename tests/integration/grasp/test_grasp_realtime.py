"""A grasp in the simulated cell on the machine's own clock and pseudo-terminals, of which one program is stopped for two seconds.

usage: test_grasp_realtime.py FINGERTIP FINGERTIP_SIMULATE TABLES [unittest arguments]
"""

# real time: the tool as people run it, its clock, threads and serial ports, and a process that the kernel stops.
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

FINGERTIP, FINGERTIP_SIMULATE, TABLES = (os.path.abspath(path) for path in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import grip_file  # noqa: E402
from world_case import WorldCase  # noqa: E402

# A machine that is held up for less than that changes nothing of what is asked here.
HELD_UP = ("--timeout", "10000", "--silent", "5000", "--stale", "1000")
STOPPED_s = 2  # a Robotiq reports a second without a command


class Stopped(WorldCase):
    def setUp(self):
        super().setUp()
        self.environment["FINGERTIP_PORT"] = f"{self.folder}/left:{self.folder}/right"

    def start(self, *arguments):
        return self.world.start(arguments, env=self.environment, stdin=subprocess.PIPE)

    def until(self, process, words):
        lines = []
        while words not in (lines[-1] if lines else ""):
            lines.append(process.stdout.readline())
            if not lines[-1]:
                self.fail((f"ended without {words!r}", lines, process.communicate()[1], process.returncode))
        return lines[-1]

    def test_the_tool_and_then_the_cell(self):
        words = f"--lift --ports {self.folder} --gripper 2f85 --by-command --cache {TABLES}"
        cell = self.start(FINGERTIP_SIMULATE, *words.split())  # what it grips stands on the table
        self.until(cell, "ready: ")
        tool = self.start(FINGERTIP, "grasp", "--gripper", "2f85", "--gripper-port", f"{self.folder}/gripper", "-o", self.csv, *HELD_UP)
        self.until(tool, " s  holding ")
        for stopped in (tool, cell):
            os.kill(stopped.pid, signal.SIGSTOP)
            time.sleep(STOPPED_s)
            os.kill(stopped.pid, signal.SIGCONT)
            cell.stdin.write("truth\n")
            cell.stdin.flush()
            self.until(cell, ",")
            self.until(tool, " s  holding ")
        tool.terminate()
        _, err = tool.communicate()
        self.assertEqual(tool.returncode, 0, err)
        self.assertIn("the gripper keeps its position", err)
        rows = grip_file.read_grip(self.csv)
        self.assertNotIn("fault", set(rows["state"]))
        lasted_s = (rows["time_us"][1:] - rows["time_us"][:-1]).max() / 1e6
        self.assertGreater(lasted_s, 0.9 * STOPPED_s, "the tool was not stopped")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
