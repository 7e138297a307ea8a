"""Scenarios, evaluation and plots on data whose answer is known."""

import contextlib
import io
import itertools
import json
import math
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tracemalloc
import unittest
from unittest import mock

import numpy as np

TOOLS = pathlib.Path(__file__).resolve().parents[3] / "host_tools" / "python"
sys.path.insert(0, str(TOOLS))

from fingertip import Flag, cells, command, files  # noqa: E402
from fingertip import plot  # noqa: E402
from fingertip.__main__ import installed  # noqa: E402
from fingertip.columns import Columns  # noqa: E402
from fingertip.wire import Health  # noqa: E402

RECORDING_COLUMNS = ("t_us", "frame", *files.CONTACT_COLUMNS, *files.LATER_COLUMNS, *files.RAW_COLUMNS)

CONTACT, FIT_VALID, SLIP_VALID, SLIP, TARED = 1, 2, 8, 16, 32


class ColumnsTest(unittest.TestCase):
    CODES = {"t_us": "Q", "frame": "I", "sequence": "H", "flags": "I", "x_mm": "f", "temperature_degC": "h", "s0_Pa": "i", "tare0_Pa": "i"}

    def test_numbers_come_back_and_take_what_they_need(self):
        prng, count, gap = np.random.default_rng(3), 20_000, np.arange(20_000) % 7000 < 20
        rows, far = np.arange(count), prng.integers(-(2**31), 2**31, count)
        far[50:52] = -(2**31), 2**31 - 1  # as far apart as they can be
        counted = [1_000_000 + np.round(763.9 * rows) + prng.integers(0, 3, count), rows + 5.0, 2.0 * rows % 65536]
        values = np.float32(prng.normal(size=count)).tolist()
        sent = [prng.choice((32, 5243055), count), [float(str(np.float32(value))) for value in values], prng.integers(-99, 99, count) / 100]
        table = np.array([*counted, *sent, np.round(far / 1024, 4), np.full(count, 101325.5)]).T
        table[9000, 0] = 2.0**60  # beyond what is narrow
        table[gap, 3:] = math.nan
        columns = Columns(self.CODES, list(self.CODES)[:6], ["x1_mm"])
        tracemalloc.start()
        self.addCleanup(tracemalloc.stop)
        for begin, end in itertools.pairwise((0, 1, 5000, 5000, 18_000, count)):
            columns.append(table[begin:end], range(begin + 9, end + 9), rows[begin:end] / 8)
        self.assertLess(tracemalloc.get_traced_memory()[0] / count, 40, "bytes of a row: where doubles take 80")
        for at, name in enumerate(columns):
            np.testing.assert_array_equal(columns[name], table[:, at] if at < 6 else math.nan, name)
        np.testing.assert_array_equal(columns.take(["tare0_Pa", "s0_Pa"]), table[:, :5:-1])
        np.testing.assert_array_equal(columns.take(["line", "time_us"]).T, [rows + 9, rows / 8])
        self.assertIs(columns["x_mm"], columns["x_mm"])
        self.assertNotIn("s0_Pa", columns)


class CellsTest(unittest.TestCase):
    def test_a_number_is_that_of_float_or_odd(self):
        prng = random.Random(4)
        number = lambda: b"%.*f" % (prng.randrange(12), prng.gauss(0, 10 ** prng.randrange(-3, 8)))
        kinds = [number, lambda: number().split(b".")[0], lambda: bytes(prng.choices(b"0123456789.-e/ \xff", k=prng.randrange(19))), bytes]
        rows = [[prng.choice(kinds)() for _ in range(9)] for _ in range(5000)]
        values, odd = cells.cells_of(b"".join(b",".join(row) + b"\n" for row in rows), 9, np.arange(9) < 4)
        usual = rb"[0-9]{0,15}", rb"-?(?=.{2,16}$)([0-9]+\.[0-9]*|\.[0-9]+)|-?[0-9]{1,15}|"
        self.assertEqual(
            odd.tolist(), [i for i, row in enumerate(rows) if not all(re.fullmatch(usual[at > 3], text) for at, text in enumerate(row))]
        )
        for (row, at), value in np.ndenumerate(values):
            text = rows[row][at] if re.fullmatch(usual[at > 3], rows[row][at]) else b""
            self.assertEqual(repr(float(value)), repr(float(text or "nan")))
        self.assertIsNone(cells.cells_of(b"1,2\n3\n4,5,6\n", 2, np.array([True, False])))


class ToolTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))

    def tool(self, name, *arguments, status=0):
        """What the console command does and says, in this process: a Python with matplotlib takes half a second to start."""
        stdout, stderr = io.StringIO(), io.StringIO()
        with (
            mock.patch.object(sys, "argv", [f"bin/fingertip-{name.replace('_', '-')}", *map(str, arguments)]),
            contextlib.redirect_stdout(stdout),
            contextlib.redirect_stderr(stderr),
        ):
            found = installed()
        plot.plt.close("all")
        self.assertEqual(found, status, stderr.getvalue())
        return subprocess.CompletedProcess(name, found, stdout.getvalue(), stderr.getvalue())

    def error(self, name, *arguments):
        done = self.tool(name, *arguments, status=1)
        self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1), done.stderr)
        return done.stderr

    def scenario(self, name="demo", *arguments):
        path = self.folder / f"{name}.csv"
        self.tool("scenario", name, "-o", path, "--overwrite", *arguments)
        return path

    def recording(self, scenario, rate_Hz=200, zero_s=0.25, change=lambda row: row, until_s=None, end=True, columns=RECORDING_COLUMNS):
        """What a perfect fingertip would record of a scenario, after change(row)."""
        truth = files.read_scenario(scenario)
        path = self.folder / "recording.csv"
        names = [*columns, *(f"s{k}_Pa" for k in range(15)), *(f"tare{k}_Pa" for k in range(15))]
        lines = [
            "# fingertip-recording 1",
            "# serial: 0123456789ABCDEF",
            "# slip_window_ms: 100",
            "# x_mm: " + " ".join(f"{v:g}" for v in files.SENSOR_X_mm),
            "# y_mm: " + " ".join(f"{v:g}" for v in files.SENSOR_Y_mm),
            ",".join(names),
        ]
        t_us = np.round(np.arange(0.1, (until_s or truth.t_s[-1]) - zero_s, 1 / rate_Hz) * 1e6).astype(int)
        t_s = t_us / 1e6 + zero_s
        keys = ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N")
        values = np.column_stack([truth.at(key, t_s) for key in keys])
        pressed, slips = truth.is_on("contact", t_s) & (values[:, 4] > 0.05), truth.is_on("slip", t_s)
        stages = dict(convert_us=2500, read_us=3200, queue_us=100, condition_us=20, fit_us=7000, contact_us=30, total_us=12850)
        for frame in range(len(t_us)):
            row = {**dict.fromkeys(names, 0), **stages, "t_us": t_us[frame], "frame": frame, "sequence": frame % 65536, "flags": TARED}
            if pressed[frame]:
                row.update(zip(keys, values[frame]))
                row["flags"] |= CONTACT | FIT_VALID | SLIP_VALID | (SLIP if slips[frame] else 0)
            row = change(row)
            if row is not None:
                lines.append(",".join(str(row[name]) for name in names))
        if end:
            lines.append("# end: reason=seconds frames=1 dropped_packets=3 crc_errors=2 format_errors=1")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    def run_report(self, zero_s=0.25, **more):
        path = self.folder / "run.json"
        path.write_text(json.dumps({"device_time_zero_s": zero_s, "warnings": ["a", "b"], **more}), encoding="utf-8")
        return path

    def summary(self, recording, scenario, *arguments):
        output = self.folder / "summary.json"
        self.tool("evaluate", recording, scenario, "-o", output, "--overwrite", *arguments)
        return json.loads(output.read_text(encoding="utf-8"))


class Scenarios(ToolTest):
    def test_the_same_seed_gives_the_same_bytes(self):
        first = self.scenario("ideal", "--seed", "5").read_bytes()
        self.assertEqual(self.scenario("ideal", "--seed", "5").read_bytes(), first)
        self.assertNotEqual(self.scenario("ideal", "--seed", "6").read_bytes(), first)

    def test_every_scenario_is_whole(self):
        for name, seconds in (("ideal", 20), ("demo", 10), ("wander", 10)):
            truth = files.read_scenario(self.scenario(name))
            self.assertEqual(truth.metadata["name"], name)
            self.assertEqual(truth.sensors_Pa.shape[1], 15)
            np.testing.assert_allclose(np.diff(truth.t_s), 1e-3, atol=1e-9)
            self.assertAlmostEqual(truth.t_s[-1], seconds)
            self.assertFalse(truth.truth["contact"][truth.t_s < 0.5].any(), "quiet at first, for the tare")
            on = truth.truth["contact"] > 0.5
            self.assertTrue((np.abs(truth.truth["x_mm"]) <= 9).all() and (np.abs(truth.truth["y_mm"]) <= 18).all())
            # eq. (4), and no step between rows that a sensor could not follow
            p0, sigma, force = (truth.truth[key][on] for key in ("p0_Pa", "sigma_mm", "force_N"))
            np.testing.assert_allclose(force, 2 * np.pi * p0 * (sigma * 1e-3) ** 2, atol=1e-4)
            self.assertLess(np.abs(np.diff(truth.truth["force_N"])).max(), 0.3)

    def test_the_sensors_feel_the_gaussian(self):
        truth = files.read_scenario(self.scenario("ideal"))
        row = int(np.argmax(truth.truth["force_N"]))
        x, y, p0, sigma = (truth.truth[key][row] for key in ("x_mm", "y_mm", "p0_Pa", "sigma_mm"))
        for k in range(15):
            distance = math.hypot((k // 5 - 1) * 9 - x, (k % 5 - 2) * 9 - y)
            self.assertAlmostEqual(truth.sensors_Pa[row, k], p0 * math.exp(-(distance**2) / (2 * sigma**2)), delta=0.002 * p0 + 0.01)

    def test_ideal_covers_place_and_force_and_does_not_slip(self):
        truth = files.read_scenario(self.scenario("ideal"))
        middles = [np.searchsorted(truth.t_s, (a + b) / 2) for a, b in truth.intervals("contact")]
        self.assertGreater(len(middles), 25)
        for key, low, high in (("x_mm", -7, 7), ("y_mm", -15, 15), ("force_N", 0.6, 17)):
            self.assertLess(truth.truth[key][middles].min(), low)
            self.assertGreater(truth.truth[key][middles].max(), high)
        self.assertEqual(truth.intervals("slip"), [])

    def test_slips_have_their_speed(self):
        truth = files.read_scenario(self.scenario("demo"))
        speeds = []
        for start, end in truth.intervals("slip"):
            middle = truth.at("y_mm", (start + end) / 2 + np.array([-0.01, 0.01]))
            speeds.append((middle[1] - middle[0]) / 0.02)
        self.assertEqual(len(speeds), 3)
        np.testing.assert_allclose(speeds[:2], [40, -64], rtol=1e-3)

    def test_ranges(self):
        self.assertIn("1 to 3600", self.error("scenario", "demo", "-o", self.folder / "x", "--seconds", "nan"))
        self.assertIn("0 or more", self.error("scenario", "demo", "-o", self.folder / "x", "--seed", "-1"))
        self.assertIn("choose another place", self.error("scenario", "demo", "-o", self.folder / "no" / "x"))
        self.assertIn("give --overwrite", self.error("scenario", "demo", "-o", self.scenario()))
        with mock.patch("fingertip.scenario.write_scenario", side_effect=KeyboardInterrupt):
            self.assertEqual(self.error("scenario", "demo", "-o", self.folder / "x"), "fingertip-scenario: interrupted\n")


class Evaluation(ToolTest):
    def setUp(self):
        super().setUp()
        self.demo = self.scenario()

    def evaluated(self, change=lambda row: row, **options):
        """The demo's summary."""
        return self.summary(self.recording(self.demo, change=change, **options), self.demo, "--run", self.run_report())

    def test_a_perfect_recording(self):
        summary = self.evaluated()
        # the file has four decimals of mm, five of N
        self.assertLess(summary["localisation_p95_mm"], 2e-4)
        self.assertLess(summary["force_mape_percent"], 1e-2)
        self.assertLess(summary["force_rmse_N"], 1e-4)
        self.assertAlmostEqual(summary["frames_per_s"], 200, delta=0.1)
        nothing = "contact_missed contact_false slip_missed slip_valid_lost slip_false stages_sum_wrong"
        counts = dict(slip_found=3, dropped_packets=3, crc_errors=2, format_errors=1, emulator_warnings=2, total_us_median=12850)
        for key, value in {**dict.fromkeys(nothing.split(), 0), **counts}.items():
            self.assertEqual(summary[key], value, key)

    def test_known_errors_come_out(self):
        def change(row):
            if row["flags"] & FIT_VALID:
                row.update(x_mm=row["x_mm"] + 0.3, y_mm=row["y_mm"] - 0.4, force_N=1.05 * row["force_N"])
            return row

        summary = self.evaluated(change)
        self.assertAlmostEqual(summary["localisation_median_mm"], 0.5, delta=1e-3)
        self.assertAlmostEqual(summary["force_mape_percent"], 5, delta=0.01)

    def test_device_time_zero_counts(self):
        recording = self.recording(self.demo)
        wrong = self.summary(recording, self.demo, "--run", self.run_report(zero_s=0.2))
        self.assertGreater(wrong["force_rmse_N"], 0.1)
        self.assertGreater(self.summary(recording, self.demo)["force_rmse_N"], wrong["force_rmse_N"])

    def test_missed_and_false_contacts(self):
        truth = files.read_scenario(self.demo)
        recorded = truth.t_s >= 0.35
        missed = self.evaluated(lambda row: {**row, "flags": TARED if row["frame"] % 2 else row["flags"]})
        strong = (truth.truth["force_N"][recorded] > 0.2).mean()
        self.assertAlmostEqual(missed["contact_missed"] / missed["frames"], strong / 2, delta=0.01)
        false = self.evaluated(lambda row: {**row, "flags": row["flags"] | CONTACT})
        self.assertAlmostEqual(false["contact_false"] / false["frames"], 1 - truth.truth["contact"][recorded].mean(), delta=0.01)
        self.assertEqual(false["contact_missed"], 0)

    def test_slips_missed_false_and_without_validity(self):
        slips = files.read_scenario(self.demo).intervals("slip")
        middle_s = sum(slips[1]) / 2

        def lost(row):  # one frame within the second slip, and a time far from any
            t_s = row["t_us"] / 1e6 + 0.25
            return {**row, "flags": row["flags"] & ~SLIP_VALID if abs(t_s - middle_s) < 0.003 or t_s < slips[0][0] - 0.1 else row["flags"]}

        for change, until_s, expected in (
            (lambda row: {**row, "flags": row["flags"] & ~SLIP}, None, (0, 3, 0, 0)),
            # one frame of slip well before the first true one
            (lambda row: {**row, "flags": row["flags"] | (SLIP if row["frame"] == 500 else 0)}, None, (3, 0, 1, 0)),
            (lambda row: row, 4, (1, 0, 0, 0)),  # a slip after the end of the recording is neither found nor missed
            (lost, None, (3, 0, 0, 1)),
        ):
            found = self.evaluated(change, until_s=until_s)
            self.assertEqual(tuple(found[f"slip_{name}"] for name in ("found", "missed", "false", "valid_lost")), expected)

    def test_an_output_is_never_an_input(self):
        scenario = self.scenario()
        recording = self.recording(scenario)
        before = recording.read_bytes()
        linked = self.folder / "linked.png"
        linked.hardlink_to(recording)
        self.assertIn("is named twice", self.error("evaluate", recording, scenario, "-o", linked))
        self.assertIn("is named twice", self.error("plot", recording, "-o", linked))
        self.assertIn("is a folder", self.error("evaluate", recording, scenario, "-o", self.folder))
        self.assertEqual(recording.read_bytes(), before)

    def test_stages_that_do_not_add_up(self):
        self.assertEqual(self.evaluated(lambda row: {**row, "fit_us": 7000 + (row["frame"] < 7)})["stages_sum_wrong"], 7)

    def test_rows_without_contact_packet_are_left_out(self):
        contact = dict.fromkeys((*files.CONTACT_COLUMNS, *files.LATER_COLUMNS), "")
        summary = self.evaluated(lambda row: row if row["frame"] % 10 else {**row, **contact})
        self.assertLess(summary["localisation_p95_mm"], 2e-4)

    def test_a_killed_recorder(self):
        ended, killed = self.evaluated(), self.evaluated(end=False)
        counts = {key: value for key, value in ended.items() if value != killed[key]}
        self.assertEqual(counts, {"dropped_packets": 3, "crc_errors": 2, "format_errors": 1})
        self.assertIsNone(killed["dropped_packets"])
        self.tool("plot", self.folder / "recording.csv", "-o", self.folder / "p.png")

    def test_unrelated_files(self):
        scenario = self.scenario()
        recording = self.recording(scenario, change=lambda row: {**row, "flags": TARED})
        output = self.folder / "s.json"
        self.assertIn("no fitted frame", self.error("evaluate", recording, scenario, "-o", output))
        self.assertIn("no recording", self.error("evaluate", scenario, scenario, "-o", output))
        self.assertIn("no scenario", self.error("evaluate", recording, recording, "-o", output))
        self.assertIn("device_time_zero_s", self.error("evaluate", recording, scenario, "--run", self.run_report(None), "-o", output))
        self.assertFalse(output.exists())

    def test_restarts(self):
        """By the time, and where only the frames' numbers show them."""
        back = lambda row: {**row, "t_us": row["t_us"] if row["frame"] < 600 else row["t_us"] - 3000000}
        self.assert_restart(self.recording(self.demo, change=back), self.demo, 600)
        self.assert_restart(self.recording(self.demo, change=lambda row: {**row, "frame": row["frame"] % 700}), self.demo, 700)

    def test_frame_numbers_that_cross_their_end_are_no_restart(self):
        scenario = self.scenario()
        recording = self.recording(scenario, change=lambda row: {**row, "frame": (row["frame"] + 2**32 - 700) % 2**32})
        self.tool("evaluate", recording, scenario, "--run", self.run_report(), "-o", self.folder / "wrapped.json")
        t_us, frame = np.arange(4), np.array([2**32 - 2, 2**32 - 1, 0, 1])
        self.assertEqual(list(files.restart_rows(t_us, frame)), [])
        self.assertEqual(list(files.restart_rows(t_us, frame[::-1])), [1, 2, 3])

    def assert_restart(self, recording, scenario, frame):
        lines = recording.read_text(encoding="utf-8").split("\n")
        line = 2 + frame + next(at for at, text in enumerate(lines) if text.startswith("t_us,"))
        self.tool("plot", recording, "-o", self.folder / "restarted.png", "--overwrite")
        for arguments in (("evaluate", recording, scenario), ("plot", recording, "--truth", scenario)):
            err = self.error(*arguments, "--run", self.run_report(), "-o", self.folder / "p.png")
            self.assertIn(f"{recording}:{line}: the fingertip restarted here; ", err)
        self.assertFalse((self.folder / "p.png").exists())
        # what it advises to do works
        recording.write_text("\n".join(lines[: line - 1]) + "\n", encoding="utf-8")
        self.tool("plot", recording, "--truth", scenario, "-o", self.folder / "p.png")
        (self.folder / "p.png").unlink()

    def test_a_time_that_repeats(self):
        scenario = self.scenario()
        recording = self.recording(scenario, change=lambda row: {**row, "t_us": row["t_us"] - 5000 * (row["frame"] == 600)})
        err = self.error("evaluate", recording, scenario, "-o", self.folder / "s")
        self.assertRegex(err, r"\.csv:\d+: a second frame of the same time")

    def test_out_of_the_source_tree(self):
        recording = self.recording(self.scenario("demo", "--seconds", "2"))
        for words, status, said in (
            (("plot", recording, "-o", self.folder / "p.png"), 0, ""),
            (("plot", recording, "-o", "p"), 1, "ends in .png"),
            (("fly",), 1, "plot|scenario"),
        ):
            done = subprocess.run([sys.executable, TOOLS, *map(str, words)], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(said, done.stderr)

    def test_names_cannot_speak_to_the_terminal(self):
        err = self.error("evaluate", self.folder / "\x1b[31m\n", "x", "-o", self.folder / "s")
        self.assertIn("\\x1b[31m\\n: No such file", err)


class TrustedRows(ToolTest):
    def test_a_fit_without_a_warning_is_trusted(self):
        flags = [0, files.FIT_VALID, files.FIT_VALID | files.SLIP, files.FIT_VALID | int(Flag.SENSOR_DOUBTFUL), int(Flag.SENSOR_DOUBTFUL)]
        rows = iter(flags * 10_000)
        recording = files.read_recording(self.recording(self.scenario(), change=lambda row: {**row, "flags": next(rows)}))
        np.testing.assert_array_equal(recording.trusted[:5], [False, True, True, False, False])


class MalformedFiles(ToolTest):
    def assert_damage(self, read, path, line_number, change, expected):
        lines = path.read_text(encoding="utf-8").split("\n")
        lines[line_number - 1] = change(lines[line_number - 1])
        bad = self.folder / "bad.csv"
        bad.write_text("\n".join(lines), encoding="utf-8")
        with self.assertRaises(files.InputError) as caught:
            read(bad)
        message = str(caught.exception)
        self.assertTrue(message.startswith(f"{bad}:{line_number}: "), message)
        self.assertIn(expected, message)
        return bad

    def test_scenarios(self):
        path = self.scenario("demo", "--seconds", "1")
        for change, expected in [
            (lambda s: "nan," + s.split(",", 1)[1], "t_s"),
            (lambda s: "-0.001," + s.split(",", 1)[1], "time starts at 0"),
            (lambda s: s + ",1", "columns"),
            (lambda s: s[:30], "columns"),
            (lambda s: s.rsplit(",", 1)[0] + ",inf", "s14_Pa"),
            (lambda s: s.rsplit(",", 1)[0] + ",", "s14_Pa"),
            (lambda s: "0.001," + s.split(",", 1)[1], "does not increase"),
        ]:
            self.assert_damage(files.read_scenario, path, 100, change, expected)
        self.assert_damage(files.read_scenario, path, 8, lambda s: s.replace("force_N", "force"), "wrong header")
        self.assert_damage(files.read_scenario, path, 1, lambda s: "# fingertip-scenario 2", "format 2 is unknown")
        with self.assertRaisesRegex(files.InputError, "check the path"):
            files.read_scenario(self.folder / "absent.csv")

    def test_health(self):
        path = self.recording(self.scenario())
        fields = {"sequence": 1, "t_us": 5, **dict.fromkeys(Health._fields, 0), "frames": 7}
        packet = " ".join(f"{name}={value}" for name, value in fields.items())
        path.write_text(path.read_text(encoding="utf-8").replace("# end:", f"# packet: health {packet}\n# end:"), encoding="utf-8")
        self.assertEqual(files.read_recording(path).health(), [fields])

    def test_run_reports(self):
        path = self.folder / "run.json"
        for text in ("{", "[]"):
            path.write_text(text, encoding="utf-8")
            with self.assertRaises(files.InputError):
                files.read_run(path)


class TangentialLoad(ToolTest):
    SHARE, DEGREES = 0.3, 40

    def pulled_scenario(self):
        """The demo, each contact pulled by 0.3 of its force, 40 degrees from x to y."""
        path = self.scenario()
        shares = [self.SHARE * f(math.radians(self.DEGREES)) for f in (math.cos, math.sin)]
        lines = []
        for line in path.read_text(encoding="utf-8").splitlines():
            if line[0].isdigit():
                force_N = float(line.split(",")[4])
                line += "".join(f",{share * force_N:.6f}" for share in shares)
            elif not line.startswith("#"):
                line += ",Qx_N,Qy_N"
            lines.append(line)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    def pulled_recording(self, scenario, share=SHARE, degrees=DEGREES, flags=files.TANGENTIAL_VALID):
        def change(row):
            if row["flags"] & FIT_VALID:
                qx_N, qy_N = (share * row["force_N"] * f(math.radians(degrees)) for f in (math.cos, math.sin))
                row.update(flags=row["flags"] | flags, qx_N=qx_N, qy_N=qy_N, q_sd_N=0.1, tangential_ratio=share)
            return row

        return self.recording(scenario, change=change)

    def evaluated(self, *arguments, **options):
        scenario = self.pulled_scenario()
        return self.summary(self.pulled_recording(scenario, *arguments, **options), scenario, "--run", self.run_report())

    def test_the_error_is_that_of_the_vector(self):
        exact = self.evaluated()
        self.assertGreater(exact["tangential_frames"], 500)
        self.assertAlmostEqual(exact["tangential_ratio_error_p95"], 0, delta=1e-3)
        self.assertAlmostEqual(exact["tangential_direction_p90_deg"], 0, delta=0.1)
        self.assertEqual(exact["tangential_from_touch"], 0)
        stronger = self.evaluated(share=0.34)
        self.assertAlmostEqual(stronger["tangential_ratio_error_p50"], 0.04, delta=1e-3)
        turned = self.evaluated(degrees=self.DEGREES - 10)
        self.assertAlmostEqual(turned["tangential_ratio_error_p50"], 2 * self.SHARE * math.sin(math.radians(5)), delta=1e-3)
        self.assertAlmostEqual(turned["tangential_direction_p90_deg"], 10, delta=0.1)
        backwards = self.evaluated(degrees=self.DEGREES + 179)
        self.assertAlmostEqual(backwards["tangential_direction_p90_deg"], 179, delta=0.2)
        touched = self.evaluated(flags=files.TANGENTIAL_VALID | files.TANGENTIAL_FROM_TOUCH)
        self.assertEqual(touched["tangential_from_touch"], touched["tangential_frames"])

    def test_nothing_is_said_without_a_truth_or_a_load(self):
        keys = [f"tangential_{key}" for key in ("frames", "ratio_error_p50", "ratio_error_p95", "direction_p90_deg", "from_touch")]
        for found in (
            self.evaluated(flags=0),
            self.summary(self.pulled_recording(self.scenario()), self.scenario(), "--run", self.run_report()),
        ):
            self.assertEqual([found[key] for key in keys], [None] * 5)

    def panels(self, recording, *arguments):
        """The drawn panels by their labels, and what their legends say."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(plot.main([str(recording), "-o", str(self.folder / "p.png"), *map(str, arguments)]), 0)
        figure = plot.plt.gcf()
        self.addCleanup(plot.plt.close, figure)
        return {panel.get_ylabel(): panel for panel in figure.axes}

    def test_three_axes_are_drawn(self):
        scenario = self.pulled_scenario()
        moving = files.TANGENTIAL_VALID | files.MOVING | files.SLIDING
        panels = self.panels(self.pulled_recording(scenario, flags=moving), "--truth", scenario, "--run", self.run_report())
        legend = lambda label: panels[label].get_legend_handles_labels()[1]
        self.assertEqual(legend("Q, N"), ["truth", "along x", "along y"])
        self.assertEqual(legend("Q/F"), ["moving", "sliding"])
        drawn = {line.get_label(): np.nanmax(line.get_ydata()) for line in panels["Q, N"].lines}
        force_N = files.read_scenario(scenario).truth["force_N"].max()
        self.assertAlmostEqual(drawn["along x"], self.SHARE * force_N * math.cos(math.radians(self.DEGREES)), delta=0.02)
        self.assertAlmostEqual(drawn["along y"], self.SHARE * force_N * math.sin(math.radians(self.DEGREES)), delta=0.02)

    def test_what_is_doubtful_or_since_the_touch_is_marked(self):
        scenario = self.scenario()
        panels = self.panels(self.pulled_recording(scenario, flags=files.TANGENTIAL_VALID | files.TANGENTIAL_FROM_TOUCH | 1 << 16))
        self.assertIn("doubtful", panels["Q since touch, N"].get_legend_handles_labels()[1])
        for line in panels["Q since touch, N"].lines:
            self.assertTrue(np.isnan(line.get_ydata()).all(), "no curve of what is doubtful")

    def test_legends_cover_no_curve_and_no_time_looks_doubtful(self):
        scenario = self.pulled_scenario()
        panels = self.panels(self.pulled_recording(scenario), "--truth", scenario, "--run", self.run_report())
        legends = {label: panel.get_legend() for label, panel in panels.items() if panel.get_legend()}
        self.assertLessEqual({"force, N", "Q, N"}, set(legends))
        for label, legend in legends.items():
            self.assertFalse(any(panel.get_window_extent().overlaps(legend.get_window_extent()) for panel in panels.values()), label)
        times = next(points.get_cmap() for points in panels["y, mm"].figure.axes[0].collections if points.get_array() is not None)
        to_rgb = plot.matplotlib.colors.to_rgb
        for colour in (plot.DOUBTFUL, plot.SLIPPING, plot.TRUTH):
            self.assertGreater(np.linalg.norm(times(np.linspace(0, 1, 256))[:, :3] - to_rgb(colour), axis=1).min(), 0.4, colour)

    def test_another_fingertip_beside_it(self):
        scenario = self.scenario()
        other = self.folder / "other.csv"
        shutil.copy(self.recording(scenario, change=lambda row: {**row, "force_N": 0.8 * row["force_N"]}), other)
        one = self.recording(scenario)
        self.assertRegex(self.tool("plot", status=2).stderr, r"\Afingertip-plot: .* -o/--output; see fingertip-plot --help\n\Z")
        self.assertIn("--beside compares with a truth", self.error("plot", one, "--beside", "AAAA", "-o", self.folder / "p.png"))
        load = lambda options, **how: files.read_recording(other if options.device == "BBBB" else one)
        beside = ("--beside", "BBBB", "--beside-name", "never calibrated", "--beside-run", self.run_report())
        with mock.patch.object(plot, "load_recording", load):
            panels = self.panels(one, "--truth", scenario, "--run", self.run_report(), *beside)
        drawn = {line.get_label(): np.nanmax(line.get_ydata()) for line in panels["force, N"].lines if len(line.get_ydata())}
        self.assertAlmostEqual(drawn["never calibrated"], 0.8 * drawn["measured"], delta=0.01 * drawn["measured"])
        texts = " ".join(text.get_text() for text in panels["force, N"].figure.texts)
        self.assertRegex(texts, r"never calibrated, dashed .* force: median 20\.\d\d %")

    def test_without_loads_there_is_no_panel_of_them(self):
        panels = self.panels(self.recording(self.scenario()))
        self.assertIn("force, N", panels)
        self.assertFalse([label for label in panels if label.startswith("Q")])


class Plots(ToolTest):
    def test_progress_is_a_line_every_ten_seconds(self):
        clock = iter(range(0, 100, 4))
        now_s = mock.patch.object(command.host_time, "now_s", lambda: next(clock))
        with now_s, contextlib.redirect_stderr(io.StringIO()) as told, command.progress("reading") as show:
            for tenth in range(10):
                show(max(tenth - 2, 0) / 10)
        self.assertEqual(told.getvalue(), "reading 0 %\nreading 30 %, 56 s left\nreading 60 %, 24 s left\n")

    def test_a_hundred_megabytes(self):
        """A quarter of an hour at 243 frames a second, with a restart in the middle and no end line."""
        recording = self.recording(self.scenario(), until_s=3, end=False)
        lines = recording.read_text(encoding="utf-8").splitlines()
        head = [line for line in lines if not line[0].isdigit()]
        cells = ",".join([*lines[-1].split(",")[2:-30], *30 * ["101325.0000"]])
        rows = 100_000_000 // (len(cells) + 18)
        with open(recording, "w", encoding="utf-8") as file:
            file.write("\n".join(head) + "\n")
            for frame in range(rows):
                since = frame % (rows // 2)
                file.write(f"{1000 + 4115 * since},{since},{cells}\n")
        self.assertGreater(recording.stat().st_size, 99e6)
        picture = self.folder / "p.png"
        process = subprocess.Popen([sys.executable, TOOLS, "plot", recording, "-o", picture], stderr=subprocess.PIPE, text=True)
        with process:
            told = process.stderr.read()
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        self.assertEqual(process.returncode, 0, told)
        self.assertIn("no end line", told)
        self.assertLess(used.ru_maxrss, 200_000)  # KiB
        self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(picture.stat().st_size, 20000)

    def test_a_thinned_curve_breaks_where_all_rows_do(self):
        def change(row):
            at = row["frame"] % 100
            return row | (
                {"flags": TARED, "x_mm": "", "y_mm": "", "force_N": ""}
                if at == 40
                else {"flags": row["flags"] | int(Flag.LOW_SIGNAL)}
                if at == 60
                else {}
            )

        recording = files.read_recording(self.recording(self.scenario(), change=change))
        self.assertEqual(files.read_recording(recording.path, columns=("t_us", "frame"))["x1_mm"].strides, (0,), "takes no memory")
        rows = np.flatnonzero(recording.has_contact)
        with mock.patch.object(plot, "POINTS", 20):
            some = plot.thinned(recording, rows)
        self.assertLess(len(some), len(rows) / 4)
        for flag in (files.FIT_VALID, files.WARNINGS):
            self.assertEqual(np.diff(recording.flag(flag)[some]).sum(), np.diff(recording.flag(flag)[rows]).sum())

    def test_runs_of_a_restarted_fingertip_follow_one_another(self):
        change = lambda row: {**row, "t_us": row["t_us"] - 3000000 * (row["frame"] >= 600), "frame": row["frame"] % 600}
        recording = files.read_recording(self.recording(self.scenario(), change=change))
        t_s, restarts_s = plot.continuous_time_s(recording, recording.has_contact)
        self.assertTrue((np.diff(t_s) > 0).all())
        self.assertAlmostEqual(np.diff(t_s)[599], 0.005, delta=1e-9)
        self.assertEqual(list(restarts_s), list(t_s[600::600]))

    def test_where_nothing_can_be_written(self):
        recording = self.recording(self.scenario())
        (self.folder / "d.png").mkdir()
        for name, expected in (
            ("no/p.png", "there is no folder"),
            ("p.xyz", "ends in .png"),
            ("p", "ends in .png"),
            ("d.png", "is a folder"),
            ("/proc/p.png", "choose another place"),
        ):
            self.assertIn(expected, self.error("plot", recording, "-o", self.folder / name))
        full = self.folder / "full.png"
        full.symlink_to("/dev/full")
        self.assertIn("exists; give --overwrite", self.error("plot", recording, "-o", full))
        self.assertIn("exists; give --overwrite", self.error("evaluate", recording, recording, "-o", full))
        self.assertIn("No space left on device; choose another place", self.error("plot", recording, "-o", full, "--overwrite"))
        self.assertEqual({path.name for path in self.folder.iterdir()}, {"demo.csv", "recording.csv", "d.png", "full.png"})


if __name__ == "__main__":
    unittest.main()
