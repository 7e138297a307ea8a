"""What a validation measured: frames and steps in, means out. Live and from a recording alike."""

import collections
import math
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..command import printable
from ..files import read_recording
from ..frames import Q10
from ..line import SENSOR_LISTS, Flag
from .placements import Placement, PlacementFinder, Reading
from .protocol import Array, array_of, step_of
from .pulls import Estimate, PullWatch, estimate_of, upper_median

_KEPT_s = 3.0  # contacts
_HALF_READ_s = 0.25  # about a placement's time
_BEFORE_s, _BEFORE_TOUCH_s, _EARLY_s, _HALF_MEAN_s = 1.0, 0.15, 1.0, 0.5
_TENTH_s, _HELD_MIN_s, _LIFTING_s = 0.1, 5.0, 0.2
AFTER_s = (1.0, 10.0, 25.0)  # the release, when the rest is measured
# Every press is of one weight: a far weaker contact than the median press is rubber that recovers from the press before. On the twin's rubber
# of 8 mm that had 0.02 of the median readings, and a press 0.8 at least.
SAME_WEIGHT = 0.2


class Pad(NamedTuple):
    """The fingertip as an info packet reports it."""

    array: Array
    serial: str
    board: str
    scene: str
    firmware: str
    capabilities: int
    stored: int
    gains: np.ndarray  # of the stored calibration; empty: none

    @classmethod
    def of(cls, metadata):
        """metadata: an info packet's, as the comments of a recording have it."""

        def numbers(key):
            return np.array([float(word) for word in metadata.get(key, "").split()])

        array = array_of(numbers("x_mm"), numbers("y_mm"), float(metadata.get("pitch_mm", 0)))
        words = (metadata.get(key, "") for key in ("serial", "board", "scene", "firmware"))
        return cls(array, *words, int(metadata.get("capabilities", 0)), int(metadata.get("stored", 0)), numbers(next(iter(SENSOR_LISTS))))


class Press(NamedTuple):
    mark: int  # from 1
    x_mm: float  # of the mark
    y_mm: float
    placement: Placement
    estimate: Estimate  # of half a second


class Pull(NamedTuple):
    toward_deg: float
    weight_g: float
    height_mm: float
    rest: Estimate
    pull: Estimate


class Empty(NamedTuple):
    """Of the empty minute, by sensor: sd about the line through the readings, that line's slope; means of each second above the first's."""

    seconds: float
    noise_Pa: np.ndarray
    drift_Pa_min: np.ndarray
    seconds_Pa: np.ndarray


class Hold(NamedTuple):
    """By sensor, above before: from 0.5 to 1.5 s after the touch; in the last second; AFTER_s after the release (None: not measured).
    sum_Pa: (time from the touch, all sensors) of each tenth of a second."""

    held_s: float
    early_Pa: np.ndarray
    late_Pa: np.ndarray
    after_Pa: tuple
    sum_Pa: list


def _strength_Pa(placement):
    return np.maximum(placement.reading_Pa, 0).sum()


class Measurement:
    """Takes frames and steps in their order, then finish(). The members without underscore are what was measured."""

    def __init__(self, pad):
        self.pad = pad
        self.weight_g = self.skin_mm = 0.0
        self.presses, self.pulls = [], []
        self.pulls_asked, self.frames, self.ended = 0, 0, False
        self.empty = self.hold = None
        self.finder, self.pull_watch = PlacementFinder(pad.array.sensors), PullWatch()
        self.has_done = False  # the last frame completed the press or the pull of the step
        self._step, self._last_s, self._step_s = None, 0.0, 0.0
        self._answers = np.zeros(pad.array.sensors)
        self._rows, self._contacts = [], collections.deque()
        self._touched_s = self._released_s = None

    @property
    def answered(self):
        """Share of the frames in which each sensor gave a reading."""
        return self._answers / max(self.frames, 1)

    @property
    def step_s(self):
        """Since the step began."""
        return self._last_s - self._step_s

    @property
    def touched_s(self):
        """Since the present hold began; 0: it did not."""
        return 0.0 if self._touched_s is None else self._last_s - self._touched_s

    @property
    def released_s(self):
        return 0.0 if self._released_s is None else self._last_s - self._released_s

    @property
    def is_free(self):
        return self.finder.state == "resting"

    def step(self, step):
        self._finish_step(None if self._step is None else self._step.kind)
        if step.kind == "take_back":
            taken = self.pulls if self._step and self._step.kind == "pull" else self.presses
            del taken[-1:]
            return  # the step is what it was
        if step.kind == "begin":
            self.weight_g, self.skin_mm = step.weight_g, step.skin_mm
        elif step.kind in ("hold", "empty"):
            self._rows, self._touched_s, self._released_s = [], None, None
        elif step.kind == "pull":
            self.pulls_asked += 1
            self.pull_watch = PullWatch()
        self.ended |= step.kind == "end"
        self._step, self._step_s = step, self._last_s

    def _finish_step(self, kind):
        if kind == "empty":
            self._finish_empty()
        elif kind == "rest":
            self._finish_hold()

    def finish(self):
        kind = None if self._step is None else self._step.kind
        self._finish_step(kind if kind == "empty" or self.hold else "rest")
        return self

    def contact(self, t_s, contact):
        self._contacts.append((t_s, contact))
        while self._contacts[0][0] + _KEPT_s < t_s:
            self._contacts.popleft()

    def reading(self, reading):
        """One frame's. Held frames, and those with other sensors, are left to the caller."""
        self.has_done, self._last_s = False, reading.t_s
        if self._step is None or (self._step.kind == "end" and self.frames == 0):
            return  # before the first step
        self.frames += 1
        self._answers += reading.answered
        was_free, kind = self.is_free, self._step.kind
        found = self.finder.take(reading)
        if kind == "press" and found and self._is_same_weight(found):
            estimate = estimate_of(self._contacts, found.t_s - _HALF_READ_s, found.t_s + _HALF_READ_s)
            self.presses.append(Press(self._step.mark, self._step.x_mm, self._step.y_mm, found, estimate))
            self.has_done = True
        elif kind == "pull" and self.pull_watch.take(reading, self.is_free, self._contacts):
            step = self._step
            self.pulls.append(Pull(step.toward_deg, step.weight_g, step.height_mm, self.pull_watch.rest, self.pull_watch.pull))
            self.has_done = True
        elif kind in ("empty", "hold", "rest"):
            self._rows.append(reading)
            if kind != "empty":
                self._follow_hold(was_free)
            elif not self.is_free:
                self._rows, self._step_s = [], self._last_s  # something touched it: it begins again

    def _is_same_weight(self, placement):
        before = [_strength_Pa(press.placement) for press in self.presses]
        return not before or _strength_Pa(placement) >= SAME_WEIGHT * upper_median(before)

    def _follow_hold(self, was_free):
        if was_free and not self.is_free and self._touched_s is None:
            self._touched_s = self._last_s
        elif not was_free and self.is_free and self._touched_s is not None and self._released_s is None:
            if self.touched_s < _HELD_MIN_s:
                self._touched_s = None  # rubber that recovers, or a hand
            else:
                self._released_s = self._last_s

    def _table(self):
        return (np.array(column) for column in zip(*((row.t_s, row.valid, row.pressure_Pa) for row in self._rows)))

    def _finish_empty(self):
        if len(self._rows) < 2:
            return
        t_s, valid, pressure_Pa = self._table()
        t = t_s - t_s[0]
        noise_Pa, drift_Pa_min = (np.zeros(valid.shape[1]) for _ in range(2))
        for k in range(valid.shape[1]):
            if valid[:, k].sum() > 2:
                own_t = t[valid[:, k]] - t[valid[:, k]].mean()
                own_Pa = pressure_Pa[valid[:, k], k] - pressure_Pa[valid[:, k], k].mean()
                slope = own_t @ own_Pa / (own_t @ own_t)
                drift_Pa_min[k] = 60 * slope
                noise_Pa[k] = math.sqrt(((own_Pa - slope * own_t) ** 2).sum() / (len(own_t) - 2))
        seconds = [self._mean(t_s, valid, pressure_Pa, t_s[0] + s, t_s[0] + s + 1) for s in range(int(t[-1]))]
        seconds = np.array([one for one in seconds if one is not None])
        self.empty = Empty(t[-1], noise_Pa, drift_Pa_min, seconds - seconds[:1])
        self._rows = []

    @staticmethod
    def _mean(t_s, valid, pressure_Pa, from_s, to_s):
        """None: there is no frame."""
        chosen = (t_s >= from_s) & (t_s < to_s)
        count = valid[chosen].sum(axis=0)
        return (pressure_Pa[chosen] * valid[chosen]).sum(axis=0) / np.maximum(count, 1) if chosen.any() else None

    def _finish_hold(self):
        if self._touched_s is None or self._released_s is None:
            return
        t_s, valid, pressure_Pa = self._table()
        before = self._mean(t_s, valid, pressure_Pa, self._touched_s - _BEFORE_s, self._touched_s - _BEFORE_TOUCH_s)
        if before is None:
            return

        def above(from_s, to_s):
            mean = self._mean(t_s, valid, pressure_Pa, from_s, to_s)
            return None if mean is None else mean - before

        end_s = self._released_s - _LIFTING_s
        early = above(self._touched_s + _EARLY_s - _HALF_MEAN_s, self._touched_s + _EARLY_s + _HALF_MEAN_s)
        late = above(end_s - 2 * _HALF_MEAN_s, end_s)
        if early is None or late is None:
            return
        times_s = [self._released_s + after_s for after_s in AFTER_s]
        after = tuple(above(at_s - _HALF_MEAN_s, at_s + _HALF_MEAN_s) if self._last_s >= at_s + _HALF_MEAN_s else None for at_s in times_s)
        total = ((pressure_Pa - before) * valid).sum(axis=1)
        sums, first = [], 0
        for i in range(1, len(t_s)):
            if t_s[i] >= t_s[first] + _TENTH_s:
                sums.append((float(t_s[first] - self._touched_s), float(total[first:i].mean())))
                first = i
        self.hold = Hold(end_s - self._touched_s, early, late, after, sums)


class Fit(NamedTuple):
    """What a contact packet has of the contact."""

    flags: int
    x_mm: float
    y_mm: float
    force_N: float
    qx_N: float
    qy_N: float
    q_sd_N: float


def frames_of(recording):
    """(line number, t_s, Fit or None, Reading or None) of each frame, with the values that the line had; held frames have no reading."""
    has_contact, has_raw = recording.has_contact, ~np.isnan(recording["valid"])
    whole = {name: np.nan_to_num(recording[name]).astype(np.int64) for name in ("flags", "raw_flags", "valid", "saturated", "doubtful")}
    bits = 1 << np.arange(recording.sensors_Pa.shape[1])
    answered = whole["valid"][:, None] & bits != 0
    measured = answered & ((whole["saturated"] | whole["doubtful"])[:, None] & bits == 0)
    pressure_Pa, zero_Pa = (np.round(values * Q10) / Q10 for values in (recording.sensors_Pa, recording.tare_Pa))
    quantities = np.column_stack([recording[name] for name in Fit._fields[1:]]).astype(np.float32).astype(float).tolist()
    is_used = has_raw & (whole["raw_flags"] & Flag.HELD == 0)
    for i, (number, t_us) in enumerate(zip(recording.line_numbers, recording["t_us"])):
        fit = Fit(int(whole["flags"][i]), *quantities[i]) if has_contact[i] else None
        reading = Reading(t_us * 1e-6, answered[i], measured[i], pressure_Pa[i], zero_Pa[i]) if is_used[i] else None
        yield number, t_us * 1e-6, fit, reading


def read_measurement(path, serial=None):
    """Raises InputError."""
    recording = read_recording(path, serial=serial)
    if not recording.sensors_Pa.shape[1]:
        raise InputError(f"{printable(path)}: contains no pressures; give a recording that `fingertip validate` kept")
    measurement = Measurement(Pad.of(recording.metadata))
    steps = [(number, step) for number, step in zip(recording.event_lines, map(step_of, recording.events)) if step]
    for number, t_s, contact, reading in frames_of(recording):
        while steps and steps[0][0] < number:
            measurement.step(steps.pop(0)[1])
        if contact:
            measurement.contact(t_s, contact)
        if reading:
            measurement.reading(reading)
    for _, step in steps:
        measurement.step(step)
    return measurement.finish()
