#!/usr/bin/python3
"""How far the fingertip's number is from the truth of the contact: gains, shapes and time.

    truth.py --build build/host -o build/report

    truth.json    the figures by which it is judged, with their goals; all tables of truth.md
    truth.md      the same to read
    truth.png     the same to look at

Pads, presses and sensors are the twin's, the code that judges them is the firmware's own, compiled for the host; recordings of
real strips are used where they are at hand (--recordings, or the environment's FINGERTIP_RECORDINGS) and their figures are null
elsewhere. Constants were chosen with other seeds and other pads than those that judge here. Cycles are those of the fit report in
the same folder, and what is kept without power is that of the nightly tests reliability.power_cuts and reliability.storing.
"""

import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/report/measure"), str(ROOT / "host_tools/python")]

import calibrations  # noqa: E402
import one_press  # noqa: E402
import over_time  # noqa: E402
import truth_report  # noqa: E402
import zero_and_gate  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from measure import Measure  # noqa: E402
from reporting import add_parts, figures_kept, option_parser, report_of_parts  # noqa: E402

PARTS = {
    "fit": "one press: coverage of the standard deviations, warnings, contacts that are not round",
    "calibration": "gains by placements of one weight",
    "gate": "zero and gate over time, on simulated and recorded rubber",
    "over_time": "contacts after contacts, on pads that remember, lean, end, or are thin",
}
OVER_TIME = ("plain", "remembered", "ends", "beyond", "leaning", "thin")
GOALS = (
    ("cal_median_mm", "<=", 0.15),
    ("cal_rough_median_mm", "<=", 0.21),
    ("cal_20_median_mm", "<=", 0.15),
    ("cal_dip_median_mm", "<=", 0.13),
    ("worse_after_accept", "<=", 0),
    ("accepted_good_percent", ">=", 95),
    ("refused_percent_worst", ">=", 90),
    ("cal_force_mape_percent", "<=", 2),
    ("calibrated_warned_percent_worst", "<=", 5),
    ("cover_1sd_min", ">=", 55),
    ("cover_1sd_max", "<=", 75),
    ("cover_2sd_min", ">=", 93),
    ("cal_warned_percent", "<=", 5),
    ("cal_bad_unflagged_percent", "<=", 0.1),
    ("raw_warned_percent", "<=", 32),
    ("raw_bad_unflagged_percent", "<=", 1.3),
    ("raw_20_bad_unflagged_percent", "<=", 2),
    ("loaded_silent_percent", "<=", 1),
    ("unloaded_warned_percent", "<=", 5),
    ("elongated_bad_unflagged_percent", "<=", 3),
    ("round_elongated_percent", "<=", 1),
    ("remembered_location_p50_mm", "<=", 0.12),
    ("remembered_location_p95_mm", "<=", 0.35),
    ("remembered_trusted_percent", ">=", 90),
    ("remembered_force_p50_percent", "<=", 2),
    ("remembered_refused", "<=", 0),
    ("slides_vector_error_p95", "<=", 0.07),
    *((f"{kind}_cover_1sd_percent", "within", (55, 80)) for kind in OVER_TIME),
    ("over_time_silent_percent_worst", "<=", 0.5),
    ("slow_force_error_percent", "<=", 2),
    ("false_contacts", "<=", 0),
    ("zero_recovery_s", "<=", 5),
    ("real_phantom_percent_worst", "<=", 5),
    ("real_phantom_longest_s", "<=", 5),
    ("real_held_missed", "<=", 0),
    ("phantom_force_longest_s", "<=", 10),
    ("real_median_mm_worst_test", "<=", 0.15),
    ("real_median_mm_worst_other", "<=", 0.30),
    ("flash_lost", "<=", 0),
    ("flash_frames_skipped", "<=", 0),
)
# Of the nightly tests reliability.power_cuts and reliability.storing.
KEPT = {"reliability.json": ("flash_lost", "flash_frames_skipped")}


MEASURE = {
    "fit": lambda options: one_press.figures(Measure(options.build), options),
    "calibration": lambda options: calibrations.figures(Measure(options.build), options),
    "gate": lambda options: zero_and_gate.figures(Measure(options.build), options),
    "over_time": over_time.figures,
}


def kept(_, out):
    return {name: value for file, names in KEPT.items() for name, value in figures_kept(out / file, names).items()}


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--recordings", default=os.environ.get("FINGERTIP_RECORDINGS"), metavar="DIR", help="of real strips")
    parser.add_argument("--seed", type=int, metavar="N")
    parser.add_argument("--pads", type=int, metavar="N", help="where pads differ; default 200 or more, of over_time 10")
    add_parts(parser, "truth", PARTS)
    return report_of_parts(parser.parse_args(argv), "truth", PARTS, GOALS, MEASURE, truth_report, kept)


if __name__ == "__main__":
    sys.exit(run_tool("truth.py", main))
