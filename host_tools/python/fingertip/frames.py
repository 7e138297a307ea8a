"""Frames, one by one and as arrays."""

import difflib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .clock import ClockEstimate
from .line import WARNINGS, BlockQuantities, Contact, ContactQuantities, Flag, Raw
from .wire import layout_of

if TYPE_CHECKING:
    import pandas

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

Q10 = 1024.0  # the wire's pressures are in 1/1024 Pa

_FIT_VALID = int(Flag.FIT_VALID)
_JUDGED = int(Flag.FIT_VALID | WARNINGS)
NO_CONTACT = Contact._make(math.nan if wire.code == "f" else 0 for _, wire in layout_of(Contact))
NO_RAW = Raw(0, 0, 0, 0, 0, 0, 0, ())


class Edge(NamedTuple):
    """The sync pin of a fingertip changed."""

    t_us: int
    """on the fingertip's clock, to a microsecond"""
    number: int
    """since the pin was set, from 1; a gap is edges that came too fast, or a lost packet"""
    level: int
    """of the pin after it: 1 high, 0 low"""
    time_us: float
    """on the host's clock, as Frame.host_us; in a recording of several on the recorder's, as their rows; NaN in a recording of one"""


class Frame(ContactQuantities):
    """One frame of a fingertip: a contact packet, a raw packet, or both.

    A quantity whose flag is off, or whose packet did not come, is NaN, never 0. Lengths are mm from the centre of the pad, x across the
    strips and y along them. frame counts every frame since the fingertip's start; t_us is its own clock, the middle of the sensors'
    conversion; run counts the starts and returns of the fingertip since it was opened, from 0.
    """

    __slots__ = ("serial", "run", "frame", "t_us", "has_contact", "has_raw", "contact", "raw", "sequence", "raw_sequence", "clock")

    def __init__(
        self,
        serial: str,
        run: int,
        t_us: int,
        contact: Contact | None,
        raw: Raw | None,
        sequence: int,
        raw_sequence: int,
        clock: ClockEstimate,
    ) -> None:
        self.serial = serial
        self.run = run
        self.t_us = t_us
        self.has_contact = contact is not None
        self.has_raw = raw is not None
        self.contact = NO_CONTACT if contact is None else contact
        self.raw = NO_RAW if raw is None else raw
        self.frame = self.raw.frame if contact is None else contact.frame
        self.sequence = sequence
        self.raw_sequence = raw_sequence
        self.clock = clock
        """The relation of the two clocks when this frame came; clock.uncertainty_us bounds the error of host_us."""

    @property
    def host_us(self) -> float:
        """t_us on the host's clock: time.perf_counter() in us. NaN before the clocks were compared."""
        return self.clock.host_at(self.t_us)

    @property
    def flags(self) -> Flag:
        return Flag(self.contact.flags if self.has_contact else self.raw.flags)

    @property
    def warnings(self) -> Flag:
        """Why the numbers deserve less trust; none: Flag(0)."""
        return self.flags & WARNINGS

    @property
    def trusted(self) -> bool:
        """There is a fit, and no warning."""
        return self.contact.flags & _JUDGED == _FIT_VALID

    @property
    def temperature_degC(self) -> float:
        """Mean of the sensors; NaN until measured."""
        return self.raw.temperature_cC / 100 if self.raw.temperature_cC else math.nan

    @property
    def sensors_Pa(self) -> FloatArray:
        """Absolute pressure of each sensor; NaN where the reading is no measurement of this frame (missing sensors, held frames)."""
        return np.where(_bits(self.raw.valid, self.raw.sensors), np.array(self.raw.readings[0::2], dtype=np.float64) / Q10, math.nan)

    @property
    def tare_Pa(self) -> FloatArray:
        """The zero of each sensor, in the same unit."""
        return np.array(self.raw.readings[1::2], dtype=np.float64) / Q10

    def __repr__(self) -> str:
        what = f"x_mm={self.x_mm:.2f}, y_mm={self.y_mm:.2f}, force_N={self.force_N:.3f}, " if self.has_contact else ""
        return f"<Frame {self.frame} t_us={self.t_us}, {what}{self.flags!r}>"


def _bits(bitmap: int, count: int) -> BoolArray:
    return np.array([bitmap >> k & 1 for k in range(count)], dtype=np.bool_)


class Block(BlockQuantities):
    """Frames as arrays, one value for each of the n frames.

    Every quantity of a Frame by the same name, and block["x_mm"] as well; sensors_Pa and tare_Pa are [n][sensor]. A value that is not
    there is NaN; integers (flags, bitmaps, stages) of a packet that did not come are 0, see has_contact and has_raw.
    """

    frame: IntArray
    run: IntArray
    t_us: IntArray
    host_us: FloatArray
    flags: IntArray
    has_contact: BoolArray
    has_raw: BoolArray
    temperature_degC: FloatArray
    sensors_Pa: FloatArray
    tare_Pa: FloatArray

    def __init__(self, frames: Sequence[Frame]) -> None:
        self._names: list[str] = []
        kinds: dict[str, Any] = {**dict.fromkeys(("frame", "run", "t_us"), np.int64), "host_us": np.float64}
        for name, kind in (kinds | dict.fromkeys(("has_contact", "has_raw"), np.bool_)).items():
            self._set(name, np.array([getattr(each, name) for each in frames], dtype=kind))
        contacts = np.array([each.contact for each in frames], dtype=np.float64).reshape(-1, len(Contact._fields))
        for i, (name, wire) in enumerate(layout_of(Contact)[1:], 1):
            self._set(name, contacts[:, i] if wire.code == "f" else contacts[:, i].astype(np.int64))
        raws = np.array([each.raw[1:6] for each in frames], dtype=np.int64).reshape(-1, 5)
        self._set("flags", np.where(self.has_contact, self.flags, raws[:, 0]))
        for i, name in enumerate(("valid", "saturated", "doubtful"), 1):
            self._set(name, raws[:, i])
        self._set("temperature_degC", np.where(raws[:, 4] == 0, math.nan, raws[:, 4] / 100))
        sensors = max((each.raw.sensors for each in frames), default=0)
        readings = np.full((len(frames), 2 * sensors), math.nan)
        with_raw = [i for i, each in enumerate(frames) if each.raw.sensors == sensors and sensors]
        if with_raw:
            readings[with_raw] = np.array([frames[i].raw.readings for i in with_raw], dtype=np.float64) / Q10
        measured = (self.valid[:, None] >> np.arange(sensors) & 1).astype(bool)
        self.sensors_Pa = np.where(measured, readings[:, 0::2], math.nan)
        self.tare_Pa = readings[:, 1::2]

    def _set(self, name: str, values: Any) -> None:
        setattr(self, name, values)
        if name not in self._names:
            self._names.append(name)

    def __len__(self) -> int:
        return len(self.frame)

    __iter__ = None  # of columns, or of frames?

    def __contains__(self, name: object) -> bool:
        return name in self._names or name in ("sensors_Pa", "tare_Pa")

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if not isinstance(name, str):
            raise TypeError(f'a block has no frame {name!r}, but arrays by their names: block["t_us"][0]')
        if not isinstance(values := getattr(self, name, None), np.ndarray):
            near = difflib.get_close_matches(name, self._names, cutoff=0.4)
            raise KeyError(f"a block has no {name}; {'did you mean ' + near[0] if near else 'it has ' + ', '.join(self._names)}")
        return values

    def __repr__(self) -> str:
        seconds = float(np.ptp(self.t_us)) / 1e6 if len(self) else 0.0
        return f"<Block of {len(self)} frames in {seconds:.2f} s, {int(self.has_contact.sum())} with a contact packet>"

    def flag(self, bits: int) -> BoolArray:
        """Where any of these flags is set."""
        found: BoolArray = self.flags & int(bits) != 0
        return found

    @property
    def trusted(self) -> BoolArray:
        """Where there is a fit, and no warning."""
        return self.flag(Flag.FIT_VALID) & ~self.flag(WARNINGS)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each frame, the sensors as s0_Pa, ... and tare0_Pa, ... Needs pandas."""
        return frame_of({name: self[name] for name in self._names}, self.sensors_Pa, self.tare_Pa)


def frame_of(columns: dict[str, Any], sensors_Pa: FloatArray, tare_Pa: FloatArray) -> "pandas.DataFrame":
    """Raises ImportError with what to install."""
    try:
        import pandas
    except ImportError:
        raise ImportError("pandas is not installed: pip install pandas") from None
    for kind, values in (("s", sensors_Pa), ("tare", tare_Pa)):
        columns |= {f"{kind}{k}_Pa": values[:, k] for k in range(values.shape[1])}
    return pandas.DataFrame(columns)
