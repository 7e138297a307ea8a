"""fingertip grasp against simulated fingertips and a simulated gripper, on simulated time.

usage: test_grasp.py FINGERTIP FAKE_CELL TIME_KEEPER [unittest arguments]
"""

import contextlib
import itertools
import os
import pathlib
import signal
import subprocess
import sys
import unittest
from unittest import mock

import numpy as np

FINGERTIP, FAKE_CELL, TIME_KEEPER = (os.path.abspath(path) for path in sys.argv[1:4])
PLOT_PATIENCE_s = 300
PYTHON_TOOLS = pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"
sys.path[:0] = [str(PYTHON_TOOLS), str(pathlib.Path(__file__).resolve().parents[2] / "support")]
from fingertip import FingertipError, files, grip_file, host_time  # noqa: E402
from fingertip.running_grasp import RunningGrasp  # noqa: E402
from simulated_host_time import SimulatedHostTime  # noqa: E402
from small_disk import disk_of  # noqa: E402
from simulated_terminal import Terminal  # noqa: E402
from world_case import WorldCase  # noqa: E402

MISSED, DROPPED, FAULT = 3, 4, 5
# A load of 2 N on both pads at the friction that is taken before any slide.
HOLDS_2_N = 1 / 0.5


class GraspTest(WorldCase):
    TIME_KEEPER = TIME_KEEPER

    def setUp(self):
        super().setUp()
        self.environment["FINGERTIP_PORT"] = f"{self.folder}/left:{self.folder}/right"

    @contextlib.contextmanager
    def cell(self):
        self.simulated = self.world.start([FAKE_CELL, self.folder], stdin=subprocess.PIPE)
        try:
            self.assertEqual(self.simulated.readline(), "ready\n")
            yield
        finally:
            self.simulated.kill()
            self.simulated.wait()

    def tell(self, command="truth"):
        """Opening in mm and force on either pad in N, as they are."""
        self.simulated.stdin.write(command.encode() + b"\n")
        return tuple(float(word) for word in self.simulated.readline().split())

    def steady(self):
        """What tell() tells once the gripper has come to rest."""
        told = [()]

        def rests():
            before, told[0] = told[0], self.tell()
            return before == told[0]

        self.world.until(rests, step_s=0.5)
        return told[0]

    ARGUMENTS = ("grasp", "--gripper", "2f85", "--gripper-port")

    def start(self, *arguments, **options):
        return self.world.start([FINGERTIP, *self.ARGUMENTS, f"{self.folder}/gripper", *arguments], env=self.environment, **options)

    def holding(self, *arguments, **options):
        process = self.start(*arguments, **options)
        self.until_state(process, "holding")
        return process

    def run_grasp(self, *arguments, status=0, **options):
        return self.run_cli(*self.ARGUMENTS, f"{self.folder}/gripper", *arguments, status=status, **options)

    def run_cli(self, *arguments, status=0, **options):
        ended, out, err = self.world.run([FINGERTIP, *arguments], env=self.environment, **options)
        self.assertEqual(ended, status, (out, err))
        return out, err

    def until_state(self, process, state):
        """Lines of standard output up to the one that tells this state."""
        return self.lines_until(process, f" s  {state} ")

    def lines_until(self, process, words, limit_s=60):
        """The same, up to the line with these words, within so much of the world's time."""
        lines, end_s = [], self.world.now_s + limit_s
        while self.world.now_s < end_s and (line := process.readline()):
            lines.append(line)
            if words in line:
                return lines
        self.fail((words, lines, process.read("stderr")))

    def rows(self):
        return grip_file.read_grip(self.csv)

    def events(self):
        lines = files.read_lines(self.csv)
        return [line.split(",", 1)[1] for line in lines if line.startswith("# grip_event: ")]


class Usage(GraspTest):
    def test_limits_are_checked_before_a_port_is_opened(self):
        for arguments, words in (
            (("--cap", "0.1"), '--cap "0.1" is not possible; give N, 0.5 to 100'),
            (("--margin", "x"), "give 1 to 5"),
            (("--preset", "anvil"), "no preset anvil; there are egg, strawberry, cup"),
            (("--open-width", "90"), "2f85 opens to 85.0 mm"),
        ):
            _, err = self.run_grasp(*arguments, status=2)
            self.assertIn(words, err)
        err = self.run_cli("grasp", "--gripper", "claw", "--gripper-port", "x", status=2)[1]
        self.assertIn("no gripper model claw; there are 2f85, ", err)
        self.assertIn("of grasp, --gripper-port", self.run_cli("gripper", "info", "--model", "2f85", status=2)[1])

    def test_two_fingertips_are_needed_and_two_different_ones(self):
        self.environment["FINGERTIP_PORT"] = ""
        self.assertIn("two fingertips", self.run_grasp(status=1)[1])
        with self.cell():
            left = f"{self.folder}/left"
            self.assertIn("name the same fingertip", self.run_grasp("--left", left, "--right", left, status=2)[1])
            os.symlink(left, f"{self.folder}/again")
            self.run_grasp("--left", left, "--right", f"{self.folder}/again", status=1)
            self.environment["FINGERTIP_PORT"] = f"{self.folder}/left:{self.folder}/right"
            _, err = self.run_grasp("--left", "BBBB", "--seconds", "0.2", "-o", self.csv)
            self.assertEqual(files.recorded_devices(self.csv), ["BBBB", "AAAA"])
            self.assertIn("no fingertip CCCC", self.run_grasp("--right", "CCCC", status=1)[1])

    def test_a_gripper_that_is_not_active_is_activated_only_when_asked(self):
        with self.cell():
            for command in ("power 0", "power 1", "object 0"):
                self.tell(command)
            _, err = self.run_grasp(status=1)
            self.assertIn("not active", err)
            self.assertIn("--activate", err)
            process = self.start("--activate")
            self.until_state(process, "approach")
            self.tell("object 40")
            self.until_state(process, "holding")
            process.terminate()
            self.assertEqual(process.wait(), 0)

    def test_what_is_not_there_is_said(self):
        with self.cell():
            process = self.start("--seconds", "0.1")
            process.communicate()
            os.unlink(f"{self.folder}/gripper")
            self.assertIn("no such port", self.run_grasp(status=1)[1])
        with self.cell():
            self.tell("line silent")
            self.assertIn("no answer", self.run_grasp(status=1)[1])
            self.tell("line none")
            self.tell("fault 8")
            self.assertIn("fault", self.run_grasp(status=1)[1])


class Course(GraspTest):
    def test_holds_until_the_end_is_asked_for_and_then_opens_when_told_to(self):
        with self.cell():
            process = self.holding()
            self.tell("load 2")
            self.world.until(lambda: self.tell()[1] > HOLDS_2_N)
            process.terminate()
            out, err = process.communicate()
            self.assertEqual(process.returncode, 0, err)
            self.assertRegex(err, r"holding; the gripper keeps its position, 3\d\.\d mm")
            self.assertGreater(self.steady()[1], HOLDS_2_N)
            # and the next grasp takes up what is held
            process = self.start()
            lines = self.until_state(process, "holding")
            self.assertNotIn("approach", "".join(lines))
            process.terminate()
            process.wait()
            self.assertGreater(self.tell()[1], 1)

    def test_a_set_force(self):
        with self.cell():
            process = self.start("--fixed", "4", "-o", self.csv, "--quiet")
            while " s  holding " not in process.readline("stderr"):
                self.assertIsNone(process.poll())
            self.world.until(lambda: abs(self.tell()[1] - 4) < 0.5)
            process.terminate()
            out, err = process.communicate()
            self.assertEqual((process.returncode, out), (0, ""), err)
            self.assertIn("frames of 2 fingertips", err)

    def test_nothing_between_is_missed(self):
        with self.cell():
            self.tell("object 0")
            out, err = self.run_grasp("--approach", "8", status=MISSED)
            self.assertIn("nothing was there", err)

    def test_ctrl_c_holds_and_the_second_opens_slowly(self):
        with self.cell():
            process = self.holding("-o", self.csv, "--open-width", "45")
            self.world.sleep(0.137)  # anywhere between two of its lines
            asked_s = self.world.now_s
            process.send_signal(signal.SIGINT)
            lines = self.lines_until(process, "Ctrl-C: the width stays; again: opens slowly")
            self.assertLessEqual(self.world.now_s - asked_s, 0.1)
            self.assertIn(" s  still ", lines[-1])  # with the first line that tells of it
            width = self.steady()[0]
            self.tell("load 5")
            self.assertEqual(self.steady()[0], width)
            self.assertIsNone(process.poll())
            process.send_signal(signal.SIGINT)
            out, err = process.communicate()
            self.assertEqual(process.returncode, 0, err)
            self.assertGreater(self.tell()[0], 43)
        rows = self.rows()
        # slowly: 10 mm/s
        opening = rows["state"] == "release"
        t_s = rows["time_us"][opening] / 1e6
        self.assertGreater(t_s[-1] - t_s[0], 0.2)

    def test_a_kill_keeps_the_gripper_where_it_was(self):
        with self.cell():
            process = self.holding("-o", self.csv)
            process.kill()
            process.wait()
            self.assertGreater(self.steady()[1], 0.5)
            recording = files.read_recording(self.csv, serial="AAAA", salvage=True)
            self.assertGreater(len(recording["t_us"]), 50)
            self.assertEqual(recording.end, {})

    def test_another_program_asks(self):
        with self.cell():
            process = self.holding("--quiet", "-o", self.csv, stderr=subprocess.STDOUT)
            self.tell("load 2")
            self.steady()
            host_time.use(SimulatedHostTime(self.world))
            self.enterContext(mock.patch.dict(os.environ, self.environment))
            grasp = RunningGrasp("AAAA")
            self.addCleanup(grasp.close)
            report = grasp.report()
            self.assertEqual((report["state"], report["load_N"][:3]), ("holding", "1.0"))
            before_N = self.steady()[1]
            grasp.ask("mass=1.5")
            firm_N = self.steady()[1]
            self.assertGreater(firm_N, 1.5 * before_N)
            for line, words in (
                ("cap=5 grasp", "cannot be while it is holding"),
                ("cap=500", "cap is not possible"),
                ("nonsense", "nonsense"),
            ):
                self.assertRaisesRegex(FingertipError, words, grasp.ask, line)
            self.assertAlmostEqual(self.steady()[1], firm_N, delta=0.5)  # all of it or nothing
            grasp.ask("mass=0 place")
            self.assertRaisesRegex(FingertipError, "cannot be while it is placing", grasp.ask, "place")
            self.assertEqual(grasp.states(), ["placing"])
            self.tell("load 0")
            self.until_state(process, "open")
            process.terminate()
            self.assertEqual(process.wait(), 0)
        self.assertIn("request mass=0 place", self.events())


class Trouble(GraspTest):
    """Nothing of this opens the gripper or tightens it."""

    def hold(self, *arguments):
        process = self.holding("-o", self.csv, *arguments)
        self.tell("load 1")
        self.world.sleep(2)  # down from the start force
        self.assertGreater(self.steady()[1], 0.9)
        return process

    def finish(self, process, status=0):
        process.terminate()
        out, err = process.communicate()
        self.assertEqual(process.returncode, status, err)
        return out, err

    def failed(self, process):
        _, err = process.communicate()
        self.assertEqual(process.returncode, FAULT, err)
        return err

    def assert_stays(self, seconds=0.7):
        width = self.tell()[0]
        self.world.sleep(seconds)
        self.assertAlmostEqual(self.tell()[0], width, delta=0.8)

    def test_a_fingertip_is_unplugged_while_it_holds_and_comes_back(self):
        with self.cell():
            process = self.hold()
            self.tell("unplug left")
            self.lines_until(process, "left: no frames")
            self.assert_stays()
            self.tell("unplug right")
            self.lines_until(process, "right: no frames")
            self.world.sleep(0.5)
            self.tell("load 9")
            self.assert_stays()
            self.tell("load 1")
            self.tell("plug left")
            self.tell("plug right")
            while "no frames" in process.readline():
                pass
            self.assertGreater(self.tell()[1], 0.8)
            self.world.until(lambda: len(files.read_recording(self.csv, serial="AAAA").events) == 2, step_s=0.5)  # went, came back
            self.finish(process)

    def test_a_fingertip_is_unplugged_while_it_opens(self):
        with self.cell():
            process = self.hold()
            process.send_signal(signal.SIGINT)
            self.until_state(process, "still")
            self.tell("unplug left")
            self.tell("unplug right")
            process.send_signal(signal.SIGINT)
            process.communicate()
            self.assertGreater(self.tell()[0], 83)

    def test_an_object_that_falls_is_dropped(self):
        with self.cell():
            process = self.hold()
            self.tell("object 1")
            out, err = process.communicate()
            self.assertEqual(process.returncode, DROPPED, err)
            self.assertIn("nothing is between the fingertips any more", err)

    def test_a_gripper_unplugged_to_the_end_is_a_fault(self):
        with self.cell():
            process = self.hold()
            self.tell("unplug gripper")
            self.lines_until(process, "the gripper does not answer")
            _, err = self.finish(process, FAULT)
            self.assertRegex(err, "the gripper does not answer: .*gripper: (gone|no such port)")

    def test_a_fault_that_is_over_is_named_at_the_end_and_in_the_recording(self):
        with self.cell():
            process = self.hold()
            self.tell("fault 14")
            self.until_state(process, "fault")
            self.tell("fault 0")
            err = self.failed(process)
            self.assertIn("fault; the width stays", err)
            self.assertRegex(err, "(?m)^the gripper failed: fault 14, too much current; needs activation; ")
            self.assertGreater(self.tell()[1], 0.8)
        self.assertTrue(any("the gripper failed: fault 14, too much current" in text for text in self.events()))
        rows = self.rows()
        self.assertEqual(set(rows["fault"][rows["state"] == "fault"]), {14})
        self.assertEqual(rows["active"][-1], 1)

    def test_a_gripper_that_lost_its_power_is_named(self):
        with self.cell():
            process = self.hold()
            self.tell("power 0")
            self.tell("power 1")
            self.assertRegex(self.failed(process), "(?m)^the gripper failed: it is not active any more: it lost its power, or was reset$")

    def test_a_program_that_stands_for_two_seconds_goes_on(self):
        """A machine that stops one of them: the gripper reports a second without a command, and takes commands as before."""
        with self.cell():
            process = self.hold()
            for stopped in (process, self.simulated):
                stopped.hold_up(2)
                self.world.sleep(3)
                self.assertIsNone(process.poll(), process.communicate() if process.poll() is not None else "")
                self.tell("load 2")
                self.world.until(lambda: self.tell()[1] > HOLDS_2_N)
                self.tell("load 1")
            self.finish(process)
        self.assertIn("gripper: no command for a second", self.events())
        self.assertNotIn("fault", set(self.rows()["state"]))

    def test_a_full_disk_ends_the_recording_and_not_the_grasp(self):
        with self.cell():
            process = self.holding("-o", self.csv, preexec_fn=disk_of(600000))
            self.lines_until(process, "not recorded any more")
            self.tell("load 2")
            self.world.until(lambda: self.tell()[1] > HOLDS_2_N)
            _, err = self.finish(process, 1)
            self.assertIn("make room", err)
            self.assertGreater(self.tell()[1], HOLDS_2_N)
        self.assertGreater(len(files.read_recording(self.csv, serial="BBBB")["t_us"]), 20)


class Recorded(GraspTest):
    """One grasp, looked at by everything that reads recordings."""

    def record(self):
        with self.cell():
            process = self.holding("-o", self.csv)
            self.tell("load 2")
            self.assertGreater(self.steady()[1], HOLDS_2_N)
            self.tell("slide 1")
            self.until_state(process, "slipping")
            self.tell("slide 0")
            self.until_state(process, "holding")
            self.world.sleep(0.5)
            self.truth = self.tell()
            process.send_signal(signal.SIGINT)
            self.until_state(process, "still")
            process.terminate()
            self.assertEqual(process.wait(), 0)

    def test_everything_reads_it(self):
        self.record()
        rows = self.rows()
        # every state in its order, at least every 10 ms and a little
        states = [str(state) for i, state in enumerate(rows["state"]) if i == 0 or state != rows["state"][i - 1]]
        for earlier, later in itertools.pairwise("idle approach squeeze ready holding slipping still".split()):
            self.assertLess(states.index(earlier), len(states) - 1 - states[::-1].index(later), states)
        # in order with the rows of both fingertips
        lines = [line.removeprefix("# grip: ") for line in files.read_lines(self.csv)]
        times_us = [float(line.split(",")[line[:2] in ("0,", "1,")]) for line in lines if line[:1].isdigit()]
        self.assertGreater(len(times_us), len(rows["time_us"]) + 500)
        self.assertTrue((np.diff(times_us) >= 0).all())
        self.assertLess(np.median(np.diff(rows["time_us"])), 10500)
        self.assertAlmostEqual(rows["width_mm"][-1], self.truth[0], delta=0.6)
        self.assertGreater(rows["load_N"].max(), 0.8)
        self.assertGreater(rows["margin"].max(), 1)
        # on the same clock as the fingertips
        left, right = (files.read_recording(self.csv, serial=serial) for serial in ("AAAA", "BBBB"))
        for recording in (left, right):
            self.assertEqual(recording.end["dropped_packets"], "0")
            touched_us = recording.time_us[recording.flag(files.CONTACT)][0]
            squeezed_us = rows["time_us"][rows["state"] == "squeeze"][0]
            self.assertLess(abs(touched_us - squeezed_us), 1.5e6)
        self.assertEqual(left.metadata["grasp_mode"], "hold")
        self.assertEqual(left.metadata["grasp_cap"], "21 N")
        self.assertRegex(left.metadata["grasp_gripper"], "2f85 .*gripper, ")
        self.assertTrue(any("grasp" in text for text in self.events()), self.events())

        out, _ = self.run_cli("replay", self.csv, "--speed", "max")
        self.assertRegex(out, r" s  still  width 3\d\.\d mm")
        self.assertRegex(out, r"AAAA: \d+ frames in")
        converted = os.path.join(self.folder, "one.csv")
        self.run_cli("convert", self.csv, "--device", "BBBB", converted)
        self.assertTrue(np.array_equal(files.read_recording(converted)["t_us"], right["t_us"]))
        # the line of the manual
        plain = subprocess.run(["sed", "-n", "s/^# grip: //p", self.csv], capture_output=True, text=True, check=True).stdout.splitlines()
        self.assertEqual(len(plain), len(rows["time_us"]) + 1)
        self.assertTrue(plain[0].startswith("time_us,state,trouble,width_mm,"))

        picture = os.path.join(self.folder, "grasp.png")

        def plot(*options, status=0):
            words = [sys.executable, PYTHON_TOOLS, "plot", self.csv, *options, "-o", picture, "--overwrite"]
            done = subprocess.run(words, capture_output=True, text=True, env=self.environment, timeout=PLOT_PATIENCE_s)
            self.assertEqual(done.returncode, status, done.stderr)
            return done.stdout + done.stderr

        self.assertRegex(plot(), r"grasp\.png: 1 slide, held by at most \d+\.\d N, at last still")
        with open(picture, "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
        self.assertIn("frames in", plot("--device", "AAAA"))
        self.assertIn("nothing of the grasp from --from to --to", plot("--from", "10000", status=1))

        # what is damaged is named, and salvaged
        text = pathlib.Path(self.csv).read_text(encoding="utf-8")
        number = text[: text.index("# grip: ", text.index(",holding,") - 40)].count("\n") + 1
        for state in ("placing", "handing"):
            pathlib.Path(self.csv).write_text(text.replace(",holding,", f",{state},", 1), encoding="utf-8")
            self.assertIn(state, grip_file.read_grip(self.csv)["state"])
        pathlib.Path(self.csv).write_text(text.replace(",holding,", ",hodling,", 1), encoding="utf-8")
        _, err = self.run_cli("replay", self.csv, "--speed", "max", status=1)
        self.assertRegex(err, rf':{number}: state is "hodling"; use --salvage')
        self.run_cli("replay", self.csv, "--speed", "max", "--salvage")
        with self.assertRaisesRegex(files.InputError, rf":{number}: "):
            grip_file.read_grip(self.csv)
        self.assertEqual(len(grip_file.read_grip(self.csv, salvage=True)["time_us"]), len(rows["time_us"]) - 1)


class Live(GraspTest):
    def on_terminal(self, *arguments, steps, size=(80, 24)):
        """Each step: what the screen shows before the keys are typed. Exit status; self.shown is the last screen."""
        with Terminal(
            self.world, [FINGERTIP, *arguments], {**self.environment, "COLORTERM": "truecolor", "TERM": "xterm"}, size
        ) as terminal:
            for pattern, action in steps:
                terminal.until(pattern)
                action() if callable(action) else terminal.type(action)
            status = terminal.wait()
            self.shown, self.output = terminal.shown, terminal.output
        return status

    def test_shows_both_pads_and_the_gripper_and_obeys_keys(self):
        for size in ((80, 24), (160, 50)):
            with self.cell():
                status = self.on_terminal(
                    *(*self.ARGUMENTS, f"{self.folder}/gripper", "-o", self.csv, "--overwrite"),
                    size=size,
                    steps=[
                        (r"HOLDING.*wanted +\d\.\d\d N", lambda: self.tell("load 2")),
                        (r"load +1\.0\d N .*margin +\d\.\d\d", lambda: None),
                        (r"q end, holding  o open  h hold  g grasp", b"h"),
                        (r"STILL", b"g"),
                        (r"HOLDING", b"o"),
                        (r"RELEASE", b"h"),
                        (r"STILL", b"q"),
                    ],
                )
            self.assertEqual(status, 0)
            words = "left ● AAAA/right ● BBBB/width/cap  21.0 N/slides/friction/SLIP left/grasp  2f85/kPa/force / N┤/0 s"
            for word in words.split("/"):
                self.assertIn(word, self.shown)
            after = self.output[self.output.rfind(b"\x1b[?1049l") + 8 :].decode()
            self.assertNotIn("\x1b", after)
            self.assertIn("the gripper keeps its position", after)
            status = self.on_terminal(
                "replay",
                self.csv,
                size=size,
                steps=[
                    (r"grasp  2f85.*left ● AAAA.*space pause", b" "),
                    ("PAUSED", b"\x1b[F"),
                    (r"STILL.*PAUSED", b"\x1b[H"),
                    (r"IDLE.*PAUSED at 0", b"q"),
                ],
            )
            self.assertEqual(status, 0)

    def test_pasted_text_and_a_terminals_answers_are_no_keys(self):
        with self.cell():
            status = self.on_terminal(
                *self.ARGUMENTS,
                f"{self.folder}/gripper",
                steps=[("HOLDING", b"\x1b[200~ohoq\x1b[201~\x1b[8;24;80t"), ("HOLDING", lambda: self.world.sleep(0.5)), ("HOLDING", b"q")],
            )
            self.assertEqual(status, 0)
            self.assertGreater(self.tell()[1], 0.8)

    def test_ctrl_c_on_a_terminal_and_a_window_that_is_too_small(self):
        with self.cell():
            status = self.on_terminal(
                *(*self.ARGUMENTS, f"{self.folder}/gripper", "--open-width", "45"),
                size=(79, 24),
                steps=[(r"needs 80x24.*holding", b"\x03"), (r"Ctrl-C: the width stays", b"\x03")],
            )
        self.assertEqual(status, 0)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
