"""An emulated fingertip in a simulated world (time_keeper.cpp):

    emulated_fingertip.py PORT [--wait-open] NODE MAIN.MJS [option of the emulator...]

runs the emulator with --stepped and serves its CDC port as PORT, a socket as simulated_port.cpp has it. Emulated time passes with the world's: what
the board sends arrives at its time, what a client does reaches the board TRANSFER_us later, always. So the emulator may be ahead of the world, by
TRANSFER_us beyond the first moment that anybody else goes on, and two runs are the same byte for byte.

--wait-open: power comes when the port is first opened. With the power comes a line on standard output, the world's time then in us: "1000002500".
Ends with the emulator and its exit status; SIGTERM and SIGINT end the emulator's run.
"""

import collections
import contextlib
import os
import signal
import socket
import struct
import subprocess
import sys

from simulated_time import FOR_EVER_us, INTERRUPTED, VARIABLE, Line

TRANSFER_us = 250  # less than the millisecond between two frames of the bus, which is what a client's bytes may wait
FULL_WAIT_us = 1000  # until a client that does not read is looked at again
LONGEST_RUN_us = 1_000_000


class Emulator:
    """As a process; its frames: host_tools/simulation/emulator/port/stepped_port.mjs. Times are since power-on."""

    def __init__(self, command):
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.now_us, self.has_ended = 0, False

    def say(self, kind, *times_us, data=b""):
        """At the first of the times, which has not come."""
        payload = struct.pack(f"<{len(times_us)}Q", *(1000 * time_us for time_us in times_us)) + data
        try:
            self._process.stdin.write(struct.pack("<cI", kind, len(payload)) + payload)
            self._process.stdin.flush()
        except BrokenPipeError:
            sys.exit(self.status())  # it has ended, and said why

    def run(self, until_us, sent):
        """Runs until then, or until TRANSFER_us beyond the first bytes out; those that came are added to sent, with their times."""
        self.say(b"R", until_us, TRANSFER_us)
        while True:
            kind, length = struct.unpack("<cI", self._take(5))
            payload = self._take(length)
            at_us = -(-int.from_bytes(payload[:8], "little") // 1000)
            if kind == b"T":
                self.now_us, self.has_ended = at_us, payload[8] != 0
                return
            sent.append((at_us, payload[8:]))

    def _take(self, length):
        data = self._process.stdout.read(length)
        return data if len(data) == length else sys.exit(self.status())

    def end(self):
        """Its status, once it has written what it writes; its power is cut if it still ran."""
        if not self.has_ended:
            self.say(b"E")
        return self.status()

    def status(self):
        status = self._process.wait()
        return status if status >= 0 else 128 - status


class Port:
    def __init__(self, path):
        self._path, self._client = path, None
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(path)
        self._listener.listen(8)
        self._listener.setblocking(False)

    def close(self):
        os.unlink(self._path)

    @property
    def is_open(self):
        return self._client is not None

    def _look(self):
        try:
            if not self.is_open:
                self._client, _ = self._listener.accept()
                self._client.setblocking(False)
            elif not self._client.recv(1, socket.MSG_PEEK):
                self._client = None  # the next client shows at the next look: who serves sees either change
        except BlockingIOError:
            pass
        except ConnectionError:
            self._client = None

    def wait(self, line, until_us):
        was_open = self.is_open
        self._look()
        if self.is_open == was_open and until_us > line.now_us:
            line.wait(until_us, [(self._client or self._listener).fileno()])
            self._look()

    def read(self):
        with contextlib.suppress(BlockingIOError, ConnectionError):
            return self._client.recv(4096) if self.is_open else b""
        return b""

    def write(self, data):
        """How much of it was taken; all where nobody is there."""
        self._look()
        try:
            return self._client.send(data) if self.is_open else len(data)
        except BlockingIOError:
            return 0
        except ConnectionError:
            return len(data)


class Fingertip:
    def __init__(self, port, waits_open, command):
        self._is_interrupted, self._line = False, None
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._interrupt)
        self._port, self._emulator = port, Emulator(command)
        self._is_open = self._is_full = False
        self._sent = collections.deque()  # not due yet
        self._unread = b""  # due, and not taken by the client's end yet
        self._emulator.run(0, self._sent)  # is there, or has ended with a word why
        self._line = Line(os.environ[VARIABLE])
        self._line.take_turn()
        while waits_open and not port.is_open and not self._is_interrupted:
            port.wait(self._line, FOR_EVER_us)
        self._zero_us = self._line.now_us
        self._emulator.say(b"Z", self._zero_us)
        print(self._zero_us, flush=True)

    def _interrupt(self, *_):
        self._is_interrupted = True
        if self._line is not None:
            self._line.say(INTERRUPTED)

    @property
    def _now_us(self):
        return self._line.now_us - self._zero_us

    def run(self):
        emulator = self._emulator
        while not self._is_interrupted and not (emulator.has_ended and not self._sent and self._now_us >= emulator.now_us):
            self._hear()
            self._put()
            if not emulator.has_ended:
                self._advance()
            until_us = self._sent[0][0] if self._sent else emulator.now_us
            if self._unread:
                until_us = min(max(until_us, self._now_us + 1), self._now_us + FULL_WAIT_us)
            self._port.wait(self._line, self._zero_us + until_us)
        return emulator.end()

    def _hear(self):
        """What the client does."""
        if self._emulator.has_ended:
            return
        at_us = self._now_us + TRANSFER_us
        if self._port.is_open != self._is_open:
            self._is_open, self._is_full, self._unread = not self._is_open, False, b""
            self._emulator.say(b"O" if self._is_open else b"C", at_us)
        while data := self._port.read():
            self._emulator.say(b"D", at_us, data=data)

    def _put(self):
        """What is due for it."""
        while self._sent and self._sent[0][0] <= self._now_us:
            self._unread += self._sent.popleft()[1]
        if self._unread:
            self._unread = self._unread[self._port.write(self._unread) :]
        if self._is_full != bool(self._unread) and not self._emulator.has_ended:
            self._is_full = not self._is_full
            self._emulator.say(b"W", self._now_us + TRANSFER_us, data=bytes([self._is_full]))

    def _advance(self):
        """As far as no other can interfere."""
        until_us = min(self._now_us + LONGEST_RUN_us, self._line.others_us - self._zero_us + TRANSFER_us)
        if self._sent:
            until_us = min(until_us, self._sent[0][0] + TRANSFER_us)
        if until_us > self._emulator.now_us:
            self._emulator.run(until_us, self._sent)


def main(argv):
    waits_open = argv[1:2] == ["--wait-open"]
    command = argv[1 + waits_open :]
    if len(command) < 2:
        sys.exit(__doc__)
    port = Port(argv[0])
    try:
        return Fingertip(port, waits_open, [*command, "--stepped"]).run()
    finally:
        port.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
