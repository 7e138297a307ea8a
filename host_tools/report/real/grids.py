"""Presses on real two-dimensional arrays: what others recorded, and how far the firmware's fit of each press is off.

The sensors are in two columns of four; the board's drawing gives the pitch. The gantry's frame is laid on that layout by one rotation and one
shift. Every second row of presses aligns the layout and gives placements for calibrations; the figures are of the other rows.
"""

import dataclasses

import fingertip
import numpy as np
from fingertip.files import InputError
from fingertip.fit import inputs, read_pad, response_of
from fingertip.line import WARNINGS, Flag
from fingertip.tables import read_numbers

PA_PER_PSI = 6894.757
NOISE_PA = 10.0  # of a mean of ten samples, whose steps are 20 Pa
RESPONSE_MM = 6.0  # a sensor's response is fitted to presses so near it
OUTSIDE_MM = 3.0  # presses so far beyond the outer sensors are judged apart
PRIOR_WIDTH_MM = 0.5  # of the prior on sigma that a user sets: PRIOR_WIDTH in line.toml
DIP_WIDTHS = 5.0  # standard deviation of the dip, over that of the response: as a calibration expects it
DIP_FROM_WIDTHS = 3.0
PLACEMENTS, SESSIONS, EVERY_S = 20, 30, 8.0
GUIDED, HAND_OFF_mm = 8, 1.0  # sessions
PASSES = 31
PLACEMENT_PEAK_PA = 1500.0  # a calibration refuses lighter ones


class Grid:
    """One recording. xy [press, 2] in mm of the layout's frame, reading_Pa [press, 8], judged [press]: not of a row that aligns."""

    def __init__(self, path, pitch_mm):
        _, table, _ = read_numbers(path)
        if table.shape[1] != 10:
            raise InputError(f"{path}: rows are not x, y and eight readings")
        stage, self.reading_Pa = table[:, :2], table[:, 2:] * PA_PER_PSI
        self.pitch_mm = pitch_mm
        up = (np.arange(4) - 1.5) * pitch_mm
        self.layout = np.array([(pitch_mm / 2, y) for y in up] + [(-pitch_mm / 2, y) for y in up[::-1]])
        self.judged = np.searchsorted(np.unique(stage[:, 1]), stage[:, 1]) % 2 == 1
        self.align(stage)
        low, high = self.layout.min(axis=0), self.layout.max(axis=0)
        beyond = np.hypot(*np.maximum(np.maximum(low - self.xy, self.xy - high), 0.0).T)
        self.inside, self.outside = beyond == 0.0, (beyond > 0.0) & (beyond <= OUTSIDE_MM)

    def align(self, stage):
        """Sets xy, the responses [sensor]: peak_Pa, place of the stage, width_mm, and places_off_mm [sensor] of the layout."""
        fitted = []
        for sensor in range(8):
            reading, where = self.reading_Pa[~self.judged, sensor], stage[~self.judged]
            top = where[reading.argmax()]
            near = np.hypot(*(where - top).T) < RESPONSE_MM
            fitted.append(fit_gaussian(where[near], reading[near], top, 0.4 * RESPONSE_MM))
        self.peak_Pa, places, self.width_mm = (
            np.array([one[0] for one in fitted]),
            np.array([one[1:3] for one in fitted]),
            np.array([one[3] for one in fitted]),
        )
        middle = places.mean(axis=0)
        left, _, right = np.linalg.svd((places - middle).T @ self.layout)
        turn = left @ np.diag([1.0, np.linalg.det(left @ right)]) @ right
        self.xy = (stage - middle) @ turn
        self.places_off_mm = np.hypot(*((places - middle) @ turn - self.layout).T)

    def sessions(self, seed):
        """Lists of presses, as a person would set a weight down: inside the array, apart from each other, none of them judged."""
        random = np.random.default_rng(seed)
        return [random.permutation(self.placements())[:PLACEMENTS] for _ in range(SESSIONS)]

    def placements(self):
        """The presses of which sessions are made."""
        return np.flatnonzero(~self.judged & self.inside & (self.reading_Pa.max(axis=1) >= PLACEMENT_PEAK_PA))


def fit_gaussian(xy, reading_Pa, start, width_mm):
    """(peak, x, y, width) of least squares, by Levenberg and Marquardt."""
    at, damping = np.array([reading_Pa.max(), *start, width_mm]), 1e-3
    for _ in range(60):
        apart = xy - at[1:3]
        square = (apart**2).sum(axis=1)
        shape = np.exp(-square / (2 * at[3] ** 2))
        by = np.column_stack(
            [shape, at[0] * shape * apart[:, 0] / at[3] ** 2, at[0] * shape * apart[:, 1] / at[3] ** 2, at[0] * shape * square / at[3] ** 3]
        )
        left = reading_Pa - at[0] * shape
        normal = by.T @ by
        trial = at + np.linalg.solve(normal + damping * np.diag(np.diag(normal)), by.T @ left)
        model = trial[0] * np.exp(-((xy - trial[1:3]) ** 2).sum(axis=1) / (2 * trial[3] ** 2))
        lower = ((reading_Pa - model) ** 2).sum() < (left**2).sum()
        at, damping = (trial, damping / 10) if lower else (at, damping * 10)
        if damping > 1e9 or damping < 1e-12:
            break
    return at


class Fingertip:
    """The firmware's fit and the tool's calibration for one layout [sensor, 2], and a shared object that is compiled for it."""

    def __init__(self, measure, layout, pitch_mm):
        self.measure, self.layout_mm, self.pitch_mm = measure, tuple(np.ascontiguousarray(layout.T)), pitch_mm
        self.pad = {"pitch_mm": pitch_mm, "places_mm": layout.tolist()}

    def calibrate(self, reading_Pa, every_s=EVERY_S, last=True):
        """A Calibration for each session of placements [session, placement, sensor]. last: no placement follows."""
        t_s = np.tile(every_s * np.arange(reading_Pa.shape[1]), (len(reading_Pa), 1))
        found = self.measure.calibrate(*self.layout_mm, self.pitch_mm, t_s, np.ascontiguousarray(reading_Pa), NOISE_PA, last=last)
        return [Calibration(*one) for one in zip(*found)]

    def guided(self, grid, seed):
        """A Calibration for each session that the tool leads, by a hand that is HAND_OFF_mm (sd) off."""
        random, free = np.random.default_rng(seed), grid.placements()
        made, found, wanted_mm = [[] for _ in range(GUIDED)], [None] * GUIDED, np.zeros((GUIDED, 2))
        while open_ := [i for i in range(GUIDED) if found[i] is None]:
            for i in open_:
                far = np.hypot(*(grid.xy[free] - wanted_mm[i] - HAND_OFF_mm * random.normal(size=2)).T)
                made[i].append(free[np.where(np.isin(free, made[i]), np.inf, far).argmin()])
            for i, one in zip(open_, self.calibrate(grid.reading_Pa[np.array([made[i] for i in open_])], last=False)):
                wanted_mm[i] = one.found["wanted_x_mm"], one.found["wanted_y_mm"]
                found[i] = one if one.found["state"] else None
        return found

    def fit(self, reading_Pa, response=None):
        """What `fingertip fit` finds of readings [press, sensor], NaN where a sensor is missing, as of presses that are held."""
        return fingertip.fit(reading_Pa, self.pad, calibration=response, noise_Pa=NOISE_PA)

    def inputs(self, reading_Pa, response=None, **fields):
        """What the fit gets of these: fit_array, settings, readings, bitmap of usable sensors, deviations."""
        return inputs(self.measure, read_pad(self.pad), reading_Pa, response, NOISE_PA, **fields)

    def us(self, several):
        """Microseconds of one fit of each of several inputs, in the quickest of PASSES passes in which they take turns."""
        return np.min([[self.measure.timed_fit(*one[:4], deviations=one[4])[1] for one in several] for _ in range(PASSES)], axis=0)


@dataclasses.dataclass
class Calibration:
    """One session: calibration, calibrated_sensor and fit_deviation [sensor]."""

    found: np.void
    sensors: np.ndarray
    deviations: np.ndarray

    @property
    def good(self):
        return bool(self.found["state"] == 1)

    @property
    def response(self):
        return response_of(self.found, self.sensors)


def dip_share(grid):
    """Depth of the dip, as a share of the contact's peak: least squares over the rows that align, where the Gaussian has ended."""
    square = ((grid.xy[:, None, :] - grid.layout) ** 2).sum(axis=2) / grid.width_mm**2
    far = (square > DIP_FROM_WIDTHS**2) & ~grid.judged[:, None]
    below = (np.exp(-square / 2) - grid.reading_Pa / grid.peak_Pa)[far]
    dip = np.exp(-square[far] / (2 * DIP_WIDTHS**2))
    return float((below * dip).sum() / (dip**2).sum())


class Errors:
    """Fits beside where the presses were. All arrays [press]; without a fit the error is infinite."""

    def __init__(self, fits, xy):
        valid = fits["flags"] & Flag.FIT_VALID != 0
        apart = np.hypot(fits["x_mm"] - xy[:, 0], fits["y_mm"] - xy[:, 1])
        self.error_mm = np.where(valid, apart, np.inf)
        self.sd_mm = np.nan_to_num(fits["location_sd_mm"])
        self.warned = ~valid | (fits["flags"] & WARNINGS != 0)
        self.force_N = fits["force_N"]

    def figures(self, inside, outside):
        error, warned = self.error_mm[inside], self.warned[inside]
        return {
            "presses": int(inside.sum()),
            "inside_p50_mm": quantile(error, 0.5),
            "inside_p95_mm": quantile(error, 0.95),
            "over_1mm_percent": percent(error > 1.0),
            "over_2mm_percent": percent(error > 2.0),
            "cover_1sd_percent": percent(error <= self.sd_mm[inside]),
            "cover_2sd_percent": percent(error <= 2 * self.sd_mm[inside]),
            "warned_percent": percent(warned),
            "silent_percent": percent((error > 1.0) & ~warned),
            "silent_by_sd": 1 - np.prod(-np.expm1(-1 / np.maximum(self.sd_mm[inside][~warned], 1e-6) ** 2)),  # were it exact
            "force_scatter_percent": 100 * float(np.nanstd(np.log(np.maximum(self.force_N[inside], 1e-9)))),
            "outside_p50_mm": quantile(self.error_mm[outside], 0.5),
        }


def quantile(values, share):
    return float(np.quantile(values, share)) if len(values) else None


def percent(these):
    return 100 * float(np.mean(these)) if len(these) else None
