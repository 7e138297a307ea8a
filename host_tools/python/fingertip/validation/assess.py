"""The figures of a pad's report card, and what is wrong with the pad or with the validation.

Findings follow from residuals against the profile that the presses themselves teach (marks_fit.py), not from names of faults. Each bound
lies between what healthy and faulty pads of the twin show (host_tools/report/validation/cards.py; chosen on seeds 1 to 12, 101 to 124, 201 to
206 and 501 to 512, judged on others). No real pad has been validated yet.

Cautions are less than findings: figures far outside of those of healthy simulated pads (expected.json), and presses with warnings.
"""

import json
import math
import pathlib
import statistics
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..line import Capability, Stored
from .marks_fit import LOOSE_SCATTER, MARKS_MIN, RESPONDS_SHARE, fit_marks
from .measure import AFTER_s
from .placements import solve_gains
from .protocol import GRAVITY_N_PER_g
from .pulls import upper_median

ANSWERS_MIN, ANSWERS_STEADY = 0.5, 0.995  # share of the frames: less is a dead sensor, and a loose one
RESPONDS_MIN = 0.3  # of the mean gain; less: it responds to nothing
# Largest residual of a sensor, rms against the profile. More: some sensor is odd. Up to 0.007 without a loose sensor, 0.011 at least with one.
ODD_RESIDUAL = 0.008
# How many times smaller the largest residual is once the loose sensors teach nothing: up to 1.9 where there is none, 3.3 at least where there is.
FITS_BETTER = 2.5
# So few presses reach a sensor at a corner that the fit may move them so that they follow it. Then nothing is odd, and it is left out to see.
FEW_RESPONSES = 8
NOISY_OVER_MEDIAN = 4.0
TILT_MIN, TILT_SDS = 0.04, 4.0  # the width's change from the middle to an end
THIN_SHARE = 0.85  # of the thickness that the user states
DRIFT_MAX_Pa_min = 40.0  # a sensor against the median of all
READS_OF_FORCE = 1.01  # share of the force that an uncalibrated pad reads: on seeds 101 to 124 of the twin, 0.95 to 1.09, sd 0.03
WEIGHT_OFF_MAX = 0.22  # force by the readings, over the weight, less 1
USABLE_SD_MAX = 1.0  # of the force: a larger standard deviation is of no use, and is not shown
MOSTLY_WARNED_percent = 50.0
_LOOSE_MAX, _CANDIDATES = 3, 3

EXPECTED = json.loads((pathlib.Path(__file__).parent / "expected.json").read_text(encoding="utf-8"))
SKIN_OFF_mm, PITCH_OFF_mm, PULL_OFF = 2.0, 0.05, 0.05  # a pad that differs from those of the table by less is compared
_BOTH_SIDES = ("force_over_weight", "weight_ratio", "sigma_mm", "thickness_mm")  # of the others only more is worse
_NOT_OF_THE_PAD = ("drift_all_Pa_min", "pull_blind_true", "gain_spread_percent")


class Figure(NamedTuple):
    key: str
    text: str
    unit: str
    value: float
    digits: int

    def shown(self, value):
        return f"{value:.{self.digits}f}" + (f" {self.unit}" if self.unit else "")


class Finding(NamedTuple):
    """code: dead_sensor, loose_sensor, swapped_wires, tilted_skin, thin_skin, drift or wrong_weight. text: with the evidence, and what to do."""

    code: str
    sensors: list
    text: str


def _sd(values):
    return statistics.stdev(values) if len(values) > 1 else 0.0


def _largest(values):
    return max(values, key=abs, default=0.0)


def _quantile(values, share):
    return sorted(values)[int(share * (len(values) - 1))]


def _named(sensors):
    names = [str(k) for k in sensors]
    return f"Sensor {names[0]}" if len(names) == 1 else f"Sensors {', '.join(names[:-1])} and {names[-1]}"


def why_no_tangential(pad):
    """Why this fingertip estimates no tangential force, and what to do; empty: it does."""
    if not pad.capabilities & Capability.TANGENTIAL:
        return (
            f"Scene {pad.scene} estimates no tangential force, so the card has only what a pull does to location and force; flash firmware of "
            "scene grasp for more."
        )
    if not pad.stored & Stored.PAD:
        return (
            "This fingertip does not know its pad, so it estimates no tangential force, and the card has only what a pull does to location and "
            "force; calibrate it (fingertip calibrate), or set the pad (fingertip pad), for more."
        )
    return ""


class Card:
    """measured (measure.py), fit (marks_fit.py), solution and judged (a calibration from these presses), gain and gain_sd by sensor (0: none),
    location_mm by press (the estimate's error each way; None: no estimate), figures, pull_note, findings, cautions."""

    def __init__(self, measured, name):
        if not measured.weight_g > 0:
            raise InputError(f"{name}: contains no validation; record one with `fingertip validate`")
        marks = len({press.mark for press in measured.presses})
        if marks < MARKS_MIN:
            raise InputError(f"{name}: contains presses at {marks} marks, and a card needs {MARKS_MIN}; record a whole validation")
        self.measured, self.array, self.sensors = measured, measured.pad.array, measured.pad.array.sensors
        self.is_calibrated = bool(measured.pad.stored & Stored.CALIBRATION)
        self.weight_N = GRAVITY_N_PER_g * measured.weight_g
        self.figures, self.findings, self.pull_note = [], [], ""
        self._dead, self._loose = np.zeros(self.sensors, bool), np.zeros(self.sensors, bool)
        self.fit = fit_marks(self.array, measured.presses)
        self._find_dead()
        self._find_swapped()
        self._find_loose()
        self._solve()
        self._locate()
        self._find_tilt()
        self._weigh(is_thin=self._find_thickness())
        self._assess_empty()
        self._assess_hold()
        self._assess_pulls()
        self.cautions = self._cautions()

    @property
    def verdict(self):
        return "faulty" if self.findings else "caution" if self.cautions else "good"

    @property
    def named(self):
        """Sensors in a finding."""
        return {k for finding in self.findings for k in finding.sensors}

    def figure(self, key):
        return next((figure for figure in self.figures if figure.key == key), None)

    def _add(self, key, text, unit, value, digits):
        self.figures.append(Figure(key, text, unit, float(value), digits))

    def _find(self, code, sensors, text):
        self.findings.append(Finding(code, [int(k) for k in sensors], text))

    def _find_dead(self):
        silent = self.measured.answered < ANSWERS_MIN
        numb = ~silent & (self.fit.gain < RESPONDS_MIN)
        self._dead = silent | numb
        for k in np.flatnonzero(silent):
            self._find(
                "dead_sensor",
                [k],
                f"{_named([k])} answered in {100 * self.measured.answered[k]:.0f} % of the frames. See that its power and its wires reach it: "
                "fingertip doctor names the line.",
            )
        for k in np.flatnonzero(numb):
            self._find(
                "dead_sensor",
                [k],
                f"{_named([k])} answers, but measured {100 * self.fit.gain[k]:.0f} % of what the others measure. See that rubber fills the hole "
                "of its lid, and that it is glued to nothing but the board; else replace it.",
            )
        self.place = np.where(self._dead, np.arange(self.sensors), self.fit.place)

    def _find_swapped(self):
        for k, other in enumerate(self.place):
            if other > k and self.place[other] == k:
                off = self.fit.off_mm
                self._find(
                    "swapped_wires",
                    [k, other],
                    f"{_named([k, other])} answer from each other's place: each is found {off[k]:.1f} and {off[other]:.1f} mm from where the "
                    "layout has it. Exchange their wires, and compare the others with the board's table.",
                )
            elif other != k and self.place[other] != k:
                self._find(
                    "swapped_wires",
                    [k],
                    f"{_named([k])} answers from the place of sensor {other}. Compare the wires with the board's table.",
                )

    def _without(self, without):
        return fit_marks(self.array, self.measured.presses, without)

    def _find_loose(self):
        """A loose sensor pulls at the profile, at the places of the presses and so at its neighbours' residuals. So the oddest are left out
        one after the other, as long as the rest then fits much better. Those of them are loose that respond differently to the same press
        each time. One that is odd by the same each time is elsewhere, or is wider."""
        if self._dead.any():
            self.fit = self._without(self._dead)
        without, tried, rest = self._dead, self._dead, self.fit
        residual, odd = rest.residual_share[~tried].max(), ODD_RESIDUAL
        for _ in range(_LOOSE_MAX):
            if residual <= odd:
                break
            odd = FITS_BETTER * ODD_RESIDUAL  # where one is left out, little holds its neighbours
            tried, rest = self._without_oddest(rest, tried)
            before, residual = residual, rest.residual_share[~tried].max()
            if before > FITS_BETTER * residual:
                without, self.fit = tried, rest
        if without is self._dead:
            without = self._without_followed()
        noise_Pa = self.measured.empty.noise_Pa if self.measured.empty else np.zeros(self.sensors)
        for k in np.flatnonzero(~self._dead):
            evidence = self._evidence_of_loose(k, without, noise_Pa, statistics.median(noise_Pa))
            if evidence:
                self._loose[k] = True
                self._find(
                    "loose_sensor",
                    [k],
                    f"{_named([k])} {evidence}. See that it is soldered and that the rubber holds it; a calibration cannot mend it.",
                )

    def _evidence_of_loose(self, k, without, noise_Pa, usual_Pa):
        if self.measured.answered[k] < ANSWERS_STEADY:
            return f"answered in {100 * self.measured.answered[k]:.1f} % of the frames only"
        if without[k] and self.fit.scatter_share[k] > LOOSE_SCATTER:
            others = statistics.median(self.fit.residual_share[~without])
            return (
                "responds differently to the same press each time: its readings leave the profile that the others teach by "
                f"{100 * self.fit.residual_share[k]:.1f} % rms, the others by {100 * others:.1f} %"
            )
        if 0 < NOISY_OVER_MEDIAN * usual_Pa < noise_Pa[k]:
            return f"is noisy with nothing on the pad: {noise_Pa[k]:.1f} Pa, the others {usual_Pa:.1f}"
        return ""

    def _without_oddest(self, fit, without):
        """One sensor more is left out, of those with the largest residuals: the one that leaves the profile of the others by most, in units
        of how far these leave it. (A neighbour of a loose sensor alone would not do: without it the rest may fit as well.)"""
        most, best = 0.0, (without, fit)
        for k in sorted(np.flatnonzero(~without), key=lambda k: -fit.residual_share[k])[:_CANDIDATES]:
            less = without | (np.arange(self.sensors) == k)
            other = self._without(less)
            odd = other.residual_share[k] / other.residual_share[~less].max()
            if odd > most:
                most, best = odd, (less, other)
        return best

    def _without_followed(self):
        """One sensor more, which the presses follow; the same: there is none."""
        without, fit = self._dead, self.fit
        # On thin rubber the neighbours respond too little to a press to show what a sensor should read.
        if math.exp(-0.5 * (self.array.pitch_mm / fit.width_mm) ** 2) < RESPONDS_SHARE:
            return without
        most = LOOSE_SCATTER
        for k in np.flatnonzero(~self._dead & (fit.responses <= FEW_RESPONSES)):
            less = self._dead | (np.arange(self.sensors) == k)
            other = self._without(less)
            if other.scatter_share[k] > most:
                most, without, self.fit = other.scatter_share[k], less, other
        return without

    def _solve(self):
        """Gains, width and dip, from the readings at the places where they belong."""
        placements = []
        for press in self.measured.presses:
            at = press.placement
            usable, reading_Pa, rest_Pa = np.zeros(self.sensors, bool), at.reading_Pa.copy(), at.rest_Pa.copy()
            for k in np.flatnonzero(at.usable & ~self._dead & ~self._loose):
                if not usable[self.place[k]]:
                    to = self.place[k]
                    usable[to], reading_Pa[to], rest_Pa[to] = True, at.reading_Pa[k], at.rest_Pa[k]
            placements.append(at._replace(usable=usable, reading_Pa=reading_Pa, rest_Pa=rest_Pa))
        self.solution, gains, self.judged, _ = solve_gains(self.array, placements, self.weight_N)
        self.gain, self.gain_sd = np.zeros(self.sensors), np.zeros(self.sensors)
        if not self.judged["solved"]:
            return
        known = np.flatnonzero(~self._dead & ~self._loose)
        self.gain[known], self.gain_sd[known] = gains[:, self.place[known]]
        self._add("gain_spread_percent", "gains of the sensors differ by, sd", "%", 100 * _sd(np.log(self.gain[known])), 1)
        self._add("gain_sd_percent", "each gain is known to, median sd", "%", 100 * statistics.median(self.gain_sd[known]), 1)
        if self.is_calibrated:
            left = _sd(np.log(self.gain[known] / self.measured.pad.gains[known]))
            self._add("gain_left_percent", "gains differ from the stored calibration by, sd", "%", 100 * left, 1)

    def _locate(self):
        presses = self.measured.presses
        seen = [i for i, press in enumerate(presses) if press.estimate.frames]
        self.location_mm = [None] * len(presses)
        self._force_over_weight = self._force_scatter = 0.0
        if not seen:
            return
        at_mm = np.array([[presses[i].estimate.x_mm, presses[i].estimate.y_mm] for i in seen])
        error_mm = at_mm - self.fit.press_mm[seen]
        for i, error in zip(seen, error_mm):
            self.location_mm[i] = error
        off_mm, as_pressed_mm = np.hypot(*error_mm.T), np.hypot(*(at_mm - self.fit.mark_mm[seen]).T)
        forces = np.array([presses[i].estimate.force_N for i in seen]) / self.weight_N
        mark = np.array([presses[i].mark for i in seen])
        squares = freedom = 0.0
        for own in (mark == each for each in np.unique(mark)):
            squares += ((error_mm[own] - error_mm[own].mean(axis=0)) ** 2).sum()
            freedom += 2 * (own.sum() - 1)
        self._force_over_weight = statistics.median(forces)
        warned = 100 * sum(presses[i].estimate.warned for i in seen) / len(seen)
        repeated_mm = math.sqrt(squares / freedom) if freedom else 0.0
        self._add("location_error_mm", "location off by, median", "mm", statistics.median(off_mm), 2)
        self._add("location_p90_mm", "one in ten is off by more than", "mm", _quantile(off_mm, 0.9), 2)
        self._add("as_pressed_mm", "from the marks themselves, with the hand's error, median", "mm", statistics.median(as_pressed_mm), 2)
        self._add("hand_mm", "the hand missed the marks by, sd each way", "mm", self.fit.hand_sd_mm, 2)
        self._add("repeatability_mm", "the same location again differs by, sd each way", "mm", repeated_mm, 2)
        self._add("warned_percent", "presses with a warning", "%", warned, 0)
        self._add("force_over_weight", "force reported over the weight, median", "", self._force_over_weight, 3)
        self._force_scatter = _sd(forces / self._force_over_weight)
        if self._force_scatter <= USABLE_SD_MAX:
            self._add("force_scatter_percent", "force scatters by, sd", "%", 100 * self._force_scatter, 1)

    def _find_tilt(self):
        slope, sd = np.hypot(*self.fit.slope), np.hypot(*self.fit.slope_sd)
        self._add("width_slope_percent", "width grows from the middle to an end by", "%", 100 * slope, 1)
        if not (slope > TILT_MIN and slope > TILT_SDS * sd):
            return
        axis = int(np.argmax(np.abs(self.fit.slope)))
        self._find(
            "tilted_skin",
            [],
            f"The skin is thicker towards {'+' if self.fit.slope[axis] > 0 else '-'}{'xy'[axis]}: its response is wider there by "
            f"{100 * slope:.0f} % than in the middle, and as much narrower at the other end. Level the mould and cast it again, or clamp it evenly.",
        )

    def _find_thickness(self):
        found = self.solution
        if not self.judged["solved"]:
            return False
        self._add("sigma_mm", "width of the response, sigma", "mm", found["sigma_mm"], 2)
        self._add("dip_percent", "dip around it, of the peak", "%", 100 * found["dip_share"], 1)
        self._add("thickness_mm", "thickness of rubber with that width", "mm", found["thickness_mm"], 1)
        if found["thickness_mm"] >= THIN_SHARE * self.measured.skin_mm:
            return False
        self._find(
            "thin_skin",
            [],
            f"The response is that of {found['thickness_mm']:.1f} mm, sd {found['thickness_sd_mm']:.1f} of rubber, not of "
            f"{self.measured.skin_mm:.0f} mm. Measure the skin; on rubber as thin as that too few sensors respond to a press near the outer ones, "
            "so cast it thicker or set a prior (fingertip set prior=).",
        )
        return True

    def _weigh(self, is_thin):
        """By the stored calibration, or by the readings of a pad whose sensors measure the pressure on the base."""
        ratio, found = self._force_over_weight, self.solution
        if not self.is_calibrated or not ratio > 0:
            if not found["force_scale"]:
                return
            ratio = 1 / (found["force_scale"] * found["force_ratio"] * READS_OF_FORCE)
        self._add("weight_ratio", "force by the readings, over the weight as given", "", ratio, 2)
        # A calibration of another skin does not show the weight.
        if not (is_thin and self.is_calibrated) and abs(ratio - 1) > WEIGHT_OFF_MAX:
            repair = (
                "calibrate again, with --weight."
                if self.is_calibrated
                else "the rubber passes on another share of the force, which fingertip calibrate --weight corrects."
            )
            grams = self.measured.weight_g
            self._find(
                "wrong_weight",
                [],
                f"The readings are those of {ratio * grams:.0f} g, not of {grams:.0f}. Weigh the weight with its foot; if it is right, {repair}",
            )

    def _assess_empty(self):
        empty = self.measured.empty
        if not empty:
            return
        there = self.measured.answered >= ANSWERS_MIN
        noise_Pa, drift = empty.noise_Pa[there], empty.drift_Pa_min[there]
        together = statistics.median(drift) if len(drift) else 0.0
        self._add("noise_Pa", "noise of a reading, median of the sensors", "Pa", statistics.median(noise_Pa) if len(noise_Pa) else 0.0, 1)
        self._add("noise_worst_Pa", "the noisiest sensor", "Pa", _largest(noise_Pa), 1)
        self._add("drift_Pa_min", "a zero moves against the others by at most", "Pa/min", abs(_largest(drift - together)), 1)
        self._add("drift_all_Pa_min", "all zeros move together, as the weather does, by", "Pa/min", together, 1)
        own = np.where(there, np.abs(empty.drift_Pa_min - together), 0)
        moving = np.flatnonzero(own > DRIFT_MAX_Pa_min)
        if len(moving):
            self._find(
                "drift",
                moving,
                f"{_named(moving) if len(moving) <= 3 else f'{len(moving)} sensors'}: their zeros move by up to {own.max():.0f} Pa a minute with "
                "nothing on the pad. Let it warm up for ten minutes, away from sun and draught; if it goes on, look for rubber that still cures or "
                "is clamped too hard.",
            )

    def _assess_hold(self):
        hold = self.measured.hold
        if not hold:
            return
        early, late = (np.maximum(values, 0).sum() for values in (hold.early_Pa, hold.late_Pa))
        self._add("hold_loss_percent", "readings fade in the hold by", "%", 100 * (1 - late / early), 1)
        pressed = hold.early_Pa > RESPONDS_SHARE * max(hold.early_Pa.max(), 0)
        for after_s, left_Pa in zip(AFTER_s, hold.after_Pa):
            if left_Pa is not None:
                most = (np.abs(left_Pa[pressed]) / hold.early_Pa[pressed]).max(initial=0)
                text = f"largest reading that remains {after_s:.0f} s after the release, of that in the hold"
                self._add(f"after_{after_s:.0f}s_percent", text, "%", 100 * most, 1)

    def _assess_pulls(self):
        """The tangential force that is found is the change from the rest before the pull, over the force that the fingertip reports then. That
        of the thread is its weight over the weight on the pad, if the pulley has no friction. A thread h above the rubber tilts the weight by
        its moment, so the contact's centre moves by h times that share: the card corrects the location for it."""
        measured = self.measured
        if not measured.pulls_asked:
            return
        pulls = [pull for pull in measured.pulls if pull.rest.frames and pull.pull.frames]
        if not pulls:
            self.pull_note = (
                "No pull was seen: leave the weight at rest for two seconds, then hang the other one on its level thread and leave both alone for "
                "two more."
            )
            return
        share = pulls[-1].weight_g / measured.weight_g
        moves_mm, over_thread, off_deg_squared, zero, sds = [], [], [], [], []
        for pull in pulls:
            angle, rest, then = math.radians(pull.toward_deg), pull.rest, pull.pull
            along = np.array([math.cos(angle), math.sin(angle)])
            moves_mm.append(along @ [then.x_mm - rest.x_mm, then.y_mm - rest.y_mm] - pull.weight_g / measured.weight_g * pull.height_mm)
            if then.pull_frames and rest.pull_frames:
                found_N = np.array([then.qx_N - rest.qx_N, then.qy_N - rest.qy_N])
                across_N = found_N[1] * along[0] - found_N[0] * along[1]
                over_thread.append(along @ found_N / then.force_N / share)
                off_deg_squared.append(math.degrees(math.atan2(across_N, along @ found_N)) ** 2)
                zero.append(math.hypot(rest.qx_N, rest.qy_N) / rest.force_N)
                sds.append(then.q_sd_N / then.force_N)
        forces = [pull.pull.force_N / pull.rest.force_N - 1 for pull in pulls]
        warned = 100 * sum(pull.pull.warned for pull in pulls) / len(pulls)
        start = "pull_" if over_thread else "pull_blind_"  # of a fingertip that estimates none
        self._add(start + "true", "tangential force of the thread, over the weight", "", share, 3)
        if over_thread:
            self._add(start + "over_thread", "tangential force found over that of the thread, mean", "", statistics.mean(over_thread), 3)
            self._add(start + "scatter", "that scatters by, sd", "", _sd(over_thread), 3)
            self._add(start + "direction_deg", "its direction is off by, rms", "deg", math.sqrt(statistics.mean(off_deg_squared)), 1)
            if upper_median(sds) <= USABLE_SD_MAX:
                self._add(start + "stated_sd", "its standard deviation by the fingertip, of the force, median", "", upper_median(sds), 3)
            self._add(start + "zero", "tangential force found before each pull, of the force, median", "", upper_median(zero), 3)
        self._add(start + "moves_mm", "a pull moves the location along by, mean", "mm", statistics.mean(moves_mm), 2)
        self._add(start + "moves_scatter_mm", "that scatters by, sd", "mm", _sd(moves_mm), 2)
        self._add(start + "force_percent", "a pull changes the force by, mean", "%", 100 * statistics.mean(forces), 1)
        self._add(start + "warned_percent", "pulls with a warning", "%", warned, 0)
        self.pull_note = "" if over_thread else why_no_tangential(measured.pad)
        if not self.pull_note and len(over_thread) < measured.pulls_asked:
            self.pull_note = (
                f"The fingertip estimated the tangential force of {len(over_thread)} of {measured.pulls_asked} pulls; give it its pad's thickness "
                "and overhang (fingertip pad)."
            )

    def is_comparable(self, key=""):
        """With the simulated pads of the table."""
        pads, measured = EXPECTED["pads"], self.measured
        if key.startswith("pull_"):
            share = measured.pulls[-1].weight_g / measured.weight_g if measured.pulls else 0.0
            if abs(share - pads["pull_share"]) >= PULL_OFF:
                return False
        return (
            self.sensors == pads["sensors"]
            and abs(self.array.pitch_mm - pads["pitch_mm"]) < PITCH_OFF_mm
            and abs(measured.skin_mm - pads["skin_mm"]) <= SKIN_OFF_mm
        )

    def expected(self, key):
        """(low, middle, high) of healthy simulated pads: nine in ten are between low and high; None: not comparable."""
        table = EXPECTED["calibrated" if self.is_calibrated else "never_calibrated"]
        return table.get(key) if self.is_comparable(key) else None

    def _cautions(self):
        """Figures further outside of the range of healthy pads than that is wide, and what to do where most presses warn."""
        cautions = []
        warned = self.figure("warned_percent")
        if warned and warned.value > MOSTLY_WARNED_percent:
            repair = "calibrate it again" if self.is_calibrated else "calibrate first"
            cautions.append(
                f"{warned.shown(warned.value)} of the presses carry a warning: {repair} (fingertip calibrate --weight), then validate again."
            )
        if self._force_scatter > USABLE_SD_MAX:
            cautions.append(
                "The forces of the presses scatter by more than their median, so they have no standard deviation that is of use."
            )
        outside = []
        for figure in self.figures:
            # Those of a tangential force that is found are of pads without the errors of real ones.
            is_compared = figure.key not in _NOT_OF_THE_PAD and (figure.key.startswith("pull_blind_") or not figure.key.startswith("pull_"))
            range_of = self.expected(figure.key) if is_compared else None
            if range_of:
                low, _, high = range_of
                is_low = figure.key in _BOTH_SIDES and figure.value < low - (high - low)
                if is_low or figure.value > high + (high - low):
                    outside.append(f"{figure.text} {figure.shown(figure.value)} ({low:.{figure.digits}f} to {figure.shown(high)})")
        if outside:
            cautions.append(f"Outside of what nine in ten of such simulated pads have: {'; '.join(outside)}.")
        if not self.measured.ended:
            cautions.append("The validation was not led to its end: some figures are missing.")
        return cautions
