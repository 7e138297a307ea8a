"""The firmware, the tool's calibration and the twin, called with arrays: fingertip.arrays, and the entry points of this folder."""

import pathlib

import numpy as np
from fingertip.arrays import Firmware, Library as Library, MeasureError as MeasureError
from fingertip.arrays import q10 as q10, round_half_away as round_half_away, usable_of as usable_of


class Measure(Firmware):
    """A shared object of this build."""

    def __init__(self, build, name="measure"):
        self.build = pathlib.Path(build).resolve()
        super().__init__(self.build / f"arrays/lib{name}.so")

    @property
    def contact_tables(self):
        return self.build / "contact_tables"

    def chain(self, array, settings, frames, *, before=None, gains=None, deviations=None, contacts=None):
        """(conditioned, fit_result, contact_result), each [run, frame], of frames through condition, fit and contact. Every run begins after the frames
        `before`."""
        if contacts is None:
            contacts = self.made("contact_settings", 1)
            self.call("default_contact_settings", contacts)
        found = tuple(self.made(name, *frames.shape) for name in ("conditioned", "fit_result", "contact_result"))
        none = self.made("condition_gains", 0)
        before = self.made("frame", 0) if before is None else before
        self.call("chain", array, settings, deviations, contacts, none if gains is None else gains, before, frames, *found)
        return found

    def osr(self, osr):
        """(conversion_us, noise_Pa_q10) of a reading at this oversampling; the noise is rms."""
        found = np.zeros(1, np.int32), np.zeros(1, np.int32)
        self.call("sensor_osr", osr, *found)
        return tuple(int(one[0]) for one in found)

    def random(self, seed, stream, index):
        """Random numbers of the twin's generator, a state for each index: what C++ draws with Random(seed, stream, index). seed: one, or one for each."""
        return Random(self, seed, stream, index)

    def base_pressure(self, contact_shape, layer_mm, touches, *, dip_share=0.0, seats=None, shape=None):
        """Pressure on the base, Pa, [touch, sensor], under one of the twin's contact shapes by its name, or, with `shape`, a contact_shape of that name.
        touches: twin_touch [touch]; seats: twin_seat [1 or touch, sensor]."""
        x_mm, y_mm, _ = self.layout()
        if shape is None:
            shape = self.made("contact_shape", 1)
            self.call("shape_named", contact_shape, shape)
        if seats is None:
            seats = self.made("twin_seat", 1, len(x_mm))
            seats["width"] = 1.0
        base_Pa = np.zeros((len(touches), len(x_mm)))
        dip_share = np.atleast_1d(np.asarray(dip_share, float))
        self.call(
            "base_pressure", contact_shape, shape, float(layer_mm), self.contact_tables, x_mm, y_mm, touches, dip_share, seats, base_Pa
        )
        return base_Pa


class Random:
    """Each draw gives one number for each state, [state], or `count` of them, [state, count]."""

    def __init__(self, measure, seed, stream, index):
        index = np.ascontiguousarray(index, np.int64)
        seeds = seed if isinstance(seed, np.ndarray) else np.array([signed(seed)])
        self.measure, self.states = measure, np.zeros(len(index), "V8")
        measure.call("random_begin", seeds, signed(stream), index, self.states)

    def drawn(self, entry, *arguments, count, of, kind=float):
        """of: which states draw, all by default; the others keep theirs and have 0."""
        values = np.zeros((len(self.states), count or 1), kind)
        if of is None:
            self.measure.call(entry, self.states, *arguments, values)
        else:
            some, some_values = self.states[of], values[of]
            self.measure.call(entry, some, *arguments, some_values)
            self.states[of], values[of] = some, some_values
        return values if count else values[:, 0]

    def uniform(self, low=0.0, high=1.0, count=None, of=None):
        return self.drawn("random_uniform", float(low), float(high), count=count, of=of)

    def log_uniform(self, low, high, count=None, of=None):
        return self.drawn("random_log_uniform", float(low), float(high), count=count, of=of)

    def normal(self, count=None, of=None):
        return self.drawn("random_normal", count=count, of=of)

    def bits(self, count=None, of=None):
        """Seeds."""
        return self.drawn("random_bits", count=count, of=of, kind=np.int64)

    def below(self, end, count=None, of=None):
        """Whole numbers."""
        return self.drawn("random_below", int(end), count=count, of=of, kind=np.int64)

    def some_of(self, sensors, count):
        """Bitmaps of `count` of this many sensors."""
        usable = np.full(len(self.states), (1 << sensors) - 1, np.uint64)
        left = np.full(len(usable), sensors)
        while (more := left > count).any():
            bit = np.where(more, np.uint64(1) << self.below(sensors, of=more).astype(np.uint64), np.uint64(0))
            left -= (usable & bit) > 0
            usable &= ~bit
        return usable


def signed(number):
    """The same 64 bits."""
    number = int(number) & (2**64 - 1)
    return number - 2**64 if number >= 2**63 else number


def stream_of(name):
    """Stream of random numbers for a name, as the C++ reports have it."""
    stream = 0
    for letter in name.encode():
        stream = (stream * 131 + letter) & (2**64 - 1)
    return stream
