"""The packets that a program and a fingertip exchange on one line, from its opening to its end."""

import threading
from typing import TypeVar

from . import host_time, wire
from .clock import NO_CLOCK, ClockExchange, ClockFit, host_now_us
from .errors import FingertipError, GoneError, NoAnswerError, NotNowError, OtherVersionError
from .errors import RefusedError, RefusedValueError, UnknownCommandError
from .line import Result
from .transport import Transport
from .wire import Acknowledgement, Body, Crash, Health, Info, LineStatistics, Packet

ATTEMPTS = 3
ANSWER_TIMEOUT_s = 1.0
POLL_s = 0.05
NEWER_VERSIONS = 2  # a fingertip does not answer a version that it does not speak: it is asked in these too

Answer = TypeVar("Answer", Info, Health, Crash)
REFUSALS: dict[int, tuple[type[RefusedError], str]] = {
    Result.UNKNOWN_COMMAND: (UnknownCommandError, "its firmware does not know it"),
    Result.OUT_OF_RANGE: (RefusedValueError, "out of range"),
    Result.NOT_NOW: (NotNowError, "not now"),
}


class Conversation:
    """Commands, repeated until they are acknowledged, and the relation of the two clocks, by each acknowledgement.

    One thread reads and passes on each packet that is no frame (heard); any thread may ask (exchange). changed is notified, by who reads,
    after anything came, and guards what is read below it.
    """

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self.decoder = wire.Decoder()
        self.estimate = NO_CLOCK
        self.changed = host_time.condition()
        self.error: FingertipError | None = None
        """Why it has ended."""
        self.is_closed = False
        self.is_interrupted = False
        """The port has gone, and is searched for."""
        self._clock_fit = ClockFit()
        self._sending = threading.Lock()
        self._one_command = threading.Lock()
        self._sequence = 0
        self._eager_until_us = 0
        self._awaited: tuple[int, int] | None = None  # type of the command, sequence of its first attempt
        self._ack: Acknowledgement | None = None
        self._answer: Body | None = None

    @property
    def description(self) -> str:
        """The port or the socket."""
        return self.transport.description

    @property
    def statistics(self) -> LineStatistics:
        return self.decoder.statistics

    @property
    def clock_jumps(self) -> int:
        return self._clock_fit.jumps

    def go_on(self, transport: Transport) -> None:
        """With a fingertip that came back: packets and clock begin again."""
        self.transport = transport
        self.decoder.restart()
        self._clock_fit = ClockFit()
        self.estimate = NO_CLOCK

    def read(self, settle_s: float) -> list[Packet]:
        """What has come, settle_s after its first byte unless an answer is awaited. Raises GoneError."""
        data = self.transport.read(POLL_s, 0.0 if host_now_us() < self._eager_until_us else settle_s)
        return self.decoder.feed(data) if data else []

    def send(self, body: Body) -> None:
        """Without waiting for the answer. Raises GoneError."""
        with self._sending:
            sequence = self._sequence
            self._sequence = sequence + 1 & 0xFFFF
            self._eager_until_us = host_now_us() + round(ANSWER_TIMEOUT_s * 1e6)
            self.transport.write(wire.encode(Packet(sequence, host_now_us(), body)))

    def heard(self, t_us: int, body: Body) -> None:
        """A packet that is no frame."""
        if isinstance(body, Acknowledgement):
            self.relate(t_us, body)
            awaited = self._awaited
            if awaited is None:
                self._eager_until_us = 0
            elif body.command == awaited[0] and body.command_sequence - awaited[1] & 0xFFFF < self._sequence - awaited[1] & 0xFFFF:
                self._ack = body
        elif self._ack:
            self._answer = body

    def relate(self, t_us: int, ack: Acknowledgement) -> None:
        """The clocks, by this acknowledgement."""
        now_us = host_now_us()
        if 0 < ack.host_time_us <= now_us:
            self._clock_fit.add(ClockExchange(ack.host_time_us, now_us, t_us))
            self.estimate = self._clock_fit.estimate or NO_CLOCK

    def ask(self, body: Body, answer_type: type[Answer]) -> Answer:
        answer = self.exchange(body, answer_type)
        assert isinstance(answer, answer_type)
        return answer

    def exchange(self, body: Body, answer_type: type[Body] | None = None) -> Body | None:
        """Sends until the acknowledgement and, if one is named, the answer came; the answer. Raises RefusedError, NoAnswerError,
        OtherVersionError, GoneError."""
        name = type(body).__name__
        number = next(number for number, each in wire.TYPES.items() if each is type(body))
        with self._one_command:
            versions = self.statistics.version_errors
            try:
                for attempt in range(ATTEMPTS):
                    with self.changed:
                        self._check_open()
                        if attempt == 0:
                            self._ack = self._answer = None
                            self._awaited = (number, self._sequence)
                    self.send(body)
                    if attempt > 0:
                        self._look_for_other_versions()
                    if self._await_answer(answer_type):
                        break
                    if self.statistics.version_errors > versions:
                        raise OtherVersionError(
                            f"{self.description}: speaks protocol version {self.decoder.other_version}, not {wire.VERSION}"
                        )
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

    def _look_for_other_versions(self) -> None:
        for version in range(1, wire.VERSION + NEWER_VERSIONS + 1):
            if version != wire.VERSION:
                with self._sending:
                    self.transport.write(wire.encode(Packet(0, 0, wire.AskInfo()), version))

    def _check_open(self) -> None:
        if self.error:
            raise self.error
        if self.is_closed:
            raise GoneError(f"{self.description}: closed")
        if self.is_interrupted:
            raise GoneError(f"{self.description}: vanished, and is not back yet")

    def _await_answer(self, answer_type: type[Body] | None) -> bool:
        end_s = host_time.now_s() + ANSWER_TIMEOUT_s
        with self.changed:
            while True:
                if self._ack and (self._ack.result != Result.DONE or answer_type is None or isinstance(self._answer, answer_type)):
                    return True
                self._check_open()
                left_s = end_s - host_time.now_s()
                if left_s <= 0:
                    return False
                self.changed.wait(left_s)
