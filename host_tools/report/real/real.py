#!/usr/bin/python3
"""The firmware's own code on what others recorded: presses on real arrays, and the zero on real strips.

    real.py --build build/host -o build/report FOLDER

FOLDER holds the recordings of sources.json, in any folders below it. They are of others and not part of this project; each is known by its
checksum, and what is missing is named and left out.

    real.json    the figures by which it is judged, with their goals; all tables of real.md
    real.md      the same to read
    real.png     response of the sensors, errors over the array, coverage
    pace.png     error against run time, with and without the pad's profile, on simulated and on real presses

Recordings that chose a constant ("chooses") judge nothing. Presses lie in rows: every second row aligns the layout and gives the placements of
calibrations, the others are judged.
"""

import functools
import hashlib
import json
import os
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / folder) for folder in ("report/shared", "report/measure", "report/truth", "python")]

import grids  # noqa: E402
import pace  # noqa: E402
import real_report  # noqa: E402
import strips  # noqa: E402
from fingertip.command import InputError, run_tool  # noqa: E402
from presentation import judge  # noqa: E402
from measure import Measure  # noqa: E402
from reporting import option_parser, output_folder, publish  # noqa: E402

GOALS = (
    ("raw_inside_p50_mm", "<=", 0.35),
    ("raw_over_2mm_percent", "<=", 3),
    ("cal_inside_p50_mm", "<=", 0.20),
    ("cal_inside_p95_mm", "<=", 0.60),
    ("cal_over_1mm_percent", "<=", 1.5),
    ("cal_silent_percent", "<=", 0.1),
    ("cal_warned_percent", "<=", 15),
    ("cal_cover_1sd_percent", ">=", 55),
    ("cal_cover_1sd_most_percent", "<=", 85),
    ("cal_outside_p50_mm", "<=", 0.65),
    ("cal_force_scatter_percent", "<=", 7),
    ("sessions_accepted_percent", ">=", 90),
    ("worse_median_after_accept", "<=", 0),
    ("worse_p95_after_accept", "<=", 0),
    ("worse_silent_after_accept", "<=", 0),
    ("rows_accepted_percent", ">=", 90),
    ("one_missing_over_1mm_percent", "<=", 15),
    ("phantom_percent_1308", "<=", 1.5),
    ("phantom_percent_57", "<=", 2.5),
    ("doubted_percent", "<=", 20),
    ("holds_missed", "<=", 0),
)
SEED = 20230101
COMPARED = ("inside_p50_mm", "inside_p95_mm", "silent_percent")


def found_below(folder, sources):
    """{name: path} of the files whose checksum is right."""
    wanted = {one["name"]: one["sha256"] for source in sources.values() for one in source["files"]}
    here = {}
    for path in sorted(pathlib.Path(folder).rglob("*.csv")):
        if path.name in wanted and hashlib.sha256(path.read_bytes()).hexdigest() == wanted[path.name]:
            here.setdefault(path.name, path)
    if not here:
        raise InputError(f"{folder}: none of the recordings of sources.json is there; host_tools/report/real/README.md has their sources")
    return here


def one_missing(readings):
    """Of each press eight, with one sensor missing each."""
    copies = np.repeat(readings, readings.shape[1], axis=0)
    copies[np.arange(len(copies)), np.tile(np.arange(readings.shape[1]), len(readings))] = np.nan
    return copies


def judge_grid(measure, one, path):
    """The firmware's figures of one recording without a calibration, and after each of its sessions."""
    grid = grids.Grid(path, one["pitch_mm"])
    fingertip = grids.Fingertip(measure, grid.layout, grid.pitch_mm)
    readings, xy = grid.reading_Pa[grid.judged], grid.xy[grid.judged]
    inside, outside = grid.inside[grid.judged], grid.outside[grid.judged]
    set_by_hand = {"sigma_mm": float(np.median(grid.width_mm)), "sigma_sd_mm": grids.PRIOR_WIDTH_MM}
    sessions = np.array(grid.sessions(SEED))
    calibrations = fingertip.calibrate(grid.reading_Pa[sessions])
    in_rows = fingertip.calibrate(grid.reading_Pa[np.sort(sessions)])  # as the gantry went
    solved = [one for one in calibrations if one.found["solved"]]
    torn, torn_xy = one_missing(readings[inside]), np.repeat(xy[inside], readings.shape[1], axis=0)
    calibrated = [grids.Errors(fingertip.fit(readings, one.response), xy) for one in solved]
    missing = [grids.Errors(fingertip.fit(torn, one.response), torn_xy) for one in solved]
    shipped, raw = (grids.Errors(fingertip.fit(readings, known), xy) for known in (None, set_by_hand))
    guided = fingertip.guided(grid, SEED)
    worse = np.zeros(4)  # sessions whose median, 95th percentile, silent presses are more than as shipped; with any silent by their sds
    after = {}
    for way, several in (("random", calibrations), ("rows", in_rows), ("guided", guided)):
        errors = [grids.Errors(fingertip.fit(readings, one.response), xy).figures(inside, outside) for one in several if one.good]
        for each in errors:
            worse += [*(each[name] > shipped.figures(inside, outside)[name] for name in COMPARED), each["silent_by_sd"]]
        after[way] = [100 * len(errors) / len(several), *(mean_of(errors, name) for name in COMPARED)]
    found = {
        "recording": one["key"],
        "part": one["part"],
        "width_mm": set_by_hand["sigma_mm"],
        "dip_percent": 100 * grids.dip_share(grid),
        "gains_cv_percent": 100 * float(grid.peak_Pa.std() / grid.peak_Pa.mean()),
        "places_off_mm": float(np.median(grid.places_off_mm)),
        "shipped": shipped.figures(inside, outside),
        "raw": raw.figures(inside, outside),
        "sessions": len(calibrations),
        "accepted": sum(one.good for one in calibrations),
        "reasons": sorted({one.found["reason"].decode() for one in calibrations} - {"none"}),
        "rows_accepted": sum(one.good for one in in_rows),
        "accepted_percent_p50_p95_mm_silent_percent": after,
        "width_found_mm": grids.quantile([one.found["width_mm"] for one in solved], 0.5),
        "worse_median_p95_silent_by_sd": worse.tolist(),
    }
    if calibrated:
        figures = [each.figures(inside, outside) for each in calibrated]
        found["calibrated"] = {name: mean_of(figures, name) for name in figures[0]}
        found["one_missing_over_1mm_percent"] = grids.percent(np.concatenate([each.error_mm for each in missing]) > 1.0)
    shown = {
        "grid": grid,
        "inside": inside,
        "shipped": shipped,
        "raw": raw,
        "calibrated": calibrated[0] if calibrated else None,
        "to_pace": [(fingertip, readings[inside], xy[inside], one) for one in calibrations if one.good],
    }
    return found, shown


def by_time(rows, key):
    """Of all the time in which nothing touches, of all rows together."""
    return float(np.average([row[key] for row in rows], weights=[row["free_s"] for row in rows])) if rows else None


def mean_of(rows, *keys):
    values = [functools.reduce(lambda found, key: (found or {}).get(key), keys, row) for row in rows]
    return None if not values or None in values else float(np.mean(values))


def judge_grids(measure, source, here):
    found, shown = [], {}
    for one in source["files"]:
        if one["name"] in here:
            print(f"        {one['key']}", flush=True)
            row, shown[one["key"]] = judge_grid(measure, one, here[one["name"]])
            found.append(row)
    rows = [row for row in found if row["part"] == "judges"]
    figures = {f"raw_{name}": mean_of(rows, "raw", name) for name in ("inside_p50_mm", "over_2mm_percent")}
    cal = [name for name, _, _ in GOALS if name.startswith("cal_")]
    figures |= {name: mean_of(rows, "calibrated", name.removeprefix("cal_")) for name in cal}
    figures["cal_cover_1sd_most_percent"] = figures["cal_cover_1sd_percent"]
    for name, accepted in (("sessions_accepted_percent", "accepted"), ("rows_accepted_percent", "rows_accepted")):
        figures[name] = 100 * sum(row[accepted] for row in rows) / sum(row["sessions"] for row in rows) if rows else None
    worse = np.sum([row["worse_median_p95_silent_by_sd"] for row in found], axis=0).tolist() if found else [None] * 4
    figures |= dict(zip((*(f"worse_{what}_after_accept" for what in ("median", "p95", "silent")), "silent_after_accept_by_sd"), worse))
    figures["one_missing_over_1mm_percent"] = mean_of(rows, "one_missing_over_1mm_percent")
    return {**figures, "grids": found}, shown


def judge_strips(firmware, source, here):
    wanted = [one for one in source["files"] if one["name"] in here]
    names = ("phantom_percent_1308", "phantom_percent_57", "doubted_percent")
    print(f"        {len(wanted)} recordings of strips", flush=True)
    read = {one["name"]: (one["part"], strips.Strip(here[one["name"]])) for one in wanted}
    rates = {name: [strip.gate(firmware, *rate) for rate in strips.RATES] for name, (_, strip) in read.items()}
    judged = [one for name, (part, _) in read.items() if part == "judges" for one in rates[name]]
    fast, slow = ([one for one in judged if one["frames_per_s"] == rate] for rate in (1308.0, 57.0))
    columns = ((fast, "phantom_percent"), (slow, "phantom_percent"), (fast, "doubted_percent"))
    return {
        **{name: by_time(*column) for name, column in zip(names, columns)},
        **{f"{name}_by_file": mean_of(*column) for name, column in zip(names, columns)},
        "holds_missed": sum(one["held_missed"] for one in judged) if judged else None,
        "strips": [
            {"recording": name, "part": part, "holds": len(strip.holds)}
            | {f"{key} at {rate['frames_per_s']:g}/s": rate[key] for rate in rates[name] for key in rate if key != "frames_per_s"}
            for name, (part, strip) in read.items()
        ],
    }


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("folder", metavar="FOLDER", help="with the recordings, in any folders below it")
    parser.add_argument(
        "--sources", default=pathlib.Path(__file__).with_name("sources.json"), metavar="FILE.json", help="which recordings there are"
    )
    parser.add_argument("--pads", type=int, default=30, help="simulated ones for the run times (default: %(default)s)")
    options = parser.parse_args(argv)
    output_folder(options)
    firmware = Measure(options.build)
    os.environ["FINGERTIP_TOOL"] = str(firmware.build / "host_tools/tool/cli/fingertip")
    sources = json.loads(pathlib.Path(options.sources).read_text(encoding="utf-8"))
    here = found_below(options.folder, sources)
    found, shown = judge_grids(firmware, sources["grids"], here)
    print("        run times", flush=True)
    judges = [row["recording"] for row in found["grids"] if row["part"] == "judges"]
    found["pace"] = pace.twin_rows(firmware, options.pads) + pace.rows("real", [pad for key in judges for pad in shown[key]["to_pace"]])
    found |= judge_strips(firmware, sources["strips"], here)
    missing = sorted(one["name"] for source in sources.values() for one in source["files"] if one["name"] not in here)
    found["missing_recordings"] = ", ".join(missing) or "none"
    found["recordings"] = [{key: source[key] for key in ("repository", "commit", "terms", "what")} for source in sources.values()]
    found = judge(found, GOALS)
    pictures = {
        "real.png": lambda path: real_report.draw(found, shown, path),
        "pace.png": lambda path: real_report.draw_pace(found["pace"], path),
    }
    return publish(found, options, "real", pictures)


if __name__ == "__main__":
    sys.exit(run_tool("real.py", main))
