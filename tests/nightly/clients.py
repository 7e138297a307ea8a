"""Many programs on one fingertip: what `fingertip serve` delivers to each, how late, and what it answers.

`fingertip serve` shares two simulated fingertips of the highest rate with eight clients, four each. Each client reads both streams and sends a command
ten times a second, at the same instants as the others. One of them reads nothing for eight seconds; after twelve it would be turned away. Of one fingertip every byte goes to a second
terminal too, which is read directly: added is the time from a frame's arrival there to its arrival at a client.
"""

# real time: latency of programs on this computer
import os
import re
import selectors
import socket
import time
import tty

import numpy as np
from nightly import Programs, busy_s, job, wait_for

from fingertip import wire
from fingertip.discovery import find_shared

SERIALS, CLIENTS_EACH, SECONDS, STOPPED_s = ("AAAA", "BBBB"), 4, 60, 8
RATE_Hz = 1310  # 763 us a frame; 764 would be 1308.9, and the last one may come late
TICK_s, LAST_ANSWERS_s = 0.1, 3
COMMANDS = (wire.AskHealth(), wire.SetSlip(0.5, 100), wire.Tare(1), wire.SetRate(1308000), wire.AskInfo(), wire.SetLocationLimit(0.5))


class Client:
    """One end of a line: chunks of bytes with the time at which they came."""

    def __init__(self, descriptor):
        self.descriptor, self.chunks, self.sent = descriptor, [], 0

    def send(self, command):
        os.write(self.descriptor, wire.encode(wire.Packet(self.sent & 0xFFFF, 0, command)))
        self.sent += 1

    def read(self):
        self.chunks.append((time.monotonic(), os.read(self.descriptor, 1 << 16)))

    def decode(self):
        """Arrival of each contact's frame in us, the frames of raw packets, answers to commands, and packets that were lost or damaged."""
        decoder, arrivals, raws, answers = wire.Decoder(), {}, [], 0
        for at_s, data in self.chunks:
            for packet in decoder.feed(data):
                if isinstance(packet.body, wire.Contact):
                    arrivals[packet.body.frame] = 1e6 * at_s
                elif isinstance(packet.body, wire.Raw):
                    raws.append(packet.body.frame)
                answers += isinstance(packet.body, wire.Acknowledgement)
        line = decoder.statistics
        return arrivals, np.array(raws), answers, line.dropped_packets + line.out_of_order + line.crc_errors + line.format_errors


def listen(direct, clients, stopped, seconds):
    """Reads all but the one that is stopped, and sends the commands."""
    begin_s, tick = time.monotonic(), 0
    with selectors.DefaultSelector() as selector:
        for client in (direct, *clients):
            selector.register(client.descriptor, selectors.EVENT_READ, client)
        reads = True
        while (now_s := time.monotonic()) < begin_s + seconds:
            if reads != (not 0 <= now_s - begin_s - seconds / 3 < STOPPED_s):
                reads = not reads
                (selector.register(stopped.descriptor, selectors.EVENT_READ, stopped) if reads else selector.unregister(stopped.descriptor))
            if now_s - begin_s > tick * TICK_s and now_s < begin_s + seconds - LAST_ANSWERS_s:
                for client in clients if reads else [each for each in clients if each is not stopped]:
                    client.send(COMMANDS[tick % len(COMMANDS)])
                tick += 1
            for key, _ in selector.select(TICK_s / 10):
                key.data.read()


@job(
    "tools",
    ("serve_clients", ">=", len(SERIALS) * CLIENTS_EACH),
    ("serve_fps", ">=", 1308),
    ("serve_lost", "<=", 0),
    ("serve_unanswered", "<=", 0),
    ("serve_added_median_us", "<=", 300),
)
def serve(build, seconds=SECONDS):
    with Programs(build) as programs:
        mirror, log = programs.folder / "mirror", programs.folder / "serve.log"
        ports = [programs.fake_device(serial, f"rate={RATE_Hz}", *[f"mirror={mirror}"] * (serial == SERIALS[0])) for serial in SERIALS]
        programs.environment["FINGERTIP_PORT"] = ":".join(map(str, ports))
        with open(log, "w", encoding="utf-8") as file:
            server = programs.start(build / "host_tools/tool/cli/fingertip", "serve", stderr=file)
        wait_for(lambda: log.read_text().count("shared as") == len(SERIALS), "fingertip serve")
        direct = Client(os.open(mirror, os.O_RDWR | os.O_NOCTTY))
        tty.setraw(direct.descriptor)
        clients = []
        for found in find_shared():
            for _ in range(CLIENTS_EACH):
                line = programs.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
                line.connect(found.share_socket)
                client = Client(line.fileno())
                client.serial = found.serial
                client.send(wire.SetStreams(3))
                clients.append(client)
        stopped = clients[-1]
        begun_s, cpu_s = time.monotonic(), busy_s(server.pid)
        listen(direct, clients, stopped, seconds)
        cpu_percent = 100 * (busy_s(server.pid) - cpu_s) / (time.monotonic() - begun_s)
        server.terminate()
        server.wait()
        lost_by_stopped = max(map(int, re.findall(r" lost (\d+) packets", log.read_text())), default=0)
    found = [(client, *client.decode()) for client in clients if client is not stopped]
    at_once = direct.decode()[0]
    packets = lost = 0
    added_us = []
    for client, arrivals, raws, _, _ in found:
        first, last = min(arrivals) + 1, max(arrivals) - 1  # the raw packet of the last one may be under way
        packets += 2 * (last - first + 1)
        lost += 2 * (last - first + 1) - sum(first <= frame <= last for frame in arrivals) - int(np.sum((raws >= first) & (raws <= last)))
        if client.serial == SERIALS[0]:
            added_us += [at_us - at_once[frame] for frame, at_us in arrivals.items() if frame in at_once]
    times_us = list(at_once.values())
    return {
        "serve_clients": len(clients),
        "serve_fingertips": len(SERIALS),
        "serve_seconds": seconds,
        "serve_fps": (len(times_us) - 1) / (times_us[-1] - times_us[0]) * 1e6,
        "serve_packets": packets,
        "serve_lost": lost,
        "serve_gaps": sum(gaps for *_, gaps in found),
        "serve_commands": sum(client.sent for client, *_ in found),
        "serve_unanswered": sum(client.sent - answers for client, _, _, answers, _ in found),
        "serve_added_median_us": float(np.median(added_us)),
        "serve_added_p99_us": float(np.percentile(added_us, 99)),
        "serve_added_max_us": float(np.max(added_us)),
        "serve_cpu_percent": cpu_percent,
        "serve_lost_by_stopped": lost_by_stopped,
    }
