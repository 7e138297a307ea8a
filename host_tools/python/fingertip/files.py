"""The files of the Fingertip tools: scenarios, recordings, run reports. One reader for each.

Scenario (CSV, UTF-8): what the sensors measure over time, and the truth behind it: see host_tools/simulation/emulator/scenario.mjs. Without Qx_N
and Qy_N there is no tangential force.

Recording (CSV or MCAP): host_tools/library/libfingertip/RECORDING.md. Empty cells are NaN here. Of several it is read as the recording of one of
them, with time_us, the recorder's clock. Rows of a grasp, "# grip: ...": see host_tools/grasp/grip_row.hpp, read_grip.

Run report (JSON): what the emulator measured; used are device_time_zero_s and warnings.

Every error is an InputError whose text is one line that names file and line and what to do.
"""

import contextlib
import functools
import io
import json
import math
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import line, recorded
from .columns import Array, Columns
from .command import Path
from .errors import InputError
from .frames import Edge, frame_of
from .line import CONTACT_COLUMNS, LATER_COLUMNS, RAW_COLUMNS, SENSORS_MAX, STAGES, Flag  # STAGES for readers of recordings
from .mcap_recording import MAGIC, Contacts, Damaged, Line, LogClock, McapLineReader, Skipped
from .recorded import JOINT_COLUMNS, UNKNOWN_HEADER, Rows, counts_of, judge_key, packet_of, restored, serials_of

if TYPE_CHECKING:
    import pandas

PITCH_mm = 9.0
# Sensor k = 5 * strip + position along the strip; origin in the centre of the pad.
SENSOR_X_mm = np.repeat(np.arange(-1, 2), 5) * PITCH_mm
SENSOR_Y_mm = np.tile(np.arange(-2, 3), 3) * PITCH_mm
SLIP_SPEED_mm_s = 10.0

TRUTH_COLUMNS = ("contact", "x_mm", "y_mm", "force_N", "p0_Pa", "sigma_mm", "slip")
OPTIONAL_COLUMNS = ("Qx_N", "Qy_N", "temperature_degC")  # after the sensors, in any order

CONTACT, FIT_VALID, SLIP_VALID, SLIP = map(int, (Flag.CONTACT, Flag.FIT_VALID, Flag.SLIP_VALID, Flag.SLIP))
TANGENTIAL_VALID, TANGENTIAL_FROM_TOUCH = int(Flag.TANGENTIAL_VALID), int(Flag.TANGENTIAL_FROM_TOUCH)
MOVING, SLIDING, WARNINGS = map(int, (Flag.MOVING, Flag.SLIDING, line.WARNINGS))


def read_lines(path: Path) -> list[str]:
    try:
        with open(path, encoding="utf-8") as file:
            return file.read().split("\n")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; check the path") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: no text file; give a CSV file") from None


def write_text(path: Path, text: str) -> None:
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Whole or not at all, where path is a file."""
    to_file = os.path.isfile(path) or not os.path.exists(path)
    part = f"{path}.part" if to_file else path
    try:
        with open(part, "wb") as file:
            file.write(content)
        if to_file:
            os.replace(part, path)
    except OSError as error:
        if to_file:
            with contextlib.suppress(OSError):
                os.remove(part)
        raise InputError(f"{path}: {error.strerror}; choose another place") from None


def number_of(path: Path, line: int, column: str, cell: str, empty_allowed: bool) -> float:
    if cell == "" and empty_allowed:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{path}:{line}: column {column} is "{cell}"; a finite number is needed')
    return value


def _check_kind(path: Path, lines: Sequence[str], kind: str, formats: Collection[str] = ("1",)) -> str:
    """The format's number."""
    begin, _, number = lines[0].strip(" \t\r").partition(f"# fingertip-{kind} ")
    if begin or not number:
        raise InputError(f'{path}:1: no {kind}; its first line must be "# fingertip-{kind} 1"')
    if number not in formats:
        raise InputError(f"{path}:1: {kind} format {number[:9]} is unknown; this tool reads format {' and '.join(formats)}")
    return number


def _metadata(line: str) -> tuple[str, str]:
    key, separator, value = line[1:].partition(":")
    return (key.strip(), value.strip()) if separator else ("", "")


class Scenario:
    """t_s[n], the TRUTH_COLUMNS and the tangential force as arrays[n], has_pull: the file has it, sensors_Pa[n][sensor], metadata."""

    def __init__(self, metadata: dict[str, str], header: list[str], table: Array, sensors: int) -> None:
        self.metadata = metadata
        self.t_s = table[:, 0]
        self.truth = {name: table[:, 1 + i] for i, name in enumerate(TRUTH_COLUMNS)}
        self.has_pull = "Qx_N" in header and "Qy_N" in header
        for name in ("Qx_N", "Qy_N"):
            self.truth[name] = table[:, header.index(name)] if name in header else np.zeros(len(table))
        self.sensors_Pa = table[:, 1 + len(TRUTH_COLUMNS) : 1 + len(TRUTH_COLUMNS) + sensors]

    def at(self, name: str, t_s: Any) -> Any:
        """The truth at these times, linear between rows."""
        return np.interp(t_s, self.t_s, self.truth[name])

    def is_on(self, name: str, t_s: Any) -> Any:
        """True where contact or slip is on at both rows around each time."""
        return self.at(name, t_s) > 1 - 1e-9

    def is_off(self, name: str, t_s: Any) -> Any:
        return self.at(name, t_s) < 1e-9

    def intervals(self, name: str) -> list[tuple[float, float]]:
        """(start_s, end_s) of every run of rows in which contact or slip is on."""
        on = np.concatenate(([0], (self.truth[name] > 0.5).astype(int), [0]))
        starts, ends = np.flatnonzero(np.diff(on) == 1), np.flatnonzero(np.diff(on) == -1) - 1
        return [(float(self.t_s[a]), float(self.t_s[b])) for a, b in zip(starts, ends)]


def read_scenario(path: Path) -> Scenario:
    lines = read_lines(path)
    _check_kind(path, lines, "scenario")
    metadata: dict[str, str] = {}
    header: list[str] | None = None
    rows: list[list[float]] = []
    sensors = 0
    for number, line in enumerate(lines[1:], 2):
        line = line.strip()
        if not line:
            continue
        if line.startswith("#"):
            key, value = _metadata(line)
            if key:
                metadata[key] = value
            continue
        cells = [cell.strip() for cell in line.split(",")]
        if header is None:
            header = cells
            sensors = sum(name.startswith("s") and name[1:].removesuffix("_Pa").isdigit() for name in cells)
            expected = ["t_s", *TRUTH_COLUMNS, *(f"s{k}_Pa" for k in range(sensors))]
            more = cells[len(expected) :]
            if cells[: len(expected)] != expected or not sensors or not set(more) <= set(OPTIONAL_COLUMNS) or len(set(more)) < len(more):
                raise InputError(
                    f"{path}:{number}: wrong header; it must be {','.join(['t_s', *TRUTH_COLUMNS])},s0_Pa,... "
                    f"and after the sensors, once each, any of {', '.join(OPTIONAL_COLUMNS)}"
                )
            continue
        if len(cells) != len(header):
            raise InputError(f"{path}:{number}: {len(cells)} columns where the header has {len(header)}; write the scenario again")
        row = [number_of(path, number, name, cell, False) for name, cell in zip(header, cells)]
        if row[0] < 0:
            raise InputError(f"{path}:{number}: t_s is {cells[0]}; time starts at 0")
        if rows and row[0] <= rows[-1][0]:
            raise InputError(f"{path}:{number}: t_s {cells[0]} does not increase; sort the rows by time")
        rows.append(row)
    if header is None or not rows:
        raise InputError(f"{path}: no rows; write the scenario again")
    return Scenario(metadata, header, np.array(rows), sensors)


def write_scenario(path: Path, metadata: Mapping[str, Any], columns: Mapping[str, Any]) -> None:
    """columns: t_s, the TRUTH_COLUMNS, and sensors_Pa[n][sensor]."""
    sensors = columns["sensors_Pa"].shape[1]
    header = ["t_s", *TRUTH_COLUMNS, *(f"s{k}_Pa" for k in range(sensors))]
    formats = ["%.3f", "%d", "%.4f", "%.4f", "%.5f", "%.3f", "%.3f", "%d"] + ["%.3f"] * sensors
    table = np.column_stack([columns["t_s"], *(columns[name] for name in TRUTH_COLUMNS), columns["sensors_Pa"]])
    row_format = ",".join(formats)
    text = ["# fingertip-scenario 1", *(f"# {key}: {value}" for key, value in metadata.items()), ",".join(header)]
    text += [(row_format % tuple(row)).replace("-0.0000", "0.0000") for row in table.tolist()]
    write_text(path, "\n".join(text) + "\n")


class Recording:
    """metadata, columns (name -> array[n], NaN where empty), sensors_Pa and tare_Pa [n][sensor] as the file has them (valid has those that are
    measurements), events and event_lines, their numbers in the file, end; packets, those that are no frame: (type, {field: text});
    line_numbers[n] of the rows in the file; time_us[n] on the recorder's clock, None in a recording of one. An array is made when it is asked for:
    an hour at 1300 frames a second takes 0.95 GB, and 0.04 more for each column that someone holds. Columns are not to be changed."""

    def __init__(self, reading: "_Reading", skipped_lines: int) -> None:
        assert reading.columns is not None
        self.path, self.metadata, self.packets, self.end = reading.path, reading.metadata, reading.packets, reading.end
        self.events, self.event_lines, self.skipped_lines = reading.events, reading.event_lines, skipped_lines
        self.columns, self._is_joint, self._sensors = reading.columns, reading.is_joint, reading.sensors

    @functools.cached_property
    def time_us(self) -> Array | None:
        return self.columns.take(["time_us"])[:, 0] if self._is_joint else None

    @functools.cached_property
    def line_numbers(self) -> npt.NDArray[np.int64]:
        return self.columns.take(["line"])[:, 0].astype(np.int64)

    @functools.cached_property
    def sensors_Pa(self) -> Array:
        return self.columns.take([f"s{k}_Pa" for k in range(self._sensors)])

    @functools.cached_property
    def tare_Pa(self) -> Array:
        return self.columns.take([f"tare{k}_Pa" for k in range(self._sensors)])

    __iter__ = None  # of columns, or of rows?

    def __len__(self) -> int:
        return self.columns.rows

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Array:
        if name not in self.columns:
            raise KeyError(f"a recording has no {name!r}, but columns by their names: {', '.join(self.columns)}")
        return self.columns[name]

    def __repr__(self) -> str:
        return f"<Recording {self.path}: {self.columns.rows} frames, ended: {self.end.get('reason', 'cut short')}>"

    @property
    def has_contact(self) -> npt.NDArray[np.bool_]:
        return ~np.isnan(self["flags"])

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each frame: all columns, the sensors as s0_Pa, ... and tare0_Pa, ... Needs pandas."""
        time_us = {} if self.time_us is None else {"time_us": self.time_us}
        return frame_of({**time_us, **self.columns}, self.sensors_Pa, self.tare_Pa)

    def _packets(self, wanted: str) -> list[dict[str, int]]:
        return [{name: int(text) for name, text in fields.items()} for kind, fields in self.packets if kind == wanted]

    def health(self) -> list[dict[str, int]]:
        """Counters and state as of each health packet: {field: number}."""
        return self._packets("health")

    @property
    def sync_edges(self) -> list[Edge]:
        """Those at the sync pin, in their order."""
        found = self._packets("sync")
        t_us = np.array([fields["t_us"] for fields in found], dtype=float)
        times_us = np.full(len(found), math.nan) if self.time_us is None or not len(self.time_us) else self._place(t_us)
        return [Edge(fields["t_us"], fields["number"], fields["level"], float(time_us)) for fields, time_us in zip(found, times_us)]

    def _place(self, t_us: Array) -> Array:
        """On the recorder's clock: between the rows as they are, beyond them by the nearest."""
        assert self.time_us is not None
        order = np.argsort(self["t_us"], kind="stable")
        placed: Array = t_us + np.interp(t_us, self["t_us"][order], (self.time_us - self["t_us"])[order])
        return placed

    def flag(self, bit: int) -> npt.NDArray[np.bool_]:
        found: npt.NDArray[np.bool_] = (np.nan_to_num(self["flags"]).astype(np.int64) & bit) != 0
        return found

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        """Where there is a fit, and no warning."""
        return self.flag(FIT_VALID) & ~self.flag(WARNINGS)


# Some 20 MB are read in a second: below this the wait is short.
WORTH_WAITING_bytes = 10_000_000
LATE_s = 1.0  # a row may come behind later ones by less than this
HEAD_WITHIN_bytes = 1 << 20  # of a recording that a spreadsheet has saved
BLOCK_bytes, ROWS_AT_ONCE = 500_000, 1024  # about the same; more take no less time each


# What may hold a recording: how it begins, and what makes a file of it that is read.
_OTHERS = {
    b"\x28\xb5\x2f\xfd": "packed as a whole by zstd: unzstd FILE",
    b"\x04\x22\x4d\x18": "packed as a whole by lz4: unlz4 FILE",
    b"\x1f\x8b\x08": "packed as a whole by gzip: gunzip FILE",
    b"BZh": "packed as a whole by bzip2: bunzip2 FILE",
    b"\xfd7zXZ": "packed as a whole by xz: unxz FILE",
    b"\x89MCAP0": "an MCAP file that was copied as text; copy it again, as bytes",
    b"PK\3\4": "packed as a ZIP archive: unzip FILE; a spreadsheet is to be saved as CSV",
    **dict.fromkeys((b"\x93NUMPY", b"MATLAB 5", b"\x89HDF"), "arrays of NumPy or MATLAB, no text; save them as CSV"),
    b"\xd0\xcf\x11\xe0": "a spreadsheet; save it as CSV",
    b"SQLite format 3": "a bag of ROS 2 in SQLite; ros2 bag convert makes one in MCAP, packed as it is now",
    **dict.fromkeys((b"\xff\xfe", b"\xfe\xff", b"#\0", b"\0#"), "text in UTF-16, an editor's or a spreadsheet's; save it as UTF-8"),
}


class Stretch(NamedTuple):
    """Whole lines one after the other, and their numbers."""

    numbers: range
    lines: bytes

    @property
    def texts(self) -> list[str]:
        """Without their ends."""
        return self.lines.decode("utf-8", "surrogateescape").split("\n")[:-1]


class _RecordingLines:
    """The lines of a recording, CSV or MCAP, one after the other: number, text without its end, whether it is torn; or Damaged."""

    def __init__(self, path: Path, progress: Callable[[float], None] | None = None, interval_s: tuple[float, float] | None = None) -> None:
        self.path, self.progress, self.interval_s = path, progress, interval_s
        first = next(iter(self), (1, "", True))
        if isinstance(first, Damaged):
            raise first
        self.format = _check_kind(path, [first[1]], "recording", ("1", "2"))

    def __iter__(self) -> Iterator[Line | Damaged]:
        for each in self.stretches():
            if isinstance(each, Stretch):
                for number, text in zip(each.numbers, each.texts):
                    yield number, text, False
            elif not isinstance(each, (Contacts, Skipped)):
                yield each

    def stretches(self) -> Iterator["Line | Damaged | Stretch | Contacts | Skipped"]:
        """The same, but rows, or what else is neither comment nor blank, many at a time."""
        try:
            with open(self.path, "rb") as file:
                start = file.read(HEAD_WITHIN_bytes)
                if start.startswith(MAGIC):
                    self.mcap = McapLineReader(self.path, self.progress, self.interval_s)
                    yield from self.mcap.items()
                    return
                check_kind_of_file(self.path, start)
                file.seek(3 if start.startswith(b"\xef\xbb\xbf") else 0)
                source: Any = file
                if (b"\r" in start and b"\n" not in start) or recorded.OF_SPREADSHEETS.match(start):
                    texts = file.read().decode("utf-8", "surrogateescape").split("\n" if b"\n" in start else "\r")
                    source = io.BytesIO("\n".join(restored(texts)).encode("utf-8", "surrogateescape"))
                size, read, shown, number = os.fstat(file.fileno()).st_size, 0, 0, 1
                while block := source.read(BLOCK_bytes):
                    block += source.readline(recorded.LINE_MOST_bytes)
                    read += len(block)
                    if self.progress and size > WORTH_WAITING_bytes and read - shown > size // 100:
                        shown = read
                        self.progress(read / size)
                    if b"\r" in block:
                        block = re.sub(rb"\r+(?=\n|\Z)", b"", block)
                    letters = np.frombuffer(block, np.uint8)
                    begins = np.concatenate(([0], np.flatnonzero(letters[:-1] == ord("\n")) + 1, [len(block)]))
                    torn = np.diff(begins) - 1 > recorded.LINE_MOST_bytes
                    torn[-1] |= not block.endswith(b"\n")
                    is_row = ~np.isin(letters[begins[:-1]], list(b'"# \t\n')) & ~torn
                    at = 0
                    for other in (*np.flatnonzero(~is_row).tolist(), len(is_row)):
                        if other > at:
                            yield Stretch(range(number + at, number + other), block[begins[at] : begins[other]])
                        if other < len(is_row):
                            text = block[begins[other] : begins[other + 1]].decode("utf-8", "surrogateescape")
                            text = text.removesuffix("\n").lstrip(" \t")
                            yield number + other, next(restored([text])) if text.startswith('"#') else text, bool(torn[other])
                        at = other + 1
                    number += len(is_row)
                    while block and not block.endswith(b"\n"):  # the rest of a line that is too long
                        block = source.readline(recorded.LINE_MOST_bytes)
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; check the path") from None


def check_kind_of_file(path: Path, start: bytes) -> None:
    for magic, what in _OTHERS.items():
        if start.startswith(magic):
            raise InputError(f"{path}: {what}")


def is_recording(path: Path) -> bool:
    with contextlib.suppress(OSError), open(path, "rb") as file:
        start = file.read(100)
        return start.startswith(MAGIC) or b"fingertip-recording" in start
    return False


def recorded_devices(path: Path) -> list[str]:
    """Serial numbers of the fingertips in a recording of several; of one, an empty list."""
    lines = _RecordingLines(path)
    if lines.format == "1":
        return []
    for each in lines:
        if not isinstance(each, Damaged) and each[1].startswith("# devices:"):
            return serials_of(each[1].split(":", 1)[1])
    raise InputError(f'{path}: no line "# devices: ..."; record again')


def _choose_device(path: Path, devices: list[str], wanted: str | None) -> int:
    """The number of the wanted fingertip."""
    for number, serial in enumerate(devices):
        if serial.lower() == wanted.lower() if wanted else len(devices) == 1:
            return number
    if wanted:
        raise InputError(f"{path}: no fingertip {wanted} in it; choose one of {' '.join(devices)}")
    raise InputError(f"{path}: holds several fingertips; choose one with " + " or ".join(f'serial="{serial}"' for serial in devices))


class _Reading:
    """A recording while it is read, line by line."""

    def __init__(
        self, path: Path, is_joint: bool, serial: str | None, columns: Collection[str] | None, interval_s: tuple[float, float] | None
    ) -> None:
        self.interval_s = interval_s
        self.clock, self.is_over = LogClock({}), False
        self.path, self.is_joint, self.serial, self.chosen = path, is_joint, serial, columns
        self.number: int | None = None  # of the wanted fingertip among several
        self.rows: Rows | None = None  # once there is a header
        self.metadata: dict[str, str] = {}
        self.events: list[str] = []
        self.event_lines: list[int] = []
        self.packets: list[tuple[str, dict[str, str]]] = []
        self.end: dict[str, str] = {}
        self.own_end: dict[str, str] = {}
        self.wanted: list[int] = []
        self.columns: Columns | None = None
        self.waits: list[tuple[int, str, float]] = []  # rows of a joint recording, or of MCAP: line, text, time_us
        self.sensors = self.info_sensors = self.devices = 0
        self.has_info = False

    def line(self, number: int, text: str) -> None:
        """Raises ValueError where it is damaged."""
        if not text.strip(" \t\r"):
            return
        if text.startswith("#"):
            self._comment(number, text.rstrip(" \t\r"))
        elif self.rows is None:
            self._header(text)
        elif not self.is_joint:
            self.waits.append((number, text, math.nan))
        else:
            cells = text.split(",", 2)
            if len(cells) < 3:
                raise ValueError("neither a comment nor a row of this recording")
            if cells[0] not in map(str, range(self.devices)):
                raise ValueError(f'no number of a fingertip: "{cells[0]}"')
            if cells[0] == str(self.number):
                self.waits.append((number, cells[2], recorded.number("time_us", cells[1])))

    def _header(self, text: str) -> None:
        if self.is_joint:
            if not text.startswith(JOINT_COLUMNS) or self.number is None:
                raise ValueError(UNKNOWN_HEADER)
            text = text.removeprefix(JOINT_COLUMNS)
        elif self.serial and self.metadata.get("serial"):
            _choose_device(self.path, [self.metadata["serial"]], self.serial)
        self.rows = Rows(text)
        self.clock = LogClock(self.metadata)
        self.sensors = self.rows.sensors if self.chosen is None else 0
        codes = {name: code for name, code in self.rows.codes.items() if self.chosen is None or name in self.chosen}
        self.wanted = [at for at, name in enumerate(self.rows.names) if name in codes]
        shown = list(codes)[: len(codes) - 2 * self.sensors]
        self.columns = Columns(codes, shown, [name for name in LATER_COLUMNS if name not in shown])

    def take_rows(self, damaged: Callable[[int, ValueError], None]) -> None:
        """Those that wait. damaged is called for each line that is."""
        if self.waits:
            numbers, texts, times_us = zip(*self.waits)
            self.waits.clear()
            lines = "".join(f"{text}\n" for text in texts).encode("utf-8", "surrogateescape")
            self.take(numbers, lines, damaged, times_us)

    def take(
        self, numbers: Sequence[int], lines: bytes, damaged: Callable[[int, ValueError], None], times_us: Sequence[float] = ()
    ) -> None:
        """Rows and their lines' numbers."""
        assert self.rows is not None
        at = 0
        for found in self.rows.tables(lines):
            if isinstance(found, ValueError):
                damaged(numbers[at], found)
                at += 1
                continue
            self.put(found, numbers[at : at + len(found)], times_us[at : at + len(found)])
            at += len(found)

    def take_contacts(self, numbers: list[int], devices: Array, times_us: Array, table: Array, times_s: list[float]) -> None:
        """Messages of an MCAP file, as McapLineReader.tables has them."""
        mine = np.flatnonzero(devices == self.number) if self.is_joint else slice(None)
        mine_us = times_us[mine].tolist() if self.is_joint else ()
        self.put(table[mine], np.array(numbers, "q")[mine].tolist(), mine_us, np.array(times_s)[mine])

    def _times_s(self, found: Array, times_us: Sequence[float]) -> Array:
        """Since the recording began, as the log times of an MCAP file."""
        if self.is_joint:
            return np.array(times_us) / 1e6
        t_us, runs = found[:, 0], np.flatnonzero(np.diff(found[:, 0]) < 0) + 1
        times_s = np.empty(len(t_us))
        for begin, end in zip([0, *runs.tolist()], [*runs.tolist(), len(t_us)]):
            begin_ns = self.clock.row(int(t_us[begin]), math.nan) if end > begin else 0
            times_s[begin:end] = (begin_ns - self.clock.begin_ns) / 1e9 + (t_us[begin:end] - t_us[begin]) / 1e6
            self.clock.row(int(t_us[end - 1]), math.nan)
        return times_s

    def put(self, found: Array, numbers: Sequence[int], times_us: Sequence[float], times_s: Array | None = None) -> None:
        if self.interval_s is not None and len(found):
            times_s = self._times_s(found, times_us) if times_s is None else times_s
            inside = np.flatnonzero((times_s >= self.interval_s[0]) & (times_s <= self.interval_s[1])).tolist()
            self.is_over = bool(times_s.min() > self.interval_s[1] + LATE_s)
            found, numbers = found[inside], [numbers[at] for at in inside]
            times_us = [times_us[at] for at in inside] if self.is_joint else ()
        if len(found) and not self.has_info:  # of a recorder that has written none
            self.has_info = True
            if 1 <= self.info_sensors <= SENSORS_MAX:
                self.packets.append(("info", {"sequence": "0", "t_us": "0"}))
        assert self.columns is not None
        self.columns.append(found[:, self.wanted], numbers, times_us)

    def _comment(self, line: int, text: str) -> None:
        if text.startswith("# fingertip-recording "):
            raise ValueError("another recording begins; give each by itself")
        key, separator, value = text[1:].partition(": ")
        if not separator:
            if text.startswith(("#N/A,", "#VALUE!,", "#REF!,", "#NAME?,", "#NUM!,", "#DIV/0!,")):
                raise ValueError("a spreadsheet's error in place of a number")
            return  # a person's note
        key = key.strip(" \t\r")
        if self.is_joint and "/" in key:
            number, _, key = key.partition("/")
            if number != str(self.number):
                return
            if key == "end":
                self.own_end = counts_of(value)
                return
        elif self.is_joint and key == "packet":
            raise ValueError("a packet without a fingertip's number")
        elif self.is_joint and key == "devices":
            serials, self.has_info, self.info_sensors = serials_of(value), False, 0
            self.number, self.devices = _choose_device(self.path, serials, self.serial), len(serials)
        if key == "end":
            counts = dict(pair.split("=", 1) for pair in value.split(" ") if "=" in pair) if self.is_joint else counts_of(value)
            self.end = {**counts, **self.own_end}
        elif key == "event":
            self.clock.event(value)
            self.events.append(value)
            self.event_lines.append(line)
        elif key == "packet":
            self._packet(value)
        else:
            judge_key(key, value)
            if self.rows is None:
                self.metadata[key] = value
            if key == "sensors":
                self.info_sensors = int(value)

    def _packet(self, text: str) -> None:
        kind, fields = packet_of(text)
        if kind == "info" and not 1 <= self.info_sensors <= SENSORS_MAX:
            raise ValueError('an info packet without "# sensors:" before it')
        self.has_info = self.has_info or kind == "info"
        self.packets.append((kind, fields))


def read_recording(
    path: Path,
    salvage: bool = False,
    serial: str | None = None,
    columns: Collection[str] | None = None,
    progress: Callable[[float], None] | None = None,
    from_s: float = 0.0,
    to_s: float = math.inf,
) -> Recording:
    """serial: of one of several fingertips. columns: only these (t_us and frame among them), for recordings
    that are too large to hold whole; then there are no sensors. progress: called now and then with the share that was read.
    from_s, to_s: only rows of this time since the recording began, and events and packets of what was read for them; MCAP files are
    read there by their index. Times are the log times of RECORDING.md."""
    if not 0 <= from_s <= to_s:
        raise InputError(f"from {from_s:g} s to {to_s:g} s is no time in a recording; give 0 or more, the earlier first")
    interval_s = None if (from_s, to_s) == (0, math.inf) else (from_s, to_s)
    np.empty(30_000_000, np.uint8)  # freed at once: glibc gives the memory of smaller arrays back no longer, only to ask for it again
    lines = _RecordingLines(path, progress, interval_s)
    reading = _Reading(path, lines.format == "2", serial, columns, interval_s)
    skipped = unplaced = skipped_to = 0
    last: int | None = None  # line's number

    def damaged(error: InputError, lost: int, is_comment: bool = False) -> None:
        nonlocal skipped, unplaced
        if not salvage or (reading.rows is None and not is_comment):
            raise error
        skipped += lost
        unplaced += isinstance(error, Damaged)  # the next line's number may show that more are lost

    def wrong(number: int, error: ValueError, is_comment: bool = False) -> None:
        what = str(error) if len(str(error)) <= 200 else f"{str(error)[:200]}..."
        what += "; use salvage=True to skip damaged lines" if reading.rows or is_comment else ""
        damaged(InputError(f"{path}:{number}: {what}"), 1, is_comment)

    def one(number: int, text: str, torn: bool) -> None:
        if text.startswith("#") or len(reading.waits) >= ROWS_AT_ONCE:
            reading.take_rows(wrong)
        try:
            if torn and text:
                raise ValueError("the line is longer than a megabyte" if len(text) > recorded.LINE_MOST_bytes else "the last line is torn")
            reading.line(number, text)
        except ValueError as error:
            reading.take_rows(wrong)
            wrong(number, error, text.startswith("#"))

    def follow(number: int, to: int) -> None:
        nonlocal last, unplaced
        if last is not None and number > max(last + 1, skipped_to):
            reading.take_rows(wrong)
            lost = number - last - 1
            damaged(InputError(f"{path}:{number}: {lost} lines are missing before it; use salvage=True to go on"), max(0, lost - unplaced))
            unplaced = 0
        last = to

    for each in lines.stretches():
        if reading.is_over:
            break
        if isinstance(each, (Damaged, Contacts, Skipped)):
            reading.take_rows(wrong)
        if isinstance(each, Skipped):
            skipped_to = each.to
            continue
        if isinstance(each, Damaged):
            damaged(each, 1)
        elif isinstance(each, Contacts):
            assert reading.rows is not None
            for found in lines.mcap.tables(each, reading.rows, reading.devices):
                if isinstance(found, Damaged):
                    damaged(found, 1)
                else:
                    follow(found[0][0], found[0][-1])
                    reading.take_contacts(*found)
        elif isinstance(each, Stretch):
            if reading.rows is None or reading.is_joint:
                for number, text in zip(each.numbers, each.texts):
                    one(number, text, False)
            else:
                reading.take_rows(wrong)
                reading.take(each.numbers, each.lines, wrong)
            last = each.numbers[-1]
        elif last is None:
            last = 1
        else:
            follow(each[0], each[0])
            one(*each)
    reading.take_rows(wrong)
    if reading.rows is None:
        raise InputError(f"{path}: no header line; record again")
    if interval_s and not reading.end:
        reading.end = {"reason": "part"}
    return Recording(reading, skipped)


def restart_rows(t: npt.NDArray[Any], frame: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """The rows, but the first, that a run of a fingertip begins with: the time or the frame's number steps back. Numbers
    wrap (PROTOCOL.md)."""
    steps = np.mod(np.diff(frame.astype(np.int64)), 2**32)
    return np.flatnonzero((np.diff(t) < 0) | (steps >= 2**31)) + 1


def undamaged(path: Path, salvage: bool) -> Iterator[Line]:
    for each in _RecordingLines(path):
        if not isinstance(each, Damaged):
            yield each
        elif not salvage:
            raise each


def read_run(path: Path | None) -> dict[str, Any]:
    """The emulator's report; without a file an empty one."""
    if path is None:
        return {}
    try:
        run = json.loads("\n".join(read_lines(path)))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}: no JSON ({error.msg}); run the emulator again") from None
    if not isinstance(run, dict):
        raise InputError(f"{path}: no run report; give the emulator's --report file")
    return run
