"""Presses on real two-dimensional arrays: what others recorded, and how far the firmware's fit of each press is off.

The sensors stand in two columns of four; the board's drawing gives the pitch. The gantry's frame is laid on that layout by one rotation and one
shift. Every second row of presses aligns the layout and gives placements for calibrations; the figures are of the other rows.
"""

import csv
import json
import subprocess

import numpy as np
from fingertip.files import InputError
from fingertip.line import WARNINGS, Flag

PA_PER_PSI = 6894.757
NOISE_PA = 10.0  # of a mean of ten samples, whose steps are 20 Pa
RESPONSE_MM = 6.0  # a sensor's response is fitted to presses so near it
OUTSIDE_MM = 3.0  # presses so far beyond the outer sensors are judged apart
RAW_GAIN_SD = 0.105  # of a pad that was never calibrated: DEFAULT_GAIN_SD
PRIOR_WIDTH_MM = 0.5  # of the prior on sigma that a user types: PRIOR_WIDTH in line.toml
DIP_PITCHES = 2.3  # standard deviation of the dip: DIP_PITCHES of calibration/solver.hpp
DIP_FROM_WIDTHS = 3.0
PLACEMENTS, SESSIONS, EVERY_S = 20, 30, 8.0
PLACEMENT_PEAK_PA = 1500.0  # a calibration refuses lighter ones


class Grid:
    """One recording. xy [press, 2] in mm of the layout's frame, reading_Pa [press, 8], judged [press]: not of a row that aligns."""

    def __init__(self, path, pitch_mm):
        rows = []
        with open(path, encoding="utf-8") as lines:
            for cells in csv.reader(lines):
                try:
                    rows.append([float(cell) for cell in cells])
                except ValueError:
                    continue  # the header
        if not rows or {len(row) for row in rows} != {10}:
            raise InputError(f"{path}: rows are not x, y and eight readings")
        table = np.array(rows)
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
        free = np.flatnonzero(~self.judged & self.inside & (self.reading_Pa.max(axis=1) >= PLACEMENT_PEAK_PA))
        return [random.permutation(free)[:PLACEMENTS] for _ in range(SESSIONS)]


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


def ask(program, array, jobs):
    """The answers of real_fit, one for each job. array: has layout [sensor, 2] and pitch_mm, as a Grid."""
    asked = {"x_mm": array.layout[:, 0].tolist(), "y_mm": array.layout[:, 1].tolist(), "pitch_mm": array.pitch_mm, "jobs": jobs}
    done = subprocess.run([str(program)], input=json.dumps(asked), capture_output=True, text=True)
    if done.returncode:
        raise InputError(f"{program.name} failed: {done.stderr.strip()}")
    return json.loads(done.stdout)["results"]


def fit_job(readings, gain=None, gain_sd=None, prior=(0.0, 0.0), dip=(0.0, 0.0), own=(), **settings):
    """prior: sigma, its standard deviation, mm; dip: its share, its sd, mm; NaN in readings: that sensor is missing. settings: others of real_fit."""
    sensors = readings.shape[1]
    return {
        "kind": "fit",
        "presses": [[None if np.isnan(one) else one for one in press] for press in readings.tolist()],
        "noise_Pa": NOISE_PA,
        "gain": [1.0] * sensors if gain is None else gain,
        "gain_sd": [RAW_GAIN_SD] * sensors if gain_sd is None else gain_sd,
        "prior_sigma_mm": prior[0],
        "prior_width_mm": prior[1],
        "dip_share": dip[0],
        "dip_sd_mm": dip[1],
        "own": list(own),
        **settings,
    }


def stored_job(readings, stored, **settings):
    """With what a calibration leaves in the fingertip."""
    return fit_job(
        readings,
        stored["gain"],
        stored["gain_sd"],
        (stored["prior_sigma_mm"], stored["prior_width_mm"]),
        (stored["dip_share"], stored["dip_sd_mm"]),
        stored["own"],
        **settings,
    )


def calibration_job(readings, every_s=EVERY_S):
    return {"kind": "calibrate", "presses": readings.tolist(), "noise_Pa": NOISE_PA, "every_s": every_s}


def dip_share(grid):
    """Depth of the dip, as a share of the contact's peak: least squares over the rows that align, where the Gaussian has ended."""
    square = ((grid.xy[:, None, :] - grid.layout) ** 2).sum(axis=2) / grid.width_mm**2
    far = (square > DIP_FROM_WIDTHS**2) & ~grid.judged[:, None]
    below = (np.exp(-square / 2) - grid.reading_Pa / grid.peak_Pa)[far]
    dip = np.exp(-square[far] / (2 * (DIP_PITCHES * grid.pitch_mm / grid.width_mm.mean()) ** 2))
    return float((below * dip).sum() / (dip**2).sum())


class Felt:
    """What the fit said of presses beside where they were. All arrays [press]; without a fit the error is infinite."""

    def __init__(self, answer, xy):
        flags = np.array(answer["flags"])
        valid = flags & int(Flag.FIT_VALID) != 0
        apart = np.hypot(np.array(answer["x_mm"]) - xy[:, 0], np.array(answer["y_mm"]) - xy[:, 1])
        self.error_mm = np.where(valid, apart, np.inf)
        self.sd_mm = np.array(answer["location_sd_mm"])
        self.warned = ~valid | (flags & int(WARNINGS) != 0)
        self.force_N = np.where(valid, answer["force_N"], np.nan)

    @classmethod
    def joined(cls, several):
        """One after another."""
        made = cls.__new__(cls)
        for name in ("error_mm", "sd_mm", "warned", "force_N"):
            setattr(made, name, np.concatenate([getattr(one, name) for one in several]))
        return made

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
            "force_scatter_percent": 100 * float(np.nanstd(np.log(np.maximum(self.force_N[inside], 1e-9)))),
            "outside_p50_mm": quantile(self.error_mm[outside], 0.5),
        }


def quantile(values, share):
    return float(np.quantile(values, share)) if len(values) else None


def percent(these):
    return 100 * float(np.mean(these)) if len(these) else None


def centroid(readings, layout):
    """[press, 2]; of the readings above zero."""
    above = np.maximum(readings, 0.0)
    total = above.sum(axis=1, keepdims=True)
    return np.divide(above @ layout, total, out=np.full((len(above), 2), np.nan), where=total > 0)
