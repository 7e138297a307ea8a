"""Leads a person through a validation: a fingertip's frames in, the steps as they are done, what to do now."""

import math

from .measure import Measurement
from .protocol import EMPTY_s, HEIGHT_mm, HOLD_s, REST_s, TURNS, Step, marks_of, steps_of, way_of


def _left(all_s, done_s):
    return f"{math.ceil(max(all_s - done_s, 0.0))} s"


class Walk:
    def __init__(self, pad, weight_g, skin_mm, pull_g=0.0, height_mm=HEIGHT_mm):
        marks = marks_of(pad.array)
        self._steps, self._marks, self._next = steps_of(marks, weight_g, skin_mm, pull_g, height_mm), len(marks), 0
        self._is_taken = False  # the press or the pull of the present step
        self.measurement = Measurement(pad)

    @property
    def is_done(self):
        return self._next == len(self._steps)

    @property
    def progress(self):
        """0 to 1."""
        return self._next / len(self._steps)

    @property
    def _now(self):
        return self._steps[self._next - 1]

    def _begin(self):
        self._next += 1
        self.measurement.step(self._now)
        self._is_taken = False
        return self._now

    def take(self, t_s, contact, reading):
        """One frame; the steps that begin after it, in order, for the recording."""
        if self.is_done:
            return []
        if self._next == 0:
            return [self._begin(), self._begin()]
        measured = self.measurement
        if contact:
            measured.contact(t_s, contact)
        if not reading:
            return []
        measured.reading(reading)
        self._is_taken |= measured.has_done
        is_over = {
            "empty": measured.step_s >= EMPTY_s and measured.is_free,
            "press": self._is_taken and measured.is_free,
            "pull": self._is_taken and measured.is_free,
            "hold": measured.touched_s >= HOLD_s,
            "rest": measured.released_s >= REST_s,
        }[self._now.kind]
        return [self._begin()] if is_over else []

    def take_back(self):
        """The last press or pull does not count, and is asked for again. Steps that begin; none: there is none to take back."""
        if self._next == 0 or self.is_done:
            return []
        last = self._next - 1 if self._is_taken else self._next - 2
        kind = self._now.kind
        if kind not in ("press", "pull") or self._steps[last].kind != kind:
            return []
        back = Step("take_back")
        self.measurement.step(back)
        self._next = last
        return [back, self._begin()]

    def _press_advice(self):
        finder = self.measurement.finder
        if self._is_taken:
            return "taken: lift it"
        if finder.state == "settling":
            return "hold on"
        if finder.state == "refused":
            return "it was not still: lift it, and leave it at rest by itself"
        turn = (self._next - 3) // self._marks + 1
        light = "too light. " if finder.refusal == "light" else ""
        return f"{light}set the weight down on mark {self._now.mark}, turn {turn} of {TURNS}"

    def _pull_advice(self):
        way = way_of(self._now.toward_deg)
        return {
            "free": f"set the weight down in the middle, its thread slack towards {way}",
            "settling": f"leave it at rest, its thread slack towards {way}",
            "resting": f"pull: hang the other weight on the thread towards {way}",
            "pulled": "let it hang still",
            "taken": "taken: lift it",
        }[self.measurement.pull_watch.state]

    @property
    def advice(self):
        """What to do now, and for how long."""
        if self._next == 0:
            return "wait"
        measured, kind = self.measurement, self._now.kind
        if kind == "empty":
            left = f"leave it alone: {_left(EMPTY_s, measured.step_s)}"
            return left if measured.is_free else "take off what touches it: the empty minute begins again"
        if kind == "press":
            return self._press_advice()
        if kind == "pull":
            return self._pull_advice()
        if kind == "hold":
            held_s = measured.touched_s
            return f"leave it at rest: {_left(HOLD_s, held_s)}" if held_s > 0 else "set the weight down in the middle, and leave it at rest"
        if kind == "rest":
            return f"leave it alone: {_left(REST_s, measured.released_s)}" if measured.released_s > 0 else "lift it"
        return "done"
