"""Two emulated fingertips on simulated time, their clocks 50 ppm apart, recorded into one file by the host tool.

Each emulator says when, on the tool's clock, it was powered on, and so when every frame truly was.
"""

import json
import os

import numpy as np
from emulation import options

from fingertip import files

CLOCKS_ppm = {"E660583883265A01": 25, "E660583883265A02": -25}
RATE_Hz = 50


class Emulator:
    def __init__(self, world, image, folder, serial, scenario, *more):
        self.port = folder / f"tty-{serial}"
        self.report_path = folder / f"{serial}.json"
        own = options(seed=int(serial[-2:]), serial=serial, clock_ppm=CLOCKS_ppm[serial], report=self.report_path)
        shared = options(image=image, board="pico_mux", scenario=scenario, seconds=3600, fast_enumeration=True)
        self.process = world.emulator(self.port, *shared, *own, *more)

    def stop(self):
        self.process.terminate()
        said, self.errors = self.process.communicate()
        self.power_on_us = int(said)
        self.report = json.loads(self.report_path.read_text())

    def true_us(self, device_us):
        """On the host's clock."""
        return self.power_on_us + self.report["device_time_zero_s"] * 1e6 + device_us / (1 + self.report["clock_ppm"] * 1e-6)


def record_all(world, emulators, path, seconds):
    ports = ":".join(str(each.port) for each in emulators)
    world.tool("record", path, "--all", "--seconds", seconds, env={**os.environ, "FINGERTIP_PORT": ports})


def recordings_in(path):
    return [files.read_recording(path, serial=serial) for serial in CLOCKS_ppm]


def worst_us(emulators, recordings, from_s=-np.inf, to_s=np.inf):
    """Of each row against the other's latest: how far apart the two are that truly are of one moment."""
    host_zero_us = float(recordings[0].metadata["host_zero_us"])
    rows = []
    for number, (each, recording) in enumerate(zip(emulators, recordings)):
        error_us = recording.time_us - (each.true_us(recording["t_us"]) - host_zero_us)
        inside = (recording.time_us >= from_s * 1e6) & (recording.time_us < to_s * 1e6)
        rows += [(time_us, number, error) for time_us, error in zip(recording.time_us[inside], error_us[inside])]
    latest, worst = {}, 0.0
    for _, number, error_us in sorted(rows):
        latest[number] = error_us
        worst = max(worst, abs(latest[number] - latest.get(1 - number, error_us)))
    return worst
