"""`fingertip doctor` against a fake device: usage test_doctor.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import json
import os
import pathlib
import re
import sys
import unittest

from cli_case import FINGERTIP, CliTest
from simulated_terminal import Terminal

LINE = re.compile(r"(ok|warn|bad) +([a-z]+)  (.+)")


class DoctorTest(CliTest):
    def setUp(self):
        super().setUp()
        rules = pathlib.Path(self.folder, "etc/udev/rules.d")
        rules.mkdir(parents=True)
        self.rule = rules / "60-fingertip.rules"
        self.rule.write_text(self.run_cli("rule")[0])
        for shared in ("dev", "proc", "sys"):
            os.symlink(f"/{shared}", os.path.join(self.folder, shared))
        for name in ("NO_COLOR", "TERM"):
            self.environment.pop(name, None)

    ARGUMENTS = ("doctor", "--seconds", "1")

    def plug_in(self, *options):
        """Until the test ends."""
        self.enterContext(self.device(*options))

    def examine(self, *arguments, tool=FINGERTIP, **options):
        """Exit status, output and errors."""
        return self.world.run(
            [tool, *self.ARGUMENTS, "--port", self.port, "--root", self.folder, *arguments], env=self.environment, **options
        )

    def findings(self, *arguments, **options):
        """[(verdict, check, text)] of the lines."""
        status, out, err = self.examine(*arguments, **options)
        self.assertEqual(err, "")
        found = [LINE.fullmatch(line).groups() for line in out.splitlines()]
        self.assertEqual(status, 1 if any(verdict == "bad" for verdict, _, _ in found) else 0)
        return found

    def test_findings(self):
        version = self.run_cli("--version")[0].split()[1]
        for options, check, verdict, text in (
            (["version=3"], "protocol", "bad", "speaks protocol version 3, not 9; install this tool's firmware"),
            (["mute=1"], "protocol", "bad", 'no answer to "info"'),
            (["firmware=0.0.9"], "firmware", "warn", rf"0.0.9 \(0123456789ab\+\), board pico_mux, scene slip; .* of version {version}"),
            ([f"firmware={version}"], "firmware", "ok", version),
            (["drop=20", "flip=30"], "packets", "warn", "[1-9][0-9]* lost, [1-9][0-9]* damaged"),
            (["frames=20"], "port", "bad", "vanished while it was examined"),
            ([], "restarts", "warn", "by the watchdog"),
            (
                [],
                "crash",
                "bad",
                "a hard fault at 0x20001000, .* fitting, .*; before that: command stream 1.50 s, started 4 min; r0 0x00000001",
            ),
        ):
            with self.subTest(options), self.device(*options):
                found = [(one, words) for one, name, words in self.findings() if name == check]
                self.assertEqual([one for one, _ in found], [verdict], found)
                self.assertRegex(found[0][1], text)

    def test_no_port_and_no_rule(self):
        self.rule.unlink()
        found = self.findings()
        self.assertEqual([line[:2] for line in found], [("warn", "rule"), ("bad", "port")])
        self.assertIn("no such port; plug the fingertip in", found[1][2])

    def test_permission_denied(self):
        self.plug_in()
        os.chmod(os.path.realpath(self.port), 0)
        tool, user = self.other_user()
        self.assertEqual([line[:2] for line in self.findings(tool=tool, **user)], [("ok", "rule"), ("bad", "port")])
        self.rule.unlink()
        self.assertEqual([line[:2] for line in self.findings(tool=tool, **user)], [("bad", "rule"), ("bad", "port")])

    def test_an_elf_file_that_is_none_is_an_error(self):
        self.plug_in()
        status, out, err = self.examine("--elf", __file__)
        self.assertEqual((status, out), (1, ""))
        self.assertRegex(err, "no ELF file of a fingertip; give fingertip-BOARD.elf")

    def test_json_has_all_of_it(self):
        self.plug_in("absent=3")
        status, out, _ = self.examine("--json")
        told = json.loads(out)
        self.assertEqual((told["verdict"], told["board"], told["serial"]), ("bad", "pico_mux", "E660583883265A2C"))
        self.assertEqual(status, 1)
        missing = [finding for finding in told["findings"] if finding["check"] == "sensors" and finding["verdict"] == "bad"]
        self.assertEqual([finding["sensors"] for finding in missing], [[{"sensor": 3, "strip": 0, "channel": 3, "multiplexer": 0x70}]])
        self.assertEqual(len(told["measured"]["sensors"]), 15)
        self.assertAlmostEqual(told["measured"]["rate_Hz"], 200, delta=20)
        self.assertEqual(told["health"]["stack_free_bytes"], 18)

    def on_terminal(self, **environment):
        """What a terminal is shown."""
        arguments = [FINGERTIP, *self.ARGUMENTS, "--port", self.port, "--root", self.folder]
        with Terminal(self.world, arguments, {**self.environment, "TERM": "xterm", **environment}) as terminal:
            terminal.wait()
            return terminal.output.decode()

    def test_colour_only_on_a_terminal_that_wants_it(self):
        self.plug_in()
        self.assertNotIn("\x1b[3", self.examine()[1])
        shown = self.on_terminal()
        self.assertIn("\x1b[32mok  \x1b[0m  rule", shown)
        self.assertIn("measuring, touch nothing", shown)
        self.assertNotIn("\x1b[3", self.on_terminal(NO_COLOR="1"))

    def test_seconds_are_checked(self):
        for seconds in ("0", "601", "x", ""):
            self.assertIn("give 1 to 600", self.run_cli("doctor", "--seconds", seconds, status=2)[1])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
