"""Contacts after contacts, on pads that remember: each pad is calibrated with a weight, as a user does it, and then pressed every few seconds.

The scenarios are the twin's (grid, taps), and the firmware's own code plays them whole: zero, gate, fit, tangential estimate, doubt. Judged
are the frames of which the force has not changed by more than a twentieth within 0.15 s.
"""

import concurrent.futures
import os
import pathlib
import subprocess
import tempfile
from typing import NamedTuple

import numpy as np
from fingertip.files import WARNINGS, InputError, read_recording, read_scenario
from fingertip.line import Flag
from reporting import built, run

SEED, PADS = 7000, 6
WEIGHT_N, FOOT, FORCES_N = 3, "sphere15", "2..10"
PLACEMENTS_s, PRESSES_s = 150, 90
BEFORE_s, AFTER_s, CHANGE = 0.15, 0.03, 0.05
FORCE_MIN_N, SILENT_mm = 0.3, 1.0

SEATS = "gain=5,places,widths,dip"
RUBBER = f"{SEATS},drift,hysteresis,relaxation,creep,memory"
USUAL, STRIP = f"{RUBBER},aftereffect", f"{RUBBER}=2.6,aftereffect=4"


class Kind(NamedTuple):
    name: str
    effects: str
    layer_mm: float = 12
    object: str = FOOT
    tangential: float = 0.0
    overhang_mm: float | None = None
    scenario: str = "grid"


KINDS = (
    Kind("plain: gains of 5 %", "gain=5"),
    Kind("still: places, widths, dip", SEATS),
    Kind("remembered", USUAL),
    Kind("remembered, lime", USUAL, object="lime"),
    Kind("remembered, pulled by 0.3", USUAL, tangential=0.3, scenario="taps"),
    Kind("as strips", STRIP),
    Kind("as strips, pulled by 0.3", STRIP, tangential=0.3, scenario="taps"),
    Kind("ends of 9 mm", USUAL, overhang_mm=9),
    Kind("ends of 9 mm, pulled by 0.3", USUAL, tangential=0.3, overhang_mm=9, scenario="taps"),
    Kind("6 mm", USUAL, layer_mm=6),
    Kind("6 mm, pulled by 0.3", USUAL, layer_mm=6, tangential=0.3, scenario="taps"),
)


class Frames(NamedTuple):
    """[frame] of those judged."""

    error_mm: np.ndarray
    sd_mm: np.ndarray
    force_error: np.ndarray  # share
    warned: np.ndarray
    valid: np.ndarray  # has a tangential estimate
    ratio_error: np.ndarray  # of Q / F
    ratio_sd: np.ndarray


def frames_of(scenario, recording):
    truth, read = read_scenario(scenario), read_recording(recording)
    t_s = read["t_us"] * 1e-6
    true = {name: np.interp(t_s, truth.t_s, truth.truth[name]) for name in ("x_mm", "y_mm", "force_N")}
    force_N, flags = true["force_N"], read["flags"].astype(np.int64)
    pulls = [np.interp(t_s, truth.t_s, truth.truth[name]) if name in truth.truth else 0.0 for name in ("Qx_N", "Qy_N")]
    before_N, after_N = (np.interp(t_s + off_s, truth.t_s, truth.truth["force_N"]) for off_s in (-BEFORE_s, AFTER_s))
    held = (force_N > FORCE_MIN_N) & (np.maximum(abs(before_N - force_N), abs(after_N - force_N)) < CHANGE * force_N)
    judged = held & (flags & Flag.FIT_VALID > 0)
    return Frames(
        *(
            column[judged]
            for column in (
                np.hypot(read["x_mm"] - true["x_mm"], read["y_mm"] - true["y_mm"]),
                read["location_sd_mm"],
                read["force_N"] / np.maximum(force_N, FORCE_MIN_N) - 1,
                flags & WARNINGS > 0,
                flags & Flag.TANGENTIAL_VALID > 0,
                np.hypot(read["qx_N"] - pulls[0], read["qy_N"] - pulls[1]) / np.maximum(force_N, FORCE_MIN_N),
                read["q_sd_N"] / np.maximum(force_N, FORCE_MIN_N),
            )
        )
    )


def played(tools, folder, kind, pad):
    """Frames of one pad, or None if its calibration was refused."""
    twin, player = tools
    placements, presses, recording, commands = (
        folder / f"{KINDS.index(kind)}-{pad}-{name}" for name in ("placements.csv", "presses.csv", "recording.csv", "commands")
    )
    of_pad = ("--effects", kind.effects, "--pad", pad, "--seed", pad, "--layer", kind.layer_mm, "--overwrite")
    of_pad += () if kind.overhang_mm is None else ("--overhang", kind.overhang_mm)
    run(twin, "scenario", "placements", *of_pad, "--seconds", PLACEMENTS_s, "-o", placements)
    play = ("--overwrite", "--quiet", "--seed", pad, "-o", recording)
    run(player, "play", placements, *play, "--raw")
    judged = [str(part) for part in (player, "calibrate", recording, "--force", WEIGHT_N, "-o", commands)]
    if subprocess.run(judged, capture_output=True, check=False).returncode:
        return None
    touch = ("--indenter", kind.object, "--force", FORCES_N, *(("--tangential", kind.tangential) if kind.tangential else ()))
    run(twin, "scenario", kind.scenario, *of_pad, *touch, "--seconds", PRESSES_s, "-o", presses)
    run(player, "play", presses, *play, "--osr", 256, "--pad", kind.layer_mm, "--first", commands)
    return frames_of(presses, recording)


def percent(which):
    return float(100 * np.mean(which)) if len(which) else None


def quantile(values, share):
    return float(np.quantile(values, share)) if len(values) else None


def row_of(kind, pads):
    accepted = [frames for frames in pads if frames is not None]
    row = {"pad": kind.name, "pads": len(accepted), "refused": len(pads) - len(accepted)}
    if not accepted:
        return row
    all_of = Frames(*map(np.concatenate, zip(*accepted)))
    ratio_error, ratio_sd = all_of.ratio_error[all_of.valid], all_of.ratio_sd[all_of.valid]
    return row | {
        "location_p50_mm": quantile(all_of.error_mm, 0.5),
        "location_p95_mm": quantile(all_of.error_mm, 0.95),
        "cover_1sd_percent": percent(all_of.error_mm < all_of.sd_mm),
        "silent_percent": percent((all_of.error_mm > SILENT_mm) & ~all_of.warned),
        "trusted_percent": percent(~all_of.warned),
        "force_p50_percent": 100 * quantile(abs(all_of.force_error), 0.5),
        "valid_percent": percent(all_of.valid),
        "ratio_error_p50": quantile(ratio_error, 0.5),
        "ratio_error_p95": quantile(ratio_error, 0.95),
        "beyond_2sd_percent": percent(ratio_error > 2 * ratio_sd),
    }


def figures(options):
    tools = tuple(built(options.build, "host_tools/simulation", tool) for tool in ("twin/twin", "player/fingertip_player"))
    seed, count = SEED if options.seed is None else options.seed, options.pads or PADS
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        playing = [[pool.submit(played, tools, pathlib.Path(folder), kind, seed + i) for i in range(count)] for kind in KINDS]
        rows = [row_of(kind, [one.result() for one in pads]) for kind, pads in zip(KINDS, playing)]
    if not any(row["pads"] for row in rows):
        raise InputError("every calibration was refused")
    remembered, pulled = (next(row for row in rows if row["pad"] == name) for name in ("remembered", "remembered, pulled by 0.3"))
    each = lambda name: [row[name] for row in rows if row["pads"]]
    found = {f"remembered_{name}": value for name, value in remembered.items() if name not in ("pad", "pads", "refused")}
    return found | {
        "remembered_pulled_error_p50": pulled.get("ratio_error_p50"),
        "remembered_pulled_error_p95": pulled.get("ratio_error_p95"),
        "remembered_cover_1sd_min": min(each("cover_1sd_percent")),
        "remembered_cover_1sd_max": max(each("cover_1sd_percent")),
        "remembered_silent_percent_worst": max(each("silent_percent")),
        "over_time": rows,
    }
