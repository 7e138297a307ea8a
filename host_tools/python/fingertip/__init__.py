"""Reads and commands fingertips: fifteen barometers under rubber that measure where they are touched, how hard, and whether it slips.

with fingertip.Fingertip() as tip:
    for frame in tip:
        if frame.trusted:
            print(frame.x_mm, frame.y_mm, frame.force_N)
"""

from .aio import AsyncFingertip as AsyncFingertip
from .clock import ClockEstimate as ClockEstimate, host_now_us as host_now_us
from .device import Fingertip as Fingertip, list_fingertips as list_fingertips
from .discovery import Found as Found
from .errors import (
    BadValueError as BadValueError,
    FingertipError as FingertipError,
    GoneError as GoneError,
    InputError as InputError,
    NoAnswerError as NoAnswerError,
    NoFingertipError as NoFingertipError,
    NoFrameError as NoFrameError,
    NoSuchPortError as NoSuchPortError,
    NotAPortError as NotAPortError,
    NotNowError as NotNowError,
    NotSharedError as NotSharedError,
    OtherFingertipError as OtherFingertipError,
    OtherVersionError as OtherVersionError,
    PermissionDeniedError as PermissionDeniedError,
    PortError as PortError,
    PortInUseError as PortInUseError,
    RefusedError as RefusedError,
    RefusedValueError as RefusedValueError,
    SeveralFingertipsError as SeveralFingertipsError,
    UnknownCommandError as UnknownCommandError,
)
from .fit import calibrate as calibrate, fit as fit, read_pad as read_pad
from .files import Recording as Recording, read_recording as read_recording
from .frames import Block as Block, Edge as Edge, Frame as Frame
from .group import Fingertips as Fingertips
from .line import WARNINGS as WARNINGS, Capability as Capability, Flag as Flag, Result as Result, Stored as Stored, Streams as Streams
from .recording import JointRecordingWriter as JointRecordingWriter, RecordingWriter as RecordingWriter
from .version import __version__ as __version__
from .wire import Calibration as Calibration, Crash as Crash, Health as Health, Info as Info
from .wire import LineStatistics as LineStatistics, PadProfile as PadProfile
