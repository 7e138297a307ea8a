"""Holds an object between two fingertips on a gripper of yours, by the controller of `fingertip grasp`.

    gripper = MyGripper()                          # three methods: see Gripper
    with Fingertip("sim:left", latency_ms=1) as left, Fingertip("sim:right", latency_ms=1) as right:
        grip = Grip(gripper.traits(), Settings(cap_N=8))
        grip.request(Request.GRASP)
        for report in grip.follow((left, right), gripper):
            if report.state == State.HOLDING:
                ...                                # lift; later grip.request(Request.PLACE)

It needs libfingertip, which `cmake --install` or the Debian package brings. CONTROL.md in host_tools/grasp/control describes states,
troubles and requests, and where the controller fails. Forces are N, of one fingertip; times are s on time.perf_counter().
"""

import ctypes
import dataclasses
import functools
import os
import pathlib
import typing
import weakref
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

from . import host_time
from .clock import host_now_us
from .device import Fingertip
from .errors import BadValueError, FingertipError
from .frames import Frame
from .grip_table import TRAITS as TRAITS, Motion as Motion, Request as Request, Settings, State, Traits, Trouble
from .version import __version__

_AGAIN_s = 0.1  # a command may be lost on its way
_OTHER = -9  # FINGERTIP_ERR_OTHER: all other errors are the caller's


class Answer(NamedTuple):
    """Of the gripper."""

    width_mm: float
    moving: bool = False
    active: bool = True
    """it takes commands; one that is not is never activated from here: the state stays ACTIVATING"""
    fault: int = 0
    """the maker's code; twice in a row is the end of the grasp"""
    t_s: float | None = None
    """when the width was measured; None: at the step"""


class Gripper(Protocol):
    """A gripper of yours. No method may wait longer than a few milliseconds: on a slow line let a thread of yours talk to the gripper, poll
    return its newest answer with its time, and move leave the newest command. What they raise ends the loop; the width stays."""

    def traits(self) -> Traits: ...

    def poll(self) -> Answer | None:
        """None: no new answer. Without any for the setting silent_s the gripper counts as silent."""

    def move(self, width_mm: float, speed_mm_s: float, force_N: float) -> None:
        """Called where one of these has changed, and again each 0.1 s, since one may be lost on its way. force_N: for its own limit of force, if it has one."""


class Command(NamedTuple):
    width_mm: float
    speed_mm_s: float
    force_N: float
    motion: Motion


class Report(NamedTuple):
    """What one step found: fingertip_grip.h describes each."""

    state: State
    gripper_fault: int
    trouble: Trouble
    slides: int
    wanted_N: float
    force_N: float
    finger_N: tuple[float, float]
    load_N: float
    margin: float
    friction: float
    width_mm: float
    delay_s: float


def _structure(of: Any, **kinds: Any) -> type[ctypes.Structure]:
    """In C: doubles, but for these."""
    fields = [(name, kinds.get(name, ctypes.c_double)) for name in typing.get_type_hints(of)]
    return type(f"_{of.__name__}", (ctypes.Structure,), {"_fields_": fields})


_uint8, _uint32 = ctypes.c_uint8, ctypes.c_uint32
_Traits, _Answer = _structure(Traits), _structure(Answer, moving=_uint8, active=_uint8, fault=_uint8)
_Command = _structure(Command, motion=_uint32)
_Report = _structure(Report, state=_uint8, gripper_fault=_uint8, trouble=_uint32, slides=_uint32, finger_N=ctypes.c_double * 2)


@functools.cache
def _library() -> Any:
    """FINGERTIP_LIBRARY names it; else that of the source tree, else the installed one."""
    name = "libfingertip.so." + ".".join(__version__.split(".")[:2])
    built = pathlib.Path(__file__).resolve().parents[3] / "build/host/host_tools/install/library" / name
    path = os.environ.get("FINGERTIP_LIBRARY") or (str(built) if built.exists() else name)
    try:
        library = ctypes.CDLL(path)
        library.fingertip_error.restype = ctypes.c_char_p
        library.fingertip_grip_new.restype = ctypes.c_void_p
        library.fingertip_value_count.restype = ctypes.c_size_t
    except (OSError, AttributeError) as error:
        raise FingertipError(f"{path}: {error}; install libfingertip of this version, or name it by FINGERTIP_LIBRARY") from None
    return library


def _given(settings: Settings) -> tuple[Any, Any, ctypes.c_size_t]:
    given = {name: value for name, value in dataclasses.asdict(settings).items() if value is not None}
    names = (ctypes.c_char_p * len(given))(*(name.encode() for name in given))
    return names, (ctypes.c_double * len(given))(*given.values()), ctypes.c_size_t(len(given))


class Grip:
    """The controller. It has no clock and no thread, and waits for nothing: the same inputs give the same commands. Not for two threads at
    once.

    Settings that are None have the default of the gripper. Raises BadValueError, which names the setting and its range, and FingertipError
    where there is no libfingertip.
    """

    def __init__(self, traits: Traits, settings: Settings | None = None) -> None:
        self._c = _library()
        handle = self._c.fingertip_grip_new(ctypes.byref(_Traits(*dataclasses.astuple(traits))), *_given(settings or Settings()))
        if not handle:
            raise BadValueError(self._c.fingertip_error().decode())
        self._handle = ctypes.c_void_p(handle)
        weakref.finalize(self, self._c.fingertip_grip_free, self._handle)
        self._values = (ctypes.c_double * self._c.fingertip_value_count(1))()
        self._command, self._report = _Command(), _Report()
        self._sent: tuple[Command | None, float] = (None, 0.0)

    def _do(self, name: str, *arguments: Any) -> bool:
        status = getattr(self._c, f"fingertip_grip_{name}")(self._handle, *arguments)
        if status < 0:
            raise (FingertipError if status == _OTHER else BadValueError)(self._c.fingertip_error().decode())
        return bool(status == 0)

    def set(self, settings: Settings) -> None:
        """From the next step on, in any state; what is None stays as it is. All but the mode may change. Raises BadValueError: nothing changes."""
        self._do("set", *_given(settings))

    def setting(self, name: str) -> float:
        """The value that applies, default or not. Raises BadValueError."""
        value = ctypes.c_double()
        self._do("setting", name.encode(), ctypes.byref(value))
        return value.value

    def request(self, request: Request) -> bool:
        """False: not from this state."""
        return self._do("ask", ctypes.c_int(request))

    def take(self, finger: int, frame: Frame) -> None:
        """A frame of the left fingertip, 0, or the right, 1. Without a contact packet, or before the clocks were compared, it is ignored."""
        time_us = frame.host_us
        if frame.has_contact and time_us >= 0:  # false for NaN
            self._values[:] = (frame.sequence & 0xFFFF, frame.t_us, *frame.contact)
            self._do(
                "take_contact", ctypes.c_size_t(finger), ctypes.c_double(1e-6 * time_us), self._values, ctypes.c_size_t(len(self._values))
            )

    def answer(self, answer: Answer, now_s: float) -> None:
        width_mm, moving, active, fault, time_s = answer
        given = _Answer(width_mm, bool(moving), bool(active), min(int(fault), 255), now_s if time_s is None else time_s)
        self._do("take_answer", ctypes.byref(given))

    def step(self, now_s: float) -> tuple[Command, Report]:
        """Once after every input, and every 10 ms without one."""
        command: Any = self._command
        report: Any = self._report
        self._do("step", ctypes.c_double(now_s), ctypes.byref(command), ctypes.byref(report))
        found = {name: getattr(report, name) for name in Report._fields}
        found |= {"state": State(report.state), "trouble": Trouble(report.trouble), "finger_N": tuple(report.finger_N)}
        return Command(command.width_mm, command.speed_mm_s, command.force_N, Motion(command.motion)), Report(**found)

    def drive(self, gripper: Gripper, now_s: float) -> Report:
        """A step with this gripper: asks it, and sends it where the step commands."""
        answer = gripper.poll()
        if answer is not None:
            self.answer(answer, now_s)
        command, report = self.step(now_s)
        sent, sent_s = self._sent
        if command.motion == Motion.MOVE and (command != sent or now_s - sent_s >= _AGAIN_s):
            self._sent = command, now_s
            gripper.move(*command[:3])
        return report

    def follow(self, fingertips: tuple[Fingertip, Fingertip], gripper: Gripper, wait_s: float = 0.005) -> Iterator[Report]:
        """Steps with the frames of the left and the right fingertip as they come, and after wait_s without any; the report of each step.
        Raises what the fingertips raise: GoneError, if they were opened without reconnect. The width stays where the loop ends."""
        news = host_time.event()
        for each in fingertips:
            each.on_frames(news.set)
        while True:
            news.wait(wait_s)
            news.clear()
            for finger, each in enumerate(fingertips):
                while frame := each.take_one():
                    self.take(finger, frame)
            yield self.drive(gripper, 1e-6 * host_now_us())
