"""The batch entry points of host_tools/report/measure: the same bits as a direct call, and what they refuse.

usage: test_measure.py BUILD
"""

import ctypes
import pathlib
import sys
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/measure", "python")]
from fingertip import InputError  # noqa: E402
from fingertip.arrays import table_of  # noqa: E402
from measure import Measure, MeasureError, q10, stream_of, usable_of  # noqa: E402

MEASURE = Measure(sys.argv.pop())
X_mm, Y_mm, PITCH_mm = MEASURE.layout()
ARRAY = MEASURE.array()
ALL = np.uint64((1 << 15) - 1)


def presses(count, seed=1, noise_Pa=5.0):
    """(x_mm, y_mm [press], readings [press, sensor] Pa) of Gaussians on the array."""
    random = MEASURE.random(seed, stream_of("test"), np.arange(count))
    x_mm, y_mm, sigma_mm, p0_Pa = random.uniform(-9, 9), random.uniform(-18, 18), random.log_uniform(4, 10), random.log_uniform(3e3, 5e4)
    square = (X_mm - x_mm[:, None]) ** 2 + (Y_mm - y_mm[:, None]) ** 2
    return x_mm, y_mm, p0_Pa[:, None] * np.exp(-square / (2 * sigma_mm[:, None] ** 2)) + noise_Pa * random.normal(15)


class Fit(unittest.TestCase):
    def test_a_batch_has_the_bits_of_direct_calls(self):
        _, _, readings_Pa = presses(200)
        readings = q10(readings_Pa)
        settings = MEASURE.settings(200, noise_Pa=np.linspace(2, 20, 200))
        for usable in (None, np.full(200, ALL & ~np.uint64(1 << 7), np.uint64)):
            batch = MEASURE.fit(ARRAY, settings, readings, usable)
            direct = MEASURE.made("fit_result", 200)
            for i in range(200):
                pointers = [ctypes.c_void_p(one.ctypes.data) for one in (ARRAY, readings[i], settings[i : i + 1], direct[i : i + 1])]
                MEASURE.library.fit_gaussian(*pointers[:2], ctypes.c_uint64(int(ALL if usable is None else usable[i])), *pointers[2:])
            self.assertEqual(batch.tobytes(), direct.tobytes())

    def test_presses_are_found_where_they_are(self):
        x_mm, y_mm, readings_Pa = presses(300)
        for kernel in ("fit", "fit_grid", "grid", "masked", "general"):
            found = MEASURE.fit(ARRAY, MEASURE.settings(noise_Pa=5.0, iterations=7), q10(readings_Pa), kernel=kernel)
            self.assertLess(np.quantile(np.hypot(found["x_mm"] - x_mm, found["y_mm"] - y_mm), 0.9), 0.05, kernel)

    def test_another_rectangle_has_the_same_fit(self):
        x_mm, y_mm = np.tile([-4.5, 4.5], 4), np.repeat([-13.5, -4.5, 4.5, 13.5], 2)
        readings = q10(2e4 * np.exp(-((x_mm - 1) ** 2 + (y_mm - 2) ** 2) / 72)[None])
        found = MEASURE.fit(MEASURE.array(x_mm, y_mm, 9.0), MEASURE.settings(noise_Pa=5.0), readings, kernel="fit_grid")
        self.assertLess(np.hypot(found["x_mm"] - 1, found["y_mm"] - 2)[0], 0.01)

    def test_what_is_wrong_is_refused_before_it_runs(self):
        readings, settings = q10(presses(4)[2]), MEASURE.settings()
        for values, words in (
            (dict(pressure_Pa_q10=readings.astype(float)), "argument 6: an array of another type of item"),
            (dict(pressure_Pa_q10=readings[0]), "another number of dimensions"),
            (dict(pressure_Pa_q10=readings[:, :14].copy()), "another number of sensors"),
            (dict(pressure_Pa_q10=readings[:, ::-1]), "neither a number, a text nor an array in C order"),
            (dict(usable=np.zeros(3, np.uint64)), "arrays of different lengths"),
            (dict(settings=MEASURE.settings(3)), "neither one row nor one for each"),
            (dict(kernel="none"), "no kernel has this name"),
        ):
            with self.assertRaisesRegex(MeasureError, words):
                MEASURE.fit(
                    **({"array": ARRAY, "settings": settings, "pressure_Pa_q10": readings, "usable": np.full(4, ALL, np.uint64)} | values)
                )
        fixed = MEASURE.made("fit_result", 4)
        fixed.flags.writeable = False
        with self.assertRaisesRegex(MeasureError, "argument 8: an array that is written"):
            MEASURE.call("fit", "fit", 2, ARRAY, settings, None, readings, np.full(4, ALL, np.uint64), fixed, np.zeros(1))
        with self.assertRaisesRegex(MeasureError, "fit: another number of arguments"):
            MEASURE.call("fit", "fit")
        for of_other_version in (MEASURE.call, MEASURE.made):
            with self.assertRaisesRegex(MeasureError, "knows no none: it is of another version than this package"):
                of_other_version("none")
        finder, found, solved = np.zeros(1, np.int64), MEASURE.made("found_placement", 1), MEASURE.made("solved_placements", 1)
        kept, done = (MEASURE.made("calibration", 1), MEASURE.made("calibrated_sensor", 42)), np.zeros(3, np.int64)
        MEASURE.call("finder_new", 15, finder)
        for name, *values in (
            ("finder_new", 42, finder),
            ("finder_take", int(finder[0]), np.zeros(1), done[:1], np.zeros((2, 14)), done, found, np.zeros((2, 15))),
            ("solve_placements", np.arange(42.0), np.zeros(42), 9.0, 3.0, found, np.ones((1, 2, 42)), solved, np.zeros((2, 42)), *kept),
        ):
            with self.assertRaisesRegex(MeasureError, "number of sensors"):
                MEASURE.call(name, *values)
        with self.assertRaisesRegex(InputError, "not as many in each row"):
            table_of([[1.0, 2.0], [3.0]])
        with self.assertRaisesRegex(MeasureError, "build it"):
            Measure(MEASURE.build / "none")


class Held(unittest.TestCase):
    def test_a_press_that_is_held_is_the_fit_and_what_the_search_adds(self):
        touches = MEASURE.made("twin_touch", 8)
        touches["force_N"], touches["pull_x_N"] = 6.0, np.linspace(1.0, 2.0, 8)
        settings, readings = MEASURE.settings(noise_Pa=5.0, gain_sd=0.01), q10(MEASURE.base_pressure("sphere15", 12.0, touches))
        alone, held = MEASURE.fit(ARRAY, settings, readings), MEASURE.fit_held(ARRAY, settings, readings)
        np.testing.assert_array_equal(MEASURE.fit_held(ARRAY, settings, readings[:, None].copy()), alone)
        np.testing.assert_array_equal(held["x_mm"], alone["x_mm"])
        self.assertTrue((held["location_sd_mm"] > alone["location_sd_mm"]).all())
        self.assertGreater(held["location_sd_mm"][-1], 1.5 * held["location_sd_mm"][0])  # by the tangential force that it has found

    def test_gains_that_are_apart_are_learnt(self):
        gains, sd = MEASURE.made("fit_gains", 1), np.array([0.1])
        MEASURE.call("gains_begin", sd, gains)
        for _, _, readings_Pa in (presses(1, seed) for seed in range(40)):
            readings = q10(readings_Pa * (1.0 + 0.3 * (-1.0) ** np.arange(15)))
            for is_first in (1, 0):
                fits = MEASURE.fit(ARRAY, MEASURE.settings(noise_Pa=5.0), readings, kernel="fit_grid")
                MEASURE.call("gains_learn", ARRAY, MEASURE.settings(noise_Pa=5.0), readings, fits, is_first, gains, sd)
        self.assertGreater(sd[0], 0.2)


class Frames(unittest.TestCase):
    def test_a_series_has_the_zeros_and_contacts_of_the_chain(self):
        frames = MEASURE.made("frame", 1, 400)
        frames["t_us"], frames["sensor_count"], frames["noise_Pa_q10"], frames["valid"] = 10000 * np.arange(1, 401), 15, 5 * 1024, ALL
        pressed_Pa = np.where(np.arange(400) % 100 > 60, 1.0, 0.0)[:, None] * presses(1)[2]
        frames["pressure_Pa_q10"][0, :, :15] = q10(101325.0 + pressed_Pa)
        chained, *_ = MEASURE.chain(ARRAY, MEASURE.settings(), frames)
        flags, usable, above = np.zeros(400, np.uint8), np.zeros(400, np.uint64), np.zeros((400, 15), np.int32)
        readings = np.ascontiguousarray(frames["pressure_Pa_q10"][0, :, :15])
        MEASURE.call("gate_series", 5.0, frames["t_us"][0].copy(), readings, flags, usable, above, np.zeros(0, np.int32))
        np.testing.assert_array_equal(flags & 1, chained["contact"][0])
        np.testing.assert_array_equal(flags >> 1, chained["zero_doubtful"][0])
        np.testing.assert_array_equal(usable, chained["usable"][0])
        np.testing.assert_array_equal(above, chained["pressure_Pa_q10"][0, :, :15])

    def test_a_press_is_a_contact_with_the_fit_of_its_readings(self):
        _, _, readings_Pa = presses(20)
        frames = MEASURE.made("frame", 20, 20)
        frames["t_us"], frames["sensor_count"], frames["noise_Pa_q10"], frames["valid"] = 10000 * np.arange(1, 21), 15, 5 * 1024, ALL
        frames["pressure_Pa_q10"][..., :15] = q10(101325.0 + np.zeros(15))
        frames["pressure_Pa_q10"][:, 16:, :15] += q10(readings_Pa)[:, None]
        conditioned, fits, results = MEASURE.chain(ARRAY, MEASURE.settings(), frames)
        self.assertFalse(conditioned["contact"][:, :16].any())
        self.assertTrue(conditioned["contact"][:, 16:].all())
        again = MEASURE.fit(
            ARRAY,
            MEASURE.settings(noise_Pa=5.0),
            np.ascontiguousarray(conditioned["pressure_Pa_q10"][:, 16, :15]),
            conditioned["usable"][:, 16].copy(),
        )
        np.testing.assert_array_equal(again, fits[:, 16])
        self.assertTrue(((results["flags"][:, 16] & fits["flags"][:, 16]) == fits["flags"][:, 16]).all())

    def test_a_tangential_force_of_the_twin_is_estimated(self):
        touches = MEASURE.made("twin_touch", 8)
        touches["force_N"], touches["pull_x_N"] = 6.0, np.linspace(0, 1.4, 8)
        base_Pa = MEASURE.base_pressure("sphere15", 12.0, touches)
        readings = np.ascontiguousarray(np.repeat(q10(base_Pa)[:, None], 6, axis=1))
        _, loads = MEASURE.tangential(ARRAY, MEASURE.profile(12.0), MEASURE.settings(noise_Pa=2.0, clip_below_sds=0), readings)
        self.assertTrue(loads["valid"][:, -1].all())
        self.assertLess(abs(loads["qx_N"][:, -1] - touches["pull_x_N"]).max(), 0.2)


class Calibration(unittest.TestCase):
    def test_gains_are_found_from_placements(self):
        gain = 1.0 + 0.15 * MEASURE.random(3, 1, np.arange(15)).normal()
        random = MEASURE.random(5, 2, np.arange(24))
        touches = MEASURE.made("twin_touch", 24)
        touches["force_N"], touches["x_mm"], touches["y_mm"] = 3.0, random.uniform(-8, 8), random.uniform(-16, 16)
        readings_Pa = gain * MEASURE.base_pressure("sphere15", 12.0, touches) + 0.5 * random.normal(15)
        readings_Pa[0, 3] = np.nan
        self.assertEqual(usable_of(readings_Pa)[0], ALL & ~np.uint64(8))
        found, sensors, deviations = MEASURE.calibrate(X_mm, Y_mm, PITCH_mm, 8.0 * np.arange(24.0)[None], readings_Pa[None], 0.5)
        self.assertEqual((int(found["state"][0]), found["reason"][0]), (1, b"none"))
        self.assertLess(abs(sensors["gain"][0] - gain / gain.mean()).max(), 0.06)
        self.assertEqual(deviations.shape, (1, 15))


class RandomNumbers(unittest.TestCase):
    def test_each_state_is_its_own(self):
        whole, part = (MEASURE.random(7, 2**63 + 5, np.arange(first, 10)) for first in (0, 4))
        np.testing.assert_array_equal(whole.uniform(-1, 1)[4:], part.uniform(-1, 1))
        drawn = whole.normal(3, of=np.arange(10) < 5)
        self.assertTrue((drawn[:5] != 0).all() and (drawn[5:] == 0).all())
        np.testing.assert_array_equal(whole.below(1000)[5:], part.below(1000)[1:])


if __name__ == "__main__":
    unittest.main(verbosity=2)
