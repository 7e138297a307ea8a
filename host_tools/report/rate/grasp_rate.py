"""The release images, of scene grasp (with two contacts of scene shapes), with a pad's profile in the emulator: its rate, latency and sleep, with one contact and with two, on calibrated rubber with a dip, where the fit costs most, and with a sensor that reads double."""

import pathlib

import numpy as np
from boards import BOARDS, PARALLEL, short
from emulated import FROM_s, Measurement, Tools, distribution, pressed, scenario
from fingertip.files import TANGENTIAL_VALID, read_recording, read_scenario, write_scenario
from fingertip.line import Flag
from reporting import run
from scenes import SceneTools

PAD = ("12", "0")  # thickness and overhang, mm; 0: no ends, which cost as much
CALIBRATED = ("5.5", "5.8")  # width of a contact, mm, and its dip, %: as a calibration finds them on the twin's rubber with a dip
GOALS = (
    ("grasp_parallel_fps_osr256", ">=", 1305),
    ("grasp_frames_skipped", "<=", 0),
    ("grasp_latency_p99_us", "<=", 1000),
    ("grasp_two_latency_p99_us", "<=", 1500),
    ("grasp_calibrated_latency_p99_us", "<=", 1000),
    ("grasp_broken_fps_osr256", ">=", 1305),
    ("grasp_broken_latency_p99_us", "<=", 1000),
    ("grasp_sleep_percent", ">=", 20),
)
TWO_FROM_s = 0.65
ONE_SLIP_s = 6  # a scenario with one contact at least
BROKEN = 3
PITCH_mm, SIGMA_mm, PEAK_Pa = 9.0, 5.7, 25000.0


def two_contacts(path, seconds):
    """A scenario of two presses 18 mm apart."""
    x_mm, y_mm = PITCH_mm * (np.arange(15) // 5 - 1), PITCH_mm * (np.arange(15) % 5 - 2)
    press_Pa = sum(PEAK_Pa * np.exp(-((x_mm - x) ** 2 + (y_mm - y) ** 2) / (2 * SIGMA_mm**2)) for x, y in ((2, 10), (-1, -8)))
    return pressed(path, "two", [0, TWO_FROM_s, TWO_FROM_s + 0.01, seconds], np.outer([0, 0, 1, 1], press_Pa.round()))


def with_broken_sensor(path, scenario_path):
    """The scenario, with a sensor that reads double."""
    read = read_scenario(scenario_path)
    read.sensors_Pa[:, BROKEN] *= 2
    write_scenario(path, read.metadata, {"t_s": read.t_s, "sensors_Pa": read.sensors_Pa, **read.truth})
    return path


def share_of(recording, flag, seconds):
    flags = recording["flags"][recording.has_contact & (recording["t_us"] > recording["t_us"][-1] - 1e6 * seconds)].astype(np.int64)
    return 100 * float(((flags & int(flag)) != 0).mean())


def jobs(build, boards, folder, seconds, on=BOARDS):
    """{name: (what, measures)} for Steps.run_all."""
    wander = scenario(folder, "wander", FROM_s + seconds + 1, "grasp-wander")
    two = two_contacts(wander.with_name("grasp-two.csv"), FROM_s + seconds + 1)
    tools = Tools(build, boards)

    dipped = wander.with_name("grasp-dip.csv")
    slip = ("--force", "5", "--quiet", "0.3", "--effects", "dip=5", "--seconds", f"{max(FROM_s + seconds + 1, ONE_SLIP_s):g}")
    twin, tables = pathlib.Path(build) / "host_tools/simulation/twin/twin", pathlib.Path(build) / "contact_tables"
    run(twin, "scenario", "slip", *slip, "-o", dipped, "--cache", tables)

    def one(board, path, *commands):
        of_scene = SceneTools(build, boards, "shapes", (board,)) if path is two else tools
        return Measurement(of_scene, folder, board, 256, path, seconds, commands=[*commands, tools.encoded("pad", *PAD)])

    cases = [(short(board), board, wander, ()) for board in on] + [("two", PARALLEL, two, ())]
    cases.append(("calibrated", PARALLEL, dipped, (tools.encoded("calibrate", *CALIBRATED),)))
    broken = with_broken_sensor(wander.with_name("grasp-broken.csv"), wander)
    cases.append(("broken", PARALLEL, broken, (tools.encoded("calibrate", *CALIBRATED),)))
    return {
        name: (f"scene grasp on {board}, {path.stem}", lambda b=board, p=path, c=commands: one(b, p, *c))
        for name, board, path, commands in cases
    }


def figures(runs):
    parallel, two = runs[short(PARALLEL)], runs["two"]
    latency_us, of_two_us = distribution(parallel.offered_us), distribution(two.offered_us)
    calibrated_us = distribution(runs["calibrated"].offered_us)
    recording, of_two = read_recording(f"{parallel.name}.csv"), read_recording(f"{two.name}.csv")
    return {
        **{f"grasp_{name}_fps_osr256": one.fitted_per_s for name, one in runs.items() if name in map(short, BOARDS)},
        **{f"grasp_{name}_latency_median_us": distribution(one.offered_us)["median"] for name, one in runs.items() if name != "two"},
        "grasp_calibrated_latency_p99_us": calibrated_us["p99"],
        "grasp_broken_fps_osr256": runs["broken"].fitted_per_s,
        "grasp_broken_latency_p99_us": distribution(runs["broken"].offered_us)["p99"],
        "grasp_frames_skipped": max(one.frames_skipped for one in runs.values()),
        "grasp_dropped": max(one.dropped for one in runs.values()),
        "grasp_latency_p99_us": latency_us["p99"],
        "grasp_latency_max_us": latency_us["max"],
        "grasp_two_latency_p99_us": of_two_us["p99"],
        "grasp_sleep_percent": parallel.sleep_percent,
        "grasp_load_percent": share_of(recording, TANGENTIAL_VALID, parallel.seconds),
        "grasp_shape_percent": share_of(of_two, Flag.SHAPE_VALID, two.seconds),
        "grasp_shape_age_ms": float(np.nanmean(of_two["shape_age_ms"])),
    }
