"""The reference of the fit: its optimum, the presses it is solved for, the kernels that reach it, and reference.py.

usage: test_reference.py BUILD
"""

import csv
import io
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/pads", "report/fit", "report/shared", "report/measure", "python")]
import errors  # noqa: E402
import pads  # noqa: E402
import presses  # noqa: E402
from fingertip.line import CONTACT_COLUMNS, RAW_COLUMNS  # noqa: E402
from measure import Measure  # noqa: E402

BUILD = sys.argv.pop()
MEASURE = Measure(BUILD)
COMPARED = presses.Compared(MEASURE)
SEED = 11
X_mm, Y_mm, _ = MEASURE.layout()
PRESS = {"x_mm": 2.5, "y_mm": -4.0, "p0_Pa": 20000.0, "sigma_mm": 6.0}
AIR_Pa = 101325.0


def run(*options):
    words = [sys.executable, ROOT / "host_tools/report/fit/reference.py", "--build", BUILD, *options]
    return subprocess.run(words, capture_output=True, text=True)


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


def pressure_Pa(k):
    distance2 = (X_mm[k] - PRESS["x_mm"]) ** 2 + (Y_mm[k] - PRESS["y_mm"]) ** 2
    return PRESS["p0_Pa"] * math.exp(-distance2 / (2 * PRESS["sigma_mm"] ** 2))


def recorded(readings, tare=AIR_Pa, before="", valid=0x7FFF):
    """A recording of one frame; readings: [sensor]."""
    columns = {"t_us": 7, "frame": 0} | dict.fromkeys(CONTACT_COLUMNS, "") | dict.fromkeys(RAW_COLUMNS, 0)
    columns |= {"valid": valid} | {f"s{k}_Pa": f"{value:.6f}" for k, value in enumerate(readings)}
    columns |= {f"tare{k}_Pa": tare for k in range(len(readings))}
    return f"# fingertip-recording 1\n{before}{','.join(columns)}\n{','.join(map(str, columns.values()))}\n"


def cost_at(these, best, dx_mm=0.0, dy_mm=0.0):
    """[press], of the usable sensors"""
    square = (X_mm - best["x_mm"][:, None] - dx_mm) ** 2 + (Y_mm - best["y_mm"][:, None] - dy_mm) ** 2
    left_Pa = best["p0_Pa"][:, None] * np.exp(-0.5 * square / best["sigma_mm"][:, None] ** 2) - these.readings / 1024
    return 0.5 * (np.square(left_Pa) * (these.usable[:, None] >> np.arange(15, dtype=np.uint64) & np.uint64(1))).sum(axis=1)


class Rectangles(unittest.TestCase):
    def test_every_rectangle_reaches_the_optimum_with_seven_iterations(self):
        for columns, rows in pads.OBSERVABLE:
            um = pads.p99_9_um(MEASURE, columns, rows, 1000, np.random.default_rng(SEED))
            self.assertLess(um, 1.0, (columns, rows))


class Optimum(unittest.TestCase):
    def setUp(self):
        self.cache = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def load(self, set_, mask, count):
        return presses.load(MEASURE, COMPARED, set_, mask, SEED, count, self.cache)

    def test_rationed_starts_miss_no_minimum(self):
        observable = 0
        for set_ in presses.SETS:
            for mask in ("none", "peak"):
                these = self.load(set_, mask, 60)
                full = COMPARED.optimum(these.readings, these.usable, these.noise_Pa, all_starts=True)[these.observable]
                best = these.best[these.observable]
                self.assertTrue((best["cost"] <= full["cost"] * (1 + 1e-9)).all())
                self.assertLess(np.hypot(best["x_mm"] - full["x_mm"], best["y_mm"] - full["y_mm"]).max(), 1e-6)
                observable += len(best)
        self.assertGreater(observable, 250)

    def test_no_neighbour_is_better(self):
        these = self.load("D", "none", 100)
        cost = cost_at(these, these.best)
        np.testing.assert_allclose(cost[these.observable], these.best["cost"][these.observable], rtol=1e-9)
        for dx_mm, dy_mm in ((1e-3, 0), (-1e-3, 0), (0, 1e-3), (0, -1e-3)):
            self.assertTrue((cost_at(these, these.best, dx_mm, dy_mm) > cost)[these.observable].all())

    def test_the_cache_repeats_grows_and_survives_damage(self):
        fresh = self.load("B", "random", 200).best
        file = self.cache / f"reference_{SEED}_B_random.npz"
        written = file.stat().st_mtime_ns
        np.testing.assert_array_equal(self.load("B", "random", 200).best, fresh)
        np.testing.assert_array_equal(self.load("B", "random", 50).best, fresh[:50])
        self.assertEqual(file.stat().st_mtime_ns, written)
        np.testing.assert_array_equal(self.load("B", "random", 260).best[:200], fresh)
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 0x5A
        for damaged in (bytes(content), bytes(content[: len(content) // 2]), b""):
            file.write_bytes(damaged)
            np.testing.assert_array_equal(self.load("B", "random", 200).best, fresh)

    def test_every_kernel_reaches_the_optimum_of_an_easy_press(self):
        bench = errors.Bench(MEASURE, SEED, 600, self.cache)
        for mask in ("none", "random"):
            these = bench.presses("C", mask)
            for kernel in (*errors.KERNELS, *(errors.LIBRARIES if mask == "none" else ())):
                if mask == "none" or errors.SUBSET in errors.KERNELS[kernel]:
                    threads = 1 if kernel in errors.LIBRARIES else 2
                    found, _ = bench.fit(kernel, errors.Variant("", 20), these.readings, these.usable, these.noise_Pa, threads)
                    found, best = found[these.observable], these.best[these.observable]
                    self.assertTrue((found["flags"] & errors.VALID).all(), kernel)
                    loose = 20 if kernel in errors.LIBRARIES else 2  # their own tolerances end them
                    self.assertLess(errors.distance_um(found, best).max(), loose, kernel)
                    for name in ("p0_Pa", "sigma_mm"):
                        np.testing.assert_allclose(found[name], best[name], rtol=3e-4 * loose, err_msg=kernel)

    def test_the_firmware_reaches_the_optimum_of_gaussians(self):
        """float32 leaves about 0.15 um at p99.9; the limits leave a factor of three."""
        bench = errors.Bench(MEASURE, SEED, 15000, self.cache)
        of_sets = [one for one, _ in zip(errors.outcomes(bench, "fit", errors.Variant("")), "AB")]
        um, flags = (np.concatenate([one[i][one[0]] for one in of_sets]) for i in (1, 4))
        self.assertGreater(len(um), 8000)
        self.assertLess(np.quantile(um, 0.5), 0.05)
        self.assertLess(np.quantile(um, 0.999), 0.5)
        self.assertLessEqual((um > 100).sum(), 2)
        self.assertTrue((flags[um > 100] & errors.WARNINGS).all())

    def test_double_reaches_every_observable_optimum(self):
        bench = errors.Bench(MEASURE, SEED, 1200, self.cache)
        for set_ in presses.SETS:
            these = bench.presses(set_)
            found, _ = bench.fit("double", errors.Variant("", 10), these.readings, these.usable, these.noise_Pa)
            self.assertLess(errors.distance_um(found, these.best)[these.observable].max(), 0.1)
            np.testing.assert_allclose(found["sigma_mm"][these.observable], these.best["sigma_mm"][these.observable], rtol=1e-5)

    def test_nothing_positive_is_no_fit(self):
        bench = errors.Bench(MEASURE, SEED, 600, self.cache)
        readings, usable = np.full((1, 15), -1024, np.int32), np.full(1, presses.ALL)
        for kernel in errors.KERNELS:
            found, _ = bench.fit(kernel, errors.Variant(""), readings, usable, np.array([5.0]))
            self.assertFalse(found["flags"][0] & errors.VALID, kernel)
        self.assertEqual(COMPARED.optimum(readings, usable, [5.0])["location_sd_mm"][0], np.inf)


class Presses(unittest.TestCase):
    def test_presses_on_a_layer_are_where_their_readings_are(self):
        for set_, off_mm in (("C", 0.5), ("D", 1.5)):
            made = presses.draw(MEASURE, set_, SEED, 400)
            x_mm, y_mm = (made.pressure_Pa @ at / made.pressure_Pa.sum(axis=1) for at in (X_mm, Y_mm))
            middle = (np.abs(made.x_mm) < 4) & (np.abs(made.y_mm) < 9)
            self.assertLess(np.median(np.hypot(x_mm - made.x_mm, y_mm - made.y_mm)[middle]), off_mm)
            # Sensors of 9 mm by 9 mm each carry the force but for what is beyond the array.
            self.assertAlmostEqual(np.median((81e-6 * made.pressure_Pa.sum(axis=1) / made.force_N)[middle]), 0.91, delta=0.05)

    def test_presses_repeat_and_pass_the_gate(self):
        for set_ in presses.SETS:
            made, again, other = (presses.draw(MEASURE, set_, seed, 300) for seed in (7, 7, 8))
            np.testing.assert_array_equal(made.pressure_Pa, again.pressure_Pa)
            np.testing.assert_array_equal(made.pressure_Pa[:40], presses.draw(MEASURE, set_, 7, 40).pressure_Pa)
            self.assertFalse((made.pressure_Pa == other.pressure_Pa).any())
            self.assertTrue(((2 <= made.noise_Pa) & (made.noise_Pa <= 20)).all())
            self.assertTrue((made.pressure_Pa.max(axis=1) >= 20 * made.noise_Pa).all())
            inside = (np.abs(made.x_mm) <= 9) & (np.abs(made.y_mm) <= 18)
            self.assertTrue((inside == (set_ != "B")).all())
            self.assertTrue(((np.abs(made.x_mm) <= 15) & (np.abs(made.y_mm) <= 24)).all())


class Program(unittest.TestCase):
    def run_on(self, text, *options):
        path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "recording.csv"
        path.write_text(text)
        return run(path, *options)

    def found(self, text, *options):
        done = self.run_on(text, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return rows_of(done.stdout)[0]

    def assert_is_press(self, row):
        self.assertEqual((row["t_us"], row["observable"], row["at_bound"]), ("7", "1", "0"))
        for name, value in PRESS.items():
            self.assertAlmostEqual(float(row[name]), value, delta=1e-4 * abs(value), msg=name)
        self.assertAlmostEqual(float(row["force_N"]), 2e-6 * math.pi * 20000 * 36, delta=1e-3)

    def test_a_gaussian_above_the_zero_is_found(self):
        absolute = [AIR_Pa + pressure_Pa(k) for k in range(15)]
        self.assert_is_press(self.found(recorded(absolute)))
        gains = [0.9 + 0.02 * k for k in range(15)]
        absolute = [AIR_Pa + gain * pressure_Pa(k) for k, gain in enumerate(gains)]
        self.assert_is_press(self.found(recorded(absolute, before=f"# gains: {' '.join(map(str, gains))}\n")))

    def test_a_sensor_without_a_measurement_is_left_out(self):
        absolute = [AIR_Pa + pressure_Pa(k) * (k != 6) for k in range(15)]
        self.assert_is_press(self.found(recorded(absolute, valid=0x7FBF)))
        row = self.found(recorded(absolute, valid=0x7000))
        self.assertEqual((row["t_us"], row["x_mm"], row["observable"]), ("7", "", ""))

    def test_before_the_zero_there_is_nothing_to_fit(self):
        self.assertEqual(self.found(recorded([AIR_Pa] * 15, tare=0))["x_mm"], "")

    def test_noise_decides_what_is_observable(self):
        weak = recorded([AIR_Pa + 0.005 * pressure_Pa(k) for k in range(15)])
        self.assertEqual(self.found(weak, "--noise", "1")["observable"], "1")
        self.assertEqual(self.found(weak, "--noise", "20")["observable"], "0")

    def test_what_is_wrong_is_one_line(self):
        for options, text, words in (
            ((), recorded([AIR_Pa] * 14), "14 sensors"),
            (("--noise", "0"), recorded([AIR_Pa] * 15), "--noise 0 is out of range"),
        ):
            done = self.run_on(text, *options)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
