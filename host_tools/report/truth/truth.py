#!/usr/bin/python3
"""How far the fingertip's number is from the truth of the contact: gains, shapes, time, and what is kept in flash.

    truth.py --build build/host -o build/report

    truth.json    the figures by which it is judged, with their goals; all tables of truth.md
    truth.md      the same to read
    truth.png     the same to look at

Pads, presses and sensors are the twin's, the code that judges them is the firmware's own, compiled for the host; recordings of
real strips are used where they are at hand (--recordings, or the environment's FINGERTIP_RECORDINGS) and their figures are null
elsewhere. Constants were chosen with other seeds and other pads than those that judge here. Cycles are those of the fit report in
the same folder.
"""
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]

import truth_report  # noqa: E402
from fingertip.files import InputError, run_tool  # noqa: E402
from goals import judge  # noqa: E402
from reporting import finish, option_parser, output_folder, write_json  # noqa: E402

# part: what it does, its program below the build folder
PARTS = {
    "fit": "one press: coverage of the standard deviations, warnings, contacts that are not round",
    "calibration": "gains by placements of one weight",
    "gate": "zero and gate over time, on simulated and recorded rubber",
    "flash": "what is kept, when power goes",
}
GOALS = (
    ("cal_median_mm", "<=", 0.15), ("cal_rough_median_mm", "<=", 0.21), ("worse_after_accept", "<=", 0), ("accepted_good_percent", ">=", 95),
    ("refused_percent_worst", ">=", 90), ("cal_force_mape_percent", "<=", 2), ("cover_1sd_min", ">=", 55), ("cover_1sd_max", "<=", 75),
    ("cover_2sd_min", ">=", 93), ("cal_warned_percent", "<=", 5), ("cal_bad_unflagged_percent", "<=", 0.1), ("raw_warned_percent", "<=", 32),
    ("raw_bad_unflagged_percent", "<=", 1.3), ("elongated_bad_unflagged_percent", "<=", 3), ("round_elongated_percent", "<=", 1),
    ("slow_force_error_percent", "<=", 2), ("false_contacts", "<=", 0), ("zero_recovery_s", "<=", 5), ("real_phantom_percent_worst", "<=", 5),
    ("real_phantom_longest_s", "<=", 5), ("real_held_missed", "<=", 0), ("phantom_force_longest_s", "<=", 10), ("real_median_mm_worst_test", "<=", 0.15),
    ("real_median_mm_worst_other", "<=", 0.30), ("flash_lost", "<=", 0), ("flash_frames_skipped", "<=", 0), ("cold_cycles", "<=", 31000),
    ("masked_cycles", "<=", 62000))
OF_FIT_REPORT = ("cold_cycles", "masked_cycles")


def command_of(part, options):
    if part == "flash":
        command = [sys.executable, str(ROOT / "host_tools/report/truth/flash/truth_flash.py"), "--build", str(options.build),
                   "--boards", str(options.boards)]
    else:
        program = pathlib.Path(options.build) / "host_tools/report/truth" / part / f"truth_{part}"
        if not program.is_file():
            raise InputError(f"{program} is not there; build it: cmake --build --preset host")
        command = [str(program)]
    if options.seed is not None and part != "flash":
        command += ["--seed", str(options.seed)]
    if options.pads is not None and part != "flash":
        command += ["--pads", str(options.pads)]
    if part in ("fit", "calibration"):
        command += ["--cache", str(pathlib.Path(options.output) / "contact_tables")]
    if part == "gate" and options.recordings:
        command += ["--recordings", options.recordings]
    return command


def run_part(part, options):
    """What it found; its progress goes to stderr as it comes."""
    print(f"        {PARTS[part]}", flush=True)
    done = subprocess.run(command_of(part, options), stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise InputError(f"truth_{part} ended with status {done.returncode}; its own words are above")
    try:
        return json.loads(done.stdout)
    except ValueError as error:
        raise InputError(f"truth_{part} wrote no JSON ({error})") from None


def cycles(out):
    """Of the fit report, None where it is not there."""
    try:
        found = json.loads((out / "fit.json").read_text())
    except OSError:
        found = {}
    return {name: found.get(name) for name in OF_FIT_REPORT}


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--boards", default="build", metavar="DIR", help="folder of the boards' builds; default build")
    parser.add_argument("--recordings", default=os.environ.get("FINGERTIP_RECORDINGS"), metavar="DIR", help="of real strips")
    parser.add_argument("--seed", type=int, metavar="N")
    parser.add_argument("--pads", type=int, metavar="N", help="where pads differ; default 200 or more")
    parser.add_argument("--parts", metavar="NAME,...", help=f"only these of {','.join(PARTS)}; the others from the folder's truth.json")
    options = parser.parse_args(argv)
    parts = options.parts.split(",") if options.parts else list(PARTS)
    if unknown := [part for part in parts if part not in PARTS]:
        raise InputError(f"--parts: {unknown[0]} is none of {','.join(PARTS)}")
    out = output_folder(options)
    path = out / "truth.json"
    found = {name: None for name, _, _ in GOALS}
    if options.parts and path.is_file():
        found |= json.loads(path.read_text())
    for part in parts:
        found |= run_part(part, options)
        found = judge({**found, **cycles(out)}, GOALS)
        write_json(path, found)  # what is found is kept though a later part fails
    truth_report.write(found, out / "truth.md")
    truth_report.draw(found, out / "truth.png")
    return finish(found, options, ("truth.json", "truth.md", "truth.png"))


if __name__ == "__main__":
    sys.exit(run_tool("truth.py", main))
