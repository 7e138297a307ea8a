"""Parts of the report truth on few pads: their figures are there, repeatable, and as good as they are meant to be.

usage: test_truth.py TruthFit|TruthGate|TruthOverTime BUILD
"""

import argparse
import math
import pathlib
import random
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
REPORT = [str(ROOT / "host_tools/report" / part) for part in ("truth", "measure", "shared", "shear")]
sys.path[:0] = [*REPORT, str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
import one_press  # noqa: E402
import over_time  # noqa: E402
import shear  # noqa: E402
import truth  # noqa: E402
import zero_and_gate  # noqa: E402
from figures import assert_within  # noqa: E402
from fingertip.files import InputError  # noqa: E402
from measure import Measure  # noqa: E402

BUILD = sys.argv.pop()
FIRMWARE = Measure(BUILD)
# (key, least, most): what a full run is held to, with room for few pads.
FIT_GOALS = (
    ("cover_1sd_min", 54, 100),
    ("cover_1sd_max", 0, 77),
    ("cover_2sd_min", 92, 100),
    ("cal_warned_percent", 0, 6),
    ("cal_bad_unflagged_percent", 0, 0.2),
    ("raw_warned_percent", 0, 36),
    ("raw_bad_unflagged_percent", 0, 2),
    ("raw_20_bad_unflagged_percent", 0, 4),
    ("loaded_silent_percent", 0, 1),
    ("raw_loaded_silent_percent", 0, 4),
    ("unloaded_warned_percent", 0, 6),
    ("elongated_bad_unflagged_percent", 0, 3),
    ("round_elongated_percent", 0, 1),
)


def run(pads, seed, parts=one_press.PARTS):
    return one_press.figures(FIRMWARE, argparse.Namespace(pads=pads, seed=seed), parts)


class TruthFit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = run(60, 3)

    def test_goals(self):
        assert_within(self, self.found, FIT_GOALS)

    def test_four_iterations_do_what_more_do(self):
        medians = {}
        for row in self.found["iterations"]:
            medians.setdefault((row["layer_mm"], row["gain_percent"]), {})[row["iterations"]] = row["error_p50_mm"]
        self.assertEqual(len(medians), 4)
        for median in medians.values():
            self.assertEqual(sorted(median), [3, 4, 5, 6, 7, 8])
            self.assertLess(median[4], 1.03 * median[8])

    def test_calibration_helps(self):
        rows = {row["case"]: row for row in self.found["cases"]}
        self.assertLess(rows["12 mm, calibrated"]["error_p50_mm"], 0.5 * rows["12 mm, gains 10 %"]["error_p50_mm"])
        self.assertLess(rows["noise only"]["error_p50_mm"], 0.01)

    def test_a_seed_decides_what_is_drawn(self):
        parts = (one_press.coverage, one_press.few_sensors)  # all kinds of draws
        once = run(4, 3, parts)
        self.assertEqual(run(4, 3, parts), once)
        self.assertNotEqual(run(4, 4, parts), once)

    def test_no_pads_are_refused(self):
        with self.assertRaises(InputError):
            run(0, 3)


GATE_GOALS = {"slow_force_error_percent": 2, "false_contacts": 0, "zero_recovery_s": 5, "phantom_force_longest_s": 1}
REAL = (
    "real_phantom_percent_worst",
    "real_phantom_longest_s",
    "real_held_missed",
    "real_held_doubted_percent_worst",
    "real_median_mm_worst_test",
    "real_median_mm_worst_other",
)
ROWS_PER_S = 17
DEEPEST = 2000  # steps; 1 mm is 1000 along the strip
PRESSES = 14  # one at each millimetre
PLACES_mm = (-6.5, -0.5, 5.5, 11.5)
AMBIENT_Pa = 101000


def write_recording(path, sigma_mm, stays_Pa=0, seed=1):
    """Presses of two seconds, 1 mm apart; what stays on the last sensor from the third release on. Some rows are damaged."""
    draw = random.Random(seed)
    rows, t_s = [], 0.0

    def row(x_mm, depth, touches, stays):
        nonlocal t_s
        sensed = [12000 * touches * math.exp(-0.5 * ((place - x_mm) / sigma_mm) ** 2) for place in PLACES_mm]
        sensed[-1] += stays
        cells = [f"{AMBIENT_Pa + pressure + draw.gauss(0, 5):.2f}" for pressure in sensed]
        rows.append(",".join([*cells, f"{1000 * x_mm:.0f}", f"{depth:.0f}", f"{t_s:.4f}"]))
        t_s += 1 / ROWS_PER_S

    for _ in range(20 * ROWS_PER_S):
        row(0, 0, 0, 0)
    for press in range(PRESSES):
        stays = stays_Pa if press > 2 else 0
        for step in (*range(0, DEEPEST, 100), *[DEEPEST] * (2 * ROWS_PER_S), *range(DEEPEST, 0, -100), *[0] * (3 * ROWS_PER_S)):
            row(press, step, max(0, step / DEEPEST - 0.6) / 0.4, stays)
    rows[5] = rows[5].rsplit(",", 2)[0]
    rows[7] = "x" + rows[7]
    path.write_text("Sensor_0,Sensor_1,Sensor_2,Sensor_3,x,z,time\n" + "\n".join(rows) + "\n")


def judged(pads, recordings):
    return zero_and_gate.figures(FIRMWARE, argparse.Namespace(pads=pads, seed=None, recordings=recordings))


class TruthGate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_recording(folder / "test_good.csv", 2.4)
        write_recording(folder / "other.csv", 2.1, seed=2)
        write_recording(folder / "stays.csv", 2.2, stays_Pa=3000, seed=3)
        cls.found = judged(1, folder)
        cls.strips = {}
        for strip in cls.found["strips"]:
            cls.strips.setdefault(strip["name"], []).append(strip)

    def test_goals_are_met(self):
        for name, goal in GATE_GOALS.items():
            self.assertLessEqual(self.found[name], goal, name)

    def test_a_force_that_is_left_is_contact_or_in_doubt(self):
        for row in self.found["left_forces"]:
            self.assertGreater(row["certain_percent"] + row["doubted_percent"], 99)
            self.assertEqual(row["certain_percent"] > 99, row["share"] > 0.15)

    def test_presses_and_free_time_of_a_recording_are_found(self):
        for name in ("test_good.csv", "other.csv"):
            self.assertEqual(len(self.strips[name]), 3)
            for strip in self.strips[name]:
                self.assertEqual(strip["holds"], PRESSES)
                # The beginning, less two rows, and three seconds after each press; the way down and up is free in part.
                free = (20 + 3 * PRESSES) * ROWS_PER_S
                self.assertGreater(strip["free_rows"], free - 10)
                self.assertLess(strip["free_rows"], free + 30 * PRESSES)
                self.assertEqual((strip["phantom_percent"], strip["held_missed"], strip["held_doubted_percent"]), (0, 0, 0))

    def test_what_does_not_go_away_counts_as_phantom(self):
        worst = max(strip["phantom_percent"] for strip in self.strips["stays.csv"])
        self.assertGreater(worst, 30)
        self.assertEqual(self.found["real_phantom_percent_worst"], worst)
        self.assertGreater(self.found["real_phantom_longest_s"], 20)

    def test_locations_are_found_where_sensors_respond(self):
        for located in self.found["locations"]:
            if located["name"] != "stays.csv":
                self.assertGreater(located["fits"], 11 * 2 * ROWS_PER_S)
                self.assertAlmostEqual(located["sigma_mm"], 2.4 if located["name"] == "test_good.csv" else 2.1, delta=0.02)
                self.assertLess(located["median_mm"], 0.06)
        self.assertLess(self.found["real_median_mm_worst_test"], 0.06)

    def test_recordings_that_are_not_there_have_no_figures(self):
        with tempfile.TemporaryDirectory() as folder:
            found = judged(0, folder)
        for name in REAL:
            self.assertIsNone(found[name], name)
        self.assertFalse(GATE_GOALS.keys() & found.keys())
        with self.assertRaises(InputError):
            judged(0, "/nowhere")


KINDS = [kind for kind in over_time.KINDS if kind.key]
# (of a row, most location_p50_mm, most silent_percent, least trusted_percent)
BOUNDS = {"plain": (0.05, 0, 90), "remembered": (0.15, 1, 80), "pulled": (0.3, 1, 70), "slides": (0.3, 2, 60)}
BOUNDS |= {"ends": (0.2, 1, 80), "ends_pulled": (0.35, 2, 60), "beyond": (3, 5, 0), "leaning": (0.2, 1, 80), "thin": (4, 2, 0)}


class TruthOverTime(unittest.TestCase):
    @mock.patch.object(over_time, "PRESSES_s", 120)
    def test_figures(self):
        found = over_time.figures(argparse.Namespace(build=BUILD, pads=1, seed=902), KINDS)
        asked = [name for name, *_ in truth.GOALS if name.startswith(truth.OVER_TIME)]
        self.assertLessEqual({*asked, *(there for _, there, *_ in shear.OVER_TIME)}, found.keys())
        self.assertEqual(found["remembered_refused"], 0)
        for row, (key, (location_mm, silent, trusted)) in zip(found["over_time"], BOUNDS.items(), strict=True):
            with self.subTest(key):
                self.assertLess(row["location_p50_mm"], location_mm)
                self.assertLessEqual(row["silent_percent"], silent)
                self.assertGreaterEqual(row["trusted_percent"], trusted)
                self.assertGreater(row["frames"], 60)
                self.assertEqual([name for name, value in row.items() if value is None and key != "thin"], [])
        for key, most in (("remembered", 0.03), ("pulled", 0.035), ("ends_pulled", 0.045)):
            self.assertLess(found[f"{key}_vector_error_p50"], most, key)
        none = over_time.row_of(KINDS[0], 1, [])
        self.assertEqual([name for name in found["over_time"][0] if none[name] is not None], list(over_time.COUNTS))


if __name__ == "__main__":
    unittest.main()
