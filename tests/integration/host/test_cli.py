"""The fingertip command against a fake device: usage test_cli.py FINGERTIP FAKE_DEVICE [unittest arguments]."""
import contextlib
import fcntl
import json
import os
import pathlib
import pty
import re
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest

import numpy as np
import pyte

FINGERTIP, FAKE_DEVICE = (os.path.abspath(path) for path in sys.argv[1:3])
PATIENCE_s = 30
PYTHON_TOOLS = pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"
sys.path.insert(0, str(PYTHON_TOOLS))
from fingertip import files  # noqa: E402


def report(**numbers):
    """Adds to the JSON file that FINGERTIP_REPORT names."""
    path = os.environ.get("FINGERTIP_REPORT")
    if path:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        old = json.loads(pathlib.Path(path).read_text(encoding="utf-8")) if os.path.exists(path) else {}
        pathlib.Path(path + ".new").write_text(json.dumps({**old, **numbers}, indent=2) + "\n", encoding="utf-8")
        os.replace(path + ".new", path)


def end(process):
    """Whatever becomes of the test that started it, nothing is left running."""
    process.kill()
    with process:
        pass


class CliTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.port = os.path.join(self.folder, "tty")
        self.csv = os.path.join(self.folder, "r.csv")
        self.ftr = os.path.join(self.folder, "r.ftr")
        self.environment = {k: v for k, v in os.environ.items() if k != "FINGERTIP_PORT" and not k.startswith("LC_")}
        self.environment["LC_ALL"] = "C.UTF-8"
        self.environment["XDG_RUNTIME_DIR"] = self.folder  # where nobody shares a fingertip

    @contextlib.contextmanager
    def device(self, *options, port=None):
        port = port or self.port
        process = subprocess.Popen([FAKE_DEVICE, port, *options])
        try:
            self.wait_for(lambda: os.path.lexists(port))
            yield process
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE_s)
            end(process)

    def wait_for(self, condition):
        end = time.monotonic() + PATIENCE_s
        while not condition():
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.01)

    def once_in_three(self, measure, limit):
        """A busy computer may make anything late, but hardly thrice in a row."""
        measured = [measure()]
        while measured[-1] >= limit and len(measured) < 3:
            measured.append(measure())
        self.assertLess(measured[-1], limit, measured)

    def start(self, *arguments, **options):
        process = subprocess.Popen([FINGERTIP, *arguments], env=self.environment, text=True, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
        self.addCleanup(end, process)
        return process

    def run_cli(self, *arguments, status=0, patience_s=PATIENCE_s, **options):
        process = self.start(*arguments, **options)
        out, err = process.communicate(timeout=patience_s)
        self.assertEqual(process.returncode, status, (arguments, out, err))
        return out, err

    def error(self, *arguments, status=1):
        """The one line that a failing command prints."""
        out, err = self.run_cli(*arguments, status=status)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("fingertip: "), err)
        return err

    RULE = "permission denied; install the udev rule: fingertip rule | sudo tee /etc/udev/rules.d/60-fingertip.rules, " \
           "then sudo udevadm control --reload, and plug it in again"

    def without_permission(self, *arguments, status=1):
        """What the tool says to a user who may not open the port."""
        os.chmod(os.path.realpath(self.port), 0)
        os.chmod(self.folder, 0o777)
        tool, user = FINGERTIP, {}
        if os.geteuid() == 0:
            tool, user = os.path.join(self.folder, "fingertip"), {"user": 65534, "group": 65534, "extra_groups": []}
            shutil.copy(FINGERTIP, tool)  # where everybody may run it
        done = subprocess.run([tool, *arguments], capture_output=True, text=True, env=self.environment, timeout=PATIENCE_s, **user)
        self.assertEqual((done.returncode, done.stdout), (status, ""))
        return done.stderr

    def rows(self, path=None):
        """Data rows as dictionaries, and the comment lines."""
        with open(path or self.csv, encoding="utf-8") as file:
            lines = file.read().splitlines()
        data = [line.split(",") for line in lines if not line.startswith("#")]
        return [dict(zip(data[0], row)) for row in data[1:]], [line for line in lines if line.startswith("#")]


class Usage(CliTest):
    def test_help_and_version(self):
        self.assertRegex(self.run_cli("--version")[0], r"^fingertip \d+\.\d+\.\d+\n$")
        commands = re.findall(r"^  (\w+) ", self.run_cli("--help")[0].split("Subcommands:")[1], re.M)
        self.assertEqual(sorted(commands), sorted(
            ["list", "info", "doctor", "monitor", "record", "replay", "convert", "grasp", "gripper", "tare", "calibrate", "pad", "set", "serve", "web", "flash", "rule", "loader",
             "encode"]))
        for command in commands:
            self.assertIn(f"Usage: fingertip {command}", self.run_cli(command, "--help")[0])

    def test_wrong_usage(self):
        self.assertIn("see fingertip --help", self.error(status=2))
        self.assertIn("see fingertip record --help", self.error("record", status=2))
        self.error("monitor", "--bogus", status=2)
        for words, problem in (([], "a command is missing"), (["moniter"], '"moniter" is no command'), (["moniter", "--port", "x"], "is no command")):
            self.assertRegex(self.error(*words, status=2), f"{problem}; give one of list, info, doctor, monitor, .*; see fingertip --help")

    def test_wrong_values_say_what_is_right(self):
        for value in ("nan", "-1", "0", "inf", "1x"):
            self.assertIn("give a number from 0.001", self.error("record", self.csv, f"--seconds={value}", status=2))
        for value in ("pink", "0"):
            err = self.error("monitor", "--colour", value, status=2)
            self.assertEqual(err, f'fingertip: --colour "{value}" is not possible; give auto, truecolour, 256 or plain; '
                                  "see fingertip monitor --help\n")
        for value in ("abc", "0", "nan", "-1", "1001"):
            self.assertIn("give 0.01 to 1000, or max", self.error("replay", self.csv, "--speed", value, status=2))

    def test_what_the_parser_says_is_for_people(self):
        self.assertEqual(self.error("info", "--port", "a", "--port", "b", status=2),
                         "fingertip: --port is given twice; give it once; see fingertip info --help\n")
        self.assertEqual(self.error("record", status=2), "fingertip: FILE.csv|FILE.mcap|- is missing; see fingertip record --help\n")
        self.assertEqual(self.error("encode", status=2), "fingertip: COMMAND [ARGS] is missing; see fingertip encode --help\n")

    def test_help_fits_into_80_columns(self):
        pages = {(): self.run_cli("--help")[0]}
        for command in re.findall(r"^  (\w+) ", pages[()].split("Subcommands:")[1], re.M):
            pages[command] = self.run_cli(command, "--help")[0]
        for command, page in pages.items():
            for line in page.splitlines():
                self.assertLessEqual(len(line), 80, (command, line))
            words = page.split()
            self.assertIn("Usage:", words)
        self.assertIn("slip_window=MS (5 to 1000, and 160 frames at most), prior=SIGMA[:WIDTH]|none", " ".join(pages["set"].split()))

    def test_names_cannot_speak_to_the_terminal(self):
        name = self.folder + "/\x1b[31m\n.csv"
        err = self.error("replay", name)
        self.assertIn("\\x1b[31m\\x0a.csv: No such file", err)
        self.assertNotIn("\x1b", self.error("record", name, "--port", "/no/\x1b[31m"))
        self.assertNotIn("\x1b", self.error("replay", "--\x1b[31m", status=2))

    def test_ports(self):
        self.assertIn("no such port", self.error("info", "--port", self.port))
        self.assertIn("no serial port", self.error("info", "--port", "/dev/null"))
        self.environment["FINGERTIP_PORT"] = "/tmp/a:/tmp/b"
        self.assertIn("several fingertips found", self.error("info"))
        self.environment["FINGERTIP_PORT"] = self.port + ":" + self.folder
        self.assertRegex(self.run_cli("list")[0],
                         f"-\t-\t-\tport {self.port} \\(.*no such port; plug .*\\)\n-\t-\t-\tport {self.folder} \\(.*\\)\n")
        self.assertIn("no fingertip 1234 here", self.error("info", "--device", "1234"))
        self.assertIn("choose the fingertip with --device", self.error("info", "--port", self.port, "--transport", "usb"))
        self.assertIn("give auto, socket, serial or usb", self.error("info", "--transport", "bluetooth", status=2))

    def test_ranges_are_found_before_a_port_is_opened(self):
        for setting, allowed in [("rate=0", "0.1 to 2000 Hz, or max"), ("rate=x", "0.1 to 2000 Hz, or max"),
                                 ("osr=1000", "256, 512, 1024, 2048, 4096 or 8192"),
                                 ("slip_threshold=0", "0.01 to 50 mm"), ("slip_window=1001", "5 to 1000 ms"),
                                 ("colour=red", "rate=HZ|max"), ("rate", "0.1 to 2000 Hz")]:
            self.assertIn(allowed, self.error("set", "--port", self.port, setting, status=2))

    def test_encode(self):
        # COBS of version, type, sequence, time, body and CRC, worked out by zlib.crc32 and hand
        self.assertEqual(self.run_cli("encode", "tare")[0], "03058101010101010101010101051ed639e900\n")
        timed = self.run_cli("encode", "--sequence", "258", "--time", "1", "osr", "8192")[0].strip()
        self.assertTrue(timed.startswith("0605830201"), timed)
        self.assertIn("slip THRESHOLD_MM WINDOW_MS", self.error("encode", "slip", "0.75", status=2))
        self.assertIn("0.1 to 2000", self.error("encode", "rate", "3000", status=2))
        self.assertIn("unknown", self.error("encode", "bogus", status=2))
        self.assertEqual(self.run_cli("encode", "erase-pad")[0], "03058e01010101010101010105e6afe1c600\n")
        from_zero, from_touch = (self.run_cli("encode", command, "12", "9")[0] for command in ("pad", "pad-from-touch"))
        self.assertIn("4041" + "012b" + "1041", from_zero)  # 12 and 9 mm; COBS has a code for each zero
        self.assertNotEqual(from_zero, from_touch)
        self.assertIn("5 to 20 mm", self.error("encode", "pad", "3", "9", status=2))
        self.assertIn("must be numbers", self.error("encode", "pad", "thick", "9", status=2))


class Several(CliTest):
    """Two fingertips, told apart by their serial numbers."""

    def setUp(self):
        super().setUp()
        self.other = self.port + "2"
        self.environment["FINGERTIP_PORT"] = self.port + ":" + self.other

    def test_list_shows_each_and_what_is_in_use(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            self.assertEqual(self.run_cli("list")[0], f"AAAA\tpico_mux\t1.20.3\tport {self.port}\n"
                                                      f"BBBB\tpico_mux\t1.20.3\tport {self.other}\n")
            process = self.start("record", self.csv, "--device", "AAAA")
            self.wait_for(lambda: os.path.exists(self.csv))
            first, second = self.run_cli("list")[0].splitlines()
            self.assertRegex(first, r"^-\t-\t-\t.*in use by another program")
            self.assertTrue(second.startswith("BBBB"))
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_s)

    def test_the_serial_number_chooses(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            for serial, port in (("aaaa", self.port), ("BBBB", self.other)):
                out = self.run_cli("info", "--device", serial)[0]
                self.assertRegex(out, f"(?m)^port +{port}$")
                self.assertRegex(out, f"(?m)^serial +{serial.upper()}$")
            self.assertEqual(self.error("info", "--device", "CCCC"), "fingertip: no fingertip CCCC here, there are: AAAA BBBB; plug it in, then see `fingertip list`\n")
            self.assertEqual(self.error("info"), f"fingertip: several fingertips found: AAAA ({self.port}), BBBB ({self.other}); "
                                                 "choose one with --device SERIAL\n")
            self.assertIn("is fingertip AAAA, not BBBB", self.error("info", "--port", self.port, "--device", "BBBB"))


    ALIGNMENT_SECONDS = int(os.environ.get("FINGERTIP_ALIGNMENT_SECONDS", "3"))

    def assert_in_order(self):
        """Rows are in order of the common clock."""
        with open(self.csv, encoding="utf-8") as file:
            times = [float(line.split(",")[1]) for line in file if line[0].isdigit()]
        self.assertEqual(times, sorted(times))

    def test_rows_stay_in_order_when_the_tool_was_held_up(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            process = self.start("record", self.csv, "--all")
            self.wait_for(lambda: os.path.exists(self.csv) and len(self.rows()[0]) > 20)
            for _ in range(4):
                process.send_signal(signal.SIGSTOP)
                time.sleep(0.6)
                process.send_signal(signal.SIGCONT)
                time.sleep(0.1)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)
        self.assertGreater(len(self.rows()[0]), 500)
        self.assert_in_order()

    def test_two_on_one_clock(self):
        zeros = [os.path.join(self.folder, name) for name in ("zero_a", "zero_b")]
        rates = (1 + 25e-6, 1 - 25e-6)
        life = f"life={self.ALIGNMENT_SECONDS + PATIENCE_s}"
        with self.device("serial=AAAA", "clock_ppm=25", "started=1000", f"zero_log={zeros[0]}", life), \
                self.device("serial=BBBB", "clock_ppm=-25", "started=7", f"zero_log={zeros[1]}", life, port=self.other):
            self.run_cli("record", self.csv, "--all", "--seconds", str(self.ALIGNMENT_SECONDS),
                         patience_s=self.ALIGNMENT_SECONDS + PATIENCE_s)
        one, two = (files.read_recording(self.csv, device=serial) for serial in ("AAAA", "bbbb"))
        host_zero_us = float(one.metadata["host_zero_us"])
        errors = []
        for recording, zero, rate in zip((one, two), zeros, rates):
            with open(zero, encoding="utf-8") as file:
                zero_us = float(file.read())
            truth_us = zero_us + recording["t_us"] / rate - host_zero_us
            error_us = recording.time_us - truth_us
            self.assertEqual(list(recording["frame"]), list(range(1, len(error_us) + 1)))
            self.assertEqual(len(recording.events), 0)
            errors.append(error_us)
        # at each row of the one, against the other's latest error
        both = np.concatenate([np.column_stack([r.time_us, e, np.full(len(e), i)]) for i, (r, e) in enumerate(zip((one, two), errors))])
        both = both[np.argsort(both[:, 0], kind="stable")]
        latest, alignment_us = [None, None], 0.0
        for _, error, number in both:
            latest[int(number)] = error
            if None not in latest:
                alignment_us = max(alignment_us, abs(latest[0] - latest[1]))
        self.assertLess(alignment_us, 1000)
        self.assertLessEqual(alignment_us, float(one.end["alignment_us"]) + 2)
        self.assertEqual(one.end["dropped_packets"], "0")
        span_us = one["t_us"][-1] - one["t_us"][0]
        self.assertGreater(span_us, 1e6)
        self.assertGreater(len(errors[0]), 100e-6 * span_us)
        report(alignment_fake_devices_us=round(alignment_us, 1), alignment_fake_devices_seconds=self.ALIGNMENT_SECONDS)
        self.assert_in_order()
        # replay and conversion take one of them
        self.assertIn("holds several fingertips: AAAA BBBB; choose one with --device SERIAL", self.run_cli("replay", self.csv, "--to-csv", self.csv + "2", status=1)[1])
        self.assertIn("no fingertip CCCC in it", self.run_cli("replay", self.csv, "--device", "CCCC", status=1)[1])
        self.assertIn(f" {len(errors[1])} frames in", self.run_cli("replay", self.csv, "--device", "BBBB", "--speed", "max")[0])
        converted = os.path.join(self.folder, "c.csv")
        self.run_cli("replay", self.csv, "--device", "BBBB", "--to-csv", converted)
        self.assertTrue(np.array_equal(files.read_recording(converted)["t_us"], two["t_us"]))
        self.assertEqual(files.read_recording(converted).metadata["serial"], "BBBB")

    def test_one_of_two_goes_and_comes_back(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", "vanish=100,500", port=self.other):
            process = self.start("record", self.csv, "--all")
            self.wait_for(lambda: os.path.exists(self.csv) and any("1/event: back" in c for c in self.rows()[1]))
            self.wait_for(lambda: sum(row["device"] == "1" for row in self.rows()[0]) > 130)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn(" of 2 fingertips, aligned to ", err)
        one, two = (files.read_recording(self.csv, device=serial) for serial in ("AAAA", "BBBB"))
        self.assertEqual((len(one.events), len(two.events)), (0, 2))
        self.assertTrue((np.diff(two.time_us) > 0).all())
        self.assertTrue((np.diff(one["frame"]) == 1).all())

    def test_all_agree_on_what_came(self):
        """Recorder, replay, conversion, reader and plot of a joint recording whose fingertip was unplugged."""
        with self.device("serial=AAAA", "health=7"), self.device("serial=BBBB", "health=5", "vanish=103,500", port=self.other):
            process = self.start("record", self.csv, "--all")
            self.wait_for(lambda: os.path.exists(self.csv) and any("1/event: back" in c for c in self.rows()[1]))
            self.wait_for(lambda: sum(row["device"] == "1" for row in self.rows()[0]) > 150)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn(" 0 packets dropped, 0 CRC errors", err)
        text = pathlib.Path(self.csv).read_text(encoding="utf-8")
        cut = os.path.join(self.folder, "cut.csv")  # its recorder killed: only the lines themselves tell
        pathlib.Path(cut).write_text(re.sub(r"(?m)^# (\d/)?end: .*\n", "", text), encoding="utf-8")
        for number, serial in enumerate(("AAAA", "BBBB")):
            end = re.search(rf"(?m)^# {number}/end: frames=(\d+) .* packets=(\d+) dropped_packets=0 out_of_order=0 crc_errors=0", text)
            recording = files.read_recording(self.csv, device=serial)
            self.assertEqual(len(recording["frame"]), int(end[1]))
            self.assertEqual((recording.end["frames"], recording.end["packets"]), end.groups())  # its own, not those of all
            for path in (self.csv, cut):
                out, _ = self.run_cli("replay", path, "--device", serial, "--speed", "max")
                self.assertRegex(out, r" 0 packets dropped, 0 CRC errors")
                converted = os.path.join(self.folder, "c.csv")
                out, _ = self.run_cli("replay", path, "--device", serial, "--to-csv", converted, "--overwrite")
                self.assertRegex(out, f": {end[1]} frames, packets=\\d+ dropped_packets=0 out_of_order=0 ")
                again = files.read_recording(converted)
                self.assertEqual(again.end["dropped_packets"], "0")
                self.assertEqual(again.end["out_of_order"], "0")
                self.assertEqual(len(again["frame"]), int(end[1]))
                self.assertEqual(len(again.events), 2 if serial == "BBBB" else 0)
                if path == self.csv:
                    self.assertEqual(again.end["packets"], end[2])
                self.assertIn(" 0 packets dropped", self.run_cli("replay", converted, "--speed", "max")[0])
            drawn = subprocess.run([sys.executable, PYTHON_TOOLS, "plot", self.csv, "--device", serial, "-o",
                                    os.path.join(self.folder, f"{serial}.png")], capture_output=True, text=True, check=True).stdout
            self.assertRegex(drawn, rf": {end[1]} frames in [\d.]+ s  ·  dropped packets: 0\n$")

    def test_errors_of_several(self):
        with self.device("serial=AAAA"), self.device("serial=AAAA", port=self.other):
            self.assertIn("is the same fingertip as another", self.error("record", self.csv, "--all"))
            self.assertFalse(os.path.exists(self.csv))
            self.assertIn("--raw-bytes keeps one fingertip's line", self.error("record", self.csv, "--all", "--raw-bytes", self.ftr))
        with self.device("serial=AAAA"), self.device("serial=BBBB", "mute=1", port=self.other):
            self.assertIn("no answer", self.error("record", self.csv, "--all"))
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            _, err = self.run_cli("record", "/dev/full", "--overwrite", "--all", status=1)
            self.assertIn("No space left on device", err)


class ErrorsPeopleMeet(CliTest):
    """Each one line that says what to do, and exit status 1. Those of several fingertips on USB: tests/unit/host."""

    def test_no_permission(self):
        with self.device():
            for command in (["info"], ["monitor"], ["record", self.csv]):
                self.assertEqual(self.without_permission(*command, "--port", self.port), f"fingertip: {self.port}: {self.RULE}\n")

    def test_port_busy(self):
        with self.device():
            process = self.start("record", self.csv, "--port", self.port)
            self.wait_for(lambda: os.path.exists(self.csv))
            for command in (["info"], ["monitor"], ["record", self.ftr]):
                self.assertEqual(self.error(*command, "--port", self.port),
                                 f"fingertip: {self.port}: in use by another program; end that one first "
                                 "(`fingertip doctor` names it)\n")
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_s)

    def test_no_device(self):
        if subprocess.run([FINGERTIP, "list"], env=self.environment, capture_output=True).returncode == 0:
            self.skipTest("a fingertip is plugged in")
        for command in (["list"], ["info"], ["monitor"], ["record", self.csv], ["tare"], ["set", "rate=max"], ["loader"]):
            self.assertRegex(self.error(*command), "^fingertip: no fingertip found; plug one in")
        self.assertRegex(self.error("monitor", "--transport", "usb"), "^fingertip: no fingertip found by libusb; plug one in")
        self.assertFalse(os.path.exists(self.csv))

    def test_two_and_none_chosen(self):
        other = self.port + "2"
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=other):
            self.environment["FINGERTIP_PORT"] = self.port + ":" + other
            for command in (["info"], ["monitor"], ["record", self.csv], ["tare"]):
                self.assertEqual(self.error(*command), f"fingertip: several fingertips found: AAAA ({self.port}), BBBB ({other}); "
                                                       "choose one with --device SERIAL\n")

    def test_wrong_device(self):
        with self.device("mute=1"):
            _, err = self.run_cli("info", "--port", self.port, status=1)
            self.assertEqual(err, f'{self.port}: waiting for an answer\n'
                                  f'fingertip: {self.port}: no answer to "info"; is it a fingertip? unplug it and plug it in again\n')
        with self.device("serial=AAAA"):
            self.assertEqual(self.error("info", "--port", self.port, "--device", "BBBB"),
                             f"fingertip: {self.port}: is fingertip AAAA, not BBBB; see `fingertip list`, and choose by --device alone\n")

    def test_older_or_newer_protocol_version(self):
        for version in (1, 4, 6):
            with self.device(f"version={version}"):
                for command in (["info"], ["set", "rate=max"]):
                    self.assertEqual(self.error(*command, "--port", self.port),
                                     f"fingertip: {self.port}: speaks protocol version {version}, not 5; install "
                                     "this tool's firmware with `fingertip flash`, or use the other's tool\n")

    def test_cable_pulled(self):
        with self.device("pulled=1"):
            self.assertEqual(self.error("info", "--port", self.port),
                             f'fingertip: {self.port}: vanished before it answered "info"; plug it in and try again\n')
        for command, told in (["record", self.csv], "stderr"), (["monitor"], "stdout"), (["record", self.ftr, "--all"], "stderr"):
            self.environment["FINGERTIP_PORT"] = self.port
            with self.device() as device:
                process = self.start(*command)
                stream = getattr(process, told)
                while not re.search(r" [1-9]\d* frames", line := stream.readline()):
                    self.assertIn("frames", line)
                device.terminate()
                while "gone, plug it in again" not in (line := stream.readline()):
                    self.assertIn("frames", line)
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=PATIENCE_s)
            self.assertEqual(process.returncode, 0)

    def test_disk_full(self):
        with self.device():
            for command in (["record", "/dev/full", "--overwrite"], ["record", self.csv, "--raw-bytes", "/dev/full", "--overwrite"],
                            ["monitor", "--record", "/dev/full", "--overwrite"]):
                err = self.run_cli(*command, "--port", self.port, status=1)[1]
                self.assertRegex(err.splitlines()[-1], "^fingertip: /dev/full: No space left on device; .*make room and start a new file$|"
                                                       "^fingertip: /dev/full: No space left on device; .*--salvage$")


class Flash(CliTest):
    """Images as the build makes them, a fake loader's drive, and a fake device that comes back."""

    def setUp(self):
        super().setUp()
        self.environment["FINGERTIP_PORT"] = self.port
        self.volume = os.path.join(self.folder, "RPI-RP2")
        self.image = self.uf2()

    def uf2(self, board="pico_mux", git="abcdef012345", name="new.uf2"):
        """An image with a second boot stage, an identity and some code, by the build's own scripts."""
        cmake = pathlib.Path(__file__).resolve().parents[3] / "cmake"
        path = os.path.join(self.folder, name)
        pathlib.Path(path + ".code").write_bytes(bytes(range(200)))
        subprocess.run([sys.executable, cmake / "boot2_checksum.py", path + ".code", path + ".boot2"], check=True)
        identity = f"fingertip-version=9.8.7 fingertip-git={git}\0fingertip-board={board}\0".encode()
        flash = pathlib.Path(path + ".boot2").read_bytes() + bytes(1000) + identity + bytes(range(256)) * 8
        pathlib.Path(path + ".bin").write_bytes(flash)
        subprocess.run([sys.executable, cmake / "bin2uf2.py", path + ".bin", path], check=True)
        return path

    def make_volume(self, board="RPI-RP2"):
        os.mkdir(self.volume)
        with open(os.path.join(self.volume, "INFO_UF2.TXT"), "w", encoding="ascii") as file:
            file.write(f"UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: {board}\n")

    def flash(self, *first, after=("board=pico_mux", "git=abcdef012345", "firmware=9.8.7"), status=0):
        """Runs flash against a device with these options, that ends in its loader, and comes back with those."""
        with self.device("loader=1", *first) as device:
            process = self.start("flash", self.image, "--volume", self.volume)
            self.wait_for(lambda: device.poll() is not None or process.poll() is not None)
            if process.poll() is None:
                self.make_volume()
                written = os.path.join(self.volume, "fingertip.uf2")
                size = os.path.getsize(self.image)
                self.wait_for(lambda: os.path.exists(written) and os.path.getsize(written) == size)
                with open(written, "rb") as new, open(self.image, "rb") as image:
                    self.assertEqual(new.read(), image.read())
                os.unlink(os.path.join(self.volume, "INFO_UF2.TXT"))
                with self.device(*after):
                    out, err = process.communicate(timeout=PATIENCE_s)
            else:
                out, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, status, err)
        return out, err

    def test_by_the_command(self):
        out, err = self.flash()
        self.assertEqual(out, "fingertip E660583883265A2C: firmware 9.8.7 abcdef012345, board pico_mux\n")
        self.assertEqual(err, "writing 9.8.7 abcdef012345 for pico_mux\n")

    def test_one_of_an_older_protocol_is_asked_by_its_baud_rate(self):
        self.assertIn("firmware 9.8.7", self.flash("version=1")[0])

    def test_in_the_loader_already(self):
        self.make_volume()
        with self.device("board=pico_mux", "git=abcdef012345", "firmware=9.8.7"):
            self.assertIn("firmware 9.8.7", self.run_cli("flash", self.image, "--volume", self.volume)[0])

    def test_back_before_the_rule_is_installed(self):
        self.make_volume()
        os.chmod(self.volume, 0o777)
        with self.device():
            err = self.without_permission("flash", self.image, "--volume", self.volume, status=0)
        self.assertEqual(err, "writing 9.8.7 abcdef012345 for pico_mux\n"
                              f"written, and it came back; its version was not read: {self.port}: {self.RULE}\n")
        with open(os.path.join(self.volume, "fingertip.uf2"), "rb") as written, open(self.image, "rb") as image:
            self.assertEqual(written.read(), image.read())

    def test_another_version_came_back(self):
        self.assertIn("came back with firmware 1.20.3 0123456789ab+ instead of 9.8.7 abcdef012345; unplug the Pico, hold its BOOTSEL",
                      self.flash(after=(), status=1)[1])

    def test_another_board_is_refused_before_anything_happens(self):
        self.assertIn("for board pico_mux, but fingertip E660583883265A2C is a pico_parallel; give fingertip-pico_parallel.uf2",
                      self.flash("board=pico_parallel", status=1)[1])
        self.assertFalse(os.path.exists(self.volume))

    def test_nothing_there_says_what_to_press(self):
        del self.environment["FINGERTIP_PORT"]
        self.assertIn("unplug the Pico, hold its BOOTSEL button while plugging it in", self.error("flash", self.image))
        self.make_volume(board="RP2350")
        self.assertIn("the loader of another chip (RP2350)", self.error("flash", self.image, "--volume", self.volume))

    def test_a_folder_that_is_no_boot_volume_is_refused_before_anything_happens(self):
        with self.device("loader=1") as device:
            self.assertEqual(self.error("flash", self.image, "--volume", self.folder),
                             f"fingertip: {self.folder}: no RP2040 boot volume (no INFO_UF2.TXT); "
                             "leave out --volume, or give that of the drive RPI-RP2\n")
            self.assertIsNone(device.poll())
        self.assertFalse(os.path.exists(os.path.join(self.folder, "fingertip.uf2")))

    def test_damaged_and_foreign_images_are_refused(self):
        with open(self.image, "rb") as file:
            good = file.read()

        def refused(message, content):
            path = os.path.join(self.folder, "bad.uf2")
            with open(path, "wb") as file:
                file.write(content)
            self.assertIn(message, self.error("flash", path))

        def with_word(block, word, value):
            at = 512 * block + 4 * word
            return good[:at] + value.to_bytes(4, "little") + good[at + 4:]

        refused("no UF2 file", b"")
        refused("no UF2 file", b"\x7fELF" + good)
        refused("cut off", good[:-1])
        refused("numbered", good[:-512])
        refused("block 1: numbered 2", good[:512] + good[1024:1536] + good[512:1024] + good[1536:])
        refused("block 1: no UF2 block", with_word(1, 1, 0))
        refused("block 2: no UF2 block", with_word(2, 127, 0))
        refused("for another chip (UF2 family 0xe48bff59)", with_word(0, 7, 0xE48BFF59))
        refused("for another chip", with_word(0, 2, 0))
        refused("not the next page", with_word(1, 3, 0x10000000))
        refused("not the next page", with_word(0, 4, 476))
        refused("the boot ROM would refuse", with_word(0, 10, 1))
        refused("the CRC of the image differs", with_word(3, 30, 0x12345678))
        refused("no Fingertip firmware", good.replace(b"fingertip-board", b"fingertip-bored"))
        self.assertIn("No such file", self.error("flash", self.folder + "/none.uf2"))


class Install(CliTest):
    """What users get: rule, manual, completion."""

    INSTALL = pathlib.Path(__file__).resolve().parents[3] / "host_tools" / "install"

    def commands(self):
        return re.findall(r"^  (\w+) ", self.run_cli("--help")[0].split("Subcommands:")[1], re.M)

    def test_the_build_installs_all_of_the_tool(self):
        build = pathlib.Path(FINGERTIP).parents[2]
        subprocess.run(["cmake", "--install", build, "--component", "tool", "--prefix", self.folder], check=True, capture_output=True)
        installed = {os.path.relpath(os.path.join(folder, name), self.folder)
                     for folder, _, names in os.walk(self.folder) for name in names}
        page = {path for path in installed if path.startswith("share/fingertip/web/")}
        if page:  # only where it was built
            self.assertIn("share/fingertip/web/index.html", page)
        self.assertEqual(installed - page, {
            "bin/fingertip", "lib/udev/rules.d/60-fingertip.rules", "share/man/man1/fingertip.1",
            "share/bash-completion/completions/fingertip", "share/zsh/site-functions/_fingertip",
            "share/fish/vendor_completions.d/fingertip.fish", "lib/systemd/user/fingertip.service"})
        self.assertEqual(subprocess.run([os.path.join(self.folder, "bin/fingertip"), "--version"], capture_output=True, text=True,
                                        check=True).stdout, self.run_cli("--version")[0])
        with open(os.path.join(self.folder, "lib/udev/rules.d/60-fingertip.rules"), encoding="utf-8") as file:
            self.assertEqual(file.read(), self.run_cli("rule")[0])

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
            script = f'. {self.INSTALL}/fingertip.bash; COMP_WORDS=({" ".join(words)} ""); COMP_CWORD={len(words)}; ' \
                     'COMP_WORDS[COMP_CWORD]=$1; _fingertip; echo ${COMPREPLY[@]}'
            environment = {**self.environment, "PATH": os.path.dirname(FINGERTIP) + ":" + self.environment["PATH"]}
            return lambda start: subprocess.run(["bash", "-c", script, "bash", start], env=environment, capture_output=True, text=True,
                                                check=True).stdout.split()

        self.assertEqual(sorted(complete("fingertip")("")), sorted(self.commands()))
        self.assertEqual(complete("fingertip")("mon"), ["monitor"])
        self.assertIn("--transport", complete("fingertip", "info")("--"))
        self.assertEqual(complete("fingertip", "info", "--transport")("s"), ["socket", "serial"])
        models = re.search(r"--gripper MODEL REQUIRED +(.*)", self.run_cli("grasp", "--help")[0])[1].split(", ")
        self.assertEqual(complete("fingertip", "grasp", "--gripper")(""), models)
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device("serial=AAAA"):
            self.assertEqual(complete("fingertip", "info", "--device")(""), ["AAAA"])


class Commands(CliTest):
    def test_info_and_settings(self):
        with self.device():
            out = self.run_cli("info", "--port", self.port)[0]
            self.assertRegex(out, r"(?m)^serial +E660583883265A2C$")
            self.assertRegex(out, r"(?m)^sensors_present +15 of 15$")
            self.assertRegex(out, r"(?m)^sensors_prom_bad +0 1 2 3$")
            self.assertRegex(out, r"(?m)^rate_mHz +20000$")
            self.environment["FINGERTIP_PORT"] = self.port
            out = self.run_cli("set", "rate=max", "osr=256", "slip_threshold=0.5")[0]
            self.assertEqual(out, "rate=max osr=256 slip_threshold=0.5 slip_window=100 prior=3.1:0.5 limit=0.6\n")
            self.assertRegex(self.run_cli("info")[0], r"(?m)^rate_mHz +max$")
            out = self.run_cli("set", "slip_window=250", "rate=20.5")[0]
            self.assertEqual(out, "rate=20.500 osr=256 slip_threshold=0.5 slip_window=250 prior=3.1:0.5 limit=0.6\n")
            self.assertEqual(self.run_cli("tare")[0], "tared\n")
            self.assertIn("RPI-RP2", self.run_cli("loader")[0])

    def test_settings_that_are_kept(self):
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device():
            self.assertRegex(self.run_cli("info")[0], r"(?m)^stored +nothing$")
            out = self.run_cli("set", "prior=2.5", "limit=0.8", "--keep")[0]
            self.assertEqual(out, "rate=20.000 osr=1024 slip_threshold=0.75 slip_window=100 prior=2.5:0.5 limit=0.8 kept\n")
            self.assertRegex(self.run_cli("info")[0], r"(?m)^stored +settings$")
            self.assertNotIn("kept", self.run_cli("set", "--forget", "prior=none")[0])
            self.assertIn(" kept\n", self.run_cli("set", "--keep")[0])
        self.assertIn("excludes", self.error("set", "--keep", "--forget", status=2))
        for words in ([], ["prior=0"], ["limit=x"], ["prior=3:0"]):
            self.assertIn("give", self.error("set", *words, status=2))

    def test_info_shows_a_calibration(self):
        with self.device("calibrated=1"):
            out = self.run_cli("info", "--port", self.port)[0]
        self.assertRegex(out, r"(?m)^stored +calibration$")
        self.assertRegex(out, r"(?m)^calibration_date_s +1785931200 \(2026-08-05 12:00 UTC\)$")
        self.assertRegex(out, r"(?m)^force_scale +1.0625$")
        rows = re.findall(r"(?m)^ +(\d+) +(\d\.\d+) +([\d.]+) +(#*)\|(#*)$", out)
        self.assertEqual(len(rows), 15)
        self.assertEqual(rows[3], ("3", "0.920", "0.8", "####", ""))
        self.assertEqual(rows[12], ("12", "1.100", "0.9", "", "#####"))

    def test_a_pad_is_told_and_shown_and_erased(self):
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device("capabilities=15"):
            self.assertNotIn("pad_", self.run_cli("info")[0])
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "9", patience_s=300)
            self.assertRegex(out, r"^thickness=12 overhang=9 ends force_ratio=0\.9\d\d kept\n$")
            self.assertEqual(err, "")
            out = self.run_cli("info")[0]
            self.assertRegex(out, r"(?m)^capabilities +fit,slip,raw,tangential$")
            self.assertRegex(out, r"(?m)^stored +pad$")
            self.assertRegex(out, r"(?m)^pad_thickness_mm +12$")
            self.assertRegex(out, r"(?m)^pad_overhang_mm +9$")
            self.assertRegex(out, r"(?m)^pad_from_touch +0$")
            self.assertRegex(out, r"(?m)^pad_moments_mm +1\.12\d* 4\.03\d* 5\.56\d*$")
            self.assertRegex(out, r"(?m)^pad_edge_ratio_x +0\.2[3-6]\d* -0\.0\d+ -0\.0\d+$")
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "4.5", patience_s=300)
            self.assertEqual(err.count("spoils the zero"), 1)
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "4.5", "--from-touch", patience_s=300)
            self.assertIn(" from_touch ", out)
            self.assertEqual(err, "")
            self.assertRegex(self.run_cli("info")[0], r"(?m)^pad_from_touch +1$")
            out, err = self.run_cli("pad", "--thickness", "9")
            self.assertIn("overhang=? ", out)
            self.assertIn("a pad without end", err)
            self.assertIn("erased", self.run_cli("pad", "--erase")[0])
            self.assertRegex(self.run_cli("info")[0], r"(?m)^stored +nothing$")
            self.assertIn("--thickness goes from 9 to 20 mm", self.error("pad", "--thickness", "8.9", status=2))
            for wrong in (["--thickness", "21"], ["--thickness", "12", "--overhang", "200"]):
                self.assertIn("out of range; give", self.error("pad", *wrong, status=2))
        self.assertIn("excludes", self.error("pad", "--erase", "--thickness", "12", status=2))
        self.assertIn("--thickness", self.error("pad", "--from-touch", status=2))
        self.assertIn("give --thickness MM", self.error("pad", status=2))
        with self.device():
            self.assertIn("of scene slip, tells no tangential load; install one of scene grasp", self.error("pad", "--thickness", "12"))
        with self.device("capabilities=15", "refuse=1"):
            self.assertIn('refused "pad": not possible now', self.error("pad", "--thickness", "12"))

    def test_info_shows_a_pad_that_was_stored(self):
        with self.device("capabilities=15", "pad=1"):
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], r"(?m)^pad_sds_mm +3.554 5.737$")

    def test_info_names_missing_sensors(self):
        with self.device("absent=7"):
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], r"(?m)^sensors_present +14 of 15, missing: 7$")

    MISSING_ALL = "absent=" + ",".join(str(k) for k in range(15))

    def test_a_recorder_names_missing_sensors(self):
        with self.device("absent=3,7", "frames=50"):
            _, err = self.run_cli("record", self.csv, "--port", self.port, "--until-gone")
        self.assertIn(f"{self.port}: sensors missing: 3 7; see their wiring (fingertip info)\n", err)
        self.assertEqual(err.count("see their wiring"), 1)
        with self.device("frames=50"):
            self.assertNotIn("missing", self.run_cli("record", self.ftr, "--port", self.port, "--until-gone")[1])

    def test_without_any_sensor_it_fails(self):
        with self.device(self.MISSING_ALL, "frames=50"):
            _, err = self.run_cli("record", self.csv, "--port", self.port, "--until-gone", status=1)
        self.assertIn("none of its sensors answers; see their wiring", err.splitlines()[-1])
        with self.device(self.MISSING_ALL, "frames=50"):
            out, err = self.run_cli("monitor", "--port", self.port, "--until-gone", status=1)
        self.assertIn("no sensor answers", out)
        self.assertIn("sensors missing: 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14", out)
        self.assertIn("none of its sensors answers", err)

    def test_refusal(self):
        with self.device("refuse=1"):
            self.assertIn("not tared, it reports a contact of 5.00 N; let go of the pad, or --force", self.error("tare", "--port", self.port))
            self.assertIn('refused "rate": not possible now', self.error("set", "rate=100", "--port", self.port))

    def test_no_answer_can_be_interrupted(self):
        heard = os.path.join(self.folder, "heard")
        with self.device("mute=1", f"heard={heard}"):
            process = self.start("info", "--port", self.port)
            self.wait_for(lambda: os.path.exists(heard))
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE_s)
            self.assertEqual((process.returncode, out, err), (1, "", "fingertip: interrupted\n"))

    def test_a_port_in_use_is_busy(self):
        with self.device():
            process = self.start("record", self.csv, "--port", self.port)
            self.wait_for(lambda: os.path.exists(self.csv))
            self.assertIn("in use by another program", self.error("info", "--port", self.port))
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_s)


class Recording(CliTest):
    def test_seconds(self):
        def recorded_s():
            with self.device():
                self.run_cli("record", self.csv, "--port", self.port, "--seconds", "1", "--raw-bytes", self.ftr, "--overwrite")
            rows, _ = self.rows()
            span_s = (int(rows[-1]["t_us"]) - int(rows[0]["t_us"])) / 1e6
            self.assertGreaterEqual(span_s, 1)
            return span_s

        self.once_in_three(recorded_s, 1.1)
        rows, comments = self.rows()
        self.assertIn("# serial: E660583883265A2C", comments)
        self.assertRegex(comments[-1], r"^# end: reason=seconds frames=\d+ .* dropped_packets=0 .*crc_errors=0")
        self.assertEqual([int(row["frame"]) for row in rows], list(range(1, len(rows) + 1)))
        self.assertTrue(all(row["x_mm"] and row["s14_Pa"] and row["tare0_Pa"] for row in rows[:-1]))
        # the captured bytes hold the same frames
        converted = os.path.join(self.folder, "c.csv")
        self.run_cli("replay", self.ftr, "--to-csv", converted)
        again, _ = self.rows(converted)
        self.assertEqual(again[:len(rows) - 1], rows[:-1])

    def test_interrupt_ends_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.device():
                process = self.start("record", self.csv, "--port", self.port)
                self.wait_for(lambda: os.path.exists(self.csv) and len(self.rows()[0]) > 20)
                process.send_signal(number)
                _, err = process.communicate(timeout=PATIENCE_s)
            self.assertEqual(process.returncode, 0)
            self.assertRegex(err, r"r\.csv: \d+ frames in .* 0 packets dropped")
            _, comments = self.rows()
            os.unlink(self.csv)
            self.assertIn("reason=interrupted", comments[-1])
            # the stop was acknowledged: command 128 is stream
            self.assertTrue(any(c.startswith("# packet: ack") and "command=128" in c for c in comments[-2:]), comments[-2:])

    def test_kill_loses_nothing_written(self):
        with self.device():
            process = self.start("record", self.csv, "--port", self.port)
            self.wait_for(lambda: os.path.exists(self.csv) and len(self.rows()[0]) > 50)
            process.kill()
            process.communicate(timeout=PATIENCE_s)
        self.assertRegex(self.run_cli("replay", self.csv, "--speed", "max")[0], r"\d\d frames in")

    def test_losses_and_damage_are_counted(self):
        with self.device("drop=20", "flip=25", "frames=100"):
            self.run_cli("record", self.csv, "--port", self.port, "--until-gone")
        rows, comments = self.rows()
        # Frames 20, 40, 60 and 80 lose two packets each, and 25, 50 and 75 a damaged one; 100 has no successor to tell.
        self.assertRegex(comments[-1], "reason=gone frames=95 .*dropped_packets=11 .*crc_errors=3 format_errors=0")
        self.assertEqual(sum(row["x_mm"] == "" for row in rows), 3)

    def test_a_vanished_device_is_waited_for(self):
        with self.device("vanish=100,700", "frames=150"):
            self.wait_for(lambda: os.path.lexists(self.port))
            process = self.start("record", self.csv, "--port", self.port)
            self.wait_for(lambda: os.path.exists(self.csv) and any("back" in c for c in self.rows()[1]))
            self.wait_for(lambda: len(self.rows()[0]) >= 220)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)
        rows, comments = self.rows()
        self.assertTrue(any(c.startswith("# event: gone") for c in comments))
        self.assertIn("dropped_packets=0", comments[-1])
        frames = [int(row["frame"]) for row in rows]
        restart = frames.index(1, 1)
        self.assertEqual(frames[:restart], list(range(1, 101)))
        self.assertEqual(frames[restart:], list(range(1, len(frames) - restart + 1)))
        t_us = [int(row["t_us"]) for row in rows]
        seconds = (t_us[restart - 1] - t_us[0] + t_us[-1] - t_us[restart]) / 1e6
        self.assertIn(f" seconds={seconds:.6f} ", comments[-1])
        self.assertRegex(self.run_cli("replay", self.csv, "--speed", "max")[0], " 0 packets dropped")

    def test_until_gone(self):
        with self.device("frames=60"):
            out, _ = self.run_cli("monitor", "--port", self.port, "--until-gone", "--record", self.csv)
        self.assertRegex(out, r"r\.csv: 60 frames in")

    def test_existing_files_are_kept(self):
        with open(self.csv, "w", encoding="utf-8") as file:
            file.write("precious")
        self.assertIn("exists already", self.error("record", self.csv))
        self.assertIn("exists already", self.error("monitor", "--record", self.csv))
        self.assertIn("exists already", self.error("record", self.ftr, "--raw-bytes", self.csv))
        # nor does --overwrite touch them while nothing answers
        self.assertIn("no such port", self.error("record", self.csv, "--port", self.port, "--overwrite"))
        heard = os.path.join(self.folder, "heard")
        with self.device("mute=1", f"heard={heard}"):
            process = self.start("record", self.ftr, "--raw-bytes", self.csv, "--port", self.port, "--overwrite")
            self.wait_for(lambda: os.path.exists(heard))
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_s)
        with open(self.csv, encoding="utf-8") as file:
            self.assertEqual(file.read(), "precious")

    def test_one_file_cannot_be_two(self):
        for other in (self.csv, self.folder + "/./r.csv"):
            for overwrite in ([], ["--overwrite"]):
                self.assertIn("give --raw-bytes another name", self.error("record", self.csv, "--raw-bytes", other, *overwrite))
        self.assertFalse(os.path.exists(self.csv))

    def test_a_full_disk_is_an_error_and_leaves_a_readable_file(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))

        with self.device():
            _, err = self.run_cli("record", self.csv, "--port", self.port, status=1, preexec_fn=limit)
        self.assertIn("what was written until now stays readable", err)
        self.assertRegex(self.run_cli("replay", self.csv, "--speed", "max")[0], r"\d\d frames in")

    def test_a_wrong_place_is_found_before_a_port_is_opened(self):
        for option in ([], ["--overwrite"]):
            self.assertIn("No such file or directory; choose another place", self.error("record", self.folder + "/no/r.csv", *option))
            self.assertIn("is a folder; give the name of a file in it", self.error("record", self.folder, *option))
            self.assertIn("is a folder", self.error("record", self.csv, "--raw-bytes", self.folder + "/", *option))


class LiveData(CliTest):
    """record -: the recording for another program, as it happens."""

    def read_row(self, process):
        while (line := process.stdout.readline()) and not line[0].isdigit():
            pass
        return line.split(",")

    def test_the_last_row_does_not_wait_for_the_next(self):
        with self.device("stall=50"):
            process = self.start("record", "-", "--port", self.port, cwd=self.folder)
            for frame in range(1, 51):
                self.assertEqual(int(self.read_row(process)[1]), frame)
            process.send_signal(signal.SIGINT)
            rest, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn("# end: reason=interrupted frames=50 ", rest)
        self.assertRegex(err.splitlines()[-1], r"^50 frames in .* 0 packets dropped")
        self.assertEqual(os.listdir(self.folder), [])

    def test_what_comes_out_is_a_recording(self):
        with self.device("frames=60"):
            out, err = self.run_cli("record", "-", "--port", self.port, "--until-gone", "--raw-bytes", self.ftr)
        pathlib.Path(self.csv).write_text(out, encoding="utf-8")
        self.assertEqual(len(files.read_recording(self.csv)["frame"]), 60)
        self.assertRegex(err, r"^60 frames in .*\n$")
        self.assertIn(" 60 frames in", self.run_cli("replay", self.csv, "--speed", "max")[0])
        self.assertIn(" 60 frames in", self.run_cli("replay", self.ftr, "--speed", "max")[0])

    def test_a_reader_that_leaves_ends_it(self):
        with self.device():
            process = self.start("record", "-", "--port", self.port)
            self.read_row(process)
            process.stdout.close()
            self.assertEqual(process.wait(PATIENCE_s), 0)
            self.assertRegex(process.stderr.read(), r"^\d+ frames in")
            process.stderr.close()
            self.assertIn("E660583883265A2C", self.run_cli("info", "--port", self.port)[0])

    def test_a_reader_that_does_not_read_keeps_nobody_from_ending_it(self):
        with self.device("rate=2000") as device:
            process = self.start("record", "-", "--port", self.port)
            self.read_row(process)
            time.sleep(1.5)  # a pipe holds 64 KiB, a hundred rows
            process.send_signal(signal.SIGTERM)
            try:
                self.assertEqual(process.wait(PATIENCE_s), 0)
            finally:
                process.kill()
                process.communicate()
                device.kill()  # it waits for its own reader

    def test_trouble_is_told_on_standard_error(self):
        with self.device("vanish=50,2500"), open(self.csv, "wb") as out:
            process = subprocess.Popen([FINGERTIP, "record", "-", "--port", self.port], env=self.environment, text=True,
                                       stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE)
            self.assertEqual(process.stderr.readline(), "gone, plug it in again\n")
            while (line := process.stderr.readline()) != "streaming\n":
                self.assertIn(line, ["waiting for an answer\n", "STALLED\n"])
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_s)
        self.assertRegex(pathlib.Path(self.csv).read_text(encoding="utf-8"), "(?m)^# event: gone .*\n(#.*\n)*# event: back ")

    def test_what_cannot_go_there(self):
        self.assertIn("for - run one `fingertip record - --device SERIAL` for each", self.error("record", "-", "--all", status=2))
        self.assertIn("for each", self.error("record", "-", "--device", "A", "--device", "B", status=2))
        self.assertIn("--raw-bytes needs a file", self.error("record", self.csv, "--raw-bytes", "-", status=2))
        self.assertIn("use `fingertip record -`", self.error("monitor", "--record", "-", status=2))
        with self.device(), open("/dev/full", "w", encoding="ascii") as full:
            process = subprocess.run([FINGERTIP, "record", "-", "--port", self.port], env=self.environment, text=True,
                                     stdin=subprocess.DEVNULL, stdout=full, stderr=subprocess.PIPE, timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 1)
        self.assertIn("fingertip: -: No space left on device", process.stderr)

    def test_a_file_it_is_appended_to_keeps_what_it_had(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))

        pathlib.Path(self.csv).write_text("precious\n", encoding="utf-8")
        with self.device(), open(self.csv, "a", encoding="utf-8") as file:
            process = subprocess.run([FINGERTIP, "record", "-", "--port", self.port], env=self.environment, stdin=subprocess.DEVNULL,
                                     stdout=file, stderr=subprocess.PIPE, preexec_fn=limit, timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 1)
        self.assertIn("precious\n# fingertip-recording 1\n", pathlib.Path(self.csv).read_text(encoding="utf-8"))


class Replay(CliTest):
    def record(self):
        with self.device("frames=100"):
            self.run_cli("record", self.csv, "--port", self.port, "--until-gone", "--raw-bytes", self.ftr)

    def test_recorded_speed(self):
        def replay_s(*options):
            begin = time.monotonic()
            self.run_cli("replay", *options)
            return time.monotonic() - begin

        self.record()
        times_us = [int(row["t_us"]) for row in self.rows()[0]]
        span_us = times_us[-1] - times_us[0]
        self.assertGreaterEqual(replay_s(self.csv), 1e-6 * span_us)
        # the same, stretched to a minute
        with open(self.csv, encoding="utf-8") as file:
            lines = file.readlines()
        stretched = os.path.join(self.folder, "stretched.csv")
        with open(stretched, "w", encoding="utf-8") as file:
            for line in lines:
                if line[0].isdigit():
                    t_us, others = line.split(",", 1)
                    line = f"{times_us[0] + (int(t_us) - times_us[0]) * 60_000_000 // span_us},{others}"
                file.write(line)
        self.assertGreaterEqual(replay_s(stretched, "--speed", "100"), 0.59)
        self.assertLess(replay_s(stretched, "--speed", "max"), 30)

    def test_torn_lines(self):
        self.record()
        with open(self.csv, encoding="utf-8") as file:
            text = file.read()
        rows = [i for i, line in enumerate(text.split("\n")) if line and not line.startswith("#")]
        lines = text.split("\n")
        lines[rows[10]] = lines[rows[10]][:40]
        with open(self.csv, "w", encoding="utf-8") as file:
            file.write("\n".join(lines))
        out, err = self.run_cli("replay", self.csv, "--speed", "max", status=1)
        self.assertIn(f"{self.csv}:{rows[10] + 1}: ", err)
        self.assertIn("use --salvage", err)
        out, err = self.run_cli("replay", self.csv, "--speed", "max", "--salvage")
        self.assertIn("1 damaged lines skipped", err)
        self.assertIn("99 frames in", out)

    def test_a_recording_that_was_cut_short(self):
        self.record()
        self.assertNotIn("cut short", self.run_cli("replay", self.csv, "--speed", "max")[1])
        self.assertNotIn("cut short", self.run_cli("replay", self.ftr, "--speed", "max")[1])
        with open(self.csv, encoding="utf-8") as file:
            lines = file.readlines()
        self.assertTrue(lines[-1].startswith("# end: "))
        with open(self.csv, "w", encoding="utf-8") as file:
            file.writelines(lines[:-1])
        self.assertIn(f"{self.csv}: no end line: the recording was cut short", self.run_cli("replay", self.csv, "--speed", "max")[1])
        self.assertIn("cut short", self.run_cli("replay", self.csv, "--to-csv", self.folder + "/c.csv")[1])

    def test_a_conversion_never_harms_a_file(self):
        self.record()
        with open(self.csv, "rb") as file:
            before = file.read()
        os.link(self.csv, self.folder + "/hard.csv")
        os.symlink("r.csv", self.folder + "/soft.csv")
        for name in ("r.csv", "./r.csv", "hard.csv", "soft.csv"):
            err = self.error("replay", self.csv, "--to-csv", os.path.join(self.folder, name), "--overwrite")
            self.assertIn("is the file to read; give another name", err)
        self.assertIn("is a folder", self.error("replay", self.ftr, "--to-csv", self.folder, "--overwrite"))
        self.assertIn("exists already", self.error("replay", self.ftr, "--to-csv", self.csv))

        # a disk that is full in the middle
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (10000, 10000))

        _, err = self.run_cli("replay", self.ftr, "--to-csv", self.csv, "--overwrite", status=1, preexec_fn=limit)
        self.assertIn("nothing was changed", err)
        with open(self.csv, "rb") as file:
            self.assertEqual(file.read(), before)
        self.assertEqual(sorted(os.listdir(self.folder)), ["hard.csv", "r.csv", "r.ftr", "soft.csv"])
        self.run_cli("replay", self.ftr, "--to-csv", self.csv, "--overwrite")
        self.assertIn("reason=converted", self.rows()[1][-1])

    def test_salvage_is_advised_only_where_it_helps(self):
        self.record()
        text = pathlib.Path(self.csv).read_text(encoding="utf-8")
        bad = os.path.join(self.folder, "bad.csv")
        for content, problem in ((text.replace("t_us,frame", "t_us,fame"), "unknown header"), (text.split("t_us,frame")[0], "no header line"),
                                 (text.replace("recording 1", "recording 9"), 'recording format "9" is unknown'),
                                 (text.replace("recording 1", "scenario 1"), "a scenario, not a recording")):
            pathlib.Path(bad).write_text(content, encoding="utf-8")
            for option in ([], ["--salvage"]):
                err = self.run_cli("replay", bad, "--speed", "max", *option, status=1)[1]
                self.assertIn(problem, err)
                self.assertNotIn("--salvage", err)

    def test_line_ends_of_another_system(self):
        self.record()
        windows = os.path.join(self.folder, "w.csv")
        pathlib.Path(windows).write_bytes(pathlib.Path(self.csv).read_bytes().replace(b"\n", b"\r\n"))
        self.assertIn(" 100 frames in", self.run_cli("replay", windows, "--speed", "max")[0])
        self.assertEqual(len(files.read_recording(windows)["frame"]), 100)

    def test_a_conversion_keeps_what_the_recorder_knew(self):
        self.record()
        converted = os.path.join(self.folder, "c.csv")
        self.run_cli("replay", self.csv, "--to-csv", converted)
        before, after = (files.read_recording(path) for path in (self.csv, converted))
        for key in ("started_utc", "started_device_us", "started_uncertainty_us", "port", "serial"):
            self.assertEqual(after.metadata[key], before.metadata[key])
        self.assertEqual(after.metadata["source"], self.csv)
        self.assertEqual({key: value for key, value in after.end.items() if key != "reason"},
                         {key: value for key, value in before.end.items() if key != "reason"})
        # once more, and still each key once
        twice = os.path.join(self.folder, "d.csv")
        self.run_cli("replay", converted, "--to-csv", twice)
        text = pathlib.Path(twice).read_text(encoding="utf-8")
        for key in ("recorded_by", "source", "port", "started_utc"):
            self.assertEqual(text.count(f"\n# {key}: "), 1, key)

    def test_without_a_fit_there_are_no_numbers(self):
        with self.device("frames=40", "flags=33"):  # CONTACT and TARED
            self.run_cli("record", self.csv, "--port", self.port, "--until-gone")
        for name in ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N", "slip_mm", "location_sd_mm", "sigma_x_mm"):
            self.assertEqual({row[name] for row in self.rows()[0]}, {""}, name)
        self.assertTrue(np.isnan(files.read_recording(self.csv)["force_N"]).all())
        self.assertIn(" 40 frames in", self.run_cli("replay", self.csv, "--speed", "max")[0])

    def test_other_files(self):
        noise = os.path.join(self.folder, "noise.ftr")
        with open(noise, "wb") as file:
            file.write(bytes(range(256)) * 20)
        self.assertIn("no frames in it", self.run_cli("replay", noise, "--speed", "max", status=1)[1])
        self.assertIn("no frames in it", self.error("replay", noise, "--to-csv", self.csv))
        self.assertFalse(os.path.exists(self.csv))
        text = os.path.join(self.folder, "text.csv")
        for content in ("x\n", "a,b,c\n1,2,3\n" * 1000):
            pathlib.Path(text).write_text(content, encoding="utf-8")
            for option in ([], ["--to-csv", self.csv]):
                self.assertIn("neither a recording nor bytes of a fingertip's line", self.error("replay", text, *option))
        self.assertIn("No such file", self.run_cli("replay", self.folder + "/absent.csv", status=1)[1])


class Monitor(CliTest):
    """On a terminal that this test reads, 80 x 24 if nothing else is said."""

    BETWEEN_KEYS_s = 0.5  # a person's pace
    COLOURS = (("COLORTERM", "truecolor"), ("TERM", "xterm"))

    def on_terminal(self, *arguments, until, then, finally_="", environment=COLOURS, size=(80, 24)):
        """Output up to the end; once the screen showed `until`, `then` (a signal, or keys) is sent. A list of keys is typed,
        and q a moment after them, but not before `finally_` was seen. self.shown is the last screen before the end, self.seen every line that was ever on it."""
        pid, terminal = pty.fork()
        if pid == 0:
            time.sleep(0.05)  # until the terminal has its size
            os.execve(FINGERTIP, [FINGERTIP, *arguments], {**self.environment, **dict(environment)})
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))
        screen = pyte.Screen(*size)
        stream = pyte.ByteStream(screen)
        self.shown, self.seen, self.screen = "", [], screen
        try:
            before = termios.tcgetattr(terminal)
            output, sent, pending, typed_at, limit = b"", False, [], 0.0, time.monotonic() + PATIENCE_s
            while True:
                self.assertLess(time.monotonic(), limit, self.shown + repr(output[-2000:]))
                if pending and time.monotonic() - typed_at > self.BETWEEN_KEYS_s and (
                        len(pending) > 1 or not finally_ or re.search(finally_, self.shown)):
                    typed_at = time.monotonic()
                    os.write(terminal, pending.pop(0))
                if not select.select([terminal], [], [], 0.1)[0]:
                    continue
                try:
                    chunk = os.read(terminal, 65536)
                except OSError:
                    break
                if not chunk:
                    break
                output += chunk
                for part in re.split(rb"(?<=\x1b\[\?2026l)", chunk):
                    stream.feed(part)
                    if part.endswith(b"\x1b[?2026l"):
                        self.shown = "\n".join(screen.display)
                        self.seen += [line.rstrip() for line in screen.display if line.rstrip() not in self.seen]
                if not sent and re.search(until, self.shown or output.decode(errors="replace"), re.S):
                    sent = True
                    if isinstance(then, list):
                        pending = [*then, b"q"]
                        typed_at = time.monotonic()
                        os.write(terminal, pending.pop(0))
                    elif isinstance(then, bytes):
                        os.write(terminal, then)
                    else:
                        os.kill(pid, then)
            _, status = os.waitpid(pid, 0)
            pid = 0
            after = None
            with contextlib.suppress(termios.error):
                after = termios.tcgetattr(terminal)
        finally:
            if pid:
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
            os.close(terminal)
        return output.decode(), os.waitstatus_to_exitcode(status), before, after

    def assert_restored(self, output):
        last_enter, last_leave = output.rfind("\x1b[?1049h"), output.rfind("\x1b[?1049l")
        self.assertGreater(last_enter, -1)
        self.assertGreater(last_leave, last_enter)
        self.assertGreater(output.rfind("\x1b[?25h"), output.rfind("\x1b[?25l"))
        self.assertNotIn("\x1b", output[last_leave + 8:])
        self.assertRegex(output[last_leave:], r"\d+ frames in")

    def test_every_way_out_restores_the_terminal(self):
        for way in (signal.SIGINT, signal.SIGTERM, b"q"):
            with self.device():
                output, status, before, after = self.on_terminal("monitor", "--port", self.port, until="live", then=way)
            self.assertEqual(status, 0)
            self.assert_restored(output)
            if after:
                self.assertEqual(before, after)

    def test_shows_what_matters(self):
        for size in ((80, 24), (120, 40), (200, 60)):
            with self.device():
                output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until=r"frames +\d\d", then=b"q", size=size)
            for word in ("FINGERTIP", "E660583883265A2C", "pico_mux", "● live", "force      5.00 N", "CONTACT", "SLIP", "0.75 of 0.75 mm",
                         "frames/s", "dropped", "CRC errors", "convert 2501", "no fit  13", "q quit  t tare", "tared", "kPa",
                         "force  5 N┤", "x    15 mm┤", "y    24 mm┤", "slip  1 mm┤", " 0 s"):
                self.assertIn(word, self.shown)
            for sensor in range(15):
                self.assertRegex(self.shown, rf"[ ▀▄]{sensor}[ ?▀▄]")
            self.assertIn("38;2;", output)

    def test_other_sizes(self):
        with self.device():
            self.on_terminal("monitor", "--port", self.port, until="window too small: 79x24, needs 80x24.*force +5.00", then=b"q", size=(79, 24))

    def test_without_colour(self):
        for environment in ((("NO_COLOR", "1"), *self.COLOURS), (("NO_COLOR", "yes"), ("TERM", "xterm-256color"))):
            with self.device():
                output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until=r"frames +\d\d", then=b"q", environment=environment)
            self.assertNotRegex(output, r"\x1b\[[0-9;]*[34]8;")
            self.assertNotRegex(output, r"\x1b\[(\d+;)*([34][0-7]|9[0-7]|10[0-7])m")
            self.assertIn("┼", "".join(self.seen))
        for environment, arguments in (((("NO_COLOR", ""), *self.COLOURS), ()),
                                       ((("NO_COLOR", "1"), *self.COLOURS), ("--colour", "truecolour"))):
            with self.device():
                output, _, _, _ = self.on_terminal("monitor", "--port", self.port, *arguments, until=r"frames +\d\d", then=b"q",
                                                   environment=environment)
            self.assertIn("38;2;", output)

    CONTACT, FIT_VALID, TARED, UNCERTAIN, FORCE_LOWER_BOUND, AT_BOUND = 1, 2, 32, 1 << 10, 1 << 13, 1 << 15

    def test_what_carries_a_warning_looks_it(self):
        good = self.CONTACT | self.FIT_VALID | self.TARED
        with self.device(f"flags={good}"):
            self.on_terminal("monitor", "--port", self.port, until="5.00 N", then=b"q")
        self.assertNotIn("?N", "".join(self.seen))
        with self.device(f"flags={good | self.UNCERTAIN | self.FORCE_LOWER_BOUND}"):
            self.on_terminal("monitor", "--port", self.port, until="5.00", then=b"q")
        self.assertIn("≥5.00?N", self.shown)
        self.assertIn("UNCERTAIN, may be off by more than 0.60 mm", self.shown)
        self.assertIn("FORCE_LOWER_BOUND, the force is at least this", self.shown)
        self.assertNotIn("┼", "".join(self.seen))
        for flags, words in ((good | self.AT_BOUND | self.FORCE_LOWER_BOUND, r"doubtful:  x -?\d.* force at least 5\.00 N  CONTACT .*AT_BOUND"),
                             (good, r"dropped 0  CRC errors 0  x ")):
            with self.device("frames=300", f"flags={flags}"):
                self.assertRegex(self.run_cli("monitor", "--port", self.port, "--until-gone")[0], words)

    def test_without_a_zero_there_are_no_pressures(self):
        with self.device("flags=0"):
            self.on_terminal("monitor", "--port", self.port, until=r"taring.*frames +\d\d", then=b"q")
        self.assertNotIn("101", self.shown)
        self.assertIn("no zero yet", self.shown)

    def test_what_is_gone_has_no_rate(self):
        with self.device("frames=50"):
            self.on_terminal("monitor", "--port", self.port, until="gone, plug it in again", then=b"q")
        self.assertRegex(self.shown, "frames/s +- ")
        self.assertNotIn("5.00 N", self.shown)

    def test_several_side_by_side(self):
        other = self.port + "2"
        self.environment["FINGERTIP_PORT"] = self.port + ":" + other
        for size in ((80, 24), (200, 60)):
            with self.device("serial=AAAA"), self.device("serial=BBBB", f"flags={self.CONTACT | self.TARED}", port=other):
                output, status, _, _ = self.on_terminal("monitor", "--all", "--record", self.csv, "--overwrite", size=size,
                                                        until=r"5\.00 N.*frames/s +\d.*frames/s +\d", then=b"q")
            self.assertEqual(status, 0, output[-500:])
            self.assertRegex(self.shown, "AAAA pico_mux .*● live .*BBBB pico_mux .*● live")
            self.assertRegex(self.shown, r"force +5\.00 N.* force +- N")
            self.assertEqual(len(re.findall(r"force +\d N┤", self.shown)), 2)
        with self.device("serial=AAAA"), self.device("serial=BBBB", "refuse=1", port=other):
            self.on_terminal("monitor", "--device", "AAAA", "--device", "BBBB", until="live.*live", then=[b"t", b"y"], finally_="not tared")
        self.assertTrue(any("tare all, pads free? y/n" in line for line in self.seen))
        self.assertIn("BBBB: not tared: it reports a contact", self.shown)
        # and what was recorded
        self.on_terminal("replay", self.csv, until="AAAA pico_mux .*replay.*BBBB pico_mux .*replay", then=b"q")
        out, _ = self.run_cli("replay", self.csv, "--speed", "max")
        self.assertRegex(out, r"(?m)^.*: AAAA: \d+ frames in .*\n.*: BBBB: \d+ frames in ")

    def test_replay_pauses_and_seeks(self):
        with self.device():
            self.run_cli("record", self.csv, "--port", self.port, "--seconds", "2")
        lines = pathlib.Path(self.csv).read_text(encoding="utf-8").splitlines(keepends=True)
        first_us = next(int(line.split(",")[0]) for line in lines if line[0].isdigit())
        with open(self.csv, "w", encoding="utf-8") as file:  # the same, twenty times as long
            for line in lines:
                if line[0].isdigit():
                    t_us, others = line.split(",", 1)
                    line = f"{first_us + 20 * (int(t_us) - first_us)},{others}"
                file.write(line)
        last_us = max(int(line.split(",")[0]) for line in lines if line[0].isdigit())
        end_s = 20 * (last_us - first_us) / 1e6  # 40, or more of a machine that is busy
        back = "|".join(f"{end_s - 5 + tenth / 10:.1f}" for tenth in range(-2, 3))
        output, status, _, _ = self.on_terminal("replay", self.csv, until="space pause.* at 0", then=[
            b" ", b"\x1b[C", b"\x1bOC", b"\x1b[D", b"\x1b[H", b"\x1b[F", b"\x1b[D"], finally_=f"PAUSED at ({back})")
        self.assertEqual(status, 0, output[-300:])
        places = [float(at) for line in self.seen for at in re.findall(r"PAUSED at (\d+\.\d) s of", line)]
        begin = places[0]
        self.assertLess(begin, 3)
        for place in (begin + 5, begin + 10, 0.0):
            self.assertTrue(any(abs(place - at) < 0.11 for at in places), (place, places))
        self.assertTrue(any(abs(at - end_s) < 0.5 for at in places), places)
        self.assertAlmostEqual(places[-1], max(places) - 5, delta=0.11)
        self.assert_restored(output)

    def test_256_colours(self):
        with self.device():
            output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until="live", then=b"q",
                                               environment=(("TERM", "xterm-256color"), ("COLORTERM", "")))
        self.assertIn("38;5;", output)
        self.assertNotIn("38;2;", output)

    def test_a_terminal_without_utf_8_gets_ascii(self):
        for language in ("C", "POSIX"):
            with self.device():
                output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until="live", then=b"q",
                                                   environment=(("TERM", "xterm"), ("LC_ALL", language)))
            self.assertTrue(output.isascii(), re.sub("[ -~]", "", output)[:200])
            self.assertIn("CONTACT", self.shown)
            self.assertIn(" us ", self.shown)
        # a locale that this system does not have is known by its name
        with self.device():
            output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until="live", then=b"q",
                                               environment=(("TERM", "xterm"), ("LC_ALL", "xx_XX.utf8")))
        self.assertIn("▀", output)

    def test_flags_move_nothing(self):
        def places(*options):
            with self.device(*options):
                self.on_terminal("monitor", "--port", self.port, until=r"frames +\d\d", then=b"q")
            lines = self.shown.split("\n")
            return lines, [next((i, line.index(word)) for i, line in enumerate(lines) if word in line)
                           for word in ("force", "slip ", "frames/s", "dropped", "one frame", "CPU", "q quit")]

        _, few_places = places("flags=0")
        many, many_places = places(f"flags={0x7FFFF}")
        self.assertEqual(few_places, many_places)
        for name in ("UNCERTAIN", "FORCE_LOWER_BOUND", "AT_BOUND", "SENSOR_DOUBTFUL"):
            self.assertTrue(any(name in line for line in many), (name, many))

    def test_a_dumb_terminal_gets_lines(self):
        with self.device():
            output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until="FIT_VALID", then=signal.SIGINT,
                                               environment=(("TERM", "dumb"),))
        self.assertNotIn("\x1b", output)

    def test_a_stall_shows(self):
        with self.device("stall=50"):
            output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until=r"STALLED for \d", then=b"q")
        self.assert_restored(output)

    def test_a_stall_shows_within_a_second_without_a_terminal(self):
        def shown_after_s():
            """From the line that the first frame brought."""
            with self.device("stall=50"):
                process = self.start("monitor", "--port", self.port)
                first_s, line = None, ""
                while "STALLED" not in line:
                    line = process.stdout.readline()
                    self.assertIn("frames", line)
                    if first_s is None and re.search(" [1-9][0-9]* frames ", line):
                        first_s = time.monotonic()
                shown_s = time.monotonic() - first_s
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=PATIENCE_s)
            return shown_s

        # fifty frames take a quarter of a second
        self.once_in_three(shown_after_s, 0.25 + 1.0)

    def test_an_error_restores_the_terminal(self):
        with self.device("frames=30"):
            output, status, _, _ = self.on_terminal("monitor", "--port", self.port, "--record", "/dev/full", "--overwrite",
                                                    until="never", then=b"q")
        self.assertEqual(status, 1)
        self.assertIn("\x1b[?1049h", output)
        self.assertGreater(output.rfind("\x1b[?1049l"), output.rfind("\x1b[?1049h"))
        self.assertIn("No space left on device", output[output.rfind("\x1b[?1049l"):])

    def on_terminal_tare(self, keys, until, *options):
        """Whether pressing these keys, a moment after each other, tares; and what the screen said."""
        tared = os.path.join(self.folder, "tared")
        pathlib.Path(tared).unlink(missing_ok=True)
        with self.device(f"tared={tared}", *options):
            output, status, _, _ = self.on_terminal("monitor", "--port", self.port, until="live", then=keys, finally_=until)
        self.assertEqual(status, 0)
        self.assert_restored(output)
        return os.path.exists(tared), "\n".join(self.seen)

    def test_a_tare_is_asked_for_and_reported(self):
        done, text = self.on_terminal_tare([b"t", b"y"], "t tare +tared")
        self.assertTrue(done)
        self.assertIn("tare, pad free? y/n", text)
        for flags, why in ((self.CONTACT | self.TARED, "it reports a contact, let go of the pad"), (self.TARED, "not possible now")):
            done, text = self.on_terminal_tare([b"t", b"y"], "not tared", "refuse=1", f"flags={flags}")
            self.assertIn(f"not tared: {why}", text)
            self.assertFalse(done)

    def test_nothing_but_a_person_tares(self):
        for keys in ([b"t", b"n"], [b"ty"], [b"tytytyty\n"], [b"t", b"ty"], [b"\x1b[200~t\x1b[201~", b"y"], [b"\x1b[8;24;80t", b"y"],
                     [b"\x1b]11;rgb:t/t/t\x07", b"y"]):
            self.assertFalse(self.on_terminal_tare(keys, None)[0], keys)

    def test_a_recording_that_cannot_be_gives_the_terminal_back(self):
        pathlib.Path(self.csv).write_text("# fingertip-recording 1\n" + self.header_without_sensors() + "\n# event: then\n1000,1" + 28 * ","
                                          + ",7,0,0,0,0,20.00\n", encoding="utf-8")
        output, status, before, after = self.on_terminal("replay", self.csv, until="never", then=b"q")
        self.assertEqual(status, 1)
        self.assertGreater(output.rfind("\x1b[?1049l"), output.rfind("\x1b[?1049h"))
        self.assertIn("pressures in a recording without sensors", output[output.rfind("\x1b[?1049l"):])
        if after:
            self.assertEqual(before, after)

    @staticmethod
    def header_without_sensors():
        return ",".join(files.RECORDING_COLUMNS)

    def test_lines_where_there_is_no_terminal(self):
        with self.device("frames=300"):
            out, _ = self.run_cli("monitor", "--port", self.port, "--until-gone")
        self.assertNotIn("\x1b", out)
        self.assertRegex(out, r"(?m)^\d\.\d s  \d+ frames .* force 5\.00 N  CONTACT FIT_VALID UNCERTAINTY_VALID SLIP_VALID TARED WIDTHS_VALID "
                         r"TANGENTIAL_VALID VELOCITY_VALID$")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
