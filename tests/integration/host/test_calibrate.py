"""Calibrating, from the twin's scenario to what the fingertip keeps: usage
test_calibrate.py FINGERTIP FAKE_DEVICE TIME_KEEPER TWIN PLAYER TABLES [unittest arguments]."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

TWIN, PLAYER, TABLES = sys.argv[4:7]
import cli_case  # noqa: E402
from simulated_terminal import Terminal  # noqa: E402

GAIN_TOLERANCE = 0.02


def setUpModule():
    """One recording of good placements for all tests, the way a user would make one."""
    global folder, recording, gains, mean_gain
    folder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
    unittest.addModuleCleanup(folder.cleanup)
    recording, scenario = make_recording("good", "placements", "--gain", "10", "--seed", "6")
    errors = re.search(r"^# gain_errors_percent: (.*)$", pathlib.Path(scenario).read_text(encoding="utf-8"), re.M)
    gains = [1 + float(word) / 100 for word in errors[1].split()]
    mean_gain = sum(gains) / len(gains)
    gains = [gain / mean_gain for gain in gains]


def make_recording(name, kind, *options, raw=True, rate="40"):
    scenario, played = (os.path.join(folder.name, name + end) for end in (".csv", ".recording.csv"))
    subprocess.run([TWIN, "scenario", kind, *options, "-o", scenario, "--cache", TABLES], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(
        [PLAYER, "play", scenario, "-o", played, "--quiet", "--rate", rate, *(["--raw"] if raw else [])],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return played, scenario


def table(text):
    """Gains and their standard deviations by sensor."""
    rows = re.findall(r"^ +(\d+) +(\d\.\d{3}) +(\d+\.\d) ", text, re.M)
    return [float(row[1]) for row in rows], [float(row[2]) / 100 for row in rows]


class CalibrateTest(cli_case.CliTest):
    def calibrate(self, *arguments, **options):
        return self.run_cli("calibrate", *arguments, **options)

    def assert_gains(self, text):
        found, sds = table(text)
        self.assertEqual(len(found), len(gains))
        for k, (gain, truth, sd) in enumerate(zip(found, gains, sds)):
            self.assertAlmostEqual(gain / truth, 1, delta=GAIN_TOLERANCE, msg=f"sensor {k}")
            self.assertLess(sd, 0.03)


class FromRecording(CalibrateTest):
    def test_shows_and_writes_nothing_with_dry_run(self):
        out, err = self.calibrate("--from", recording, "--dry-run", "--force", "3")
        self.assertEqual(err, "")
        self.assert_gains(out)
        before, after = re.search(r"location off by +([\d.]+) mm +([\d.]+) mm", out).groups()
        self.assertLess(float(after), 0.5 * float(before))
        scale, sd = re.search(r"force scale +1\.000 +(\d\.\d+) +sd (\d\.\d+)", out).groups()
        # The volume of the Gaussian is 9 % less than the force.
        self.assertAlmostEqual(float(scale) * mean_gain, 1.09, delta=0.02)
        self.assertLess(float(sd), 0.03)
        out, _ = self.calibrate("--from", recording, "--dry-run", "--weight", "306")
        self.assertAlmostEqual(float(re.search(r"force scale +1\.000 +(\d\.\d+)", out)[1]), float(scale), delta=0.005)
        out, _ = self.calibrate("--from", recording, "--dry-run")
        self.assertIn("force scale         unknown", out)

    def test_writes_into_the_fingertip_it_is_of(self):
        serial = re.search(r"^# serial: (\S+)$", pathlib.Path(recording).read_text(encoding="utf-8"), re.M)[1]
        with self.device(f"serial={serial}"):
            out, _ = self.calibrate("--from", recording, "--yes", "--port", self.port)
            self.assertIn("calibrated: it applies from now on", out)
            shown, _ = self.calibrate("--show", "--port", self.port)
            self.assert_gains(shown)
            self.assertRegex(shown, r"^calibrated 20\d\d-\d\d-\d\d \d\d:\d\d UTC from \d\d placements, force scale 1.000 sd 0.100\n")
            self.assertEqual(self.calibrate("--erase", "--yes", "--port", self.port)[0], "erased: it is as if never calibrated\n")
            self.assertEqual(self.calibrate("--show", "--port", self.port)[0], "not calibrated\n")
            self.assertEqual(self.calibrate("--erase", "--yes", "--port", self.port)[0], "not calibrated\n")
        with self.device("serial=0123456789ABCDEF"):
            _, err = self.calibrate("--from", recording, "--yes", "--port", self.port, status=1)
            self.assertIn("is of fingertip", err)
            self.assertEqual(self.calibrate("--show", "--port", self.port)[0], "not calibrated\n")

    def test_finds_the_thickness_and_says_where_another_was_told(self):
        serial = re.search(r"^# serial: (\S+)$", pathlib.Path(recording).read_text(encoding="utf-8"), re.M)[1]
        write = ("--from", recording, "--yes", "--port", self.port)
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
        with self.device(f"serial={serial}"):
            out, err = self.calibrate(*write)
            self.assertNotIn("profile of a pad", out)

    def test_is_asked_before(self):
        serial = re.search(r"^# serial: (\S+)$", pathlib.Path(recording).read_text(encoding="utf-8"), re.M)[1]
        with self.device(f"serial={serial}"):
            _, err = self.calibrate("--from", recording, "--port", self.port, status=1)
            self.assertEqual(err, "fingertip: not written; give --yes without a terminal\n")
            self.assertEqual(self.calibrate("--show", "--port", self.port)[0], "not calibrated\n")
        with self.device("calibrated=1"):
            _, err = self.calibrate("--erase", "--port", self.port, status=1)
            self.assertEqual(err, "fingertip: not erased; give --yes without a terminal\n")
            self.assertIn("from 30 placements", self.calibrate("--show", "--port", self.port)[0])

    def test_refuses_with_the_reason(self):
        for name, options, reason in (
            ("weights", ("placements", "--gain", "10", "--force", "2.5,3.5"), "use one and the same weight"),
            ("cube", ("placements", "--indenter", "cube6", "--force", "12", "--layer", "12", "--seconds", "30"), "too few placements"),
            ("hand", ("pokes", "--gain", "10"), "no placement was found"),
            ("middle", ("placements", "--margin", "0", "--seconds", "100"), "are only known to 1."),
        ):
            with self.subTest(name):
                played, _ = make_recording(name, *options)
                _, err = self.calibrate("--from", played, "--dry-run", status=1)
                self.assertIn("fingertip: not calibrated: ", err)
                self.assertIn(reason, err)

    def test_a_recording_without_pressures_is_told(self):
        played, _ = make_recording("without", "placements", "--seconds", "10", raw=False)
        _, err = self.calibrate("--from", played, "--dry-run", status=1)
        self.assertRegex(err, "has no pressures to calibrate from; record with a firmware that sends them")


class Live(CalibrateTest):
    def test_takes_placements_until_it_is_good_and_writes(self):
        with self.device(f"play={recording}"):
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
            shown, _ = self.calibrate("--show", "--port", self.port)
            self.assert_gains(shown)
            self.assertAlmostEqual(float(re.search(r"force scale (\d\.\d+) sd 0\.01", shown)[1]) * mean_gain, 1.11, delta=0.02)

    def test_what_cannot_be_calibrated_is_told(self):
        for options, reason in (
            (("capabilities=3",), "sends no pressures; flash one of scene grasp"),
            (("capabilities=4",), "computes no locations"),
            (("absent=3",), "sensors do not answer: 3; mend their wiring"),
            (("version=3",), "version"),
        ):
            with self.subTest(reason), self.device(*options):
                _, err = self.calibrate("--port", self.port, "--yes", status=1)
                self.assertIn(reason, err)
                self.assertEqual(err.count("\n"), 1)

    def test_no_more_frames_is_no_calibration(self):
        played, _ = make_recording("short", "placements", "--seconds", "20")
        with self.device(f"play={played}"):
            _, err = self.calibrate("--port", self.port, "--yes", status=1)
            self.assertIn("sends no frames", err)
            self.assertEqual(self.calibrate("--show", "--port", self.port)[0], "not calibrated\n")

    def test_interrupted_leaves_it_as_it_was(self):
        with self.device("calibrated=1"):
            process = self.start("calibrate", "--port", self.port, "--yes")
            self.assertIn("set the weight down", process.stdout.readline())
            process.send_signal(signal.SIGINT)
            _, err = process.communicate()
            self.assertEqual((process.returncode, err), (1, "fingertip: interrupted; the fingertip is as it was\n"))
            self.assertIn("from 30 placements", self.calibrate("--show", "--port", self.port)[0])

    def test_on_a_terminal_draws_the_pad_and_asks(self):
        for answer, written in ((b"n\n", False), (b"y\n", True)):
            with self.subTest(answer), self.device(f"play={recording}"):
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
                self.assertEqual(self.calibrate("--show", "--port", self.port)[0].startswith("calibrated 20"), written)


class Usage(CalibrateTest):
    def test_wrong_words(self):
        for arguments, reason in (
            (("--dry-run",), "--dry-run goes with --from"),
            (("--weight", "x"), "10.2 to 5099"),
            (("--force", "0"), "0.1 to 50"),
            (("--force", "3", "--weight", "300"), "excludes"),
            (("--show", "--erase"), "excludes"),
        ):
            self.assertIn(reason, self.error("calibrate", *arguments, status=2))
        self.assertIn("absent.csv", self.error("calibrate", "--from", os.path.join(self.folder, "absent.csv"), "--dry-run"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[7:]])
