"""The controller from Python: the names, what it takes and gives, and the README's program on a simulated gripper.

usage: test_grip_python.py GRIP_TABLE FINGERTIP TABLES [unittest arguments]; FINGERTIP_LIBRARY
"""

import dataclasses
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest

GRIP_TABLE, FINGERTIP, TABLES = (os.path.abspath(path) for path in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import BadValueError, Flag, grip  # noqa: E402
from fingertip.wire import Contact  # noqa: E402
from readme_example import environment_of, simulated  # noqa: E402

PATIENCE_s = 200
TRAITS = next(iter(grip.TRAITS.values()))


class Names(unittest.TestCase):
    def test_the_table_is_that_of_the_sources(self):
        written = (ROOT / "host_tools/python/fingertip/grip_table.py").read_text(encoding="utf-8")
        self.assertEqual(subprocess.run([GRIP_TABLE], capture_output=True, text=True, check=True).stdout, written)

    def test_settings(self):
        made = grip.Grip(TRAITS, grip.Settings(mass_kg=0.5))
        self.assertEqual((made.setting("mass_kg"), made.setting("cap_N")), (0.5, 21.0))
        for field in dataclasses.fields(grip.Settings):
            self.assertGreaterEqual(made.setting(field.name), 0)
        self.assertRaisesRegex(BadValueError, "no setting grip_N", made.setting, "grip_N")
        made.set(grip.Settings(cap_N=30))
        self.assertEqual((made.setting("mass_kg"), made.setting("cap_N")), (0.5, 30.0))
        for wrong, words in (
            ({"cap_N": 200}, "cap_N is not possible; give 0.5 to 100 N"),
            ({"start_N": 31}, "start_N .* above cap_N"),
            ({"decay_1_s": 21}, "decay_1_s .* 0 to 20$"),
        ):
            self.assertRaisesRegex(BadValueError, words, made.set, grip.Settings(**wrong))
        self.assertRaisesRegex(BadValueError, "mode", made.set, grip.Settings(set_N=3))
        self.assertRaisesRegex(BadValueError, "traits", grip.Grip, grip.Traits(*[0.0] * 9))
        self.assertEqual(made.setting("cap_N"), 30.0)

    def test_a_command_that_may_be_lost_is_sent_again(self):
        made, moves, answers = grip.Grip(TRAITS), [], [grip.Answer(50.0)]
        gripper = types.SimpleNamespace(poll=lambda: answers[-1], move=lambda *command: moves.append(command))
        made.request(grip.Request.GRASP)
        for i in range(42):
            made.drive(gripper, 1 + 0.01 * i)
        self.assertEqual((len(moves), len(set(moves))), (5, 1))
        answers.append(grip.Answer(50.0, fault=256))
        for i in range(3):
            self.assertEqual(made.drive(gripper, 2 + 0.01 * i).gripper_fault, 255)
        self.assertEqual(made.drive(gripper, 3).state, grip.State.FAULT)

    def test_a_frame_is_the_contact_that_it_has(self):
        """What the controller makes of it: unit.grasp.grip_c."""
        made = grip.Grip(TRAITS)
        contact = Contact(*[0] * len(Contact._fields))._replace(
            sigma_mm=3.0, flags=int(Flag.CONTACT | Flag.FIT_VALID | Flag.TARED), force_N=3.25
        )
        frame = types.SimpleNamespace(has_contact=True, host_us=2e6, t_us=7, sequence=70000, contact=contact)
        made.take(1, frame)
        for ignored in ({"has_contact": False}, {"host_us": float("nan")}):
            made.take(0, types.SimpleNamespace(**vars(frame) | ignored))
        report = made.step(2.015)[1]
        self.assertEqual(report.finger_N[0], 0.0)
        self.assertAlmostEqual(report.finger_N[1], 3.25, places=6)
        self.assertAlmostEqual(report.delay_s, 0.015)


class Example(unittest.TestCase):
    # real time: `fingertip simulate`, and the program as people run it, on pseudo-terminals

    def test_the_program_of_the_readme_holds_and_opens(self):
        folder = self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-"))
        environment = environment_of(folder) | {"FINGERTIP_LIBRARY": os.environ["FINGERTIP_LIBRARY"]}
        text = (ROOT / "host_tools/python/README.md").read_text(encoding="utf-8")
        program = next(code for code in re.findall(r"```python\n(.*?)```", text, re.S) if "class HandE" in code)
        self.assertIn("/dev/ttyUSB0", program)
        program = program.replace("/dev/ttyUSB0", f"{folder}/fingertip/simulated/gripper")
        with simulated(FINGERTIP, environment, "--lift", "--gripper", "hande", "--then", "lower:1@1", "--cache", TABLES):
            done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, timeout=PATIENCE_s)
        self.assertEqual(done.returncode, 0, done.stderr)
        states = [line.split()[0] for line in done.stdout.splitlines()]
        for earlier, later in itertools.pairwise("APPROACH SQUEEZE READY HOLDING PLACING RELEASE OPEN".split()):
            self.assertLess(states.index(earlier), states.index(later), done.stdout)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
