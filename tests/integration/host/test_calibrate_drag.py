"""The tangential force's scale, from the twin's drags to what the fingertip keeps: usage
test_calibrate_drag.py FINGERTIP FAKE_DEVICE TIME_KEEPER TWIN PLAYER TABLES [unittest arguments]."""

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

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"))
from fingertip import files  # noqa: E402

FORCE_N, SHARE = 3.0, 0.3
PULL_N = FORCE_N * SHARE
GRASP, SLIP = "capabilities=15", "capabilities=7"


def setUpModule():
    global folder, recording, serial
    folder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
    unittest.addModuleCleanup(folder.cleanup)
    recording, _ = make_recording("good", "--gain", "2", "--seed", "31")
    serial = re.search(r"^# serial: (\S+)$", pathlib.Path(recording).read_text(encoding="utf-8"), re.M)[1]


def make_recording(name, *options, pad=("--pad", "12"), kind="drag", force_N=FORCE_N, seconds=100):
    scenario, played = (os.path.join(folder.name, name + end) for end in (".csv", ".recording.csv"))
    subprocess.run(
        [TWIN, "scenario", kind, "--force", str(force_N), "--seconds", str(seconds), *options, "-o", scenario, "--cache", TABLES],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run([PLAYER, "play", scenario, "-o", played, "--quiet", "--rate", "50", *pad], check=True, stdout=subprocess.DEVNULL)
    return played, scenario


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


class DragTest(cli_case.CliTest):
    def calibrate(self, *arguments, pull=("--force", str(PULL_N)), **options):
        return self.run_cli("calibrate", "--drag", *pull, *arguments, **options)

    def refused(self, path, *arguments, **options):
        out, err = self.calibrate("--from", path, "--dry-run", *arguments, status=1, **options)
        self.assertEqual(err.count("\n"), 1, err)
        return err

    def scale(self, text):
        found = re.search(r"^tangential scale +\S+ sd \S+ before, (\S+) sd (\S+) now$", text, re.M)
        return float(found[1]), float(found[2])


class FromRecording(DragTest):
    def test_finds_the_scale_within_its_sd(self):
        for name, thickness, *options in (
            ("equal gains", "12", "--gain", "0", "--seed", "32"),
            ("unequal gains", "12", "--gain", "2", "--seed", "33"),
            ("another thickness than it is told", "11", "--gain", "2", "--seed", "34"),
        ):
            with self.subTest(name):
                played, scenario = make_recording(name, *options, pad=("--pad", thickness))
                out, err = self.calibrate("--from", played, "--dry-run")
                self.assertEqual(err, "")
                scale, sd = self.scale(out)
                self.assertLess(sd, 0.03)
                self.assertAlmostEqual(scale, scale_of_truth(played, scenario), delta=sd)

    def test_what_was_said_to_pull_is_believed(self):
        scale, _ = self.scale(self.calibrate("--from", recording, "--dry-run")[0])
        twice, _ = self.scale(self.calibrate("--from", recording, "--dry-run", pull=("--force", str(2 * PULL_N)))[0])
        self.assertAlmostEqual(twice, 2 * scale, delta=0.005)
        grams = f"{PULL_N / 9.80665e-3:.3f}"
        self.assertAlmostEqual(
            self.scale(self.calibrate("--from", recording, "--dry-run", pull=("--weight", grams))[0])[0], scale, delta=0.002
        )
        self.assertIn("the readings are not those of 3.80 N", self.refused(recording, pull=("--force", "3.8")))

    def test_writes_the_scale_and_nothing_else_of_the_pad(self):
        with self.device(f"serial={serial}", GRASP):
            self.run_cli("pad", "--thickness", "12", "--port", self.port)
            before, _ = self.run_cli("info", "--port", self.port)
            out, _ = self.calibrate("--from", recording, "--yes", "--port", self.port)
            self.assertTrue(out.endswith("calibrated: it applies from now on\n"), out)
            scale, sd = self.scale(out)
            after, _ = self.run_cli("info", "--port", self.port)
            kept = {k: float(v) for k, v in re.findall(r"^(pad_tangential_scale\w*) +(\S+)$", after, re.M)}
            self.assertAlmostEqual(kept["pad_tangential_scale"], scale, delta=6e-4)
            self.assertAlmostEqual(kept["pad_tangential_scale_sd"], sd, delta=6e-4)
            others = lambda text: re.findall(r"^pad_(?!tangential_scale).*$", text, re.M)
            self.assertGreater(len(others(after)), 5)
            self.assertEqual(others(after), others(before))

    def test_only_into_the_fingertip_and_the_pad_that_it_is_of(self):
        for options, thickness, reason in (
            ((f"serial={serial}", GRASP), "15", "is of a pad of 12 mm"),
            ((GRASP,), "12", "is of fingertip"),
            ((f"serial={serial}", GRASP), None, "no pad profile; fingertip pad --thickness MM first"),
            ((f"serial={serial}", SLIP), None, "reports no tangential force; flash one of scene grasp"),
        ):
            with self.subTest(reason), self.device(*options):
                if thickness:
                    self.run_cli("pad", "--thickness", thickness, "--port", self.port)
                before, _ = self.run_cli("info", "--port", self.port)
                _, err = self.calibrate("--from", recording, "--yes", "--port", self.port, status=1)
                self.assertIn(reason, err)
                shown = lambda text: re.findall(r"^pad_.*$", text, re.M)
                self.assertEqual(shown(self.run_cli("info", "--port", self.port)[0]), shown(before))
        with self.device(f"serial={serial}", GRASP):
            self.run_cli("pad", "--thickness", "12", "--port", self.port)
            _, err = self.calibrate("--from", recording, "--port", self.port, status=1)
            self.assertEqual(err, "fingertip: not written; give --yes without a terminal\n")
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], r"(?m)^pad_tangential_scale +1$")

    def of_two_loads(self):
        """Pulls towards x by the known force, then towards y by a fifth more."""
        parts = []
        for share, degrees in ((SHARE, 0), (1.2 * SHARE, 90)):
            _, scenario = make_recording(f"towards {degrees}", "--gain", "0", "--tangential", f"{share:.2f},{degrees}", seconds=60)
            lines = pathlib.Path(scenario).read_text(encoding="utf-8").splitlines(keepends=True)
            first = next(i for i, line in enumerate(lines) if line[0].isdigit())
            parts.append((lines[:first], [line.split(",", 1) for line in lines[first:]]))
        later_s = float(parts[0][1][-1][0]) + 1
        rows = parts[0][1] + [(f"{float(t_s) + later_s:.3f}", rest) for t_s, rest in parts[1][1]]
        joined, played = (os.path.join(folder.name, "joined" + end) for end in (".csv", ".recording.csv"))
        pathlib.Path(joined).write_text("".join(parts[0][0]) + "".join(",".join(row) for row in rows), encoding="utf-8")
        subprocess.run([PLAYER, "play", joined, "-o", played, "--quiet", "--rate", "50", "--pad", "12"], check=True)
        return played

    def test_refuses_with_the_reason(self):
        weak, _ = make_recording("weak", "--gain", "10", "--seed", "2", "--tangential", "0.05")
        self.assertRegex(
            self.refused(weak, pull=("--force", "0.15")), r"0\.15 N is small beside .* possible error there, 0\.\d\d N: pull harder"
        )
        one_way, _ = make_recording("one way", "--gain", "0", "--tangential", f"{SHARE},0")
        self.assertIn("0 of 3 pulls along y; pull more", self.refused(one_way))
        weights, _ = make_recording("weights", "--gain", "0", "--tangential", "0.15..0.45")
        self.assertIn("use one and the same weight", self.refused(weights))
        self.assertIn("directions disagree: pulls towards +x read", self.refused(self.of_two_loads()))
        still, _ = make_recording("still", "--gain", "0", kind="placements")
        self.assertIn("no pull was found", self.refused(still))
        without, _ = make_recording("without", "--gain", "0", seconds=30, pad=())
        self.assertIn("no pad profile; fingertip pad --thickness MM first", self.refused(without))


class Live(DragTest):
    def test_takes_pulls_until_it_is_good_and_writes(self):
        with self.device(f"play={recording}", GRASP, "pad=1"):
            out, err = self.calibrate("--port", self.port, "--yes")
            self.assertEqual(err, "")
            for advice in (
                "set the object down, its string slack\n",
                "release it, and leave it alone\n",
                "pull: hang the weight on its string\n",
                "hold on\n",
                "taken: take it off the pad\n",
                "; 7 of 8 pulls\n",
            ):
                self.assertIn(advice, out)
            self.assertNotIn("\x1b", out)
            self.assertIn("the force's scale is not calibrated, of which this is a multiple: once it is, do this again\n", out)
            self.assertTrue(out.endswith("calibrated: it applies from now on\n"), out)
            scale, _ = self.scale(out)
            self.assertAlmostEqual(scale, self.scale(self.calibrate("--from", recording, "--dry-run")[0])[0], delta=0.02)
            shown, _ = self.run_cli("info", "--port", self.port)
            self.assertAlmostEqual(float(re.search(r"^pad_tangential_scale +(\S+)$", shown, re.M)[1]), scale, delta=6e-4)

    def test_after_the_force_nothing_is_left_to_do(self):
        with self.device(f"play={recording}", GRASP, "pad=1", "calibrated=1"):
            out, _ = self.calibrate("--port", self.port, "--yes")
            self.assertNotIn("do this again", out)

    def test_what_cannot_be_calibrated_is_told(self):
        for options, reason in (
            ((SLIP,), "reports no tangential force"),
            ((GRASP,), "no pad profile"),
            ((GRASP, "pad=1", "absent=3"), "sensors do not answer: 3"),
        ):
            with self.subTest(reason), self.device(*options):
                _, err = self.calibrate("--port", self.port, "--yes", status=1)
                self.assertIn(reason, err)
                self.assertEqual(err.count("\n"), 1)

    def test_too_few_frames_are_told(self):
        with self.device(GRASP, "pad=1"):
            self.run_cli("set", "rate=5", "--port", self.port)
            _, err = self.calibrate("--port", self.port, "--yes", status=1)
            self.assertIn("5.0 frames a second are too few to see a pull hold still; fingertip set rate=max", err)

    def test_interrupted_leaves_it_as_it_was(self):
        with self.device(GRASP, "pad=1"):
            process = self.start("calibrate", "--drag", "--force", "1", "--port", self.port, "--yes")
            self.assertIn("set the object down", process.stdout.readline())
            process.send_signal(signal.SIGINT)
            _, err = process.communicate()
            self.assertEqual((process.returncode, err), (1, "fingertip: interrupted; the fingertip is as it was\n"))
            self.assertRegex(self.run_cli("info", "--port", self.port)[0], r"(?m)^pad_tangential_scale +1$")


class Usage(DragTest):
    def test_wrong_words(self):
        self.assertIn("--drag needs the pull", self.error("calibrate", "--drag", status=2))
        self.assertIn("excludes", self.error("calibrate", "--drag", "--show", status=2))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[7:]])
