"""Error against run time: the fit as it was published, as the firmware ships it, and after a calibration, by the number of iterations.

On presses of real arrays, and of simulated pads with their dip, gains and widths. Distances are from where the press was, not from an optimum. Run
times are of this host, all ways in turns, over that of the published fit with four iterations.
"""

import json
import subprocess
from types import SimpleNamespace

import grids
import numpy as np
from fingertip.files import InputError

ITERATIONS = range(1, 11)
PUBLISHED_ITERATIONS = 4
PASSES = 31
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


def twin_rows(programs, pads):
    """Of so many simulated pads."""
    source = programs.parent / "truth/calibration/truth_calibration"
    done = subprocess.run([source, "--presses", "--pads", str(pads), "--seed", str(SEED)], stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise InputError(f"{source} failed, exit status {done.returncode}; see above")
    made = json.loads(done.stdout)
    array = SimpleNamespace(layout=np.column_stack([made["x_mm"], made["y_mm"]]), pitch_mm=made["pitch_mm"])
    program = programs / "twin_fit"
    calibrations = (
        grids.ask(program, array, [grids.calibration_job(np.array(pad["placements"]), pad["every_s"])])[0] for pad in made["pads"]
    )
    return rows(
        "twin",
        [
            (program, array, np.array(pad["presses"]), np.array(pad["xy_mm"]), calibration["stored"])
            for pad, calibration in zip(made["pads"], calibrations)
        ],
    )
