"""The release image of pico_mux in the emulator: accuracy, repeatability, timing, faults.

usage: test_pico_mux.py --image F.bin --fingertip TOOL --command_frame PROGRAM --node NODE
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip import files  # noqa: E402
from truth import Truth  # noqa: E402

TOOLS = argparse.Namespace()
FLAG_CONTACT = 1 << 0
FLAG_FIT_VALID = 1 << 1
FLAG_HELD = 1 << 6
FLAG_SENSOR_MASKED = 1 << 14
# Noise of a conversion at OSR 1024, rms: MS5840 datasheet.
NOISE_Pa = 3.9
# Two standard deviations at the limit of UNCERTAIN: a location without a warning is not off by more, whatever befalls the array.
UNWARNED_mm = 1.2


def encoded(*command):
    done = subprocess.run([TOOLS.command_frame, *command], capture_output=True, text=True, check=True)
    return done.stdout.strip()


class Run:
    """One run of the image: starts at once, waits on demand."""

    def __init__(self, folder, name, scenario, seconds=None, commands=(), faults=None, logs=False):
        self.base = pathlib.Path(folder) / name
        script = [(0.45, "dtr 1"), (0.46, encoded("stream", "contact,raw,health")), *commands]
        self.path("script").write_text("".join(f"{t} {what}\n" for t, what in script))
        call = [
            TOOLS.node,
            str(ROOT / "host_tools/simulation/emulator/main.mjs"),
            "--board",
            "pico_mux",
            "--image",
            TOOLS.image,
            "--scenario",
            str(scenario),
            "--host-script",
            str(self.path("script")),
            "--capture",
            str(self.path("ftr")),
            "--report",
            str(self.path("run.json")),
        ]
        if seconds:
            call += ["--seconds", str(seconds)]
        if faults is not None:
            self.path("faults.json").write_text(json.dumps(faults))
            call += ["--faults", str(self.path("faults.json"))]
        if logs:
            call += ["--bus-log", str(self.path("bus.csv")), "--usb-log", str(self.path("usb.csv"))]
        self.process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def path(self, suffix):
        return self.base.with_suffix("." + suffix)

    def finish(self):
        output, _ = self.process.communicate()
        if self.process.returncode != 0:
            raise AssertionError(f"the emulator found something wrong:\n{output}")
        self.report = json.loads(self.path("run.json").read_text())
        subprocess.run(
            [TOOLS.fingertip, "replay", str(self.path("ftr")), "--to-csv", str(self.path("csv"))], check=True, capture_output=True
        )
        self.recording = files.read_recording(self.path("csv"))
        return self


def make_scenario(folder, name, seconds):
    path = pathlib.Path(folder) / f"{name}.csv"
    subprocess.run(
        [sys.executable, str(ROOT / "host_tools/python"), "scenario", name, "-o", str(path), "--seconds", str(seconds)], check=True
    )
    return path


class PicoMux(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.scenario = make_scenario(cls.folder.name, "ideal", 12)
        runs = [Run(cls.folder.name, "first", cls.scenario, logs=True), Run(cls.folder.name, "second", cls.scenario)]
        for run in runs:
            cls.addClassCleanup(run.process.kill)
        cls.first, cls.second = [run.finish() for run in runs]
        cls.truth = Truth(cls.scenario)

    def assert_nothing_is_wrong_and_unflagged(self, run):
        t_s = self.truth.times_s(run.recording, run.report)
        self.assertLess(self.truth.worst_reading_Pa(run.recording, t_s), 7 * NOISE_Pa)
        errors_mm = self.truth.unwarned_errors_mm(run.recording, t_s)
        self.assertGreater(len(errors_mm), 50)
        self.assertLess(errors_mm.max(), UNWARNED_mm)

    def test_ideal_presses_are_located_and_weighed(self):
        out = self.first.path("summary.json")
        subprocess.run(
            [
                sys.executable,
                str(ROOT / "host_tools/python"),
                "evaluate",
                str(self.first.path("csv")),
                str(self.scenario),
                "--run",
                str(self.first.path("run.json")),
                "-o",
                str(out),
            ],
            check=True,
        )
        summary = json.loads(out.read_text())
        self.assertLessEqual(summary["localisation_median_mm"], 0.05)
        self.assertLessEqual(summary["force_mape_percent"], 1.0)
        self.assertGreaterEqual(summary["frames_per_s"], 200)
        self.assertGreater(summary["fitted_frames"], 500)
        for nothing in ("dropped_packets", "crc_errors", "emulator_warnings"):
            self.assertEqual(summary[nothing], 0, nothing)

    def test_two_runs_are_the_same_to_the_byte(self):
        self.assertEqual(self.first.path("ftr").read_bytes(), self.second.path("ftr").read_bytes())
        self.assertEqual(self.first.report["cycles"], self.second.report["cycles"])

    def test_stage_timings_are_those_of_the_bus(self):
        """convert and read against the bus itself, and the six stages against their total."""
        zero_us = self.first.report["device_time_zero_s"] * 1e6
        with open(self.first.path("bus.csv"), newline="") as file:
            transfers = list(csv.DictReader(file))
        start_us = [float(row["start_ns"]) / 1e3 - zero_us for row in transfers]
        end_us = [float(row["end_ns"]) / 1e3 - zero_us for row in transfers]
        conversions = [i for i, row in enumerate(transfers) if row["address"] == "0x76" and row["rw"] == "w" and row["bytes"] == "44"]
        recording = self.first.recording
        held = recording.flag(FLAG_HELD)
        checked = 0
        for row in range(len(recording["t_us"])):
            stages = [recording[name][row] for name in files.STAGES]
            if not all(stage == stage for stage in stages):
                continue  # no contact packet for this frame
            if held[row]:
                continue  # a conversion of the temperature
            self.assertEqual(sum(stages), recording["total_us"][row])
            t_us = recording["t_us"][row]
            command = max((i for i in conversions if end_us[i] <= t_us), default=None)
            self.assertIsNotNone(command)
            # The middle of the conversion, as the datasheet's maximum and its margin have it.
            self.assertLess(abs(t_us - end_us[command] - 1.05 * 2170 / 2), 20)
            convert_us, read_us = stages[0], stages[1]
            begin_us = start_us[command - 3]  # three selections lead up to the broadcast
            reads = [
                i
                for i in range(command, min(command + 60, len(transfers)))
                if transfers[i]["rw"] == "r" and start_us[i] < begin_us + convert_us + read_us + 100
            ]
            self.assertEqual(len(reads), 15)
            self.assertLess(abs(end_us[reads[-1]] - begin_us - convert_us - read_us), 40)
            checked += 1
        self.assertGreater(checked, 1000)

    def test_the_fit_takes_its_time_and_no_more(self):
        """Emulated time of a full frame's fit, interrupts included, is the same in every run."""
        recording = self.first.recording
        fitted = recording.flag(FLAG_FIT_VALID) & ~recording.flag(FLAG_SENSOR_MASKED) & ~recording.flag(FLAG_HELD)
        self.assertGreater(fitted.sum(), 500)
        self.assertLessEqual(recording["fit_us"][fitted].max(), 450)

    def test_a_sensor_that_dies_is_masked_and_comes_back(self):
        faults = [{"type": "sensor_dead", "sensor": 7, "from_s": 1.0, "to_s": 1.5}]
        run = Run(self.folder.name, "dead", self.scenario, 4.1, [(1.3, encoded("health"))], faults).finish()
        recording = run.recording
        t_s = recording["t_us"] * 1e-6
        valid = recording["valid"].astype("uint32")
        measured = ~recording.flag(FLAG_HELD)
        dead = (t_s > 1.05) & (t_s < 1.45) & measured
        self.assertTrue((valid[dead] & 1 << 7 == 0).all())
        self.assertLessEqual(
            (valid[dead] != 0x7FFF & ~(1 << 7)).sum(), 2
        )  # a code in 65536 ends in sixteen ones, and costs the next reading too
        self.assertTrue((valid[(t_s > 3.0) & measured] == 0x7FFF).all())
        flags = recording["flags"].astype("uint32")
        in_contact = dead & (flags & FLAG_CONTACT != 0)
        self.assertGreater(in_contact.sum(), 0)
        self.assertTrue((flags[in_contact] & FLAG_SENSOR_MASKED != 0).all())
        during, end = recording.health()[1], recording.health()[-1]
        self.assertEqual((during["sensors_present"], end["sensors_present"]), (0x7FFF & ~(1 << 7), 0x7FFF))
        self.assertGreater(end["bus_nacks"], 50)
        self.assertGreater(end["frames_incomplete"], 50)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_scattered_nacks_are_repaired_or_cost_two_frames_each(self):
        """A sensor that does not hear a command that the others acknowledge has nothing to say, nor anything for sure the next time."""
        faults = [{"type": "sensor_nack", "sensor": 4 * i % 15, "from_s": 0.7 + 0.0503 * i} for i in range(48)]
        run = Run(self.folder.name, "nacks", self.scenario, 3.6, [(3.5, encoded("health"))], faults).finish()
        end = run.recording.health()[-1]
        repaired = run.report["i2c"]["nacks"]
        self.assertGreater(repaired, 6)
        self.assertLessEqual(end["frames_incomplete"], 2 * (48 - repaired))
        self.assertGreater(end["frames_incomplete"], 0)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_stuck_bus_recovers(self):
        # A reset of the multiplexer, which is part of each reading, may free it before anybody notices: so at several moments of a frame.
        faults = [{"type": "sda_stuck_low", "sensor": 3, "from_s": 1.0 + 0.0207 * i, "to_s": 3.0} for i in range(6)]
        faults += [{"type": "mux_stuck", "mux": 1, "from_s": 2.0, "to_s": 3.0}]
        run = Run(self.folder.name, "stuck", self.scenario, 4.1, faults=faults).finish()
        recording = run.recording
        t_s = recording["t_us"] * 1e-6
        self.assertGreater(((t_s > 1.2) & (t_s < 1.9)).sum(), 50)
        back = (t_s > 3.5) & ~recording.flag(FLAG_HELD)
        self.assertTrue((recording["valid"].astype("uint32")[back] == 0x7FFF).all())
        self.assertGreater(((t_s > 3.5) & (t_s < 4.0)).sum(), 40)
        self.assertGreater(recording.health()[-1]["bus_recoveries"], 0)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_line_tied_low_costs_its_multiplexer_only(self):
        faults = [{"type": "line_stuck_low", "sensor": 7, "from_s": 1.0, "to_s": 1.5}]
        run = Run(self.folder.name, "tied", self.scenario, 4.1, [(1.3, encoded("health"))], faults).finish()
        recording = run.recording
        t_s = recording["t_us"] * 1e-6
        valid = recording["valid"].astype("uint32")
        measured = ~recording.flag(FLAG_HELD)
        others = 0x7FFF & ~(0x1F << 5)
        tied = (t_s > 1.1) & (t_s < 1.5) & measured
        self.assertGreater(tied.sum(), 70)
        self.assertTrue((valid[tied] == others).all())
        back = (t_s > 2.2) & (t_s < 4.0) & measured
        self.assertGreater(back.sum(), 150)
        self.assertTrue((valid[back] == 0x7FFF).all())
        during, end = recording.health()[1], recording.health()[-1]
        self.assertEqual((during["sensors_present"], end["sensors_present"]), (others, 0x7FFF))
        self.assertLess(end["bus_recoveries"], 6)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_a_host_that_stalls_and_a_cable_that_is_pulled_cost_frames_and_no_more(self):
        faults = [{"type": "host_stall", "from_s": 0.8, "to_s": 5.8}, {"type": "usb_unplug", "from_s": 6.2, "to_s": 6.4}]
        again = [(7.0, "dtr 1"), (7.01, encoded("stream", "contact,raw,health")), (7.3, encoded("health"))]
        run = Run(self.folder.name, "host", self.scenario, 7.5, again, faults).finish()
        t_s = self.truth.times_s(run.recording, run.report)
        for from_s, to_s in ((5.85, 6.15), (7.1, 7.49)):
            rows = (t_s > from_s) & (t_s < to_s)
            self.assertGreater(rows.sum(), 190 * (to_s - from_s))
            self.assertTrue((run.recording["valid"][rows & ~run.recording.flag(FLAG_HELD)] == 0x7FFF).all())
        # What the host misses is what the device says that it dropped, and the few that were under way in the cable.
        missed, dropped = int(run.recording.end["dropped_packets"]), run.recording.health()[-1]["packets_dropped"]
        self.assertGreater(missed, 4.5 * 190)
        self.assertLessEqual(dropped, missed)
        self.assertLess(missed - dropped, 10)
        self.assertEqual(run.report["reboots"], 0)
        self.assertEqual(run.report["usb"]["enumerations"], 2)
        self.assert_nothing_is_wrong_and_unflagged(run)

    def test_the_rate_of_the_paper(self):
        commands = [(0.5, encoded("rate", "20"))]
        recording = Run(self.folder.name, "slow", self.scenario, 3, commands=commands).finish().recording
        t_us = recording["t_us"]
        steps = (t_us[1:] - t_us[:-1])[t_us[:-1] > 600000]
        self.assertGreater(len(steps), 40)
        self.assertLess(abs(steps - 50000).max(), 20)

    def test_the_loader_is_entered_on_command(self):
        run = Run(self.folder.name, "loader", self.scenario, 3, commands=[(0.8, encoded("loader"))]).finish()
        self.assertIn("loader", run.report["end_reason"])
        self.assertLess(run.report["emulated_s"], 1.0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("image", "fingertip", "command_frame", "node"):
        parser.add_argument(f"--{name}", required=True)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
