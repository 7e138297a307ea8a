"""Publishes every fingertip of this computer on Zenoh, until it is ended: contact, raw, health and info packets as they were on the
line, with this computer's clock. Keys: README.md of the package. A fingertip that is plugged in later is found, one that is unplugged is
waited for. It listens on this computer alone, unless --listen, --connect or --config has it otherwise, and takes no commands, unless
--commands does: nothing is encrypted, and everybody in reach may tare and set then, unless --config restricts it.

In Python, because the package reconnects, finds and shares fingertips already, and Debian has no Zenoh for C++.
"""

import collections
import concurrent.futures
import contextlib
import json
import os
import pathlib
import platform

from . import discovery, host_time, wire
from .command import Parser, check_range, printable, reporter
from .device import Fingertip
from .errors import FingertipError, InputError
from .network import AGAIN_MOST, ROOT, Stamp, add_session_options, host_clock, open_session, settings_of, until_ended, zenoh_module

LOOK_s = 1.0  # for fingertips that came
STATUS_s = 0.5
CHRONY_s = 5.0
LIVE_s = 0.5  # what waited longer for the network is not published, but kept for who asks
KEPT_LINES = 8
NAMES = {wire.Contact: "contact", wire.Raw: "raw", wire.Health: "health", wire.Info: "info"}


def _boot():
    """Only processes of the same computer have this in common: they have one clock."""
    try:
        return pathlib.Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return platform.node()


class _Published:
    """One fingertip on Zenoh. Its reading thread numbers and keeps the packets, a thread of its own publishes them: the network never
    holds up the line."""

    def __init__(self, session, tip, keep, clock_of_host, commands):
        self.tip = tip
        self._zenoh = zenoh_module()
        self._session = session
        self._keep = keep
        self._clock_of_host = clock_of_host
        self._lines = collections.deque(maxlen=KEPT_LINES)  # [line, number of its last packet that was read, and that was published]
        self._kept = collections.OrderedDict()  # (line, number) -> (name, frame, stamp)
        self._line = self._number = 0
        self._expected = None
        self._early = []
        self._queue = collections.deque()
        self._news = host_time.event()
        self._closing = False
        self.skipped = 0
        self._token = None
        self._root = f"{ROOT}/{tip.serial}"
        drop = {"congestion_control": self._zenoh.CongestionControl.DROP, "express": True}
        names = (*NAMES.values(), "other", "status")
        self._publishers = {name: session.declare_publisher(f"{self._root}/{name}", **drop) for name in names}
        self._pool = concurrent.futures.ThreadPoolExecutor(3, thread_name_prefix="answer")
        answers = {"info": self._info, "status": self._answer_status, "again": self._again}
        answers |= {"tare": self._tare, "set": self._set} if commands else dict.fromkeys(("tare", "set"), self._refuse)
        self._queryables = [session.declare_queryable(f"{self._root}/{name}", self._when_asked(answer)) for name, answer in answers.items()]
        self._begin_line()
        self._thread = host_time.thread(self._publish, name="publish", daemon=True)
        self._thread.start()
        tip.on_packets(self._hear)
        with contextlib.suppress(FingertipError):
            tip.read_info()  # goes out as a packet

    # The reading thread

    def _begin_line(self):
        self._line, self._number, self._expected = max(host_time.wall_ns(), self._line + 1), 0, None
        self._lines.append([self._line, 0, 0])

    def _note(self, column, line, number):
        next(each for each in reversed(self._lines) if each[0] == line)[column] = number

    def _hear(self, packet, frame):
        if packet is None:
            self._begin_line()
            return
        ahead = 0 if self._expected is None else packet.sequence - self._expected & 0xFFFF
        if ahead >= 0x8000:  # repeated, or again
            self._begin_line()
            ahead = 0
        self._expected = packet.sequence + 1 & 0xFFFF
        self._number += ahead + 1
        name = NAMES.get(type(packet.body), "other")
        self._early.append((name, packet.t_us, bytes(frame), self._line, self._number, host_time.wall_ns()))
        clock = self.tip.clock
        if clock.host_us != clock.host_us:
            return  # until the clocks were compared
        behind_ns = host_time.wall_ns() - host_time.now_ns()  # the clock of Fingertip.clock, the time of day
        shared = int(self.tip.description.endswith(".sock"))
        for name, t_us, data, line, number, taken_ns in self._early:
            measured_ns = round(clock.host_at(t_us) * 1000) + behind_ns
            stamp = Stamp(line, number, taken_ns, measured_ns, clock.uncertainty_us, clock.drift_ppm, shared).packed()
            self._kept[line, number] = (name, data, stamp)
            self._queue.append((name, data, stamp, line, number, host_time.now_s()))
            self._note(1, line, number)
        self._early.clear()
        while len(self._kept) > self._keep:
            self._kept.popitem(last=False)
        self._news.set()

    # The publishing thread

    def _publish(self):
        next_status_s = 0.0
        while not self._closing:
            self._news.wait(STATUS_s / 2)
            self._news.clear()
            while self._queue:
                name, data, stamp, line, number, kept_s = self._queue.popleft()
                if host_time.now_s() - kept_s < LIVE_s:
                    self._publishers[name].put(data, attachment=stamp)
                else:
                    self.skipped += 1
                self._note(2, line, number)
            if host_time.now_s() >= next_status_s:
                next_status_s = host_time.now_s() + STATUS_s
                self._watch()
                self._publishers["status"].put(self._status(2))

    def _watch(self):
        there = not self.tip.is_returning
        if there and self._token is None:
            self._token = self._session.liveliness().declare_token(f"{self._root}/alive")
        elif not there and self._token is not None:
            token, self._token = self._token, None
            token.undeclare()

    def _status(self, column):
        """column: 1, packets that were read; 2, those that were published."""
        clock, line = self._clock_of_host(), self.tip.statistics
        status = {"host": platform.node(), "boot": _boot(), "port": self.tip.description, "there": not self.tip.is_returning}
        status |= {"now_ns": host_time.wall_ns(), "unpublished": self.skipped, "line": {name: getattr(line, name) for name in line.COUNTS}}
        status["clock"] = {"disciplined": clock.disciplined, "bound_us": clock.bound_us if clock.disciplined else None, "text": clock.text}
        return json.dumps(status | {"lines": [(each[0], each[column]) for each in list(self._lines)]})

    # Answers

    def _when_asked(self, answer):
        def asked(query):
            with contextlib.suppress(RuntimeError):  # the bridge ends
                self._pool.submit(self._answer, query, answer)

        return asked

    def _answer(self, query, answer):
        with query:
            try:
                answer(query)
            except (FingertipError, InputError, ValueError) as error:
                query.reply_err(printable(str(error)))
            except self._zenoh.ZError:
                pass  # the asker is gone

    @staticmethod
    def _parameters(query):
        pairs = (pair.partition("=") for pair in str(query.parameters).split(";") if pair)
        return {name: value for name, _, value in pairs}

    def _reply_info(self, query, name, info):
        query.reply(f"{self._root}/{name}", wire.encode(wire.Packet(0, 0, info))[:-1])

    def _refuse(self, query):
        raise InputError("this bridge takes no commands; start it with --commands")

    def _tare(self, query):
        self.tip.tare(force=self._parameters(query).get("force", "0") == "1")
        self._reply_info(query, "tare", self.tip.info)

    def _set(self, query):
        self._reply_info(query, "set", self.tip.set(**settings_of(self._parameters(query))))

    def _info(self, query):
        self._reply_info(query, "info", self.tip.info if self.tip.is_returning else self.tip.read_info())

    def _answer_status(self, query):
        query.reply(f"{self._root}/status", self._status(1))

    def _again(self, query):
        asked = self._parameters(query)
        line, first, last = (int(asked.get(name, "-1")) for name in ("line", "first", "last"))
        for number in range(first, min(last, first + AGAIN_MOST - 1) + 1):
            found = self._kept.get((line, number))
            if found:
                query.reply(f"{self._root}/again", found[1], attachment=found[2])
        oldest = next(iter(self._kept), (0, 0))
        query.reply(f"{self._root}/again", json.dumps({"line": line, "first": first, "last": last, "oldest": oldest}))

    def close(self):
        self._closing = True
        self._thread.join()
        self.tip.close()
        self._pool.shutdown(wait=False, cancel_futures=True)
        for each in (*self._queryables, *self._publishers.values(), *([self._token] if self._token else [])):
            with contextlib.suppress(self._zenoh.ZError):
                each.undeclare()


class Bridge:
    """ports: these alone; none: all that discovery finds, again and again. commands: whether others may tare and set."""

    def __init__(self, session, ports, keep, latency_ms, report, commands):
        self._session = session
        self._ports = ports
        self._keep = keep
        self._latency_ms = latency_ms
        self._report = report
        self._commands = commands
        self._published = {}
        self._complaints = {}
        self.clock = host_clock()
        self._next_clock_s = host_time.now_s() + CHRONY_s

    def look(self):
        """For fingertips that came, and how this computer's clock is kept."""
        if host_time.now_s() >= self._next_clock_s:
            self._next_clock_s = host_time.now_s() + CHRONY_s
            self.clock = host_clock()
        for way, one in list(self._published.items()):
            try:
                one.tip.take_one()
            except FingertipError as error:  # for good: another one has its port
                self._report(str(error))
                del self._published[way]
                one.close()
        found = [discovery.Found("", port) for port in self._ports] or discovery.find()
        for each in found:
            way = each.port or each.share_socket
            taken = {os.path.realpath(way) for way in self._published}
            serials = {one.tip.serial.lower() for one in self._published.values()}
            if os.path.realpath(way) in taken or each.serial.lower() in serials or not os.path.exists(way):
                continue
            self._open(way, each)

    def _open(self, way, found):
        try:
            serial = None if found.port else found.serial
            tip = Fingertip(found.port or None, serial=serial, reconnect=True, latency_ms=self._latency_ms, buffer_frames=1)
        except FingertipError as error:
            if self._complaints.get(way) != str(error):
                self._complaints[way] = str(error)
                self._report(str(error))
            return
        if any(one.tip.serial == tip.serial for one in self._published.values()):  # it is waited for already, and has another name now
            tip.close()
            return
        self._published[way] = _Published(self._session, tip, self._keep, lambda: self.clock, self._commands)
        self._report(f"{tip.serial} at {tip.description}")

    def close(self):
        for one in self._published.values():
            one.close()


def main(argv):
    parser = Parser(prog="fingertip-bridge", description=__doc__)
    add, keep = (
        parser.add_argument,
        "packets of each fingertip that are kept for recorders that missed them, some 0.4 kB each; default 100000",
    )
    add("--port", action="append", default=[], metavar="PORT", help="this serial port; several times for several; without, all")
    add("--keep", type=int, default=100_000, metavar="N", help=keep + ": 38 s at the highest rate")
    add("--latency-ms", type=float, default=1.0, metavar="MS", help="how long bytes may wait to be read together; default 1")
    parser.add_argument("--router", action="store_true", help="be a router too, for others to --connect to; with --listen")
    parser.add_argument("--commands", action="store_true", help="let everybody who reaches this tare and set; otherwise that is refused")
    add_session_options(parser)
    options = parser.parse_args(argv)
    check_range("keep", options.keep, 1, 10_000_000)
    check_range("latency-ms", options.latency_ms, 0, 1000)
    report = reporter("fingertip-bridge")

    with open_session(options, options.router, True, report) as session:
        ended = until_ended()
        bridge = Bridge(session, options.port, options.keep, options.latency_ms, report, options.commands)
        report(bridge.clock.text)
        try:
            while not ended.is_set():
                bridge.look()
                ended.wait(LOOK_s)
        finally:
            bridge.close()
    return 0
