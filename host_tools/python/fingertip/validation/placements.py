"""Finds presses in a stream of frames: a weight is set down, rests, and is lifted again. The tool's host_tools/tool/calibration/placements.hpp does it,
which describes how."""

import weakref
from typing import NamedTuple

import numpy as np

from ..arrays import table_of
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
    return int((1 << np.flatnonzero(flags)).sum())


class PlacementFinder:
    """state: resting (nothing touches), settling, taken (a placement, to be lifted) or refused. refusal: None, unsteady or light."""

    def __init__(self, sensors):
        library, finder = firmware(), np.zeros(1, np.int64)
        library.call("finder_new", sensors, finder)
        self._call, self._finder = library.call, int(finder[0])
        weakref.finalize(self, library.call, "finder_free", self._finder)
        self._state, self._found, self._levels = np.zeros(3, np.int64), library.made("found_placement", 1), np.zeros((2, sensors))
        self.state, self.refusal = "resting", None

    def take(self, reading):
        """The placement that this frame completes."""
        frame = table_of([reading.pressure_Pa, reading.zero_Pa])
        self._call("finder_take", self._finder, reading.t_s, bits_of(reading.valid), frame, self._state, self._found, self._levels)
        self.state, self.refusal = _STATES[self._state[0]], _REFUSALS[self._state[1]]
        if not self._state[2]:
            return None
        t_s, noise_Pa, fading, usable = self._found[0].item()
        reading_Pa, rest_Pa = self._levels.copy()
        return Placement(t_s, reading_Pa, usable >> np.arange(len(rest_Pa)) & 1 != 0, rest_Pa, noise_Pa, fading)
