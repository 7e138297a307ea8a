"""Calibrating the gains and the tangential force's scale, from the twin's scenario to what the fingertip keeps: usage
test_calibrate.py FINGERTIP FAKE_DEVICE TIME_KEEPER TWIN PLAYER TABLES [unittest arguments]."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import numpy as np

TWIN, PLAYER, TABLES = sys.argv[4:7]
import cli_case  # noqa: E402
from fingertip import files  # noqa: E402
from simulated_terminal import Terminal  # noqa: E402

FORCE_N, SHARE = 3.0, 0.3
PULL_N = FORCE_N * SHARE
GRASP, SLIP = "capabilities=15", "capabilities=7"


def setUpModule():
    """One good recording of each kind for all tests, the way a user would make one."""
    global folder, placed, pulled, serial, gains, mean_gain
    folder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
    unittest.addModuleCleanup(folder.cleanup)
    placed, scenario = make_placements("good", "--effects", "gain=10", "--seed", "6")
    errors = re.search(r"^# gain_errors_percent: (.*)$", pathlib.Path(scenario).read_text(encoding="utf-8"), re.M)
    gains = np.array([1 + float(word) / 100 for word in errors[1].split()])
    mean_gain = gains.mean()
    gains /= mean_gain
    pulled, _ = make_pulls("pulls", "--effects", "gain=2", "--seed", "31")
    serial = re.search(r"^# serial: (\S+)$", pathlib.Path(pulled).read_text(encoding="utf-8"), re.M)[1]


def make_recording(name, scenario_options, play_options):
    scenario, played = (os.path.join(folder.name, name + end) for end in (".csv", ".recording.csv"))
    quiet = {"check": True, "stdout": subprocess.DEVNULL}
    subprocess.run([TWIN, "scenario", *scenario_options, "-o", scenario, "--cache", TABLES], **quiet)
    subprocess.run([PLAYER, "play", scenario, "-o", played, "--quiet", *play_options], **quiet)
    return played, scenario


def make_placements(name, *options, kind="placements", raw=("--raw",)):
    return make_recording(name, [kind, *options], ["--rate", "40", *raw])


def make_pulls(name, *options, pad=("--pad", "12"), kind="drag", seconds=100):
    return make_recording(name, [kind, "--force", str(FORCE_N), "--seconds", str(seconds), *options], ["--rate", "50", *pad])


def table(text):
    """Gains and their standard deviations by sensor."""
    rows = re.findall(r"^ +(\d+) +(\d\.\d{3}) +(\d+\.\d) ", text, re.M)
    return np.array([float(row[1]) for row in rows]), np.array([float(row[2]) / 100 for row in rows])


def scale_of_truth(recording, scenario):
    """What the readings of every steady pull have to be multiplied by, from the scenario's own loads."""
    recording, scenario = files.read_recording(recording), files.read_scenario(scenario)
    rows = recording.flag(files.TANGENTIAL_VALID)
    t_s, read = recording["t_us"][rows] / 1e6, np.column_stack((recording["qx_N"][rows], recording["qy_N"][rows]))
    truth = np.column_stack([scenario.at(name, t_s) for name in ("Qx_N", "Qy_N")])
    size, force = np.hypot(*truth.T), scenario.at("force_N", t_s)
    ratios = []
    for start, end in scenario.intervals("contact"):
        inside = (t_s > start) & (t_s < end) & (force > 0.999 * FORCE_N)
        pulled, rest = inside & (abs(size - PULL_N) < 1e-4), inside & (size < 1e-4)
        rest &= t_s < t_s[pulled][0] if pulled.any() else False
        if pulled.sum() > 50 and rest.sum() > 10:
            along = truth[pulled].mean(axis=0) / PULL_N
            ratios.append((read[pulled].mean(axis=0) - read[rest].mean(axis=0)) @ along / PULL_N)
    return 1 / np.mean(ratios)


class CalibrateTest(cli_case.CliTest):
    def calibrate(self, *arguments, **options):
        return self.run_cli("calibrate", *arguments, **options)

    def drag(self, *arguments, pull=("--force", str(PULL_N)), **options):
        return self.calibrate("--drag", *pull, *arguments, **options)

    def refused(self, *arguments, drag=False, **options):
        _, err = (self.drag if drag else self.calibrate)(*arguments, status=1, **options)
        self.assertEqual(err.count("\n"), 1, err)
        return err

    def shown(self):
        return self.calibrate("--show", "--port", self.port)[0]

    def lines_of_info(self, key):
        """The lines of info whose keys begin so."""
        return re.findall(rf"^{key}.*$", self.run_cli("info", "--port", self.port)[0], re.M)

    def assert_gains(self, text):
        found, sds = table(text)
        np.testing.assert_array_less(abs(found / gains - 1), 2 * sds)
        self.assertLess(sds.max(), 0.03)

    def scale(self, text):
        found = re.search(r"^tangential scale +\S+ sd \S+ before, (\S+) sd (\S+) now$", text, re.M)
        return float(found[1]), float(found[2])


class Gains(CalibrateTest):
    def test_shows_and_writes_nothing_with_dry_run(self):
        out, err = self.calibrate("--from", placed, "--dry-run", "--force", "3")
        self.assertEqual(err, "")
        self.assert_gains(out)
        before, after = re.search(r"location off by +([\d.]+) mm +([\d.]+) mm", out).groups()
        self.assertLess(float(after), 0.5 * float(before))
        scale, sd = re.search(r"force scale +1\.000 +(\d\.\d+) +sd (\d\.\d+)", out).groups()
        # The volume of the Gaussian is 9 % less than the force.
        self.assertAlmostEqual(float(scale) * mean_gain, 1.09, delta=0.02)
        self.assertLess(float(sd), 0.03)
        out, _ = self.calibrate("--from", placed, "--dry-run", "--weight", "306")
        self.assertAlmostEqual(float(re.search(r"force scale +1\.000 +(\d\.\d+)", out)[1]), float(scale), delta=0.005)
        late = pathlib.Path(self.folder, "late.csv")
        late.write_text(re.sub(r"(?m)^(\d+),", lambda row: f"{int(row[1]) + 10**9},", pathlib.Path(placed).read_text()))
        out, _ = self.calibrate("--from", late, "--dry-run")
        self.assertIn("force scale         unknown", out)
        self.assertRegex(out, r"^placement 1, \d\.\d s: ")  # since the recording began

    def test_writes_into_the_fingertip_it_is_of(self):
        with self.device(f"serial={serial}"):
            out, _ = self.calibrate("--from", placed, "--yes", "--port", self.port)
            self.assertIn("calibrated: it applies from now on", out)
            shown = self.shown()
            self.assert_gains(shown)
            self.assertRegex(shown, r"^calibrated 20\d\d-\d\d-\d\d \d\d:\d\d UTC from \d\d placements, force scale 1.000 sd 0.800\n")
            self.assertEqual(self.calibrate("--erase", "--yes", "--port", self.port)[0], "erased: it is as if never calibrated\n")
            self.assertEqual(self.shown(), "not calibrated\n")
            self.assertEqual(self.calibrate("--erase", "--yes", "--port", self.port)[0], "not calibrated\n")
        with self.device("serial=0123456789ABCDEF"):
            _, err = self.calibrate("--from", placed, "--yes", "--port", self.port, status=1)
            self.assertIn("is of fingertip", err)
            self.assertEqual(self.shown(), "not calibrated\n")

    def test_finds_the_thickness_and_says_where_another_was_told(self):
        write = ("--from", placed, "--yes", "--port", self.port)
        with self.device(f"serial={serial}", "capabilities=15"):
            out, err = self.calibrate(*write)
            found, sd = (float(value) for value in re.search(r"(?m)^rubber ([\d.]+) mm, sd ([\d.]+)$", out).groups())
            self.assertAlmostEqual(found, 12, delta=0.5)
            self.assertLess(sd, 0.7)
            self.assertEqual(err, "")
            self.assertIn(f"profile of a pad without end of {found} mm", out)
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], rf"(?m)^pad_thickness_mm +{found:g}$")
            for told in ("10.2", "13.8"):
                _, err = self.run_cli("pad", "--thickness", told, "--port", self.port)
                self.assertIn(f"the profile is of {told} mm of rubber, but the calibration's width is that of {found} mm, sd {sd}", err)
            _, err = self.calibrate(*write)
            self.assertIn("the profile is of 13.8 mm of rubber", err)
            out, err = self.run_cli("pad", "--overhang", "30", "--port", self.port)
            self.assertIn(f"thickness found in the calibration: {found} mm", out)
            self.assertEqual(err, "")
            _, err = self.run_cli("pad", "--thickness", "12", "--overhang", "30", "--port", self.port)
            self.assertEqual(err, "")
            self.assertIn("fingertip pad --thickness 12 --overhang 30\n", self.calibrate("--erase", "--yes", "--port", self.port)[0])
        with self.device(f"serial={serial}"):
            out, err = self.calibrate(*write)
            self.assertNotIn("profile of a pad", out)

    def test_is_asked_before(self):
        with self.device(f"serial={serial}"):
            _, err = self.calibrate("--from", placed, "--port", self.port, status=1)
            self.assertEqual(err, "fingertip: not written; give --yes without a terminal\n")
            self.assertEqual(self.shown(), "not calibrated\n")
        with self.device("calibrated=1"):
            _, err = self.calibrate("--erase", "--port", self.port, status=1)
            self.assertEqual(err, "fingertip: not erased; give --yes without a terminal\n")
            self.assertIn("from 30 placements", self.shown())

    def test_refuses_with_the_reason(self):
        for played, reason in (
            (make_placements("weights", "--effects", "gain=10", "--force", "2.5,3.5"), "not calibrated: .*use one and the same weight"),
            (make_placements("hand", "--effects", "gain=10", kind="pokes"), "not calibrated: no placement was found"),
            (make_placements("no pressures", "--seconds", "10", raw=()), "has no pressures to calibrate from; record with a firmware"),
        ):
            self.assertRegex(self.refused("--from", played[0], "--dry-run"), reason)

    def test_takes_placements_until_it_is_good_and_writes(self):
        with self.device(f"play={placed}"):
            out, err = self.calibrate("--port", self.port, "--yes", "--force", "3")
            self.assertEqual(err, "")
            self.assertRegex(out, r"set the weight down on its round foot, best near x -?\d+ y -?\d+ mm\n")
            self.assertIn("hold on\n", out)
            self.assertIn("taken: lift it\n", out)
            known = [float(text) for text in re.findall(r"gains known to ([\d.]+) %, wanted 1.5 %", out)]
            self.assertGreater(known[0], 5)
            self.assertLessEqual(known[-1], 2.0)  # the gains differ by more: from twenty placements on that is enough
            self.assertNotIn("\x1b", out)
            self.assert_gains(out)
            self.assertTrue(out.endswith("calibrated: it applies from now on\n"))
            shown = self.shown()
            self.assert_gains(shown)
            self.assertAlmostEqual(float(re.search(r"force scale (\d\.\d+) sd 0\.01", shown)[1]) * mean_gain, 1.11, delta=0.02)

    def test_what_cannot_be_calibrated_is_told(self):
        played, _ = make_placements("short", "--seconds", "20")
        for option, reason in (
            ("capabilities=3", "sends no pressures; flash one of scene grasp"),
            ("capabilities=4", "computes no locations"),
            ("absent=3", "sensors do not answer: 3; mend their wiring"),
            ("version=3", "version"),
            (f"play={played}", "sends no frames"),
        ):
            with self.subTest(reason), self.device(option):
                _, err = self.calibrate("--port", self.port, "--yes", status=1)
                self.assertIn(reason, err)
        with self.device(f"play={played}"):
            self.assertEqual(self.shown(), "not calibrated\n")

    def test_interrupted_leaves_it_as_it_was(self):
        with self.device("calibrated=1", GRASP, "pad=1"):
            for options, advice in ((), "set the weight down"), (("--drag", "--force", "1"), "set the object down"):
                process = self.start("calibrate", *options, "--port", self.port, "--yes")
                self.assertIn(advice, process.stdout.readline())
                process.send_signal(signal.SIGINT)
                _, err = process.communicate()
                self.assertEqual((process.returncode, err), (1, "fingertip: interrupted; the fingertip is as it was\n"))
            self.assertIn("from 30 placements", self.shown())
            self.assertEqual(self.lines_of_info("pad_tangential_scale +"), ["pad_tangential_scale    1"])

    def test_on_a_terminal_draws_the_pad_and_asks(self):
        for answer, written in ((b"n\n", False), (b"y\n", True)):
            with self.subTest(answer), self.device(f"play={placed}"):
                with Terminal(
                    self.world, [cli_case.FINGERTIP, "calibrate", "--port", self.port], {**self.environment, "TERM": "xterm-256color"}
                ) as terminal:
                    self.world.until(lambda: (terminal.look(), b"[y/N]" in terminal.output)[1])
                    terminal.type(answer)
                    status, shown = terminal.wait(), terminal.output
                text = shown.decode(errors="replace")
                self.assertIn("●", text)
                self.assertIn("○", text)
                self.assertGreater(text.rfind("\x1b[?1049l"), text.rfind("\x1b[?1049h"))
                self.assert_gains(text[text.rfind("\x1b[?1049l") :].replace("\r", ""))
                self.assertEqual(status, 0 if written else 1)
                self.assertEqual(self.shown().startswith("calibrated 20"), written)


class Drags(CalibrateTest):
    def test_finds_the_scale_within_its_sd(self):
        for name, thickness, *options in (
            ("equal gains", "12", "--seed", "32"),
            ("unequal gains", "12", "--effects", "gain=2", "--seed", "33"),
            ("another thickness than it is told", "11", "--effects", "gain=2", "--seed", "34"),
        ):
            with self.subTest(name):
                played, scenario = make_pulls(name, *options, pad=("--pad", thickness))
                out, err = self.drag("--from", played, "--dry-run")
                self.assertEqual(err, "")
                scale, sd = self.scale(out)
                self.assertLess(sd, 0.03)
                self.assertAlmostEqual(scale, scale_of_truth(played, scenario), delta=sd)

    def test_what_was_said_to_pull_is_believed(self):
        scale, sd = self.scale(self.drag("--from", pulled, "--dry-run")[0])
        # Of a larger force no touch is refused as too weak for what the sensors' past leaves uncertain.
        twice, thrice = (self.scale(self.drag("--from", pulled, "--dry-run", pull=("--force", str(n * PULL_N)))[0])[0] for n in (2, 3))
        self.assertAlmostEqual(twice, 2 * scale, delta=2 * sd)
        self.assertAlmostEqual(thrice, 1.5 * twice, delta=0.005)
        grams = f"{PULL_N / 9.80665e-3:.3f}"
        self.assertAlmostEqual(self.scale(self.drag("--from", pulled, "--dry-run", pull=("--weight", grams))[0])[0], scale, delta=0.002)

    def test_writes_the_scale_and_nothing_else_of_the_pad(self):
        with self.device(f"serial={serial}", GRASP):
            self.run_cli("pad", "--thickness", "12", "--port", self.port)
            before = self.lines_of_info("pad_(?!tangential_scale)")
            out, _ = self.drag("--from", pulled, "--yes", "--port", self.port)
            self.assertTrue(out.endswith("calibrated: it applies from now on\n"), out)
            kept = [float(line.split()[1]) for line in self.lines_of_info("pad_tangential_scale")]
            np.testing.assert_allclose(kept, self.scale(out), atol=6e-4)
            self.assertGreater(len(before), 5)
            self.assertEqual(self.lines_of_info("pad_(?!tangential_scale)"), before)

    def test_only_into_the_fingertip_and_the_pad_that_it_is_of(self):
        for options, thickness, more, reason in (
            ((f"serial={serial}", GRASP), "15", ("--yes",), "is of a pad of 12 mm"),
            ((GRASP,), "12", ("--yes",), "is of fingertip"),
            ((f"serial={serial}", GRASP), None, ("--yes",), "no pad profile; fingertip pad --thickness MM first"),
            ((f"serial={serial}", SLIP), None, ("--yes",), "reports no tangential force; flash one of scene grasp"),
            ((f"serial={serial}", GRASP), "12", (), "not written; give --yes without a terminal"),
        ):
            with self.subTest(reason), self.device(*options):
                if thickness:
                    self.run_cli("pad", "--thickness", thickness, "--port", self.port)
                before = self.lines_of_info("pad_")
                _, err = self.drag("--from", pulled, *more, "--port", self.port, status=1)
                self.assertIn(reason, err)
                self.assertEqual(self.lines_of_info("pad_"), before)

    def test_refuses_with_the_reason(self):
        for played, pull, reason in (
            (
                make_pulls("weak", "--effects", "gain=10", "--seed", "2", "--tangential", "0.05"),
                "0.15",
                r"0\.15 N is small beside .* possible error there, 0\.\d\d N: pull harder",
            ),
            (make_pulls("still", kind="placements"), str(PULL_N), "no pull was found"),
            (make_pulls("without", seconds=30, pad=()), str(PULL_N), "no pad profile; fingertip pad --thickness MM first"),
            ((pulled,), "3.8", "the readings are not those of 3.80 N"),
        ):
            self.assertRegex(self.refused("--from", played[0], "--dry-run", drag=True, pull=("--force", pull)), reason)

    def test_takes_pulls_until_it_is_good_and_writes(self):
        with self.device(f"play={pulled}", GRASP, "pad=1"):
            out, err = self.drag("--port", self.port, "--yes")
            self.assertEqual(err, "")
            self.assertRegex(out, r"^set the object down, its string slack\nrelease it, and .*\npull: hang the weight on its string\n")
            self.assertRegex(out, r"(?s)\nhold on\n.*\ntaken: take it off the pad\n.*; 7 of 8 pulls\n")
            self.assertNotIn("\x1b", out)
            self.assertIn("the force's scale is not calibrated, of which this is a multiple: once it is, do this again\n", out)
            self.assertTrue(out.endswith("calibrated: it applies from now on\n"), out)
            scale, _ = self.scale(out)
            self.assertAlmostEqual(scale, self.scale(self.drag("--from", pulled, "--dry-run")[0])[0], delta=0.02)
            self.assertAlmostEqual(float(self.lines_of_info("pad_tangential_scale +")[0].split()[1]), scale, delta=6e-4)

    def test_after_the_force_nothing_is_left_to_do(self):
        with self.device(f"play={pulled}", GRASP, "pad=1", "calibrated=1"):
            out, _ = self.drag("--port", self.port, "--yes")
            self.assertNotIn("do this again", out)

    def test_what_cannot_be_calibrated_is_told(self):
        for options, reason in (
            ((SLIP,), "reports no tangential force"),
            ((GRASP,), "no pad profile"),
            ((GRASP, "pad=1", "absent=3"), "sensors do not answer: 3"),
        ):
            with self.subTest(reason), self.device(*options):
                self.assertIn(reason, self.refused("--port", self.port, "--yes", drag=True))
        with self.device(GRASP, "pad=1"):
            self.run_cli("set", "rate=5", "--port", self.port)
            few = "5.0 frames a second are too few to see a pull hold still; fingertip set rate=max"
            self.assertIn(few, self.refused("--port", self.port, "--yes", drag=True))


class Usage(CalibrateTest):
    def test_wrong_words(self):
        for arguments, reason in (
            (("--dry-run",), "--dry-run goes with --from"),
            (("--weight", "x"), "10.2 to 5099"),
            (("--force", "0"), "0.1 to 50"),
            (("--show", "--erase"), "excludes"),
            (("--drag",), "--drag needs the pull"),
        ):
            self.assertIn(reason, self.error("calibrate", *arguments, status=2))
        self.assertIn("absent.csv", self.error("calibrate", "--from", os.path.join(self.folder, "absent.csv"), "--dry-run"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[7:]])
