"""The twin command, and its files in the hands of their readers: usage test_twin.py TWIN TABLES PLAYER [unittest arguments]."""

import csv
import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

TWIN, TABLES, PLAYER = (os.path.abspath(path) for path in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PATIENCE_s = 300
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import files  # noqa: E402
from real_time import RealTime  # noqa: E402
from small_disk import disk_of  # noqa: E402

READ_AS_THE_EMULATOR_DOES = """
import { readScenario } from '%s';
const s = readScenario(process.argv[1]);
const at = (t) => Array.from({ length: s.sensors }, (_, k) => s.at_ns(k, t * 1e9));
console.log(JSON.stringify({ metadata: s.metadata, rows: s.times_s.length, end_s: s.end_s,
  at: process.argv.slice(2).map(Number).map(at) }));
""" % (ROOT / "host_tools/simulation/emulator/scenario.mjs").as_uri()

PROGRESS = re.compile(r"(?m)^.* \d+ %(, \d+ s left)?\n")  # a line is ten seconds of this machine


class TwinTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="twin-test-")))
        self.csv = str(self.folder / "played.csv")

    def run_twin(self, *arguments, status=0, **options):
        done = subprocess.run([TWIN, *arguments], capture_output=True, text=True, timeout=PATIENCE_s, **options)
        self.assertEqual(done.returncode, status, (arguments, done.stdout, done.stderr))
        return done.stdout, PROGRESS.sub("", done.stderr)

    def scenario(self, *arguments, path=None, **options):
        return self.run_twin("scenario", *arguments, "-o", path or self.csv, "--cache", TABLES, **options)

    def error(self, *arguments, status=1, **options):
        out, err = self.run_twin(*arguments, status=status, **options)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("twin: "), err)
        return err

    def scenario_error(self, *arguments, **options):
        return self.error("scenario", *arguments, "-o", self.csv, "--cache", TABLES, **options)

    def events(self):
        lines = (self.folder / "played.truth.csv").read_text().splitlines()
        self.assertEqual(lines[0], "# fingertip-truth 1")
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))

    def read_as_the_emulator_does(self, *times_s):
        words = ["node", "--input-type=module", "-e", READ_AS_THE_EMULATOR_DOES, self.csv, *map(str, times_s)]
        return json.loads(subprocess.run(words, capture_output=True, text=True, check=True, timeout=PATIENCE_s).stdout)

    def played(self, *options):
        recording = str(self.folder / "recording.csv")
        words = [PLAYER, "play", self.csv, "-o", recording, "--quiet", "--noise", "0", "--rate", "50", *options]
        subprocess.run(words, check=True, timeout=PATIENCE_s)
        return files.read_recording(recording)


class Files(TwinTest):
    def test_every_kind_is_read_by_python_and_emulator_alike(self):
        names = [line.split()[0] for line in self.run_twin("list")[0].split("\n\n")[0].splitlines()[1:]]
        known = "grid taps hold high pokes cycle slip twist rolloff placements two lift drag slide screw"
        self.assertEqual(sorted(names), sorted(known.split()))
        for kind in names:
            with self.subTest(kind):
                seconds = 34 if kind == "cycle" else 12
                self.scenario(kind, "--seconds", str(seconds), "--effects", "all", "--overwrite")
                scenario = files.read_scenario(self.csv)
                times = [0, 1.8, 7.3, seconds]
                emulator = self.read_as_the_emulator_does(*times)
                self.assertEqual(emulator["end_s"], seconds)
                self.assertEqual(emulator["rows"], len(scenario.t_s))
                self.assertEqual(emulator["metadata"], scenario.metadata)
                name = f"{kind}-{'sphere15' if kind in ('placements', 'drag') else 'sphere6'}-h12-gain10-dip-widths-places-drift-relaxation-memory-hysteresis-aftereffect-creep-temperature-branch-bias-clip{'-tangential0.3' if kind in ('lift', 'drag') else ''}"
                self.assertEqual(scenario.metadata["name"], name)
                for t_s, sensors in zip(times, emulator["at"]):
                    for k, sensor in enumerate(sensors):
                        pressure_Pa = files.np.interp(t_s, scenario.t_s, scenario.sensors_Pa[:, k])
                        self.assertAlmostEqual(sensor["pressure_Pa"] - 101325, pressure_Pa, places=6)
                        self.assertTrue(5 <= sensor["temperature_degC"] < 31)
                events = self.events()
                held = [row for row in events if float(row["force_N"]) > 0 or float(row["force_end_N"]) > 0]
                self.assertGreater(len(held), 1)
                # Where the events say that something presses, so does the scenario.
                for row in events:
                    middle = (float(row["t_begin_s"]) + float(row["t_end_s"])) / 2
                    self.assertTrue(scenario.is_on("contact", middle), row)
                    slips = row["phase"] in ("dead_travel", "slip")
                    self.assertEqual(bool(scenario.is_on("slip", middle)), slips, row)
                    force = float(row["force_end_N"]) + float(row["force2_end_N"] or 0)
                    true_N = scenario.at("force_N", float(row["t_end_s"]))
                    if kind in ("placements", "lift", "drag", "slide", "screw"):  # a weight, or a grip of controlled force
                        self.assertAlmostEqual(true_N, force, delta=0.02, msg=row)
                    else:  # travel that is held, on rubber that relaxes
                        self.assertTrue(0.88 * force - 0.02 <= true_N <= 0.997 * force + 0.02, row)
                acts = {row["act"]: row for row in events}
                self.assertEqual(len(scenario.intervals("contact")), len(acts))

    def test_same_options_same_bytes_and_other_seeds_others(self):
        options = ("taps", "--seconds", "20", "--effects", "gain=10,relaxation,hysteresis")
        files = {}
        for name, more in {"a": (), "b": (), "seed": ("--seed", "2"), "pad": ("--pad", "2")}.items():
            path = self.folder / name / "played.csv"
            path.parent.mkdir()
            self.scenario(*options, *more, path=str(path))
            files[name] = (path.read_bytes(), (path.parent / "played.truth.csv").read_bytes())
        self.assertEqual(files["a"], files["b"])
        self.assertNotEqual(files["a"][1], files["seed"][1])
        self.assertEqual(files["a"][1], files["pad"][1])
        self.assertNotEqual(files["a"][0], files["pad"][0])

    def test_the_tangential_force_is_read_by_its_name_and_moves_what_the_firmware_finds(self):
        self.scenario("taps", "--force", "5", "--seconds", "40", "--tangential", "0.3,90", "--effects", "temperature")
        scenario = files.read_scenario(self.csv)
        files.np.testing.assert_allclose(scenario.truth["Qx_N"], 0, atol=1e-9)
        files.np.testing.assert_allclose(scenario.truth["Qy_N"], 0.3 * scenario.truth["force_N"], atol=2e-5)
        row = max(self.events(), key=lambda row: float(row["Qy_N"]))
        self.assertEqual((row["Qx_N"], row["Qy_N"]), ("0.00000", "1.50000"))
        played = self.played()
        t_s = played["t_us"] * 1e-6
        pressed = (scenario.at("force_N", t_s) > 4.9) & ~files.np.isnan(played["y_mm"])
        self.assertGreater(pressed.sum(), 100)
        off_mm = (played["y_mm"] - scenario.at("y_mm", t_s))[pressed]
        self.assertAlmostEqual(files.np.median(off_mm), 1.05, delta=0.15)
        text = pathlib.Path(self.csv).read_text()
        for name, what in (
            ("Qz_N", 'column 24 is "Qz_N"; after the sensors there may be, once each: Qx_N, Qy_N, temperature_degC'),
            ("Qy_N", 'column 25 is "Qy_N"; after the sensors'),
        ):
            pathlib.Path(self.csv).write_text(text.replace("Qx_N", name, 1))
            words = [PLAYER, "play", self.csv, "-o", str(self.folder / "refused.csv"), "--quiet"]
            refused = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_s)
            self.assertEqual(refused.returncode, 1)
            self.assertIn(what, refused.stderr)
            with self.assertRaisesRegex(files.InputError, "wrong header.*once each, any of Qx_N, Qy_N, temperature_degC"):
                files.read_scenario(self.csv)

    def test_a_slide_tells_where_friction_gave_way(self):
        self.scenario("slide", "--seconds", "40", "--effects", "gain")
        scenario, events = files.read_scenario(self.csv), self.events()
        for row in events:
            self.assertTrue(0.3 <= float(row["friction"]) <= 0.8 and 0.1 <= float(row["mass_kg"]) <= 0.5, row)
        slides = [row for row in events if row["phase"] == "slip"]
        self.assertEqual({row["act"] for row in slides}, {row["act"] for row in events if row["press"] != "carry"})
        told = [(float(row["t_begin_s"]), float(row["t_end_s"])) for row in slides]
        files.np.testing.assert_allclose(scenario.intervals("slip"), told, atol=0.0021)
        self.assertGreater(self.played().has_contact.sum(), 1000)

    def test_a_pad_that_ends_reads_more_near_its_edge(self):
        options = ("taps", "--force", "5", "--seconds", "20")
        self.scenario(*options)
        endless = pathlib.Path(self.csv).read_text()
        out, err = self.scenario(*options, "--overhang", "6", "--overwrite")
        self.assertIn("taps-sphere6-h12-overhang6-gain0", out)
        ends = pathlib.Path(self.csv).read_text()
        self.assertIn("# overhang_mm: 6\n", ends)
        self.assertEqual(len(list(pathlib.Path(TABLES).glob("block30x48-h12-*.table"))), 1)

        def largest(text):
            rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
            return max(float(row[f"s{k}_Pa"]) for row in rows for k in range(15))

        self.assertGreater(abs(largest(ends) - largest(endless)), 10.0)

    def test_a_cold_pad_reads_one_step_and_old_temperatures(self):
        # Almost no force; the firmware keeps a branch for 0.3 K, 3 s, and its temperature for half a second: some 24 Pa at 0.1 K/s.
        self.scenario("taps", "--force", "0.02", "--quiet", "60", "--seconds", "70", "--effects", "branch=7")
        scenario, played = files.read_scenario(self.csv), self.played("--raw")
        t_s, read_Pa = played["t_us"] * 1e-6, played.sensors_Pa - 101325
        crossing_s = 10 * (9.665 - 7)
        for k in range(15):
            with self.subTest(sensor=k):
                off_Pa = read_Pa[:, k] - files.np.interp(t_s, scenario.t_s, scenario.sensors_Pa[:, k])
                for begin_s, end_s in ((3, crossing_s - 2), (crossing_s + 8, 58)):
                    steady = (t_s > begin_s) & (t_s < end_s)
                    self.assertLess(off_Pa[steady].max(), 1)
                    self.assertTrue(-32 < off_Pa[steady].min() < -17, off_Pa[steady].min())
                late = (t_s > crossing_s + 1) & (t_s < crossing_s + 2.5)
                self.assertLess(read_Pa[late, k].max(), 10)
                self.assertGreater(read_Pa[(t_s > crossing_s + 8) & (t_s < 58), k].max(), 40)

    def test_an_interrupt_leaves_nothing(self):
        words = f"scenario slip --seconds 7200 --effects all -o {self.csv} --cache {TABLES}"
        twin = subprocess.Popen([TWIN, *words.split()], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        RealTime().until(lambda: any(path.stat().st_size for path in self.folder.iterdir()))
        twin.send_signal(signal.SIGINT)
        out, err = twin.communicate(timeout=PATIENCE_s)
        self.assertEqual(
            (twin.returncode, out, PROGRESS.sub("", err)), (1, "", "twin: interrupted; what was not finished was not written\n")
        )
        self.assertEqual(os.listdir(self.folder), [])

    def test_a_full_disk_leaves_older_files_as_they_were(self):
        self.scenario("taps", "--seconds", "5")
        before = [(self.folder / name).read_bytes() for name in ("played.csv", "played.truth.csv")]

        err = self.scenario_error("taps", "--seconds", "60", "--overwrite", preexec_fn=disk_of(100000))
        self.assertIn("played.csv", err)
        self.assertEqual(before, [(self.folder / name).read_bytes() for name in ("played.csv", "played.truth.csv")])
        self.assertEqual(sorted(os.listdir(self.folder)), ["played.csv", "played.truth.csv"])


class Usage(TwinTest):
    def test_list_explains_everything(self):
        out = self.run_twin("list")[0]
        for word in ("sphere6", "cube24", "rubber_duck", "relaxation", "hysteresis", "clip", "rolloff", "Shore"):
            self.assertIn(word, out)

    def test_width_is_that_of_the_layer(self):
        out, _ = self.run_twin("width", "--indenter", "sphere6", "--layer", "12", "--cache", TABLES)
        found = dict(word.split("=") for word in out.split())
        self.assertEqual(list(found), ["sigma_mm", "force_share", "peak_kPa"])
        self.assertAlmostEqual(float(found["sigma_mm"]), 0.45 * 12, delta=0.36)
        self.assertAlmostEqual(float(found["force_share"]), 0.9, delta=0.02)
        peak_kPa = 2 * float(found["force_share"]) / (2 * math.pi * float(found["sigma_mm"]) ** 2) * 1000
        self.assertAlmostEqual(float(found["peak_kPa"]), peak_kPa, delta=0.01 * peak_kPa)

    def test_width_hardly_depends_on_hardness(self):
        widths = []
        for shore in ("10", "40"):
            words = f"width --indenter sphere15 --layer 12 --force 5 --shore {shore} --cache {self.folder}"
            out, _ = self.run_twin(*words.split())
            widths.append(float(out.split()[0].removeprefix("sigma_mm=")))
        self.assertLess(widths[1], widths[0])  # a ball sinks deeper into softer rubber
        self.assertGreater(widths[1], 0.95 * widths[0])

    def test_existing_files_stay_unless_told(self):
        self.scenario("taps", "--seconds", "5")
        self.assertIn("exists already; choose another name, or --overwrite", self.scenario_error("taps", "--seconds", "5"))
        os.remove(self.csv)
        self.assertIn("played.truth.csv: exists already", self.scenario_error("taps", "--seconds", "5"))
        self.scenario("taps", "--seconds", "5", "--overwrite")

    def test_the_help_is_the_same_for_everybody(self):
        out, _ = self.run_twin("scenario", "--help", env={**os.environ, "XDG_CACHE_HOME": "/somewhere/else"})
        self.assertIn("~/.cache/fingertip/contact-tables", out)
        self.assertNotIn("/somewhere/else", out)

    def test_wrong_words_are_told_in_one_line(self):
        for arguments, what in {
            ("glide",): 'there is no kind of scenario "glide"; give one of: grid, taps',
            ("taps", "--indenter", "thumb"): 'there is no indenter "thumb"',
            ("taps", "--layer", "1"): "--layer 1 is out of range; give 3 to 20 mm",
            ("taps", "--layer", "nan"): "--layer nan is out of range",
            ("taps", "--effects", "noise"): 'there is no effect "noise"; give some of: dip, widths',
            ("taps", "--effects", "gain=ten"): 'effect gain is "ten"; give 0 to 30 (%)',
            ("taps", "--overhang", "2"): "--overhang 2 is out of range; give 3 to 20",
            ("taps", "--overhang", "9", "--layer", "3"): "--layer of a pad that ends 3 is out of range; give 4 to 20",
            ("taps", "--seconds", "0"): "--seconds 0 is out of range; give 1 to 7200",
            ("cycle", "--seconds", "20"): '--seconds 20 is too short for one contact of "cycle"',
            ("taps", "--force", "much"): '--force "much" is not possible',
            ("taps", "--speed", "20"): "--speed has no effect",
            ("slip", "--tangential", "0.3"): "--tangential has no effect",
            ("taps", "--tangential", "0.6"): "--tangential 0.6 does not hold; give 0 to 0.5, or another --friction",
            ("taps", "--tangential", "much"): '--tangential "much" is not possible; give a number, or any of a range as 0.1..0.4',
            ("taps", "--tangential", "0.3,left"): '--tangential "0.3,left" has no direction; after the comma give degrees',
            ("lift", "--tangential", "0.1..0.6"): "--tangential 0.6 does not hold; give 0 to 0.5, or another --friction",
            ("lift", "--friction", "9"): "--friction 9 is out of range; give 0.05 to 5",
            ("lift", "--mass", "0.2"): '--mass has no effect in a scenario of "lift"; leave it out, or choose slide',
            ("slide", "--tangential", "0.2"): "--tangential has no effect",
            (
                *"slide --mass 2 --friction 0.3".split(),
            ): "--mass 2 needs a grip of up to 81.75 N at --friction 0.3, above 50; give less mass",
            ("slide", "--speed", "300"): "--speed 300 is out of range; give 1 to 200",
        }.items():
            self.assertIn(what, self.scenario_error(*arguments))
            self.assertEqual(os.listdir(self.folder), [])
        for words in (
            *("taps --seconds 2", "taps --seconds 1e9", "taps --seconds nan", "taps --force 0", "taps --force 1..51", "taps --force 9..2"),
            *("taps --force 5,", "taps --margin -1", "slip --speed 0", "taps --tangential -0.1", "taps --tangential 0.3,0,0"),
            *("lift --friction nan", "lift --tangential 0.4..0.1", "lift --tangential 0.1..", "lift --friction 0.3..0.5 --tangential 0.4"),
            *("slide --mass 0..1", "slide --kinetic 1.1", "slide --dead-travel 0", "slip --dead-travel 11"),
            "taps --overhang 20.1",
        ):
            self.assertIn("; ", self.scenario_error(*words.split()), words)
        self.assertIn("/no/such/place.csv: No such file or directory", self.error("scenario", "taps", "-o", "/no/such/place.csv"))
        taps = map("scenario taps -o x.csv {}".format, ("--seed -1", "--pad 1.5", "--seconds x"))
        for words in ("scenario", "scenario taps", "draw", "", *taps):
            self.error(*words.split(), status=2)

    def test_a_cache_that_cannot_be_is_told(self):
        blocked = self.folder / "file"
        blocked.write_text("")
        err = self.error("scenario", "taps", "-o", self.csv, "--cache", str(blocked / "cache"), "--indenter", "sphere6", "--layer", "12")
        self.assertIn("file/cache: cannot keep contact tables here; give another --cache", err)


if __name__ == "__main__":
    del sys.argv[1:4]
    unittest.main(verbosity=2)
