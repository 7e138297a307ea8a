#!/usr/bin/python3
"""The least-squares optimum in double precision that the fingertip's fit is measured against.

    reference.py fit [FILE.csv] [--noise PA]    the optimum of each row of readings

FILE is a recording with the raw stream or a scenario; without it, the standard input. A row keeps its first cell; distance_mm is from its x_mm,
y_mm; a sensor with an empty cell is left out. Readings are above each sensor's zero (columns tare0_Pa ..., where there are any) and over the gains of
a calibrated fingertip, as the fit gets them.
"""

import argparse
import csv
import pathlib
import sys
from types import SimpleNamespace

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/measure", "python")]
import presses  # noqa: E402
from fingertip.files import InputError, run_tool  # noqa: E402
from measure import Measure, usable_of  # noqa: E402

ABSOLUTE_Pa = 50e3  # no pad weighs on all of its sensors by this
SENSORS_MIN = 4
FOUND = (("best_x_mm", "x_mm"), ("best_y_mm", "y_mm"), ("best_p0_Pa", "p0_Pa"), ("best_sigma_mm", "sigma_mm"), ("best_force_N", "force_N"))
ROWS_AT_ONCE = 2000


class Table:
    """Rows of readings: names of the columns, and for each row its first cell, readings_Pa [sensor] and what else fit needs."""

    def __init__(self, lines, path):
        self.path, self.gains, self.lines = path, np.ones(presses.SENSORS), self.numbered(lines)
        self.names = next(self.lines, (0, None))[1]
        if self.names is None:
            raise InputError(f"{path}: no header; the first line names the columns")
        if "device" in self.names:
            raise InputError(f"{path}: holds several fingertips; record each alone")
        for k in range(presses.SENSORS):
            if f"s{k}_Pa" not in self.names:
                what = f"give readings of all {presses.SENSORS} sensors, a recording with the raw stream, or a scenario"
                raise InputError(f"{path}: has no column s{k}_Pa; {what}")
        self.with_zero = "tare0_Pa" in self.names

    def numbered(self, lines):
        """(number, cells) of each row, without comments, of which the gains count."""
        for number, line in enumerate(lines, 1):
            line = line.rstrip("\r\n")
            if line.startswith("# gains: "):
                self.gains = self.gains_of(number, line.removeprefix("# gains: ").split(" "))
            if line and not line.startswith("#"):
                yield number, next(csv.reader([line]))

    def gains_of(self, number, words):
        if len(words) != presses.SENSORS:
            raise InputError(f"{self.path}:{number}: {len(words)} gains for {presses.SENSORS} sensors")
        gains = [self.number(number, word) for word in words]
        for word, gain in zip(words, gains):
            if not gain > 0:
                raise InputError(f"{self.path}:{number}: '{word}' is no gain")
        return np.array(gains)

    def number(self, number, cell):
        try:
            return float(cell) if cell else np.nan
        except ValueError:
            raise InputError(f"{self.path}:{number}: '{cell}' is not a number") from None

    def rows(self, noise_Pa):
        for number, cells in self.lines:
            if len(cells) != len(self.names):
                raise InputError(f"{self.path}:{number}: has {len(cells)} cells, its header {len(self.names)}")
            row = dict(zip(self.names, cells))
            value = {name: self.number(number, row.get(name, "")) for name in ("noise_Pa", "x_mm", "y_mm")}
            reading, tare = (
                np.array([self.number(number, row.get(f"{name}{k}_Pa", "")) for k in range(presses.SENSORS)]) for name in ("s", "tare")
            )
            readings_Pa = (reading - (tare if self.with_zero else 0.0)) / self.gains
            there = readings_Pa[~np.isnan(readings_Pa)]
            if no_zero := len(there) > 0 and there.min() > ABSOLUTE_Pa:
                if not self.with_zero:
                    raise InputError("the readings are absolute pressures; subtract each sensor's zero, or give its column tare0_Pa, ...")
            fits = len(there) >= SENSORS_MIN and there.max() > 0 and not no_zero
            noise = noise_Pa if np.isnan(value["noise_Pa"]) else value["noise_Pa"]
            yield SimpleNamespace(
                first=cells[0], readings_Pa=readings_Pa, fits=fits, noise_Pa=noise, x_mm=value["x_mm"], y_mm=value["y_mm"]
            )


def print_optima(measure, options):
    if options.file == "-":
        return print_rows(measure, Table(sys.stdin, "standard input"), options.noise)
    try:
        with open(options.file, encoding="utf-8") as lines:
            return print_rows(measure, Table(lines, options.file), options.noise)
    except OSError:
        raise InputError(f"{options.file}: cannot read it; does it exist?") from None


def print_rows(measure, table, noise_Pa):
    compared = presses.Compared(measure)
    names = [name for name, _ in FOUND]
    print(table.names[0], *names, "location_sd_mm", "condition_number", "observable", "at_bound", "distance_mm", sep=",")
    rows = list(table.rows(noise_Pa))
    for start in range(0, len(rows), ROWS_AT_ONCE):
        some = rows[start : start + ROWS_AT_ONCE]
        readings_Pa = np.array([row.readings_Pa for row in some])
        usable = np.where([row.fits for row in some], usable_of(readings_Pa), np.uint32(0)).astype(np.uint32)
        best = compared.optimum(1024 * np.nan_to_num(readings_Pa), usable, [row.noise_Pa for row in some])
        for row, found in zip(some, best):
            print_row(row, found)


def print_row(row, found):
    if not row.fits:
        return print(row.first + 10 * ",")
    located = bool(found["observable"]) and np.nanmax(row.readings_Pa) >= presses.GATE_NOISES * row.noise_Pa
    distance_mm = np.hypot(found["x_mm"] - row.x_mm, found["y_mm"] - row.y_mm)
    cells = [f"{found[field]:.7g}" for _, field in FOUND] + [f"{found[field]:.4g}" for field in ("location_sd_mm", "condition_number")]
    return print(
        row.first,
        *cells,
        int(located),
        int(found["at_bound"]),
        f"{distance_mm:.5g}" if located and np.isfinite(distance_mm) else "",
        sep=",",
    )


def noise(text):
    if not 0.01 <= float(text) <= 10000:
        raise argparse.ArgumentTypeError("from 0.01 to 10000")
    return float(text)


def main(argv):
    parser = argparse.ArgumentParser(prog="reference.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=ROOT / "build/host", metavar="DIR", help="build folder of the host tools (default: %(default)s)")
    parser.add_argument("command", choices=["fit"])
    parser.add_argument("file", nargs="?", default="-", metavar="FILE.csv", help="the readings; - is standard input, the default")
    parser.add_argument(
        "--noise", type=noise, default=5.0, metavar="PA", help="of a sensor, rms, without a column noise_Pa (default: %(default)s)"
    )
    options = parser.parse_args(argv)
    print_optima(Measure(options.build), options)
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("reference.py", main))
