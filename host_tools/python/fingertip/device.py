"""One fingertip: its frames, its settings, its state."""
import collections
import contextlib
import math
import os
import threading
from collections.abc import Callable, Iterator
from types import TracebackType

from . import discovery, host_time, line, wire
from .clock import NO_CLOCK, ClockEstimate, ClockExchange, ClockFit, host_now_us
from .errors import (
    BadValueError, FingertipError, GoneError, InputError, NoAnswerError, NoFingertipError, NoFrameError, NotNowError, OtherFingertipError, OtherVersionError,
    RefusedError, RefusedValueError, UnknownCommandError)
from .frames import Block, Frame
from .line import Capability, Result, Streams
from .recording import Recorder, RecordingWriter
from .transport import Transport, open_way
from .wire import Acknowledgement, Body, Contact, Crash, Health, Info, LineStatistics, Raw

ATTEMPTS = 3
ANSWER_TIMEOUT_s = 1.0
EXCHANGE_INTERVAL_us = 500_000  # the two clocks are compared so often
FIRST_EXCHANGES = 8
POLL_s = 0.05
RETURN_INTERVAL_s = 0.25  # a port that has gone is looked for so often
NEWER_VERSIONS = 2  # a fingertip does not answer a version that it does not speak: it is asked in these too
FRAMES_MAX = 1 << 20

REFUSALS: dict[int, tuple[type[RefusedError], str]] = {
    Result.UNKNOWN_COMMAND: (UnknownCommandError, "its firmware does not know it"),
    Result.OUT_OF_RANGE: (RefusedValueError, "out of range"),
    Result.NOT_NOW: (NotNowError, "not now"),
}


def _in_range(name: str, value: float, span: tuple[float, float], unit: str) -> None:
    if not span[0] <= value <= span[1]:  # false for NaN
        raise BadValueError(f"{name} {value:g} is out of range; give {span[0]:g} to {span[1]:g} {unit}")


class Fingertip:
    """A fingertip that streams, in the background, from the moment it is opened.

        with Fingertip() as fingertip:
            for frame in fingertip:
                if frame.trusted:
                    print(frame.x_mm, frame.y_mm, frame.force_N)

    port: a serial port; serial: a serial number, where there are several fingertips; neither: the only one, or the one that
    FINGERTIP_PORT names. share: True is only by the socket of `fingertip serve`, False only by the port, None the socket where there is one.
    streams: what it sends, by default all that its firmware can. reconnect: wait for one that is unplugged to come back (frame.run then
    counts up, and settings that were not kept are the firmware's own again); else GoneError ends everything. buffer_frames: how many wait for
    a program that is late, 16384 being twelve seconds at the highest rate; more are dropped, the oldest first, and counted (overrun_frames).
    latency_ms: how long bytes may wait to be read together, 0 to 1000; less costs more of the processor.
    timeout_s: in which a frame has to come, or NoFrameError is raised; slower rates have the time that they need.

    Raises FingertipError: NoFingertipError, SeveralFingertipsError, PortError (NoSuchPortError, PermissionDeniedError, PortInUseError, ...),
    OtherFingertipError, OtherVersionError, NoAnswerError, BadValueError. All methods may be called from any thread; one takes the frames.
    """

    def __init__(self, port: "str | os.PathLike[str] | None" = None, *, serial: str | None = None, share: bool | None = None,
                 streams: Streams | None = None, reconnect: bool = False, buffer_frames: int = 16384, latency_ms: float = 8.0,
                 timeout_s: float = 3.0) -> None:
        _in_range("buffer_frames", buffer_frames, (1, FRAMES_MAX), "frames")
        _in_range("latency_ms", latency_ms, (0, 1000), "ms")
        _in_range("timeout_s", timeout_s, (0.01, 3600), "s")
        self._settle_s = latency_ms / 1000
        self._reconnect = reconnect
        self._timeout_s = timeout_s
        self._serial = serial
        self._share = share
        self._decoder = wire.Decoder()
        self._clock_fit = ClockFit()
        self._estimate = NO_CLOCK
        self._queue: collections.deque[Frame] = collections.deque()
        self._buffer_frames = int(buffer_frames)
        self._latest: Frame | None = None
        self._latest_s = 0.0
        self._health: Health | None = None
        self._pending: tuple[int, int, Contact] | None = None
        self._run = 0
        self._is_returning = False
        self._overrun_frames = 0
        self._streams = Streams.NONE
        self._wants_stream = False
        self._sequence = 0
        self._eager_until_us = 0
        self._next_exchange_us = 0
        self._error: FingertipError | None = None
        self._closing = False
        self._changed = host_time.condition()
        self._sending = threading.Lock()
        self._one_command = threading.Lock()
        self._ack: Acknowledgement | None = None
        self._answer: Body | None = None
        self._awaited: tuple[int, int] | None = None  # type of the command, sequence of its first attempt
        self._listeners: list[Callable[[], None]] = []
        self._recorder: Recorder | None = None
        self._thread: threading.Thread | None = None

        self._transport, self._info = self._open(discovery.choose(None if port is None else os.fspath(port), serial, share))
        try:
            self._start_streams(streams)
        except BaseException:
            self.close()
            raise

    # Opening

    def _open(self, ways: list[discovery.Found]) -> tuple[Transport, Info]:
        """The way to the wanted one; each is asked who it is."""
        others: list[str] = []
        for way in ways:
            self._decoder = wire.Decoder()
            self._clock_fit = ClockFit()
            self._estimate = NO_CLOCK
            self._error = None
            try:
                self._transport = open_way(way.port, way.share_socket)
                self._thread = host_time.thread(self._read_on, name="fingertip", daemon=True)
                self._thread.start()
                info = self._ask_info()
            except FingertipError as error:
                self._stop_thread()
                if len(ways) == 1:
                    raise
                others.append(str(error))
                continue
            except BaseException:
                self._stop_thread()
                raise
            if self._serial is None or info.serial.lower() == self._serial.lower():
                return self._transport, info
            self._stop_thread()
            if len(ways) == 1:
                raise OtherFingertipError(f"{self._transport.description}: is fingertip {info.serial}, not {self._serial}")
            others.append(info.serial)
        raise NoFingertipError(f"no fingertip {self._serial} here, there are: " + ", ".join(others))

    def _stop_thread(self) -> None:
        self._closing = True
        if self._thread:
            if self._thread is not threading.current_thread():
                self._thread.join()
            self._transport.close()
            self._thread = None
        self._closing = False

    def _start_streams(self, streams: Streams | None) -> None:
        possible = Streams.HEALTH
        if self._info.capabilities & Capability.FIT:
            possible |= Streams.CONTACT
        if self._info.capabilities & Capability.RAW_STREAM:
            possible |= Streams.RAW
        if streams is not None and streams & ~possible:
            raise BadValueError(f"streams {streams!r}: firmware of scene {self._info.scene} has {possible!r}")
        for _ in range(FIRST_EXCHANGES):
            self._exchange(wire.SetStreams(0))
        self.set_streams(possible if streams is None else streams)

    def __enter__(self) -> "Fingertip":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the streams and gives the port free. Whoever waits for a frame is told that there are no more."""
        if self._closing:
            return
        with contextlib.suppress(FingertipError):
            if self._error is None:
                self._send(wire.SetStreams(0))
        self._closing = True
        if self._thread and self._thread is not threading.current_thread():
            self._thread.join()
        self._transport.close()
        self._finish_recording("closed")
        self._tell()

    # What it is

    @property
    def serial(self) -> str:
        """Sixteen hexadecimal digits."""
        return self._info.serial

    @property
    def description(self) -> str:
        """The port or the socket."""
        return self._transport.description

    @property
    def info(self) -> Info:
        """As of the last time it was read: when it was opened, after each change, by read_info."""
        return self._info

    @property
    def health(self) -> Health | None:
        """The last one that it sent, once a second."""
        return self._health

    @property
    def statistics(self) -> LineStatistics:
        """What the line lost and damaged since it was opened: dropped_packets and the others."""
        return self._decoder.statistics + LineStatistics()

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
        return self._estimate

    @property
    def clock_jumps(self) -> int:
        return self._clock_fit.jumps

    # Frames

    def __iter__(self) -> Iterator[Frame]:
        """Every frame, in order, beginning with the oldest that nobody took. Ends when it is closed; raises GoneError, NoFrameError."""
        while True:
            frame = self._take_frame()
            if frame is None:
                return
            yield frame

    @property
    def patience_s(self) -> float:
        """In which a frame has to come: timeout_s, or two and a half frames where the rate is that low."""
        return max(self._timeout_s, 2500 / self._info.rate_mHz if self._info.rate_mHz else 0)

    @property
    def is_closed(self) -> bool:
        return self._closing

    @property
    def is_returning(self) -> bool:
        """It has gone, and is waited for (reconnect)."""
        return self._is_returning

    def take_one(self) -> Frame | None:
        """The oldest frame that nobody took, if there is one, without waiting. Raises GoneError once there are none any more."""
        with contextlib.suppress(IndexError):
            return self._queue.popleft()
        if self._error:
            raise self._error
        return None

    def _take_frame(self) -> Frame | None:
        """Nothing: it is closed."""
        try:
            return self._queue.popleft()
        except IndexError:
            pass
        self._wait(lambda: bool(self._queue), None)
        return self._queue.popleft() if self._queue else None

    def _wait(self, condition: Callable[[], bool], timeout_s: float | None) -> None:
        """Until it holds or this is closed."""
        patience_s = self.patience_s if timeout_s is None else timeout_s
        with self._changed:
            end_s = host_time.now_s() + patience_s
            while not condition() and not self._closing:
                if self._error:
                    raise self._error
                if self._is_returning:
                    end_s = host_time.now_s() + patience_s
                left_s = end_s - host_time.now_s()
                if left_s <= 0:
                    raise NoFrameError(f"{self.description}: no frame in {patience_s:g} s")
                self._changed.wait(min(left_s, 0.2))

    def latest(self, timeout_s: float | None = None) -> Frame:
        """The newest frame, at once unless it is older than that; takes none away from iteration. Raises GoneError, NoFrameError."""
        if self._error:
            raise self._error
        patience_s = self.patience_s if timeout_s is None else timeout_s
        self._wait(lambda: self._latest is not None and host_time.now_s() - self._latest_s <= patience_s, timeout_s)
        latest = self._latest
        if latest is None or self._closing:
            raise GoneError(f"{self.description}: closed")
        return latest

    def read_block(self, frames: int | None = None, seconds: float | None = None) -> Block:
        """The next frames as arrays: so many (1 to 1048576), or those of so many seconds of device time (above 0). Fewer if it is closed."""
        if (frames is None) == (seconds is None):
            raise BadValueError("give frames or seconds")
        if frames is not None:
            _in_range("frames", frames, (1, FRAMES_MAX), "frames")
        elif seconds is not None:
            _in_range("seconds", seconds, (1e-6, 86400), "s")
        taken: list[Frame] = []
        while frames is None or len(taken) < frames:
            frame = self._take_frame()
            if frame is None:
                break
            taken.append(frame)
            if seconds is not None and (frame.t_us - taken[0].t_us >= seconds * 1e6 or frame.run != taken[0].run):
                break
        return Block(taken)

    def blocks(self, frames: int) -> Iterator[Block]:
        """Arrays of so many frames each, without end; the last one may be shorter."""
        while True:
            block = self.read_block(frames)
            if len(block):
                yield block
            if len(block) < frames:
                return

    def on_frames(self, listener: Callable[[], None]) -> None:
        """Called by the reading thread after frames came and when it ends; must be quick."""
        self._listeners.append(listener)

    def on_packets(self, listener: Callable[[wire.Packet | None, bytes], None]) -> None:
        """Told by the reading thread each packet from now on, with its frame on the line without the delimiter; must be quick. Nothing
        instead of a packet: the line was interrupted, and sequence numbers begin anew."""
        self._decoder.listener = listener

    # Commands. Each returns once the fingertip has done it, and raises RefusedError (NotNowError, RefusedValueError, UnknownCommandError),
    # NoAnswerError or GoneError.

    def tare(self, force: bool = False) -> None:
        """Measures the zero anew over the next 16 frames, in which no contact is reported; nothing may touch the pad.

        While a contact is reported it is refused (NotNowError): what presses would become the zero. force: tares all the same.
        """
        self._command(wire.Tare(int(force)))

    def set(self, *, rate_Hz: float | None = None, osr: int | None = None, slip_threshold_mm: float | None = None,
            slip_window_ms: int | None = None, prior_sigma_mm: float | None = None, prior_width_mm: float | None = None,
            location_limit_mm: float | None = None, keep: bool | None = None) -> Info:
        """Changes what is given, until power-off; keep True: from now on start with all present settings, False: with the firmware's own.

        rate_Hz: 0.1 to 2000, 0 is as fast as the sensors allow. osr: the sensors' oversampling, 256, 512, ... 8192. slip_threshold_mm:
        0.01 to 50. slip_window_ms: 5 to 1000. prior_sigma_mm: the width to expect of a contact, 0.5 to 100, 0 is none; prior_width_mm:
        its standard deviation, 0.01 to 100, 0.5 if not given. location_limit_mm: UNCERTAIN above it, 0.01 to 100.
        Raises BadValueError before anything is sent. Returns how it is set now.
        """
        commands: list[Body] = []
        if rate_Hz is not None:
            if rate_Hz != 0:
                _in_range("rate_Hz", rate_Hz, (line.RATE_mHz.least / 1000, line.RATE_mHz.most / 1000), "Hz, or 0 for as fast as possible")
            commands.append(wire.SetRate(round(rate_Hz * 1000)))
        if osr is not None:
            if osr not in line.OSR:
                raise BadValueError(f"osr {osr} is out of range; give one of {', '.join(map(str, line.OSR))}")
            commands.append(wire.SetOsr(osr))
        if slip_threshold_mm is not None or slip_window_ms is not None:
            threshold_mm = self._info.slip_threshold_mm if slip_threshold_mm is None else slip_threshold_mm
            window_ms = self._info.slip_window_ms if slip_window_ms is None else slip_window_ms
            if window_ms is None or math.isnan(threshold_mm) and slip_threshold_mm is None:
                raise BadValueError(f"firmware of scene {self._info.scene} knows no slip")
            _in_range("slip_threshold_mm", threshold_mm, line.SLIP_THRESHOLD_mm, "mm")
            _in_range("slip_window_ms", window_ms, line.SLIP_WINDOW_ms, "ms")
            commands.append(wire.SetSlip(threshold_mm, int(window_ms)))
        if prior_sigma_mm is not None:
            width_mm = (0.0 if prior_sigma_mm == 0 else line.PRIOR_WIDTH_DEFAULT_mm) if prior_width_mm is None else prior_width_mm
            if prior_sigma_mm != 0 or width_mm != 0:
                _in_range("prior_sigma_mm", prior_sigma_mm, line.PRIOR_SIGMA_mm, "mm, or 0 for none")
                _in_range("prior_width_mm", width_mm, line.PRIOR_WIDTH_mm, "mm")
            commands.append(wire.SetPrior(prior_sigma_mm, width_mm))
        elif prior_width_mm is not None:
            raise BadValueError("prior_width_mm needs prior_sigma_mm")
        if location_limit_mm is not None:
            _in_range("location_limit_mm", location_limit_mm, line.LOCATION_LIMIT_mm, "mm")
            commands.append(wire.SetLocationLimit(location_limit_mm))
        if keep is not None:
            commands.append(wire.Keep(int(keep)))
        if not commands:
            raise BadValueError("nothing to set")
        for command in commands:
            self._command(command)
        return self.read_info()

    def set_streams(self, streams: Streams) -> None:
        """What it sends from now on; NONE is silence."""
        if not 0 <= streams <= Streams.ALL:
            raise BadValueError(f"streams {int(streams)} is out of range; give 0 to {int(Streams.ALL)}")
        before, self._streams = (self._streams, self._wants_stream), Streams(streams)
        self._wants_stream = True  # the first frame comes with the answer
        try:
            self._command(wire.SetStreams(int(streams)))
        except FingertipError:
            self._streams, self._wants_stream = before
            raise

    def read_info(self) -> Info:
        """Who it is and how it is set, as of now."""
        self._info = self._ask_info()
        return self._info

    def read_health(self) -> Health:
        """Its counters, as of now."""
        answer = self._exchange(wire.AskHealth(), Health)
        assert isinstance(answer, Health)
        return answer

    def read_crash(self) -> Crash | None:
        """How its firmware last came to an end since power-on; nothing: it did not. Firmware of before raises UnknownCommandError."""
        answer = self._exchange(wire.AskCrash(), Crash)
        assert isinstance(answer, Crash)
        return answer if answer.kind else None

    # Recording

    def record(self, path: "str | os.PathLike[str]", replace: bool = False) -> RecordingWriter:
        """Writes everything that it says from now on, as `fingertip record` does, until the writer is closed:

            with fingertip.record("press.csv"):
                ...

        Frames are there for iteration at the same time. Raises InputError.
        """
        if self._recorder:
            raise BadValueError("it is being recorded already")
        writer = RecordingWriter(path, self._info, replace=replace, raw_expected=bool(self._streams & Streams.RAW),
                                 extra={"port": self.description}, count=lambda: self.detach(writer) - first)
        first = self.attach(writer)
        return writer

    def attach(self, recorder: Recorder) -> LineStatistics:
        """It is told every packet from now on, by the reading thread; what the line has counted until now. Raises BadValueError."""
        with self._changed:
            if self._recorder:
                raise BadValueError("it is being recorded already")
            self._recorder = recorder
            return self.statistics

    def detach(self, recorder: Recorder) -> LineStatistics:
        """It is told no more; what the line has counted until now."""
        with self._changed:
            if self._recorder is recorder:
                self._recorder = None
            return self.statistics

    def _finish_recording(self, reason: str) -> None:
        recorder = self._recorder
        if recorder:
            try:
                recorder.close(reason)
            except InputError as error:
                recorder.fail(error)

    # The conversation

    def _send(self, body: Body) -> int:
        """Its sequence number."""
        with self._sending:
            sequence = self._sequence
            self._sequence = sequence + 1 & 0xFFFF
            self._eager_until_us = host_now_us() + round(ANSWER_TIMEOUT_s * 1e6)
            self._transport.write(wire.encode(wire.Packet(sequence, host_now_us(), body)))
        return sequence

    def _look_for_other_versions(self) -> None:
        for version in range(1, wire.VERSION + NEWER_VERSIONS + 1):
            if version != wire.VERSION:
                with self._sending:
                    self._transport.write(wire.encode(wire.Packet(0, 0, wire.AskInfo()), version))

    def _command(self, body: Body) -> None:
        self._exchange(body)

    def _ask_info(self) -> Info:
        answer = self._exchange(wire.AskInfo(), Info)
        assert isinstance(answer, Info)
        return answer

    def _exchange(self, body: Body, answer_type: type[Body] | None = None) -> Body | None:
        """Sends until the acknowledgement and, if one is named, the answer came; the answer."""
        name = type(body).__name__
        number = next(number for number, each in wire.TYPES.items() if each is type(body))
        with self._one_command:
            versions = self._decoder.statistics.version_errors
            try:
                for attempt in range(ATTEMPTS):
                    with self._changed:
                        self._check_open()
                        if attempt == 0:
                            self._ack = self._answer = None
                            self._awaited = (number, self._sequence)
                    self._send(body)
                    if attempt > 0:
                        self._look_for_other_versions()
                    if self._await_answer(answer_type):
                        break
                    if self._decoder.statistics.version_errors > versions:
                        raise OtherVersionError(f"{self.description}: speaks protocol version {self._decoder.other_version}, not {wire.VERSION}")
                else:
                    raise NoAnswerError(f"{self.description}: no answer to {name}")
            finally:
                self._awaited = None
                self._eager_until_us = 0
            ack, answer = self._ack, self._answer
        if ack is not None and ack.result != Result.DONE:
            kind, why = REFUSALS.get(ack.result, (RefusedError, f"result {ack.result}"))
            raise kind(f"the fingertip refused {name}: {why}", ack.result)
        return answer

    def _check_open(self) -> None:
        if self._error:
            raise self._error
        if self._closing or self._thread is None:
            raise GoneError(f"{self.description}: closed")
        if self._is_returning:
            raise GoneError(f"{self.description}: vanished, and is not back yet")

    def _await_answer(self, answer_type: type[Body] | None) -> bool:
        end_s = host_time.now_s() + ANSWER_TIMEOUT_s
        with self._changed:
            while True:
                if self._ack and (self._ack.result != Result.DONE or answer_type is None or isinstance(self._answer, answer_type)):
                    return True
                self._check_open()
                left_s = end_s - host_time.now_s()
                if left_s <= 0:
                    return False
                self._changed.wait(left_s)

    # The reading thread

    def _tell(self) -> None:
        with self._changed:
            self._changed.notify_all()
        for listener in self._listeners:
            listener()

    def _read_on(self) -> None:
        while not self._closing:
            try:
                now_us = host_now_us()
                if self._wants_stream and now_us >= self._next_exchange_us:
                    # Repeating the wish is an exchange, and wakes a device that restarted unnoticed.
                    self._next_exchange_us = now_us + EXCHANGE_INTERVAL_us
                    self._send(wire.SetStreams(int(self._streams)))
                data = self._transport.read(POLL_s, 0.0 if now_us < self._eager_until_us else self._settle_s)
                if data:
                    self._take(self._decoder.feed(data))
            except GoneError as error:
                if self._closing:
                    return
                if not self._reconnect or self._thread is None or not self._wants_stream:
                    self._error = error
                else:
                    self._return()
                self._finish_pending()
                self._tell()
                if self._error:
                    self._finish_recording("gone")
                    return

    def _finish_pending(self) -> None:
        frames: list[Frame] = []
        self._flush(frames)
        self._keep(frames)

    def _return(self) -> None:
        """Looks for the port until it is back or this is closed."""
        self._is_returning = True
        self._finish_pending()
        self._latest = None
        self._note("gone")
        self._tell()
        self._transport.close()
        while not self._closing:
            host_time.sleep(RETURN_INTERVAL_s)
            with contextlib.suppress(FingertipError):
                self._transport = self._reopened()
                break
        else:
            return
        self._decoder.restart()
        self._clock_fit = ClockFit()
        self._estimate = NO_CLOCK
        try:
            self._greet()
        except GoneError:
            return  # once more, from the reading loop

    def _reopened(self) -> Transport:
        """It may have another name now."""
        with contextlib.suppress(FingertipError):
            return open_way(*discovery.choose(None, self._info.serial, self._share)[0][1:])
        by_socket = self._transport.description.endswith(".sock")
        return open_way("" if by_socket else self._transport.description, self._transport.description if by_socket else "")

    def _greet(self) -> None:
        """Who is back? Streams only once that is known."""
        next_s, found = 0.0, None
        while found is None and not self._closing:
            if host_time.now_s() >= next_s:
                next_s = host_time.now_s() + ANSWER_TIMEOUT_s
                self._send(wire.AskInfo())
            for packet in self._decoder.feed(self._transport.read(POLL_s, 0.0)):
                self._record(packet)
                if isinstance(packet.body, Info):
                    found = packet.body
                elif isinstance(packet.body, Acknowledgement):
                    self._relate(packet.t_us, packet.body)
        if found is None:
            return
        if found.serial != self._info.serial:
            self._error = OtherFingertipError(f"{self.description}: is fingertip {found.serial}, not {self._info.serial}")
            return
        self._info = found
        self._run += 1
        self._is_returning = False
        self._next_exchange_us = 0
        self._note("back")

    def _relate(self, t_us: int, ack: Acknowledgement) -> None:
        now_us = host_now_us()
        if 0 < ack.host_time_us <= now_us:
            self._clock_fit.add(ClockExchange(ack.host_time_us, now_us, t_us))
            self._estimate = self._clock_fit.estimate or NO_CLOCK

    def _record(self, packet: wire.Packet) -> None:
        recorder = self._recorder
        if recorder:
            try:
                recorder.packet(packet)
            except InputError as error:  # the disk is full: the recording ends, the frames go on
                self._recorder = None
                recorder.fail(error)

    def _note(self, event: str) -> None:
        recorder = self._recorder
        if recorder:
            try:
                recorder.event(event)
            except InputError as error:
                self._recorder = None
                recorder.fail(error)

    def _take(self, packets: list[wire.Packet]) -> None:
        frames: list[Frame] = []
        news, wanted, both = False, self._wants_stream, int(self._streams) & 3 == 3
        for packet in packets:
            sequence, t_us, body = packet
            if self._recorder:
                self._record(packet)
            if isinstance(body, (Raw, Contact)) and not wanted:
                continue  # asked for by somebody before
            if isinstance(body, Raw):
                pending = self._pending
                if pending and pending[2].frame == body.frame and pending[1] == t_us:
                    self._pending = None
                    frames.append(Frame(self._info.serial, self._run, t_us, pending[2], body, pending[0], sequence, self._estimate))
                else:
                    self._flush(frames)
                    frames.append(Frame(self._info.serial, self._run, t_us, None, body, -1, sequence, self._estimate))
            elif isinstance(body, Contact):
                if self._pending:
                    self._flush(frames)
                if both:
                    self._pending = (sequence, t_us, body)
                else:
                    frames.append(Frame(self._info.serial, self._run, t_us, body, None, sequence, -1, self._estimate))
            else:
                news = True
                self._take_other(t_us, body)
        self._keep(frames)
        if frames or news:
            self._tell()

    def _flush(self, frames: list[Frame]) -> None:
        """A contact whose raw packet did not come."""
        if self._pending:
            sequence, t_us, contact = self._pending
            self._pending = None
            frames.append(Frame(self._info.serial, self._run, t_us, contact, None, sequence, -1, self._estimate))

    def _keep(self, frames: list[Frame]) -> None:
        if frames:
            self._latest, self._latest_s = frames[-1], host_time.now_s()
            self._queue.extend(frames)
            with contextlib.suppress(IndexError):
                while len(self._queue) > self._buffer_frames:
                    self._queue.popleft()
                    self._overrun_frames += 1

    def _take_other(self, t_us: int, body: Body) -> None:
        if isinstance(body, Acknowledgement):
            self._relate(t_us, body)
            awaited = self._awaited
            if awaited is None:
                self._eager_until_us = 0
            elif body.command == awaited[0] and body.command_sequence - awaited[1] & 0xFFFF < self._sequence - awaited[1] & 0xFFFF:
                self._ack = body
        else:
            if isinstance(body, Health):
                self._health = body
            if self._ack:
                self._answer = body


def list_fingertips() -> list[discovery.Found]:
    """Those that can be opened, without asking them: serial number as far as it is known, port, share_socket."""
    return discovery.find()
