"""`fingertip fit` and fingertip.fit: what they find on arrays of every size, what a calibration changes, and what they refuse.

usage: test_fit.py FINGERTIP
"""

import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

FINGERTIP = os.environ["FINGERTIP_TOOL"] = os.path.abspath(sys.argv.pop())
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python")]
import fingertip  # noqa: E402
from fingertip.fit import SHAPES, read_pad  # noqa: E402
from fingertip.line import WARNINGS, Flag  # noqa: E402

PAD = read_pad("2x4")
RUBBER = {"thickness_mm": 12}
SIGMA_mm = 0.48 * 12  # under 12 mm


def responses(pad, x_mm, y_mm, sigma_mm):
    """[press, sensor], 1 above the contact."""
    return np.exp(-((np.c_[x_mm] - pad.x_mm) ** 2 + (np.c_[y_mm] - pad.y_mm) ** 2) / (2 * sigma_mm**2))


def presses(pad, count, sigma_mm, seed=1, noise_Pa=5.0):
    """(x_mm, y_mm, Pa [press, sensor]) of contacts among the sensors."""
    random = np.random.default_rng(seed)
    x_mm, y_mm = (random.uniform(places.min(), places.max(), count) for places in (pad.x_mm, pad.y_mm))
    return x_mm, y_mm, 12000.0 * responses(pad, x_mm, y_mm, sigma_mm) + noise_Pa * random.normal(size=(count, len(pad.x_mm)))


def off_mm(found, x_mm, y_mm):
    return np.median(np.hypot(found["x_mm"] - x_mm, found["y_mm"] - y_mm))


class Fit(unittest.TestCase):
    def test_every_rectangle_and_others_have_a_fit_and_rectangles_on_thick_rubber_more(self):
        for columns, rows in ((2, 2), (2, 4), (3, 3), (3, 5), (4, 4), (4, 5), (5, 6), (6, 5), (4, 8), (1, 5)):
            with self.subTest(columns=columns, rows=rows):
                described = {"pitch_mm": 9, "columns": columns, "rows": rows}
                pad = read_pad(described)
                x_mm, y_mm, readings_Pa = presses(pad, 40, SIGMA_mm)
                width = {"sigma_mm": SIGMA_mm, "sigma_sd_mm": 0.1} if columns * rows == 4 else None  # which four readings do not determine
                found = fingertip.fit(readings_Pa, described, calibration=width)
                self.assertLess(off_mm(found, x_mm, y_mm), 0.05)
                thick = fingertip.fit(readings_Pa, described | {"rubber": RUBBER})
                self.assertEqual("qx_N" in thick, columns > 1 and 8 <= columns * rows <= 30)
                if "qx_N" in thick:
                    self.assertGreater(np.isfinite(thick["qx_N"]).mean(), 0.9)
                    self.assertEqual((thick["shape"] > 0).mean() > 0.9, len(pad.x_mm) >= 12)
                    np.testing.assert_array_equal(thick["flags"] & Flag.UNCERTAIN > 0, thick["location_sd_mm"] > 0.6)

    def test_two_contacts_and_a_pull_are_found(self):
        pad = read_pad("4x4")
        one, other, across = (responses(pad, [x], [0.0], SIGMA_mm) for x in (-9.0, 9.0, 1.0))
        described = {"pitch_mm": 9, "columns": 4, "rows": 4, "rubber": RUBBER}
        two = fingertip.fit(9000.0 * one + 6000.0 * other, described)
        self.assertEqual(SHAPES[two["shape"][0]], "two")
        self.assertLess(abs(two["x1_mm"][0] + 9.0) + abs(two["x2_mm"][0] - 9.0), 1.0)
        one, other = (responses(pad, [x], [0.0], SIGMA_mm) for x in (-4.0, 4.0))  # which looks like a pull too
        near = fingertip.fit(9000.0 * one + 1080.0 * other, described, calibration={"gain_sd": [0.002] * 16})
        self.assertTrue(near["flags"][0] & Flag.TWO_CONTACTS and np.isnan(near["qx_N"][0]))
        ring = responses(pad, [0.0], [0.0], 3 * SIGMA_mm) - responses(pad, [0.0], [0.0], 0.8 * SIGMA_mm)
        unknown = fingertip.fit(9000.0 * ring, described)
        self.assertTrue(SHAPES[unknown["shape"][0]] == "none" and unknown["flags"][0] & Flag.SHAPE_UNKNOWN)
        broad = (pad.x_mm - 1.0) / 9.0 * responses(pad, [1.0], [0.0], 1.5 * SIGMA_mm)
        pulled = fingertip.fit(9000.0 * across + 1000.0 * broad, described, calibration={"gain_sd": [0.002] * 16})
        self.assertGreater(pulled["qx_N"][0], 3 * pulled["q_sd_N"][0] + 10 * abs(pulled["qy_N"][0]))

    def test_a_missing_sensor_is_left_out_and_flagged(self):
        x_mm, y_mm, readings_Pa = presses(PAD, 50, 4.5)
        readings_Pa[:, 3] = np.nan
        found = fingertip.fit(readings_Pa, "2x4")
        self.assertTrue((found["flags"] & Flag.SENSOR_MASKED > 0).all() and (found["sensors_used"] & 8 == 0).all())
        self.assertLess(off_mm(found, x_mm, y_mm), 0.3)

    def test_rows_with_a_time_are_contacts_by_the_gate(self):
        t_s = 0.01 * np.arange(300)
        x_mm = -2.0 + 2 * t_s
        pressed = (t_s > 0.5) & (t_s < 2.0)
        readings_Pa = 3e4 + 9000.0 * pressed[:, None] * responses(PAD, x_mm, np.zeros(300), 4.5)
        found = fingertip.fit(readings_Pa, "2x4", time_s=t_s, zero_rows=40)
        np.testing.assert_array_equal(np.isfinite(found["x_mm"]), pressed)
        self.assertLess(off_mm({name: found[name][pressed] for name in found}, x_mm[pressed], 0.0), 0.05)
        self.assertEqual(found["flags"][~pressed].max(), 0)

    def test_a_calibration_brings_places_and_forces_nearer(self):
        gains = np.exp(0.15 * np.random.default_rng(3).normal(size=8))
        found = fingertip.calibrate(gains * presses(PAD, 40, 3.6, seed=4)[2], "2x4", force_N=2.0)
        x_mm, y_mm, readings_Pa = presses(PAD, 200, 3.6, seed=5)
        before, after = (fingertip.fit(gains * readings_Pa, "2x4", calibration=known) for known in (None, found))
        self.assertLess(off_mm(after, x_mm, y_mm), 0.4 * off_mm(before, x_mm, y_mm))
        self.assertAlmostEqual(np.median(after["force_N"]), 2.0, delta=0.1)
        self.assertLess((after["flags"] & WARNINGS > 0).mean(), 0.5 * (before["flags"] & WARNINGS > 0).mean())

    def test_what_cannot_be_is_refused_with_its_cause(self):
        readings_Pa = presses(PAD, 10, 4.5)[2]
        for values, pad, more, words in (
            (readings_Pa[:, :7], "2x4", {}, "10 x 7, and pad 2x4 has 8 sensors"),
            (readings_Pa, "2x5", {}, "no such pad; give 2x4, 3x5, 4x4"),
            (readings_Pa, {"columns": 2, "rows": 4}, {}, "KeyError 'pitch_mm'"),
            (readings_Pa / 1000, "2x4", {}, "below six times the noise"),
            (readings_Pa, "2x4", {"unit": "bar"}, "more than such sensors measure"),
            (readings_Pa, "2x4", {"unit": "Torr"}, "is no unit; give one of Pa"),
            (readings_Pa + 1e5, "2x4", {}, "as the air's"),
            (readings_Pa * np.nan, "2x4", {}, "none is a number"),
            (readings_Pa, "2x4", {"time_s": np.zeros(10)}, "time does not rise"),
            (readings_Pa, "2x4", {"calibration": {"gain": [1.0] * 7}}, "gain of the calibration has 7 values"),
        ):
            with self.subTest(words), self.assertRaisesRegex(fingertip.InputError, words):
                fingertip.fit(values, pad, **more)

    def test_the_command_does_the_same_from_a_file(self):
        x_mm, y_mm, readings_Pa = presses(PAD, 30, 4.5)
        with tempfile.TemporaryDirectory() as folder:
            path, out = f"{folder}/presses.csv", f"{folder}/out.csv"
            lines = [f"{x},{y},{','.join(map(repr, row.tolist()))}" for x, y, row in zip(x_mm, y_mm, readings_Pa / 1000)]
            pathlib.Path(path).write_text("x,y,some pressures\n" + "\n".join(lines) + "\n")

            def run(*options, status=0):
                done = subprocess.run([FINGERTIP, "fit", path, *options], capture_output=True, text=True)
                self.assertEqual(done.returncode, status, done.stderr)
                return done.stdout + done.stderr

            right = ("--pad", "2x4", "--first", "3", "--unit", "kPa")
            rows = list(csv.DictReader(run(*right).splitlines()))
            found = fingertip.fit(readings_Pa, json.loads((ROOT / "boards/pads/2x4.json").read_text()))
            np.testing.assert_allclose([float(row["x_mm"]) for row in rows], found["x_mm"], atol=1e-5)
            self.assertIn("10 columns, and the pad has 8 sensors", run("--pad", "2x4", status=1))
            run(*right, "-o", out)
            self.assertIn("--overwrite", run(*right, "-o", out, status=1))
            pathlib.Path(path).write_text("\n".join([lines[0], lines[1] + ",1"]))
            self.assertIn(":2: 11 cells, and 10 before", run(*right, status=1))
            pathlib.Path(path).write_text("\n".join([lines[0], lines[1] + "x"]))
            self.assertIn(":2: could not convert", run(*right, status=1))


if __name__ == "__main__":
    unittest.main()
