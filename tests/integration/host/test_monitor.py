"""The live view on pseudo-terminals: usage test_monitor.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import contextlib
import os
import pathlib
import re
import signal
import sys
import unittest

from cli_case import CliTest, FINGERTIP
from fingertip import files
from simulated_terminal import Ended, Terminal


class Monitor(CliTest):
    """On a terminal that this test reads, 80 x 24 if nothing else is said."""

    BETWEEN_KEYS_s = 0.5  # a person's pace
    COLOURS = (("COLORTERM", "truecolor"), ("TERM", "xterm"))

    def on_terminal(self, *arguments, until, then, finally_="", environment=COLOURS, size=(80, 24)):
        """Output up to the end; once the screen showed `until`, `then` (a signal, or keys) is sent. A list of keys is typed,
        and q a moment after them, but not before `finally_` was seen. self.shown is the last screen before the end, self.seen every line that was ever on it."""
        with Terminal(self.world, [FINGERTIP, *arguments], {**self.environment, **dict(environment)}, size) as terminal:
            before = terminal.settings_before
            with contextlib.suppress(Ended):
                terminal.until(until)
                if isinstance(then, list):
                    for keys in then:
                        terminal.type(keys)
                        self.world.sleep(self.BETWEEN_KEYS_s)
                    if finally_:
                        terminal.until(finally_)
                    terminal.type(b"q")
                elif isinstance(then, bytes):
                    terminal.type(then)
                else:
                    terminal.process.send_signal(then)
            status = terminal.wait()
            self.shown, self.seen = terminal.shown, terminal.seen
            return terminal.output.decode(), status, before, terminal.settings()

    def assert_restored(self, output):
        last_enter, last_leave = output.rfind("\x1b[?1049h"), output.rfind("\x1b[?1049l")
        self.assertGreater(last_enter, -1)
        self.assertGreater(last_leave, last_enter)
        self.assertGreater(output.rfind("\x1b[?25h"), output.rfind("\x1b[?25l"))
        self.assertNotIn("\x1b", output[last_leave + 8 :])
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
            for word in (
                "FINGERTIP",
                "E660583883265A2C",
                "pico_mux",
                "● live",
                "force      5.00 N",
                "CONTACT",
                "SLIP",
                "0.75 of 0.75 mm",
                "frames/s",
                "dropped",
                "CRC errors",
                "convert 2501",
                "no fit  13",
                "q quit  t tare",
                "tared",
                "kPa",
                "force  5 N┤",
                "x    15 mm┤",
                "y    24 mm┤",
                "slip  1 mm┤",
                " 0 s",
            ):
                self.assertIn(word, self.shown)
            for sensor in range(15):
                self.assertRegex(self.shown, rf"[ ▀▄]{sensor}[ ?▀▄]")
            self.assertIn("38;2;", output)

    def test_other_sizes(self):
        with self.device():
            self.on_terminal(
                "monitor", "--port", self.port, until="window too small: 79x24, needs 80x24.*force +5.00", then=b"q", size=(79, 24)
            )

    def test_without_colour(self):
        for environment in ((("NO_COLOR", "1"), *self.COLOURS), (("NO_COLOR", "yes"), ("TERM", "xterm-256color"))):
            with self.device():
                output, _, _, _ = self.on_terminal(
                    "monitor", "--port", self.port, until=r"frames +\d\d", then=b"q", environment=environment
                )
            self.assertNotRegex(output, r"\x1b\[[0-9;]*[34]8;")
            self.assertNotRegex(output, r"\x1b\[(\d+;)*([34][0-7]|9[0-7]|10[0-7])m")
            self.assertIn("┼", "".join(self.seen))
        for environment, arguments in (
            ((("NO_COLOR", ""), *self.COLOURS), ()),
            ((("NO_COLOR", "1"), *self.COLOURS), ("--colour", "truecolour")),
        ):
            with self.device():
                output, _, _, _ = self.on_terminal(
                    "monitor", "--port", self.port, *arguments, until=r"frames +\d\d", then=b"q", environment=environment
                )
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
        for flags, words in (
            (good | self.AT_BOUND | self.FORCE_LOWER_BOUND, r"doubtful:  x -?\d.* force at least 5\.00 N  CONTACT .*AT_BOUND"),
            (good, r"dropped 0  CRC errors 0  x "),
        ):
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
                output, status, _, _ = self.on_terminal(
                    "monitor",
                    "--all",
                    "--record",
                    self.csv,
                    "--overwrite",
                    size=size,
                    until=r"5\.00 N.*frames/s +\d.*frames/s +\d",
                    then=b"q",
                )
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
        output, status, _, _ = self.on_terminal(
            "replay",
            self.csv,
            until="space pause.* at 0",
            then=[b" ", b"\x1b[C", b"\x1bOC", b"\x1b[D", b"\x1b[H", b"\x1b[F", b"\x1b[D"],
            finally_=f"PAUSED at ({back})",
        )
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
            output, _, _, _ = self.on_terminal(
                "monitor", "--port", self.port, until="live", then=b"q", environment=(("TERM", "xterm-256color"), ("COLORTERM", ""))
            )
        self.assertIn("38;5;", output)
        self.assertNotIn("38;2;", output)

    def test_a_terminal_without_utf_8_gets_ascii(self):
        for language in ("C", "POSIX"):
            with self.device():
                output, _, _, _ = self.on_terminal(
                    "monitor", "--port", self.port, until="live", then=b"q", environment=(("TERM", "xterm"), ("LC_ALL", language))
                )
            self.assertTrue(output.isascii(), re.sub("[ -~]", "", output)[:200])
            self.assertIn("CONTACT", self.shown)
            self.assertIn(" us ", self.shown)
        # a locale that this system does not have is known by its name
        with self.device():
            output, _, _, _ = self.on_terminal(
                "monitor", "--port", self.port, until="live", then=b"q", environment=(("TERM", "xterm"), ("LC_ALL", "xx_XX.utf8"))
            )
        self.assertIn("▀", output)

    def test_flags_move_nothing(self):
        def places(*options):
            with self.device(*options):
                self.on_terminal("monitor", "--port", self.port, until=r"frames +\d\d", then=b"q")
            lines = self.shown.split("\n")
            return lines, [
                next((i, line.index(word)) for i, line in enumerate(lines) if word in line)
                for word in ("force", "slip ", "frames/s", "dropped", "one frame", "CPU", "q quit")
            ]

        _, few_places = places("flags=0")
        many, many_places = places(f"flags={0x7FFFF}")
        self.assertEqual(few_places, many_places)
        for name in ("UNCERTAIN", "FORCE_LOWER_BOUND", "AT_BOUND", "SENSOR_DOUBTFUL"):
            self.assertTrue(any(name in line for line in many), (name, many))

    def test_a_dumb_terminal_gets_lines(self):
        with self.device():
            output, _, _, _ = self.on_terminal(
                "monitor", "--port", self.port, until="FIT_VALID", then=signal.SIGINT, environment=(("TERM", "dumb"),)
            )
        self.assertNotIn("\x1b", output)

    def test_a_stall_shows(self):
        with self.device("stall=50"):
            output, _, _, _ = self.on_terminal("monitor", "--port", self.port, until=r"STALLED for \d", then=b"q")
        self.assert_restored(output)

    def test_a_stall_shows_within_a_second_without_a_terminal(self):
        with self.device("stall=50"):
            process = self.start("monitor", "--port", self.port)
            first_s, line = None, ""
            while "STALLED" not in line:
                line = process.stdout.readline()
                self.assertIn("frames", line)
                if first_s is None and re.search(" [1-9][0-9]* frames ", line):
                    first_s = self.world.now_s
            shown_s = self.world.now_s - first_s
            process.send_signal(signal.SIGINT)
            process.communicate()
        self.assertLess(shown_s, 0.25 + 1.0)  # fifty frames take a quarter of a second

    def test_an_error_restores_the_terminal(self):
        with self.device("frames=30"):
            output, status, _, _ = self.on_terminal(
                "monitor", "--port", self.port, "--record", "/dev/full", "--overwrite", until="never", then=b"q"
            )
        self.assertEqual(status, 1)
        self.assertIn("\x1b[?1049h", output)
        self.assertGreater(output.rfind("\x1b[?1049l"), output.rfind("\x1b[?1049h"))
        self.assertIn("No space left on device", output[output.rfind("\x1b[?1049l") :])

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
        for keys in (
            [b"t", b"n"],
            [b"ty"],
            [b"tytytyty\n"],
            [b"t", b"ty"],
            [b"\x1b[200~t\x1b[201~", b"y"],
            [b"\x1b[8;24;80t", b"y"],
            [b"\x1b]11;rgb:t/t/t\x07", b"y"],
        ):
            self.assertFalse(self.on_terminal_tare(keys, None)[0], keys)

    def test_a_recording_that_cannot_be_gives_the_terminal_back(self):
        pathlib.Path(self.csv).write_text(
            "# fingertip-recording 1\n"
            + self.header_without_sensors()
            + "\n# event: then\n1000,1"
            + (len(files.RECORDING_COLUMNS) - 8) * ","
            + ",7,0,0,0,0,20.00\n",
            encoding="utf-8",
        )
        output, status, before, after = self.on_terminal("replay", self.csv, until="never", then=b"q")
        self.assertEqual(status, 1)
        self.assertGreater(output.rfind("\x1b[?1049l"), output.rfind("\x1b[?1049h"))
        self.assertIn("pressures in a recording without sensors", output[output.rfind("\x1b[?1049l") :])
        if after:
            self.assertEqual(before, after)

    @staticmethod
    def header_without_sensors():
        return ",".join(files.RECORDING_COLUMNS)

    def test_lines_where_there_is_no_terminal(self):
        with self.device("frames=300"):
            out, _ = self.run_cli("monitor", "--port", self.port, "--until-gone")
        self.assertNotIn("\x1b", out)
        self.assertRegex(
            out,
            r"(?m)^\d\.\d s  \d+ frames .* force 5\.00 N  CONTACT FIT_VALID UNCERTAINTY_VALID SLIP_VALID TARED WIDTHS_VALID "
            r"TANGENTIAL_VALID VELOCITY_VALID SHAPE_VALID EDGE$",
        )


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
