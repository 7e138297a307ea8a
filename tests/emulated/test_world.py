"""An emulated fingertip in a simulated world (tests/support/emulated_fingertip.py): two runs are the same, however slow the machine is.

usage: test_world.py --image F.bin --support FOLDER --node NODE
"""

import argparse
import contextlib
import json
import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import threading
import unittest

from emulation import files, main, options, write_scenario
from world import World

OPTIONS = argparse.Namespace()
BUSY_FOR_s, BUSY_EVERY_s = 0.05, 0.2


class Emulated(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        write_scenario(self.folder / "rest.csv")

    def emulator(self, world, *more, **how):
        shared = {"board": "pico_mux", "image": OPTIONS.image, "scenario": self.folder / "rest.csv", "fast_enumeration": True}
        return world.emulator(self.folder / "port", *options(**shared), *more, **how)

    def recorded(self, disturb=lambda pid: None):
        """What two programs, one after the other, find at the port, when, and what became of the emulator."""
        with World(OPTIONS.support, OPTIONS.node, self.folder) as world:
            emulator = self.emulator(world, "--seconds", "3600", "--report", self.folder / "report.json")
            disturb(emulator.pid)
            told = world.tool("info", "--port", self.folder / "port")
            world.tool("record", self.folder / "out.csv", "--overwrite", "--seconds", 1, "--port", self.folder / "port")
            at_s = world.now_s
            emulator.terminate()
            said = emulator.communicate()
            report = json.loads((self.folder / "report.json").read_text())
            self.assertEqual((emulator.returncode, report.pop("end_reason")), (0, "interrupted"), said)
            del report["wall_s"]
        return told, (self.folder / "out.csv").read_text(), at_s, said, report

    def test_two_runs_are_the_same_even_if_one_is_held_up(self):
        over = threading.Event()

        def hold_up(pid):
            """Stops the process over and over: a machine that is busy. In real time, which is what must not matter."""

            def act():
                while not over.wait(BUSY_EVERY_s):
                    try:
                        os.kill(pid, signal.SIGSTOP)
                        over.wait(BUSY_FOR_s)
                        os.kill(pid, signal.SIGCONT)
                    except ProcessLookupError:
                        return

            thread = threading.Thread(target=act)
            thread.start()
            self.addCleanup(thread.join)
            self.addCleanup(over.set)

        first = self.recorded()
        second = self.recorded(hold_up)
        self.assertEqual(first, second)
        self.assertEqual(first[-1]["warnings"], [])
        recording = files.read_recording(self.folder / "out.csv")
        self.assertGreater(len(recording["frame"]), 200)
        self.assertEqual(recording.end["dropped_packets"], "0")

    def test_who_does_not_read_stops_the_board_and_loses_nothing(self):
        with World(OPTIONS.support, OPTIONS.node, self.folder) as world:
            emulator = self.emulator(
                world, "--seconds", "3600", "--capture", self.folder / "captured", "--usb-log", self.folder / "usb.csv"
            )
            came = b""
            with socket.socket(socket.AF_UNIX) as port:
                port.connect(str(self.folder / "port"))
                port.setblocking(False)
                world.sleep(0.5)
                port.send(bytes.fromhex(subprocess.check_output([f"{OPTIONS.support}/command_frame", "stream", "contact,raw"], text=True)))
                world.sleep(3)  # which is more than fits
                for _ in range(100):
                    with contextlib.suppress(BlockingIOError):
                        while some := port.recv(1 << 16):
                            came += some
                    world.sleep(0.01)
                emulator.terminate()
                emulator.wait()
                while some := port.recv(1 << 16):
                    came += some
            self.assertEqual(came, (self.folder / "captured").read_bytes())
            rows = [line.split(",") for line in (self.folder / "usb.csv").read_text().splitlines()[1:]]
            read_ns = [int(row[0]) for row in rows if row[1:3] == ["2", "in"] and row[3] != "0"]
            pause_s = max(b - a for a, b in zip(read_ns, read_ns[1:])) / 1e9
            self.assertTrue(0.5 < pause_s < 3, pause_s)

    def test_its_end_is_the_ports_end_and_its_status_its_own(self):
        with World(OPTIONS.support, OPTIONS.node, self.folder) as world:
            emulator = self.emulator(world, "--seconds", "0.5", wait_open=False)
            emulator.wait()
            self.assertEqual((emulator.returncode, emulator.read("stderr")), (0, ""))
            self.assertAlmostEqual(world.now_s - int(emulator.read()) / 1e6, 0.5, delta=1e-3)
            self.assertFalse((self.folder / "port").exists())
            with self.assertRaisesRegex(AssertionError, '--seed "x" is not a whole number'):
                self.emulator(world, "--seed", "x")


if __name__ == "__main__":
    main(OPTIONS, "image", "support", "node")
