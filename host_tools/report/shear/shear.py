#!/usr/bin/python3
"""The tangential force from the normal pressures: how near to the truth, on which pads, and what it does to every other figure.

    shear.py --build build/host -o build/report

    shear.json    the figures by which it is judged, with their goals; all tables of shear.md
    shear.md      the same to read
    shear.png     the same to look at

Pads, touches and sensors are the twin's, the code that judges them is the firmware's own, compiled for the host. No measurement on a
real pad confirms the size or the accuracy of what is read; that the centroid of the pressure under an infinite layer moves by one
thickness for each unit of Q / F follows from the balance of moments alone.
"""

import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / part) for part in ("host_tools/report/shared", "host_tools/report/measure", "host_tools/python")]

import shear_report  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from reporting import add_parts, contacts_of, figures_kept, given, option_parser, output_folder, positive, report_of_parts  # noqa: E402

# part: what it measures
PARTS = {
    "static": "one touch: size, direction, location and force by pad, tangential force, object and location; pads that end",
    "motion": "objects that are lifted, carried and slip: sliding distinguished from loading",
}
# Of contacts after contacts, which the part over_time of truth.py simulates: here, there, and its goal.
OVER_TIME = (
    ("valid_percent", "remembered_valid_percent", ">=", 95),
    ("phantom_p95", "remembered_vector_error_p95", "<=", 0.07),
    ("beyond_2sd_percent", "remembered_beyond_2sd_percent", "<=", 5),
    ("pulled_error_p50", "pulled_vector_error_p50", "<=", 0.03),
    ("pulled_error_p95", "pulled_vector_error_p95", "<=", 0.08),
    ("ends_error_p50", "ends_pulled_vector_error_p50", "<=", 0.035),
    ("ends_error_p95", "ends_pulled_vector_error_p95", "<=", 0.09),
)
# The ratio is |Q| / F, which is what is published; the vector's error has its direction in it and is held to the same.
GOALS = (
    ("ratio_error_p50", "<=", 0.02),
    ("ratio_error_p95", "<=", 0.05),
    ("vector_error_p50", "<=", 0.02),
    ("vector_error_p95", "<=", 0.05),
    ("direction_p90_deg", "<=", 5),
    ("location_loaded_median_mm", "<=", 0.17),
    ("location_price_mm", "<=", 0.01),
    ("equal_ratio_error_p50", "<=", 0.01),
    ("equal_ratio_error_p95", "<=", 0.03),
    ("equal_location_loaded_mm", "<=", 0.06),
    ("elongated_false_percent", "<=", 1),
    ("raw_beyond_2sd_percent", "<=", 10),
    ("dip_ratio_error_p50", "<=", 0.02),
    ("dip_ratio_error_p95", "<=", 0.05),
    ("cast_ratio_error_p50", "<=", 0.02),
    ("cast_ratio_error_p95", "<=", 0.05),
    ("learned_ratio_error_p50", "<=", 0.02),
    ("learned_ratio_error_p95", "<=", 0.05),
    ("wrong_thickness_warned_percent", ">=", 90),
    ("right_thickness_warned_percent", "<=", 5),
    ("screw_ratio", "<=", 0.02),
    ("screw_change_p95", "<=", 0.02),
    ("increment_error_p50_13mm", "<=", 0.05),
    ("increment_error_p50_9mm", "<=", 0.05),
    ("zero_error_p50_own_tables", "<=", 0.03),
    ("lift_false_slides", "<=", 0),
    ("slide_found_percent", ">=", 97),
    ("slide_latency_p95_ms", "<=", 25),
    ("optimum_p99_um", "<=", 2),
    ("optimum_p99_ratio", "<=", 0.001),
    *((name, *goal) for name, _, *goal in OVER_TIME),
)
# Of the estimate against an independent one in double precision: the test that compares them leaves them in the file that it is given.
OPTIMUM_TEST = "tests/accuracy/test_tangential_against_reference"
OPTIMUM_FILE, OPTIMUM = "shear_optimum.json", ("optimum_p99_um", "optimum_p99_ratio")


def measure_static(options):
    import static

    return static.figures(contacts_of(options), **given(options, "seed", "pads"), few=options.few)


def measure_motion(options):
    import motion

    return motion.figures(contacts_of(options), **given(options, "seed"), cases=motion.CASES[: 1 if options.few else None])


MEASURE = {"static": measure_static, "motion": measure_motion}


def derived(found, out):
    """Of lifts of any duration, the optimum of the test, and contacts after contacts."""
    kept = figures_kept(out / "truth.json", [there for _, there, *_ in OVER_TIME])
    false = [value for name, value in found.items() if name.startswith("lift_false_slides_") and value is not None]
    others = figures_kept(out / OPTIMUM_FILE, OPTIMUM) | {here: kept[there] for here, there, *_ in OVER_TIME}
    return ({"lift_false_slides": sum(false)} if false else {}) | others


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--seed", type=int, metavar="N")
    parser.add_argument("--pads", type=positive, metavar="N", help="of each case of one touch; default 1500")
    parser.add_argument(
        "--few", action="store_true", help="no rubber of other thicknesses than 12 mm, no other cases of motion than the usual"
    )
    add_parts(parser, "shear", PARTS)
    options = parser.parse_args(argv)
    if not options.parts and (test := pathlib.Path(options.build) / OPTIMUM_TEST).is_file():
        subprocess.run([str(test), str(output_folder(options) / OPTIMUM_FILE)], stdout=subprocess.DEVNULL)
    return report_of_parts(options, "shear", PARTS, GOALS, MEASURE, shear_report, derived)


if __name__ == "__main__":
    sys.exit(run_tool("shear.py", main))
