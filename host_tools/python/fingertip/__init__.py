"""Reads and commands fingertips: fifteen barometers under rubber that measure where they are touched, how hard, and whether it slips.

from fingertip import Fingertip
with Fingertip() as fingertip:
    for frame in fingertip:
        if frame.trusted:
            print(frame.x_mm, frame.y_mm, frame.force_N)
"""

from .aio import AsyncFingertip
from .clock import ClockEstimate, host_now_us
from .device import Fingertip, list_fingertips
from .discovery import Found
from .errors import (
    BadValueError,
    FingertipError,
    GoneError,
    InputError,
    NoAnswerError,
    NoFingertipError,
    NoFrameError,
    NoSuchPortError,
    NotAPortError,
    NotNowError,
    NotSharedError,
    OtherFingertipError,
    OtherVersionError,
    PermissionDeniedError,
    PortError,
    PortInUseError,
    RefusedError,
    RefusedValueError,
    SeveralFingertipsError,
    UnknownCommandError,
)
from .files import Recording, read_recording
from .frames import Block, Edge, Frame
from .group import Fingertips
from .line import WARNINGS, Capability, Flag, Result, Stored, Streams
from .recording import JointRecordingWriter, RecordingWriter
from .version import __version__
from .wire import Calibration, Crash, Health, Info, LineStatistics, PadProfile

__all__ = [
    "WARNINGS",
    "__version__",
    "AsyncFingertip",
    "BadValueError",
    "Block",
    "Calibration",
    "Capability",
    "ClockEstimate",
    "Crash",
    "Edge",
    "Fingertip",
    "FingertipError",
    "Fingertips",
    "Flag",
    "Found",
    "Frame",
    "GoneError",
    "Health",
    "host_now_us",
    "Info",
    "InputError",
    "JointRecordingWriter",
    "LineStatistics",
    "list_fingertips",
    "NoAnswerError",
    "NoFingertipError",
    "NoFrameError",
    "NoSuchPortError",
    "NotAPortError",
    "NotNowError",
    "NotSharedError",
    "OtherFingertipError",
    "OtherVersionError",
    "PadProfile",
    "PermissionDeniedError",
    "PortError",
    "PortInUseError",
    "read_recording",
    "Recording",
    "RecordingWriter",
    "RefusedError",
    "RefusedValueError",
    "Result",
    "SeveralFingertipsError",
    "Stored",
    "Streams",
    "UnknownCommandError",
]
