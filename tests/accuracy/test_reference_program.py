"""The program `reference`: what it prints of presses, recordings and scenarios, and what it refuses.

usage: test_reference_program.py REFERENCE
"""

import csv
import io
import math
import pathlib
import subprocess
import sys
import unittest

PROGRAM = None
X_mm = [x for x in (-9, 0, 9) for _ in range(5)]
Y_mm = [y for _ in range(3) for y in (-18, -9, 0, 9, 18)]
PRESS = {"x_mm": 2.5, "y_mm": -4.0, "p0_Pa": 20000.0, "sigma_mm": 6.0}
AIR_Pa = 101325.0


def run(*options, text=""):
    return subprocess.run([PROGRAM, *options], input=text, capture_output=True, text=True)


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


def pressure_Pa(k):
    distance2 = (X_mm[k] - PRESS["x_mm"]) ** 2 + (Y_mm[k] - PRESS["y_mm"]) ** 2
    return PRESS["p0_Pa"] * math.exp(-distance2 / (2 * PRESS["sigma_mm"] ** 2))


def table(readings, tare=None, before="", **cells):
    """A file of one row; readings: [sensor], None is an empty cell."""
    columns = {"t_us": 7, **cells, **{f"s{k}_Pa": "" if value is None else f"{value:.6f}" for k, value in enumerate(readings)}}
    if tare is not None:
        columns |= {f"tare{k}_Pa": tare for k in range(15)}
    return f"{before}{','.join(columns)}\n{','.join(str(cell) for cell in columns.values())}\n"


class Reference(unittest.TestCase):
    def fitted(self, text, *options):
        done = run("fit", *options, text=text)
        self.assertEqual(done.returncode, 0, done.stderr)
        return rows_of(done.stdout)[0]

    def assert_is_press(self, row, scale=1.0):
        self.assertEqual((row["observable"], row["at_bound"]), ("1", "0"))
        for name, value in PRESS.items():
            self.assertAlmostEqual(float(row[f"best_{name}"]), value * (scale if name == "p0_Pa" else 1), delta=1e-4 * abs(value), msg=name)
        self.assertAlmostEqual(float(row["best_force_N"]), scale * 2e-6 * math.pi * 20000 * 36, delta=1e-3)

    def test_a_gaussian_is_found(self):
        row = self.fitted(table([pressure_Pa(k) for k in range(15)], x_mm=2.5, y_mm=-1.0))
        self.assertEqual(row["t_us"], "7")
        self.assert_is_press(row)
        self.assertAlmostEqual(float(row["distance_mm"]), 3.0, delta=1e-4)

    def test_an_empty_cell_is_a_sensor_left_out(self):
        self.assert_is_press(self.fitted(table([None if k == 6 else pressure_Pa(k) for k in range(15)])))
        row = self.fitted(table([None] * 12 + [5000.0] * 3))
        self.assertEqual((row["t_us"], row["best_x_mm"], row["observable"]), ("7", "", ""))

    def test_of_a_recording_the_zero_is_subtracted_and_gains_are_divided_out(self):
        absolute = [AIR_Pa + pressure_Pa(k) for k in range(15)]
        self.assert_is_press(self.fitted(table(absolute, tare=AIR_Pa)))
        gains = [0.9 + 0.02 * k for k in range(15)]
        absolute = [AIR_Pa + gain * pressure_Pa(k) for k, gain in enumerate(gains)]
        text = table(absolute, tare=AIR_Pa, before=f"# fingertip-recording 1\n# gains: {' '.join(map(str, gains))}\n")
        self.assert_is_press(self.fitted(text))

    def test_before_the_zero_there_is_nothing_to_fit(self):
        self.assertEqual(self.fitted(table([AIR_Pa] * 15, tare=0))["best_x_mm"], "")

    def test_noise_decides_what_is_observable(self):
        weak = [0.005 * pressure_Pa(k) for k in range(15)]
        self.assertEqual(self.fitted(table(weak), "--noise", "1")["observable"], "1")
        row = self.fitted(table(weak, x_mm=1, y_mm=1), "--noise", "20")
        self.assertEqual((row["observable"], row["distance_mm"]), ("0", ""))
        self.assertEqual(self.fitted(table(weak, noise_Pa=20), "--noise", "1")["observable"], "0")

    def test_presses_are_the_same_again_and_are_found(self):
        for letter in "ABCD":
            printed = run("presses", "--set", letter, "--count", "40", "--seed", "3").stdout
            self.assertEqual(printed, run("presses", "--set", letter, "--count", "40", "--seed", "3").stdout)
            self.assertNotEqual(printed, run("presses", "--set", letter, "--count", "40", "--seed", "4").stdout)
            drawn, found = rows_of(printed), rows_of(run("fit", text=printed).stdout)
            self.assertEqual([row["press"] for row in found], [row["press"] for row in drawn])
            distances_mm = sorted(float(row["distance_mm"]) for row in found if row["observable"] == "1")
            self.assertGreater(len(distances_mm), 20)
            # Of a Gaussian noise alone is left; of rubber its tails, too.
            self.assertLess(distances_mm[len(distances_mm) // 2], 0.05 if letter in "AB" else 0.5, letter)

    def test_what_is_wrong_is_one_line(self):
        good = [pressure_Pa(k) for k in range(15)]
        for options, text, words in (
            (("fit", "none.csv"), "", "none.csv: cannot read it"),
            (("fit",), "", "no header"),
            (("fit",), table(good[:14]), "has no column s14_Pa"),
            (("fit",), table(good, device=0), "several fingertips"),
            (("fit",), table([AIR_Pa] * 15), "absolute pressures"),
            (("fit",), table(good).replace("\n7", "\n7,7"), "standard input:2: has 17 cells"),
            (("fit",), table(good, noise_Pa="loud"), "'loud' is not a number"),
            (("fit",), table(good, before="# gains: 1 1\n"), "2 gains for 15"),
            (("fit",), table(good, before=f"# gains:{' 0' * 15}\n"), "'0' is no gain"),
        ):
            done = run(*options, text=text)
            self.assertEqual(done.returncode, 1, words)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(words, done.stderr)
        for options in (
            ("fit", "--noise", "0"),
            ("presses", "--set", "E"),
            ("presses", "--count", "0"),
            ("presses", "--count", "-1"),
            ("presses", "--seed", "-1"),
            (),
        ):
            done = run(*options)
            self.assertEqual(done.returncode, 2, options)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)))
    unittest.main(verbosity=2)
