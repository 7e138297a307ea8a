"""The steps of a validation: an empty minute, presses of one weight at the marks of the template, a hold, a rest, and pulls on request.

A validation's recording is a usual recording of one fingertip. The steps are its events, so that the card can be made from it alone:

    # event: validate: begin weight_g=300 skin_mm=12
    # event: validate: empty
    # event: validate: press mark=1 x_mm=-9 y_mm=18        before each press
    # event: validate: take_back                           the last press does not count
    # event: validate: hold
    # event: validate: rest
    # event: validate: pull toward_deg=90 weight_g=100 height_mm=2    before each pull
    # event: validate: end

A pull: a thread at the weight's foot runs level over a pulley, and another weight hangs on it.
"""

import math
from typing import NamedTuple

import numpy as np

from ..lines import shortest

EMPTY_s, HOLD_s, REST_s = 60.0, 30.0, 30.0
RATE_Hz = 50.0  # of frames meanwhile: enough, and the recording stays small
TURNS = 2  # presses at each mark
PULLS_TOWARD_deg = (0.0, 90.0, 180.0, 270.0)  # from +x to +y
# Of the weight: a lighter pull is lost in the noise, a heavier one may make the weight slide.
PULL_SHARE_MIN, PULL_SHARE_MAX = 0.15, 0.5
HEIGHT_mm = 2.0  # of the thread above the rubber
GRAVITY_N_PER_g = 9.80665e-3

_BEGINS = "validate: "
_KEYS = {"begin": ("weight_g", "skin_mm"), "press": ("mark", "x_mm", "y_mm"), "pull": ("toward_deg", "weight_g", "height_mm")}
_KINDS = ("begin", "empty", "press", "take_back", "hold", "rest", "pull", "end")
_STRIDE_MIN = 7  # from one mark to the next, of the marks sorted by columns
_ACROSS_MIN, _ACROSS_MAX = 1.2, 1.6  # distance of two sensors across a cell of a grid, in pitches


class Array(NamedTuple):
    """The sensors' places in the board's axes."""

    x_mm: np.ndarray
    y_mm: np.ndarray
    pitch_mm: float

    @property
    def sensors(self):
        return len(self.x_mm)


class Step(NamedTuple):
    """kind, and of those that have them: the mark from 1, its place, the weight (of a pull: on the thread), the rubber as it was cast."""

    kind: str
    mark: int = 0
    x_mm: float = 0.0
    y_mm: float = 0.0
    weight_g: float = 0.0
    skin_mm: float = 0.0
    toward_deg: float = 0.0
    height_mm: float = HEIGHT_mm


def array_of(x_mm, y_mm, pitch_mm):
    """pitch_mm 0: a free layout, whose pitch is the distance of the nearest two sensors."""
    x_mm, y_mm = np.asarray(x_mm, float), np.asarray(y_mm, float)
    if not pitch_mm > 0:
        distance = np.hypot(x_mm[:, None] - x_mm, y_mm[:, None] - y_mm)
        pitch_mm = distance[~np.eye(len(x_mm), dtype=bool)].min(initial=math.inf)
    return Array(x_mm, y_mm, float(pitch_mm))


def marks_of(array):
    """On each sensor, and in the middle of each cell of four; 23 on the grid of three by five. So each sensor, at a corner too, has presses
    in which it reads most, and presses from which its neighbours show what it should read. In an order in which each mark is far from the
    one before, so that the rubber there is at rest. Those on the outer sensors are one overhang from the rubber's end."""
    places = []
    for k in range(array.sensors):
        places.append((array.x_mm[k], array.y_mm[k]))
        for j in range(k):
            pitches = math.hypot(array.x_mm[k] - array.x_mm[j], array.y_mm[k] - array.y_mm[j]) / array.pitch_mm
            if _ACROSS_MIN < pitches < _ACROSS_MAX:
                places.append((0.5 * (array.x_mm[k] + array.x_mm[j]), 0.5 * (array.y_mm[k] + array.y_mm[j])))
    half_mm = {tuple(0.5 * math.floor(2 * abs(at) + 0.5) * (1 if at > 0 else -1) + 0.0 for at in place) for place in places}
    marks = sorted(half_mm, key=lambda mark: (mark[0], -mark[1]))
    stride = _STRIDE_MIN
    while math.gcd(stride, len(marks)) > 1:
        stride += 1
    return [marks[i * stride % len(marks)] for i in range(len(marks))]


def steps_of(marks, weight_g, skin_mm, pull_g=0.0, height_mm=HEIGHT_mm):
    """All steps, in order."""
    presses = [Step("press", m + 1, *mark) for m, mark in enumerate(marks)] * TURNS
    pulls = [Step("pull", weight_g=pull_g, toward_deg=toward, height_mm=height_mm) for toward in PULLS_TOWARD_deg if pull_g > 0]
    return [Step("begin", weight_g=weight_g, skin_mm=skin_mm), Step("empty"), *presses, Step("hold"), Step("rest"), *pulls, Step("end")]


def event_of(step):
    return _BEGINS + step.kind + "".join(f" {key}={shortest(getattr(step, key))}" for key in _KEYS.get(step.kind, ()))


def step_of(event):
    """None: another event."""
    kind, *words = event.removeprefix(_BEGINS).split(" ")
    if not event.startswith(_BEGINS) or kind not in _KINDS:
        return None
    values = {}
    for key, separator, text in (word.partition("=") for word in words):
        try:
            if separator and key in _KEYS.get(kind, ()) and math.isfinite(float(text)):
                values[key] = float(text)
        except ValueError:
            continue
    if len(values) < len(_KEYS.get(kind, ())) or values.get("mark", 1) < 1:
        return None
    if any(values.get(key, 1) <= 0 for key in ("weight_g", "skin_mm")):
        return None
    if kind == "press":
        values["mark"] = int(values["mark"])
    return Step(kind, **values)


def way_of(toward_deg):
    return ("+x", "+y", "-x", "-y")[round(toward_deg / 90) % 4]
