#!/usr/bin/python3
"""Grasps of the controller in the simulated cell: what it drops, how hard it grips, how soon it answers a slip.

    grasp.py --build build/host -o build/report

    grasp.json    the figures by which it is judged, with their goals; a row for each set of grasps
    grasp.md      the same to read
    grasp.png     the same to look at

The controller is the tool's own; rubber, objects, sensors and grippers are simulated (host_tools/simulation/cell, whose headers state what is
assumed). The controller's constants were chosen with other seeds (--seed refuses them). In one grasp more the fingertips are emulated boards with
their release image. Nothing has been checked on hardware.
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]

import emulated_grasp  # noqa: E402
import grasp_report  # noqa: E402
import kinds  # noqa: E402
from fingertip.command import InputError, run_tool  # noqa: E402
from presentation import judge  # noqa: E402
from reporting import Steps, option_parser, output_folder, publish  # noqa: E402

SEED = 47001  # seen by no choice of a constant
CHOSE = (5001, 7001, 7101, 7201, 9001, 9101, 11001, 11101, 13001, 15001, 15101, 18001, 18101, 27001, 50001)  # and all below 1000
FAULTS = ("faults_opened", "faults_beyond_cap", "faults_unsaid", "cups_crushed")
GOALS = (*kinds.GOALS, ("emulated_reaction_ms", "<=", 60), *((name, "<=", 0) for name in FAULTS))


def table_of_faults(rows):
    """A row for each fault and state, the worst of its grasps."""
    groups = {}
    for row in rows:
        groups.setdefault((row["fault"], row["state"], row["untold"]), []).append(row)
    return [
        {
            "fault": fault,
            "state": state,
            "untold": untold,
            "grasps": len(group),
            "reported": kinds.words(group, "reported"),
            "ends": kinds.words(group, "ends"),
            "opened_mm": max(row["opened_mm"] for row in group),
            "peak_N": max(row["peak_N"] for row in group),
            "of_cap": max(row["peak_N"] / row["cap_N"] for row in group),
            "crushed": sum(row["crushed"] for row in group),
        }
        for (fault, state, untold), group in groups.items()
    ]


def measure_faults(build):
    """Every fault in every state of a grasp."""
    rows = kinds.found_by(build, "--faults")["rows"]
    never = [row for row in rows if not row["begun"]]
    if never:
        raise InputError(f"{never[0]['fault']} never began in {never[0]['state']}: the grasp came not so far")
    judged = [row for row in rows if not row["untold"]]
    return {
        "faults": table_of_faults(rows),
        "faults_grasps": len(rows),
        "faults_opened": sum(row["opened"] for row in judged),
        "faults_beyond_cap": sum(row["beyond_cap"] for row in judged),
        "faults_unsaid": sum(row["unsaid"] for row in judged),
        "cups_crushed": sum(row["crushed"] for row in judged),
    }


def measure(options):
    steps = Steps()
    found = {"simulated": True, "grasp_seed": options.seed} | kinds.measure(options, steps) | measure_faults(options.build)
    steps.report(f"faults: {found['faults_grasps']} grasps")
    if not options.no_emulated:
        found |= emulated_grasp.measure(options.build, options.boards, pathlib.Path(options.output) / "contact_tables")
        steps.report("two emulated fingertips: one grasp")
    return found


def main(argv):
    parser = option_parser(__doc__, boards=True)
    parser.add_argument("--seed", type=int, default=SEED, metavar="N", help="1000 or more; default %(default)s")
    parser.add_argument("--usual", action="store_true", help="a tenth of the grasps")
    parser.add_argument("--grasps", type=int, metavar="N", help="of each row")
    parser.add_argument("--no-emulated", action="store_true", help="without the grasp of two emulated fingertips")
    options = parser.parse_args(argv)
    if options.seed < 1000 or options.seed in CHOSE:
        raise InputError(f"constants were chosen by seeds below 1000 and by {', '.join(map(str, CHOSE))}: give another --seed")
    if options.grasps is not None and options.grasps < 1:
        raise InputError("--grasps needs 1 or more")
    if not options.no_emulated:
        emulated_grasp.program(options.build)
    output_folder(options)
    found = {name: None for name, _, _ in GOALS}
    found = judge(found | measure(options), GOALS)
    return publish(found, options, "grasp", {"grasp.png": lambda path: grasp_report.draw(found, path)}, ("distributions",))


if __name__ == "__main__":
    sys.exit(run_tool("grasp.py", main))
