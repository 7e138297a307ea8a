"""One fingertip: its frames, its settings, its state."""

import collections
import contextlib
import itertools
import math
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from . import discovery, host_time, wire
from .clock import ClockEstimate, host_now_us
from .closing import Closing
from .conversation import ANSWER_TIMEOUT_s, Conversation
from .errors import BadValueError, FingertipError, GoneError, InputError, NoFingertipError, NoFrameError, OtherFingertipError
from .frames import Block, Edge, Frame
from .line import SETTINGS, Capability, Settable, Setting, Streams
from .recording import Recorder, RecordingWriter
from .transport import Transport, open_endpoint
from .wire import Acknowledgement, Body, Contact, Crash, Health, Info, LineStatistics, Raw, SyncEdge

EXCHANGE_INTERVAL_us = 500_000  # the two clocks are compared so often
FIRST_EXCHANGES = 8
RETURN_INTERVAL_s = 0.25  # a port that has gone is searched for at this interval
FRAMES_MAX = 1 << 20
EDGES_KEPT = 65536


def _in_range(name: str, value: float, span: tuple[float, float], unit: str) -> None:
    if not span[0] <= value <= span[1]:  # false for NaN
        raise BadValueError(f"{name} {value:g} is out of range; give {span[0]:g} to {span[1]:g} {unit}")


def block_end(frames: int | None, seconds: float | None) -> Callable[[list[Frame]], bool]:
    """Whether these frames are a whole block. Raises BadValueError."""
    if (frames is None) == (seconds is None):
        raise BadValueError("give frames or seconds")
    if seconds is None:
        _in_range("frames", frames or 0, (1, FRAMES_MAX), "frames")
        return lambda taken: len(taken) >= (frames or 0)
    _in_range("seconds", seconds, (1e-6, 86400), "s")
    return lambda taken: bool(taken) and (taken[-1].t_us - taken[0].t_us >= seconds * 1e6 or taken[-1].run != taken[0].run)


Given = Mapping[str, float | str | None]


def _number(setting: Setting, value: float | str | None) -> float | None:
    """Of what is given, which may be a word."""
    if value is None or not (setting.words or isinstance(value, str)):
        return value
    if value not in setting.words:
        raise BadValueError(f"{setting.argument} {value!r} is unknown; give {setting.give}")
    return (*setting.choices, 0)[setting.words.index(str(value))]


def _wanted(setting: Setting, given: Given, now: Info) -> float:
    """What is given, else its default, else as it is now."""
    value = _number(setting, given[setting.argument])
    if value is not None and setting.needs and given[setting.needs] is None:
        raise BadValueError(f"{setting.argument} needs {setting.needs}")
    if value is None and setting.default is not None:
        return 0.0 if given[setting.needs] == 0 else setting.default
    if value is None:
        value = getattr(now, setting.info)
        if value is None or math.isnan(value):
            raise BadValueError(f"firmware of scene {now.scene} knows no {setting.of}")
        value /= setting.per
    return value


def setting_commands(given: Given, now: Info) -> list[Body]:
    """Of the arguments of Fingertip.set; None: not given. Raises BadValueError."""
    commands: list[Body] = []
    for command, group in itertools.groupby(SETTINGS, lambda setting: setting.command):
        settings = list(group)
        if all(given[setting.argument] is None for setting in settings):
            continue
        values = [_wanted(setting, given, now) for setting in settings]
        zeros = not any(values)
        for setting, value in zip(settings, values, strict=True):
            in_range = setting.least <= value <= setting.most and (not setting.choices or value in setting.choices)  # NaN is in no range
            if not in_range and not (zeros and setting.zero):
                raise BadValueError(f"{setting.argument} {value:g} is out of range; give {setting.give}")
        fields: dict[str, Any] = {
            setting.field: round(value * setting.per) if setting.whole else value for setting, value in zip(settings, values, strict=True)
        }
        commands.append(command(**fields))
    return commands


class Fingertip(Settable, Closing):
    """A fingertip that streams, in the background, from the moment it is opened.

        with Fingertip() as fingertip:
            for frame in fingertip:
                if frame.trusted:
                    print(frame.x_mm, frame.y_mm, frame.force_N)

    port: a serial port, or sim:, which `fingertip simulate` simulates; serial: a serial number, where there are several fingertips; neither: the only one, or the one that
    FINGERTIP_PORT names. share: True is only by the socket of `fingertip serve`, False only by the port, None the socket where there is one.
    streams: what it sends, by default all that its firmware can. reconnect: wait for one that is unplugged to come back (frame.run then
    counts up, and settings that were not kept are the firmware's own again); else GoneError ends everything. buffer_frames: how many wait for
    a program that is late, 16384 being twelve seconds at the highest rate; more are dropped, the oldest first, and counted (overrun_frames).
    latency_ms: how long bytes may wait to be read together, 0 to 1000; less costs more of the processor.
    timeout_s: in which a frame has to come, or NoFrameError is raised; slower rates have the time that they need.

    Raises FingertipError: NoFingertipError, SeveralFingertipsError, PortError (NoSuchPortError, PermissionDeniedError, PortInUseError, ...),
    OtherFingertipError, OtherVersionError, NoAnswerError, BadValueError. All methods may be called from any thread; one takes the frames.
    """

    def __init__(
        self,
        port: "str | os.PathLike[str] | None" = None,
        *,
        serial: str | None = None,
        share: bool | None = None,
        streams: Streams | None = None,
        reconnect: bool = False,
        buffer_frames: int = 16384,
        latency_ms: float = 8.0,
        timeout_s: float = 3.0,
    ) -> None:
        _in_range("buffer_frames", buffer_frames, (1, FRAMES_MAX), "frames")
        _in_range("latency_ms", latency_ms, (0, 1000), "ms")
        _in_range("timeout_s", timeout_s, (0.01, 3600), "s")
        if not (serial is None or isinstance(serial, str)):
            raise BadValueError(f"serial {serial!r} is no text; give sixteen hexadecimal digits in quotes")
        self._settle_s = latency_ms / 1000
        self._reconnect = reconnect
        self._timeout_s = timeout_s
        self._serial = serial
        self._share = share
        self._queue: collections.deque[Frame] = collections.deque()
        self._buffer_frames = int(buffer_frames)
        self._edges: collections.deque[Edge] = collections.deque(maxlen=EDGES_KEPT)
        self._latest: Frame | None = None
        self._latest_s = 0.0
        self._health: Health | None = None
        self._pending: tuple[int, int, Contact] | None = None
        self._run = 0
        self._overrun_frames = 0
        self._streams = Streams.NONE
        self._wants_stream = False
        self._next_exchange_us = 0
        self._listeners: list[Callable[[], None]] = []
        self._recorder: Recorder | None = None
        self._thread: threading.Thread | None = None

        self._line, self._info = self._open(discovery.choose(None if port is None else os.fspath(port), serial, share))
        try:
            self._start_streams(streams)
        except BaseException:
            self.close()
            raise

    # Opening

    def _open(self, ways: list[discovery.Found]) -> tuple[Conversation, Info]:
        """With the wanted one; each is asked who it is."""
        others: list[str] = []
        for way in ways:
            opened = False
            try:
                self._line = Conversation(open_endpoint(way.port, way.share_socket))
                opened = True
                self._thread = host_time.thread(self._read_on, name="fingertip", daemon=True)
                self._thread.start()
                info = self._line.ask(wire.AskInfo(), Info)
                if self._serial is None or info.serial.lower() == self._serial.lower():
                    return self._line, info
                others.append(info.serial)
                raise OtherFingertipError(f"{self.description}: is fingertip {info.serial}, not {self._serial}")
            except BaseException as error:
                if opened:
                    self._stop()
                if len(ways) == 1 or not isinstance(error, FingertipError):
                    raise
                if not isinstance(error, OtherFingertipError):
                    others.append(str(error))
        raise NoFingertipError(f"no fingertip {self._serial} here, there are: " + ", ".join(others))

    def _stop(self) -> None:
        self._line.is_closed = True
        if self._thread and self._thread is not threading.current_thread():
            self._thread.join()
        self._line.transport.close()

    def _start_streams(self, streams: Streams | None) -> None:
        possible = Streams.HEALTH
        for capability, stream in ((Capability.FIT, Streams.CONTACT), (Capability.RAW_STREAM, Streams.RAW)):
            possible |= stream if self._info.capabilities & capability else 0
        if streams is not None and streams & ~possible:
            raise BadValueError(f"streams {streams!r}: firmware of scene {self._info.scene} has {possible!r}")
        for _ in range(FIRST_EXCHANGES):
            self._line.exchange(wire.SetStreams(0))
        self.set_streams(possible if streams is None else streams)

    def close(self) -> None:
        """Ends the streams and gives the port free. A waiting reader learns that there are no more frames."""
        if self._line.is_closed:
            return
        with contextlib.suppress(FingertipError):
            if self._line.error is None:
                self._line.send(wire.SetStreams(0))
        self._stop()
        self._to_recorder(lambda recorder: recorder.close("closed"))
        self._notify()

    # What it is

    def __repr__(self) -> str:
        return f"<Fingertip {self.serial} on {self.info.board}, {self.description}{', closed' if self.is_closed else ''}>"

    @property
    def serial(self) -> str:
        """Sixteen hexadecimal digits."""
        return self._info.serial

    @property
    def description(self) -> str:
        """The port or the socket."""
        return self._line.description

    @property
    def info(self) -> Info:
        """As of the last time it was read: when it was opened, after each change, by read_info."""
        return self._info

    @property
    def health(self) -> Health | None:
        """The last one that it sent, once a second."""
        return self._health

    @property
    def sync_edges(self) -> list[Edge]:
        """Those at the sync pin since it was opened, the last 65536 at most, while set(sync="in") or "second" is set. A gap in their numbers is
        edges that came too fast."""
        return list(self._edges)

    @property
    def statistics(self) -> LineStatistics:
        """What the line lost and damaged since it was opened: dropped_packets and the others."""
        return self._line.statistics + LineStatistics()

    @property
    def overrun_frames(self) -> int:
        """Frames that this program did not take in time."""
        return self._overrun_frames

    @property
    def run(self) -> int:
        """How often it came back (reconnect)."""
        return self._run

    @property
    def clock(self) -> ClockEstimate:
        """The fingertip's clock in terms of the host's, with its bound."""
        return self._line.estimate

    @property
    def clock_jumps(self) -> int:
        return self._line.clock_jumps

    # Frames

    def __iter__(self) -> Iterator[Frame]:
        """Every frame, in order, beginning with the oldest that was not taken. Ends when it is closed; raises GoneError, NoFrameError."""
        while (frame := self._take_frame()) is not None:
            yield frame

    @property
    def patience_s(self) -> float:
        """In which a frame has to come: timeout_s, or two and a half frames where the rate is that low."""
        return max(self._timeout_s, 2500 / self._info.rate_mHz if self._info.rate_mHz else 0)

    @property
    def is_closed(self) -> bool:
        return self._line.is_closed

    @property
    def is_returning(self) -> bool:
        """It has gone, and is waited for (reconnect)."""
        return self._line.is_interrupted

    def take_one(self) -> Frame | None:
        """The oldest frame that was not taken, if there is one, without waiting. Raises GoneError once there are none any more."""
        with contextlib.suppress(IndexError):
            return self._queue.popleft()
        if self._line.error:
            raise self._line.error
        return None

    def _take_frame(self) -> Frame | None:
        """Nothing: it is closed."""
        with contextlib.suppress(IndexError):
            return self._queue.popleft()
        self._wait(lambda: bool(self._queue), None)
        return self._queue.popleft() if self._queue else None

    def _wait(self, condition: Callable[[], bool], timeout_s: float | None) -> None:
        """Until it holds or this is closed."""
        patience_s = self.patience_s if timeout_s is None else timeout_s
        with self._line.changed:
            end_s = host_time.now_s() + patience_s
            while not condition() and not self._line.is_closed:
                if self._line.error:
                    raise self._line.error
                if self._line.is_interrupted:
                    end_s = host_time.now_s() + patience_s
                left_s = end_s - host_time.now_s()
                if left_s <= 0:
                    raise NoFrameError(f"{self.description}: no frame in {patience_s:g} s")
                self._line.changed.wait(min(left_s, 0.2))

    def latest(self, timeout_s: float | None = None) -> Frame:
        """The newest frame, at once unless it is older than that; takes none away from iteration. Raises GoneError, NoFrameError."""
        if timeout_s is not None:
            _in_range("timeout_s", timeout_s, (0, 3600), "s")
        if self._line.error:
            raise self._line.error
        patience_s = self.patience_s if timeout_s is None else timeout_s
        self._wait(lambda: self._latest is not None and host_time.now_s() - self._latest_s <= patience_s, timeout_s)
        latest = self._latest
        if latest is None or self._line.is_closed:
            raise GoneError(f"{self.description}: closed")
        return latest

    def read_block(self, frames: int | None = None, seconds: float | None = None) -> Block:
        """The next frames as arrays: their number (1 to 1048576), or those of this time by the device (above 0). Fewer if it is closed or gone;
        the call after that raises GoneError. What was taken when another error or Ctrl-C ends it is there for the next call, or for iteration."""
        is_whole = block_end(frames, seconds)
        taken: list[Frame] = []
        try:
            while not is_whole(taken) and (frame := self._take_frame()) is not None:
                taken.append(frame)
        except BaseException as error:
            if not (taken and isinstance(error, GoneError)):
                self.give_back(taken)
                raise
        return Block(taken)

    def give_back(self, frames: list[Frame]) -> None:
        """The last that were taken, in their order."""
        self._queue.extendleft(reversed(frames))

    def blocks(self, frames: int) -> Iterator[Block]:
        """Arrays of this number of frames each, without end; the last one may be shorter. Raises GoneError after that, NoFrameError."""
        while len(block := self.read_block(frames)):
            yield block

    def on_frames(self, listener: Callable[[], None]) -> None:
        """Called by the reading thread after frames came and when it ends; must be quick."""
        self._listeners.append(listener)

    def on_packets(self, listener: Callable[[wire.Packet | None, bytes], None]) -> None:
        """Called by the reading thread with each packet from now on, with its frame on the line without the delimiter; must be quick. Nothing
        instead of a packet: the line was interrupted, and sequence numbers begin again."""
        self._line.decoder.listener = listener

    # Commands. Each returns once the fingertip has done it, and raises RefusedError (NotNowError, RefusedValueError, UnknownCommandError),
    # NoAnswerError or GoneError.

    def tare(self, force: bool = False) -> None:
        """Measures the zero again over the next 16 frames, in which no contact is reported; nothing may touch the pad.

        While a contact is reported it is refused (NotNowError): the contact would become the zero. force: tares all the same.
        """
        self._line.exchange(wire.Tare(int(force)))

    def _set(self, given: dict[str, float | str | None], keep: bool | None) -> Info:
        commands = setting_commands(given, self._info)
        if keep is not None:
            commands.append(wire.Keep(int(keep)))
        if not commands:
            raise BadValueError("nothing to set")
        for command in commands:
            self._line.exchange(command)
        return self.read_info()

    def set_streams(self, streams: Streams) -> None:
        """What it sends from now on; NONE is silence."""
        if not 0 <= streams <= Streams.ALL:
            raise BadValueError(f"streams {int(streams)} is out of range; give 0 to {int(Streams.ALL)}")
        before, self._streams = (self._streams, self._wants_stream), Streams(streams)
        self._wants_stream = True  # the first frame comes with the answer
        try:
            self._line.exchange(wire.SetStreams(int(streams)))
        except FingertipError:
            self._streams, self._wants_stream = before
            raise

    def read_info(self) -> Info:
        """Who it is and how it is set, as of now."""
        self._info = self._line.ask(wire.AskInfo(), Info)
        return self._info

    def read_health(self) -> Health:
        """Its counters, as of now."""
        return self._line.ask(wire.AskHealth(), Health)

    def read_crash(self) -> Crash | None:
        """How its firmware last came to an end since power-on; nothing: it did not. Firmware of before raises UnknownCommandError."""
        answer = self._line.ask(wire.AskCrash(), Crash)
        return answer if answer.kind else None

    # Recording

    def record(self, path: "str | os.PathLike[str]", replace: bool = False) -> RecordingWriter:
        """Writes all its packets from now on, as `fingertip record` does, until the writer is closed:

            with fingertip.record("press.csv"):
                ...

        Frames are there for iteration at the same time. Raises InputError.
        """
        self.check_recordable()
        raw, port = bool(self._streams & Streams.RAW), {"port": self.description}
        writer = RecordingWriter(path, self._info, replace=replace, raw_expected=raw, extra=port, count=lambda: self.detach(writer) - first)
        first = self.attach(writer)
        return writer

    def check_recordable(self) -> None:
        """Raises GoneError, BadValueError."""
        if self._line.error or self.is_closed:
            raise self._line.error or GoneError(f"{self.description}: closed")
        if self._recorder:
            raise BadValueError("it is being recorded already")

    def attach(self, recorder: Recorder) -> LineStatistics:
        """It gets every packet from now on, by the reading thread; what the line has counted until now. Raises BadValueError."""
        with self._line.changed:
            self.check_recordable()
            self._recorder = recorder
            return self.statistics

    def detach(self, recorder: Recorder) -> LineStatistics:
        """It gets no more packets; what the line has counted until now."""
        with self._line.changed:
            if self._recorder is recorder:
                self._recorder = None
            return self.statistics

    def _to_recorder(self, pass_on: Callable[[Recorder], None]) -> None:
        recorder = self._recorder
        if recorder:
            try:
                pass_on(recorder)
            except InputError as error:  # the disk is full: the recording ends, the frames go on
                self._recorder = None
                recorder.fail(error)

    # The reading thread

    def _notify(self) -> None:
        with self._line.changed:
            self._line.changed.notify_all()
        for listener in self._listeners:
            listener()

    def _read_on(self) -> None:
        while not self._line.is_closed:
            try:
                now_us = host_now_us()
                if self._wants_stream and now_us >= self._next_exchange_us:
                    # Repeating the wish is an exchange, and wakes a device that restarted unnoticed.
                    self._next_exchange_us = now_us + EXCHANGE_INTERVAL_us
                    self._line.send(wire.SetStreams(int(self._streams)))
                self._take(self._line.read(self._settle_s))
            except GoneError as error:
                if self._line.is_closed:
                    return
                if not self._reconnect or not self._wants_stream:
                    self._line.error = error
                else:
                    self._return()
                self._finish_pending()
                self._notify()
                if self._line.error:
                    self._to_recorder(lambda recorder: recorder.close("gone"))
                    return

    def _finish_pending(self) -> None:
        frames: list[Frame] = []
        self._flush(frames)
        self._keep(frames)

    def _return(self) -> None:
        """Searches for the port until it is back or this is closed."""
        self._line.is_interrupted = True
        self._finish_pending()
        self._latest = None
        self._to_recorder(lambda recorder: recorder.event("gone"))
        self._notify()
        self._line.transport.close()
        while not self._line.is_closed:
            host_time.sleep(RETURN_INTERVAL_s)
            with contextlib.suppress(FingertipError):
                self._line.go_on(self._reopened())
                break
        else:
            return
        try:
            self._greet()
        except GoneError:
            return  # once more, from the reading loop

    def _reopened(self) -> Transport:
        """It may have another name now."""
        with contextlib.suppress(FingertipError):
            return open_endpoint(*discovery.choose(None, self._info.serial, self._share)[0][1:])
        by_socket = self._line.description.endswith(".sock")
        return open_endpoint("" if by_socket else self._line.description, self._line.description if by_socket else "")

    def _greet(self) -> None:
        """Who is back? Streams only once that is known."""
        next_s, found = 0.0, None
        while found is None and not self._line.is_closed:
            if host_time.now_s() >= next_s:
                next_s = host_time.now_s() + ANSWER_TIMEOUT_s
                self._line.send(wire.AskInfo())
            for packet in self._line.read(0.0):
                self._to_recorder(lambda recorder, packet=packet: recorder.packet(packet))  # type: ignore[misc]
                if isinstance(packet.body, Info):
                    found = packet.body
                elif isinstance(packet.body, Acknowledgement):
                    self._line.relate(packet.t_us, packet.body)
        if found is None:
            return
        if found.serial != self._info.serial:
            self._line.error = OtherFingertipError(f"{self.description}: is fingertip {found.serial}, not {self._info.serial}")
            return
        self._info = found
        self._run += 1
        self._line.is_interrupted = False
        self._next_exchange_us = 0
        self._to_recorder(lambda recorder: recorder.event("back"))

    def _take(self, packets: list[wire.Packet]) -> None:
        frames: list[Frame] = []
        news, wanted, both = False, self._wants_stream, int(self._streams) & 3 == 3
        for packet in packets:
            sequence, t_us, body = packet
            if self._recorder:
                self._to_recorder(lambda recorder, packet=packet: recorder.packet(packet))  # type: ignore[misc]
            if isinstance(body, (Raw, Contact)) and not wanted:
                continue  # asked for by somebody before
            if isinstance(body, Raw):
                pending = self._pending
                if pending and pending[2].frame == body.frame and pending[1] == t_us:
                    self._pending = None
                    self._add(frames, t_us, pending[2], body, pending[0], sequence)
                else:
                    self._flush(frames)
                    self._add(frames, t_us, None, body, -1, sequence)
            elif isinstance(body, Contact):
                self._flush(frames)
                if both:
                    self._pending = (sequence, t_us, body)
                else:
                    self._add(frames, t_us, body, None, sequence, -1)
            elif isinstance(body, SyncEdge):
                news = True
                self._edges.append(Edge(t_us, body.number, body.level, self._line.estimate.host_at(t_us)))
            else:
                news = True
                if isinstance(body, Health):
                    self._health = body
                self._line.heard(t_us, body)
        self._keep(frames)
        if frames or news:
            self._notify()

    def _flush(self, frames: list[Frame]) -> None:
        """A contact whose raw packet did not come."""
        if self._pending:
            sequence, t_us, contact = self._pending
            self._pending = None
            self._add(frames, t_us, contact, None, sequence, -1)

    def _add(self, frames: list[Frame], t_us: int, contact: Contact | None, raw: Raw | None, sequence: int, raw_sequence: int) -> None:
        frames.append(Frame(self._info.serial, self._run, t_us, contact, raw, sequence, raw_sequence, self._line.estimate))

    def _keep(self, frames: list[Frame]) -> None:
        if frames:
            self._latest, self._latest_s = frames[-1], host_time.now_s()
            self._queue.extend(frames)
            with contextlib.suppress(IndexError):
                while len(self._queue) > self._buffer_frames:
                    self._queue.popleft()
                    self._overrun_frames += 1


def list_fingertips() -> list[discovery.Found]:
    """Those that can be opened, without asking them: serial number as far as it is known, port, share_socket."""
    return discovery.find()
