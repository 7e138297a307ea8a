"""Writes recordings as `fingertip record` does (host_tools/libfingertip/recording.hpp has the format); read_recording reads them."""
import contextlib
import datetime
import math
import os
import threading
from collections.abc import Callable, Iterable, Mapping
from types import TracebackType
from typing import Any

import numpy as np

from .errors import InputError
from .files import CONTACT_COLUMNS, RAW_COLUMNS, TANGENTIAL_COLUMNS
from .frames import Q10
from .wire import Acknowledgement, Calibration, Contact, Health, Info, LineStatistics, Packet, PadProfile, Raw

_QUANTITIES = [name for name in (*CONTACT_COLUMNS, *TANGENTIAL_COLUMNS) if name not in ("sequence", "flags")]


def _shortest(value: float) -> str:
    """The shortest text that reads back the same binary32; nothing for NaN."""
    if math.isnan(value):
        return ""
    return str(np.float32(value)).removesuffix(".0")


def _cell(value: Any) -> str:
    if value is None:
        return "0"
    return _shortest(value) if isinstance(value, float) else str(value)


def _number(value: Any) -> str:
    """Of an info packet: what the firmware has not is 0 there."""
    return _cell(value) or "0"


def _list(values: Iterable[float]) -> str:
    return " ".join(map(_number, values))


def _calibration_metadata(calibration: Calibration) -> dict[str, str]:
    return {"calibration_date_s": str(calibration.date_s), "calibration_placements": str(calibration.placements),
            "force_scale": _number(calibration.force_scale), "force_scale_sd": _number(calibration.force_scale_sd),
            "gains": _list(calibration.gains), "gain_sds": _list(calibration.gain_sds)}


def _pad_metadata(pad: PadProfile) -> dict[str, str]:
    scalars = ("thickness_mm", "overhang_mm", "spread_mm2", "spread_sd_mm2", "force_ratio", "tangential_scale", "tangential_scale_sd", "from_touch")
    pairs = {"pad_shares": pad.normal[0::2], "pad_sds_mm": pad.normal[1::2], "pad_moments_mm": pad.tangential[0::2],
             "pad_moment_sds_mm": pad.tangential[1::2]}
    edges = {f"pad_{name}": getattr(pad, name) for name in pad._fields if name.startswith("edge_")}
    return {**{f"pad_{name}": _number(getattr(pad, name)) for name in scalars},
            **{name: _list(values) for name, values in (pairs | edges).items()}}


def info_metadata(info: Info) -> dict[str, str]:
    """An info packet as the comments of a recording."""
    scalars = ("sensors", "capabilities", "rate_mHz", "measured_rate_mHz", "osr", "temperature_interval_ms", "slip_threshold_mm", "slip_window_ms",
               "fit_iterations", "streams", "pitch_mm", "prior_sigma_mm", "prior_width_mm", "location_limit_mm", "stored")
    return {"serial": info.serial, "board": info.board, "scene": info.scene, "firmware": ".".join(map(str, info.firmware)), "git": info.git,
            **{name: _number(getattr(info, name)) for name in scalars}, "x_mm": _list(info.x_mm), "y_mm": _list(info.y_mm),
            **(_calibration_metadata(info.calibration) if info.calibration else {}), **(_pad_metadata(info.pad) if info.pad else {})}


class RecordingWriter:
    """A recording of one fingertip, from its packets in the order in which they came.

    Lines are written whole. The file is there from the beginning; a recorder that is killed leaves one without an end line, which
    every reader takes. replace: over a file that exists. raw_expected: a contact waits for the raw packet of its frame. Raises InputError.
    """

    def __init__(self, path: "str | os.PathLike[str]", info: Info, *, replace: bool = False, raw_expected: bool = True,
                 extra: Mapping[str, str] | None = None) -> None:
        self.path = os.fspath(path)
        self.frames = 0
        self._sensors = info.sensors
        self._raw_expected = raw_expected
        self._pending: Packet | None = None
        self._metadata: dict[str, str] = {}
        self._first_us: int | None = None
        self._last_us = self._before_us = 0
        self._on_close: Callable[[], LineStatistics] | None = None
        self._closed = False
        self._failure: InputError | None = None
        self._lock = threading.RLock()
        try:
            self._file = open(self.path, "wb" if replace else "xb", buffering=0)
        except FileExistsError:
            raise InputError(f"{self.path}: exists; give replace=True or another name") from None
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; choose another place") from None
        try:
            self._head(info, extra or {})
        except InputError:
            self.abandon()
            raise
        self._no_contact = [""] * (len(CONTACT_COLUMNS) + len(TANGENTIAL_COLUMNS))
        self._no_raw = [""] * (len(RAW_COLUMNS) + 2 * self._sensors)

    def _head(self, info: Info, extra: Mapping[str, str]) -> None:
        started = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
        self._line("# fingertip-recording 1")
        for key, value in {"recorded_by": "fingertip-tactile", "started_utc": started, **extra}.items():
            self._comment(key, "".join(c if c.isprintable() else "?" for c in value))
        self._info(info)
        sensors = range(self._sensors)
        self._line(",".join(["t_us", "frame", *CONTACT_COLUMNS, *TANGENTIAL_COLUMNS, *RAW_COLUMNS, *(f"s{k}_Pa" for k in sensors),
                             *(f"tare{k}_Pa" for k in sensors)]))

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _line(self, text: str) -> None:
        line = text.encode("utf-8") + b"\n"
        try:
            while line:
                line = line[self._file.write(line):]
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None

    def _comment(self, key: str, value: str) -> None:
        self._line(f"# {key}: {value}")

    def _info(self, info: Info) -> None:
        now = info_metadata(info)
        for key, value in now.items():
            if self._metadata.get(key) != value:
                self._comment(key, value)
        self._metadata = now

    def _packet_line(self, kind: str, packet: Packet, fields: Mapping[str, Any]) -> None:
        pairs = {"sequence": packet.sequence, "t_us": packet.t_us, **fields}
        self._comment("packet", kind + "".join(f" {name}={_cell(value)}" for name, value in pairs.items()))

    def packet(self, packet: Packet) -> None:
        """Of any type; commands are left out."""
        body = packet.body
        with self._lock:
            if self._closed:
                return
            if isinstance(body, Contact):
                self._write_pending()
                if self._raw_expected:
                    self._pending = packet
                else:
                    self._row(packet, None)
            elif isinstance(body, Raw):
                if body.sensors != self._sensors:
                    raise InputError(f"{self.path}: the fingertip now has {body.sensors} sensors instead of {self._sensors}")
                pending = self._pending
                if pending and pending.t_us == packet.t_us and isinstance(pending.body, Contact) and pending.body.frame == body.frame:
                    self._pending = None
                    self._row(pending, packet)
                else:
                    self._write_pending()
                    self._row(None, packet)
            elif isinstance(body, (Health, Info, Acknowledgement)):
                self._write_pending()
                if isinstance(body, Info):
                    self._info(body)
                    self._packet_line("info", packet, {})
                else:
                    self._packet_line("ack" if isinstance(body, Acknowledgement) else "health", packet, body._asdict())

    def event(self, text: str) -> None:
        """Something else that happened: "gone", "back"."""
        with self._lock:
            self._write_pending()
            self._comment("event", text)

    def _write_pending(self) -> None:
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
            cells += [str(raw.sequence), str(read.flags), str(read.valid), str(read.saturated), str(read.doubtful), f"{read.temperature_cC / 100:.2f}"]
            cells += [f"{value / Q10:.4f}" for value in (*read.readings[0::2], *read.readings[1::2])]
        else:
            cells += self._no_raw
        self._line(f"{t_us},{frame}," + ",".join(cells))
        self.frames += 1
        if self._first_us is not None and t_us < self._last_us:
            self._before_us += self._last_us - self._first_us
            self._first_us = None
        self._first_us = t_us if self._first_us is None else self._first_us
        self._last_us = t_us

    @property
    def seconds(self) -> float:
        """Device time of all rows, over all runs."""
        return (self._before_us + (0 if self._first_us is None else self._last_us - self._first_us)) / 1e6

    def on_close(self, count: Callable[[], LineStatistics]) -> None:
        """What the line counted, told when the writer is closed."""
        self._on_close = count

    def abandon(self) -> None:
        """Closes without an end line."""
        with self._lock:
            self._closed = True
            with contextlib.suppress(OSError):
                self._file.close()

    def fail(self, error: InputError) -> None:
        """Closes without an end line; close() will raise this."""
        self._failure = error
        self.abandon()

    def close(self, reason: str = "closed", statistics: LineStatistics | None = None) -> None:
        """Writes the end line. Does nothing the second time. Raises InputError where the disk was full, then or before."""
        with self._lock:
            failure, self._failure = self._failure, None
            if failure:
                raise failure
            if self._closed:
                return
            self._write_pending()
            if statistics is None:
                statistics = self._on_close() if self._on_close else LineStatistics()
            self._line(f"# end: reason={reason} frames={self.frames} seconds={self.seconds:.6f} {statistics.text()}")
            self._closed = True
            try:
                self._file.close()
            except OSError as error:
                raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None
