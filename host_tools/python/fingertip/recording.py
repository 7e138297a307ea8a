"""Writes recordings as `fingertip record` does (host_tools/library/libfingertip/RECORDING.md has the format); read_recording reads them."""

import contextlib
import datetime
import heapq
import math
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from .clock import ClockEstimate, host_now_us
from .closing import Closing
from .errors import InputError
from .frames import Q10
from .line import CONTACT_COLUMNS, INFO_KEYS, LATER_COLUMNS, RAW_COLUMNS, SENSOR_LISTS
from .lines import LineFile, shortest
from .mcap_recording import McapLines
from .recorded import header_text
from .wire import Acknowledgement, Calibration, Contact, Health, Info, LineStatistics, Packet, PadProfile, Raw, SyncEdge, layout_of

LATE_us = 250_000  # rows wait for this time for those of others
CLOCK_LINES_us = 1e6
_KINDS: dict[type, str] = {SyncEdge: "sync", Health: "health", Info: "info", Acknowledgement: "ack"}
_QUANTITIES = [name for name in (*CONTACT_COLUMNS, *LATER_COLUMNS) if name not in ("sequence", "flags")]


def _cell(value: Any) -> str:
    if value is None:
        return "0"
    return shortest(value) if isinstance(value, float) else str(value)


def _number(value: Any) -> str:
    """Of an info packet: what the firmware has not is 0 there."""
    return _cell(value) or "0"


def _list(values: Iterable[float]) -> str:
    return " ".join(map(_number, values))


def _calibration_metadata(calibration: Calibration) -> dict[str, str]:
    scalars = (name for name, wire in layout_of(Calibration) if wire.times == 1)
    return {
        **{("" if name.startswith("force_scale") else "calibration_") + name: _number(getattr(calibration, name)) for name in scalars},
        **{name: _list(getattr(calibration, name)) for name in SENSOR_LISTS},
    }


def _pad_metadata(pad: PadProfile) -> dict[str, str]:
    scalars = (name for name, wire in layout_of(PadProfile) if wire.times == 1)
    terms = {"shares": pad.normal[0::2], "sds_mm": pad.normal[1::2]}
    terms |= {"moments_mm": pad.tangential[0::2], "moment_sds_mm": pad.tangential[1::2]}
    edges = {name: getattr(pad, name) for name in pad._fields if name.startswith("edge_")}
    return {
        **{f"pad_{name}": _number(getattr(pad, name)) for name in scalars},
        **{f"pad_{name}": _list(values) for name, values in (terms | edges).items()},
    }


def info_metadata(info: Info) -> dict[str, str]:
    """An info packet as the comments of a recording."""
    return {
        "serial": info.serial,
        "board": info.board,
        "scene": info.scene,
        "firmware": ".".join(map(str, info.firmware)),
        "git": info.git,
        **{name: _number(getattr(info, name)) for name in INFO_KEYS},
        "x_mm": _list(info.x_mm),
        "y_mm": _list(info.y_mm),
        **(_calibration_metadata(info.calibration) if info.calibration else {}),
        **(_pad_metadata(info.pad) if info.pad else {}),
    }


def _open_lines(path: "str | os.PathLike[str]", replace: bool) -> LineFile | McapLines:
    """The file that the lines of a recording go to, by its name. Raises InputError."""
    end = os.path.splitext(os.fspath(path))[1].lower()
    if end not in ("", ".csv", ".mcap"):
        raise InputError(f"{os.fspath(path)}: must end with .csv or .mcap, which selects the format")
    return McapLines(path, replace) if end == ".mcap" else LineFile(path, replace)


def _own_keys(extra: Mapping[str, str | None] | None) -> dict[str, str]:
    """None takes a key out."""
    started = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    keys: dict[str, str | None] = {"recorded_by": "fingertip-tactile", "started_utc": started, **(extra or {})}
    return {key: "".join(c if c.isprintable() else "?" for c in value) for key, value in keys.items() if value is not None}


class _Member:
    """One fingertip of a recording: its packets as comments and rows. number: among several."""

    def __init__(self, writer: "_Writer", info: Info, raw_expected: bool, number: int | None) -> None:
        self.frames = 0
        self.packet_us = (0, 0.0)  # of the packet under way: device and host
        self.last_line_us = -math.inf
        self.clock: ClockEstimate | None = None
        self.clock_written_us = -math.inf
        self.jumps = 0
        self._writer, self._number = writer, number
        self._sensors = info.sensors
        self._raw_expected = raw_expected
        self._pending: Packet | None = None
        self._metadata: dict[str, str] = {}
        self._first_us: int | None = None
        self._last_us = self._before_us = 0
        self._last_edge: int | None = None
        self._edges = self._edges_missing = 0
        self._no_contact = [""] * (len(CONTACT_COLUMNS) + len(LATER_COLUMNS))
        self._no_raw = [""] * (len(RAW_COLUMNS) + 2 * info.sensors)
        self.info(info)

    def comment(self, key: str, value: str, host_us: float | None = None) -> None:
        """host_us: if not with the packet under way."""
        number = "" if self._number is None else f"{self._number}/"
        self._writer.put(self, self.packet_us[1] if host_us is None else host_us, f"# {number}{key}: {value}")

    def event(self, text: str) -> None:
        """Behind all its lines until now."""
        self.write_pending()
        self.comment("event", text, self.last_line_us)

    @property
    def seconds(self) -> float:
        """Device time of all rows, over all runs."""
        return (self._before_us + (0 if self._first_us is None else self._last_us - self._first_us)) / 1e6

    def info(self, info: Info) -> None:
        now = info_metadata(info)
        for key, value in now.items():
            if self._metadata.get(key) != value:
                self.comment(key, value)
        self._metadata = now

    def packet(self, packet: Packet) -> None:
        body = packet.body
        if isinstance(body, Contact):
            self.write_pending()
            if self._raw_expected:
                self._pending = packet
            else:
                self._row(packet, None)
        elif isinstance(body, Raw):
            if body.sensors != self._sensors:
                raise InputError(f"{self._writer.path}: the fingertip now has {body.sensors} sensors instead of {self._sensors}")
            pending = self._pending
            if pending and pending.t_us == packet.t_us and isinstance(pending.body, Contact) and pending.body.frame == body.frame:
                self._pending = None
                self._row(pending, packet)
            else:
                self.write_pending()
                self._row(None, packet)
        elif type(body) in _KINDS:
            self.write_pending()
            if isinstance(body, SyncEdge):
                self._take_edge(body)
            elif isinstance(body, Info):
                self.info(body)
            fields = {} if isinstance(body, Info) else body._asdict()
            pairs = {"sequence": packet.sequence, "t_us": packet.t_us, **fields}
            self.comment("packet", _KINDS[type(body)] + "".join(f" {name}={_cell(value)}" for name, value in pairs.items()))

    def _take_edge(self, edge: SyncEdge) -> None:
        ahead = 1 if self._last_edge is None else edge.number - self._last_edge & 0xFFFFFFFF
        if 1 <= ahead <= 0x7FFFFFFF:  # else the pin was set again
            self._edges_missing += ahead - 1
        self._last_edge = edge.number
        self._edges += 1

    def edges_text(self) -> str:
        """For the end of a recording; nothing if there were none."""
        return f" edges={self._edges} edges_missing={self._edges_missing}" if self._edges else ""

    def write_pending(self) -> None:
        if self._pending:
            pending, self._pending = self._pending, None
            self._row(pending, None)

    def _row(self, contact: Packet | None, raw: Packet | None) -> None:
        any_packet = contact or raw
        assert any_packet is not None
        t_us = any_packet.t_us
        cells: list[str] = []
        frame = 0
        if contact and isinstance(contact.body, Contact):
            body = contact.body
            frame = body.frame
            cells += [str(contact.sequence), str(body.flags), *(_cell(getattr(body, name)) for name in _QUANTITIES)]
        else:
            cells += self._no_contact
        if raw and isinstance(raw.body, Raw):
            read = raw.body
            frame = read.frame
            cells += [str(value) for value in (raw.sequence, read.flags, read.valid, read.saturated, read.doubtful)]
            cells += [f"{read.temperature_cC / 100:.2f}", *(f"{value / Q10:.4f}" for value in (*read.readings[0::2], *read.readings[1::2]))]
        else:
            cells += self._no_raw
        host_us = self.packet_us[1] + (t_us - self.packet_us[0])
        self._writer.put_row(self, self._number, host_us, f"{t_us},{frame}," + ",".join(cells))
        self.frames += 1
        if self._first_us is not None and t_us < self._last_us:
            self._before_us += self._last_us - self._first_us
            self._first_us = None
        self._first_us = t_us if self._first_us is None else self._first_us
        self._last_us = t_us


class Recorder(Protocol):
    """Gets the packets of a Fingertip, from its reading thread."""

    def packet(self, packet: Packet) -> None: ...

    def event(self, text: str) -> None: ...

    def fail(self, error: InputError) -> None: ...

    def close(self, reason: str = "closed") -> None: ...


class _Writer(Closing):
    """What writers of either format share: a file, its lock, the fingertips in it, and how it ends."""

    def __init__(self, path: "str | os.PathLike[str]", replace: bool) -> None:
        self.path = os.fspath(path)
        self._lock = threading.RLock()
        self._closed = False
        self._failure: InputError | None = None
        self._file = _open_lines(path, replace)
        self._members: list[_Member] = []

    def _begin(
        self, first: Iterable[str], extra: Mapping[str, str | None] | None, infos: Sequence[Info], raw_expected: bool, columns: str = ""
    ) -> None:
        """The head. columns: before those of the fingertip."""
        try:
            for text in (*first, *(f"# {key}: {value}" for key, value in _own_keys(extra).items())):
                self._file.line(text)
            for number, info in enumerate(infos):
                self._members.append(_Member(self, info, raw_expected, number if columns else None))
            self._file.line(columns + header_text(infos[0].sensors))
        except InputError:
            self.abandon()
            raise

    def put(self, member: _Member, host_us: float, text: str) -> None:
        """A line of a fingertip."""
        self._file.line(text)

    def put_row(self, member: _Member, number: int | None, host_us: float, cells: str) -> None:
        self._file.line(cells)

    def fail(self, error: InputError) -> None:
        """Closes without an end line; close() will raise this."""
        self._failure = error
        self.abandon()

    def abandon(self) -> None:
        """Closes without an end line."""
        with self._lock:
            self._closed = True
            with contextlib.suppress(InputError):
                self._file.close()

    def close(self, reason: str = "closed") -> None:
        """Writes the end line. Does nothing the second time. Raises InputError where the disk was full, then or before."""
        with self._lock:
            failure, self._failure = self._failure, None
            if failure:
                raise failure
            if self._closed:
                return
            self._end(reason)
            self._closed = True
            self._file.close()

    def _end(self, reason: str) -> None:
        raise NotImplementedError

    @property
    def frames(self) -> int:
        """Rows until now."""
        return sum(member.frames for member in self._members)


class RecordingWriter(_Writer):
    """A recording of one fingertip, from its packets in the order in which they came: MCAP where the name ends with .mcap
    (mcap_recording.py), or CSV.

    Lines are written whole. The file is there from the beginning; a recorder that is killed leaves one without an end line, which
    every reader takes. replace: over a file that exists. raw_expected: a contact waits for the raw packet of its frame. count: what the
    line counted, asked for when it ends. Raises InputError.
    """

    def __init__(
        self,
        path: "str | os.PathLike[str]",
        info: Info,
        *,
        replace: bool = False,
        raw_expected: bool = True,
        extra: Mapping[str, str | None] | None = None,
        count: Callable[[], LineStatistics] = LineStatistics,
    ) -> None:
        super().__init__(path, replace)
        self._count = count
        self._begin(["# fingertip-recording 1"], extra, [info], raw_expected)

    def packet(self, packet: Packet) -> None:
        """Of any type; commands are left out."""
        with self._lock:
            if not self._closed:
                self._members[0].packet(packet)

    def event(self, text: str) -> None:
        """Something else that happened: "gone", "back"."""
        with self._lock:
            if not self._closed:
                self._members[0].event(text)

    def _end(self, reason: str) -> None:
        own = self._members[0]
        own.write_pending()
        self._file.line(f"# end: reason={reason} frames={own.frames} seconds={own.seconds:.6f}{own.edges_text()} {self._count().text()}")


def _bounds_text(clock: ClockEstimate) -> str:
    return f"drift_ppm={clock.drift_ppm:.3f} uncertainty_us={clock.uncertainty_us:.1f}"


class JointRecordingWriter(_Writer):
    """A recording of several fingertips on the host's clock (format 2).

    Rows of different fingertips are in order of time unless one is more than a quarter of a second late. Raises InputError.
    """

    def __init__(
        self,
        path: "str | os.PathLike[str]",
        infos: Sequence[Info],
        *,
        replace: bool = False,
        raw_expected: bool = True,
        extra: Mapping[str, str] | None = None,
        count: Callable[[], Sequence[LineStatistics]] | None = None,
    ) -> None:
        if len({info.sensors for info in infos}) != 1:
            raise InputError(f"{os.fspath(path)}: fingertips with different numbers of sensors do not fit into one file")
        super().__init__(path, replace)
        self._count = count
        self._host_zero_us = host_now_us()
        self._waiting: list[tuple[float, int, str]] = []
        self._order = 0
        self._last_us = float(self._host_zero_us)
        self._alignment_us = 0.0
        self._head_written = False
        serials = " ".join(info.serial for info in infos)
        first = ["# fingertip-recording 2", f"# devices: {serials}", f"# host_zero_us: {self._host_zero_us}"]
        self._begin(first, extra, infos, raw_expected, "device,time_us,")
        self._head_written = True

    def _time(self, host_us: float) -> str:
        return f"{host_us - self._host_zero_us:.1f}"

    def put(self, member: _Member, host_us: float, text: str) -> None:
        """The lines of one fingertip keep their order."""
        if not self._head_written:
            self._file.line(text)
            return
        member.last_line_us = max(member.last_line_us, host_us)
        self._order += 1
        heapq.heappush(self._waiting, (member.last_line_us, self._order, text))

    def put_row(self, member: _Member, number: int | None, host_us: float, cells: str) -> None:
        self.put(member, host_us, f"{number},{self._time(host_us)},{cells}")
        self._last_us = max(self._last_us, host_us)

    def _settle(self, host_us: float) -> None:
        while self._waiting and self._waiting[0][0] <= host_us:
            self._file.line(heapq.heappop(self._waiting)[2])

    def packet(self, number: int, packet: Packet, clock: ClockEstimate, jumps: int) -> None:
        """Of the fingertip of this number, with its clock at this time."""
        with self._lock:
            if self._closed or math.isnan(clock.host_us):
                return
            member = self._members[number]
            member.packet_us = (packet.t_us, clock.host_at(packet.t_us))
            if clock is not member.clock:
                self._clock(member, clock, jumps)
            member.packet(packet)
            self._settle(host_now_us() - LATE_us)

    def _clock(self, member: _Member, clock: ClockEstimate, jumps: int) -> None:
        member.clock, member.jumps = clock, jumps
        bounds = sorted((each.clock.uncertainty_us for each in self._members if each.clock), reverse=True)
        self._alignment_us = max(self._alignment_us, sum(bounds[:2]))
        if clock.host_us - member.clock_written_us >= CLOCK_LINES_us:
            member.clock_written_us = clock.host_us
            now = f"t_us={clock.device_us} time_us={self._time(clock.host_us)}"
            member.comment("clock", f"{now} {_bounds_text(clock)}", clock.host_us)

    def event(self, number: int, text: str) -> None:
        with self._lock:
            if not self._closed:
                self._members[number].event(text)

    def _end(self, reason: str) -> None:
        for member in self._members:
            member.write_pending()
        self._settle(math.inf)
        counts = self._count() if self._count else [LineStatistics() for _ in self._members]
        total = LineStatistics()
        for number, (member, statistics) in enumerate(zip(self._members, counts)):
            total += statistics
            clock = f" {_bounds_text(member.clock)}" if member.clock else ""
            text = f"frames={member.frames} jumps={member.jumps}{clock}{member.edges_text()} {statistics.text()}"
            self._file.line(f"# {number}/end: {text}")
        seconds = (self._last_us - self._host_zero_us) / 1e6 if self.frames else 0
        text = f"reason={reason} frames={self.frames} seconds={seconds:.6f} alignment_us={self._alignment_us:.1f} {total.text()}"
        self._file.line(f"# end: {text}")
