"""Finds presses in a stream of frames: a weight is set down, rests, and is lifted again. The tool's host_tools/tool/calibration/placements.hpp does it,
which describes how."""

import weakref
from typing import NamedTuple

import numpy as np

from ..arrays import table_of
from ..errors import InputError
from ..fit import firmware

FRAME_RATE_MIN_Hz = 12.0
_STATES, _REFUSALS = ("resting", "settling", "taken", "refused"), (None, "unsteady", "light")


class Reading(NamedTuple):
    """One frame: absolute pressures, valid where they are a measurement within the sensor's range (answered: at all), and the firmware's zero."""

    t_s: float
    answered: np.ndarray
    valid: np.ndarray
    pressure_Pa: np.ndarray
    zero_Pa: np.ndarray


class Placement(NamedTuple):
    """reading_Pa: above the level before, where usable. rest_Pa: that level, absolute. noise_Pa: sd of such a mean. fading: share that the readings
    lose in half a second."""

    t_s: float
    reading_Pa: np.ndarray
    usable: np.ndarray
    rest_Pa: np.ndarray
    noise_Pa: float
    fading: float


def bits_of(flags):
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")


class PlacementFinder:
    """state: resting (nothing touches), settling, taken (a placement, to be lifted) or refused. refusal: None, unsteady or light."""

    def __init__(self, sensors):
        library, finder = firmware(), np.zeros(1, np.int64)
        library.call("finder_new", sensors, finder)
        weakref.finalize(self, library.call, "finder_free", int(finder[0]))
        self._t_s, self._valid, self._frame = np.zeros(1), np.zeros(1, np.int64), np.zeros((2, sensors))
        self._state, self._found, self._levels = np.zeros(3, np.int64), library.made("found_placement", 1), np.zeros((2, sensors))
        arrays = self._t_s, self._valid, self._frame, self._state, self._found, self._levels
        self._take = library.prepare("finder_take", int(finder[0]), *arrays)
        self.state, self.refusal = "resting", None

    def take(self, reading):
        """The placement that this frame completes."""
        self._t_s[0], self._valid[0] = reading.t_s, bits_of(reading.valid)
        self._frame[:] = reading.pressure_Pa, reading.zero_Pa
        self._take()
        self.state, self.refusal = _STATES[self._state[0]], _REFUSALS[self._state[1]]
        if not self._state[2]:
            return None
        t_s, noise_Pa, fading, usable = self._found[0].item()
        reading_Pa, rest_Pa = self._levels.copy()
        return Placement(t_s, reading_Pa, usable >> np.arange(len(rest_Pa)) & 1 != 0, rest_Pa, noise_Pa, fading)


def placements_of(t_s, reading_Pa):
    """All of readings above their zero [row, sensor], NaN where a sensor has none. Raises InputError where they are too rare."""
    rate_Hz = 1 / np.median(np.diff(t_s)) if len(t_s) > 1 else 0.0
    if rate_Hz < FRAME_RATE_MIN_Hz:
        raise InputError(f"{rate_Hz:.3g} rows a second, and {FRAME_RATE_MIN_Hz:g} show a weight settle; without a time rows are placements")
    finder, zero_Pa, valid = PlacementFinder(reading_Pa.shape[1]), np.zeros(reading_Pa.shape[1]), np.isfinite(reading_Pa)
    readings = zip(t_s.tolist(), valid, valid, np.nan_to_num(reading_Pa))
    return [found for found in (finder.take(Reading(*each, zero_Pa)) for each in readings) if found]


def solve_gains(array, placements, force_N):
    """(solved_placements of host_tools/tool/arrays/placements.cpp, [gain, sd] by sensor, and what the tool would keep: calibration, calibrated_sensor
    [sensor]): there is one solver of a calibration. Raises InputError."""
    library, sensors = firmware(), len(array.x_mm)
    counts = {"found_placement": len(placements), "solved_placements": 1, "calibration": 1, "calibrated_sensor": sensors}
    found, solved, kept, kept_sensors = map(library.made, counts, counts.values())
    for name in ("t_s", "noise_Pa", "fading"):
        found[name] = [getattr(one, name) for one in placements]
    found["usable"] = [bits_of(one.usable) for one in placements]
    levels = table_of([(one.reading_Pa, one.rest_Pa) for one in placements] or np.zeros((0, 2, sensors)))
    gains = np.zeros((2, sensors))
    library.call("solve_placements", array.x_mm, array.y_mm, array.pitch_mm, force_N, found, levels, solved, gains, kept, kept_sensors)
    return solved[0], gains, kept[0], kept_sensors
