"""A program in a simulated world on a terminal: its screen, and keys for it."""

import contextlib
import fcntl
import os
import pty
import re
import select
import struct
import termios
import threading
import time

import pyte

from simulated_time import PATIENCE_s, TimedOut

# What a program on a terminal writes reaches the other side by a thread of the kernel. Behind this mark, written last, nothing is missing.
MARK = b"\x1b_all\x1b\\"
END_OF_UPDATE = b"\x1b[?2026l"
ARRIVAL_s = 60  # of real time, for what is on its way through the kernel


class Ended(AssertionError):
    """Before what was waited for was shown."""


class Terminal:
    """As Process, whose outputs and input are one terminal. Close it."""

    def __init__(self, world, arguments, env=None, size=(80, 24)):
        self._master, self._slave = pty.openpty()
        self.settings_before = termios.tcgetattr(self._slave)
        fcntl.ioctl(self._slave, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))
        self._screen = pyte.Screen(*size)
        self._stream = pyte.ByteStream(self._screen)
        self._world = world
        self.shown = ""  # the last whole picture
        self.seen = []  # every line that was ever in one
        self.output = b""
        self._came, self._more = b"", threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        control = lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0)
        ends = dict.fromkeys(("stdin", "stdout", "stderr"), self._slave)
        self.process = world.start(arguments, env=env, start_new_session=True, preexec_fn=control, **ends)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.end()
        os.close(self._slave)
        self._reader.join()
        os.close(self._master)

    def _read(self):
        """A terminal holds four kilobytes: who writes more waits, and all the world with it."""
        with contextlib.suppress(OSError):  # no program has it open any more
            while came := os.read(self._master, 1 << 16):
                with self._more:
                    self._came += came
                    self._more.notify()

    def look(self):
        """The last whole picture, with all that was written until now."""
        os.write(self._slave, MARK)
        with self._more:
            assert self._more.wait_for(lambda: self._came.endswith(MARK), ARRIVAL_s), "what was written does not arrive"
            came, self._came = self._came[: -len(MARK)], b""
        self.output += came
        for part in re.split(rb"(?<=\x1b\[\?2026l)", came):
            self._stream.feed(part)
            if part.endswith(END_OF_UPDATE):
                self.shown = "\n".join(self._screen.display)
                self.seen += [line.rstrip() for line in self._screen.display if line.rstrip() not in self.seen]
        return self.shown

    def settings(self):
        return termios.tcgetattr(self._slave)

    def type(self, keys):
        if b"\x03" in keys:
            self._world.will_signal(self.process.pid)
            os.write(self._master, keys)
            self._world.wait(seconds=1e-6)  # until then the terminal throws away what is written to it
            return
        os.write(self._master, keys)
        limit_s = time.monotonic() + ARRIVAL_s
        while not select.select([self._slave], [], [], 0.1)[0]:
            assert time.monotonic() < limit_s, "the keys do not arrive"

    def until(self, pattern, limit_s=PATIENCE_s):
        """Until the picture shows this."""

        def is_shown():
            has_ended = self.process.poll() is not None
            shown = re.search(pattern, self.look() or self.output.decode(errors="replace"), re.S)
            if has_ended and not shown:
                raise Ended(f"{pattern!r} was never shown; status {self.process.returncode}\n{self.shown}\n{self.output[-500:]}")
            return shown

        try:
            return self._world.until(is_shown, limit_s)
        except TimedOut as error:
            raise AssertionError(
                f"{error}: {pattern!r} is not shown; status {self.process.poll()}\n{self.shown}\n{self.output[-500:]}"
            ) from None

    def wait(self, limit_s=PATIENCE_s):
        """Its status. A terminal that is not read stops it."""

        def has_ended():
            self.look()
            return self.process.poll() is not None

        with contextlib.suppress(ChildProcessError):
            self._world.until(has_ended, limit_s)
        self.look()
        return self.process.returncode
