#!/usr/bin/python3
"""Holds the pseudo-terminal of pty_port.mjs: usage pty_port.py LINK. The frames are described there.

Ends when its stdin closes. Opening and closing by a client shows as the absence or presence of POLLHUP on the master side; the line is put
into raw mode before the first client and after the last one, baud rate changes are polled while a client has it open.
"""

import contextlib
import os
import pty
import select
import struct
import sys
import termios
import tty

POLL_S = 0.005
CHUNK = 4096
BAUD = {getattr(termios, n): int(n[1:]) for n in dir(termios) if n.startswith("B") and n[1:].isdigit()}


def frame(kind, payload=b""):
    data = kind + struct.pack("<I", len(payload)) + payload
    while data:
        data = data[os.write(1, data) :]


def make_link(link, target):
    if os.path.lexists(link):
        if not os.path.islink(link):
            sys.exit(f"{link} exists and is no symbolic link; choose another --pty")
        used = os.readlink(link)
        if used != target and os.path.exists(link):
            sys.exit(f"{link} is in use: it leads to {used}; end the other emulator, delete the link, or choose another --pty")
        os.unlink(link)
    try:
        os.symlink(target, link)
    except OSError as error:
        sys.exit(f"{link}: cannot make the link ({error.strerror}); choose another --pty")


def make_raw(name):
    """Raw mode set through a short-lived slave descriptor, so that the master sees the hang-up afterwards."""
    slave = os.open(name, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(slave, termios.TCSANOW)
    os.close(slave)


def main():
    link = sys.argv[1]
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    os.close(slave)
    os.set_blocking(master, False)
    os.set_blocking(0, False)
    make_raw(name)
    make_link(link, name)
    frame(b"R")

    poll = select.poll()
    is_open = False
    baud = None
    incoming = b""
    outgoing = b""
    try:
        while True:
            poll.register(0, select.POLLIN)
            poll.register(master, select.POLLIN | (select.POLLOUT if outgoing else 0))
            hung_up = False
            for fd, events in poll.poll(POLL_S * 1000):
                if fd == 0:
                    chunk = os.read(0, 65536)
                    if not chunk:
                        return
                    incoming += chunk
                elif events & select.POLLHUP:
                    hung_up = True
            if not hung_up and not is_open:
                is_open = True
                frame(b"O")
            while len(incoming) >= 5:
                (length,) = struct.unpack_from("<I", incoming, 1)
                if len(incoming) < 5 + length:
                    break
                if is_open:
                    outgoing += incoming[5 : 5 + length]
                else:  # a client that comes later must not get what an earlier one left
                    frame(b"A", struct.pack("<I", length))
                incoming = incoming[5 + length :]
            if is_open:
                speed = BAUD.get(termios.tcgetattr(master)[5], 0)
                if speed and speed != baud:
                    if baud is not None or speed != 38400:
                        frame(b"B", struct.pack("<I", speed))
                    baud = speed
                try:
                    data = os.read(master, CHUNK)
                    if data:
                        frame(b"D", data)
                except BlockingIOError:
                    pass
                except OSError:
                    hung_up = True
                if outgoing and not hung_up:
                    try:
                        taken = os.write(master, outgoing[:CHUNK])
                        outgoing = outgoing[taken:]
                        frame(b"A", struct.pack("<I", taken))
                    except BlockingIOError:
                        pass
            if hung_up:
                if is_open:
                    is_open = False
                    outgoing = b""
                    frame(b"C")
                    make_raw(name)
                select.select([0], [], [], POLL_S)
    finally:
        if os.path.islink(link) and os.readlink(link) == name:
            os.unlink(link)


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        main()
