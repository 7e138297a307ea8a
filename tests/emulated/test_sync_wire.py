"""Two emulated fingertips on one wire, their clocks 50 ppm apart, recorded into one file by the host tool; on simulated time.

usage: test_sync_wire.py --image F.bin --support FOLDER --node NODE --report FILE.json

A strobe drives both sync pins. Each emulator says when, on the tool's clock, it was powered on, and so when every frame truly was: the
error between rows of both is that of the alignment by edges, which begins some seconds after the recording, and before that the one over USB.
"""

import argparse
import json
import os
import pathlib
import tempfile
import unittest

import numpy as np

from emulation import files, main, options, write_scenario
from world import World

TOOLS = argparse.Namespace()
CLOCKS_ppm = {"E660583883265A01": 25, "E660583883265A02": -25}
RATE_Hz = 50
RECORDED_s = 16
BY_USB_s = 6.5  # the first edges, and five seconds more
STROBE_ms = 251.3337
LIMIT_us, USB_LIMIT_us = 2, 200
MEASURED = {}


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


class OneWire(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_scenario(folder / "scenario.csv")
        cls.file = folder / "both.csv"
        with World(TOOLS.support, TOOLS.node, folder) as world:
            cls.emulators = [
                Emulator(world, TOOLS.image, folder, serial, folder / "scenario.csv", "--sync-strobe", STROBE_ms) for serial in CLOCKS_ppm
            ]
            cls.said = [world.tool("set", "--port", each.port, f"rate={RATE_Hz}", "sync=in") for each in cls.emulators]
            ports = {"FINGERTIP_PORT": ":".join(str(each.port) for each in cls.emulators)}
            world.tool("record", folder / "both.mcap", "--all", "--seconds", RECORDED_s, env={**os.environ, **ports})
            world.tool("convert", folder / "both.mcap", cls.file)
            for each in cls.emulators:
                each.stop()
        cls.recordings = [files.read_recording(cls.file, serial=serial) for serial in CLOCKS_ppm]

    @classmethod
    def tearDownClass(cls):
        path = pathlib.Path(TOOLS.report)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(MEASURED, indent=1) + "\n", encoding="utf-8")

    def test_nothing_was_amiss(self):
        for each, recording, said in zip(self.emulators, self.recordings, self.said):
            self.assertIn(" sync=in", said)
            self.assertEqual(each.report["warnings"], [], each.errors)
            self.assertEqual(recording.events, [])
            self.assertEqual(recording.metadata["sync"], "1")
            self.assertEqual(recording.end["edges_missing"], "0")
            self.assertGreater(len(recording["frame"]), 0.95 * RATE_Hz * RECORDED_s)

    def test_both_have_the_edges_of_the_wire(self):
        edges = [recording.sync_edges for recording in self.recordings]
        self.assertLessEqual(abs(len(edges[0]) - len(edges[1])), 2)
        self.assertGreater(len(edges[0]), 2 * (RECORDED_s - 1) / (STROBE_ms / 1e3) - 2)
        for each, found in zip(self.emulators, edges):
            self.assertEqual([edge.number for edge in found], list(range(found[0].number, found[0].number + len(found))))
            for edge in found:
                self.assertEqual(edge.level, edge.number % 2)
                # the strobe rises at multiples of its period on the world's clock, and falls a millisecond later
                phase_us = (each.true_us(edge.t_us) - (1 - edge.level) * 1000) % (STROBE_ms * 1e3)
                self.assertLess(min(phase_us, STROBE_ms * 1e3 - phase_us), 1.1)
        late = [[edge.time_us for edge in found if edge.time_us > BY_USB_s * 1e6 and edge.level] for found in edges]
        for one, other in zip(*late):
            self.assertLess(abs(one - other), LIMIT_us)

    def test_rows_are_aligned_by_the_edges(self):
        by_usb_us = worst_us(self.emulators, self.recordings, to_s=BY_USB_s)
        by_edges_us = worst_us(self.emulators, self.recordings, from_s=BY_USB_s)
        bound_us = float(self.recordings[0].end["edges_alignment_us"])
        print(f"over USB {by_usb_us:.1f} us, by edges {by_edges_us:.2f} us, stated bound {bound_us:.1f} us")
        MEASURED.update(
            sync_alignment_us=round(by_edges_us, 2), sync_alignment_bound_us=bound_us, sync_alignment_usb_us=round(by_usb_us, 1)
        )
        self.assertLessEqual(by_edges_us, LIMIT_us)
        self.assertLessEqual(by_edges_us, bound_us)
        self.assertLessEqual(bound_us, 4)
        self.assertGreater(by_usb_us, by_edges_us)
        self.assertLess(by_usb_us, USB_LIMIT_us)
        self.assertLessEqual(by_usb_us, float(self.recordings[0].end["alignment_us"]))

    def test_the_drift_of_each_clock_is_found(self):
        ends = [line for line in self.file.read_text(encoding="utf-8").splitlines() if "/end:" in line]
        for end, drift_ppm in zip(ends, CLOCKS_ppm.values(), strict=True):
            self.assertLess(abs(float(dict(pair.split("=") for pair in end.split()[2:])["drift_ppm"]) - drift_ppm), 2)


if __name__ == "__main__":
    main(TOOLS, "image", "node", "report", "support")
