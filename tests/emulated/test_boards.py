"""The release image of a board in the emulator: rate, accuracy, timing, and faults of sensors, lines, clock and host.

usage: test_boards.py --image F.bin --fingertip TOOL --command_frame PROGRAM --node NODE PicoMux|PicoParallel
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from emulation import ROOT, Run, main, make_scenario
from truth import Truth

from fingertip import files

TOOLS = argparse.Namespace()
ALL = 0x7FFF
CONTACT, FIT_VALID, HELD = 1 << 0, 1 << 1, 1 << 6
SENSOR_MASKED, SENSOR_DOUBTFUL = 1 << 14, 1 << 18
# Noise of a conversion, rms: MS5840 datasheet.
NOISE_Pa = {256: 11.0, 1024: 3.9}
# Two standard deviations at the limit of UNCERTAIN: a location without a warning is not off by more, whatever befalls the array.
UNWARNED_mm = 1.2
HEALTH = "health"
MOVING = 0.02  # of the frames are doubtful at most as pressures have moved and no temperature came in time: none here


class BoardRun(Run):
    def __init__(self, folder, name, board, truth, seconds, osr, faults, commands, **more):
        commands = [(0.46, "stream", "contact,raw,health"), (0.47, "osr", str(osr)), *commands]
        super().__init__(TOOLS, folder, name, board, truth.path, seconds, commands, faults, **more)
        self.osr = osr
        self.t_s = truth.times_s(self.recording, self.report)
        self.valid = np.nan_to_num(self.recording["valid"]).astype(int)
        self.flags = np.nan_to_num(self.recording["flags"]).astype(int)
        self.doubtful = (self.flags & SENSOR_DOUBTFUL) != 0
        self.measured = (self.flags & HELD) == 0

    def between(self, from_s, to_s):
        return (self.t_s > from_s) & (self.t_s < to_s)


class Board:
    """What holds of both. OSR and least_per_s: of a run, and how many frames come then."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.truth = Truth(make_scenario(cls.folder / "ideal.csv", "ideal", 12))

    @classmethod
    def run_image(cls, name, seconds, faults=(), commands=(), osr=None, **more):
        return BoardRun(cls.folder, name, cls.board, cls.truth, seconds, osr or cls.OSR, faults, commands, **more)

    def assert_nothing_is_wrong_and_unflagged(self, run):
        self.assertLess(self.truth.worst_reading_Pa(run.recording, run.t_s), 7 * NOISE_Pa[run.osr])
        errors_mm = self.truth.unwarned_errors_mm(run.recording, run.t_s)
        self.assertGreater(len(errors_mm), 50)
        self.assertLess(errors_mm.max(), UNWARNED_mm)

    def test_a_host_that_stalls_and_a_cable_that_is_pulled_cost_frames_and_no_more(self):
        faults = [{"type": "host_stall", "from_s": 0.8, "to_s": 5.8}, {"type": "usb_unplug", "from_s": 6.2, "to_s": 6.4}]
        again = [(7.0, "dtr 1"), (7.01, "stream", "contact,raw,health"), (7.3, HEALTH)]
        run = self.run_image("host", 7.5, faults, again, osr=1024)
        for from_s, to_s in ((5.85, 6.15), (7.1, 7.49)):
            rows = run.between(from_s, to_s)
            self.assertGreater(rows.sum(), self.least_per_s * (to_s - from_s))
            self.assertTrue((run.valid[rows & run.measured] == ALL).all())
        # What the host misses is what the device says that it dropped, and the few that were under way in the cable.
        missed, dropped = int(run.recording.end["dropped_packets"]), run.recording.health()[-1]["packets_dropped"]
        self.assertGreater(missed, 4.5 * self.least_per_s)
        self.assertLessEqual(dropped, missed)
        self.assertLess(missed - dropped, 10)
        self.assertEqual((run.report["reboots"], run.report["usb"]["enumerations"]), (0, 2))
        self.assert_nothing_is_wrong_and_unflagged(run)


class PicoMux(Board, unittest.TestCase):
    board, OSR, least_per_s = "pico_mux", 1024, 190

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        logs = {"bus_log": cls.folder / "bus.csv"}
        cls.first = cls.run_image("first", None, **logs)

    def test_ideal_presses_are_located_and_weighed(self):
        out, run = self.folder / "summary.json", self.first
        command = [sys.executable, ROOT / "host_tools/python", "evaluate", run.path("csv"), self.truth.path]
        subprocess.run([*command, "--run", run.path("json"), "-o", out], check=True)
        summary = json.loads(out.read_text())
        self.assertLessEqual(summary["localisation_median_mm"], 0.05)
        self.assertLessEqual(summary["force_mape_percent"], 1.0)
        self.assertGreaterEqual(summary["frames_per_s"], 200)
        self.assertGreater(summary["fitted_frames"], 500)
        for nothing in ("dropped_packets", "crc_errors", "emulator_warnings"):
            self.assertEqual(summary[nothing], 0, nothing)

    def test_stage_timings_are_those_of_the_bus(self):
        """convert and read against the bus itself, and the six stages against their total."""
        zero_us = self.first.report["device_time_zero_s"] * 1e6
        with open(self.folder / "bus.csv", newline="") as file:
            transfers = list(csv.DictReader(file))
        start_us, end_us = ([float(row[name]) / 1e3 - zero_us for row in transfers] for name in ("start_ns", "end_ns"))
        conversions = [i for i, row in enumerate(transfers) if row["address"] == "0x76" and row["rw"] == "w" and row["bytes"] == "44"]
        recording, checked = self.first.recording, 0
        for row in range(len(recording["t_us"])):
            stages = [recording[name][row] for name in files.STAGES]
            # Without a contact packet, or for a conversion of the temperature.
            if not all(stage == stage for stage in stages) or not self.first.measured[row]:
                continue
            self.assertEqual(sum(stages), recording["total_us"][row])
            t_us = recording["t_us"][row]
            command = max((i for i in conversions if end_us[i] <= t_us), default=None)
            self.assertIsNotNone(command)
            # The middle of the conversion, as the datasheet's maximum and its margin have it.
            self.assertLess(abs(t_us - end_us[command] - 1.05 * 2170 / 2), 20)
            ready_us = start_us[command - 3] + stages[0] + stages[1]  # three selections lead up to the broadcast
            after = range(command, min(command + 60, len(transfers)))
            reads = [i for i in after if transfers[i]["rw"] == "r" and start_us[i] < ready_us + 100]
            self.assertEqual(len(reads), 15)
            self.assertLess(abs(end_us[reads[-1]] - ready_us), 40)
            checked += 1
        self.assertGreater(checked, 1000)

    def test_the_fit_takes_its_time_and_no_more(self):
        """Emulated time of a full frame's fit, interrupts included."""
        fitted = ((self.first.flags & (FIT_VALID | SENSOR_MASKED)) == FIT_VALID) & self.first.measured
        self.assertGreater(fitted.sum(), 500)
        self.assertLessEqual(self.first.recording["fit_us"][fitted].max(), 450)

    def test_a_sensor_that_dies_is_masked_and_comes_back(self):
        faults = [{"type": "sensor_dead", "sensor": 7, "from_s": 1.0, "to_s": 1.5}]
        run = self.run_image("dead", 4.1, faults, [(1.3, HEALTH)])
        dead = run.between(1.06, 1.45) & run.measured
        self.assertTrue((run.valid[dead] & 1 << 7 == 0).all())
        # A code in 65536 ends in sixteen ones, and costs the next reading too.
        self.assertLessEqual((run.valid[dead] != ALL & ~(1 << 7)).sum(), 2)
        self.assertTrue((run.valid[run.between(3.0, 4.1) & run.measured] == ALL).all())
        in_contact = dead & (run.flags & CONTACT != 0)
        self.assertGreater(in_contact.sum(), 0)
        self.assertTrue((run.flags[in_contact] & SENSOR_MASKED != 0).all())
        during, end = run.recording.health()[1], run.recording.health()[-1]
        self.assertEqual((during["sensors_present"], end["sensors_present"]), (ALL & ~(1 << 7), ALL))
        self.assertGreater(min(end["bus_nacks"], end["frames_incomplete"]), 50)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_stuck_bus_recovers(self):
        # A reset of the multiplexer, which is part of each reading, may free it before anybody notices: so at several moments of a frame.
        faults = [{"type": "sda_stuck_low", "sensor": 3, "from_s": 1.0 + 0.0207 * i, "to_s": 3.0} for i in range(6)]
        faults += [{"type": "mux_stuck", "mux": 1, "from_s": 2.0, "to_s": 3.0}]
        run = self.run_image("stuck", 4.1, faults)
        self.assertGreater(run.between(1.2, 1.9).sum(), 50)
        self.assertTrue((run.valid[run.between(3.5, 4.1) & run.measured] == ALL).all())
        self.assertGreater(run.between(3.5, 4.0).sum(), 40)
        self.assertGreater(run.recording.health()[-1]["bus_recoveries"], 0)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_line_tied_low_costs_its_multiplexer_only(self):
        faults = [{"type": "line_stuck_low", "sensor": 7, "from_s": 1.0, "to_s": 1.5}]
        run = self.run_image("tied", 4.1, faults, [(1.3, HEALTH)])
        others = ALL & ~(0x1F << 5)
        for from_s, to_s, least, valid in ((1.11, 1.5, 70, others), (2.21, 4.0, 150, ALL)):
            rows = run.between(from_s, to_s) & run.measured
            self.assertGreater(rows.sum(), least)
            self.assertTrue((run.valid[rows] == valid).all())
        during, end = run.recording.health()[1], run.recording.health()[-1]
        self.assertEqual((during["sensors_present"], end["sensors_present"]), (others, ALL))
        self.assertLess(end["bus_recoveries"], 6)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_the_rate_of_the_paper(self):
        t_us = self.run_image("slow", 3, commands=[(0.5, "rate", "20")]).recording["t_us"]
        steps = np.diff(t_us)[t_us[:-1] > 600000]
        self.assertGreater(len(steps), 40)
        self.assertLess(abs(steps - 50000).max(), 20)

    def test_the_loader_is_entered_on_command(self):
        run = self.run_image("loader", 3, commands=[(0.8, "loader")])
        self.assertIn("loader", run.report["end_reason"])
        self.assertLess(run.report["emulated_s"], 1.0)


class PicoParallel(Board, unittest.TestCase):
    board, OSR, least_per_s = "pico_parallel", 256, 400

    def test_rate_and_readings(self):
        for osr, at_least in ((256, 1250), (1024, 410)):
            with self.subTest(osr=osr):
                run = self.run_image(f"rate{osr}", 2.0, osr=osr)
                steady = run.between(0.6, 1.95)
                self.assertGreaterEqual(steady.sum() / 1.35, at_least)
                # A frame whose time a temperature conversion took holds no reading, and says so.
                self.assertLess((run.valid[steady] != ALL).mean(), 0.05)
                # One code in 65536 looks as if it had been torn: its sensor alone is left out.
                left_out = [ALL & ~int(valid) for valid in run.valid[steady] if valid not in (0, ALL)]
                self.assertLessEqual(len(left_out), 3)
                self.assertTrue(all(bits.bit_count() == 1 for bits in left_out))
                self.assertEqual((run.recording.end["dropped_packets"], run.recording.end["crc_errors"]), ("0", "0"))
                self.assertEqual(run.report["i2c"]["nacks"], 0)
                self.assert_nothing_is_wrong_and_unflagged(run)
                # The frame clock is steady: of the sampling, not of the sending.
                steps_us = np.diff(run.recording["t_us"][steady])
                self.assertLess(np.median(np.abs(steps_us - np.median(steps_us))), 5)

    def test_what_befalls_one_line_costs_its_sensor_only(self):
        first = {"line_stuck_low": 0, "sensor_missing": 5, "clock_glitch": 14}
        second = {"line_stuck_high": 3, "sensor_dead": 8, "sda_stuck_low": 11}
        plan = [
            {"type": kind, "sensor": sensor, "from_s": from_s, "to_s": from_s + 0.1}
            for from_s, kinds in ((0.8, first), (0.9, second))
            for kind, sensor in kinds.items()
        ]
        run = self.run_image("lines", 2.6, plan, [(0.95, HEALTH), (2.5, HEALTH)])
        self.assertTrue((run.valid[run.between(0.7, 0.795)] == ALL).all())
        for from_s, silent, touched in ((0.8, (0, 5), (0, 5, 14)), (0.9, (3, 8), (0, 5, 14, 3, 8, 11))):
            during = run.between(from_s + 0.003, from_s + 0.098) & run.measured
            self.assertGreater(during.sum(), 105)
            others = ALL & ~sum(1 << k for k in touched)
            self.assertTrue((run.valid[during] & others == others).all())
            self.assertTrue((run.valid[during] & sum(1 << k for k in silent) == 0).all())
        # Sensors that were lost are asked for again every second at first.
        after = run.valid[run.between(2.2, 2.6)]
        self.assertGreater(len(after), 480)
        self.assertGreater((after == ALL).mean(), 0.95)
        self.assertLess(np.diff(run.t_s[run.t_s > 0.6]).max(), 0.012)
        during, *_, end = run.recording.health()
        self.assertEqual(during["sensors_present"] & (1 << 3 | 1 << 8), 0)
        self.assertEqual(end["sensors_present"], ALL)
        self.assertGreater(end["frames_incomplete"], 230)
        self.assertGreater(end["bus_nacks"], 10)
        # Fewer than sixteen ones at the end of the code that a line's fault cuts off look like a code's own: one reading.
        for fault in plan:
            run.recording.sensors_Pa[np.abs(run.t_s - fault["from_s"]) < 0.001, fault["sensor"]] = np.nan
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_sensor_whose_supply_dips_is_reset_at_once(self):
        # Sensors 0 and 7 come back without a reset. Others are struck at night.
        fault = {"type": "sensor_brown_out", "sensor": 14, "from_s": 0.8006}
        run = self.run_image("supply", 1.0, [fault])
        self.assertGreater((run.valid[run.between(fault["from_s"] + 0.02, 1.0)] == ALL).mean(), 0.98)
        during = run.valid[run.between(fault["from_s"], fault["from_s"] + 0.02)]
        self.assertTrue(np.isin(during, (0, ALL, ALL & ~(1 << 14))).all())
        self.assertTrue((during == ALL & ~(1 << 14)).any())
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_temperatures_that_are_wrong_are_not_used(self):
        plan = [{"type": "sensor_d2_corrupt", "sensor": sensor, "from_s": 1.0, "to_s": 5.0} for sensor in (3, 8, 12)]
        run = self.run_image("temperatures", 7.0, plan, osr=1024)
        # Eleven bits of 24 make more than a quarter of a degree.
        self.assertGreater(run.doubtful[run.between(1.6, 5.0)].mean(), 0.5)
        self.assertLess(run.doubtful[run.between(0.5, 1.0) | run.between(6.0, 7.0)].mean(), MOVING)
        valid = run.valid[run.between(1.0, 7.0) & run.measured]
        bad = sum(1 << fault["sensor"] for fault in plan)
        self.assertGreater((valid | bad == ALL).mean(), 0.99)
        self.assertGreater((valid == ALL).mean(), 0.9)  # two that agree by chance reset their sensor: 0.97 and more of six such plans
        worst_Pa = self.truth.worst_reading_Pa(run.recording, run.t_s, ~run.doubtful)
        self.assertLess(worst_Pa, 240 + 7 * NOISE_Pa[run.osr])  # 1 degC may pass

    def test_a_sensor_with_a_wrong_bit_in_its_prom_is_flagged(self):
        run = self.run_image("prom", 4.0, [{"type": "sensor_prom_bit", "sensor": 7, "from_s": 0}], osr=1024)
        used = (run.valid & 1 << 7) != 0
        self.assertGreater(used[run.between(3.0, 4.0)].mean(), 0.95)
        self.assertTrue(run.doubtful[used & run.between(3.0, 4.0)].all())
        self.assertLess(run.doubtful[run.between(0.5, 0.8)].mean(), MOVING)  # it is not used yet
        error_Pa = np.median(run.recording.sensors_Pa[used, 7] - run.recording.sensors_Pa[used, 0])
        self.assertGreater(abs(error_Pa), 5000)
        self.assertEqual(run.recording.health()[-1]["sensors_prom_bad"], 1 << 7)

    def test_the_stream_comes_back_after_a_stuck_clock(self):
        plan = [{"type": "scl_stuck_low", "from_s": 0.7, "to_s": 0.75}, {"type": "scl_stuck_high", "from_s": 1.0, "to_s": 1.05}]
        run = self.run_image("clock", 2.5, plan)
        for fault, back_s in zip(plan, (0.15, 1.1)):
            self.assertTrue((run.valid[run.between(fault["from_s"] + 0.003, fault["to_s"])] == 0).all())
            after = run.valid[run.between(fault["to_s"] + back_s, fault["to_s"] + back_s + 0.1)]
            self.assertGreater(len(after), 110, fault["type"])
            self.assertGreater((after == ALL).mean(), 0.95, fault["type"])
        end = run.recording.health()[-1]
        self.assertGreater(min(end["bus_timeouts"], end["bus_recoveries"]), 0)
        self.assert_nothing_is_wrong_and_unflagged(run)


if __name__ == "__main__":
    main(TOOLS, "image", "fingertip", "command_frame", "node")
