"""The evaluator of a pad: its steps on frames that are known, its card of simulated pads, and the command on simulated time.

usage: test_validate.py FINGERTIP SIMULATED_PAD SIMULATE TIME_KEEPER CONTACT_TABLES
"""

import contextlib
import getpass
import io
import json
import math
import os
import pathlib
import re
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np

FINGERTIP, SIMULATED_PAD, SIMULATE, TIME_KEEPER, TABLES = (os.path.abspath(path) for path in sys.argv[1:6])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import Fingertip, command, host_time, validate  # noqa: E402
from fingertip.files import PITCH_mm, SENSOR_X_mm, SENSOR_Y_mm  # noqa: E402
from fingertip.fit import firmware  # noqa: E402
from fingertip.line import Capability  # noqa: E402
from fingertip.validation import assess, protocol  # noqa: E402
from fingertip.validation.marks_fit import MARKS_MIN, fit_marks  # noqa: E402
from fingertip.validation.measure import AFTER_s, Pad, Press  # noqa: E402
from fingertip.validation.placements import Placement, Reading  # noqa: E402
from fingertip.validation.pulls import Estimate  # noqa: E402
from fingertip.validation.walk import Walk  # noqa: E402
from simulated_host_time import SimulatedHostTime  # noqa: E402
from simulated_time import SimulatedTime  # noqa: E402

os.environ["FINGERTIP_TOOL"] = FINGERTIP
SENSORS, MARKS = 15, 23
ARRAY = protocol.array_of(SENSOR_X_mm, SENSOR_Y_mm, PITCH_mm)
SERIAL = "00000000000CE110"


class Protocol(unittest.TestCase):
    def test_marks_are_on_each_sensor_and_between_each_four(self):
        marks = np.array(protocol.marks_of(ARRAY))
        self.assertEqual(len(set(map(tuple, marks))), MARKS)
        off_mm = np.hypot(marks[:, :1] - ARRAY.x_mm, marks[:, 1:] - ARRAY.y_mm)
        self.assertEqual((off_mm < 0.25).sum(axis=0).tolist(), [1] * SENSORS)
        nearest = off_mm < off_mm.min(axis=1, keepdims=True) + 0.1
        self.assertGreaterEqual(nearest.sum(axis=0).min(), 2)  # at a corner; 5 in the middle
        self.assertGreater(np.hypot(*np.diff(marks, axis=0).T).min(), 2 * PITCH_mm)

    def test_marks_of_fewer_sensors_differ(self):
        for sensors in (14, 8):
            marks = protocol.marks_of(protocol.Array(ARRAY.x_mm[:sensors], ARRAY.y_mm[:sensors], PITCH_mm))
            self.assertEqual(len(set(marks)), len(marks))

    def test_steps_are_the_same_from_their_events(self):
        marks = protocol.marks_of(ARRAY)
        steps = protocol.steps_of(marks, 312.5, 11.0, 104.5, 1.5)
        self.assertEqual(len(steps), len(protocol.steps_of(marks, 312.5, 11.0)) + len(protocol.PULLS_TOWARD_deg))
        self.assertEqual(sum(step.kind == "press" for step in steps), MARKS * protocol.TURNS)
        for step in steps:
            self.assertEqual(protocol.step_of(protocol.event_of(step)), step)
        self.assertEqual(protocol.event_of(steps[2]), "validate: press mark=1 x_mm=-9 y_mm=18")

    def test_other_events_are_no_steps(self):
        for text in (
            "gone 2026-01-01",
            "validate: dance",
            "validate: press mark=1 x_mm=3",
            "validate: press mark=0 x_mm=1 y_mm=",
            "validate: begin",
            "validate:hold",
            "validate: begin weight_g=0 skin_mm=12",
            "validate: pull toward_deg=0 height_mm=2",
            "validate: pull toward_deg=0 weight_g=0 height_mm=2",
            "",
        ):
            self.assertIsNone(protocol.step_of(text), text)


class Walking(unittest.TestCase):
    """Frames whose readings are known: a walk is led by what is set down and lifted here."""

    FRAME_s, AIR_Pa, PRESS_Pa, DRIFT_Pa_min, DRIFTS, PULLED_ON = 0.02, 101325.0, 8000.0, 30.0, 3, 8

    def begin(self, pull_g=0.0):
        self.walk = Walk(Pad(ARRAY, "", "", "", "", 0, 0, np.array([])), 300.0, 12.0, pull_g)
        self.steps, self.t_s, self.frame = [], 1.0, 0
        self.pressed_Pa = self.left_Pa = self.pulled = 0.0

    def hold(self, pressed_Pa, seconds):
        self.pressed_Pa = pressed_Pa
        self.wait(seconds)

    def wait(self, seconds):
        end_s = self.t_s + seconds
        while self.t_s < end_s:
            pressure_Pa = self.AIR_Pa + self.pressed_Pa / (1.0 + np.arange(SENSORS)) + self.left_Pa
            pressure_Pa[self.PULLED_ON] += self.pulled * self.pressed_Pa
            pressure_Pa[self.DRIFTS] += self.DRIFT_Pa_min * self.t_s / 60
            pressure_Pa += 2.0 if self.frame % 2 else -2.0  # noise: 2 Pa rms
            self.steps += self.walk.take(
                self.t_s, None, Reading(self.t_s, *[np.ones(SENSORS, bool)] * 2, pressure_Pa, np.full(SENSORS, self.AIR_Pa))
            )
            self.t_s += self.FRAME_s
            self.frame += 1

    def press(self, seconds=1.3):
        self.hold(self.PRESS_Pa, seconds)
        self.hold(0.0, 1.0)

    def go_to_pulls(self):
        self.begin(pull_g=100.0)
        self.wait(protocol.EMPTY_s + 1)
        for _ in range(MARKS * protocol.TURNS):
            self.press()
        self.press(protocol.HOLD_s + 1)
        self.wait(protocol.REST_s + 1)

    def test_it_leads_through_all_steps(self):
        self.begin()
        self.wait(protocol.EMPTY_s + 1)
        self.assertEqual(len(self.steps), 3)
        self.assertIn("mark 1, turn 1 of 2", self.walk.advice)
        for _ in range(MARKS * protocol.TURNS):
            self.press()
        self.assertIn("in the middle", self.walk.advice)
        self.hold(self.PRESS_Pa, protocol.HOLD_s + 1)
        self.assertEqual(self.walk.advice, "lift it")
        self.pressed_Pa, self.left_Pa = 0.0, 50.0
        self.wait(protocol.REST_s + 2)
        self.assertTrue(self.walk.is_done)
        self.assertEqual(self.steps, protocol.steps_of(protocol.marks_of(ARRAY), 300.0, 12.0))
        measured = self.walk.measurement.finish()
        self.assertTrue(measured.ended)
        self.assertEqual(len(measured.presses), MARKS * protocol.TURNS)
        self.assertAlmostEqual(measured.presses[0].placement.reading_Pa[1], 0.5 * self.PRESS_Pa, delta=3)
        empty, hold = measured.empty, measured.hold
        self.assertAlmostEqual(empty.seconds, protocol.EMPTY_s, delta=1.5)
        self.assertAlmostEqual(empty.drift_Pa_min[self.DRIFTS], self.DRIFT_Pa_min, delta=0.2)
        self.assertAlmostEqual(empty.drift_Pa_min[0], 0, delta=0.2)
        self.assertAlmostEqual(empty.noise_Pa[0], 2, delta=0.05)
        self.assertAlmostEqual(hold.held_s, protocol.HOLD_s + 1, delta=0.5)
        for readings_Pa in (hold.early_Pa, hold.late_Pa):
            self.assertAlmostEqual(readings_Pa[0], self.PRESS_Pa, delta=3)
        self.assertEqual(len(hold.after_Pa), len(AFTER_s))
        for left_Pa in hold.after_Pa:
            self.assertAlmostEqual(left_Pa[0], 50, delta=2)
        self.assertEqual(measured.answered.tolist(), [1] * SENSORS)

    def test_a_touch_begins_the_empty_minute_again(self):
        self.begin()
        self.wait(0.5 * protocol.EMPTY_s)
        self.press()
        self.wait(0.5 * protocol.EMPTY_s)
        self.assertEqual(len(self.steps), 2)
        self.wait(0.5 * protocol.EMPTY_s + 1)
        self.assertEqual(len(self.steps), 3)

    def test_rubber_that_recovers_is_no_press(self):
        """On thin rubber it rises by more than LIGHT_Pa after a press."""
        self.begin()
        self.wait(protocol.EMPTY_s + 1)
        for pressed_Pa in (5 * self.PRESS_Pa, 0.05 * 5 * self.PRESS_Pa):
            self.hold(pressed_Pa, 2)
            self.hold(0.0, 2)
        self.assertIn("mark 2, turn 1", self.walk.advice)
        self.assertEqual(len(self.walk.measurement.finish().presses), 1)

    def test_a_press_is_taken_back_and_asked_for_again(self):
        self.begin()
        self.wait(protocol.EMPTY_s + 1)
        self.assertEqual(self.walk.take_back(), [])
        self.press()
        self.press()
        self.assertIn("mark 3", self.walk.advice)
        self.assertEqual([(step.kind, step.mark) for step in self.walk.take_back()], [("take_back", 0), ("press", 2)])
        self.press()
        self.assertEqual([press.mark for press in self.walk.measurement.finish().presses], [1, 2])

    def test_pulls(self):
        """A weight that rests or fades is no pull; one is taken back; then one is asked for along each way."""
        self.go_to_pulls()
        self.assertEqual(self.walk.take_back(), [])  # the rest before is no press
        self.press(10)
        self.hold(self.PRESS_Pa, 3)
        self.hold(0.8 * self.PRESS_Pa, 10)
        self.hold(0.0, 2)
        self.assertEqual(self.walk.measurement.pulls, [])
        self.pressed_Pa, self.pulled = self.PRESS_Pa, 0.0
        self.wait(3)
        self.pulled = 0.2
        self.wait(2)
        self.assertEqual(len(self.walk.take_back()), 2)
        self.assertEqual(self.walk.measurement.pulls, [])
        self.pulled = 0.0
        self.hold(0.0, 2)
        for way in ("+x", "+y", "-x", "-y"):
            self.assertEqual(self.walk.advice, f"set the weight down in the middle, its thread slack towards {way}")
            self.hold(self.PRESS_Pa, 1)
            self.assertEqual(self.walk.advice, f"leave it at rest, its thread slack towards {way}")
            self.wait(2)
            self.assertEqual(self.walk.advice, f"pull: hang the other weight on the thread towards {way}")
            self.pulled = 0.2
            self.wait(0.5)
            self.assertEqual(self.walk.advice, "let it hang still")
            self.wait(1.5)
            self.assertEqual(self.walk.advice, "taken: lift it")
            self.pulled = 0.0
            self.hold(0.0, 2)
        self.assertTrue(self.walk.is_done)
        measured = self.walk.measurement.finish()
        self.assertAlmostEqual(measured.hold.held_s, protocol.HOLD_s + 1, delta=0.5)
        self.assertEqual([(pull.toward_deg, pull.weight_g) for pull in measured.pulls], [(way, 100.0) for way in protocol.PULLS_TOWARD_deg])


class MarksFit(unittest.TestCase):
    """Readings of one Gaussian with gains: places, gains, the print and the hand are known."""

    PEAK_Pa, WIDTH_mm, HAND_mm, TURN_rad = 20000.0, 5.5, 0.3, 0.03
    SHIFT_mm = np.array([0.8, -0.6])

    def presses(self):
        """And their true places, and the gains."""
        random = np.random.default_rng(7)
        gain = 1 + 0.1 * random.standard_normal(SENSORS)
        turned = np.array([[math.cos(self.TURN_rad), math.sin(self.TURN_rad)], [-math.sin(self.TURN_rad), math.cos(self.TURN_rad)]])
        presses, places = [], []
        for number, mark in enumerate(protocol.marks_of(ARRAY) * protocol.TURNS):
            at = (np.array(mark) + self.HAND_mm * random.standard_normal(2)) @ turned + self.SHIFT_mm
            square = (ARRAY.x_mm - at[0]) ** 2 + (ARRAY.y_mm - at[1]) ** 2
            reading = gain * self.PEAK_Pa * np.exp(-0.5 * square / self.WIDTH_mm**2)
            placement = Placement(10.0 * number, reading, np.ones(SENSORS, bool), np.zeros(SENSORS), 1.0, 0.0)
            presses.append(Press(number % MARKS + 1, *mark, placement, Estimate()))
            places.append(at)
        return presses, np.array(places), gain

    def test_places_gains_print_and_hand(self):
        presses, places, gain = self.presses()
        fit = fit_marks(ARRAY, presses)
        self.assertLess(np.median(np.hypot(*(fit.press_mm - places).T)), 0.05)  # a sixth of what the hand misses
        np.testing.assert_allclose(fit.shift_mm, self.SHIFT_mm, atol=0.1)
        self.assertAlmostEqual(fit.turn_rad, self.TURN_rad, delta=0.01)
        self.assertAlmostEqual(fit.hand_sd_mm, self.HAND_mm, delta=0.1)
        self.assertLess(np.hypot(*fit.slope), 0.01)
        np.testing.assert_allclose(fit.gain, gain / gain.mean(), atol=0.03)
        self.assertLess(fit.off_mm.max(), 1)
        self.assertEqual(fit.place.tolist(), list(range(SENSORS)))
        self.assertLess(fit.residual_share.max(), 0.01)

    def test_too_few_marks_are_not_solved(self):
        self.assertIsNone(fit_marks(ARRAY, self.presses()[0][: MARKS_MIN - 1]))


class ValidateTest(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-"))
        names = ("r.csv", "card.html", "card.json", "truth.json")
        self.csv, self.card, self.figures, self.truth = (os.path.join(self.folder, name) for name in names)

    def run_validate(self, *arguments, status=0):
        """Output and errors."""
        argv = mock.patch.object(sys, "argv", ["", *arguments])
        with argv, contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            ended = command.run_tool("fingertip", validate.main)
        self.assertEqual(ended, status, (arguments, out.getvalue(), err.getvalue()))
        return out.getvalue(), err.getvalue()

    def recorded(self, *options):
        """The truth; the recording is in self.csv."""
        command = [SIMULATED_PAD, "-o", self.csv, "--truth", self.truth, "--cache", TABLES, "--overwrite", *options]
        subprocess.run(command, check=True)
        return json.loads(self.read(self.truth))

    def carded(self, *options):
        """The figures, and what was printed."""
        out, err = self.run_validate("--from", self.csv, "-o", self.card, "--figures", self.figures, "--overwrite", *options)
        self.assertEqual(err, "")
        return json.loads(self.read(self.figures)), out

    def edit(self, *pairs):
        """Replaces in the recording."""
        text = self.read(self.csv)
        for before, after in pairs:
            self.assertRegex(text, before)
            text = re.sub(before, after, text)
        pathlib.Path(self.csv).write_text(text, encoding="utf-8")

    @staticmethod
    def read(path):
        return pathlib.Path(path).read_text(encoding="utf-8")


class FromARecording(ValidateTest):
    def test_a_healthy_pad_that_was_never_calibrated(self):
        truth = self.recorded("--seed", "31")
        found, out = self.carded()
        off_mm = [math.dist(*((at["x_mm"], at["y_mm"]) for at in pair)) for pair in zip(found["presses"], truth["presses"])]
        self.assertEqual(len(off_mm), MARKS * protocol.TURNS)
        self.assertAlmostEqual(found["figures"]["location_error_mm"] / statistics.median(off_mm), 1, delta=0.25)
        errors = [math.log(gain / true) for gain, true in zip(found["gain"], truth["gains"])]
        self.assertLess(statistics.pstdev(errors), 0.025)
        self.assertGreater(statistics.pstdev(map(math.log, truth["gains"])), 0.06)
        self.assertEqual(found["findings"], [])
        page = self.read(self.card)
        self.assertEqual(page.count("<figure>"), 6)
        self.assertNotRegex(page, r"<script|https?://|<link|<img")
        self.assertGreater(len(re.findall(r"<td class=\"n\">[0-9.-]+ to ", page)), 15)  # beside the figures of simulated pads
        # Most of its presses are warned, so it is no pad to rely on yet.
        self.assertGreater(found["figures"]["warned_percent"], 50)
        self.assertEqual((found["verdict"], len(found["cautions"])), ("caution", 1))
        self.assertIn("calibrate first", found["cautions"][0])
        self.assertIn('class="caution"', page)
        for text in (page, out):
            self.assertIn("calibrate first", text)
            self.assertNotIn("othing is wrong", text)
        # With a warning in each press the figures are outside of what such pads have, too.
        self.edit((r"(?m)^(\d+,\d+,\d+,)(\d+)(?=,)", lambda row: row[1] + str(int(row[2]) | 1 << 8)))
        found, out = self.carded()
        self.assertEqual(found["figures"]["warned_percent"], 100)
        self.assertRegex(found["cautions"][1], r"Outside of what .* pads have: presses with a warning 100 % \(\d+ to \d+ %\)")

    def test_a_calibrated_pad_is_good(self):
        self.recorded("--seed", "34", "--calibrated")
        found, out = self.carded()
        page = self.read(self.card)
        self.assertEqual((found["verdict"], found["cautions"]), ("good", []))
        self.assertIn("nothing is wrong that this validation can see", out)
        self.assertIn('class="good"', page)
        self.assertIn("Circles: the stored calibration", page)

    def test_faults_are_found_with_their_sensors(self):
        # dead: where the presses beside it are hardly known; loose: along an edge, at a corner, at a corner where the presses follow it; thin:
        # where presses follow a sensor that is not loose; drift: beside a sensor that is odd by the same each time
        seeds = {"dead_sensor": (32, 33, 953), "loose_sensor": (32, 38, 890), "thin_skin": (852,), "drift": (945,)}
        seeds |= dict.fromkeys(("tilted_skin", "wrong_weight", "swapped_wires"), (32,))
        for fault, seed in ((fault, seed) for fault, some in seeds.items() for seed in some):
            with self.subTest(fault=fault, seed=seed):
                truth = self.recorded("--fault", fault, "--seed", str(seed))
                found, out = self.carded()
                self.assertEqual([(one["finding"], one["sensors"]) for one in found["findings"]], [(fault, truth["faulty"])])
                self.assertEqual(found["verdict"], "faulty")
                percents = [one for key, one in found["figures"].items() if key.endswith("_percent")]
                self.assertLess(max(percents), 101)  # none that is of no use
                self.assertIn(f"{fault}: ", out)
                self.assertIn('class="find"', self.read(self.card))

    def test_pulls_are_what_is_true(self):
        truth = self.recorded("--seed", "31", "--calibrated", "--known-pad", "--plain", "--pull", "90", "--thread-height", "5")
        found, out = self.carded()
        figures = found["figures"]
        self.assertEqual(len(found["pulls"]), 4)
        self.assertAlmostEqual(figures["pull_true"], 0.3)
        self.assertAlmostEqual(figures["pull_over_thread"], 1, delta=0.08)
        aim_deg = [true["toward_deg"] - one["toward_deg"] for true, one in zip(truth["pulls"], found["pulls"])]
        self.assertLess(figures["pull_direction_deg"], math.sqrt(statistics.mean(off * off for off in aim_deg)) + 3)
        self.assertAlmostEqual(figures["pull_moves_mm"], truth["pulls"][0]["way_mm"], delta=0.1)
        self.assertEqual(found["pull_note"], "")
        self.assertIn("tangential force found over that of the thread", out)
        page = self.read(self.card)
        self.assertEqual(page.count("<figure>"), 7)
        self.assertRegex(page, r"over that of the thread, mean</td><td class=\"n\">[0-9.]+</td><td class=\"n\">[0-9.]+</td>")
        # The force is that of the weight beside a profile, too. A standard deviation above the force is of no use.
        self.assertAlmostEqual(figures["force_over_weight"], 1, delta=0.1)
        self.assertIn("pull_stated_sd", figures)
        header = re.search(r"(?m)^t_us,.*$", self.read(self.csv)).group()
        column = header.split(",").index("q_sd_N")
        self.edit((rf"(?m)^((?:[^,#\n]*,){{{column}}})\d[^,\n]*", r"\g<1>314368"))
        self.assertNotIn("pull_stated_sd", self.carded()[0]["figures"])

    def test_without_a_tangential_force_the_card_has_the_reason(self):
        self.recorded("--seed", "31", "--calibrated", "--pull", "100")
        found, out = self.carded()
        self.assertGreater(found["figures"]["pull_blind_moves_mm"], 0.5)
        self.assertNotIn("pull_over_thread", found["figures"])
        for text in (out, self.read(self.card)):
            self.assertIn("does not know its pad", text)
        self.edit(
            ("# scene: grasp", "# scene: slip"),
            (r"(?m)^# capabilities: (\d+)$", lambda line: f"# capabilities: {int(line[1]) - Capability.TANGENTIAL}"),
        )
        self.assertIn("Scene slip estimates no tangential force", self.carded()[1])

    def test_what_is_no_validation_is_refused(self):
        self.recorded("--seed", "35")
        # A pull that was not done is not seen.
        self.edit(("# event: validate: rest\n", "# event: validate: rest\n# event: validate: pull toward_deg=0 weight_g=100 height_mm=2\n"))
        found, out = self.carded()
        self.assertEqual(found["pulls"], [])
        self.assertIn("No pull was seen: leave the weight at rest for two seconds", out)
        os.unlink(self.card)
        for marks, words in (
            (r"press mark=([6-9]|[12][0-9]).*", "contains presses at 5 marks, and a card needs 6"),
            (".*", "contains no validation; record one with `fingertip validate`"),
        ):
            self.edit((f"(?m)^# event: validate: {marks}\n", ""))
            self.assertIn(words, self.run_validate("--from", self.csv, "-o", self.card, status=1)[1])
            self.assertFalse(os.path.exists(self.card))


class Command(ValidateTest):
    def test_both_templates_have_the_marks_at_1_to_1(self):
        svg, pdf = (os.path.join(self.folder, f"sheet.{kind}") for kind in ("svg", "pdf"))
        for path in (svg, pdf):  # by the tool's command, which starts the package
            done = subprocess.run([FINGERTIP, "validate", "--template", path], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("measure its line of 50 mm", done.stdout)
        text = self.read(svg)
        width_mm, _, view = re.search(r'width="([0-9.]+)mm" height="([0-9.]+)mm" viewBox="([^"]*)"', text).groups()
        self.assertEqual(float(width_mm), float(view.split()[2]))  # a unit is a millimetre
        circles = [(float(x), -float(y)) for x, y in re.findall(r'<circle cx="([^"]*)" cy="([^"]*)"', text)]
        self.assertEqual(len(set(circles)), MARKS)
        self.assertIn('d="M-25.00 26.00L25.00 26.00"', text)
        page = pathlib.Path(pdf).read_bytes()
        # The table of objects has the places where they are.
        start = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", page).group(1))
        self.assertTrue(page[start:].startswith(b"xref\n0 6\n"))
        for number, place in enumerate(re.findall(rb"(\d{10}) 00000 n ", page), 1):
            self.assertTrue(page[int(place) :].startswith(b"%d 0 obj\n" % number))
        point_mm = 25.4 / 72
        drawn = [
            (round(float(x) * point_mm - 105 - 2, 1), round(float(y) * point_mm - 148.5, 1))
            for x, y in re.findall(rb"(?m)^([0-9.]+) ([0-9.]+) m [^l\n]* c S$", page)
        ]
        self.assertEqual(sorted(drawn), sorted(circles))

    def test_usage(self):
        live = ["-o", "c.html", "--weight", "300", "--record", "r.csv"]
        for options, words in (
            ([], "give -o CARD.html, or --template"),
            (["-o", "c.html"], "give --weight GRAMS, or --from"),
            (["-o", "c.html", "--weight", "300"], "give --record FILE.csv"),
            (["--template", "a.pdf", "--weight", "300"], "--template excludes --weight; see fingertip validate --help"),
            (["--template", os.path.join(self.folder, "s.png")], "the template is a .pdf or a .svg; give such a name"),
            (["-o", "c.html", "--from", "r.csv", "--serial"], "--from excludes --serial"),
            ([*live, "--pull", "20"], "is 0.07 of the weight; give --pull from 45 to 150 grams"),
            ([*live, "--pull", "5"], '--pull: takes 10 to 1000 grams, not "5"; see fingertip validate --help'),
            ([*live, "--thread-height", "3"], "--thread-height requires --pull"),
            ([*live, "--colour", "pink"], "--colour: invalid choice: 'pink' (choose from "),
            (["--from", "r.csv", "-o", ""], "-o/--output: takes a name, and this one is empty"),
            ([*live, "--bogus"], "unrecognized arguments: --bogus; see fingertip validate --help"),
        ):
            out, err = self.run_validate(*options, status=2)
            self.assertEqual((out, err.count("\n")), ("", 1))
            self.assertTrue(err.startswith("fingertip: ") and words in err, err)
        self.assertEqual(os.listdir(self.folder), [])
        form, other = self.folder + "/form.md", self.folder + "/other.csv"
        pathlib.Path(form).touch()
        os.symlink(self.csv, other)
        for options, words in (
            (["-o", self.folder + "/no/c.html"], "there is no folder"),
            (["-o", __file__], "exists; give --overwrite"),
            (["-o", self.csv], "is named twice"),
            (["-o", self.card, "--figures", other], "other.csv: is named twice"),
            (["-o", form, "--form", form], "is named twice"),
            (["-o", self.card, "--form", "/dev/no/form.md"], "there is no folder"),
        ):
            self.assertIn(words, self.run_validate("--from", self.csv, *options, status=1)[1])
        self.assertIn("is named twice", self.run_validate("--weight", "300", "--record", self.csv, "-o", other, status=1)[1])

    def test_without_the_solver_it_states_what_to_install(self):
        with mock.patch.dict(os.environ, {"FINGERTIP_TOOL": "", "PATH": ""}):
            firmware.cache_clear()
            with self.assertRaisesRegex(assess.InputError, "the command fingertip computes this, and is not installed"):
                assess.solve_gains(ARRAY, [], 3.0)


class Live(ValidateTest):
    def rate_mHz(self):
        with Fingertip("sim:") as fingertip:
            return fingertip.info.rate_mHz

    def test_from_the_first_step_to_the_card(self):
        world = self.enterContext(SimulatedTime(TIME_KEEPER, self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-time-"))))
        self.addCleanup(host_time.use, host_time.HostTime())
        host_time.use(SimulatedHostTime(world))
        environment = {"XDG_RUNTIME_DIR": self.folder, "LC_ALL": "C.UTF-8"}
        self.enterContext(mock.patch.dict(os.environ, environment))
        self.enterContext(mock.patch("fingertip.validation.live.POLL_s", 0.2))  # each wait changes processes, which costs more than a frame
        simulate = world.start([SIMULATE, "--cache", TABLES, "--validate", "--pull", "100", "--seed", "3"])
        self.assertTrue(simulate.readline().startswith("ready: "))
        before_mHz = self.rate_mHz()
        out, err = self.run_validate("--port", "sim:", "--weight", "300", "--pull", "100", "--record", self.csv, "-o", self.card)
        self.assertEqual(self.rate_mHz(), before_mHz)
        simulate.send_signal(signal.SIGINT)
        simulate.communicate()
        self.assertEqual(err, "")
        for words in (
            "leave it alone",
            "set the weight down on mark 1, turn 1 of 2",
            "set the weight down on mark 23, turn 2 of 2",
            "lift it",
            "set the weight down in the middle, its thread slack towards +x",
            "hang the other weight on the thread towards -y",
            "location off by, median",
            "calibrate first",
        ):
            self.assertIn(words, out)
        # The recording has what was measured, and the card can be made from it again.
        recording = self.read(self.csv)
        self.assertEqual(recording.count("# event: validate: press "), MARKS * protocol.TURNS)
        self.assertEqual(recording.count("# event: validate: pull "), 4)
        for private in (SERIAL, socket.gethostname(), self.folder, "sim", "port", "started"):
            self.assertNotIn(private, re.sub("(?m)^[^#].*$", "", recording), private)
        if len(getpass.getuser()) > 4:
            self.assertNotIn(getpass.getuser(), recording)
        live = self.read(self.card)
        form = shutil.copy(ROOT / "boards/first_measurements.md", self.folder)
        figures = self.carded("--form", form)[0]["figures"]
        self.assertEqual(self.read(self.card), live)
        self.assertNotIn(SERIAL, live)
        self.assertLess(figures["hand_mm"], 0.5)
        self.assertIn(f"| noise of a reading | {figures['noise_Pa']:.1f} Pa |", self.read(form))
        self.assertNotRegex(self.read(form), r"not measured|\{\w+\}")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[6:]], verbosity=2)
