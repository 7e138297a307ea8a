"""The live view on pseudo-terminals: usage test_monitor.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import contextlib
import os
import pathlib
import re
import signal
import sys
import unittest

from cli_case import CliTest, FINGERTIP
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

    def test_colours_and_characters_are_those_of_the_terminal(self):
        colour, codes = r"\x1b\[[0-9;]*[34]8;", r"\x1b\[(\d+;)*([34][0-7]|9[0-7]|10[0-7])m"
        for environment, options, has, has_not in (
            ((("NO_COLOR", "1"), *self.COLOURS), (), "┼", f"{colour}|{codes}"),
            ((("NO_COLOR", "yes"), ("TERM", "xterm-256color")), (), "┼", f"{colour}|{codes}"),
            ((("NO_COLOR", ""), *self.COLOURS), (), "38;2;", "38;5;"),
            ((("NO_COLOR", "1"), *self.COLOURS), ("--colour", "truecolour"), "38;2;", "38;5;"),
            ((("TERM", "xterm-256color"), ("COLORTERM", "")), (), "38;5;", "38;2;"),
            ((("TERM", "xterm"), ("LC_ALL", "C")), (), " us ", "[^\0-\x7f]"),
            ((("TERM", "xterm"), ("LC_ALL", "POSIX")), (), "CONTACT", "[^\0-\x7f]"),
            ((("TERM", "xterm"), ("LC_ALL", "xx_XX.utf8")), (), "▀", "38;2;"),  # a locale that this system does not have
            ((("TERM", "dumb"),), (), "FIT_VALID", "\x1b"),
        ):
            with self.subTest(environment), self.device():
                until, then = ("FIT_VALID", signal.SIGINT) if environment[0][1] == "dumb" else (r"frames +\d\d", b"q")
                output, *_ = self.on_terminal("monitor", "--port", self.port, *options, until=until, then=then, environment=environment)
                self.assertIn(has, output + "".join(self.seen))
                self.assertNotRegex(output, has_not)

    CONTACT, FIT_VALID, TARED, FORCE_LOWER_BOUND, AT_BOUND = 1, 2, 32, 1 << 13, 1 << 15

    def test_a_line_with_a_warning_says_so(self):
        good = self.CONTACT | self.FIT_VALID | self.TARED
        for flags, words in (
            (good | self.AT_BOUND | self.FORCE_LOWER_BOUND, r"doubtful:  x -?\d.* force at least 5\.00 N  CONTACT .*AT_BOUND"),
            (good, r"dropped 0  CRC errors 0  x "),
        ):
            with self.device("frames=300", f"flags={flags}"):
                self.assertRegex(self.run_cli("monitor", "--port", self.port, "--until-gone")[0], words)

    def test_several_side_by_side(self):
        other = self.port + "2"
        self.environment["FINGERTIP_PORT"] = self.port + ":" + other
        with self.device("serial=AAAA"), self.device("serial=BBBB", f"flags={self.CONTACT | self.TARED}", port=other):
            until = r"5\.00 N.*frames/s +\d.*frames/s +\d"
            output, status, _, _ = self.on_terminal("monitor", "--all", "--record", self.csv, size=(200, 60), until=until, then=b"q")
        self.assertEqual(status, 0, output[-500:])
        self.assertRegex(self.shown, "AAAA pico_mux .*● live .*BBBB pico_mux .*● live")
        with self.device("serial=AAAA"), self.device("serial=BBBB", "refuse=1", port=other):
            self.on_terminal("monitor", "--device", "AAAA", "--device", "BBBB", until="live.*live", then=[b"t", b"y"], finally_="not tared")
        self.assertTrue(any("tare all, pads free? y/n" in line for line in self.seen))
        self.assertIn("BBBB: not tared: it reports a contact", self.shown)
        # and what was recorded
        self.on_terminal("replay", self.csv, until="AAAA pico_mux .*replay.*BBBB pico_mux .*replay", then=[b" "], finally_="PAUSED at")
        out, _ = self.run_cli("replay", self.csv, "--speed", "max")
        self.assertRegex(out, r"(?m)^.*: AAAA: \d+ frames in .*\n.*: BBBB: \d+ frames in ")

    def test_flags_move_nothing(self):
        def places(*options):
            with self.device(*options):
                self.on_terminal("monitor", "--port", self.port, until=r"frames +\d\d", then=b"q")
            lines = self.shown.split("\n")
            return [
                next((i, line.index(word)) for i, line in enumerate(lines) if word in line)
                for word in ("force", "slip ", "frames/s", "dropped", "one frame", "CPU", "q quit")
            ]

        self.assertEqual(places("flags=0"), places(f"flags={0x7FFFF}"))

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
            self.interrupt(process)
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

    def test_lines_where_there_is_no_terminal(self):
        with self.device("frames=300"):
            out, _ = self.run_cli("monitor", "--port", self.port, "--until-gone")
        self.assertNotIn("\x1b", out)
        self.assertRegex(
            out,
            r"(?m)^\d\.\d s  \d+ frames .* force 5\.00 N  CONTACT FIT_VALID UNCERTAINTY_VALID SLIP_VALID TARED WIDTHS_VALID "
            r"TANGENTIAL_VALID VELOCITY_VALID SHAPE_VALID EDGE$",
        )
        with self.device():
            monitor = self.start("monitor", "--port", self.port)
            monitor.readline()
            monitor.stdout.close()  # as head does
            self.world.until(lambda: monitor.poll() is not None)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
