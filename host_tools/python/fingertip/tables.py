"""Reads tables of pressures as laboratories have them: any separator, decimal commas, dates, units by name, cells without a number."""

import contextlib
import csv
import dataclasses
import datetime
import math
import re
import sys
import warnings

import numpy as np

from .command import printable, progress
from .errors import InputError
from .files import check_kind_of_file
from .frames import FloatArray

UNITS = {"Pa": 1.0, "hPa": 100.0, "kPa": 1000.0, "mbar": 100.0, "bar": 1e5, "psi": 6894.757, "mmHg": 133.322}
NO_PRESSURE = re.compile(r"(t|x|y|z|f|q[xyz]?|time|temp[0-9]*|temperature[0-9]*|force|row|frame|index)([_ (\[].*)?", re.IGNORECASE)
UNIT_NAMED = re.compile(rf"(?<![A-Za-z])({'|'.join(UNITS)})(?![A-Za-z])")
SECONDS = {"milli": 1e-3, "m": 1e-3, "micro": 1e-6, "u": 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, "\ufffd": 1e-6, "nano": 1e-9, "n": 1e-9}
TIME_NAMED = re.compile(rf"(?<![a-z])({'|'.join(SECONDS)})s(?:ecs?|econds?)?(?![a-z])")
CLOCK = re.compile(r"\d:\d|\d{4}-\d\d-\d\d|\d\.\d+\.\d{4}")
MOST_bytes = 1 << 29
DECIMAL = re.compile(r"[-+]?\d*([.,])\d+(?:[eE][-+]?\d+)?")
MISSING = ("", "na", "n/a", "#n/a", "null", "none", "-", "--")  # as programs write a cell that has no number


def _number(cell: str) -> float | None:
    """Seconds of a date or a time of day, NaN of a cell that has none; None: no number."""
    with contextlib.suppress(ValueError):
        return float(cell)
    if cell.lower() in MISSING:
        return math.nan
    if not CLOCK.search(cell):
        return None
    text = re.sub(r"^(\d+)\.(\d+)\.(\d{4})", lambda found: f"{found[3]}-{found[2]:0>2}-{found[1]:0>2}", cell)
    text = re.sub(r"(?<!\d)(\d):", r"0\1:", text).replace("Z", "+00:00")
    text = re.sub(r"[.,](\d+)", lambda found: f".{found[1][:6]:0<6}", text)
    with contextlib.suppress(ValueError):
        moment = datetime.datetime.fromisoformat(text if "-" in text else f"1970-01-01 {text}")
        return (moment if moment.tzinfo else moment.replace(tzinfo=datetime.timezone.utc)).timestamp()
    return None


def _cells(line: str) -> list[str]:
    separator = next((each for each in ";\t," if each in line), None)
    if separator:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    return [cell.rstrip(",") for cell in line.split()]


@dataclasses.dataclass
class _Table:
    """heads: lines before the first row of numbers; clocks: columns with dates or times of day; points: decimal points or commas."""

    heads: list[list[str]] = dataclasses.field(default_factory=list)
    rows: list[list[float]] = dataclasses.field(default_factory=list)
    clocks: set[int] = dataclasses.field(default_factory=set)
    points: set[str] = dataclasses.field(default_factory=set)
    wrong: str = "it is empty"

    def _numbers(self, cells: list[str]) -> list[float | None]:
        self.points |= {point for point in ".," if any(point in cell and DECIMAL.fullmatch(cell) for cell in cells)}
        if len(self.points) > 1:
            raise ValueError("points and commas are both in numbers; write no thousands")
        cells = [cell.replace(",", ".") if "," in cell and DECIMAL.fullmatch(cell) else cell for cell in cells]
        try:
            return [float(cell) for cell in cells]
        except ValueError:
            self.clocks |= {k for k, cell in enumerate(cells) if CLOCK.search(cell)}
            return [_number(cell) for cell in cells]

    def take(self, cells: list[str]) -> None:
        """Raises ValueError."""
        numbers = self._numbers(cells)
        values = [each for each in numbers if each is not None]
        is_first = not self.rows or (len(self.rows) == 1 and np.isfinite(self.rows[0]).sum() <= 1)  # a date, perhaps, above the table
        if len(values) < len(cells):
            text = printable(cells[numbers.index(None)][:40])
            self.wrong = f'"{text}" is no number, nor a time as 2024-05-06 07:08:09; leave the cell empty, or delete the line'
            if not is_first or (numbers[0] is not None and np.isfinite(values).sum() > len(cells) / 2):
                raise ValueError(self.wrong)
        if len(values) < len(cells) or (is_first and not np.isfinite(values).any()):
            self.heads.append(cells)
            self.rows = []
        elif not self.rows or len(values) == len(self.rows[0]):
            self.rows.append(values)
        elif is_first:
            self.rows = [values]
        else:
            raise ValueError(f"{len(values)} cells, and {len(self.rows[0])} before; delete the line if it was cut")


def read_numbers(path: str) -> tuple[list[str], FloatArray, set[int]]:
    """(names of the columns from the lines before the first row of numbers, rows, columns of dates or times of day, in seconds) of a text file with
    comma, semicolon, tab or blanks between cells. Raises InputError, which names the line."""
    try:
        with contextlib.nullcontext(sys.stdin.buffer) if path == "-" else open(path, "rb") as file:
            data = file.read(MOST_bytes + 1)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    if len(data) > MOST_bytes:
        raise InputError(f"{path}: more than {MOST_bytes // 10**6} MB; give a part of it")
    check_kind_of_file(path, data)
    lines = data.decode("utf-8-sig", "replace").splitlines()
    found = _Table()
    with progress("reading") as show:
        for number, line in enumerate(lines, 1):
            if number % 1000 == 0:
                show(number / len(lines))
            if line.strip() and not line.lstrip().startswith("#"):
                try:
                    found.take(_cells(line))
                except (csv.Error, ValueError) as error:
                    raise InputError(f"{path}:{number}: {error}") from None
    if not found.rows:
        raise InputError(f"{path}: no row of numbers in it; {found.wrong}")
    table = np.array(found.rows)
    table = table[: np.flatnonzero(np.isfinite(table).any(axis=1)).max(initial=0) + 1]  # rows of separators may be behind it
    count = table.shape[1]
    heads = [[*cells, ""] for cells in found.heads if len(cells) in (count, count - 1) and 2 * sum(map(bool, cells)) > len(cells)]
    return [" ".join(names).strip() for names in zip(*heads)][:count], table, found.clocks


def read_table(path: str, sensors: int, first: int | None, time: int | None, unit: str) -> tuple[FloatArray, FloatArray | None]:
    """(pressures [row, sensor], time [row] in seconds or None) of such a file. first, time: columns counted from 1. Raises InputError, and warns of
    columns that look like others."""
    head, table, clocks = read_numbers(path)
    ends = table.shape[1] > sensors and np.isnan(table[:, -1]).all()  # each line ends with a separator
    if ends and not (head[-1] if head else table.shape[1] == sensors + 1 and _rises(table[:, 0])):
        head, table = head[:-1], table[:, :-1]
    count = table.shape[1]
    begin = count - sensors if first is None else first - 1
    if begin < 0 or begin + sensors > count or (first is None and begin > 1) or not 0 <= (time or 1) - 1 < count:
        raise InputError(f"{path}: {count} columns, and the pad has {sensors} sensors; give --first N, of sensor 0, and --time N")
    column = time if time is not None else 1 if first is None and begin == 1 else None
    if time is None and column and len(fallen := 1 + np.flatnonzero(~(np.diff(table[:, 0]) > 0))):
        raise InputError(f"{path}: column 1 of {count} would be the time, and does not rise after row {fallen[0]}; give --first N")
    for at in range(begin, begin + sensors):
        name = head[at] if head else ""
        if NO_PRESSURE.fullmatch(name) or at in clocks or _rises(table[:, at]):
            what = "has times" if at in clocks else "rises evenly, as a time or a row's number"
            wrong = f'is "{printable(name)}", no pressure' if NO_PRESSURE.fullmatch(name) else what
            raise InputError(f"{path}: column {at + 1}, of sensor {at - begin}, {wrong}; --first N is the column of sensor 0")
        if len(table) > 1 and np.ptp(table[:, at]) == 0.0:
            warnings.warn(f"column {at + 1}, of sensor {at - begin}, never changes; leave its cells empty if the sensor is dead")
    if units := {found[1] for name in head[begin : begin + sensors] if (found := UNIT_NAMED.search(name))} - {unit}:
        warnings.warn(f"columns are named as in {' or '.join(sorted(units))}, and read as {printable(unit)}; give --unit {min(units)}?")
    if times := [at + 1 for at in range(count) if column is None and _rises(table[:, at])]:
        warnings.warn(f"column {times[0]} rises evenly: a time? Give --time {times[0]}; without it each row is a held contact")
    named = TIME_NAMED.search(head[column - 1].lower()) if head and column and column - 1 not in clocks else None
    return table[:, begin : begin + sensors], None if column is None else table[:, column - 1] * (SECONDS[named[1]] if named else 1.0)


def _rises(values: FloatArray) -> bool:
    """Evenly, but for gaps."""
    steps = np.diff(values)
    return len(steps) >= 8 and bool((steps > 0).all() and np.quantile(steps, 0.9) < 1.5 * np.quantile(steps, 0.1))
