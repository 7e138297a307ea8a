"""Fits the pressures of any array by the firmware's own code: `fingertip fit`, which starts this.

found = fingertip.fit(pressures_Pa, "2x4")
plt.plot(found["x_mm"], found["y_mm"], ".")
"""

import argparse
import contextlib
import functools
import itertools
import json
import math
import os
import pathlib
import shutil
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .arrays import Firmware, MeasureError, q10, round_half_away, table_of, usable_of
from .command import Parser, check_output, printable, progress, reporter
from .errors import InputError
from .evaluate import add_recording_options, check_time, load_recording
from .files import is_recording, write_text
from .frames import FloatArray
from .line import SENSORS_MAX, Flag
from .tables import UNITS, read_table

Described = str | os.PathLike[str] | Mapping[str, Any]

SHAPES = ("undecided", "round", "pulled", "elongated", "two", "none")
NOISE_Pa = 10.0
ROWS_AT_ONCE = 512
MOST_Pa = 1e6  # no such barometer measures more
ABSOLUTE_Pa = 3e4  # the air is more, and touches are not in the median of all readings
AIR_Pa = (8e4, 1.1e5)  # absolute pressures at rest, up to 1900 m above the sea
LIGHT_Pa = 500.0  # a touch of some grams
ALIKE, GAP = 0.1, 5.0  # shares: sensors at rest by the air; of the usual step in time
STEP_s = 1.5  # rows are seldom further apart
LEAST = dict.fromkeys(
    ("sigma_mm", "sigma_sd_mm", "dip_share", "dip_sd_mm", "force_scale", "force_scale_sd", "gain_sd"), 0.0
)  # of a calibration
LEAST |= {"gain": 1e-3, "off_x_mm": -1e3, "off_y_mm": -1e3, "wider": -1e3}
OF_SENSORS = ("gain", "gain_sd", "off_x_mm", "off_y_mm", "wider")
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
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"{path}: no JSON: {error}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds no object, {{...}}")
    return found


def read_pad(pad: Described) -> Pad:
    """A name that the tool knows, a file, or its content (boards/pads/README.md). Raises InputError."""
    text = _described(pad, None if isinstance(pad, Mapping) else _installed("pads", "../share/fingertip/pads"))
    name, rubber = str(text.get("name", "the pad")), text.get("rubber") or {}
    try:
        pitch_mm = float(text["pitch_mm"])
        if "places_mm" in text:
            places = np.array(text["places_mm"], float)
            if places.shape != (len(places), 2) or len(np.unique(places, axis=0)) < len(places):
                raise ValueError("places_mm are no [x, y] of each sensor, or two sensors are at the same place")
        else:
            columns, rows = text["columns"], text["rows"]
            if not (columns in range(1, SENSORS_MAX + 1) and rows in range(1, SENSORS_MAX + 1)):
                raise ValueError(f"{columns} x {rows} sensors: give 1 to {SENSORS_MAX} of each")
            nodes = np.column_stack(np.divmod(np.arange(columns * rows), rows))
            places = pitch_mm * (nodes - (np.array([columns, rows]) - 1) / 2)
        if not 1 <= len(places) <= SENSORS_MAX:
            raise ValueError(f"{len(places)} sensors: 1 to {SENSORS_MAX} are possible")
        if not (0.01 <= pitch_mm <= 1000 and (np.hypot(*places.T) <= 128 * pitch_mm).all()):
            raise ValueError(f"pitch_mm {pitch_mm:g} is out of range; give 0.01 to 1000 mm, and places within 128 pitches")
        thickness_mm, overhang_mm = (float(rubber.get(key, 0)) for key in ("thickness_mm", "overhang_mm"))
        if not (0 <= thickness_mm <= 1000 and 0 <= overhang_mm <= 1000):
            raise ValueError(f"rubber of {thickness_mm:g} mm, {overhang_mm:g} mm beyond the sensors: give 0, for not known, to 1000 mm")
        return Pad(name, places[:, 0].copy(), places[:, 1].copy(), pitch_mm, thickness_mm, overhang_mm)
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as error:
        raise InputError(f"{name}: {type(error).__name__} {error}; boards/pads/README.md has what a pad is described by") from None


def _calibrated(what: Described | None, pad: Pad) -> Mapping[str, Any]:
    known = {} if what is None else _described(what)
    wrong = "" if what is None or known.keys() & LEAST.keys() else f"has none of {', '.join(LEAST)}"
    for name in known.keys() & LEAST.keys():
        values = np.array(known[name], object)
        if values.shape != (pad.x_mm.shape if name in OF_SENSORS else ()):
            wrong = f"{name} has {values.size} values, and pad {pad.name} has {len(pad.x_mm)} sensors"
        elif not all(isinstance(each, int | float) and LEAST[name] <= each < MOST_Pa for each in values.flat):
            wrong = f"{name} is {printable(str(known[name]))}"
    if known.get("force_scale") and "force_scale_sd" not in known:
        wrong = "force_scale comes without its standard deviation, force_scale_sd"
    if wrong:
        raise InputError(f"the calibration is none of this pad: {wrong}; fingertip calibrate --from FILE --pad NAME makes one")
    return known


def _warn(text: str) -> None:
    warnings.warn(text, stacklevel=4)


def _seconds(time: npt.ArrayLike) -> FloatArray:
    """Of numbers, dates or durations. Raises InputError."""
    values = np.atleast_1d(np.asarray(time))
    try:
        values = values.astype("M8[us]") if values.dtype.kind in "OU" else values
        values = values - values[:1] if values.dtype.kind == "M" else values
        return np.asarray(values / np.timedelta64(1, "s") if values.dtype.kind == "m" else values, float)
    except (TypeError, ValueError):
        raise InputError("time is neither numbers, in seconds, nor dates; give one for each row") from None


def _noise_Pa(table: FloatArray) -> float:
    """Rms of rows that follow each other, from their differences."""
    return float(np.nanmedian(np.abs(np.diff(table, axis=0)))) / (0.6745 * 2**0.5) if len(table) >= 8 else 0.0


def _gates_Pa(noise_Pa: float) -> tuple[float, float]:
    """Of the largest reading: a contact begins above the first, and ends below the second."""
    of = firmware().constants
    open_Pa, close_Pa = (float(of[f"gate_{name}_Pa"] + of[f"gate_{name}_noises"] * noise_Pa) for name in ("open", "close"))
    return open_Pa, close_Pa


def _readings(pressures: npt.ArrayLike, pad: Pad, unit: str, zero_rows: int, noise_Pa: float, time_s: FloatArray | None) -> FloatArray:
    """Pa above the zero [row, sensor]. Raises InputError where they cannot be those of touches on the pad, warns of what makes that unlikely."""
    if unit not in UNITS:
        raise InputError(f"{printable(unit)} is no unit; give one of {', '.join(UNITS)}")
    table: FloatArray = UNITS[unit] * table_of(pressures)
    if table.ndim != 2 or table.shape[1] != len(pad.x_mm):
        raise InputError(
            f"pressures are {' x '.join(map(str, table.shape))}, and pad {pad.name} has {len(pad.x_mm)} sensors: rows x {len(pad.x_mm)}"
        )
    if time_s is not None and time_s.shape != (len(table),):
        raise InputError(f"time has {' x '.join(map(str, time_s.shape))} values, and there are {len(table)} rows; give one for each")
    if time_s is not None and len(fallen := 1 + np.flatnonzero(~(np.diff(time_s) > 0))):
        raise InputError(f"time does not rise after row {fallen[0]}; without a time each row is a contact of its own")
    if time_s is not None and len(time_s) > 1 and (step_s := float(np.median(np.diff(time_s)))) > STEP_s:
        _warn(f"rows are {step_s:.4g} s apart: is the time in seconds?")
    if not 0 <= zero_rows <= len(table) or not 0 < noise_Pa < MOST_Pa:
        raise InputError(f"{zero_rows} rows at rest of {len(table)}, noise of {noise_Pa:g} Pa: give rows that are there, and noise above 0")
    if np.isinf(table).any() or not np.isfinite(table[: zero_rows or None]).any():
        raise InputError("a pressure is infinite, or none is a number; where a sensor has none, give nan")
    rest = table[: zero_rows or len(table)]
    seen = np.isfinite(rest).any(axis=0)
    level_Pa, zero_Pa = np.nanmedian(rest[:, seen], axis=0), np.where(seen, 0.0, np.nan)
    middle_Pa = float(np.median(level_Pa))
    alike = np.abs(level_Pa - middle_Pa).max(initial=0.0) < ALIKE * abs(middle_Pa)
    airs = [name for name, factor in UNITS.items() if alike and AIR_Pa[0] < factor * middle_Pa / UNITS[unit] < AIR_Pa[1]]
    scatter_Pa = _noise_Pa(rest[:, seen]) if zero_rows or time_s is not None else 0.0
    open_Pa = _gates_Pa(max(noise_Pa, scatter_Pa))[0]
    touch_Pa = 0.0
    if zero_rows:
        zero_Pa[seen] = np.nanmean(rest[:, seen], axis=0)
        touch_Pa = np.nanmax(np.abs(rest - zero_Pa))
        table = table - zero_Pa
    most, least = np.nanmax(table), np.nanmin(table)
    where_most, where_least = (f" (row {row + 1}, sensor {k})" for row, k in (np.argwhere(table == value)[0] for value in (most, least)))
    wrong = ""
    if airs and unit not in airs:
        wrong = f"readings at rest are {middle_Pa / UNITS[unit]:.4g} {unit}, as the air's in {' or '.join(airs)}; give that unit"
    elif not zero_rows and abs(middle_Pa) > ABSOLUTE_Pa and most < MOST_Pa:
        wrong = f"pressures are of {middle_Pa / 1000:.0f} kPa, as the air's; give the number of rows at rest at the beginning (zero)"
    elif most > MOST_Pa:
        wrong = f"the largest pressure is {most:.3g} Pa{where_most}, more than such sensors measure; give their unit"
    elif least < -max(most / 2, open_Pa):
        wrong = f"pressures fall to {least:.0f} Pa{where_least}: the zero is that of a press (give rows at rest), the sign is another, or it is none"
    elif most < 6 * noise_Pa:
        wrong = f"the largest pressure is {most:.3g} Pa, below six times the noise of {noise_Pa:g} Pa: nothing touches, or the unit is another (kPa?)"
    elif touch_Pa > open_Pa:
        wrong = f"a reading moves by {touch_Pa:.0f} Pa in the {zero_rows} rows at rest: something touches; give fewer rows (zero)"
    if wrong:
        raise InputError(wrong)
    if len(others := np.flatnonzero((level_Pa < 0.5 * middle_Pa) & (middle_Pa > ABSOLUTE_Pa))):
        _warn(f"sensor {np.flatnonzero(seen)[others[0]]} is at {level_Pa[others[0]]:.4g} Pa, others at {middle_Pa:.0f} Pa: a pressure?")
    if scatter_Pa > 2 * noise_Pa:
        _warn(f"readings scatter by {scatter_Pa:.0f} Pa from row to row; give that as the noise, which is {noise_Pa:g} Pa")
    if most < LIGHT_Pa:
        _warn(f"the largest pressure is {most:.0f} Pa, that of a few grams: is the unit another (hPa, kPa)?")
    return table


def inputs(
    chip: Any,
    pad: Pad,
    reading_Pa: FloatArray,
    calibration: Mapping[str, Any] | None,
    noise_Pa: float,
    has_profile: bool = False,
    **fields: Any,
) -> tuple[Any, Any, npt.NDArray[np.int32], npt.NDArray[np.uint64], Any]:
    """What the fit gets of readings: fit_array, fit_settings, readings in 1/1024 Pa, bitmap of the usable sensors, fit_deviation or None. fields: of
    fit_settings."""
    known = calibration or {}
    prior = {} if has_profile else {"prior_sigma_mm": known.get("sigma_mm", 0.0), "prior_width_mm": known.get("sigma_sd_mm", 0.0)}
    dip = {name: known.get(name, 0.0) for name in ("dip_share", "dip_sd_mm")}
    cut = {"clip_below_sds": 0} if has_profile else {}
    settings = chip.settings(noise_Pa=noise_Pa, gain_sd=known.get("gain_sd") or None, **(prior | dip | cut | fields))
    deviations = None
    if known.get("off_x_mm"):
        deviations = chip.made("fit_deviation", 1, len(pad.x_mm))
        for key, unit in (("off_x_mm", pad.pitch_mm), ("off_y_mm", pad.pitch_mm), ("wider", 1.0)):
            deviations[f"{key.removesuffix('_mm')}_q15"] = round_half_away(
                np.clip(32768.0 * np.asarray(known.get(key, 0.0)) / unit, -32767, 32767)
            )
    readings = np.clip(reading_Pa / np.asarray(known.get("gain", 1.0)), -MOST_Pa, MOST_Pa)
    return chip.array(*pad[1:4]), settings, q10(readings), usable_of(reading_Pa), deviations


def _begins(peak_Pa: FloatArray, noise_Pa: float, alone: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Of each row the first of its contact, by the firmware's gate; -1: nothing touches. alone: it does not follow the row before."""
    open_Pa, close_Pa = _gates_Pa(noise_Pa)
    begins = [-1]
    for i, peak in enumerate(peak_Pa):
        touched = begins[-1] >= 0 and not alone[i]
        begins.append(-1 if peak <= (close_Pa if touched else open_Pa) else begins[-1] if touched else i)
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
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, npt.NDArray[Any]]:
    """Location, force, their standard deviations, flags, tangential force and shape of pressures [row, sensor] above the zero, NaN where a sensor has
    none. What is unlikely is a UserWarning.

    pad: a name that the tool knows, a file or its content (boards/pads/README.md); tangential force and shape need a rectangle and the rubber's
    thickness. calibration: the same, as calibrate() returns it. time_s [row]: rows follow each other, and are contacts by the firmware's gate;
    without it each is a contact of its own, that is held. zero_rows: number of rows at the beginning that are at rest. noise_Pa: rms of a reading.
    progress: called now and then with the share that is fitted.

    Arrays [row] by the names of a recording's columns, NaN where there is none; flags are of fingertip.Flag; shape is of SHAPES. Each row is fitted
    with the 24 before it in its contact. Raises InputError, with the cause. A row takes a millisecond, or without a thickness 20 us."""
    of_pad = read_pad(pad)
    known = _calibrated(calibration, of_pad)
    time_s = None if time_s is None else _seconds(time_s)
    reading_Pa = _readings(pressures, of_pad, unit, zero_rows, noise_Pa, time_s)
    chip = firmware()
    profile = None
    if of_pad.thickness_mm:
        with contextlib.suppress(MeasureError):  # other than a rectangle has no tangential force
            made = chip.profile(of_pad.thickness_mm, of_pad.overhang_mm, layout=of_pad[1:4])
            chip.call("tangential_pad", chip.array(*of_pad[1:4]), made, chip.made("fit_pad", 1))
            profile = made
    array, settings, readings, usable, deviations = inputs(chip, of_pad, reading_Pa, known, noise_Pa, profile is not None)
    rows = np.arange(len(readings))
    alone = np.ones(len(rows), bool)
    if time_s is not None:
        steps_s = np.diff(time_s)
        alone[1:] = steps_s > GAP * np.median(steps_s) if len(steps_s) else False
    begins = _begins(readings.max(axis=1) / 1024.0, noise_Pa, alone)
    if time_s is not None and alone[1:].any():
        longest = f"{steps_s.max():.3g} s before row {steps_s.argmax() + 2}"
        _warn(f"rows are lost at {alone[1:].sum()} places, the longest of {longest}: contacts begin again there")
    if time_s is not None and begins[:1].tolist() == [0]:
        _warn("the first row is touched, so nothing shows that its zero is right; begin at rest")
    scale = float(known.get("force_scale", 0.0))
    always = int(Flag.TARED) * (zero_rows > 0) | int(Flag.CALIBRATED) * (scale > 0)
    flags = always | np.where(usable == (1 << len(of_pad.x_mm)) - 1, 0, int(Flag.SENSOR_MASKED))
    found: dict[str, npt.NDArray[Any]] = {}
    touched = begins >= 0
    for some in np.array_split(rows[touched], len(rows) // ROWS_AT_ONCE + 1):
        for name, values in _fit(chip, (array, settings, readings, usable, deviations), profile, known, some, begins[some]).items():
            found.setdefault(name, np.full(len(rows), np.nan if values.dtype == float else 0, values.dtype))[some] = values
        progress(some[-1] / len(rows) if len(some) else 0.0)
    found["flags"] |= flags | np.where(touched, int(Flag.CONTACT), 0)
    return found


def _fit(
    chip: Any, of: tuple[Any, ...], profile: Any, known: Mapping[str, Any], rows: npt.NDArray[np.int64], begins: npt.NDArray[np.int64]
) -> dict[str, npt.NDArray[Any]]:
    array, settings, readings, usable, deviations = of
    frames = int(chip.constants["shapes_frames"]) + 1 if profile is not None else 7  # that fit_held() searches
    before = np.maximum(rows[:, None] - np.arange(frames)[::-1], begins[:, None])
    held, usable = readings[before], usable[before]
    fits = chip.fit_held(array, settings, np.ascontiguousarray(held[:, -7:]), usable[:, -7:], deviations=deviations)
    scale = float(known.get("force_scale", 0.0))
    scales = (scale, float(known["force_scale_sd"])) if scale else (1.0, float(chip.constants["default_force_scale_sd"]))
    force_N = np.zeros((len(rows), 2))
    unsearched = chip.fit(array, settings, readings[rows], usable[:, -1].copy(), deviations=deviations)  # that nothing seems to pull
    chip.call("weigh", *scales, unsearched, readings[rows].max(axis=1) / 1024.0, force_N)
    flags = fits["flags"].astype(np.int64)
    valid = flags & Flag.FIT_VALID != 0
    names = ("x_mm", "y_mm", "location_sd_mm", "p0_Pa", "sigma_mm", "residual_rms_Pa")
    found = {name: np.where(valid, fits[name].astype(float), np.nan) for name in names}
    found |= {"force_N": np.where(valid, force_N[:, 0], np.nan), "force_sd_N": np.where(valid, force_N[:, 1], np.nan)}
    found |= {"flags": flags, "sensors_used": fits["used"].astype(np.int64)}
    if profile is not None:
        _add_shapes(chip, (array, settings, held, usable, deviations), profile, scales, bool(scale), found)
    return found


def _add_shapes(
    chip: Any, of: tuple[Any, ...], profile: Any, scales: tuple[float, float], is_scaled: bool, found: dict[str, npt.NDArray[Any]]
) -> None:
    """Where the pad and the array are such that the firmware estimates them."""
    array, settings, held, usable, deviations = of
    rows = len(held)
    published, pad = chip.made("published", rows), chip.made("fit_shapes_pad", 1)
    shapes, places = chip.made("fit_shapes_result", rows, 2), chip.made("shapes_location", rows, 2)
    estimated = [
        np.ascontiguousarray(each[:, -1]) for each in chip.tangential(array, profile, settings, held, usable, deviations=deviations)
    ]
    chip.call("publish", profile, np.full(rows, scales[0] if is_scaled else 0.0), scales[1], *estimated, published)
    with contextlib.suppress(MeasureError):  # rubber too thin for the pitch has no shapes
        chip.call("shapes_pad", array, profile, pad)
        chip.call("held_shapes", array, pad, settings, deviations, held, usable, published, shapes, places)
    last, shape = shapes[:, 1], shapes["shape"][:, 1].astype(np.int64)
    two, edge = (shape == SHAPES.index(name) for name in ("two", "elongated"))
    valid = published["valid"] & ~two
    for name in ("x_mm", "y_mm", "location_sd_mm", "force_N", "force_sd_N"):
        found[name] = np.where(valid, published[name], found[name])
    for name in ("qx", "qy", "q_sd"):
        found[f"{name}_N"] = np.where(valid, published[name] * published["force_N"], np.nan)
    found["location_sd_mm"] = np.where((shape > 0) & ~two, places["location_sd_mm"][:, 1], found["location_sd_mm"])
    found["shape"] = shape
    scale, scale_sd = (each * float(profile["force_ratio"][0] if is_scaled else 1.0) for each in scales)
    for k, (name, values) in itertools.product(
        range(2),
        (
            ("x{}_mm", last["x_mm"]),
            ("y{}_mm", last["y_mm"]),
            ("location{}_sd_mm", last["location_sd_mm"]),
            ("force{}_N", scale * last["force_N"]),
            ("force{}_sd_N", np.hypot(scale * last["force_sd_N"], scale_sd * last["force_N"])),
        ),
    ):
        found[name.format(k + 1)] = np.where(two, values[:, k].astype(float), np.nan)
    found["edge_angle_deg"] = np.where(edge, np.degrees(np.arctan2(last["along_y"], last["along_x"])), np.nan)
    found["edge_length_mm"] = np.where(edge, last["length_mm"].astype(float), np.nan)
    uncertain = found["location_sd_mm"] > chip.constants["location_sd_limit_mm"]
    elongated = np.where(valid, estimated[1]["elongated"], found["flags"] & Flag.ELONGATED)
    of_flags = (
        (valid, Flag.TANGENTIAL_VALID),
        (uncertain, Flag.UNCERTAIN),
        (elongated, Flag.ELONGATED),
        (shape > 0, Flag.SHAPE_VALID),
        (two, Flag.TWO_CONTACTS),
        (edge, Flag.EDGE),
        (shape == SHAPES.index("none"), Flag.SHAPE_UNKNOWN),
    )
    for these, flag in of_flags:
        found["flags"] = found["flags"] & ~int(flag) | np.where(these, int(flag), 0)


def response_of(found: Any, sensors: Any) -> dict[str, Any]:
    """A calibration as fit() takes it, of records calibration and calibrated_sensor [sensor]."""
    names = {"sigma_mm": "prior_sigma_mm", "sigma_sd_mm": "prior_width_mm"}
    names |= {name: name for name in ("dip_share", "dip_sd_mm", "force_scale", "force_scale_sd")}
    of_sensors = {"gain": "gain", "gain_sd": "reading_sd"} | (
        {name: name for name in ("off_x_mm", "off_y_mm", "wider")} if found["has_deviations"] else {}
    )
    response: dict[str, Any] = {key: float(found[name]) for key, name in names.items()}
    return response | {key: sensors[name].tolist() for key, name in of_sensors.items()}


def calibrate(
    pressures: npt.ArrayLike,
    pad: Described,
    *,
    force_N: float | None = None,
    time_s: npt.ArrayLike | None = None,
    unit: str = "Pa",
    zero_rows: int = 0,
    noise_Pa: float = NOISE_Pa,
) -> dict[str, Any]:
    """What the tool's calibration finds of one weight, of force_N if it is known, at different places, as fit() takes it. Of rows without a
    time each is a placement, and at most 40 of them count, from all over the file. time_s [row]: rows follow each other, and the weight
    was set down, rested for a second and was lifted again. Raises InputError where they do not determine the gains."""
    if force_N is not None and not 0.1 <= force_N <= 50:
        raise InputError(f"a weight of {force_N:g} N is out of range; give 0.1 to 50 N, which are 10 to 5100 grams")
    of_pad = read_pad(pad)
    time_s = None if time_s is None else _seconds(time_s)
    reading_Pa = _readings(pressures, of_pad, unit, zero_rows, noise_Pa, time_s)
    from .validation.placements import Placement, placements_of, solve_gains  # which need this module

    if time_s is None:
        pressed = np.flatnonzero(np.nan_to_num(reading_Pa).max(axis=1) >= PLACEMENT_Pa)
        chosen = reading_Pa[pressed[np.linspace(0, len(pressed) - 1, min(PLACEMENTS, len(pressed))).astype(int)]]
        placements = [Placement(EVERY_s * i, np.nan_to_num(row), np.isfinite(row), 0 * row, noise_Pa, 0.0) for i, row in enumerate(chosen)]
    else:
        placements = placements_of(time_s, reading_Pa)
    *_, found, sensors = solve_gains(of_pad, placements, force_N or 1.0)
    if found["state"] != 1:
        raise InputError(f"not calibrated from {len(placements)} placements: {found['text'].decode()}")
    return response_of(found, sensors) | ({} if force_N else {"force_scale": 0.0, "force_scale_sd": 0.0})


def _recorded(options: argparse.Namespace) -> tuple[FloatArray, FloatArray, Mapping[str, Any]]:
    """(Pa above the fingertip's own zero [row, sensor], time, pad) of a recording. Frames without pressures of their own (lost or held) are
    left out."""
    recording = load_recording(options)
    check_time(recording)
    known, pressures = recording.metadata, recording.sensors_Pa - recording.tare_Pa
    valid, *wrong = (np.nan_to_num(recording[name]).astype(np.int64) for name in ("valid", "saturated", "doubtful"))
    pressures[((valid & ~wrong[0] & ~wrong[1])[:, None] >> np.arange(pressures.shape[1])) & 1 == 0] = np.nan
    there = np.isfinite(pressures).any(axis=1)
    if not there.any():
        raise InputError(f"{options.recording}: has no pressures; record with the raw stream on")
    places = [[float(each) for each in known.get(name, "").split()] for name in ("x_mm", "y_mm")]
    rubber = {name: known.get(f"pad_{name}", 0) for name in ("thickness_mm", "overhang_mm")}
    pad = {"pitch_mm": known.get("pitch_mm"), "places_mm": list(zip(*places)), "rubber": rubber}
    return pressures[there], recording["t_us"][there] / 1e6, {"name": known.get("serial", options.recording)} | pad


def main(argv: list[str]) -> int:
    parser = Parser(prog="fingertip fit", description=(__doc__ or "").split(":")[0] + ".", allow_abbrev=False)
    parser.add_argument("recording", metavar="FILE.csv", help="a column a sensor, the time before them; or a recording; -: standard input")
    parser.add_argument("--pad", metavar="NAME|FILE.json", help="one of the tool's, or a file that describes it; default: a recording's")
    parser.add_argument("--first", type=int, metavar="N", help="column of sensor 0, counted from 1; the others follow it")
    parser.add_argument("--time", type=int, metavar="N", help="its column: seconds, dates, or as its name has it (time_ms); default: none")
    parser.add_argument("--unit", default="Pa", metavar="UNIT", help=f"{', '.join(UNITS)}; default: Pa")
    parser.add_argument("--zero", type=int, default=0, metavar="ROWS", help="that are at rest at the beginning: their mean is the zero")
    parser.add_argument("--noise", type=float, default=NOISE_Pa, metavar="PA", help="of a reading, rms; default: %(default)g")
    parser.add_argument("--calibration", metavar="FILE.json", help="what fingertip calibrate --pad wrote")
    parser.add_argument("--calibrate", action="store_true", help="find the gains instead: fingertip calibrate --from FILE --pad NAME")
    parser.add_argument("--weight", type=float, metavar="GRAMS", help="its mass: then forces are calibrated too")
    parser.add_argument("-o", "--output", metavar="FILE", help="default: standard output")
    add_recording_options(parser)
    options = parser.parse_args(argv)
    if options.weight is not None and not options.calibrate:
        parser.error("--weight is that of --calibrate; give both")
    if options.calibrate and options.calibration is not None:
        parser.error("--calibrate makes a calibration, and takes no --calibration")
    is_recorded = options.first is None and is_recording(options.recording)
    if is_recorded and (options.time is not None or options.unit != "Pa"):
        parser.error("--time and --unit are those of a table; a recording has its own")
    if not is_recorded and (options.salvage or options.device or options.from_s or options.to_s < math.inf):
        parser.error("--salvage, --device, --from and --to are of recordings, and this is a table")
    warn = reporter(parser.prog)
    warnings.showwarning = lambda message, *_: warn(f"warning: {message}")
    if options.output is not None:
        described = options.pad if options.pad and options.pad.endswith(".json") else None
        check_output(options.output, options.recording, options.calibration, described, replace=options.overwrite)
    recorded = _recorded(options) if is_recorded else None
    pad = options.pad or (recorded and recorded[2]) or parser.error("--pad NAME, or FILE.json, is needed: what the columns are of")
    of_file = (options.recording, len(read_pad(pad).x_mm), options.first, options.time, options.unit)
    pressures, time_s = recorded[:2] if recorded else read_table(*of_file)
    common = {"unit": options.unit, "zero_rows": options.zero, "noise_Pa": options.noise, "time_s": time_s}
    if options.calibrate:
        force_N = None if options.weight is None else 9.80665e-3 * options.weight
        text = json.dumps(calibrate(pressures, pad, force_N=force_N, **common), indent=1) + "\n"
    else:
        with progress("fitting") as show:
            found = fit(pressures, pad, calibration=options.calibration, progress=show, **common)
        columns = ({} if time_s is None else {"t_s": time_s}) | found
        text = "".join(f"{','.join(cells)}\n" for cells in [columns, *zip(*(_texts(values, name) for name, values in columns.items()))])
    write_text(options.output, text) if options.output is not None else sys.stdout.write(text)
    return 0


def _texts(values: npt.NDArray[Any], name: str) -> list[str]:
    """Empty where there is none."""
    texts = (repr(value) if name == "t_s" or isinstance(value, int) else f"{value:.9g}" for value in values.tolist())
    return ["" if text == "nan" else text for text in texts]
