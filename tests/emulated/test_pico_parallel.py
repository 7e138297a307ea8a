"""The release image of pico_parallel in the emulator: rate, accuracy, faults of lines, sensors, clock and host.

usage: test_pico_parallel.py --image F.bin --fingertip TOOL --command_frame PROGRAM --node NODE
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip import files  # noqa: E402
from truth import Truth  # noqa: E402

TOOLS = argparse.Namespace()
ALL = 0x7FFF
# Noise of a conversion, rms: MS5840 datasheet.
NOISE_Pa = {256: 11.0, 1024: 3.9}
# Two standard deviations at the limit of UNCERTAIN: a location without a warning is not off by more, whatever befalls the array.
UNWARNED_mm = 1.2
SENSOR_DOUBTFUL = 1 << 18


def encoded(*command):
    done = subprocess.run([TOOLS.command_frame, *command], capture_output=True, text=True, check=True)
    return done.stdout.strip()


class Run:
    def __init__(self, folder, name, truth, seconds, osr, faults=(), commands=()):
        base = pathlib.Path(folder) / name

        def path(suffix):
            return base.with_suffix("." + suffix)

        script = [(0.45, "dtr 1"), (0.46, encoded("stream", "contact,raw,health")), (0.47, encoded("osr", str(osr))), *commands]
        path("script").write_text("".join(f"{t} {what}\n" for t, what in script))
        path("faults.json").write_text(json.dumps(list(faults)))
        done = subprocess.run(
            [
                TOOLS.node,
                str(ROOT / "host_tools/simulation/emulator/main.mjs"),
                "--board",
                "pico_parallel",
                "--image",
                TOOLS.image,
                "--scenario",
                str(truth.path),
                "--host-script",
                str(path("script")),
                "--capture",
                str(path("ftr")),
                "--report",
                str(path("run.json")),
                "--seconds",
                str(seconds),
                "--faults",
                str(path("faults.json")),
            ],
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise AssertionError(f"the emulator found something wrong:\n{done.stderr}")
        self.report = json.loads(path("run.json").read_text())
        subprocess.run([TOOLS.fingertip, "replay", str(path("ftr")), "--to-csv", str(path("csv"))], check=True, capture_output=True)
        self.recording = files.read_recording(path("csv"))
        self.t_s = truth.times_s(self.recording, self.report)
        self.truth, self.osr = truth, osr
        self.valid = np.nan_to_num(self.recording["valid"]).astype(int)

        self.doubtful = (np.nan_to_num(self.recording["flags"]).astype(int) & SENSOR_DOUBTFUL) != 0

    def between(self, from_s, to_s):
        return (self.t_s > from_s) & (self.t_s < to_s)


class PicoParallel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        path = pathlib.Path(cls.folder.name) / "ideal.csv"
        subprocess.run(
            [sys.executable, str(ROOT / "host_tools/python"), "scenario", "ideal", "-o", str(path), "--seconds", "12"], check=True
        )
        cls.truth = Truth(path)

    def assert_nothing_is_wrong_and_unflagged(self, run):
        self.assertLess(run.truth.worst_reading_Pa(run.recording, run.t_s), 7 * NOISE_Pa[run.osr])
        errors_mm = run.truth.unwarned_errors_mm(run.recording, run.t_s)
        self.assertGreater(len(errors_mm), 100)
        self.assertLess(errors_mm.max(), UNWARNED_mm)

    def check_rate(self, osr, at_least):
        run = Run(self.folder.name, f"rate{osr}", self.truth, 2.0, osr)
        steady = run.between(0.6, 1.95)
        self.assertGreaterEqual(steady.sum() / 1.35, at_least)
        # A frame whose time a temperature conversion took holds no reading, and says so.
        self.assertLess((run.valid[steady] != ALL).mean(), 0.05)
        # One code in 65536 looks as if it had been torn: its sensor alone is left out.
        left_out = [ALL & ~int(valid) for valid in run.valid[steady] if valid not in (0, ALL)]
        self.assertLessEqual(len(left_out), 3)
        self.assertTrue(all(bits.bit_count() == 1 for bits in left_out))
        self.assertEqual(run.recording.end["dropped_packets"], "0")
        self.assertEqual(run.recording.end["crc_errors"], "0")
        self.assertEqual(run.report["i2c"]["nacks"], 0)
        self.assert_nothing_is_wrong_and_unflagged(run)
        # The frame clock is steady: of the sampling, not of the sending.
        steps_us = np.diff(run.recording["t_us"][steady])
        self.assertLess(np.median(np.abs(steps_us - np.median(steps_us))), 5)

    def test_rate_and_readings_at_osr_256(self):
        self.check_rate(256, 1250)

    def test_rate_and_readings_at_osr_1024(self):
        self.check_rate(1024, 410)

    def test_what_befalls_one_line_costs_its_sensor_only(self):
        first = {"line_stuck_low": 0, "sensor_missing": 5, "clock_glitch": 14}
        second = {"line_stuck_high": 3, "sensor_dead": 8, "sda_stuck_low": 11}
        plan = [
            {"type": kind, "sensor": sensor, "from_s": from_s, "to_s": from_s + 0.1}
            for from_s, kinds in ((0.8, first), (0.9, second))
            for kind, sensor in kinds.items()
        ]
        run = Run(self.folder.name, "lines", self.truth, 2.6, 256, plan, [(0.95, encoded("health")), (2.5, encoded("health"))])
        self.assertTrue((run.valid[run.between(0.7, 0.795)] == ALL).all())
        for from_s, silent, touched in ((0.8, (0, 5), (0, 5, 14)), (0.9, (3, 8), (0, 5, 14, 3, 8, 11))):
            during = run.between(from_s + 0.003, from_s + 0.098)
            self.assertGreater(during.sum(), 110)
            others = ALL & ~sum(1 << k for k in touched)
            self.assertTrue((run.valid[during] & others == others).all())
            self.assertTrue((run.valid[during] & sum(1 << k for k in silent) == 0).all())
        # Sensors that were lost are asked for again every second at first.
        after = run.valid[run.between(2.2, 2.6)]
        self.assertGreater(len(after), 480)
        self.assertGreater((after == ALL).mean(), 0.95)
        self.assertLess(np.diff(run.t_s[run.t_s > 0.6]).max(), 0.012)
        # The counters tell.
        during, *_, end = run.recording.health()
        self.assertEqual(during["sensors_present"] & (1 << 3 | 1 << 8), 0)
        self.assertEqual(end["sensors_present"], ALL)
        self.assertGreater(end["frames_incomplete"], 230)
        self.assertGreater(end["bus_nacks"], 10)
        # Fewer than sixteen ones at the end of the code that a line's fault cuts off are not told from a code's own: one reading.
        for fault in plan:
            run.recording.sensors_Pa[np.abs(run.t_s - fault["from_s"]) < 0.001, fault["sensor"]] = np.nan
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_scattered_nacks_cost_a_frame_each(self):
        plan = [{"type": "sensor_nack", "sensor": 4 * i % 15, "from_s": 0.7 + 0.0503 * i} for i in range(24)]
        run = Run(self.folder.name, "nacks", self.truth, 2.2, 256, plan, [(2.1, encoded("health"))])
        # A code that looks torn by chance, see check_rate, is taken for one: of a sensor that no fault struck within a frame or two.
        by_chance = 0
        for i in np.flatnonzero((run.valid != 0) & (run.valid != ALL) & run.between(0, 2.1)):
            struck = {fault["sensor"] for fault in plan if abs(fault["from_s"] - run.t_s[i]) < 0.002}
            by_chance += sum(not run.valid[i] >> k & 1 for k in range(15) if k not in struck)
        self.assertLessEqual(by_chance, 2)
        end = run.recording.health()[-1]
        self.assertEqual(end["bus_nacks"], 24 + by_chance)
        self.assertEqual(end["frames_incomplete"], 24 + by_chance)
        self.assertFalse(run.doubtful.any())
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_sensor_whose_supply_dips_is_reset_at_once(self):
        # One in each run: a sensor found by what it reads is reset at once, but the next one a second later at the earliest.
        for i, k in enumerate((0, 7, 14)):
            fault = {"type": "sensor_brown_out", "sensor": k, "from_s": 0.8 + 0.0003 * i}
            run = Run(self.folder.name, f"supply{k}", self.truth, 1.0, 256, [fault])
            self.assertGreater((run.valid[run.between(fault["from_s"] + 0.02, 1.0)] == ALL).mean(), 0.98)
            during = run.valid[run.between(fault["from_s"], fault["from_s"] + 0.02)]
            self.assertTrue(np.isin(during, (0, ALL, ALL & ~(1 << k))).all())
            self.assertTrue((during == ALL & ~(1 << k)).any())
            self.assert_nothing_is_wrong_and_unflagged(run)

    def test_temperatures_that_are_wrong_are_not_used(self):
        plan = [{"type": "sensor_d2_corrupt", "sensor": sensor, "from_s": 1.0, "to_s": 5.0} for sensor in (3, 8, 12)]
        run = Run(self.folder.name, "temperatures", self.truth, 7.0, 256, plan)
        self.assertGreater(
            run.doubtful[run.between(1.6, 5.0)].mean(), 0.02
        )  # one is some 0.1 s of 3.4 s; nine bits of 24 make more than 1 degC, of a sensor alone at times in none
        self.assertFalse(run.doubtful[run.between(0.5, 1.0) | run.between(6.0, 7.0)].any())
        self.assertGreater((run.valid[run.between(1.0, 7.0)] == ALL).mean(), 0.98)
        good = ~run.doubtful
        self.assertLess(run.truth.worst_reading_Pa(run.recording, run.t_s, good), 240 + 7 * NOISE_Pa[256])  # 1 degC may pass

    def test_a_sensor_with_a_wrong_bit_in_its_prom_is_flagged(self):
        plan = [{"type": "sensor_prom_bit", "sensor": 7, "from_s": 0}]
        run = Run(self.folder.name, "prom", self.truth, 4.0, 1024, plan)
        used = (run.valid & 1 << 7) != 0
        self.assertGreater(used[run.between(3.0, 4.0)].mean(), 0.95)
        self.assertTrue(run.doubtful[used & run.between(3.0, 4.0)].all())
        self.assertFalse(run.doubtful[run.between(0.5, 1.0)].any())
        error_Pa = np.median(run.recording.sensors_Pa[used, 7] - run.recording.sensors_Pa[used, 0])
        self.assertGreater(abs(error_Pa), 5000)
        self.assertEqual(run.recording.health()[-1]["sensors_prom_bad"], 1 << 7)

    def test_the_stream_comes_back_after_a_stuck_clock(self):
        plan = [{"type": "scl_stuck_low", "from_s": 0.7, "to_s": 0.75}, {"type": "scl_stuck_high", "from_s": 1.0, "to_s": 1.05}]
        run = Run(self.folder.name, "clock", self.truth, 2.5, 256, plan)
        for fault, back_s in zip(plan, (0.15, 1.1)):
            self.assertTrue((run.valid[run.between(fault["from_s"] + 0.003, fault["to_s"])] == 0).all())
            after = run.valid[run.between(fault["to_s"] + back_s, fault["to_s"] + back_s + 0.1)]
            self.assertGreater(len(after), 110, fault["type"])
            self.assertGreater((after == ALL).mean(), 0.95, fault["type"])
        end = run.recording.health()[-1]
        self.assertGreater(end["bus_timeouts"], 0)
        self.assertGreater(end["bus_recoveries"], 0)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_host_that_stalls_and_a_cable_that_is_pulled_cost_frames_and_no_more(self):
        plan = [{"type": "host_stall", "from_s": 0.8, "to_s": 5.8}, {"type": "usb_unplug", "from_s": 6.2, "to_s": 6.4}]
        again = [(7.0, "dtr 1"), (7.01, encoded("stream", "contact,raw,health")), (7.3, encoded("health"))]
        run = Run(self.folder.name, "host", self.truth, 7.5, 1024, plan, again)
        for from_s, to_s in ((5.85, 6.15), (7.1, 7.5)):
            valid = run.valid[run.between(from_s, to_s)]
            self.assertGreater(len(valid), 400 * (to_s - from_s))
            self.assertGreater((valid == ALL).mean(), 0.95)
        # What the host misses is what the device says that it dropped, and the few that were under way in the cable.
        missed, dropped = int(run.recording.end["dropped_packets"]), run.recording.health()[-1]["packets_dropped"]
        self.assertGreater(missed, 4.5 * 400)
        self.assertLessEqual(dropped, missed)
        self.assertLess(missed - dropped, 10)
        self.assertEqual(run.report["reboots"], 0)
        self.assertEqual(run.report["usb"]["enumerations"], 2)
        self.assert_nothing_is_wrong_and_unflagged(run)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for argument in ("image", "fingertip", "command_frame", "node"):
        parser.add_argument(f"--{argument}", required=True)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
