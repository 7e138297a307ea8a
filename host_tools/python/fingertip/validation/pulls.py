"""One pull of a validation, from readings alone: a weight rests on the pad, is pulled along the rubber and left alone again. So a pull is
recognised whether or not the fingertip estimates a tangential force.

A pull changes the shape of the readings over the sensors: they rise ahead of the contact and fall behind it. What they all lose together
changes no shape. The difference of two shapes is the norm of what the better scale of one leaves of the other, over the other's norm.
"""

import collections
import math
from typing import NamedTuple

import numpy as np

from ..line import WARNINGS, Flag

# Within the first two seconds of a rest shapes differ by 0.012 in 19 of 20 placements of the twin on 12 mm whose sensors remember as usual, 0.020 at
# most, and by 0.031 and 0.051 on pads as poor as the strips; by 0.11 at least under a pull of PULL_SHARE_MIN.
STILL_SHAPE, PULLED_SHAPE = 0.025, 0.06
_KEPT_s, _BEFORE_s, _BEFORE_TOUCH_s = 3.0, 1.0, 0.15
_SETTLES_s, _REST_s, _RESTS_ON_s, _PULL_s, _NOW_s = 0.5, 0.5, 1.0, 1.0, 0.1


class Estimate(NamedTuple):
    """What the fingertip estimated in a span: medians over the frames with a fit (0 frames: nothing); warned: most of these.
    pull_frames: of them, those with a tangential force; 0: the rest is zero."""

    frames: int = 0
    x_mm: float = 0.0
    y_mm: float = 0.0
    force_N: float = 0.0
    warned: bool = False
    pull_frames: int = 0
    qx_N: float = 0.0
    qy_N: float = 0.0
    q_sd_N: float = 0.0


def upper_median(values):
    """Of an even number the upper one; 0 of none."""
    return sorted(values)[len(values) // 2] if len(values) else 0.0


def estimate_of(contacts, from_s, to_s):
    """contacts: (time, contact packet) in order of time."""
    fitted = [contact for t_s, contact in contacts if from_s <= t_s <= to_s and contact.flags & Flag.FIT_VALID]
    pulled = [contact for contact in fitted if contact.flags & Flag.TANGENTIAL_VALID]
    x_mm, y_mm, force_N = (upper_median([getattr(one, name) for one in fitted]) for name in ("x_mm", "y_mm", "force_N"))
    warned = 2 * sum(bool(one.flags & WARNINGS) for one in fitted) > len(fitted)
    forces_N = (upper_median([getattr(one, name) for one in pulled]) for name in ("qx_N", "qy_N", "q_sd_N"))
    return Estimate(len(fitted), x_mm, y_mm, force_N, warned, len(pulled), *forces_N)


def _difference(a, b):
    """Of the shape of a from that of b."""
    if a is None or b is None or not a @ a > 0 or not b @ b > 0:
        return 0.0
    cosine = (a @ b) / math.sqrt((a @ a) * (b @ b))
    return math.sqrt(max(1 - cosine * cosine, 0.0))


class PullWatch:
    """state: free (nothing touches), settling, resting (its rest is known: pull), pulled (and not yet still) or taken (lift it).
    rest, pull: estimates of half a second, a second or more before the pull, and of its last second."""

    def __init__(self):
        self.state, self.rest, self.pull = "free", Estimate(), Estimate()
        self._readings = collections.deque()
        self._before_Pa = self._rest_Pa = None

    def _above(self, from_s, to_s):
        """Means above those before the touch; None: there is no frame."""
        chosen = [reading for reading in self._readings if from_s <= reading.t_s <= to_s]
        if not chosen:
            return None
        valid = np.array([reading.valid for reading in chosen])
        count = valid.sum(axis=0)
        mean = (np.array([reading.pressure_Pa for reading in chosen]) * valid).sum(axis=0) / np.maximum(count, 1)
        return np.where(count > 0, mean - (0.0 if self._before_Pa is None else self._before_Pa), 0.0)

    def _find_rest(self, t_s, contacts):
        to_s = t_s - _RESTS_ON_s
        from_s = to_s - _REST_s
        if from_s < self._touched_s + _SETTLES_s:
            return
        rest_Pa = self._above(from_s, to_s)
        later = (self._above(to_s, to_s + 0.5 * _RESTS_ON_s), self._above(t_s - _NOW_s, t_s))
        if all(_difference(one, rest_Pa) < STILL_SHAPE for one in later):
            self._rest_Pa, self.rest, self.state = rest_Pa, estimate_of(contacts, from_s, to_s), "resting"

    def take(self, reading, is_free, contacts):
        """is_free: nothing touches the pad. contacts: of the last three seconds. True: this frame completes the pull."""
        t_s = reading.t_s
        self._readings.append(reading)
        while self._readings[0].t_s < t_s - _KEPT_s:
            self._readings.popleft()
        if self.state == "taken":
            return False
        if is_free:
            self.state = "free"
        elif self.state == "free":
            self._before_Pa = self._rest_Pa = None
            self._before_Pa = self._above(t_s - _BEFORE_s, t_s - _BEFORE_TOUCH_s)
            self._touched_s = t_s
            self.state = "free" if self._before_Pa is None else "settling"
        elif self.state == "settling":
            self._find_rest(t_s, contacts)
        else:
            return self._follow(t_s, contacts)
        return False

    def _follow(self, t_s, contacts):
        """From the rest on."""
        changed = _difference(self._above(t_s - _NOW_s, t_s), self._rest_Pa)
        if self.state == "resting":
            if changed > PULLED_SHAPE:
                self.state, self._pulled_s = "pulled", t_s
            else:
                self._find_rest(t_s, contacts)
            return False
        if changed < 0.5 * PULLED_SHAPE:
            self.state = "resting"
            return False
        if t_s < self._pulled_s + _PULL_s + _NOW_s:
            return False
        if _difference(self._above(t_s - _PULL_s, t_s - 0.5 * _PULL_s), self._above(t_s - 0.5 * _PULL_s, t_s)) > STILL_SHAPE:
            return False
        self.pull, self.state = estimate_of(contacts, t_s - _PULL_s, t_s), "taken"
        return True
