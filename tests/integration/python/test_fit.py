"""`fingertip fit` and fingertip.fit: what they find on arrays of every size, what a calibration changes, and what they refuse.

usage: test_fit.py FINGERTIP
"""

import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

FINGERTIP = os.environ["FINGERTIP_TOOL"] = os.path.abspath(sys.argv.pop())
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python")]
import fingertip  # noqa: E402
from fingertip.fit import SHAPES, firmware, read_pad  # noqa: E402
from fingertip.line import CONTACT_COLUMNS, RAW_COLUMNS, WARNINGS, Flag  # noqa: E402
from fingertip.tables import read_table  # noqa: E402

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
        found = fingertip.fit(np.ma.array(readings_Pa, mask=[np.arange(8) == 3] * 50), "2x4")
        self.assertTrue((found["flags"] & Flag.SENSOR_MASKED > 0).all() and (found["sensors_used"] & 8 == 0).all())
        self.assertLess(off_mm(found, x_mm, y_mm), 0.3)
        described = {"pitch_mm": 9, "columns": 4, "rows": 4, "rubber": RUBBER}
        readings_Pa = presses(read_pad(described), 40, SIGMA_mm)[2]
        readings_Pa[:, 5] = np.nan
        found = fingertip.fit(readings_Pa, described)  # a zero there would be a dent, which no one contact makes
        self.assertLess((found["flags"] & (Flag.SHAPE_UNKNOWN | Flag.TWO_CONTACTS) > 0).mean(), 0.1)

    def test_flags_and_standard_deviations_are_those_of_the_chip(self):
        described = {"pitch_mm": 9, "columns": 4, "rows": 4}
        pad, pull = read_pad(described), responses(read_pad(described), [-7.3], [2.0], 1.27 * SIGMA_mm)
        pulled_Pa = 3000.0 * responses(pad, [-9.4, -7.3, -5.2], [2.0] * 3, SIGMA_mm).sum(axis=0) - 2500.0 * (pad.x_mm + 7.3) / 9 * pull
        for of_pad in (described, described | {"rubber": RUBBER}):
            with self.subTest(of_pad=of_pad):
                plain, exact, known = (
                    fingertip.fit(pulled_Pa, of_pad, calibration={"gain_sd": [0.02] * 16, "force_scale": scale, "force_scale_sd": sd})
                    for scale, sd in ((0.0, 0.0), (2.0, 0.0), (2.0, 0.2))
                )
                estimated, flags = "rubber" in of_pad, int(known["flags"][0])
                self.assertEqual(flags ^ plain["flags"][0], Flag.CALIBRATED)
                there = [bool(flags & flag) for flag in (Flag.CONTACT, Flag.ELONGATED, Flag.TANGENTIAL_VALID)]
                self.assertEqual(there, [True, not estimated, estimated])
                wanted_N = np.hypot(exact["force_sd_N"], known["force_N"] * 0.1)
                np.testing.assert_allclose(known["force_sd_N"], wanted_N, rtol=2e-3)  # bits of fit_quadrature()
        self.assertGreater(known["q_sd_N"][0], 0.1 * abs(known["qx_N"][0]))  # the scale of silicone that nobody has pulled
        *xy_mm, dented_Pa = presses(PAD, 200, 2.5, seed=5)
        known = {"sigma_mm": 2.5, "sigma_sd_mm": 0.1, "dip_share": 0.0005, "dip_sd_mm": 6.25}
        dented = fingertip.fit(dented_Pa - 200.0 * responses(PAD, *xy_mm, 6.25), "2x4", calibration=known)
        self.assertTrue((dented["location_sd_mm"] > dented["sigma_mm"]).any())  # it may be pulled, which takes nothing of its force
        np.testing.assert_allclose(dented["force_N"], 2e-6 * np.pi * dented["p0_Pa"] * dented["sigma_mm"] ** 2, rtol=1e-5)

    def test_rows_with_a_time_are_contacts_by_the_gate(self):
        t_s = 0.01 * np.arange(300)
        x_mm = -2.0 + 2 * t_s
        pressed = (t_s > 0.5) & (t_s < 2.0)
        readings_Pa = 3e4 + 9000.0 * pressed[:, None] * responses(PAD, x_mm, np.zeros(300), 4.5)
        found = fingertip.fit(readings_Pa, "2x4", time_s=t_s, zero_rows=40)
        np.testing.assert_array_equal(np.isfinite(found["x_mm"]), pressed)
        self.assertLess(off_mm({name: found[name][pressed] for name in found}, x_mm[pressed], 0.0), 0.05)
        self.assertEqual(set(found["flags"][~pressed].tolist()), {int(Flag.TARED)})

    def test_a_calibration_brings_places_and_forces_nearer(self):
        gains = np.exp(0.15 * np.random.default_rng(3).normal(size=8))
        found = fingertip.calibrate(gains * presses(PAD, 40, 3.6, seed=4)[2], "2x4", force_N=2.0)
        x_mm, y_mm, readings_Pa = presses(PAD, 200, 3.6, seed=5)
        told = {"progress": lambda share: self.assertEqual(share, 0.995)}
        before, after = (fingertip.fit(gains * readings_Pa, "2x4", calibration=known, **told) for known in (None, found))
        self.assertLess(off_mm(after, x_mm, y_mm), 0.4 * off_mm(before, x_mm, y_mm))
        self.assertAlmostEqual(np.median(after["force_N"]), 2.0, delta=0.1)
        self.assertLess((after["flags"] & WARNINGS > 0).mean(), 0.5 * (before["flags"] & WARNINGS > 0).mean())

    def test_a_weight_set_down_again_and_again_in_time_calibrates_and_a_recording_is_read_as_it_is(self):
        gains, t_s = np.exp(0.15 * np.random.default_rng(3).normal(size=8)), np.arange(0, 160, 1 / 40)
        x_mm, y_mm, _ = presses(PAD, 40, 3.6, seed=4)
        place, down = (t_s // 4).astype(int), np.clip(10 * (t_s % 4 - 1.5), 0, 1) * np.clip(10 * (3.9 - t_s % 4), 0, 1)
        noise_Pa = 5.0 * np.random.default_rng(6).normal(size=(len(t_s), 8))
        series_Pa = 12000.0 * gains * down[:, None] * responses(PAD, x_mm[place], y_mm[place], 3.6) + noise_Pa
        known = fingertip.calibrate(series_Pa + 101e3, "2x4", time_s=t_s, zero_rows=40, force_N=2.0)
        np.testing.assert_allclose(known["gain"] / np.mean(known["gain"]), gains / gains.mean(), atol=0.02)
        self.assertGreater(known["force_scale"], 0.0)
        for rows, slower, words in ((500, 1, "from 3 placements: too few"), (None, 4, "10 rows a second, and 12 show a weight settle")):
            self.assertRaisesRegex(fingertip.InputError, words, fingertip.calibrate, series_Pa[:rows], "2x4", time_s=slower * t_s[:rows])

        names = ["t_us", "frame", *CONTACT_COLUMNS, *RAW_COLUMNS, *(f"{kind}{k}_Pa" for kind in ("s", "tare") for k in range(8))]
        x_mm, y_mm = (" ".join(map(str, places)) for places in (PAD.x_mm, PAD.y_mm))
        head = f"# fingertip-recording 1\n# serial: A\n# sensors: 8\n# pitch_mm: {PAD.pitch_mm}\n# x_mm: {x_mm}\n# y_mm: {y_mm}\n"
        there = np.arange(len(t_s)) != 2000  # a held frame has the pressures of the one before
        empty, doubtful = "," * len(CONTACT_COLUMNS), np.where(np.arange(len(t_s)) == 1000, 8, 0)
        readings = [",".join(f"{101e3 + value:.3f}" for value in row) + ",101000" * 8 for row in series_Pa]
        maps = [f"{0 if each else int(Flag.HELD)},{255 * each},0,{doubt},25" for each, doubt in zip(there, doubtful)]
        rows = [f"{25000 * i},{i}{empty},{i},{of},{row}\n" for i, (of, row) in enumerate(zip(maps, readings))]
        with tempfile.TemporaryDirectory() as folder:
            recording, kept = pathlib.Path(folder, "r.csv"), pathlib.Path(folder, "kept.json")
            recording.write_text(head + ",".join(names) + "\n" + "".join(rows) + "# end: reason=requested\n")
            out = []
            for options, words in (("--time 1", "--time and"), ("--unit kPa", "and --unit"), ("--first 27 --to 9", "this is a table")):
                done = subprocess.run([FINGERTIP, "fit", *options.split(), "--pad", "2x4", recording], capture_output=True, text=True)
                self.assertEqual((done.returncode, words in done.stderr), (2, True), done.stderr)
            for options in ("calibrate --dry-run --from", f"calibrate --pad 2x4 -o {kept} --from", f"fit --calibration {kept}"):
                done = subprocess.run([FINGERTIP, *options.split(), recording], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                out.append(done.stdout)
            of_tool = [float(gain) for gain in re.findall(r"^ +\d +(\d\.\d{3}) ", out[0], re.M)]
            np.testing.assert_allclose(json.loads(kept.read_text())["gain"], of_tool, atol=2e-3)
        found = list(csv.DictReader(out[2].splitlines()))
        wanted = fingertip.fit(series_Pa[there], "2x4", time_s=t_s[there], calibration={"gain": of_tool})
        self.assertEqual([row["t_s"] for row in found[:2]], ["0.0", "0.025"])
        np.testing.assert_array_equal([row["x_mm"] != "" for row in found], np.isfinite(wanted["x_mm"]))
        np.testing.assert_array_equal([int(row["flags"]) & Flag.SENSOR_MASKED > 0 for row in found], doubtful[there] > 0)

    def test_what_cannot_be_is_refused_with_its_cause(self):
        readings_Pa = presses(PAD, 10, 4.5)[2]
        t_s, rest_Pa = 0.01 * np.arange(20), 5.0 * np.random.default_rng(1).normal(size=(10, 8))
        series_Pa = np.vstack([rest_Pa, readings_Pa])
        for values, pad, more, words in (
            (1013 + series_Pa / 100, "2x4", {"zero_rows": 8}, "1013 Pa, as the air's in hPa or mbar; give that unit"),
            (series_Pa, "2x4", {"zero_rows": 15}, "in the 15 rows at rest: something touches"),
            (series_Pa - readings_Pa[3], "2x4", {}, "the zero is that of a press"),
            (readings_Pa, "2x4", {"zero_rows": 11}, "give rows that are there"),
            (readings_Pa, "2x4", {"noise_Pa": 0.0}, "and noise above 0"),
            (readings_Pa, "2x4", {"calibration": {"gain": [0.0] * 8}}, "gain is \\[0.0"),
            (readings_Pa, "2x4", {"calibration": {"gain": [1.0] * 7}}, "gain has 7 values"),
            (readings_Pa, "2x4", {"calibration": {"gains": []}}, "has none of sigma_mm"),
            (readings_Pa, "2x4", {"calibration": {"force_scale": 1.0}}, "without its standard deviation"),
            (readings_Pa, "2x4", {"calibration": __file__}, "test_fit.py: no JSON"),
            (readings_Pa[:, :7], "2x4", {}, "10 x 7, and pad 2x4 has 8 sensors"),
            (readings_Pa, "2x5", {}, "no such pad; give 2x4, 3x5, 4x4"),
            (readings_Pa, {"columns": 2, "rows": 4}, {}, "KeyError 'pitch_mm'"),
            (readings_Pa, {"pitch_mm": 9, "places_mm": [PAD.x_mm, PAD.y_mm]}, {}, "are no \\[x, y\\] of each sensor"),
            (readings_Pa, {"pitch_mm": 9, "places_mm": [[0, 0]] * 8}, {}, "two sensors are at the same place"),
            (readings_Pa, {"pitch_mm": 9, "columns": 2.5, "rows": 4}, {}, "2.5 x 4 sensors"),
            (readings_Pa, {"pitch_mm": 9, "columns": 2, "rows": 4, "rubber": {"thickness_mm": -12}}, {}, "rubber of -12 mm"),
            (np.where(series_Pa == series_Pa[12, 5], -9999, series_Pa), "2x4", {}, "fall to -9999 Pa .row 13, sensor 5.: the zero"),
            (readings_Pa, {"pitch_mm": np.nan, "columns": 2, "rows": 4}, {}, "pitch_mm nan is out of range"),
            (readings_Pa, {"pitch_mm": 9, "columns": 9, "rows": 5}, {}, "45 sensors: 1 to 36"),
            (readings_Pa / 1000, "2x4", {}, "below six times the noise"),
            (readings_Pa, "2x4", {"unit": "bar"}, "more than such sensors measure"),
            (readings_Pa, "2x4", {"unit": "Torr"}, "is no unit; give one of Pa"),
            (readings_Pa + 1e5, "2x4", {}, "as the air's"),
            (readings_Pa * np.nan, "2x4", {}, "none is a number"),
            (readings_Pa, "2x4", {"time_s": np.zeros(10)}, "time does not rise after row 1"),
            (readings_Pa, "2x4", {"time_s": t_s[:9]}, "time has 9 values, and there are 10 rows"),
        ):
            with self.subTest(words), self.assertRaisesRegex(fingertip.InputError, words):
                fingertip.fit(values, pad, **more)
        for pitch_mm in (0.0, np.nan, 1e30):
            with self.subTest(pitch_mm), self.assertRaisesRegex(fingertip.InputError, "pitch_mm, are none of a pad"):
                firmware().calibrate(PAD.x_mm, PAD.y_mm, pitch_mm, t_s[None], series_Pa[None], 10.0)
        for values, more, words in (
            (series_Pa + 5 * np.vstack([rest_Pa, rest_Pa]), {"zero_rows": 10}, "readings scatter by 2. Pa from row to row"),
            (series_Pa / 100, {"noise_Pa": 1.0}, "that of a few grams"),
            (series_Pa, {"time_s": t_s + 0.2 * (t_s > 0.15)}, "rows are lost at 1 places, the longest of 0.21 s before row 17"),
            (series_Pa[10:], {"time_s": t_s[:10]}, "the first row is touched"),
            (series_Pa, {"time_s": 1000 * t_s}, "rows are 10 s apart: is the time in seconds"),
            (series_Pa, {"time_s": np.datetime64("2024-05-06") + np.arange(20).astype("m8[m]")}, "rows are 60 s apart"),
            (series_Pa + 1e5 * (np.arange(8) != 2), {"zero_rows": 10}, "sensor 2 is at .* Pa, others at 100"),
        ):
            with self.subTest(words), self.assertWarnsRegex(UserWarning, words):
                fingertip.fit(values, "2x4", **more)

    def test_the_command_does_the_same_from_a_file(self):
        x_mm, y_mm, readings_Pa = presses(PAD, 30, 4.5)
        with tempfile.TemporaryDirectory() as folder:
            path, out = f"{folder}/presses.csv", f"{folder}/out.csv"
            lines = [f"{x},{y},{','.join(map(repr, row.tolist()))}" for x, y, row in zip(x_mm, y_mm, readings_Pa / 1000)]
            pathlib.Path(path).write_text("x,y,some pressures\n" + "\n".join(lines) + "\n")

            def run(*options, status=0, command=("fit",)):
                done = subprocess.run([FINGERTIP, *command, path, *options], capture_output=True, text=True)
                self.assertEqual(done.returncode, status, done.stderr)
                return done.stdout + done.stderr

            right = ("--pad", "2x4", "--first", "3", "--unit", "kPa")
            rows = list(csv.DictReader(run(*right).splitlines()))
            found = fingertip.fit(readings_Pa, json.loads((ROOT / "boards/pads/2x4.json").read_text()))
            np.testing.assert_allclose([float(row["x_mm"]) for row in rows], found["x_mm"], atol=1e-5)
            self.assertIn("10 columns, and the pad has 8 sensors", run("--pad", "2x4", status=1))
            run(*right, "-o", out)
            weight_Pa = np.exp(0.15 * np.random.default_rng(3).normal(size=8)) * presses(PAD, 40, 3.6, seed=4)[2]
            np.savetxt(f"{folder}/weight.csv", np.c_[np.zeros((40, 2)), weight_Pa / 1000], delimiter=",")
            of_weight = ("calibrate", "--weight", "200", *right, "-o", f"{folder}/gains.json", "--from", f"{folder}/weight.csv")
            self.assertEqual(subprocess.run([FINGERTIP, *of_weight], capture_output=True, text=True).stderr, "")
            written = json.loads(pathlib.Path(f"{folder}/gains.json").read_text())
            for name, known in fingertip.calibrate(weight_Pa, "2x4", force_N=1.96133).items():
                np.testing.assert_allclose(written[name], known, rtol=1e-4)
            run(*right, "--calibration", f"{folder}/gains.json")
            self.assertIn("or `calibrate --from` with --pad", run(command=("calibrate", "--from"), status=1))
            self.assertIn('"--first" is no option of it', run("--first", "3", command=("calibrate", "--from"), status=2))
            self.assertIn("--pad NAME, or FILE.json, is needed", run(status=2))
            for options, words in (
                ((*right, "-o", out), "--overwrite"),
                ((*right, "-o", path, "--overwrite"), "presses.csv: is named twice"),
                ((*right, "-o", out, "--calibration", out, "--overwrite"), "out.csv: is named twice"),
                (("--pad", "none", "-o", folder), "is a folder"),
                (("--pad", "none", "-o", f"{folder}/no/out.csv"), "there is no folder"),
                ((*right, "--calibrate", "--weight", "nan"), "a weight of nan N is out of range"),
                ((*right, "--calibrate"), "the pad's width and dip do: the sensors are alike, or something changed"),
            ):
                self.assertIn(words, run(*options, status=1))
            for options in (("--weight", "300"), ("--calibrate", "--calibration", out)):
                self.assertIn("--calibrate", run(*right, *options, status=2))
            done = subprocess.run(["sh", "-c", '"$0" "$@" > /dev/full', FINGERTIP, "fit", path, *right], stderr=subprocess.PIPE, text=True)
            self.assertEqual((done.returncode, done.stderr), (1, "fingertip fit: standard output: No space left on device\n"))
            for head, columns, options, words in (
                ("x,y", np.c_[x_mm, x_mm, readings_Pa], ("--first", "2"), 'column 2, of sensor 0, is "y", no pressure; --first N'),
                ("", np.c_[readings_Pa, x_mm], (), "column 1 of 9 would be the time, and does not rise after row"),
                ("", np.c_[x_mm, np.arange(30), readings_Pa], ("--first", "2"), "column 2, of sensor 0, rises evenly"),
                ("", np.c_[np.arange(30), readings_Pa], ("--first", "2"), "warning: column 1 rises evenly: a time? Give --time 1"),
                ("", np.c_[readings_Pa[:, :7], np.zeros(30)], (), "warning: column 8, of sensor 7, never changes"),
            ):
                named = [head + ",p" * (columns.shape[1] - 2)] if head else []
                pathlib.Path(path).write_text("\n".join([*named, *(",".join(map(repr, row)) for row in columns.tolist())]))
                refused = "warning" not in words
                self.assertIn(f"fingertip fit: {(path + ': ') * refused}{words}", run("--pad", "2x4", *options, status=refused))
            pathlib.Path(path).write_text("\n".join(f"{1.7e9 + k / 1000!r},{line.split(',', 2)[2]}" for k, line in enumerate(lines)))
            self.assertIn("\n1700000000.029,", run("--pad", "2x4", "--unit", "kPa"))
            for more, words in ((",1", ":2: 11 cells, and 10 before"), ("x", 'x" is no number, nor a time as')):
                pathlib.Path(path).write_text("\n".join([lines[0], lines[1] + more]))
                self.assertIn(words, run(*right, status=1))

    def test_tables_of_other_programs_are_the_same_numbers_or_refused_with_their_cause(self):
        wanted = np.c_[np.arange(0.0, 1.0, 0.1), presses(PAD, 10, 4.5)[2].round(1)]
        wanted[9, 8] = np.nan
        rows = [[f"{value:.1f}" for value in row] for row in wanted]
        clock = [[f"2024-05-06T07:08:09.{k}", *row[1:]] for k, row in enumerate(rows)]

        def joined(rows, separator=",", end="\n", first="time", last="p7 [Pa]"):
            head = [first, *(f"p{k} [Pa]" for k in range(7)), last]
            return end.join(separator.join(row) for row in [head, *rows]).replace("nan", "")

        german = joined(rows, ";", "\r\n").replace(".", ",")
        for text in (
            "\ufeff" + german + "\r\n;;;;;;;;\r\n",
            joined(rows, "\t").replace(".", ","),
            joined([[f'"{cell}"' for cell in row] for row in rows]),
            joined([["t", *8 * ["Pa"]], *([str(100 * k), *row[1:]] for k, row in enumerate(rows))], first="Time (ms)"),
            joined(rows, end=",\n") + ",",
            "2024-05-06\nevery 10 ms,,,,,,,,\n" + joined(rows) + "N/A",
            german.replace(";0,", ";,").replace("\n0,", "\n,"),
            "\n".join(",".join(row) + "," for row in rows).replace("nan", ""),
            joined(clock, first="Time (hh:mm:ss.ms)"),
            joined([[row[0][12:], *row[1:]] for row in clock]),
            joined([[f"6.5.2024 {row[0][12:]}", *row[1:]] for row in clock]),
        ):
            with self.subTest(text[:30]), tempfile.NamedTemporaryFile() as file:
                pathlib.Path(file.name).write_text(text, encoding="utf-8", newline="")
                pressures, time_s = read_table(file.name, 8, None, None, "Pa")
                np.testing.assert_allclose(np.c_[time_s - time_s[0], pressures], wanted, rtol=0, atol=1e-6)
                if "p0 [Pa]" in text:
                    self.assertWarnsRegex(UserWarning, "named as in Pa, and read as kPa", read_table, file.name, 8, None, None, "kPa")
        self.assertRaisesRegex(fingertip.InputError, "more than 536 MB; give a part", read_table, "/dev/zero", 8, None, None, "Pa")
        for data, words in (
            (german.encode("utf-16"), "text in UTF-16"),
            (b"\x93NUMPY\1", "save them as CSV"),
            (german.replace(";", ";1.").encode(), 'no row of numbers in it; "1.[0-9,]*" is no number'),
            (german.replace(";", ";1.0;", 20).encode(), "points and commas are both in numbers"),
            (joined([[*row[:5], "OVF", *row[6:]] if k == 0 else row for k, row in enumerate(rows)]).encode(), ':2: "OVF" is no number'),
        ):
            with tempfile.NamedTemporaryFile() as file:
                pathlib.Path(file.name).write_bytes(data)
                self.assertRaisesRegex(fingertip.InputError, words, read_table, file.name, 8, None, None, "Pa")


if __name__ == "__main__":
    unittest.main()
