"""Records fingertips of many computers, which fingertip-bridge publishes on Zenoh, into one file, MCAP or CSV, as `fingertip record --all`
would: one clock, rows in order of time. What the network loses is asked for again; what no bridge has any more is counted, in the
file too. It ends by Ctrl-C or --seconds.

Exit status: 0 nothing was lost, 3 something was, and is counted, 1 an error.
"""

import itertools
import json
import math
import queue
from typing import NamedTuple

from . import host_time, wire
from .clock import ClockEstimate
from .command import Parser, check_output, check_range, reporter
from .errors import InputError, PacketError
from .network import AGAIN_MOST, ROOT, Stamp, add_session_options, open_session, parts_of, until_ended, zenoh_module
from .line import Capability
from .recording import JointRecordingWriter

GAP_s = 0.2  # a packet that is missing for this time is asked for
ASK_s = 0.3
ASK_TIMEOUT_s = 5.0
PINGS = 8
AHEAD_MOST = 200_000  # packets that wait for one that is missing; then it is lost
WAITING_MOST = 200_000  # live packets that wait to be written; more are asked for again later
CLOCK_s = 0.5
STATUS_AGE_s = 1.5
RECORDED = ("contact", "raw", "health", "info", "other")


class Line:
    """The packets of one unbroken line, some of which are not there yet."""

    def __init__(self, number, first):
        self.number = number
        self.next = first
        self.high = first - 1  # known to have been sent
        self.early = {}  # number -> item
        self.stuck_s = None
        self.given_up = 0  # up to here no answer will come
        self.is_over = False  # and high is final


class Account:
    """The packets of one fingertip in order, and what is missing of them.

    offer: a packet that came, in any order, any number of times. heard: what its bridge reports to have given out, [line, number]s, the
    present line last; what is missing of a line that is not among them is lost. take: the packets whose turn it is, each with how many
    were lost right before it and why. ask: the range to ask for again. sent == recorded + lost, always, after take. Lines follow one another
    as their bridge reports or as they came, whatever their numbers: a computer's clock may have been set back. unread_frames: between two lines
    of a fingertip that went on; firmware sends nothing while no program has its port, and sequence numbers wrap.
    """

    def __init__(self):
        self.lines = []
        self.recorded = self.lost = self.duplicates = self.sent = self.restarts = 0
        self.lost_between_lines = self.unread_frames = 0
        self._finished = set()  # numbers of lines
        self._is_new_line = False
        self._frame = 0
        self._last = None  # (stamp, packet) of the last one that was taken
        self._last_frame = None
        self._kinds = set()
        self._shared_gap = False

    def offer(self, stamp, packet, now_s):
        line = self._line(stamp.line, stamp.number)
        if line is None or stamp.number < line.next or stamp.number in line.early:
            self.duplicates += 1
            return
        line.early[stamp.number] = (stamp, packet)
        line.high = max(line.high, stamp.number)
        self._look(line, now_s)
        if len(line.early) > AHEAD_MOST:
            line.given_up = min(line.early) - 1

    def _line(self, number, first):
        """Nothing: it is over."""
        for line in self.lines:
            if line.number == number:
                return line
        if number in self._finished:
            return None
        self.lines.append(Line(number, first if self._last is None and not self.lines else 1))
        return self.lines[-1]

    def _look(self, line, now_s):
        is_stuck = line.high >= line.next and line.next not in line.early
        line.stuck_s = (now_s if line.stuck_s is None else line.stuck_s) if is_stuck else None

    def heard(self, reported, now_s):
        if not self.lines or not reported or reported[-1][0] in self._finished:
            return
        place = len(self.lines)  # of the line reported before, from the end
        for number, last in reversed(reported):
            at = next((at for at, line in enumerate(self.lines) if line.number == number), None)
            if at is None:
                if not last or number in self._finished or (place == 0 and self._last):
                    continue
                self.lines.insert(place, Line(number, 1))
                at = place
            line, place = self.lines[at], at
            line.high = max(line.high, last)
            self._look(line, now_s)
        known = dict(reported)
        present = next((at for at, line in enumerate(self.lines) if line.number == reported[-1][0]), len(self.lines))
        for line in self.lines[:present]:
            line.is_over = True
            if line.number not in known:
                line.given_up = line.high

    def answered(self, number, last):
        """What was asked for up to here and did not come will not come."""
        for line in self.lines:
            if line.number == number:
                line.given_up = max(line.given_up, last)

    def give_up(self):
        """The recording ends: what has not come is lost."""
        for line in self.lines:
            line.given_up = max(line.given_up, line.high)
            line.is_over = True

    def ask(self, now_s):
        """(line, first, last), or nothing."""
        for line in self.lines:
            if line.stuck_s is not None and now_s - line.stuck_s >= GAP_s:
                return line.number, line.next, min(line.high, line.next + AGAIN_MOST - 1)
        return None

    @property
    def is_complete(self):
        return all(line.next > line.high for line in self.lines)

    def take(self, now_s):
        """(stamp, packet, lost before it, restarted) in order; packet None: something was lost at the end of a line."""
        while self.lines:
            line = self.lines[0]
            lost = 0
            while True:
                item = line.early.pop(line.next, None)
                if item is None:
                    until = min(line.high, line.given_up)
                    if line.next > until:
                        break
                    step = min(min(line.early, default=until + 1), until + 1) - line.next
                    line.next += step
                    lost += step
                    self._count(0, step)
                    continue
                between, restarted = self._between(*item)
                self._count(1, between)
                yield *item, lost + between, restarted
                lost = 0
                self._last = item
                line.next += 1
                line.stuck_s = None
            self._look(line, now_s)
            if lost:
                yield None, None, lost, False
            if len(self.lines) == 1 or not line.is_over or line.next <= line.high:
                return
            self._finished.add(self.lines.pop(0).number)

    def _count(self, recorded, lost):
        self.recorded += recorded
        self.lost += lost
        self.sent += recorded + lost

    def _between(self, stamp, packet):
        """Packets that were lost between two lines, while the fingertip went on, and whether it did not: then it is unknown."""
        frame = packet.body.frame if isinstance(packet.body, (wire.Contact, wire.Raw)) else None
        lost, restarted = 0, False
        if self._last and stamp.line != self._last[0].line:
            before, last = self._last
            went_us, passed_us = packet.t_us - last.t_us, (stamp.measured_ns - before.measured_ns) / 1000
            unsure_us = 1e5 + 1e-3 * abs(passed_us) + before.uncertainty_us + stamp.uncertainty_us
            restarted = abs(went_us - passed_us) > unsure_us
            self.restarts += restarted
            if restarted:
                self._last_frame = None
            elif not stamp.shared and not before.shared:
                lost = packet.sequence - last.sequence - 1 & 0xFFFF
                self._last_frame = None
            self._shared_gap = bool(stamp.shared or before.shared) and not restarted
            self._is_new_line = not restarted
        if frame is not None:
            passed = frame - self._frame & 0xFFFFFFFF
            if self._is_new_line and self._kinds and passed < 1 << 31:
                self.unread_frames += max(0, passed - 1)
            self._is_new_line = False
            self._frame = frame
            if self._shared_gap and self._last_frame is not None:
                lost += max(0, (frame - self._last_frame - 1) * len(self._kinds))
            self._shared_gap = False
            self._last_frame = frame
            self._kinds.add(type(packet.body))
        self.lost_between_lines += lost
        return lost, restarted


class _Source:
    """One fingertip, and the thread that asks for what is missing."""

    def __init__(self, serial, number, info):
        self.serial = serial
        self.number = number
        self.info = info
        self.account = Account()
        self.clock = None
        self.clock_line = 0
        self.wanted = None  # (line, first, last) to be asked for
        self.status_s = host_time.now_s()
        self.must_answer = False
        self.asked = 0
        self.unread_frames = 0
        self.recovered = 0

    def figures(self):
        """unheard: it did not report at the end what it had sent."""
        names = ("sent", "recorded", "lost", "lost_between_lines", "unread_frames", "restarts")
        counts = {name: getattr(self.account, name) for name in names}
        return counts | {"recovered": self.recovered, "asked": self.asked, "unheard": self.must_answer}


class Recording:
    """session: of Zenoh. Everything but what asks runs in the thread that calls run."""

    def __init__(self, session, path, infos, replace, extra, report):
        self._zenoh = zenoh_module()
        self._session = session
        self._report = report
        self._zero_us = (host_time.wall_ns() - host_time.now_ns()) / 1000
        self.sources = {info.serial: _Source(info.serial, number, info) for number, info in enumerate(infos)}
        self._arrived = queue.SimpleQueue()
        self._ending = False
        self._ended = host_time.event()
        self.damaged = 0
        self.behind = self._reported_behind = False  # too much for this computer
        self.unrecorded = set()  # came later
        raw = all(info.capabilities & Capability.RAW_STREAM for info in infos)
        self._writer = JointRecordingWriter(path, infos, replace=replace, extra=extra, count=self._counts, raw_expected=raw)
        self._subscriber = session.declare_subscriber(f"{ROOT}/*/*", self._hear)
        self._threads = [host_time.thread(self._ask_on, args=(source,), daemon=True) for source in self.sources.values()]
        for thread in self._threads:
            thread.start()

    def _counts(self):
        counts = [wire.LineStatistics() for _ in self.sources]
        for line, source in zip(counts, self.sources.values()):
            line.packets, line.dropped_packets = source.account.recorded, source.account.lost
        return counts

    def _hear(self, sample):
        if self._arrived.qsize() >= WAITING_MOST:
            self.behind = True
            return
        self._put(sample, *parts_of(str(sample.key_expr)))

    def _put(self, sample, serial, name):
        attachment = sample.attachment
        self._arrived.put((serial, name, sample.payload.to_bytes(), attachment.to_bytes() if attachment else b""))

    # The asking threads

    def _ask_on(self, source):
        while not self._ended.is_set():
            wanted, source.wanted = source.wanted, None
            try:
                if wanted:
                    line, first, last = wanted
                    self._ask(source, f"{ROOT}/{source.serial}/again?line={line};first={first};last={last}", "again")
                    source.asked += 1
                    source.wanted = None  # judged again by what has come
                elif source.must_answer or not self._ending and host_time.now_s() - source.status_s > STATUS_AGE_s:
                    self._ask(source, f"{ROOT}/{source.serial}/status", "answer" if source.must_answer else "status")
            except self._zenoh.ZError:
                pass  # not now; asked once more
            self._ended.wait(ASK_s / 10 if source.wanted else ASK_s)

    def _ask(self, source, selector, name):
        for reply in self._session.get(selector, timeout=ASK_TIMEOUT_s, consolidation=self._zenoh.ConsolidationMode.NONE):
            if reply.ok:
                self._put(reply.ok, source.serial, name)

    # The main thread

    def run(self, seconds, ended, patience_s):
        """Until it is to end, or for this time, and then until everything that was sent is there or patience is over."""
        end_s = host_time.now_s() + seconds
        while not ended.is_set() and host_time.now_s() < end_s:
            self._work(0.1)
        self._subscriber.undeclare()
        for source in self.sources.values():  # what has it sent until now? That, and no more, is waited for
            source.must_answer = True
        self._ending = True
        asked_s = host_time.now_s()
        while host_time.now_s() - asked_s < patience_s:
            self._work(0.1)
            if not any(source.must_answer or not source.account.is_complete for source in self.sources.values()):
                break
        self._ended.set()
        for source in self.sources.values():
            source.account.give_up()
            self._write(source)
            self._event(source, "network: " + text_of(source.figures()))
        self._writer.close("unheard" if any(source.must_answer for source in self.sources.values()) else "closed")

    def _work(self, wait_s):
        """What has come, and what to ask for."""
        touched = set()
        end_s = host_time.now_s() + wait_s
        while (left_s := end_s - host_time.now_s()) > 0:
            try:
                serial, name, data, attachment = self._arrived.get(timeout=left_s)
            except queue.Empty:
                break
            source = self.sources.get(serial)
            if source is None:
                if name in RECORDED and serial not in self.unrecorded:
                    self.unrecorded.add(serial)
                    self._report(f"{serial} came after the recording had begun, and is not recorded")
            elif name in ("status", "answer"):
                self._take_status(source, data, name == "answer")
                touched.add(source)
            elif name in RECORDED or name == "again":
                self._take(source, name, data, attachment)
                touched.add(source)
        if self.behind and not self._reported_behind:
            self._reported_behind = True
            self._report(
                "more comes than this computer writes: what does not fit is asked for again, and lost once no bridge keeps it; record fewer, or slower"
            )
        now_s = host_time.now_s()
        for source in self.sources.values():
            if source in touched or source.account.lines:
                self._write(source)
                source.wanted = source.account.ask(now_s)

    def _take_status(self, source, data, is_answer):
        try:
            lines = [(int(line), int(number)) for line, number in json.loads(data)["lines"]]
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            self.damaged += 1
            return
        source.status_s = host_time.now_s()
        source.must_answer &= not is_answer
        source.account.heard(lines, host_time.now_s())

    def _take(self, source, name, data, attachment):
        try:
            if not attachment:
                reported = json.loads(data)
                source.account.answered(int(reported["line"]), min(int(reported["last"]), int(reported["first"]) + AGAIN_MOST - 1))
                return
            stamp = Stamp.of(attachment)
            packet = wire.decode(data)
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError, InputError, PacketError):
            self.damaged += 1
            return
        before = source.account.duplicates
        source.account.offer(stamp, packet, host_time.now_s())
        source.recovered += name == "again" and source.account.duplicates == before

    def _event(self, source, text):
        self._writer.event(source.number, text)

    def _write(self, source):
        for stamp, packet, lost, restarted in source.account.take(host_time.now_s()):
            if restarted:
                self._event(source, "restarted: what it sent in between is not known")
            if lost:
                self._event(source, f"lost {lost} packets")
            if source.account.unread_frames > source.unread_frames:
                self._event(source, f"{source.account.unread_frames - source.unread_frames} frames were read by no bridge")
                source.unread_frames = source.account.unread_frames
            if packet is None:
                continue
            t_us = packet.t_us
            clock = source.clock
            host_us = stamp.measured_ns / 1000 - self._zero_us
            if clock is None or stamp.line != source.clock_line or abs(t_us - clock.device_us) > CLOCK_s * 1e6:
                source.clock_line = stamp.line
                source.clock = clock = ClockEstimate(t_us, host_us, stamp.drift_ppm, stamp.uncertainty_us)
            self._writer.packet(source.number, packet, clock, source.account.restarts)

    def figures(self):
        return {serial: source.figures() for serial, source in self.sources.items()}


def text_of(figures):
    return " ".join(f"{name}={int(value)}" for name, value in figures.items())


def ask(session, key, timeout_s=ASK_TIMEOUT_s):
    """Serial number -> the answer's bytes, and when it was asked and answered, ns since 1970."""
    zenoh = zenoh_module()
    sent_ns = host_time.wall_ns()
    answers = {}
    try:
        for reply in session.get(key, timeout=timeout_s, consolidation=zenoh.ConsolidationMode.NONE):
            if reply.ok:
                answers.setdefault(parts_of(str(reply.ok.key_expr))[0], (reply.ok.payload.to_bytes(), sent_ns, host_time.wall_ns()))
    except zenoh.ZError:
        pass
    return answers


def find(session, serials, expect, wait_s):
    """Serial number -> info, of those that are wanted, or of all that are there. Raises InputError where some are missing."""
    end_s = host_time.now_s() + wait_s
    infos = {}
    while True:
        for serial, (data, _, _) in ask(session, f"{ROOT}/*/info", 2.0).items():
            if not serials or serial in serials:
                try:
                    infos[serial] = wire.decode(data).body
                except PacketError as error:
                    raise InputError(f"{serial}: its info packet is damaged, or of another version ({error})") from None
        missing = [serial for serial in serials if serial not in infos]
        if infos and not missing and len(infos) >= expect:
            return dict(sorted(infos.items()))
        if host_time.now_s() >= end_s:
            there = ", ".join(sorted(infos)) or "none"
            wanted = f"{', '.join(missing)} not among them" if missing else f"{max(expect, 1)} expected"
            raise InputError(f"fingertips on the network: {there}; {wanted}. Is fingertip-bridge running, and --connect right?")
        host_time.sleep(0.2)


class _HostClock(NamedTuple):
    """Of a fingertip's host: how far it was measured to be from this computer's, within half of the way there and back."""

    host: str
    boot: str
    disciplined: bool
    bound_us: float
    text: str
    within_us: float
    ahead_us: float

    def note(self):
        bound = f"{self.bound_us:.0f} us" if self.disciplined else "unknown"
        return f"host {self.host}; {self.text}; bound {bound}; measured {self.ahead_us:.0f} us from the recorder's, within {self.within_us:.0f} us"


def _clock_of(session, serial):
    best = (math.inf, 0.0)
    for _ in range(PINGS):
        answer = ask(session, f"{ROOT}/{serial}/status").get(serial)
        if answer is None:
            raise InputError(f"{serial}: its bridge does not report how its clock is kept")
        data, sent_ns, answered_ns = answer
        try:
            status = json.loads(data)
            clock, host, boot = status["clock"], str(status["host"]), str(status["boot"])
            best = min(best, ((answered_ns - sent_ns) / 2000, (status["now_ns"] - (sent_ns + answered_ns) / 2) / 1000))
            found = _HostClock(host, boot, bool(clock["disciplined"]), float(clock["bound_us"] or 0), str(clock["text"]), *best)
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{serial}: its bridge reports its clock in a way that is not known here; it is of another version") from None
    return found


def judge_clocks(session, serials, bound_us, may_be_undisciplined):
    """Serial number -> what is to be noted of its host's clock. Raises InputError where one may be, or is, further off than the bound
    from another host's."""
    clocks = {}
    for serial in serials:
        clocks[serial] = clock = _clock_of(session, serial)
        if not clock.disciplined and not may_be_undisciplined:
            raise InputError(f"{clock.host} ({serial}): {clock.text}; let chrony keep the clock, or give --undisciplined")
    for one, other in itertools.combinations(serials, 2):
        a, b = clocks[one], clocks[other]
        surely_us, perhaps_us = abs(a.ahead_us - b.ahead_us) - a.within_us - b.within_us, a.bound_us + b.bound_us
        apart = ""
        if a.boot != b.boot and a.disciplined and b.disciplined and perhaps_us > bound_us:
            apart = f"may be {perhaps_us:.0f} us apart by chrony's estimate"
        elif a.boot != b.boot and surely_us > bound_us:
            apart = f"are at least {surely_us:.0f} us apart"
        if apart:
            raise InputError(f"the clocks of {one} and {other} {apart}, more than --clock-bound-us {bound_us:g}")
    return {serial: clock.note() for serial, clock in clocks.items()}


def main(argv):
    parser = Parser(prog="fingertip-recorder", description=__doc__)
    add = parser.add_argument
    add("file", metavar="FILE.mcap|FILE.csv")
    add("--serial", action="append", default=[], metavar="SERIAL", help="this fingertip; several times for several; without, all")
    add("--expect", type=int, default=1, metavar="N", help="wait until this number is there")
    add("--wait", type=float, default=10.0, metavar="S", help="for fingertips, at most; default 10")
    add("--seconds", type=float, default=math.inf, metavar="S")
    add("--patience", type=float, default=30.0, metavar="S", help="at the end, for hosts that are cut off; default 30")
    bound = "no recording if two hosts' clocks are, or by chrony's own estimate may be, further apart; default 5000"
    add("--clock-bound-us", type=float, default=5000.0, metavar="US", help=bound)
    add("--undisciplined", action="store_true", help="take hosts whose clock nothing keeps, too")
    add("--overwrite", action="store_true", help="replace the file if it exists")
    add("--json", action="store_true", help="the counts as JSON on stdout")
    add_session_options(parser)
    options = parser.parse_args(argv)
    check_range("expect", options.expect, 1, 1000)
    for name in ("wait", "patience"):
        check_range(name, getattr(options, name), 0, 86400)
    check_range("seconds", options.seconds, 0, math.inf)
    check_range("clock-bound-us", options.clock_bound_us, 0, 1e9)
    check_output(options.file, replace=options.overwrite)
    report = reporter("fingertip-recorder")

    with open_session(options, report=report) as session:
        ended = until_ended()
        infos = find(session, options.serial, options.expect, options.wait)
        notes = judge_clocks(session, list(infos), options.clock_bound_us, options.undisciplined)
        extra = {f"{number}/host_clock": notes[serial] for number, serial in enumerate(infos)}
        recording = Recording(session, options.file, list(infos.values()), options.overwrite, extra, report)
        report(f"{options.file}: {', '.join(infos)}")
        recording.run(options.seconds, ended, options.patience)
    figures = recording.figures()
    for serial, each in figures.items():
        report(f"{serial}: {text_of(each)}")
    if recording.damaged:
        report(f"{recording.damaged} messages were damaged, and count as lost")
    if options.json:
        print(json.dumps({"fingertips": figures, "damaged": recording.damaged, "unrecorded": sorted(recording.unrecorded)}))
    return 3 if any(each["lost"] or each["restarts"] or each["unread_frames"] or each["unheard"] for each in figures.values()) else 0
