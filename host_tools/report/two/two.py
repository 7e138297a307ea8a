#!/usr/bin/python3
"""Contact shapes: one contact, a long one, one under a tangential force, or two; how often the firmware's answer is right.

    two.py --build build/host -o build/report

    two.json      the figures by which it is judged, with their goals; the table of two.md
    two.md        the same to read
    two.png       the same to look at

Pads and touches are the twin's, with a dip and calibrated; the code that answers is the firmware's own, compiled for the host. No public
recording has two contacts and their truth, so nothing here was seen on a real pad. Constants were chosen with the seeds 20000 and 30000,
how a packet's place is doubted with 50000 and 60000, what is an edge with 1, 21 to 24 and 31 to 34.
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / part) for part in ("host_tools/report/shared", "host_tools/report/measure", "host_tools/python")]

import two_report  # noqa: E402
from boards import fit_cycles_of  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from reporting import add_parts, built, contacts_of, figures_printed, given, option_parser, positive, report_of_parts  # noqa: E402

# part: what it does
PARTS = {
    "touches": "touches of one contact and of two, and what each is called, also on rubber that remembers or ends",
    "cycles": "cycles of a frame on the emulated chip",
}
GOALS = (
    ("two_right_percent_8mm", ">=", 90),
    ("two_right_percent_12mm", ">=", 97),
    ("two_right_percent_10mm_3to1", ">=", 80),
    ("one_called_two_percent", "<=", 0.2),
    ("edge_angle_p50_deg_20mm", "<=", 1.5),
    ("edge_angle_p50_deg_10mm", "<=", 3),
    ("silent_over_1mm_percent", "<=", 0.5),
    ("edge_on_round_percent", "<=", 2),
    ("edge_on_lime_and_finger_percent", "<=", 3),
    ("edges_found_percent", ">=", 90),
    ("angle_cover_1sd_percent_min", ">=", 50),
    ("angle_cover_1sd_percent_max", "<=", 85),
    ("cycles_core1_max", "<=", 85000),
)


def measure_touches(options):
    import edges
    import shapes

    contacts = contacts_of(options)
    return shapes.figures(contacts, **given(options, "seed", "pads")) | edges.figures(contacts, **given(options, "seed"))


def measure_cycles(options):
    image = built(fit_cycles_of(options.boards))
    return figures_printed("cycles.mjs", ["node", pathlib.Path(__file__).with_name("cycles.mjs"), image])


MEASURE = {"touches": measure_touches, "cycles": measure_cycles}


def main(argv):
    parser = option_parser(__doc__, boards=True)
    parser.add_argument("--seed", type=int, metavar="N")
    parser.add_argument("--pads", type=positive, metavar="N", help="calibrated pads; default 200, and 40 that remember")
    add_parts(parser, "two", PARTS)
    return report_of_parts(parser.parse_args(argv), "two", PARTS, GOALS, MEASURE, two_report)


if __name__ == "__main__":
    sys.exit(run_tool("two.py", main))
