"""What `fingertip doctor` says of emulated fingertips, each with one thing wrong, and of good ones; on simulated time. Each fault: tests/unit/doctor.

usage: test_doctor.py --boards FOLDER --support FOLDER --node NODE
"""

import argparse
import fcntl
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

from emulation import main, options, write_scenario
from world import World

TOOLS = argparse.Namespace()
BOARDS = ("pico_mux", "pico_parallel")


class Doctor(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.at_rest = write_scenario(cls.folder / "rest.csv")
        # a system with the rule
        rules = cls.folder / "with_rule/etc/udev/rules.d"
        rules.mkdir(parents=True)
        for shared in ("dev", "proc", "sys"):
            (cls.folder / "with_rule" / shared).symlink_to(f"/{shared}")
        rule = subprocess.run([f"{TOOLS.support}/simulated_fingertip", "rule"], capture_output=True, text=True, check=True).stdout
        (rules / "60-fingertip.rules").write_text(rule)

    def setUp(self):
        self.plugged_in = 0
        self.world = self.enterContext(World(TOOLS.support, TOOLS.node, self.folder))

    def plug_in(self, board, faults=()):
        """An emulated fingertip; returns its port."""
        self.plugged_in += 1
        port, plan = self.folder / f"port-{self.plugged_in}", self.folder / "faults.json"
        plan.write_text(json.dumps([{"from_s": 0, **fault} for fault in faults]))
        image = f"{TOOLS.boards}/{board}/fingertip-{board}.bin"
        more = options(faults=plan, seconds=3600, fast_enumeration=True)
        self.world.emulator(port, *options(board=board, image=image, scenario=self.at_rest), *more)
        return port

    def examine(self, port, *arguments, seconds=1):
        """The findings that are not well."""
        doctor = self.world.start_tool(
            "doctor", "--port", port, "--json", "--seconds", seconds, "--root", self.folder / "with_rule", *arguments
        )
        out, err = doctor.communicate()
        self.assertRegex(err, r"\A(measuring, touch nothing \d+ %(, \d+ s left)?\n)*\Z")  # each after ten seconds of this machine
        self.result = json.loads(out)
        wrong = [finding for finding in self.result["findings"] if finding["verdict"] != "ok"]
        self.assertEqual(doctor.returncode, 1 if any(finding["verdict"] == "bad" for finding in wrong) else 0)
        return wrong

    def only(self, findings, check, verdict):
        """The one finding of this check; what else is there are consequences."""
        found = [finding for finding in findings if finding["check"] == check]
        self.assertEqual([finding["verdict"] for finding in found], [verdict], findings)
        return found[0]

    def test_nothing_is_wrong_with_good_ones(self):
        for board in BOARDS:
            port = self.plug_in(board)
            self.assertEqual(self.examine(port, seconds=5), [], board)
            self.assertEqual(self.result["board"], board)
            self.assertGreaterEqual(self.result["measured"]["seconds"], 5)
            for sensor in self.result["measured"]["sensors"]:
                self.assertLess(abs(sensor["noise_Pa"] / self.result["measured"]["expected_noise_Pa"] - 1), 0.1)

    def function(self, board, name):
        """Its address."""
        lines = subprocess.run(["arm-none-eabi-nm", self.elf(board)], capture_output=True, text=True, check=True).stdout.splitlines()
        return next(int(line.split()[0], 16) & ~1 for line in lines if line.split()[-1] == name)

    @staticmethod
    def elf(board):
        return pathlib.Path(TOOLS.boards) / board / f"fingertip-{board}.elf"

    def test_a_main_loop_that_stood_still_is_told_with_its_place(self):
        """Once the first bytes of a function have been overwritten."""
        board = "pico_parallel"
        port = self.plug_in(board, [{"type": "sram_upset", "address": self.function(board, "scan_take"), "bytes": "fee7", "from_s": 0.5}])
        text = self.only(self.examine(port, "--elf", self.elf(board)), "crash", "bad")["text"]
        self.assertRegex(
            text,
            r"^the watchdog struck: the main loop made no progress; the processor was at scan_take\+0x0 \(0x2000[0-9a-f]{4}\), called "
            r"from app_run\+0x[0-9a-f]+ \(.*\), in the main loop, taking readings, [01]\.[0-9]. s after its start; before that: ",
        )
        self.assertEqual(self.result["crash"]["place"], "scan_take+0x0")
        # and without names that are of another image
        text = self.only(self.examine(port, "--elf", self.elf("pico_mux")), "crash", "bad")["text"]
        self.assertIn("is of other firmware: no names", text)
        self.assertEqual(self.result["crash"]["place"], "")

    def test_a_missing_sensor(self):
        findings = self.examine(self.plug_in("pico_mux", [{"type": "sensor_dead", "sensor": 7}]))
        finding = self.only(findings, "sensors", "bad")
        self.assertEqual(finding["sensors"], [{"sensor": 7, "strip": 1, "channel": 2, "multiplexer": 0x71}])
        self.assertIn("sensor 7 (strip 1, channel 2 of multiplexer 0x71) does not answer", finding["text"])
        self.assertIn("SD2 and SC2", finding["advice"])
        self.assertEqual({finding["check"] for finding in findings}, {"sensors", "bus"})
        findings = self.examine(self.plug_in("pico_parallel", [{"type": "sensor_missing", "sensor": 7}]))
        finding = self.only(findings, "sensors", "bad")
        self.assertEqual(finding["sensors"], [{"sensor": 7, "strip": 1, "position": 2, "gpio": 7}])
        self.assertIn("GP7 (pin 10)", finding["text"])

    def test_a_port_in_use(self):
        """A terminal that this process holds."""
        master, slave = os.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        fcntl.flock(slave, fcntl.LOCK_EX)
        findings = self.examine(os.ttyname(slave))
        self.assertEqual([(finding["check"], finding["verdict"]) for finding in findings], [("port", "bad")])
        name = pathlib.Path("/proc/self/comm").read_text().strip()
        self.assertIn(f"in use by another program: {name} (process {os.getpid()})", findings[0]["text"])


if __name__ == "__main__":
    main(TOOLS, "boards", "support", "node")
