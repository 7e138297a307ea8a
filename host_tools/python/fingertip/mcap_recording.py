"""Recordings as MCAP files of ROS 2 messages, written and read line by line (host_tools/library/libfingertip/RECORDING.md has the format).

Needs the package mcap.
"""

import bisect
import calendar
import collections
import functools
import heapq
import itertools
import math
import os
import re
import struct
import types
import zlib
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from .columns import Array
from .errors import InputError
from .frames import Q10
from .line import CONTACT_COLUMNS, LATER_COLUMNS, MAPS, RAW_COLUMNS, SENSORS_MAX
from .lines import LineFile, shortest
from .messages import CONTACT_TYPE, DIAGNOSTICS_TYPE, FRAME_TOPICS, LINE_TYPE, PRESSURES_TYPE, TYPES, FrameMessages
from .messages import diagnostics, health_status, name_in_ros, stamp
from .recorded import Rows, header_text, serials_of
from .ros_messages import CDR_LITTLE_ENDIAN, PRIMITIVES, decode, encode, fields_of, schema_of

LATEST_ns = (2**31 - 1) * 10**9  # that a ROS message can hold
MAGIC = b"\x89MCAP0\r\n"
CHUNK_ns = 1_000_000_000  # a chunk ends once it is that long, or has a megabyte
PERIOD_ns = 10_000_000  # each has the wrench, location and pressures of one row at most
CHUNK_MOST_bytes = 1 << 28  # of one that is read
MESSAGE_MOST_bytes = 1 << 20  # of one that is packed by itself
WAITING_MOST = 1 << 16  # lines that wait for one before them, before it counts as lost
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 2, 3, 4, 5, 6, 15  # opcodes
_PERIODIC = re.compile("# (?:[0-9]+/)?(?:clock: |grip: |packet: health )")  # lines that each second or more has
_ZSTD = b"\x28\xb5\x2f\xfd"

_COUNTS = ("sequence", "flags", "sensors_used", "convert_us", "read_us", "queue_us", "condition_us", "fit_us", "contact_us", "total_us")
_CONTACT_NAMES = (*CONTACT_COLUMNS, *LATER_COLUMNS)
_QUANTITIES = [name for name in _CONTACT_NAMES if name not in _COUNTS]
_FIRST_RAW = 2 + len(CONTACT_COLUMNS) + len(LATER_COLUMNS)
_FIRST_SENSOR = _FIRST_RAW + len(RAW_COLUMNS)
_CELLS = [(name, at) for at, name in enumerate((*CONTACT_COLUMNS, *LATER_COLUMNS, *RAW_COLUMNS), 2)]
_NUMBER_CELLS = [(name.lower(), at) for name, at in _CELLS if name in (*_QUANTITIES, "temperature_degC")]
_WHOLE_CELLS = [(name.lower(), at) for name, at in _CELLS if name not in (*_QUANTITIES, "temperature_degC")]
_UTC = re.compile(r"(\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d)(?:\.(\d{3}))?Z")


def _mcap() -> types.ModuleType:
    """The package mcap and what it needs."""
    try:
        import mcap.data_stream
        import mcap.exceptions
        import mcap.reader
        import mcap.stream_reader
        import mcap.writer
        import zstandard  # noqa: F401
    except ImportError:
        raise InputError("MCAP files need the package mcap; pip install mcap") from None
    return mcap


def _utc_ns(text: str) -> int | None:
    """Of the last word."""
    match = _UTC.fullmatch(text.rpartition(" ")[2])
    if not match:
        return None
    return calendar.timegm(tuple(int(match[i]) for i in range(1, 7))) * 10**9 + int(match[7] or 0) * 10**6


def _clamp_ns(time_ns: int) -> int:
    return min(max(time_ns, 0), LATEST_ns)


class LogClock:
    """When a row was measured, ns since 1970: the begin of the recording by the computer's clock, and then device time, or in a recording of
    several the recorder's."""

    def __init__(self, head: dict[str, str]) -> None:
        self.begin_ns = self._utc_ns = self.last_ns = _utc_ns(head.get("started_utc", "")) or 0
        started = head.get("started_device_us", "")
        self._anchor = (self._utc_ns, int(started)) if started.isascii() and started.isdigit() else None
        self._event_ns = 0
        self._last_us = 0

    def event(self, text: str) -> None:
        self._event_ns = _utc_ns(text) or self._event_ns

    def row(self, t_us: int, time_us: float) -> int:
        if math.isnan(time_us):
            if self._anchor is None:
                self._anchor = (self._utc_ns, t_us)
            elif t_us < self._last_us:  # it restarted
                self._anchor = (max(self._event_ns, self.last_ns), t_us)
            self._last_us = t_us
            self.last_ns = _clamp_ns(self._anchor[0] + (t_us - self._anchor[1]) * 1000)
        else:
            self.last_ns = _clamp_ns(self._utc_ns + round(time_us * 1000))
        return self.last_ns


class _Device:
    """One fingertip of the recording, by the comments about it."""

    def __init__(self, number: int, serial: str) -> None:
        self.number = number
        self.serial = serial
        self.messages = FrameMessages(serial)
        self.channels: dict[str, int] = {}
        self.period = -1
        self.x_mm: list[float] = []
        self.y_mm: list[float] = []
        self.sensors = 0

    def key(self, key: str, value: str) -> None:
        if key in ("x_mm", "y_mm"):
            setattr(self, key, [float(word) for word in value.split()])
        elif key == "sensors":
            self.sensors = int(value)
        if key in ("x_mm", "y_mm", "sensors"):
            self.messages.place_sensors(self.x_mm, self.y_mm, self.sensors)


class McapLines:
    """The lines of a recording as an MCAP file. Raises InputError."""

    def __init__(self, path: "str | os.PathLike[str]", replace: bool) -> None:
        writer = _mcap().writer.Writer
        self._file = LineFile(path, replace)
        self._writer = writer(self._file)
        try:
            self._writer.start("ros2", "fingertip")
        except InputError:
            self._file.close()
            raise
        self._sequences: collections.Counter[int] = collections.Counter()  # by channel
        self._log_ns = 0  # of the last message
        self._chunk_ns = 0  # when the chunk under way began
        self._number = 0
        self._head: list[str] | None = []  # until the row of columns
        self._joint = False
        self._devices: list[_Device] = []
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._clock = LogClock({})
        self._closed = False

    def line(self, text: str) -> None:
        if self._head is None:
            self._put(text)
            return
        self._head.append(text)
        if not text.startswith("#"):
            self._begin()

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        try:
            if self._head is not None:
                self._begin()
            self._writer.finish()
        finally:
            self._file.close()

    def _begin(self) -> None:
        """The head is complete."""
        head, self._head = self._head or [], None
        pairs = [text[1:].strip().partition(": ")[::2] for text in head if text.startswith("#") and ": " in text]
        keys = dict(pairs)
        self._joint = head[:1] == ["# fingertip-recording 2"]
        serials = serials_of(keys.get("devices", "")) if self._joint else [keys.get("serial", "")]
        self._devices = [_Device(number, serial) for number, serial in enumerate(serials)]
        for key, value in pairs:
            device, own = self._device_of(key)
            if device:
                device.key(own, value)
        self._clock = LogClock(keys)
        self._writer.add_metadata("fingertip_recording", dict(sorted(keys.items())))
        for name in TYPES:
            self._schemas[name] = self._writer.register_schema(name.replace("/", "/msg/"), "ros2msg", schema_of(name).encode("utf-8"))
        self._channels = {
            LINE_TYPE: self._channel("/fingertip/lines", LINE_TYPE),
            "periodic": self._channel("/fingertip/lines/periodic", LINE_TYPE),
            DIAGNOSTICS_TYPE: self._channel("/diagnostics", DIAGNOSTICS_TYPE),
        }
        for device in self._devices:
            root = f"/fingertip/{name_in_ros(device.serial)}/"
            device.channels = self._channels | {name: self._channel(root + topic, name) for topic, name in FRAME_TOPICS.items()}
        for text in head:
            self._put_line(text)
        self._writer.flush()

    def _channel(self, topic: str, name: str) -> int:
        number: int = self._writer.register_channel(topic, "cdr", self._schemas[name], {"offered_qos_profiles": ""})
        return number

    def _device_of(self, key: str) -> tuple[_Device | None, str]:
        """The fingertip that a comment is about, and the key without its number."""
        if not self._joint:
            return (self._devices[0] if self._devices else None), key
        number, slash, own = key.partition("/")
        if slash and number.isascii() and number.isdigit() and int(number) < len(self._devices):
            return self._devices[int(number)], own
        return None, key

    def _put(self, text: str) -> None:
        if not text.startswith("#"):
            self._put_row(text)
            return
        self._put_line(text)
        key, _, value = text[1:].strip().partition(": ")
        device, own = self._device_of(key)
        if own == "event":
            self._clock.event(value)
        elif device and own == "packet" and value.startswith("health "):
            fields = dict(pair.partition("=")[::2] for pair in value.split()[1:] if not pair.startswith(("sequence=", "t_us=")))
            status = health_status(device.serial, device.sensors, fields)
            self._add(self._channels[DIAGNOSTICS_TYPE], diagnostics(self._clock.last_ns, status))
        elif device and own in ("x_mm", "y_mm", "sensors"):
            device.key(own, value)

    def _add(self, channel: int, data: bytes) -> None:
        now_ns = self._log_ns = max(self._log_ns, self._clock.last_ns)  # no tool changes the order
        if abs(now_ns - self._chunk_ns) >= CHUNK_ns:
            self._writer.flush()  # outlives the writer
            self._chunk_ns = now_ns
        self._writer.add_message(channel, now_ns, data, now_ns, self._sequences[channel])
        self._sequences[channel] += 1

    def _put_line(self, text: str) -> None:
        self._number += 1
        header = {"stamp": stamp(self._clock.last_ns), "frame_id": ""}
        channel = self._channels["periodic" if _PERIODIC.match(text) else LINE_TYPE]
        self._add(channel, encode(LINE_TYPE, {"header": header, "line": self._number, "text": text, "torn": False}))

    def _put_row(self, text: str) -> None:
        self._number += 1
        cells = text.split(",")
        device, time_us = self._devices[0], math.nan
        if self._joint:
            device, time_us = self._devices[int(cells[0])], float(cells[1])
            del cells[:2]
        row = contact_of(cells) | {"line": self._number, "device": device.number, "time_us": time_us}
        self._clock.row(row["t_us"], time_us)
        period = max(self._log_ns, self._clock.last_ns) // PERIOD_ns
        is_repeated, device.period = period != device.period, period
        for kind, data in device.messages.of(self._clock.last_ns, row, is_repeated):
            self._add(device.channels[kind], data)


def contact_of(cells: list[str]) -> dict[str, Any]:
    """Cells of a row from t_us on, with all its columns, as the fields of fingertip_msgs/Contact that they hold."""
    row: dict[str, Any] = {"t_us": int(cells[0]), "frame": int(cells[1]), "has_contact": cells[2] != "", "has_raw": cells[_FIRST_RAW] != ""}
    row |= {name: int(cells[at] or 0) for name, at in _WHOLE_CELLS}
    row |= {name: float(cells[at] or "nan") for name, at in _NUMBER_CELLS}
    pressures = [round(float(cell) * Q10) / Q10 for cell in cells[_FIRST_SENSOR:]] if row["has_raw"] else []
    row["pressure_pa"], row["tare_pa"] = pressures[: len(pressures) // 2], pressures[len(pressures) // 2 :]
    return row


class Damaged(InputError):
    """A part of a file that cannot be read; reading goes on behind it."""


Line = tuple[int, str, bool]  # number, text, whether it is torn


class Contacts(NamedTuple):
    """Messages of fingertip_msgs/Contact one after the other: the lines' numbers, their bytes, their times."""

    numbers: list[int]
    data: list[bytes]
    times_s: list[float]  # since the recording began


class Skipped:
    """Lines before this number may be among those that were left out on purpose."""

    def __init__(self, to: int) -> None:
        self.to = to


@functools.cache
def _contact_layout(frame_id: int, sensors: int) -> np.dtype[Any]:
    """Of such a message behind its encapsulation, with a frame_id of this length and these sensors' pressures."""
    fields: list[Any] = [("sec", "<u4"), ("nanosec", "<u4"), ("frame_id_bytes", "<u4"), ("frame_id", f"S{frame_id}")]
    *others, (beyond, _, _) = fields_of(CONTACT_TYPE)[1:]
    for name, kind, is_sequence in others:
        code = "<" + PRIMITIVES[kind].replace("?", "B")
        fields += [(f"{name}_count", "<u4")] * is_sequence + [(name, code, (sensors,) if is_sequence else ())] * (
            not is_sequence or sensors > 0
        )
    return np.dtype([*fields, (f"{beyond}_count", "<u4"), (beyond, "<u4", (len(MAPS),))], align=True)


def _length_of(layout: np.dtype[Any], names: tuple[str, ...] = ("tare_pa", "tare_pa_count")) -> int:
    """To the end of the first of these that it has, without what aligns that."""
    assert layout.fields
    kind, at = layout.fields[next(name for name in names if name in layout.fields)][:2]
    return int(at + kind.itemsize)


class McapLineReader:
    """The lines of a recording in an MCAP file, in the order of their numbers, in whatever order a tool has written them.

    It reads from the begin, so that a file whose writer was killed reads as far as it goes; chunks that are in another order than that of
    time it reads by the index. A file with the topics of one fingertip alone, as `ros2 bag record` makes them, gets a head and an end of
    what its first messages hold. Raises InputError where the file cannot be read, or is none of a recording.
    """

    def __init__(
        self, path: "str | os.PathLike[str]", progress: Callable[[float], None] | None = None, interval_s: tuple[float, float] | None = None
    ) -> None:
        """interval_s: since the recording began; chunks outside are left out, if there is an index."""
        self.path = os.fspath(path)
        self._progress = progress
        self._interval_s = interval_s
        self._begin_ns: int | None = None
        self._mcap = _mcap()
        self._schemas: dict[int, str] = {}  # names
        self._channels: dict[int, tuple[str, str]] = {}  # topic, name of the schema
        self._is_joint: bool | None = None
        self._topic: str | None = None  # of contacts in a file without lines, whose numbers are counted here
        self._count = self._latest_ns = 0
        self._has_header = self._is_torn = self._has_any = False

    def _damaged(self, name: str, error: ValueError) -> Damaged:
        text = f"a damaged message {name} ({error}), or one of another version of the tool; use salvage=True to skip it"
        return Damaged(f"{self.path}: {text}")

    def items(self) -> Iterator[Line | Contacts | Damaged | Skipped]:
        """The lines in their order, rows many at a time; what is damaged is among them, at its place."""
        for each in self._ordered():
            number = min(each.numbers) if isinstance(each, Contacts) else each[0] if isinstance(each, tuple) else 0
            if number > 1 and self._is_joint is None:
                topics = "What the topics alone hold: mcap filter FILE -y '.*/(contact|pressures)' -o OUT"
                raise InputError(f"{self.path}: the recording's first lines are not in it. {topics}")
            if isinstance(each, Contacts) and not self._has_header:
                each = self._damaged(CONTACT_TYPE, ValueError("a row with no header line before it"))
            if isinstance(each, tuple) and not isinstance(each, Contacts):
                text = each[1].rstrip("\r")
                self._is_joint = text == "# fingertip-recording 2" if self._is_joint is None else self._is_joint
                self._has_header = self._has_header or text.strip(" \t\r")[:1] not in ("", "#")
            yield each
        if not self._has_any:
            raise InputError(f"{self.path}: no recording of a fingertip; give one that fingertip has written")
        if self._is_torn:
            yield Damaged(f"{self.path}: the last chunk is torn; use salvage=True to do without")

    def _ordered(self) -> Iterator[Line | Contacts | Damaged | Skipped]:
        """What is in the file, each line behind those before it."""
        waits: list[tuple[int, int, Line | Contacts]] = []
        last = order = skipped_to = 0
        for each in itertools.chain(self._records(), (None,)):
            if isinstance(each, (Damaged, Skipped)):
                skipped_to = each.to if isinstance(each, Skipped) else skipped_to
                yield each
                continue
            singles: list[tuple[int, Line | Contacts]] = []
            if isinstance(each, Contacts):
                numbers = np.array(each.numbers, "Q").astype(np.float64)
                largest = np.maximum.accumulate(np.concatenate(([last], numbers)))
                if not waits and (numbers <= np.maximum(largest[:-1] + 1, skipped_to)).all():
                    last = max(last, *each.numbers)
                    yield each
                    continue
                singles = [(number, Contacts([number], [data], [s])) for number, data, s in zip(*each)]
            elif each is not None:
                singles = [(each[0], each)]
            ready: list[Line | Contacts] = []
            for number, single in singles:
                order += 1
                heapq.heappush(waits, (number, order, single))
                while waits and (waits[0][0] <= max(last + 1, skipped_to) or len(waits) > WAITING_MOST):
                    number, _, single = heapq.heappop(waits)
                    last = max(last, number)
                    ready.append(single)
            if each is None:
                ready += [single for _, _, single in sorted(waits)]
            for are_contacts, group in itertools.groupby(ready, lambda single: isinstance(single, Contacts)):
                yield from [Contacts(*(list(itertools.chain(*parts)) for parts in zip(*group)))] if are_contacts else group

    def _index(self, file: BinaryIO) -> tuple[dict[int, int], int]:
        """A sound index has all channels, and when each chunk begins, by its place. And where the summary begins."""
        file.seek(0)
        try:
            summary = self._mcap.reader.make_reader(file).get_summary()
            file.seek(-len(MAGIC) - 20, os.SEEK_END)
            (begin,) = struct.unpack("<Q", file.read(8))
        except (self._mcap.exceptions.McapError, ValueError, MemoryError, OSError, struct.error):
            summary = None
        if summary is None or any(each.chunk_start_offset >= begin for each in summary.chunk_indexes):
            return {}, 0
        self._schemas = {each.id: each.name.replace("/msg/", "/") for each in summary.schemas.values()}
        self._channels = {each.id: (each.topic, self._schemas.get(each.schema_id, "")) for each in summary.channels.values()}
        return {each.chunk_start_offset: each.message_start_time for each in summary.chunk_indexes}, begin

    @staticmethod
    def _jumps(spans: dict[int, int], summary: int) -> dict[int, int]:
        """From a chunk's place, or the summary, to that of another, by time; none where the file is in that order. What no index has is read
        behind the chunk before it."""
        places, order = sorted(spans), sorted(spans, key=lambda place: (spans[place], place))
        if places == order:
            return {}
        next_in_file, next_by_time = (dict(zip(each, [*each[1:], summary])) for each in (places, order))
        return {places[0]: order[0], **{next_in_file[place]: next_by_time[place] for place in places}}

    def _is_outside(self, chunk: bytes) -> bool:
        """Of the interval, by its own times, where the index is wrong."""
        if self._interval_s is None or self._begin_ns is None or not self._has_header or len(chunk) < 16:
            return False
        begin_ns, end_ns = struct.unpack("<QQ", chunk)
        return bool((end_ns - self._begin_ns) / 1e9 < self._interval_s[0] or (begin_ns - self._begin_ns) / 1e9 > self._interval_s[1])

    def _records(self) -> Iterator[Line | Contacts | Damaged | Skipped]:
        """What is in the file, in its order, or that of its chunks by time."""
        zstd_error, struct_error = self._mcap.stream_reader.zstandard.ZstdError, struct.error
        damage = (ValueError, MemoryError, RuntimeError, EOFError, struct_error, zstd_error)
        try:
            with open(self.path, "rb") as file:
                size = os.fstat(file.fileno()).st_size
                if file.read(len(MAGIC)) != MAGIC:
                    raise InputError(f"{self.path}: no MCAP file; give one that fingertip has written")
                spans, summary = self._index(file)
                after = self._jumps(spans, summary)
                places = sorted(after)
                is_skipping = is_behind = False
                at = file.seek(len(MAGIC))
                while at < size:  # a killed writer leaves whole chunks
                    head = file.read(9)
                    length = int.from_bytes(head[1:], "little")
                    if len(head) < 9 or length > size - at - 9:
                        self._is_torn = not is_behind
                        break
                    if head[0] == _FOOTER and is_behind:
                        file.seek(at + 9 + length + len(MAGIC))
                        if file.read(len(MAGIC)) == MAGIC:
                            begin = at + 9 + length + len(MAGIC)
                            apart = f"head -c {begin} and tail -c +{begin + 1} take them apart"
                            yield Damaged(f"{self.path}: damaged at byte {begin}: another MCAP file begins; {apart}")
                        break
                    if self._progress:
                        self._progress(at / size)
                    is_outside = head[0] == _CHUNK and at in spans and self._is_outside(file.read(16))
                    file.seek(at + 9)
                    is_skipping = is_skipping or is_outside
                    try:
                        if is_outside or is_behind:
                            pass
                        elif head[0] == _CHUNK and length <= CHUNK_MOST_bytes:
                            found = self._messages(self._chunk(file.read(length)))
                            parts = (each.numbers if isinstance(each, Contacts) else each[:1] for each in found if isinstance(each, tuple))
                            if is_skipping and found:
                                yield Skipped(min(itertools.chain(*parts), default=0))
                                is_skipping = False
                            yield from found
                        elif head[0] in (_SCHEMA, _CHANNEL, _MESSAGE):
                            yield from self._messages(head + file.read(length))
                    except damage as error:
                        what = "it ends within a field" if isinstance(error, struct_error) else error
                        yield Damaged(f"{self.path}: damaged at byte {at} ({what}); use salvage=True to skip the chunk")
                    end = summary if after and head[0] == _DATA_END else at + 9 + length
                    inside = bisect.bisect(places, at)
                    if inside < len(places) and places[inside] < end:
                        after, places = {}, []  # it would lead round in circles
                    at = file.seek(after.get(end, end))
                    is_behind = is_behind or (at == summary if after else head[0] == _DATA_END)
                if self._topic and not self._is_torn:
                    yield self._count + 1, "# end: reason=topics", False
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; check the path") from None

    def _chunk(self, content: bytes) -> bytes:
        """The records in it. Raises ValueError."""
        size, crc, name = struct.unpack_from("<QII", content, 16)
        compression = content[32 : 32 + name]
        (length,) = struct.unpack_from("<Q", content, 32 + name)
        data = content[40 + name : 40 + name + length]
        if len(data) < length or compression not in (b"", b"lz4", b"zstd") or size > CHUNK_MOST_bytes:
            raise ValueError(f'a chunk of {size} bytes, compression "{compression.decode("utf-8", "replace")[:20]}"')
        if compression == b"lz4":
            data = self._mcap.stream_reader.lz4.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        elif compression:
            data = self._unzstd(data, size)
        if len(data) != size or (crc and zlib.crc32(data) != crc):
            raise ValueError("its length or CRC is wrong")
        return data

    def _unzstd(self, data: bytes, size: int) -> bytes:
        """Of frames one after the other; at most one byte more than size."""
        unpack = self._mcap.stream_reader.zstandard.ZstdDecompressor()
        found: bytes = unpack.stream_reader(data, read_across_frames=True).read(size + 1)
        return found

    def _messages(self, data: bytes) -> list[Line | Contacts | Damaged]:
        """Those that are wanted in a row of records. Raises ValueError, or what struct raises, where one of them is damaged."""
        wanted: list[tuple[str, str, bytes, int]] = []
        at, size, channels, unpack = 0, len(data), self._channels, struct.unpack_from
        clouds: dict[str, bytes] = {}
        while at < size:
            length = unpack("<Q", data, at + 1)[0]
            begin, end = at + 9, at + 9 + length
            if end > size:
                raise ValueError("a record in it is torn")
            kind = data[at]
            at = end
            if kind == _MESSAGE:
                if length < 22:
                    raise ValueError("it ends within a field")
                channel = channels.get(unpack("<H", data, begin)[0])
                if channel is None:
                    raise ValueError("its channel is unknown")
                topic, name = channel
                if name in (CONTACT_TYPE, LINE_TYPE):
                    message = data[begin + 22 : end]
                    if message[:4] == _ZSTD:  # packed by itself
                        try:
                            message = self._unzstd(message, MESSAGE_MOST_bytes)
                        except self._mcap.stream_reader.zstandard.ZstdError:
                            message = b""
                        message = message if len(message) <= MESSAGE_MOST_bytes else b""
                    wanted.append((name, topic, message, unpack("<Q", data, begin + 6)[0]))
                elif name == PRESSURES_TYPE:
                    clouds.setdefault(topic, data[begin + 22 : end])
            elif kind in (_SCHEMA, _CHANNEL):
                self._declare(kind, data[begin:end])
        found: list[Line | Contacts | Damaged] = []
        has_lines = any(name == LINE_TYPE for _, name in channels.values())
        self._has_any = self._has_any or bool(wanted)
        if self._begin_ns is None and wanted:
            self._begin_ns = min(time_ns for name, _, _, time_ns in wanted if name == wanted[0][0])
        numbers: list[int] = []
        rows: list[bytes] = []
        times_s: list[float] = []
        for name, topic, message, time_ns in wanted:
            if name == CONTACT_TYPE and self._topic is None and not has_lines and message:
                self._topic = topic
                found += self._made_head(message, clouds.get(topic.rpartition("/")[0] + "/pressures", b""))
                self._count = len(found)
            if self._topic and name == CONTACT_TYPE and time_ns < self._latest_ns:
                raise InputError(f"{self.path}: messages in another order than that of time: mcap sort FILE -o OUT")
            self._latest_ns = time_ns
            if name == CONTACT_TYPE and (number := self._number_of(message, topic)) is not None:
                numbers.append(number)
                rows.append(message)
                times_s.append((time_ns - (self._begin_ns or 0)) / 1e9)
                continue
            if self._topic:
                raise InputError(f"{self.path}: chunks in another order than that of time, and no index: mcap recover FILE -o OUT")
            if numbers:
                found.append(Contacts(numbers, rows, times_s))
                numbers, rows, times_s = [], [], []
            try:
                row = decode(name, message)
                if "\n" in row.get("text", "\n"):
                    raise ValueError("it ends within")
                found.append((row["line"], row["text"], row["torn"]))
            except ValueError as error:
                found.append(self._damaged(name, error))
        return [*found, Contacts(numbers, rows, times_s)] if numbers else found

    def _number_of(self, message: bytes, topic: str) -> int | None:
        """Of a contact's line; None where there is none in it."""
        if self._topic is None:
            frame_id = struct.unpack_from("<I", message, 12)[0] if len(message) > 16 else 0
            at = 16 + frame_id + -(12 + frame_id) % 8
            is_there = message[:4] == CDR_LITTLE_ENDIAN and frame_id and at + 8 <= len(message)
            return int(struct.unpack_from("<Q", message, at)[0]) if is_there else None
        if topic != self._topic:
            take_one = f"mcap filter FILE -y '{self._topic.rpartition('/')[0]}/.*' -o OUT"
            raise InputError(f"{self.path}: topics of several fingertips, and no lines of a recording. Take one: {take_one}")
        self._count += 1
        return self._count

    def _made_head(self, contact: bytes, cloud: bytes) -> list[Line | Contacts | Damaged]:
        """Of a recording, by the first contact and the pressures that were read with it."""
        serial = (self._topic or "").split("/")[-2:][0]
        try:
            row = decode(CONTACT_TYPE, contact)
            sensors = len(row["pressure_pa"]) * row["has_raw"]
        except ValueError:
            sensors = 0
        lines = ["# fingertip-recording 1", f"# serial: {serial[1:] if re.match('s[0-9]', serial) else serial}", f"# sensors: {sensors}"]
        data = cloud[-1 - 16 * sensors : -1]
        if cloud and sensors <= SENSORS_MAX and cloud[-5 - 16 * sensors : -1 - 16 * sensors] == struct.pack("<I", 16 * sensors):
            points = np.round(np.frombuffer(data, "<f4").reshape(-1, 4).astype(np.float64) * 1e6) / 1e3  # to a micrometre
            lines += [f"# {name}: {' '.join(map(shortest, points[:, axis].tolist()))}" for axis, name in enumerate(("x_mm", "y_mm"))]
        return [(number, text, False) for number, text in enumerate([*lines, header_text(sensors)], 1)]

    def _declare(self, kind: int, content: bytes) -> None:
        """Of schemas and channels only what they need is read: damage elsewhere costs none."""

        def text(at: int) -> tuple[str, int]:
            end = at + 4 + int(struct.unpack_from("<I", content, at)[0])
            if end > len(content):
                raise ValueError("it ends within a field")
            return content[at + 4 : end].decode("utf-8", "replace"), end

        (number,) = struct.unpack_from("<H", content)
        if kind == _SCHEMA:
            self._schemas[number] = text(2)[0].replace("/msg/", "/")
        else:
            (schema,) = struct.unpack_from("<H", content, 2)
            topic, end = text(4)
            text(end)  # the encoding
            self._channels[number] = topic, self._schemas.get(schema, "")

    def tables(
        self, contacts: Contacts, rows: Rows, device_count: int
    ) -> "Iterator[tuple[list[int], Array, Array, Array, list[float]] | Damaged]":
        """Numbers, devices, times, columns and log times, and what is damaged among them."""
        lengths = np.array(list(map(len, contacts.data)))
        fine = np.zeros(len(lengths), bool)
        table, devices, times_us = np.empty((len(lengths), len(rows.names))), np.empty(len(lengths)), np.empty(len(lengths))
        frame_ids = np.frombuffer(b"".join([data[12:16].ljust(4, b"\xff") for data in contacts.data]), "<u4")  # their lengths
        for length, frame_id in set(zip(lengths.tolist(), frame_ids.tolist())):
            at = np.flatnonzero((lengths == length) & (frame_ids == frame_id))
            if frame_id > length:
                continue  # torn
            data = b"".join(contacts.data) if len(at) == len(lengths) else b"".join([contacts.data[k] for k in at])
            messages = np.frombuffer(data, np.uint8).reshape(-1, length)[:, 4:]
            layout = _contact_layout(frame_id, rows.sensors)
            sensors = rows.sensors if _length_of(layout) <= length - 4 else 0
            layout = layout if sensors else _contact_layout(frame_id, 0)
            if _length_of(layout) > length - 4:
                continue  # torn
            padded = np.zeros((len(at), layout.itemsize), np.uint8)
            padded[:, : length - 4] = messages[:, : layout.itemsize]
            found = padded.view(layout).ravel()
            if self._topic:
                found["time_us"] = math.nan  # a recording of one
            table[at], fine[at] = rows.of_contacts(found, sensors)
            devices[at], times_us[at] = found["device"], np.round(found["time_us"], 1)
            whole = length - 4 >= _length_of(layout, ("beyond",))
            fine[at] &= (found["beyond_count"] == 0) | (whole & (found["beyond_count"] == len(MAPS)))
            fine[at] &= (np.isnan(found["time_us"]) != bool(self._is_joint)) & ~np.isinf(found["time_us"])
        fine &= (devices < device_count) | (not self._is_joint)
        numbers = np.array(contacts.numbers, "Q")
        starts = np.flatnonzero(~fine | np.concatenate(([True], ~fine[:-1] | (numbers[1:] - numbers[:-1] != 1))))
        for begin, end in zip(starts.tolist(), [*starts[1:].tolist(), len(fine)]):
            if fine[begin]:
                yield contacts.numbers[begin:end], devices[begin:end], times_us[begin:end], table[begin:end], contacts.times_s[begin:end]
            else:
                yield self._damaged(CONTACT_TYPE, ValueError("no row of this recording"))
