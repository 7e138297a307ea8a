"""What the fingertip keeps without power, in the emulator with the firmware's own flash driver."""

import concurrent.futures
import json
import pathlib
import tempfile

import numpy as np
from boards import PARALLEL as BOARD
from emulation import MAIN, options
from emulated import CONVERSION_us, MARGIN, Tools, contact_times_us, distribution, scenario
from fingertip.files import InputError, read_recording
from fingertip.line import Calibration, StoreCalibration
from fingertip.wire import Packet, encode
from reporting import run

OSR = 256
CALIBRATE, SENSORS = 0x88, 15
# From one command to the next: an erase of the slowest flash and all that follows.
INTERVAL_s = 0.6
# Gains cost time in each frame, so what is compared has them from here on.
CALIBRATED_s = 0.5
FROM_s = 1.1
KEPT_FIGURES = ("frames", "skipped", "erases", "programs", "latency_us")


def calibrate_frame(number):
    """A calibration that differs from the others, and hardly from the scenario's sensors: a fit that finds an outlier takes longer than a frame."""
    gains = [value for k in range(SENSORS) for value in (1 + 0.0001 * ((k + number) % 20), 0.01)]
    places = [value for k in range(SENSORS) for value in (k, -((k + number) % 20), 10 * k)]
    calibration = Calibration(1785931200 + number, 30, 1 + 0.001 * number, 0.02, 5700, 60, 0, 0, 101, tuple(gains), tuple(places))
    return encode(Packet(number, 0, StoreCalibration(SENSORS, calibration))).hex()


class Run:
    """The release image, calibrated, in contact, while it obeys a number of commands that store."""

    def __init__(self, tools, folder, name, path, commands, more=()):
        base = pathlib.Path(folder) / name
        lines = [
            "0.45 dtr 1",
            f"0.452 {tools.encoded('info')}",
            f"0.455 {tools.encoded('osr', OSR)}",
            f"0.46 {tools.encoded('stream', 'contact,health')}",
            f"{CALIBRATED_s} {calibrate_frame(0)}",
        ]
        stores = [calibrate_frame(1 + i) if i % 3 else tools.encoded("keep") for i in range(commands)]
        lines += [f"{FROM_s + INTERVAL_s * i:.3f} {frame}" for i, frame in enumerate(stores)]
        base.with_suffix(".script").write_text("\n".join(lines) + "\n")
        files = {"host_script": base.with_suffix(".script"), "capture": f"{base}.ftr", "usb_log": f"{base}.usb", "report": f"{base}.json"}
        run("node", MAIN, *options(board=BOARD, image=tools.image(BOARD), scenario=path, **files), *more)
        run(tools.fingertip, "convert", f"{base}.ftr", f"{base}.csv")
        emulated = json.loads(pathlib.Path(f"{base}.json").read_text())
        recording = read_recording(f"{base}.csv")
        health = recording.health()[-1]
        zero_us = emulated["device_time_zero_s"] * 1e6
        rows = recording.has_contact & (recording["t_us"] >= FROM_s * 1e6 - zero_us)
        self.frames = int(rows.sum())
        self.skipped = health["frames_skipped"] + int((np.diff(recording["frame"][rows]) - 1).sum())
        self.stored = [f for kind, f in recording.packets if kind == "ack" and int(f["command"]) >= CALIBRATE][1:]
        self.refused = sum(f["result"] != "0" for f in self.stored)
        self.erases, self.programs = emulated["flash"]["erases"], emulated["flash"]["programs"]
        times = contact_times_us(f"{base}.usb", zero_us)
        times = times[times[:, 0] >= FROM_s * 1e6 - zero_us]
        self.latency_us = distribution(times[:, 1] - times[:, 0] + CONVERSION_us[OSR] * (MARGIN / 2 - 1))


def stream(tools, commands):
    with tempfile.TemporaryDirectory() as folder:
        path = scenario(folder, "wander", FROM_s + INTERVAL_s * commands + 0.1)
        jobs = {"quiet": (0, ()), "storing": (commands, ()), "storing_slowly": (commands, ("--slow-flash",))}
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            futures = {name: pool.submit(Run, tools, folder, name, path, *job) for name, job in jobs.items()}
            runs = {name: future.result() for name, future in futures.items()}
    for name in ("storing", "storing_slowly"):
        if len(runs[name].stored) != commands or runs[name].refused:
            raise InputError(f"{name}: {len(runs[name].stored)} of {commands} commands answered, {runs[name].refused} refused")
    return runs


def storing(build, boards, commands=20):
    """Figures:

    flash_frames_skipped  frames that the release image skipped or did not send while it stored calibrations and settings, at OSR 256 and full rate,
                          in contact on every frame
    flash                 what is behind them: latencies with and without storing among them. A command that brings a calibration takes the processor
                          0.1 ms, for which a frame may have to wait once; the writing does not
    """
    runs = stream(Tools(build, boards), commands)
    return {
        "flash_frames_skipped": max(runs[name].skipped for name in ("storing", "storing_slowly")),
        "flash": {
            name: {"stored": len(found.stored)} | {each: getattr(found, each) for each in KEPT_FIGURES} for name, found in runs.items()
        },
    }
