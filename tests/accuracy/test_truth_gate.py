"""The part gate of the report truth on few pads and on made-up recordings: its keys are there, meet their goals, and distinguish a press from what follows it.

usage: test_truth_gate.py BUILD
"""

import argparse
import math
import pathlib
import random
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / folder) for folder in ("report/truth", "report/measure", "report/shared", "python")]
import zero_and_gate  # noqa: E402
from fingertip.files import InputError  # noqa: E402
from measure import Measure  # noqa: E402

GOALS = {"slow_force_error_percent": 2, "false_contacts": 0, "zero_recovery_s": 5, "phantom_force_longest_s": 1}
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
    return zero_and_gate.figures(Measure(BUILD), argparse.Namespace(pads=pads, seed=None, recordings=recordings))


class TruthGate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        folder = pathlib.Path(cls.temporary.name)
        write_recording(folder / "test_good.csv", 2.4)
        write_recording(folder / "other.csv", 2.1, seed=2)
        write_recording(folder / "stays.csv", 2.2, stays_Pa=3000, seed=3)
        cls.found = judged(1, folder)
        cls.strips = {}
        for strip in cls.found["strips"]:
            cls.strips.setdefault(strip["name"], []).append(strip)

    def test_goals_are_met(self):
        for name, goal in GOALS.items():
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
        self.assertFalse(GOALS.keys() & found.keys())
        with self.assertRaises(InputError):
            judged(0, "/nowhere")


if __name__ == "__main__":
    BUILD = sys.argv.pop()
    unittest.main()
