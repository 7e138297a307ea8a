"""The fingertip command against a fake device: usage test_cli.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import itertools
import os
import pathlib
import re
import signal
import sys
import unittest

import numpy as np

from cli_case import CliTest
from fingertip import files


class Usage(CliTest):
    def test_help_and_version(self):
        self.assertRegex(self.run_cli("--version")[0], r"^fingertip \d+\.\d+\.\d+\n$")
        commands = re.findall(r"^  (\w+) ", self.run_cli("--help")[0].split("Subcommands:")[1], re.M)
        every = "list info doctor fit monitor record replay convert grasp gripper tare calibrate pad set serve simulate validate web flash rule loader"
        self.assertEqual(sorted(commands), sorted(every.split()))
        pages = {"": self.run_cli("--help")[0]}
        for command in set(commands) - {"simulate", "validate", "fit"}:  # programs of others, with tests of their own
            pages[command] = self.run_cli(command, "--help")[0]
        for command, page in pages.items():
            self.assertIn(f"Usage: fingertip {command}", page)
            self.assertLessEqual(max(map(len, page.splitlines())), 80, command)
            self.assertNotRegex(page, r"FLOAT|INT|TEXT| in \[", command)  # the library's own words
        examples = re.findall(r"(?m)^Examples?: fingertip (.*)$", "".join(pages.values()))
        self.assertEqual(len(examples), 6)
        self.environment["FINGERTIP_PORT"] = self.port
        for words in examples:
            self.assertRegex(self.error(*words.split()), "[Nn]o such")  # wrong usage is another status
        self.assertIn("slip_window=MS (5 to 1000, and 160 frames at most), prior=SIGMA[:WIDTH]|none", " ".join(pages["set"].split()))

    def test_wrong_usage(self):
        missing = "; give one of list, info, doctor, monitor, [a-z, ]*; see fingertip --help"
        for words, problem in (
            ("", f"a command is missing{missing}"),
            ("touched --port x", f'"touched" is no command{missing}'),
            ("recrod", '"recrod" is no command; is record meant[?] see fingertip --help'),
            ("inf", '"inf" is no command; is info meant[?] see fingertip --help'),
            ("gripper1", '"gripper1" is no command; is gripper meant[?] see fingertip --help'),
            ("monitor --bogus", '"--bogus" is no option of it; see fingertip monitor --help'),
            ("list --port a", '"--port" is no option of it; see fingertip list --help'),
            ("list a b", '"a" is one word too many; see fingertip list --help'),
            ("info --port a --port b", "--port is given twice; give it once; see fingertip info --help"),
            ("record", r"FILE.csv[|]FILE.mcap[|]- is missing; see fingertip record --help"),
            ("monitor --colour pink", '--colour "pink" is not possible; give auto, truecolour, 256 or plain; see fingertip monitor --help'),
            ("info --transport bluetooth", '--transport "bluetooth" is not possible; give auto, socket, serial or usb; see .*'),
            *((f"record x.csv --seconds={value}", ".*; give a number from 0.001.*") for value in ("nan", "-1", "0", "inf", "1x")),
            *((f"replay x.csv --speed {value}", ".*; give 0.01 to 1000, or max;.*") for value in ("abc", "0", "nan", "-1", "1001")),
            ("set --keep --forget", ".*excludes.*"),
            ("set", "nothing to set; give .*"),
            ("gripper move x --model 2f85", 'WIDTH takes a number, not "x"; see fingertip gripper --help'),
            ("info --port", "--port lacks its value; see fingertip info --help"),
            ("set rate=5 osr=256 rate=6", "rate=6: is set twice; set it once"),
            (f"set --port {self.port} rate=0", ".*0.1 to 2000 Hz, or max.*"),  # found before a port is opened
            ("pad --erase --thickness 12", ".*excludes.*"),
        ):
            self.assertRegex(self.error(*words.split(), status=2), f"^fingertip: {problem}\n$")

    def test_output_that_cannot_be_written(self):
        for words in (["--help"], ["record", "--help"], ["--version"], ["rule"]):
            with open("/dev/full", "w") as full:
                process = self.start(*words, stdout=full)
                _, err = process.communicate()
            said = "fingertip: cannot write to standard output: No space left on device; choose another place\n"
            self.assertEqual((process.returncode, err), (1, said))

    def test_the_help_of_grasp_knows_what_its_errors_know(self):
        page = " ".join(self.run_cli("grasp", "--help")[0].split())
        sections = page[page.index(" Limits: ") : page.index(" Keys, ")].split(" --")[1:]
        limits = [
            each.groups()
            for each in (re.fullmatch(r"([\w-]+) .*: ([0-9.]+ to [0-9.]+)(?:; default .*)?", section) for section in sections)
            if each
        ]
        self.assertGreater(len(limits), 20)
        for option, most in limits:
            self.assertIn(f"{most}; see fingertip grasp --help", self.error("grasp", f"--{option}=-1", status=2), option)
        self.assertIn("Speed of opening: 0.5 to 100; default 10 ", page)
        for key in ("q end", "o open", "h hold", "g grasp"):
            self.assertIn(key, page[page.index(" Keys, ") : page.index(" Exit status: ")])

    def test_names_cannot_speak_to_the_terminal(self):
        name = self.folder + "/\x1b[31m\n.csv"
        err = self.error("replay", name)
        self.assertIn("\\x1b[31m\\x0a.csv: No such file", err)
        self.assertNotIn("\x1b", self.error("record", name, "--port", "/no/\x1b[31m"))
        self.assertNotIn("\x1b", self.error("replay", "--\x1b[31m", status=2))

    def test_ports(self):
        for command, file in itertools.product(("replay", "flash"), (self.folder, "/dev/zero")):
            self.assertIn("is a folder, a device or a pipe, no file", self.error(command, file))
        self.assertIn("no such port", self.error("info", "--port", self.port))
        self.assertIn("no serial port", self.error("info", "--port", "/dev/null"))
        self.environment["FINGERTIP_PORT"] = self.port + ":" + self.folder
        listed = f"-\t-\t-\tport {self.port} \\(.*no such port; plug .*\\)\n-\t-\t-\tport {self.folder} \\(.*\\)\n"
        self.assertRegex(self.run_cli("list")[0], listed)
        self.assertIn("no fingertip 1234 here", self.error("info", "--device", "1234"))
        self.assertIn("choose the fingertip with --device", self.error("info", "--port", self.port, "--transport", "usb"))


class Several(CliTest):
    """Two fingertips, told apart by their serial numbers."""

    def setUp(self):
        super().setUp()
        self.other = self.port + "2"
        self.environment["FINGERTIP_PORT"] = self.port + ":" + self.other

    def test_list_shows_each_and_what_is_in_use(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            listed = f"AAAA\tpico_mux\t1.20.3\tport {self.port}\nBBBB\tpico_mux\t1.20.3\tport {self.other}\n"
            self.assertEqual(self.run_cli("list")[0], listed)
            process = self.start("record", self.csv, "--device", "AAAA")
            self.world.until(lambda: os.path.exists(self.csv))
            first, second = self.run_cli("list")[0].splitlines()
            self.assertRegex(first, r"^-\t-\t-\t.*in use by another program")
            self.assertTrue(second.startswith("BBBB"))
            self.interrupt(process)

    def test_the_serial_number_chooses(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            for serial, port in (("aaaa", self.port), ("BBBB", self.other)):
                self.assertLessEqual({"port": port, "serial": serial.upper()}.items(), self.info("--device", serial).items())
            for words, said in (
                ("--device CCCC", "no fingertip CCCC here, there are: AAAA BBBB; plug it in, then see `fingertip list`"),
                ("", f"several fingertips found: AAAA ({self.port}), BBBB ({self.other}); choose one with --device SERIAL"),
                (
                    f"--port {self.port} --device BBBB",
                    f"{self.port}: is fingertip AAAA, not BBBB; see `fingertip list`, and choose by --device alone",
                ),
            ):
                self.assertEqual(self.error("info", *words.split()), f"fingertip: {said}\n")

    ALIGNMENT_SECONDS = int(os.environ.get("FINGERTIP_ALIGNMENT_SECONDS", "3"))

    # What clocks that go 50 ppm apart do between two exchanges, 100 ms.
    DRIFT_us = 5

    def assert_in_order(self):
        """Rows are in order of the common clock, as well as it is known."""
        with open(self.csv, encoding="utf-8") as file:
            times = [float(line.split(",")[1]) for line in file if line[0].isdigit()]
        self.assertGreaterEqual(np.diff(times).min(), -self.DRIFT_us)

    def test_rows_stay_in_order_when_the_tool_was_held_up(self):
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=self.other):
            process = self.start("record", self.csv, "--all")
            self.world.until(lambda: os.path.exists(self.csv) and len(self.rows()[0]) > 20)
            for _ in range(4):
                process.hold_up(0.6)
                self.world.sleep(0.7)
            _, err = self.interrupt(process)
        self.assertGreater(len(self.rows()[0]), 500)
        self.assert_in_order()

    def test_two_on_one_clock(self):
        zeros = [os.path.join(self.folder, name) for name in ("zero_a", "zero_b")]
        rates = (1 + 25e-6, 1 - 25e-6)
        life = f"life={self.ALIGNMENT_SECONDS + 60}"
        with (
            self.device("serial=AAAA", "clock_ppm=25", "started=1000", f"zero_log={zeros[0]}", life),
            self.device("serial=BBBB", "clock_ppm=-25", "started=7", f"zero_log={zeros[1]}", life, port=self.other),
        ):
            self.run_cli("record", self.csv, "--all", "--seconds", str(self.ALIGNMENT_SECONDS))
        one, two = (files.read_recording(self.csv, serial=serial) for serial in ("AAAA", "bbbb"))
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
        # on a line without delay what is left is what the clocks drift apart between two exchanges, and the rounding to 0.1 us
        self.assertLessEqual(alignment_us, float(one.end["alignment_us"]) + self.DRIFT_us + 0.2)
        self.assertEqual(one.end["dropped_packets"], "0")
        span_us = one["t_us"][-1] - one["t_us"][0]
        self.assertGreater(span_us, 1e6)
        self.assertGreater(len(errors[0]), 100e-6 * span_us)
        self.assert_in_order()
        several = self.run_cli("convert", self.csv, self.csv + ".ftr", status=1)[1]
        self.assertIn("holds several fingertips: AAAA BBBB; choose one with --device SERIAL", several)

    def test_all_agree_on_what_came(self):
        """Recorder, replay, conversion and reader of a joint recording whose fingertip was unplugged."""
        with self.device("serial=AAAA", "health=7"), self.device("serial=BBBB", "health=5", "vanish=103,500", port=self.other):
            process = self.start("record", self.csv, "--all")
            self.world.until(lambda: os.path.exists(self.csv) and any("1/event: back" in c for c in self.rows()[1]))
            self.world.until(lambda: sum(row["device"] == "1" for row in self.rows()[0]) > 150)
            _, err = self.interrupt(process)
        self.assertIn(" 0 packets dropped, 0 CRC errors", err)
        text = pathlib.Path(self.csv).read_text(encoding="utf-8")
        cut = os.path.join(self.folder, "cut.csv")  # its recorder killed: only the lines themselves tell
        pathlib.Path(cut).write_text(re.sub(r"(?m)^# (\d/)?end: .*\n", "", text), encoding="utf-8")
        for number, serial in enumerate(("AAAA", "BBBB")):
            end = re.search(rf"(?m)^# {number}/end: frames=(\d+) .* packets=(\d+) dropped_packets=0 out_of_order=0 crc_errors=0", text)
            recording = files.read_recording(self.csv, serial=serial)
            self.assertEqual(len(recording["frame"]), int(end[1]))
            self.assertEqual((recording.end["frames"], recording.end["packets"]), end.groups())  # its own, not those of all
            for path in (self.csv, cut):
                out, _ = self.run_cli("replay", path, "--device", serial, "--speed", "max")
                self.assertRegex(out, r" 0 packets dropped, 0 CRC errors")
                converted = os.path.join(self.folder, "c.csv")
                out, _ = self.run_cli("convert", path, "--device", serial, converted, "--overwrite")
                self.assertRegex(out, f": {end[1]} frames, packets=\\d+ dropped_packets=0 out_of_order=0 ")
                again = files.read_recording(converted)
                self.assertEqual(again.end["dropped_packets"], "0")
                self.assertEqual(again.end["out_of_order"], "0")
                self.assertEqual(len(again["frame"]), int(end[1]))
                self.assertEqual(len(again.events), 2 if serial == "BBBB" else 0)
                if path == self.csv:
                    self.assertEqual(again.end["packets"], end[2])
                self.assertIn(" 0 packets dropped", self.run_cli("replay", converted, "--speed", "max")[0])

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

    def test_no_device(self):
        if self.start("list").wait() == 0:
            self.skipTest("a fingertip is plugged in")
        for command in (["list"], ["info"], ["monitor"], ["record", self.csv], ["tare"], ["set", "rate=max"], ["loader"]):
            self.assertRegex(self.error(*command), "^fingertip: no fingertip found; plug one in.*`fingertip simulate`$")
        self.assertRegex(self.error("monitor", "--transport", "usb"), "^fingertip: no fingertip found by libusb; plug one in")
        self.assertFalse(os.path.exists(self.csv))

    def test_wrong_device(self):
        with self.device("mute=1"):
            waiting, said = self.run_cli("info", "--port", self.port, status=1)[1].splitlines()
            self.assertEqual(waiting, f"{self.port}: waiting for an answer")
            self.assertEqual(said, f'fingertip: {self.port}: no answer to "info"; is it a fingertip? unplug it and plug it in again')

    def test_older_or_newer_protocol_version(self):
        for version in (1, 8, 10):
            with self.device(f"version={version}"):
                for command in (["info"], ["set", "rate=max"]):
                    why = f"speaks protocol version {version}, not 9; install this tool's firmware with `fingertip flash`, or use the other's tool"
                    self.assertEqual(self.error(*command, "--port", self.port), f"fingertip: {self.port}: {why}\n")

    def test_cable_pulled(self):
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device("pulled=1"):
            self.assertEqual(self.error("info"), f'fingertip: {self.port}: vanished before it answered "info"; plug it in and try again\n')
        for command in (f"record {self.csv}", "monitor", f"record {self.path('all.csv')} --all"):
            with self.device() as device:
                process = self.start(*command.split())
                stream = process.stdout if command == "monitor" else process.stderr
                while not re.search(r" [1-9]\d* frames", line := stream.readline()):
                    self.assertIn("frames", line)
                device.terminate()
                while "gone, plug it in again" not in (line := stream.readline()):
                    self.assertIn("frames", line)
                self.interrupt(process)


class Commands(CliTest):
    def test_info_and_settings(self):
        with self.device():
            info = self.info("--port", self.port)
            expected = {"serial": "E660583883265A2C", "sensors_present": "15 of 15", "sensors_prom_bad": "0 1 2 3", "rate_mHz": "20000"}
            self.assertLessEqual(expected.items(), info.items())
            self.assertRegex(info["its"], r"1\.20\.3, this tool of version [0-9.]+; install this tool's with `fingertip flash`")
            self.environment["FINGERTIP_PORT"] = self.port
            out = self.run_cli("set", "rate=max", "osr=256", "slip_threshold=0.5")[0]
            self.assertEqual(out, "rate=max osr=256 slip_threshold=0.5 slip_window=100 prior=3.1:0.5 limit=0.6\n")
            self.assertEqual(self.info()["rate_mHz"], "max")
            out = self.run_cli("set", "slip_window=250", "rate=20.5")[0]
            self.assertEqual(out, "rate=20.500 osr=256 slip_threshold=0.5 slip_window=250 prior=3.1:0.5 limit=0.6\n")
            self.assertEqual(self.run_cli("tare")[0], "tared\n")
            self.assertIn("RPI-RP2", self.run_cli("loader")[0])
        with self.device("board=native"):
            self.assertIn("a simulated fingertip has no USB loader", self.error("loader", "--port", self.port))

    def test_settings_that_are_kept(self):
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device():
            self.assertEqual(self.info()["stored"], "nothing")
            out = self.run_cli("set", "prior=2.5", "limit=0.8", "--keep")[0]
            self.assertEqual(out, "rate=20.000 osr=1024 slip_threshold=0.75 slip_window=100 prior=2.5:0.5 limit=0.8 kept\n")
            self.assertEqual(self.info()["stored"], "settings")
            self.assertNotIn("kept", self.run_cli("set", "--forget", "prior=none")[0])
            self.assertIn(" kept\n", self.run_cli("set", "--keep")[0])

    def test_info_shows_a_calibration(self):
        with self.device("calibrated=1"):
            out = self.run_cli("info", "--port", self.port)[0]
        info = dict(re.findall(r"(?m)^(\S+) +(.*)$", out))
        expected = {"stored": "calibration", "calibration_date_s": "1785931200 (2026-08-05 12:00 UTC)", "force_scale": "1.0625"}
        self.assertLessEqual(expected.items(), info.items())
        rows = re.findall(r"(?m)^ +(\d+) +(\d\.\d+) +([\d.]+) .* +(#*)\|(#*)$", out)
        self.assertEqual(len(rows), 15)
        self.assertEqual(rows[3], ("3", "0.920", "0.8", "####", ""))
        self.assertEqual(rows[12], ("12", "1.100", "0.9", "", "#####"))

    def test_a_pad_is_told_and_shown_and_erased(self):
        self.environment["FINGERTIP_PORT"] = self.port
        with self.device("capabilities=15"):
            self.assertNotIn("pad_", self.run_cli("info")[0])
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "9")
            self.assertRegex(out, r"^thickness=12 overhang=9 ends force_ratio=0\.9\d\d kept\n$")
            self.assertEqual(err, "")
            expected = {"capabilities": "fit,slip,raw,tangential", "stored": "pad", "pad_thickness_mm": "12", "pad_overhang_mm": "9"}
            self.assertLessEqual((expected | {"pad_from_touch": "0"}).items(), self.info().items())
            self.assertRegex(self.info()["pad_moments_mm"], r"^1\.12\d* 4\.03\d* 5\.56\d*$")
            self.assertRegex(self.info()["pad_edge_ratio_x"], r"^0\.2[3-6]\d* -?0\.0\d+ -0\.0\d+$")
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "4.5")
            self.assertEqual(err.count("spoils the zero"), 1)
            out, err = self.run_cli("pad", "--thickness", "12", "--overhang", "4.5", "--from-touch")
            self.assertIn(" from_touch ", out)
            self.assertEqual(err, "")
            self.assertEqual(self.info()["pad_from_touch"], "1")
            out, err = self.run_cli("pad", "--thickness", "9")
            self.assertIn("overhang=? ", out)
            self.assertIn("a pad without end", err)
            self.assertIn("erased", self.run_cli("pad", "--erase")[0])
            self.assertEqual(self.info()["stored"], "nothing")
            for untold in ([], ["--from-touch"]):
                self.assertIn("give --thickness MM of the pad's rubber, or calibrate first", self.error("pad", *untold, status=2))
            for option, takes, wrong in (("--thickness", "9 to 20", ("8.9", "21", "nan")), ("--overhang", "0 to 100", ("200", "nan"))):
                for value in wrong:
                    self.assertIn(f'{option} takes {takes} mm, not "{value}"', self.error("pad", f"{option}={value}", status=2))
        with self.device():
            self.assertIn("of scene slip, reports no tangential force; install one of scene grasp", self.error("pad", "--thickness", "12"))
        with self.device("capabilities=15", "refuse=1"):
            self.assertIn('refused "pad": not possible now', self.error("pad", "--thickness", "12"))

    def test_info_shows_what_was_stored_and_what_is_missing(self):
        with self.device("capabilities=15", "pad=1", "absent=7"):
            info = self.info("--port", self.port)
            self.assertEqual((info["pad_sds_mm"], info["sensors_present"]), ("3.554 5.737", "14 of 15, missing: 7"))

    MISSING_ALL = "absent=" + ",".join(str(k) for k in range(15))

    def test_a_recorder_names_missing_sensors(self):
        with self.device("absent=3,7", "frames=50"):
            _, err = self.run_cli("record", self.csv, "--port", self.port, "--until-gone")
        self.assertIn(f"{self.port}: sensors missing: 3 7; see their wiring (fingertip info)\n", err)
        self.assertEqual(err.count("see their wiring"), 1)
        with self.device("frames=50"):
            self.assertNotIn("missing", self.run_cli("record", self.csv, "--overwrite", "--port", self.port, "--until-gone")[1])

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
            err = self.error("tare", "--port", self.port)
            self.assertIn("not tared, it reports a contact of 5.00 N; let go of the pad, or --force", err)
            self.assertIn('refused "rate": not possible now', self.error("set", "rate=100", "--port", self.port))

    def test_no_answer_can_be_interrupted(self):
        heard = os.path.join(self.folder, "heard")
        with self.device("mute=1", f"heard={heard}"):
            process = self.start("info", "--port", self.port)
            self.world.until(lambda: os.path.exists(heard))
            process.send_signal(signal.SIGINT)
            out, err = process.communicate()
            self.assertEqual((process.returncode, out, err), (1, "", "fingertip: interrupted\n"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
