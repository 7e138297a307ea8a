"""Fits the pressures of any array by the firmware's own code: `fingertip fit`, which starts this.

found = fingertip.fit(pressures_Pa, "2x4") plt.plot(found["x_mm"], found["y_mm"], ".")
"""

import argparse
import contextlib
import functools
import itertools
import json
import os
import pathlib
import shutil
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .arrays import Firmware, MeasureError, q10, round_half_away, usable_of
from .errors import InputError
from .files import printable, run_tool, write_text
from .line import Flag

FloatArray = npt.NDArray[np.float64]
Described = str | os.PathLike[str] | Mapping[str, Any]

UNITS = {"Pa": 1.0, "hPa": 100.0, "kPa": 1000.0, "mbar": 100.0, "bar": 1e5, "psi": 6894.757, "mmHg": 133.322}
SHAPES = ("undecided", "round", "pulled", "elongated", "two", "none")
NOISE_Pa = 10.0
ROWS_AT_ONCE = 4096
MOST_Pa = 1e6  # no such barometer measures more
ABSOLUTE_Pa = 3e4  # the air is more, and touches are not in the median of all readings
PLACEMENT_Pa, PLACEMENTS, EVERY_s = 1500.0, 40, 8.0  # of a calibration: readings lighter than this are no placement


class Pad(NamedTuple):
    """x_mm, y_mm [sensor]; thickness_mm of the rubber, 0: not known."""

    name: str
    x_mm: FloatArray
    y_mm: FloatArray
    pitch_mm: float
    thickness_mm: float
    overhang_mm: float


def tool() -> str:
    """The command fingertip: FINGERTIP_TOOL, or that of PATH. Raises InputError."""
    found = os.environ.get("FINGERTIP_TOOL") or shutil.which("fingertip")
    if not found:
        raise InputError("the command fingertip computes this, and is not installed; install it, or name it in FINGERTIP_TOOL")
    return found


def _installed(*places: str) -> pathlib.Path:
    """The first of these that there is, from the tool's folder: in the tree that it is built in, or where it is installed."""
    for path in (pathlib.Path(tool()).resolve().parent / place for place in places):
        if path.exists():
            return path
    raise InputError(f"{places[0]} is not installed; install all of the tool, or build the targets fingertip and fingertip_fit")


@functools.cache
def firmware() -> Any:
    return Firmware(_installed("../../../arrays/libfingertip_fit.so", "../libexec/fingertip/libfingertip_fit.so"))


def _described(what: Described, folder: pathlib.Path | None = None) -> Mapping[str, Any]:
    """Of a name in the folder, a file, or its content."""
    if isinstance(what, Mapping):
        return what
    path = pathlib.Path(what)
    if folder and path.name == str(what) and not path.suffix:
        path = folder / f"{what}.json"
        if not path.exists():
            known = ", ".join(sorted(each.stem for each in folder.glob("*.json")))
            raise InputError(f"{printable(str(what))}: no such pad; give {known}, or a FILE.json that describes yours")
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, TypeError, ValueError) as error:
        raise InputError(f"{printable(str(path))}: {error}") from None


def read_pad(pad: Described) -> Pad:
    """A name that the tool knows, a file, or its content (boards/pads/README.md). Raises InputError."""
    text = _described(pad, None if isinstance(pad, Mapping) else _installed("pads", "../share/fingertip/pads"))
    name, rubber = str(text.get("name", "the pad")), text.get("rubber", {})
    try:
        pitch_mm = float(text["pitch_mm"])
        if "places_mm" in text:
            places = np.array(text["places_mm"], float).reshape(-1, 2)
        else:
            columns, rows = int(text["columns"]), int(text["rows"])
            nodes = np.column_stack(np.divmod(np.arange(columns * rows), rows))
            places = pitch_mm * (nodes - (np.array([columns, rows]) - 1) / 2)
        thickness_mm, overhang_mm = (float(rubber.get(key, 0)) for key in ("thickness_mm", "overhang_mm"))
        return Pad(name, places[:, 0].copy(), places[:, 1].copy(), pitch_mm, thickness_mm, overhang_mm)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{name}: {type(error).__name__} {error}; boards/pads/README.md has what a pad is described by") from None


def _readings(pressures: npt.ArrayLike, pad: Pad, unit: str, zero_rows: int, noise_Pa: float) -> FloatArray:
    """Pa above the zero [row, sensor]. Raises InputError where they cannot be those of touches on the pad."""
    if unit not in UNITS:
        raise InputError(f"{printable(unit)} is no unit; give one of {', '.join(UNITS)}")
    table = UNITS[unit] * np.asarray(pressures, float)
    if table.ndim != 2 or table.shape[1] != len(pad.x_mm):
        raise InputError(
            f"pressures are {' x '.join(map(str, table.shape))}, and pad {pad.name} has {len(pad.x_mm)} sensors: rows x {len(pad.x_mm)}"
        )
    if np.isinf(table).any() or not np.isfinite(table).any():
        raise InputError("a pressure is infinite, or none is a number; where a sensor has none, give nan")
    if zero_rows:
        table = table - np.nanmean(table[:zero_rows], axis=0)
    most, middle = np.nanmax(table), np.nanmedian(table)
    wrong = ""
    if abs(middle) > ABSOLUTE_Pa and most < MOST_Pa:
        wrong = f"pressures are of {middle / 1000:.0f} kPa, as the air's; give the number of rows at rest at the beginning (zero)"
    elif most > MOST_Pa:
        wrong = f"the largest pressure is {most:.3g} Pa, more than such sensors measure; give their unit"
    elif most < 6 * noise_Pa:
        wrong = f"the largest pressure is {most:.3g} Pa, below six times the noise of {noise_Pa:g} Pa: nothing touches, or the unit is another (kPa?)"
    if wrong:
        raise InputError(wrong)
    return table


def inputs(
    chip: Any,
    pad: Pad,
    reading_Pa: FloatArray,
    calibration: Mapping[str, Any] | None,
    noise_Pa: float,
    has_profile: bool = False,
    **fields: Any,
) -> tuple[Any, Any, npt.NDArray[np.int32], npt.NDArray[np.uint32], Any]:
    """What the fit gets of readings: fit_array, fit_settings, readings in 1/1024 Pa, bitmap of the usable sensors, fit_own or None. fields: of
    fit_settings."""
    known = calibration or {}

    def of_sensors(name: str, otherwise: float) -> FloatArray:
        values = np.asarray(known.get(name) or np.full(len(pad.x_mm), otherwise), float)
        if values.shape != pad.x_mm.shape:
            raise InputError(f"{name} of the calibration has {len(values)} values, and pad {pad.name} has {len(pad.x_mm)} sensors")
        return values

    prior = {} if has_profile else {"prior_sigma_mm": known.get("sigma_mm", 0.0), "prior_width_mm": known.get("sigma_sd_mm", 0.0)}
    dip = {name: known.get(name, 0.0) for name in ("dip_share", "dip_sd_mm")}
    cut = {"cut_noises": 0} if has_profile else {}
    settings = chip.settings(noise_Pa=noise_Pa, gain_sd=known.get("gain_sd") or None, **(prior | dip | cut | fields))
    own = None
    if known.get("off_x_mm"):
        own = chip.made("fit_own", 1, len(pad.x_mm))
        for key, unit in (("off_x_mm", pad.pitch_mm), ("off_y_mm", pad.pitch_mm), ("wider", 1.0)):
            own[f"{key.removesuffix('_mm')}_q15"] = round_half_away(np.clip(32768.0 * of_sensors(key, 0.0) / unit, -32767, 32767))
    readings = np.clip(reading_Pa / of_sensors("gain", 1.0), -MOST_Pa, MOST_Pa)
    return chip.array(*pad[1:4]), settings, q10(readings), usable_of(reading_Pa), own


def _begins(peak_Pa: FloatArray, noise_Pa: float) -> npt.NDArray[np.int64]:
    """Of each row the first of its contact, by the firmware's gate; -1: nothing touches."""
    of = firmware().constants
    least_Pa = [of[f"gate_{name}_Pa"] + of[f"gate_{name}_noises"] * noise_Pa for name in ("open", "close")]
    begins = [-1]
    for i, peak in enumerate(peak_Pa):
        touched = begins[-1] >= 0
        begins.append(-1 if peak <= least_Pa[touched] else begins[-1] if touched else i)
    return np.array(begins[1:])


def fit(
    pressures: npt.ArrayLike,
    pad: Described,
    *,
    calibration: Described | None = None,
    time_s: npt.ArrayLike | None = None,
    unit: str = "Pa",
    zero_rows: int = 0,
    noise_Pa: float = NOISE_Pa,
) -> dict[str, npt.NDArray[Any]]:
    """Location, force, their standard deviations, flags, tangential force and shape of pressures [row, sensor] above the zero, NaN where a sensor has
    none.

    pad: a name that the tool knows, a file or its content (boards/pads/README.md); tangential force and shape need a rectangle and the rubber's
    thickness. calibration: the same, as calibrate() returns it. time_s [row]: rows follow each other, and are contacts by the firmware's gate;
    without it each is a contact of its own, that is held. zero_rows: so many rows at the beginning are at rest. noise_Pa: rms of a reading.

    Arrays [row] by the names of a recording's columns, NaN where there is none; flags are of fingertip.Flag; shape is of SHAPES. Each row is fitted
    with the 24 before it in its contact. Raises InputError, with the cause. A row takes a millisecond, or without a thickness 20 us."""
    of_pad, known = read_pad(pad), None if calibration is None else _described(calibration)
    reading_Pa = _readings(pressures, of_pad, unit, zero_rows, noise_Pa)
    chip = firmware()
    profile = None
    if of_pad.thickness_mm:
        with contextlib.suppress(MeasureError):  # other than a rectangle has no tangential force
            made = chip.profile(of_pad.thickness_mm, of_pad.overhang_mm, layout=of_pad[1:4])
            chip.call("tangential_pad", chip.array(*of_pad[1:4]), made, chip.made("fit_pad", 1))
            profile = made
    array, settings, readings, usable, own = inputs(chip, of_pad, reading_Pa, known, noise_Pa, profile is not None)
    rows = np.arange(len(readings))
    begins = rows
    if time_s is not None:
        if np.shape(time_s) != rows.shape or not (np.diff(np.asarray(time_s, float)) > 0).all():
            raise InputError("time does not rise from row to row; without a time each row is a contact of its own")
        begins = _begins(readings.max(axis=1) / 1024.0, noise_Pa)
    touched = begins >= 0
    found: dict[str, npt.NDArray[Any]] = {}
    for some in np.array_split(rows[touched], len(rows) // ROWS_AT_ONCE + 1):
        for name, values in _fit(chip, (array, settings, readings, usable, own), profile, known or {}, some, begins[some]).items():
            found.setdefault(name, np.full(len(rows), np.nan if values.dtype == float else 0, values.dtype))[some] = values
    return found


def _fit(
    chip: Any, of: tuple[Any, ...], profile: Any, known: Mapping[str, Any], rows: npt.NDArray[np.int64], begins: npt.NDArray[np.int64]
) -> dict[str, npt.NDArray[Any]]:
    array, settings, readings, usable, own = of
    frames = int(chip.constants["shapes_frames"]) + 1 if profile is not None else 7  # that fit_held() searches
    before = np.maximum(rows[:, None] - np.arange(frames)[::-1], begins[:, None])
    held, usable = readings[before], usable[before]
    fits = chip.fit_held(array, settings, np.ascontiguousarray(held[:, -7:]), np.ascontiguousarray(usable[:, -1]), own=own)
    scale = float(known.get("force_scale") or 0.0)
    force_N = np.zeros((len(rows), 2))
    chip.call("weigh", scale or 1.0, float(known["force_scale_sd"]) if scale else 0.8, fits, readings[rows].max(axis=1) / 1024.0, force_N)
    flags = fits["flags"].astype(np.int64)
    valid = flags & Flag.FIT_VALID != 0
    names = ("x_mm", "y_mm", "location_sd_mm", "p0_Pa", "sigma_mm", "residual_rms_Pa")
    found = {name: np.where(valid, fits[name].astype(float), np.nan) for name in names}
    found |= {"force_N": np.where(valid, force_N[:, 0], np.nan), "force_sd_N": np.where(valid, force_N[:, 1], np.nan)}
    found |= {"flags": flags, "sensors_used": fits["used"].astype(np.int64)}
    if profile is not None:
        _add_shapes(chip, (array, settings, held, usable, own), profile, scale, found)
    return found


def _add_shapes(chip: Any, of: tuple[Any, ...], profile: Any, scale: float, found: dict[str, npt.NDArray[Any]]) -> None:
    """Where the pad and the array are such that the firmware estimates them."""
    array, settings, held, usable, own = of
    rows = len(held)
    published, pad = chip.made("published", rows), chip.made("fit_shapes_pad", 1)
    shapes, places = chip.made("fit_shapes_result", rows, 2), chip.made("shapes_place", rows, 2)
    estimated = chip.tangential(array, profile, settings, held, np.ascontiguousarray(usable), own=own)
    chip.call("publish", profile, np.full(rows, scale), *(np.ascontiguousarray(each[:, -1]) for each in estimated), published)
    with contextlib.suppress(MeasureError):  # rubber too thin for the pitch has no shapes
        chip.call("shapes_pad", array, profile, pad)
        chip.call("held_shapes", array, pad, settings, chip.no_own if own is None else own, held, published, shapes, places)
    last, shape = shapes[:, 1], shapes["shape"][:, 1].astype(np.int64)
    two, edge = (shape == SHAPES.index(name) for name in ("two", "elongated"))
    valid = published["valid"] & ~two
    for name in ("x_mm", "y_mm", "location_sd_mm", "force_N"):
        found[name] = np.where(valid, published[name], found[name])
    for name in ("qx", "qy", "q_sd"):
        found[f"{name}_N"] = np.where(valid, published[name] * published["force_N"], np.nan)
    found["location_sd_mm"] = np.where((shape > 0) & ~two, places["location_sd_mm"][:, 1], found["location_sd_mm"])
    found["shape"] = shape
    for k, (name, factor) in itertools.product(range(2), (("x_mm", 1.0), ("y_mm", 1.0), ("force_N", scale or 1.0))):
        found[name.replace("_", f"{k + 1}_")] = np.where(two, factor * last[name][:, k].astype(float), np.nan)
    found["edge_angle_deg"] = np.where(edge, np.degrees(np.arctan2(last["along_y"], last["along_x"])), np.nan)
    found["edge_length_mm"] = np.where(edge, last["length_mm"].astype(float), np.nan)
    uncertain = found["location_sd_mm"] > chip.constants["location_sd_limit_mm"]
    of_shape = (
        (shape > 0, Flag.SHAPE_VALID),
        (two, Flag.TWO_CONTACTS),
        (edge, Flag.EDGE),
        (shape == SHAPES.index("none"), Flag.SHAPE_UNKNOWN),
    )
    found["flags"] &= ~int(Flag.UNCERTAIN)
    for these, flag in ((valid, Flag.TANGENTIAL_VALID), (uncertain, Flag.UNCERTAIN), *of_shape):
        found["flags"] |= np.where(these, int(flag), 0)


def response_of(found: Any, sensors: Any) -> dict[str, Any]:
    """A calibration as fit() takes it, of records calibration and calibrated_sensor [sensor]."""
    names = {"sigma_mm": "prior_sigma_mm", "sigma_sd_mm": "prior_width_mm"}
    names |= {name: name for name in ("dip_share", "dip_sd_mm", "force_scale", "force_scale_sd")}
    of_sensors = {"gain": "gain", "gain_sd": "reading_sd"} | (
        {name: name for name in ("off_x_mm", "off_y_mm", "wider")} if found["has_own"] else {}
    )
    response: dict[str, Any] = {key: float(found[name]) for key, name in names.items()}
    return response | {key: sensors[name].tolist() for key, name in of_sensors.items()}


def calibrate(
    pressures: npt.ArrayLike,
    pad: Described,
    *,
    force_N: float | None = None,
    unit: str = "Pa",
    zero_rows: int = 0,
    noise_Pa: float = NOISE_Pa,
) -> dict[str, Any]:
    """What the tool's calibration finds of rows in which one weight, of force_N if it is known, stands at different places: at most 40 of them, from
    all over the file. As fit() takes it. Raises InputError where they do not determine the gains."""
    of_pad = read_pad(pad)
    reading_Pa = _readings(pressures, of_pad, unit, zero_rows, noise_Pa)
    pressed = np.flatnonzero(np.nan_to_num(reading_Pa).max(axis=1) >= PLACEMENT_Pa)
    reading_Pa = reading_Pa[pressed[np.linspace(0, len(pressed) - 1, min(PLACEMENTS, len(pressed))).astype(int)]]
    t_s = EVERY_s * np.arange(len(reading_Pa))
    found, sensors, _ = firmware().calibrate(*of_pad[1:4], t_s[None], reading_Pa[None], noise_Pa, force_N=force_N or 1.0)
    if found[0]["state"] != 1:
        raise InputError(f"not calibrated from {len(t_s)} placements: {found[0]['reason'].decode()} (host_tools/README.md, Calibrate)")
    return response_of(found[0], sensors[0]) | ({} if force_N else {"force_scale": 0.0, "force_scale_sd": 0.0})


def read_table(path: str, sensors: int, first: int | None = None, time: int | None = None) -> tuple[FloatArray, FloatArray | None]:
    """(pressures [row, sensor], time [row] or None) of a text file with comma, semicolon, tab or blanks between cells; what is before the first row of
    numbers is a head. first, time: columns counted from 1. Raises InputError, which names the line."""
    rows: list[list[float]] = []
    count = 0
    try:
        text = sys.stdin.read() if path == "-" else pathlib.Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    for number, line in enumerate(map(str.strip, text.splitlines()), 1):
        if not line or line.startswith("#"):
            continue
        cells = line.split(next((each for each in ",;\t" if each in line), None))
        try:
            values = [float(cell) if cell.strip() else float("nan") for cell in cells]
        except ValueError as error:
            if rows:
                raise InputError(f"{path}:{number}: {error}; where a sensor has none, leave the cell empty") from None
            continue
        if rows and len(values) != count:
            raise InputError(f"{path}:{number}: {len(values)} cells, and {count} before")
        count = len(values)
        rows.append(values)
    if not rows:
        raise InputError(f"{path}: no row of numbers in it")
    begin = count - sensors if first is None else first - 1
    if begin < 0 or begin + sensors > count or (first is None and begin > 1) or not 0 <= (time or 1) - 1 < count:
        raise InputError(
            f"{path}: {count} columns, and the pad has {sensors} sensors; give their columns, or the time and those, or --first N, the column of "
            "sensor 0, and --time N"
        )
    table = np.array(rows)
    column = time if time is not None else 1 if first is None and begin == 1 else None
    return table[:, begin : begin + sensors], None if column is None else table[:, column - 1]


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="fingertip fit", description=(__doc__ or "").split(":")[0] + ".", allow_abbrev=False)
    parser.add_argument(
        "file",
        metavar="FILE.csv",
        help="a column for each sensor, in the pad's order, and perhaps one of the time before; -: standard input",
    )
    parser.add_argument("--pad", required=True, metavar="NAME|FILE.json", help="one of the tool's pads, or a file that describes it")
    parser.add_argument("--first", type=int, metavar="N", help="column of sensor 0, counted from 1; the others follow it")
    parser.add_argument("--time", type=int, metavar="N", help="column of the time in seconds; without one each row is a contact of its own")
    parser.add_argument("--unit", default="Pa", metavar="UNIT", help=f"{', '.join(UNITS)}; default: Pa")
    parser.add_argument(
        "--zero", type=int, default=0, metavar="ROWS", help="so many rows at the beginning are at rest, and their mean is the zero"
    )
    parser.add_argument("--noise", type=float, default=NOISE_Pa, metavar="PA", help="of a reading, rms; default: %(default)g")
    parser.add_argument("--calibration", metavar="FILE.json", help="what --calibrate wrote")
    parser.add_argument(
        "--calibrate", action="store_true", help="find the sensors' gains instead, of rows in which one weight stands at different places"
    )
    parser.add_argument("--weight", type=float, metavar="GRAMS", help="its mass: then forces are calibrated too")
    parser.add_argument("-o", "--output", metavar="FILE", help="default: standard output")
    parser.add_argument("--overwrite", action="store_true", help="replace it if it exists")
    options = parser.parse_args(argv)
    if options.output and os.path.exists(options.output) and not options.overwrite:
        raise InputError(f"{options.output}: exists already; give --overwrite to replace it")
    pressures, time_s = read_table(options.file, len(read_pad(options.pad).x_mm), options.first, options.time)
    common = {"unit": options.unit, "zero_rows": options.zero, "noise_Pa": options.noise}
    if options.calibrate:
        force_N = None if options.weight is None else 9.80665e-3 * options.weight
        text = json.dumps(calibrate(pressures, options.pad, force_N=force_N, **common), indent=1) + "\n"
    else:
        found = fit(pressures, options.pad, calibration=options.calibration, time_s=time_s, **common)
        columns = ({} if time_s is None else {"t_s": time_s}) | found
        text = "".join(f"{','.join(cells)}\n" for cells in [columns, *zip(*(_texts(values) for values in columns.values()))])
    write_text(options.output, text) if options.output else sys.stdout.write(text)
    return 0


def _texts(values: npt.NDArray[Any]) -> list[str]:
    """Empty where there is none."""
    return [("" if value != value else f"{value:.9g}") if isinstance(value, float) else str(value) for value in values.tolist()]


def command() -> int:
    return run_tool("fingertip fit", main)
