"""Recordings as MCAP files of ROS 2 messages, written and read line by line (host_tools/library/libfingertip/RECORDING.md has the format).

Needs the package mcap.
"""

import calendar
import collections
import io
import math
import os
import re
import struct
import types
from collections.abc import Callable, Iterator
from typing import Any

from .errors import InputError
from .frames import Q10
from .line import CONTACT_COLUMNS, LATER_COLUMNS, RAW_COLUMNS, SENSOR_LISTS
from .lines import LineFile, shortest
from .messages import CONTACT_TYPE, DIAGNOSTICS_TYPE, FRAME_TOPICS, LINE_TYPE, TYPES, FrameMessages
from .messages import diagnostics, health_status, name_in_ros, stamp
from .recorded import LISTS
from .ros_messages import decode, encode, schema_of

LATEST_ns = (2**31 - 1) * 10**9  # that a ROS message can hold
MAGIC = b"\x89MCAP0\r\n"
CHUNK_ns = 1_000_000_000  # a chunk ends once it is that long, or has a megabyte
CHUNK_MOST_bytes = 1 << 28  # of one that is read

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


class _LogClock:
    """When a row was measured, ns since 1970: the begin of the recording by the computer's clock, and then device time, or in a recording of
    several the recorder's."""

    def __init__(self, head: dict[str, str]) -> None:
        self._utc_ns = self.last_ns = _utc_ns(head.get("started_utc", "")) or 0
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
        self.keys: dict[str, str] = {}
        self.serial = serial
        self.messages = FrameMessages(serial)
        self.channels: dict[str, int] = {}
        self.x_mm: list[float] = []
        self.y_mm: list[float] = []
        self.sensors = 0

    def key(self, key: str, value: str) -> None:
        self.keys[key] = value
        if key in ("x_mm", "y_mm"):
            setattr(self, key, [float(word) for word in value.split()])
        elif key == "sensors":
            self.sensors = int(value)
        if key in ("x_mm", "y_mm", "sensors"):
            self.messages.place_sensors(self.x_mm, self.y_mm, self.sensors)

    def calibration(self) -> str:
        """What there is of gains, force scale and pad, as JSON; nothing without."""
        found = [
            f'"{key}": ' + (f"[{', '.join(value.split())}]" if key in LISTS else value)
            for key, value in self.keys.items()
            if key.startswith(("calibration_", "force_scale", "pad_")) or key in SENSOR_LISTS
        ]
        return "{" + ", ".join([f'"serial": "{self.serial}"', *found]) + "}" if found else ""


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
        self._chunk_ns = 0  # when the chunk under way began
        self._number = 0
        self._head: list[str] | None = []  # until the row of columns
        self._joint = False
        self._devices: list[_Device] = []
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._clock = _LogClock({})
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
        serials = keys.get("devices", "").split() if self._joint else [keys.get("serial", "")]
        self._devices = [_Device(number, serial) for number, serial in enumerate(serials)]
        for key, value in pairs:
            device, own = self._device_of(key)
            if device:
                device.key(own, value)
        self._clock = _LogClock(keys)
        now_ns = self._clock.last_ns
        self._writer.add_metadata("fingertip_recording", keys)
        for device in self._devices:
            calibration = device.calibration()
            if calibration:
                self._writer.add_attachment(
                    now_ns, now_ns, f"calibration_{device.serial}.json", "application/json", calibration.encode("utf-8")
                )
        for name in TYPES:
            self._schemas[name] = self._writer.register_schema(name.replace("/", "/msg/"), "ros2msg", schema_of(name).encode("utf-8"))
        self._channels = {
            name: self._channel(topic, name) for name, topic in ((LINE_TYPE, "/fingertip/lines"), (DIAGNOSTICS_TYPE, "/diagnostics"))
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
        now_ns = self._clock.last_ns
        if abs(now_ns - self._chunk_ns) >= CHUNK_ns:
            self._writer.flush()  # outlives the writer
            self._chunk_ns = now_ns
        self._writer.add_message(channel, now_ns, data, now_ns, self._sequences[channel])
        self._sequences[channel] += 1

    def _put_line(self, text: str) -> None:
        self._number += 1
        header = {"stamp": stamp(self._clock.last_ns), "frame_id": ""}
        self._add(self._channels[LINE_TYPE], encode(LINE_TYPE, {"header": header, "line": self._number, "text": text, "torn": False}))

    def _put_row(self, text: str) -> None:
        self._number += 1
        cells = text.split(",")
        device, time_us = self._devices[0], math.nan
        if self._joint:
            device, time_us = self._devices[int(cells[0])], float(cells[1])
            del cells[:2]
        row = contact_of(cells) | {"line": self._number, "device": device.number, "time_us": time_us}
        self._clock.row(row["t_us"], time_us)
        for kind, data in device.messages.of(self._clock.last_ns, row):
            self._add(device.channels[kind], data)


def contact_of(cells: list[str]) -> dict[str, Any]:
    """Cells of a row from t_us on, with all its columns, as the fields of fingertip_msgs/Contact that they hold."""
    row: dict[str, Any] = {"t_us": int(cells[0]), "frame": int(cells[1]), "has_contact": cells[2] != "", "has_raw": cells[_FIRST_RAW] != ""}
    row |= {name: int(cells[at] or 0) for name, at in _WHOLE_CELLS}
    row |= {name: float(cells[at] or "nan") for name, at in _NUMBER_CELLS}
    pressures = [round(float(cell) * Q10) / Q10 for cell in cells[_FIRST_SENSOR:]] if row["has_raw"] else []
    row["pressure_pa"], row["tare_pa"] = pressures[: len(pressures) // 2], pressures[len(pressures) // 2 :]
    return row


def _cells_of(row: dict[str, Any], names: list[str]) -> str:
    """The columns of these names, out of a fingertip_msgs/Contact."""
    cells = {name: (shortest(row[name.lower()]) if name in _QUANTITIES else str(row[name.lower()])) for name in _CONTACT_NAMES}
    cells |= {name: str(row[name.lower()]) for name in ("t_us", "frame", "device", *RAW_COLUMNS)}
    cells |= {"temperature_degC": f"{row['temperature_degc']:.2f}", "time_us": f"{row['time_us']:.1f}"}
    absent = [*(() if row["has_contact"] else _CONTACT_NAMES), *(() if row["has_raw"] else RAW_COLUMNS)]
    cells |= dict.fromkeys(absent, "")
    for kind, values in (("s", row["pressure_pa"]), ("tare", row["tare_pa"])):
        cells |= {f"{kind}{k}_Pa": f"{value:.4f}" for k, value in enumerate(values)}
    return ",".join(cells.get(name, "") for name in names)


class Damaged(InputError):
    """A part of a file that cannot be read; reading goes on behind it."""


class _Content(io.BytesIO):
    """A record's, whose fields end within it."""

    def read(self, length: int | None = -1, /) -> bytes:
        data = super().read(length)
        if length is not None and len(data) < length:
            raise ValueError("it ends within a field")
        return data


Line = tuple[int, str, bool]  # number, text, whether it is torn


class McapLineReader:
    """The lines of a recording in an MCAP file, in the order in which they were written.

    It reads from the begin and without the index, so that a file whose writer was killed reads as far as it goes. Raises InputError where
    the file cannot be read, or is none of a recording.
    """

    def __init__(self, path: "str | os.PathLike[str]", progress: Callable[[float], None] | None = None) -> None:
        self.path = os.fspath(path)
        self._progress = progress
        self._mcap = _mcap()
        self._schemas: dict[int, str] = {}  # names
        self._channels: dict[int, tuple[str, str]] = {}  # topic, name of the schema
        self._is_joint: bool | None = None
        self._names: list[str] = []

    def __iter__(self) -> Iterator[Line]:
        """Those that can be read."""
        return (each for each in self.lines() if not isinstance(each, Damaged))

    def lines(self) -> Iterator[Line | Damaged]:
        """What is damaged is among them, at its place."""
        has_line = False
        for each in self._messages():
            if isinstance(each, Damaged):
                yield each
            elif each[1] in (LINE_TYPE, CONTACT_TYPE):
                has_line = True
                yield self._line(*each)
        if not has_line:
            raise InputError(f"{self.path}: no recording of a fingertip; give one that fingertip has written")
        if self._is_torn:
            yield Damaged(f"{self.path}: the last chunk is torn; use --salvage to do without")

    def _messages(self) -> Iterator[tuple[str, str, bytes] | Damaged]:
        """(topic, name of the schema, data)"""
        damage = (ValueError, MemoryError, struct.error, self._mcap.exceptions.McapError, self._mcap.stream_reader.zstandard.ZstdError)
        self._is_torn = False
        try:
            with open(self.path, "rb") as file:
                size = os.fstat(file.fileno()).st_size
                stream = self._mcap.data_stream.ReadDataStream(file)
                if size < len(MAGIC) or stream.read(len(MAGIC)) != MAGIC:
                    raise InputError(f"{self.path}: no MCAP file; give one that fingertip has written")
                for at, opcode, content in self._records(stream, size):
                    if self._progress:
                        self._progress(at / size)
                    try:
                        yield from self._judge(opcode, content)
                    except damage as error:
                        yield Damaged(f"{self.path}: damaged at byte {at} ({error}); use --salvage to skip the chunk")
        except EOFError:
            self._is_torn = True
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; check the path") from None

    def _records(self, stream: Any, size: int) -> Iterator[tuple[int, int, bytes]]:
        """(place, opcode, content). Each ends by its length, whatever is in it. Raises EOFError where the last one is torn."""
        while stream.count < size:  # a killed writer leaves whole chunks
            at = stream.count
            if size - at < 9:
                raise EOFError
            opcode, length = stream.read1(), stream.read8()
            if length > size - stream.count:
                raise EOFError
            if opcode == self._mcap.opcode.Opcode.DATA_END:
                return
            yield at, opcode, stream.read(length)

    def _judge(self, opcode: int, content: bytes) -> list[tuple[str, str, bytes]]:
        """The messages in a record. Of schemas and channels only what they need is read: damage elsewhere costs none. Raises what mcap raises,
        or ValueError."""
        known, records = self._mcap.opcode.Opcode, self._mcap.records
        stream = self._mcap.data_stream.ReadDataStream(_Content(content))
        if opcode == known.SCHEMA:
            number, name = stream.read2(), stream.read(stream.read4())
            self._schemas[number] = name.decode("utf-8", "replace").replace("/msg/", "/")
        elif opcode == known.CHANNEL:
            number, schema, topic = stream.read2(), stream.read2(), stream.read(stream.read4())
            stream.read(stream.read4())  # the encoding
            self._channels[number] = topic.decode("utf-8", "replace"), self._schemas.get(schema, "")
        elif opcode == known.MESSAGE:
            message = records.Message.read(stream, len(content))
            if message.channel_id not in self._channels:
                raise ValueError(f"channel {message.channel_id} is unknown")
            return [(*self._channels[message.channel_id], message.data)]
        elif opcode == known.CHUNK:
            return self._chunk(records.Chunk.read(stream))
        return []

    def _chunk(self, chunk: Any) -> list[tuple[str, str, bytes]]:
        size = chunk.uncompressed_size
        if chunk.compression == "lz4":
            raise InputError(f"{self.path}: chunks packed by lz4 are not read; pack them by zstd: mcap compress FILE -o OUT")
        if chunk.compression not in ("", "zstd"):
            raise ValueError(f'compression "{chunk.compression}" is unknown')
        if size > CHUNK_MOST_bytes:
            raise ValueError(f"a chunk of {size} bytes")
        if chunk.compression and self._mcap.stream_reader.zstandard.frame_content_size(chunk.data) not in (-1, size):
            raise ValueError("its length is wrong")
        stream, length = self._mcap.stream_reader.get_chunk_data_stream(chunk, validate_crc=True)
        if length != size:
            raise ValueError("its length is wrong")
        try:
            return [
                message
                for _, opcode, content in self._records(stream, size)
                if opcode != self._mcap.opcode.Opcode.CHUNK
                for message in self._judge(opcode, content)
            ]
        except EOFError:
            raise ValueError("a record in it is torn") from None

    def _line(self, topic: str, name: str, data: bytes) -> Line | Damaged:
        try:
            row = decode(name, data)
            return self._of_row(row) if name == CONTACT_TYPE else self._of_line(row)
        except ValueError as error:
            return Damaged(
                f"{self.path}: a damaged message on {topic} ({error}), or one of another version of the tool; use --salvage to skip it"
            )

    def _of_line(self, row: dict[str, Any]) -> Line:
        text: str = row["text"]
        if "\n" in text:
            raise ValueError("a line that ends within")
        if self._is_joint is None:
            self._is_joint = text == "# fingertip-recording 2"
        if not self._names and text and not text.startswith("#"):
            self._names = text.split(",")
        return row["line"], text, row["torn"]

    def _of_row(self, row: dict[str, Any]) -> Line:
        if not row["has_raw"]:
            row["pressure_pa"] = row["tare_pa"] = ()
        sensors = sum(name.startswith("tare") for name in self._names) if row["has_raw"] else 0
        if math.isnan(row["time_us"]) == bool(self._is_joint) or {len(row["pressure_pa"]), len(row["tare_pa"])} != {sensors}:
            raise ValueError("a row of another recording")
        return row["line"], _cells_of(row, self._names), False
