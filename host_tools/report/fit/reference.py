#!/usr/bin/python3
"""The least-squares optimum in double precision that the fingertip's fit is measured against.

    reference.py fit [FILE.csv] [--noise PA]    the optimum of each row of readings

FILE is a recording with the raw stream or a scenario; without it, the standard input. A row keeps its first cell; distance_mm is from its x_mm,
y_mm; a sensor with an empty cell is left out. Readings are above each sensor's zero (columns tare0_Pa ..., where there are any) and over the gains of
a calibrated fingertip, as the fit gets them.
"""

import argparse
import pathlib
import sys
from types import SimpleNamespace

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/measure", "python")]
import presses  # noqa: E402
from fingertip.files import InputError, check_range, read_lines, run_tool  # noqa: E402
from measure import Measure, usable_of  # noqa: E402

ABSOLUTE_Pa = 50e3  # no pad weighs on all of its sensors by this
SENSORS_MIN = 4
FOUND = (("best_x_mm", "x_mm"), ("best_y_mm", "y_mm"), ("best_p0_Pa", "p0_Pa"), ("best_sigma_mm", "sigma_mm"), ("best_force_N", "force_N"))
ROWS_AT_ONCE = 2000


def number(where, cell):
    try:
        return float(cell or "nan")
    except ValueError:
        raise InputError(f"{where}: '{cell}' is not a number") from None


def read(lines, path, noise_Pa):
    """(name of the first column, rows): of each its first cell, readings_Pa [sensor] and what else the fit needs."""
    lines = [line.rstrip("\r\n") for line in lines]
    marked = next((line for line in lines if line.startswith("# gains: ")), "# gains:" + presses.SENSORS * " 1")
    gains = np.array([number(path, word) for word in marked.removeprefix("# gains: ").split(" ")])
    if len(gains) != presses.SENSORS or not (gains > 0).all():
        raise InputError(f"{path}: the gains of {presses.SENSORS} sensors are not {len(gains)} above 0")
    (_, names), *table = [(at, line.split(",")) for at, line in enumerate(lines, 1) if line and line[0] != "#"] or [(0, [""])]
    if missing := [name for name in (f"s{k}_Pa" for k in range(presses.SENSORS)) if name not in names]:
        raise InputError(f"{path}: has no column {missing[0]}; give a recording with the raw stream, or a scenario")
    if "device" in names:
        raise InputError(f"{path}: holds several fingertips; record each alone")
    rows = []
    for at, cells in table:
        if len(cells) != len(names):
            raise InputError(f"{path}:{at}: has {len(cells)} cells, its header {len(names)}")
        row = dict(zip(names, cells))
        noise, x_mm, y_mm, *pressures = (
            number(f"{path}:{at}", row.get(name, ""))
            for name in ("noise_Pa", "x_mm", "y_mm", *(f"{kind}{k}_Pa" for kind in ("s", "tare") for k in range(presses.SENSORS)))
        )
        reading, tare = np.reshape(pressures, (2, presses.SENSORS))
        readings_Pa = (reading - (tare if "tare0_Pa" in names else 0.0)) / gains
        there = readings_Pa[~np.isnan(readings_Pa)]
        no_zero = len(there) > 0 and there.min() > ABSOLUTE_Pa
        if no_zero and "tare0_Pa" not in names:
            raise InputError("the readings are absolute pressures; subtract each sensor's zero, or give its column tare0_Pa, ...")
        fits = len(there) >= SENSORS_MIN and there.max() > 0 and not no_zero
        noise = noise_Pa if np.isnan(noise) else noise
        rows.append(SimpleNamespace(first=cells[0], readings_Pa=readings_Pa, fits=fits, noise_Pa=noise, x_mm=x_mm, y_mm=y_mm))
    return names[0], rows


def print_optima(measure, options):
    path = pathlib.Path("/dev/stdin" if options.file == "-" else options.file)
    first, rows = read(read_lines(path), path, options.noise)
    compared = presses.Compared(measure)
    print(first, *(name for name, _ in FOUND), "location_sd_mm", "condition_number", "observable", "at_bound", "distance_mm", sep=",")
    for start in range(0, len(rows), ROWS_AT_ONCE):
        some = rows[start : start + ROWS_AT_ONCE]
        readings_Pa = np.array([row.readings_Pa for row in some])
        usable = np.where([row.fits for row in some], usable_of(readings_Pa), np.uint64(0))
        best = compared.optimum(1024 * np.nan_to_num(readings_Pa), usable, [row.noise_Pa for row in some])
        for row, found in zip(some, best):
            print_row(row, found)


def print_row(row, found):
    if not row.fits:
        return print(row.first + 10 * ",")
    located = bool(found["observable"]) and np.nanmax(row.readings_Pa) >= presses.GATE_NOISES * row.noise_Pa
    distance_mm = np.hypot(found["x_mm"] - row.x_mm, found["y_mm"] - row.y_mm)
    cells = [f"{found[field]:.7g}" for _, field in FOUND] + [f"{found[field]:.4g}" for field in ("location_sd_mm", "condition_number")]
    cells += [int(located), int(found["at_bound"]), f"{distance_mm:.5g}" if located and np.isfinite(distance_mm) else ""]
    return print(row.first, *cells, sep=",")


def main(argv):
    parser = argparse.ArgumentParser(prog="reference.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=ROOT / "build/host", metavar="DIR", help="build folder of the host tools (default: %(default)s)")
    parser.add_argument("command", choices=["fit"])
    parser.add_argument("file", nargs="?", default="-", metavar="FILE.csv", help="the readings; - is standard input, the default")
    parser.add_argument("--noise", type=float, default=5.0, metavar="PA", help="of a sensor, rms, without a column noise_Pa; default 5")
    options = parser.parse_args(argv)
    check_range("noise", options.noise, 0.01, 10000)
    print_optima(Measure(options.build), options)
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("reference.py", main))
