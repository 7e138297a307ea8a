"""The fingertip command on pseudo-terminals of this kernel, and what gets installed.

usage: test_real_port.py FINGERTIP FAKE_DEVICE [unittest arguments]
"""

# real time: the kernel passes on the bytes of a pseudo-terminal, and locks it, in its own time
import os
import re
import shutil
import subprocess
import sys
import unittest

sys.argv.insert(3, "")  # there is no keeper of time
import test_flash  # noqa: E402
from cli_case import CliTest, FINGERTIP, ROOT  # noqa: E402
from fingertip import files  # noqa: E402


class RealPort:
    """Before CliTest: the same, in real time."""

    TIME_KEEPER = None


class Port(RealPort, CliTest):
    def test_a_recording_loses_nothing(self):
        with self.device():
            self.run_cli("record", self.csv, "--port", self.port, "--seconds", "1")
        recording = files.read_recording(self.csv)
        self.assertEqual(recording.end["dropped_packets"], "0")
        self.assertGreaterEqual(recording["t_us"][-1] - recording["t_us"][0], 1e6)

    def test_it_is_held_exclusively_and_given_back(self):
        with self.device():
            process = self.start("record", self.csv, "--port", self.port)
            self.world.until(lambda: os.path.exists(self.csv))
            self.assertEqual(
                self.error("info", "--port", self.port),
                f"fingertip: {self.port}: in use by another program; end that one first (`fingertip doctor` names it)\n",
            )
            _, out, _ = self.world.run([FINGERTIP, "doctor", "--seconds", "1", "--port", self.port], env=self.environment)
            self.assertRegex(out, rf"fingertip.*{process.pid}")
            self.assertNotIn("udev", out)  # which knows no pseudo-terminal
            process.kill()
            process.communicate()
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], r"(?m)^serial +E660583883265A2C$")

    def test_permission(self):
        with self.device():
            self.assertEqual(self.without_permission("info", "--port", self.port), f"fingertip: {self.port}: {self.RULE}\n")


class Loader(RealPort, test_flash.Flash):
    """One of an older protocol is asked by its baud rate, which only a terminal has."""

    def test_by_the_baud_rate(self):
        self.assertIn("firmware 9.8.7", self.flash("version=1")[0])


# What is inherited of it runs on simulated time.
for name in [name for name in dir(test_flash.Flash) if name.startswith("test_")]:
    setattr(Loader, name, None)


class Install(RealPort, CliTest):
    """What users get: rule, manual, completion."""

    INSTALL = ROOT / "host_tools" / "install"

    def commands(self):
        return re.findall(r"^  (\w+) ", self.run_cli("--help")[0].split("Subcommands:")[1], re.M)

    def test_the_rule_is_for_our_ids(self):
        rule = self.run_cli("rule")[0]
        self.assertIn('ATTR{idVendor}=="1209", ATTR{idProduct}=="0001"', rule)
        for line in rule.splitlines():
            self.assertRegex(line, r'^#|^SUBSYSTEM=="(usb|tty|block)", .*TAG\+="uaccess"')

    def test_the_manual_names_every_command_and_option(self):
        manual = (self.INSTALL / "fingertip.1").read_text(encoding="utf-8").replace("\\-", "-")
        for command in self.commands():
            self.assertRegex(manual, rf"(?m)^\.BI? {command}\b")
            for option in re.findall(r"--[a-z][a-z-]*", self.run_cli(command, "--help")[0]):
                self.assertIn(option, manual)

    @unittest.skipUnless(shutil.which("groff"), "groff is not here")
    def test_the_manual_is_well_formed(self):
        done = subprocess.run(["groff", "-man", "-ww", "-Tutf8", self.INSTALL / "fingertip.1"], capture_output=True, text=True, check=True)
        self.assertEqual(done.stderr, "")
        self.assertIn("FINGERTIP_PORT", re.sub(".\b", "", done.stdout))

    def test_bash_completes(self):
        def complete(*words):
            script = (
                f'. {self.INSTALL}/fingertip.bash; COMP_WORDS=({" ".join(words)} ""); COMP_CWORD={len(words)}; '
                "COMP_WORDS[COMP_CWORD]=$1; _fingertip; echo ${COMPREPLY[@]}"
            )
            environment = {**self.environment, "PATH": os.path.dirname(FINGERTIP) + ":" + self.environment["PATH"]}
            return lambda start: subprocess.run(
                ["bash", "-c", script, "bash", start], env=environment, capture_output=True, text=True, check=True
            ).stdout.split()

        self.assertEqual(sorted(complete("fingertip")("")), sorted(self.commands()))
        self.assertEqual(complete("fingertip")("mon"), ["monitor"])
        self.assertIn("--transport", complete("fingertip", "info")("--"))
        self.assertEqual(complete("fingertip", "info", "--transport")("s"), ["socket", "serial"])
        models = re.search(r"--gripper MODEL +(.*) \(required\)", self.run_cli("grasp", "--help")[0])[1].split(", ")
        self.assertEqual(complete("fingertip", "grasp", "--gripper")(""), models)
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device("serial=AAAA"):
            self.assertEqual(complete("fingertip", "info", "--device")(""), ["AAAA"])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
