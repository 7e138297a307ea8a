"""Several fingertips on one clock."""

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from . import discovery, host_time
from .clock import host_now_us
from .closing import Closing
from .device import Fingertip
from .errors import BadValueError, FingertipError, InputError, NoFingertipError, NoFrameError
from .frames import Frame
from .line import Capability
from .recording import JointRecordingWriter
from .wire import LineStatistics, Packet

LATE_us = 250_000  # a fingertip that is later than this is not waited for


class _Side:
    """One fingertip's recorder, which is a part of a joint one."""

    def __init__(self, writer: JointRecordingWriter, number: int, fingertip: Fingertip) -> None:
        self._writer = writer
        self._number = number
        self._fingertip = fingertip

    def packet(self, packet: Packet) -> None:
        self._writer.packet(self._number, packet, self._fingertip.clock, self._fingertip.clock_jumps)

    def event(self, text: str) -> None:
        self._writer.event(self._number, text)

    def fail(self, error: InputError) -> None:
        self._writer.fail(error)

    def close(self, reason: str = "closed") -> None:
        """The others go on."""


class Fingertips(Closing):
    """Several fingertips, whose frames come in order of host_us, the host's clock that they share.

        with Fingertips() as fingertips:
            for frame in fingertips:
                print(frame.serial, frame.host_us, frame.force_N)

    ports: serial ports; serials: serial numbers; neither: all that are there. options: as for Fingertip, for each of them. by_serial has
    the fingertips themselves. A frame is out of order only if it came more than a quarter of a second late, or where a clock jumped
    (Fingertip.clock_jumps). Raises what Fingertip raises, and BadValueError if one is named twice.
    """

    def __init__(
        self, ports: "Sequence[str | os.PathLike[str]] | None" = None, *, serials: Sequence[str] | None = None, **options: Any
    ) -> None:
        if ports is not None and serials is not None:
            raise BadValueError("give ports or serials")
        if isinstance(serials, str) or isinstance(ports, (str, os.PathLike)):
            raise BadValueError("give a list of ports or of serials; Fingertip opens one")
        self._news = host_time.event()
        self._opened: dict[str, Fingertip] = {}
        self._stack = contextlib.ExitStack()
        wanted: list[dict[str, Any]]
        if serials is not None:
            wanted = [{"serial": serial} for serial in serials]
        elif ports is not None:
            wanted = [{"port": port} for port in ports]
        else:
            wanted = [{"port": found.port} if found.port else {"serial": found.serial} for found in discovery.find()]
        names = [str(name).lower() for name in (*(serials or ()), *(ports or ()))]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise BadValueError(f"{twice} is named twice")
        if not wanted:
            raise NoFingertipError("no fingertip found")
        with self._stack:
            for each in wanted:
                fingertip = self._stack.enter_context(Fingertip(**each, **options))
                self._opened[fingertip.serial] = fingertip
                fingertip.on_frames(self._news.set)
            self._stack = self._stack.pop_all()

    @property
    def by_serial(self) -> Mapping[str, Fingertip]:
        return MappingProxyType(self._opened)

    def close(self) -> None:
        self._stack.close()

    def record(self, path: "str | os.PathLike[str]", replace: bool = False) -> JointRecordingWriter:
        """Writes all their packets from now on, on one clock, as `fingertip record --all` does, until the writer is closed.
        Raises InputError."""
        fingertips = list(self._opened.values())
        sides: list[_Side] = []
        first: list[LineStatistics] = []

        def count() -> list[LineStatistics]:
            return [tip.detach(side) - before for tip, side, before in zip(fingertips, sides, first)]

        for tip in fingertips:
            tip.check_recordable()
        infos = [tip.info for tip in fingertips]
        raw = all(info.capabilities & Capability.RAW_STREAM for info in infos)
        writer = JointRecordingWriter(path, infos, replace=replace, count=count, raw_expected=raw)
        try:
            for number, tip in enumerate(fingertips):
                sides.append(_Side(writer, number, tip))
                first.append(tip.attach(sides[-1]))
        except FingertipError:
            count()
            writer.abandon()
            raise
        return writer

    def latest(self) -> dict[str, Frame]:
        """The newest frame of each, by serial number. Raises GoneError, NoFrameError."""
        return {serial: fingertip.latest() for serial, fingertip in self._opened.items()}

    def __iter__(self) -> Iterator[Frame]:
        """Every frame of all. Ends when they are closed; raises GoneError and NoFrameError of any of them."""
        fingertips = list(self._opened.values())
        heads: list[Frame | None] = [None] * len(fingertips)
        heard_s = [host_time.now_s()] * len(fingertips)
        try:
            while True:
                self._news.clear()
                for i, fingertip in enumerate(fingertips):
                    if heads[i] is None:
                        heads[i] = fingertip.take_one()
                        if heads[i] or fingertip.is_returning:
                            heard_s[i] = host_time.now_s()
                        elif host_time.now_s() - heard_s[i] > fingertip.patience_s:
                            raise NoFrameError(f"{fingertip.description}: no frame in {fingertip.patience_s:g} s")
                there = [(frame.host_us, i) for i, frame in enumerate(heads) if frame]
                if there:
                    host_us, first = min(there)
                    frame = heads[first]
                    if frame and (len(there) == len(fingertips) or host_now_us() - host_us > LATE_us):
                        heads[first] = None
                        yield frame
                        continue
                if not there and all(fingertip.is_closed for fingertip in fingertips):
                    return
                if not self._news.is_set():
                    self._news.wait(0.02)
        finally:  # those that were not taken are there for the next iteration
            for fingertip, head in zip(fingertips, heads):
                fingertip.give_back([head] if head else [])
