"""Two emulated fingertips on one wire, their clocks 50 ppm apart, recorded into one file by the host tool; on simulated time.

usage: test_sync_wire.py --image F.bin --support FOLDER --node NODE --report FILE.json

A strobe drives both sync pins. Each emulator says when, on the tool's clock, it was powered on, and so when every frame truly was: the
error between rows of both is that of the alignment by edges, which begins some seconds after the recording, and before that the one over USB.
"""
import argparse
import json
import os
import pathlib
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip import files, read_recording  # noqa: E402
from world import World  # noqa: E402

TOOLS = argparse.Namespace()
CLOCKS_ppm = {"E660583883265A01": 25, "E660583883265A02": -25}
RECORDED_s = 16
BY_USB_s = 6.5  # the first edges, and five seconds more
RATE_Hz = 50
STROBE_ms = 251.3337
LIMIT_us = 2
MEASURED = {}


def write_scenario(path):
    header = ",".join(["t_s", *files.TRUTH_COLUMNS, *(f"s{k}_Pa" for k in range(15))])
    rows = [",".join([str(t_s), *["0"] * (len(files.TRUTH_COLUMNS) + 15)]) for t_s in (0, 1)]
    path.write_text("\n".join(["# fingertip-scenario 1", header, *rows]) + "\n")


class Emulator:
    def __init__(self, world, folder, serial, scenario):
        self.port = folder / f"tty-{serial}"
        self.report_path = folder / f"{serial}.json"
        self.process = world.emulator(
            self.port, "--image", TOOLS.image, "--board", "pico_mux", "--scenario", scenario, "--seconds", "3600", "--seed", int(serial[-2:]),
            "--serial", serial, "--clock-ppm", CLOCKS_ppm[serial], "--fast-enumeration", "--sync-strobe", STROBE_ms, "--report", self.report_path)

    def stop(self):
        self.process.terminate()
        said, self.errors = self.process.communicate()
        self.power_on_us = int(said)
        self.report = json.loads(self.report_path.read_text())

    def true_us(self, device_us):
        """On the host's clock."""
        return self.power_on_us + self.report["device_time_zero_s"] * 1e6 + device_us / (1 + self.report["clock_ppm"] * 1e-6)


class OneWire(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        folder = pathlib.Path(holder.name)
        write_scenario(folder / "scenario.csv")
        cls.file = folder / "both.csv"
        with World(TOOLS.support, TOOLS.node, folder) as world:
            cls.emulators = [Emulator(world, folder, serial, folder / "scenario.csv") for serial in CLOCKS_ppm]
            cls.said = [world.tool("set", "--port", each.port, f"rate={RATE_Hz}", "sync=in") for each in cls.emulators]
            ports = ":".join(str(each.port) for each in cls.emulators)
            world.tool("record", folder / "both.mcap", "--all", "--seconds", RECORDED_s, env={**os.environ, "FINGERTIP_PORT": ports})
            world.tool("convert", folder / "both.mcap", cls.file)
            for each in cls.emulators:
                each.stop()
        cls.recordings = [read_recording(cls.file, device=serial) for serial in CLOCKS_ppm]
        cls.host_zero_us = float(cls.recordings[0].metadata["host_zero_us"])

    @classmethod
    def tearDownClass(cls):
        path = pathlib.Path(TOOLS.report)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(MEASURED, indent=1) + "\n", encoding="utf-8")

    def worst_us(self, from_s, to_s):
        """Of each row against the other's latest: how far apart the two are that truly are of one moment."""
        rows = []
        for number, (each, recording) in enumerate(zip(self.emulators, self.recordings)):
            error_us = recording.time_us - (each.true_us(recording["t_us"]) - self.host_zero_us)
            inside = (recording.time_us >= from_s * 1e6) & (recording.time_us < to_s * 1e6)
            rows += [(time_us, number, error) for time_us, error in zip(recording.time_us[inside], error_us[inside])]
        latest, worst_us = {}, 0.0
        for _, number, error_us in sorted(rows):
            latest[number] = error_us
            worst_us = max(worst_us, abs(latest[number] - latest.get(1 - number, error_us)))
        return worst_us

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
        by_usb_us, by_edges_us = self.worst_us(0, BY_USB_s), self.worst_us(BY_USB_s, RECORDED_s)
        bound_us = float(self.recordings[0].end["edges_alignment_us"])
        print(f"over USB {by_usb_us:.1f} us, by edges {by_edges_us:.2f} us, stated bound {bound_us:.1f} us")
        MEASURED.update(sync_alignment_us=round(by_edges_us, 2), sync_alignment_bound_us=bound_us, sync_alignment_usb_us=round(by_usb_us, 1))
        self.assertLessEqual(by_edges_us, LIMIT_us)
        self.assertLessEqual(by_edges_us, bound_us)
        self.assertLessEqual(bound_us, 4)
        self.assertGreater(by_usb_us, by_edges_us)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("image", "node", "report"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--support", required=True, type=pathlib.Path)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
