"""Error against run time: the fit as it was published, as the firmware ships it, and after a calibration, by the number of iterations.

On presses of real arrays, and of simulated pads with their dip, gains and widths. Distances are from where the press was, not from an optimum. Run
times are of this host, all ways in turns, over that of the published fit with four iterations.
"""

import grids
import numpy as np
import sessions

ITERATIONS = range(1, 11)
PUBLISHED_ITERATIONS = 4
PLACEMENTS, PRESSES = 30, 600
SEED = 40000  # no constant was chosen on it
WAYS = (("published", "as published"), ("shipped", "as shipped, not calibrated"), ("calibrated", "calibrated"))


def rows(presses, measured):
    """measured: for each pad (fingertip, readings [press, sensor], xy_mm [press, 2], calibration)."""
    error_mm, run_time = {}, {}
    for fingertip, readings, xy_mm, calibration in measured:
        ways = {"published": {"clip_below_sds": 0}, "shipped": {}, "calibrated": {"response": calibration.response}}
        keys = [(way, iterations) for way in ways for iterations in ITERATIONS]
        us = dict(zip(keys, fingertip.us([fingertip.inputs(readings, iterations=iterations, **ways[way]) for way, iterations in keys])))
        for way, iterations in keys:
            *of, deviations = fingertip.inputs(readings, iterations=iterations, **ways[way])
            fits = fingertip.measure.fit_held(*of, deviations=deviations)
            error_mm.setdefault((way, iterations), []).append(grids.Errors(fits, xy_mm).error_mm)
            run_time.setdefault((way, iterations), []).append(us[way, iterations] / us["published", PUBLISHED_ITERATIONS])
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


def twin_rows(measure, pads):
    """Of this number of simulated pads, cast as real ones."""
    x_mm, y_mm, pitch_mm = measure.layout()
    fingertip = grids.Fingertip(measure, np.column_stack([x_mm, y_mm]), pitch_mm)
    kind, seeds = sessions.kinds(measure, sessions.LIKE_REAL), SEED + np.arange(pads)
    made = sessions.placements(measure, "good", kind, seeds, sessions.LAYER_mm, PLACEMENTS)
    tap_x_mm, tap_y_mm, _, tap_Pa = sessions.taps(measure, kind, seeds, sessions.LAYER_mm, PRESSES)
    calibrations = fingertip.calibrate(made.reading_Pa, np.diff(made.t_s[0]).mean())
    pads = zip(tap_Pa, np.stack([tap_x_mm, tap_y_mm], axis=2), calibrations)
    return rows("twin", [(fingertip, *pad) for pad in pads])
