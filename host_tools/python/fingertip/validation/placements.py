"""Finds presses in a stream of frames: a weight is set down, rests, and is lifted again. As host_tools/tool/calibration/placements.cpp,
which has the reasons of the limits.

Frames of 12 a second or more; all times are the frames' own. Pressures above the firmware's zero, against those just before, decide what
touches the pad: what the zero fades by in a contact is taken off. A contact begins where a reading rises by TOUCH_Pa within a second. It is a
placement once it was still for a second: its reading is the mean from 0.5 to 1 s, above the mean of the half second before the contact.
"""

import collections
from typing import NamedTuple

import numpy as np

TOUCH_Pa, LIGHT_Pa = 400.0, 1500.0
DECAY_MAX, SHIFT_MAX, SWAY_MAX = 0.08, 0.025, 0.005
LATE_s, SLOT_s, GAP_s, KEPT_s = 5.0, 0.05, 0.5, 3.0
REST_s, BEFORE_TOUCH_s, STILL_s, READ_FROM_s = 0.5, 0.1, 1.0, 0.5
MOVES, RISING, LIFTED_SHARE, SEEN_MIN, SLOTS_MIN = 0.05, 0.1, 0.1, 0.8, 5
NOISE_Pa, NOISE_SDS, SWAY_NOISES = 11.0, 4.0, 2.5
FRAME_RATE_MIN_Hz = 12.0
_EPSILON_s = 1e-9


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


class _Slot:
    """A twentieth of a second, or one frame where frames are rarer: means of each sensor."""

    def __init__(self, begin_s, sensors):
        self.begin_s, self.frames = begin_s, 0
        self.counts, self.means = np.zeros(sensors), np.zeros(sensors)

    def add(self, reading):
        self.frames += 1
        self.counts += reading.valid
        self.means += np.where(reading.valid, reading.pressure_Pa - reading.zero_Pa - self.means, 0.0) / np.maximum(self.counts, 1)


class PlacementFinder:
    """state: resting (nothing touches), settling, taken (a placement, to be lifted) or refused. refusal: None, unsteady or light."""

    def __init__(self, sensors):
        self._sensors, self._ahead_s, self._last_s = sensors, 0.0, 0.0
        self._restart()

    def _restart(self):
        self.state, self.refusal = "resting", None
        self._begun, self._open, self._rest_Pa = False, None, None
        self._slots = collections.deque()

    def take(self, reading):
        """The placement that this frame completes. Frames whose time does not rise, or after a gap of half a second, begin again; the times
        of placements continue when a fingertip restarted."""
        t_s = reading.t_s + self._ahead_s
        if self._begun and not self._last_s < t_s <= self._last_s + GAP_s:
            self._restart()
            if t_s <= self._last_s:
                self._ahead_s += self._last_s + GAP_s - t_s
                t_s = self._last_s + GAP_s
        self._last_s = t_s
        if self.state == "resting":
            self._zero_Pa = reading.zero_Pa
        if not self._begun:
            self._begun, self._rest_from_s = True, t_s
        found = None
        if self._open and t_s >= self._open.begin_s + SLOT_s:
            found = self._close(self._open)
            self._open = None
        if not self._open:
            self._open = _Slot(t_s, self._sensors)
        self._open.add(reading)
        return found

    def _between(self, begin_s, end_s):
        return [slot for slot in self._slots if begin_s - _EPSILON_s <= slot.begin_s < end_s - _EPSILON_s]

    @staticmethod
    def _mean_of(slots):
        """Means, and which sensors were measured often enough."""
        counts = np.array([slot.counts for slot in slots])
        total = counts.sum(axis=0)
        means = (counts * np.array([slot.means for slot in slots])).sum(axis=0) / np.maximum(total, 1)
        return means, (total > 0) & (total >= SEEN_MIN * sum(slot.frames for slot in slots))

    def _find_rest(self, t_s):
        """The readings with nothing on the pad, just before this time."""
        end_s = t_s - BEFORE_TOUCH_s
        slots = self._between(max(end_s - REST_s, self._rest_from_s), end_s)
        if self._rest_Pa is None:
            self._rest_Pa = np.zeros(self._sensors)
        if slots:
            means, seen = self._mean_of(slots)
            self._rest_Pa = np.where(seen, means, self._rest_Pa)

    def _close(self, slot):
        before = self._slots[-1] if self._slots else slot
        self._slots.append(slot)
        while self._slots[0].begin_s < slot.begin_s - KEPT_s:
            self._slots.popleft()
        t_s = slot.begin_s
        if self.state == "resting":
            self._find_rest(t_s)
        here, both = slot.counts > 0, (slot.counts > 0) & (before.counts > 0)
        strongest = (slot.means - self._rest_Pa)[here].max(initial=0.0)
        steps = (slot.means - before.means)[both]
        if self.state == "resting":
            # While a weight is lifted readings are high, but fall.
            if strongest > TOUCH_Pa and steps.max(initial=0.0) > RISING * TOUCH_Pa:
                self.state, self.refusal, self._peak_Pa = "settling", None, strongest
                self._touch_s = self._moved_s = t_s
            return None
        self._peak_Pa = max(self._peak_Pa, strongest)
        if strongest < max(0.5 * TOUCH_Pa, LIFTED_SHARE * self._peak_Pa):
            self.state, self._rest_from_s = "resting", t_s + 2 * SLOT_s  # the end of the lift is no rest
            return None
        if self.state != "settling":
            return None
        if np.abs(steps).max(initial=0.0) > MOVES * strongest:
            self._moved_s = t_s
        return None if t_s < self._moved_s + STILL_s else self._settled(t_s)

    def _settled(self, t_s):
        """Judges the last half second. Where it was not still, the next slot is tried."""
        begin_s = t_s - (STILL_s - READ_FROM_s)
        slots = self._between(begin_s, t_s)
        if len(slots) < SLOTS_MIN:
            return None
        mean, seen = self._mean_of(slots)
        reading = np.where(seen, mean - self._rest_Pa, 0.0)
        peak, total = reading.max(initial=0.0), np.maximum(reading, 0).sum()
        # A line through each sensor's slots: its change over the time, and what the line leaves.
        there = np.array([slot.counts > 0 for slot in slots])
        t = np.array([slot.begin_s - begin_s for slot in slots])[:, None] * there
        off = (np.array([slot.means for slot in slots]) - mean) * there
        count = there.sum(axis=0)
        lines = seen & (count >= SLOTS_MIN)
        n = np.maximum(count, 1)
        tt = (t * t).sum(axis=0) - t.sum(axis=0) ** 2 / n
        tp = (t * off).sum(axis=0) - t.sum(axis=0) * off.sum(axis=0) / n
        pp = (off * off).sum(axis=0) - off.sum(axis=0) ** 2 / n
        slope = np.divide(tp, tt, out=np.zeros_like(tp), where=lines)
        changes = slope * (t_s - begin_s)
        left = np.where(lines, np.maximum(pp - slope * tp, 0), 0)
        freedom = np.where(lines, count - 2, 1)
        common, sway = changes.sum(), np.sqrt(left / freedom).max(initial=0.0)
        noise_Pa = np.sqrt(left.sum() / max((freedom * lines).sum(), 1) * 2 / len(slots))  # with that of the level before
        shift = np.abs(changes - common * np.maximum(reading, 0) / max(total, 1)).max(initial=0.0)
        noise = NOISE_Pa / np.sqrt(sum(slot.frames for slot in slots) / len(slots))
        still = (
            abs(common) <= DECAY_MAX * total + NOISE_SDS * noise
            and shift <= SHIFT_MAX * peak + NOISE_SDS * noise
            and sway <= SWAY_MAX * peak + SWAY_NOISES * noise
        )
        if still and peak < LIGHT_Pa:
            # Rubber that recovers after a release is like that, too: it becomes the new level.
            self.state, self.refusal, self._rest_from_s = "resting", "light", t_s
        elif not still and t_s > self._touch_s + LATE_s:
            self.state, self.refusal = "refused", "unsteady"
        elif still:
            self.state = "taken"
            return Placement(0.5 * (begin_s + t_s), reading, seen, self._rest_Pa + self._zero_Pa, noise_Pa, -common / max(total, 1))
        return None
