"""Error against run time: the fit as it was published, as the firmware ships it, and after a calibration, by the number of iterations.

On presses of real arrays, and of simulated pads with their dip, gains and widths. Distances are from where the press was, not from an optimum. Run
times are of this host, all ways in turns, over that of the published fit with four iterations.
"""

from types import SimpleNamespace

import grids
import numpy as np
import sessions

ITERATIONS = range(1, 11)
PUBLISHED_ITERATIONS = 4
PASSES = 31
PLACEMENTS, PRESSES = 30, 600
SEED = 40000  # no constant was chosen on it
WAYS = (("published", "as published"), ("shipped", "as shipped, not calibrated"), ("calibrated", "calibrated"))


def jobs_of(readings, stored):
    """{(way, iterations): job}"""
    return {
        (way, iterations): job(iterations)
        for way, job in (
            ("published", lambda n: grids.fit_job(readings, iterations=n, cut_noises=0)),
            ("shipped", lambda n: grids.fit_job(readings, iterations=n)),
            ("calibrated", lambda n: grids.stored_job(readings, stored, iterations=n)),
        )
        for iterations in ITERATIONS
    }


def rows(presses, measured):
    """measured: for each pad (program, array, readings [press, sensor], xy_mm [press, 2], stored calibration)."""
    error_mm, run_time = {}, {}
    for program, array, readings, xy_mm, stored in measured:
        jobs = jobs_of(readings, stored)
        *answers, pace = grids.ask(program, array, [*jobs.values(), {"kind": "pace", "passes": PASSES, "fits": list(jobs.values())}])
        us = dict(zip(jobs, pace["us"]))
        for key, answer in zip(jobs, answers):
            error_mm.setdefault(key, []).append(grids.Felt(answer, xy_mm).error_mm)
            run_time.setdefault(key, []).append(us[key] / us["published", PUBLISHED_ITERATIONS])
    return [
        {
            "presses": presses,
            "way": way,
            "iterations": iterations,
            "run_time": float(np.median(run_time[way, iterations])),
            **{f"p{percent}_mm": grids.quantile(np.concatenate(errors), percent / 100) for percent in (50, 95)},
        }
        for (way, iterations), errors in error_mm.items()
    ]


def twin_rows(programs, firmware, pads):
    """Of this number of simulated pads, cast as real ones."""
    x_mm, y_mm, pitch_mm = firmware.layout()
    array = SimpleNamespace(layout=np.column_stack([x_mm, y_mm]), pitch_mm=pitch_mm)
    kind, seeds = sessions.kinds(firmware, sessions.LIKE_REAL), SEED + np.arange(pads)
    made = sessions.placements(firmware, "good", kind, seeds, sessions.LAYER_mm, PLACEMENTS)
    tap_x_mm, tap_y_mm, _, tap_Pa = sessions.taps(firmware, kind, seeds, sessions.LAYER_mm, PRESSES)
    program = programs / "twin_fit"
    every_s = np.diff(made.t_s[0]).mean()
    calibrations = [grids.ask(program, array, [grids.calibration_job(readings, every_s)])[0] for readings in made.reading_Pa]
    return rows(
        "twin",
        [
            (program, array, readings, np.column_stack(xy_mm), calibration["stored"])
            for readings, *xy_mm, calibration in zip(tap_Pa, tap_x_mm, tap_y_mm, calibrations)
        ],
    )
