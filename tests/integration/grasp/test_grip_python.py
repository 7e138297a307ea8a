"""The controller from Python: the names, the tool's commands once more from its recording, and the README's program on a simulated gripper.

usage: test_grip_python.py SIMULATED_FINGERTIP FAKE_CELL TIME_KEEPER GRIP_TABLE FINGERTIP TABLES [unittest arguments]; FINGERTIP_LIBRARY
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

import numpy as np

SIMULATED, FAKE_CELL, TIME_KEEPER, GRIP_TABLE, FINGERTIP, TABLES = (os.path.abspath(path) for path in sys.argv[1:7])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import BadValueError, files, grip, grip_file  # noqa: E402
from fingertip.wire import Contact  # noqa: E402
from readme_example import environment_of, simulated  # noqa: E402
from world_case import WorldCase  # noqa: E402

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


class Replayed(WorldCase):
    TIME_KEEPER = TIME_KEEPER

    def record(self):
        """A grasp by the tool, on simulated time: it is loaded, it slides, it is let go."""
        cell = self.world.start([FAKE_CELL, self.folder], stdin=subprocess.PIPE)
        self.addCleanup(cell.wait)
        self.addCleanup(cell.kill)
        self.assertEqual(cell.readline(), "ready\n")
        self.environment["FINGERTIP_PORT"] = f"{self.folder}/left:{self.folder}/right"
        words = f"grasp --gripper {next(iter(grip.TRAITS))} --gripper-port {self.folder}/gripper -o {self.csv}".split()
        tool = self.world.start([SIMULATED, *words], env=self.environment)
        while " s  holding " not in tool.readline():
            pass
        for command, seconds in (("load 2", 1.5), ("slide 1", 0.4), ("slide 0", 2.0)):
            cell.stdin.write(command.encode() + b"\n")
            cell.readline()
            self.world.sleep(seconds)
        tool.terminate()
        tool.communicate()

    def inputs(self, rows):
        """Frames, answers and steps of the recording, in the order of time; frames come as late as the controller measured."""
        delay_us = 1e6 * np.median(rows["delay_s"])
        for finger, serial in enumerate(("AAAA", "BBBB")):
            recording = files.read_recording(self.csv, serial=serial)
            columns = np.array([recording.columns.get(name, np.zeros(len(recording.time_us))) for name in Contact._fields]).T
            for time_us, contact in zip(recording.time_us, columns):
                frame = types.SimpleNamespace(has_contact=True, host_us=time_us, t_us=0, sequence=0, contact=contact)
                yield time_us + delay_us, 0, (finger, frame)
        answers = {status_us: i for i, status_us in reversed(list(enumerate(rows["status_us"])))}
        for status_us, i in answers.items():
            answer = grip.Answer(*(rows[name][i] for name in ("width_mm", "moving", "active", "fault")), 1e-6 * status_us)
            yield rows["time_us"][i] - 1, 1, answer
        for i, time_us in enumerate(rows["time_us"]):
            yield time_us, 2, i

    def test_the_frames_of_a_grasp_give_its_commands(self):
        self.record()
        rows = grip_file.read_grip(self.csv)
        made = grip.Grip(TRAITS)
        requested, course, off_mm = False, [], []
        for time_us, kind, what in sorted(self.inputs(rows), key=lambda each: each[:2]):
            if kind == 0:
                made.take(*what)
            elif kind == 1:
                made.answer(what, 1e-6 * time_us)
            elif rows["state"][what] not in ("idle", "still"):
                requested = requested or made.request(grip.Request.GRASP)
                command, report = made.step(1e-6 * time_us)
                course.append((rows["state"][what], report.state.name.lower()))
                if rows["motion"][what] == command.motion == grip.Motion.MOVE:
                    off_mm.append(abs(command.width_mm - rows["command_mm"][what]))
        by_tool, by_python = ([name for name, _ in itertools.groupby(names)] for names in zip(*course))
        self.assertEqual(by_tool, by_python)
        self.assertLessEqual({"approach", "squeeze", "ready", "holding", "slipping"}, set(by_tool))
        # When within a step of its own the tool took a frame is not in the recording: now and then a move is one answer later.
        self.assertLess(np.percentile(off_mm, 95), 0.001)
        self.assertLessEqual(max(off_mm), 2.1 * TRAITS.step_mm)


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
    unittest.main(argv=[sys.argv[0], *sys.argv[7:]], verbosity=2)
