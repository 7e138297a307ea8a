"""Two emulated fingertips, their clocks 50 ppm apart, recorded into one file by the host tool; on simulated time.

usage: test_two_fingertips.py --image F.bin --support FOLDER --node NODE --report usb.json

Each emulator says when, on the tool's clock, it was powered on, and so when every frame truly was. The sensors of both feel
triangles of pressure: their tops, found in the recording, show the same without any device's clock.
"""

import argparse
import pathlib
import tempfile
import unittest

import numpy as np

from emulation import main, write_scenario
from two_clocks import CLOCKS_ppm, RATE_Hz, Emulator, record_all, recordings_in, worst_us
from world import World
import figures

TOOLS = argparse.Namespace()
RECORDED_s = 20  # in which the drift is found to 0.2 ppm
LIMIT_us = 200
TRIANGLE_s = 2.0
SCENARIO_s = RECORDED_s + 10
TOP_Pa = 20000
ALL_SENSORS = 0x7FFF
REPORTED = ("alignment_us", "alignment_bound_us", "alignment_felt_us", "alignment_seconds", "alignment_of")
MEASURED = {}


def tops_us(time_us, pressure_Pa, expected_us):
    """When each triangle was at its top: half-way between its two crossings of the middle."""
    low_Pa, high_Pa = pressure_Pa.min(), pressure_Pa.max()
    height = (pressure_Pa - low_Pa) / (high_Pa - low_Pa)
    found = []
    for top_us in expected_us:
        crossings = []
        for sign in (-1, 1):
            flank = (sign * (time_us - top_us) > 0) & (abs(time_us - top_us) < TRIANGLE_s / 2 * 1e6)
            flank &= (height > 0.1) & (height < 0.9)
            slope, offset = np.polyfit(height[flank] - 0.5, time_us[flank] - top_us, 1)
            crossings.append(offset)
        found.append(top_us + np.mean(crossings))
    return np.array(found)


class TwoFingertips(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        report()
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        folder = pathlib.Path(holder.name)
        write_scenario(folder / "scenario.csv", *((t_s * TRIANGLE_s / 2, TOP_Pa * (t_s % 2)) for t_s in range(SCENARIO_s)))
        cls.file = folder / "both.csv"
        with World(TOOLS.support, TOOLS.node, folder) as world:
            cls.emulators = [Emulator(world, TOOLS.image, folder, serial, folder / "scenario.csv") for serial in CLOCKS_ppm]
            for each in cls.emulators:
                world.tool("set", "--port", each.port, f"rate={RATE_Hz}")
            record_all(world, cls.emulators, cls.file, RECORDED_s)
            for each in cls.emulators:
                each.stop()
        cls.recordings = recordings_in(cls.file)
        cls.host_zero_us = float(cls.recordings[0].metadata["host_zero_us"])

    def test_nothing_was_amiss(self):
        for each, recording in zip(self.emulators, self.recordings):
            self.assertEqual(each.report["warnings"], [], each.errors)
            self.assertEqual(recording.events, [])
            self.assertTrue((np.diff(recording["frame"]) == 1).all())
            self.assertGreater(len(recording["frame"]), 0.95 * RATE_Hz * RECORDED_s)
        self.assertEqual(self.recordings[0].end["dropped_packets"], "0")

    def test_the_clocks_drift_as_they_were_told(self):
        for serial, recording in zip(CLOCKS_ppm, self.recordings):
            with open(self.file, encoding="utf-8") as file:
                number = list(CLOCKS_ppm).index(serial)
                end = next(line for line in file if line.startswith(f"# {number}/end:"))
            drift_ppm = float(dict(pair.split("=") for pair in end.split()[2:])["drift_ppm"])
            self.assertLess(abs(drift_ppm - CLOCKS_ppm[serial]), 2)
            # the rows themselves: device time against the common clock, over the second half
            late = slice(len(recording.time_us) // 2, None)
            slope = np.polyfit(recording.time_us[late], recording["t_us"][late] - recording.time_us[late], 1)[0]
            self.assertLess(abs(slope * 1e6 - CLOCKS_ppm[serial]), 2)

    def test_rows_are_where_they_truly_were(self):
        for recording in self.recordings:
            self.assertGreater(recording.time_us[-1] - recording.time_us[0], 0.98e6 * RECORDED_s)
        apart_us = worst_us(self.emulators, self.recordings)
        bound_us = float(self.recordings[0].end["alignment_us"])
        print(f"worst {apart_us:.1f} us, stated bound {bound_us:.1f} us")
        self.assertLess(apart_us, LIMIT_us)
        self.assertLessEqual(apart_us, bound_us)
        report(
            alignment_us=round(apart_us, 1),
            alignment_bound_us=bound_us,
            alignment_seconds=RECORDED_s,
            alignment_of="two emulated fingertips, clocks 50 ppm apart, on one simulated time with the host tool that recorded them",
        )

    def test_what_both_felt_tells_the_same(self):
        errors = []
        for each, recording in zip(self.emulators, self.recordings):
            zero_us = each.power_on_us - self.host_zero_us
            tops = zero_us + np.arange(TRIANGLE_s / 2, SCENARIO_s, TRIANGLE_s) * 1e6
            inside = (tops > recording.time_us[0] + TRIANGLE_s * 0.5e6) & (tops < recording.time_us[-1] - TRIANGLE_s * 0.5e6)
            pressure_Pa = recording.sensors_Pa.mean(axis=1)
            told = recording["valid"] == ALL_SENSORS  # in one of 65536 readings the firmware does not trust the sensor
            errors.append(tops_us(recording.time_us[told], pressure_Pa[told], tops[inside]) - tops[inside])
            self.assertGreater(len(errors[-1]), RECORDED_s / TRIANGLE_s - 3)
        apart_us = max(errors[0].max() - errors[1].min(), errors[1].max() - errors[0].min())
        print(f"tops {apart_us:.1f} us apart, late by {np.concatenate(errors).mean():.1f} us")
        self.assertLess(apart_us, LIMIT_us)
        report(alignment_felt_us=round(apart_us, 1))


def report(**numbers):
    """What this run did not measure is no longer in the file."""
    MEASURED.update(numbers)
    figures.add(TOOLS.report, MEASURED, stale=REPORTED)


if __name__ == "__main__":
    main(TOOLS, "image", "node", "report", "support")
