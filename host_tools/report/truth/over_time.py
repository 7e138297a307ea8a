"""Contacts after contacts, on pads that remember, lean, end, or are thin: each is calibrated with a weight, as a user does it, and then pressed
every few seconds.

The scenarios are the twin's, and the firmware's own code processes them whole: zero, gate, fit, tangential estimate, doubt. Judged are touches that
have HISTORY before them, each at FRAMES moments, evenly spread over those at which the force has not changed by more than a twentieth within
0.15 s. So a hold of 10 s counts as much as one of 0.2 s. A slide moves on meanwhile.

The constants of firmware/condition and firmware/fit that these pads judge were chosen on pads 1 to 4, 11 to 16, 21 to 24 and 31 to 34, and
examined on 7000 to 7005 and 8000 to 8002; others judge here.
"""

import math
import pathlib
import tempfile
from typing import NamedTuple

import numpy as np
from fingertip.files import WARNINGS, InputError, read_recording, read_scenario
from fingertip.line import Flag
from reporting import Steps
from twin_player import TwinPlayer

SEED, PADS = 9000, 10
WEIGHT_N, FOOT, FORCES_N = 3, "sphere15", "2..10"
PLACEMENTS_s, PRESSES_s, HISTORY, FRAMES = 150, 200, 20, 25
BEFORE_s, AFTER_s, CHANGE = 0.15, 0.03, 0.05
SILENT_mm, THIN_SIGMA_mm, THIN_SD_mm = 1.0, 3.1, 0.5  # the prior that the manual gives for 6 mm of rubber
NOTHING = tuple(np.empty(0, kind) for kind in (float, float, float, bool, float, float))  # of frames_of
COUNTS = ("pad", "pads", "refused", "frames")
PULL, SLOPE_deg, TURN_deg = 0.3, 10, 137.5
HALF_mm = (9, 18)  # of the array

SEATS = "gain=5,places,widths,dip"
RUBBER = f"{SEATS},drift,hysteresis,relaxation,creep"
USUAL, STRIP = f"{RUBBER},memory,aftereffect", f"{RUBBER},memory=2.6,aftereffect=4"


class Pads(NamedTuple):
    """What a calibration sees."""

    effects: str
    layer_mm: float = 12
    options: tuple = ()  # of the rubber: more of twin scenario, and known to the fingertip
    slope_deg: float = 0
    calibrated: bool = True


class Kind(NamedTuple):
    name: str
    pads: Pads
    key: str = ""  # its figures are KEY_...
    object: str = FOOT
    pull: float = 0
    margin_mm: float = 4.5  # beyond the published grid: to the outer sensors
    beyond_mm: float = -HALF_mm[1]  # only touches so far beyond the outer sensors
    scenario: str = "hold"


REMEMBERING, STRIPS, ENDING = Pads(USUAL), Pads(STRIP), Pads(USUAL, options=("--overhang", 9))
LEANING, THIN = Pads(USUAL, slope_deg=SLOPE_deg), Pads(USUAL, layer_mm=6, calibrated=False)
KINDS = (
    Kind("plain: gains of 5 %", Pads("gain=5"), "plain"),
    Kind("still: and places, widths, dip", Pads(SEATS)),
    Kind("remembered", REMEMBERING, "remembered"),
    Kind("remembered, lime", REMEMBERING, object="lime"),
    Kind("remembered, pulled", REMEMBERING, "pulled", pull=PULL),
    Kind("remembered, a lime that slides", REMEMBERING, "slides", object="lime", scenario="slip"),
    Kind("as strips", STRIPS),
    Kind("as strips, pulled", STRIPS, pull=PULL),
    Kind("ends of 9 mm", ENDING, "ends"),
    Kind("ends of 9 mm, pulled", ENDING, "ends_pulled", pull=PULL),
    Kind("ends of 9 mm, beyond the outer sensors", ENDING, "beyond", margin_mm=9, beyond_mm=0),
    Kind("leaning: calibrated on a slope of 10 degrees", LEANING, "leaning"),
    Kind("6 mm, never calibrated", THIN),
    Kind("6 mm, never calibrated, pulled", THIN, "thin", pull=PULL),
)


def moments(touch, held):
    """FRAMES of each touch's, or all there are."""
    for one in range(HISTORY + 1, touch[-1] + 1):
        of_touch = np.flatnonzero(held & (touch == one))
        yield of_touch[np.unique(np.linspace(0, len(of_touch) - 1, FRAMES).astype(int))] if len(of_touch) else of_touch


def frames_of(scenario, recording, beyond_mm):
    """Of the frames that are judged: the location's error, NaN without a fit, and its sd; the force's error as a share; whether there is a fit and no
    warning; the error of Q / F, NaN without an estimate, and its sd."""
    truth, read = read_scenario(scenario), read_recording(recording)
    t_s = read["t_us"] * 1e-6
    true = lambda name, off_s=0.0: np.interp(t_s + off_s, truth.t_s, truth.truth[name]) if name in truth.truth else np.zeros(len(t_s))
    force_N, x_mm, y_mm, flags = true("force_N"), true("x_mm"), true("y_mm"), read["flags"].astype(np.int64)
    change_N = np.maximum(*(abs(true("force_N", off_s) - force_N) for off_s in (-BEFORE_s, AFTER_s)))
    held = (force_N > 0) & (change_N < CHANGE * force_N)
    held &= np.maximum(abs(x_mm) - HALF_mm[0], abs(y_mm) - HALF_mm[1]) >= beyond_mm
    touched = truth.truth["force_N"] > 0
    begins_s = truth.t_s[1:][touched[1:] & ~touched[:-1]]
    at = np.concatenate([*moments(np.searchsorted(begins_s, t_s, "right"), held), np.empty(0, int)])
    fitted, valid, force_N = flags & Flag.FIT_VALID > 0, flags & Flag.TANGENTIAL_VALID > 0, np.maximum(force_N, 1e-3)
    columns = (
        np.where(fitted, np.hypot(read["x_mm"] - x_mm, read["y_mm"] - y_mm), np.nan),
        read["location_sd_mm"],
        abs(read["force_N"] / force_N - 1),
        fitted & (flags & WARNINGS == 0),
        np.where(valid, np.hypot(read["qx_N"] - true("Qx_N"), read["qy_N"] - true("Qy_N")) / force_N, np.nan),
        read["q_sd_N"] / force_N,
    )
    return tuple(column[at] for column in columns)


def calibrated(player, pads, seed):
    """The commands that bring what a weight's placements on this pad show; None if they are refused."""
    with tempfile.TemporaryDirectory() as folder:
        path, recording, commands = (pathlib.Path(folder) / name for name in ("placements.csv", "recording.csv", "commands"))
        slope, turn_deg = math.radians(pads.slope_deg), seed * TURN_deg % 360
        leans = ("--tangential", f"{math.tan(slope):.4f},{turn_deg:g}", "--force", f"{WEIGHT_N * math.cos(slope):.4f}") if slope else ()
        player.write(path, "placements", pads.effects, seed, PLACEMENTS_s, "--layer", pads.layer_mm, *pads.options, *leans)
        player.play(path, recording, seed, "--raw")
        return commands.read_bytes() if player.accepts(recording, WEIGHT_N, commands, *pads.options) else None


def pressed(player, kind, seed, commands):
    with tempfile.TemporaryDirectory() as folder:
        path, recording, first = (pathlib.Path(folder) / name for name in ("presses.csv", "recording.csv", "commands"))
        first.write_bytes(commands)
        pull = ("--tangential", kind.pull) if kind.pull else ()
        touch = ("--indenter", kind.object, "--force", FORCES_N, "--margin", kind.margin_mm, *pull)
        player.write(path, kind.scenario, kind.pads.effects, seed, PRESSES_s, "--layer", kind.pads.layer_mm, *kind.pads.options, *touch)
        thin = ("--set", f"prior={THIN_SIGMA_mm}:{THIN_SD_mm}")
        of_pad = ("--pad", kind.pads.layer_mm, "--first", first) if kind.pads.calibrated else thin
        player.play(path, recording, seed, "--osr", 256, *of_pad)
        return frames_of(path, recording, kind.beyond_mm)


def row_of(kind, refused, pads):
    """Every figure, None where there is nothing to judge."""
    error_mm, sd_mm, force_error, trusted, vector_error, vector_sd = map(np.concatenate, zip(NOTHING, *pads))
    fitted, valid = np.isfinite(error_mm), np.isfinite(vector_error)
    percent = lambda which: float(100 * np.mean(which)) if len(which) else None
    quantile = lambda values, share: float(np.quantile(values, share)) if len(values) else None
    return {
        "pad": kind.name,
        "pads": len(pads),
        "refused": refused,
        "frames": len(fitted),
        "location_p50_mm": quantile(error_mm[fitted], 0.5),
        "location_p95_mm": quantile(error_mm[fitted], 0.95),
        "cover_1sd_percent": percent((error_mm < sd_mm)[fitted]),
        "cover_2sd_percent": percent((error_mm < 2 * sd_mm)[fitted]),
        "silent_percent": percent((error_mm > SILENT_mm) & trusted),
        "trusted_percent": percent(trusted),
        "force_p50_percent": quantile(100 * force_error[fitted], 0.5),
        "valid_percent": percent(valid) if kind.pads.calibrated else None,
        "vector_error_p50": quantile(vector_error[valid], 0.5),
        "vector_error_p95": quantile(vector_error[valid], 0.95),
        "beyond_2sd_percent": percent((vector_error > 2 * vector_sd)[valid]),
    }


def figures(options, kinds=KINDS):
    if options.pads is not None and options.pads < 1:
        raise InputError("--pads needs at least one pad")
    player, steps = TwinPlayer(options.build, pathlib.Path(options.build) / "contact_tables"), Steps()
    seeds = [(SEED if options.seed is None else options.seed) + i for i in range(options.pads or PADS)]
    of_pads = {kind.pads: f"calibrated, as for {kind.name}" for kind in reversed(kinds) if kind.pads.calibrated}
    one = lambda pads: [calibrated(player, pads, seed) for seed in seeds]
    found = steps.run_all({pads: (what, lambda pads=pads: one(pads)) for pads, what in of_pads.items()})

    def measured(kind):
        commands = found.get(kind.pads, [b""] * len(seeds))
        return row_of(kind, commands.count(None), [pressed(player, kind, *one) for one in zip(seeds, commands) if one[1] is not None])

    rows = steps.run_all({kind: (kind.name, lambda kind=kind: measured(kind)) for kind in kinds})
    worst = lambda of, name: of((row[name] for row in rows.values() if row[name] is not None), default=None)
    return {f"{kind.key}_{name}": value for kind, row in rows.items() if kind.key for name, value in row.items() if name not in COUNTS} | {
        "over_time_seed": seeds[0],
        "over_time_pads": len(seeds),
        "remembered_refused": sum(commands.count(None) for commands in found.values()),
        "over_time_silent_percent_worst": worst(max, "silent_percent"),
        "over_time_valid_percent_worst": worst(min, "valid_percent"),
        "over_time_beyond_2sd_percent_worst": worst(max, "beyond_2sd_percent"),
        "over_time": list(rows.values()),
    }
