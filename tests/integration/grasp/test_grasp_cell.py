"""fingertip grasp in the simulated cell on simulated time, every part of it real but clock, rubber, object and motor.

usage: test_grasp_cell.py FINGERTIP FINGERTIP_SIMULATE TIME_KEEPER TABLES [unittest arguments]

Judged by the cell's truth.
"""

import contextlib
import os
import pathlib
import select
import signal
import subprocess
import sys
import threading
import unittest
from unittest import mock

import numpy as np

FINGERTIP, FINGERTIP_SIMULATE, TIME_KEEPER, TABLES = (os.path.abspath(path) for path in sys.argv[1:5])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
import ros2_stand_in  # noqa: E402
from fingertip import files, grip_file, host_time, ros2_gripper  # noqa: E402
from simulated_host_time import SimulatedHostTime  # noqa: E402
from world_case import WorldCase  # noqa: E402

PATIENCE_s = 60
STOPS_s = 0.3  # of real time
DONE, FAILED, MISSED, DROPPED, FAULT = 0, 1, 3, 4, 5
UNABLE = (FAULT, DROPPED)  # with a gripper that cannot be reached: a cup that becomes heavy then falls

# How much more than the cap a grip may be: forces are measured within some 10 %, and one count of a 2F-85 on a paper cup is up to 0.4 N.
OVER_CAP = 1.25
# How far a grip may open by itself: a servo comes down by 0.9 mm from its first grip to what the load needs.
OPENS_mm = 1.1


class CellTest(WorldCase):
    TIME_KEEPER = TIME_KEEPER

    def setUp(self):
        super().setUp()
        self.truth_csv = self.path("truth.csv")
        self.environment["FINGERTIP_PORT"] = f"{self.folder}/left:{self.folder}/right"

    @contextlib.contextmanager
    def cell(self, *options, model="2f85"):
        self.model = model
        words = f"--lift --ports {self.folder} --gripper {model} --cache {TABLES} --truth {self.truth_csv}"
        process = self.process = self.world.start([FINGERTIP_SIMULATE, *words.split(), *options], stdin=subprocess.PIPE)
        try:
            ready = process.readline()
            self.assertTrue(ready.startswith("ready: "), process.read("stderr") if not ready else ready)
            yield
            self.tell("quit")
            self.assertEqual(process.wait(), 0, process.read("stderr"))
            self.assertFalse(any(os.path.lexists(f"{self.folder}/{name}") for name in ("left", "right", "gripper")))
        finally:
            process.kill()
            process.wait()

    def tell(self, command, answer="ok"):
        self.process.stdin.write(command.encode() + b"\n")
        told = self.process.readline().strip()
        if answer:
            self.assertEqual(told, answer)
        return told

    def now(self):
        """The truth as it is: columns by name."""
        columns = self.truth_columns()[1:]
        return dict(zip(columns, map(float, self.tell("truth", None).split(","))))

    def truth_columns(self):
        with open(self.truth_csv, encoding="ascii") as file:
            return next(line for line in file if line[0] != "#").strip().split(",")

    def truth(self):
        """All of it: columns by name, and events as (time in us, text)."""
        with open(self.truth_csv, encoding="ascii") as file:
            lines = file.read().splitlines()
        events = [line.removeprefix("# event: ").split(",", 1) for line in lines if line.startswith("# event: ")]
        rows = [line.split(",") for line in lines if line[0] != "#"]
        values = np.array(rows[1:], dtype=float)
        return {name: values[:, i] for i, name in enumerate(rows[0])}, [(int(time_us), text) for time_us, text in events]

    def wait_for(self, condition, what):
        def is_so():
            self.assertIsNone(self.process.poll(), what)
            return condition()

        try:
            self.world.until(is_so, PATIENCE_s)
        except AssertionError as error:
            raise AssertionError(f"{what}: {error}") from None

    def wait_for_event(self, word):
        def has_come():
            with open(self.truth_csv, encoding="ascii") as file:
                return any(line.startswith("# event: ") and line.split(",", 1)[1].startswith(word) for line in file)

        self.wait_for(has_come, f"{word} never came")

    def pass_time(self, seconds):
        """Of the world."""
        until_s = self.now()["world_s"] + seconds
        self.wait_for(lambda: self.now()["world_s"] >= until_s, "the world stands still")

    def start(self, *arguments, **how):
        self.out = open(f"{self.folder}/said", "w+", encoding="utf-8")
        self.addCleanup(self.out.close)
        words = [FINGERTIP, "grasp", "--gripper", self.model, "--gripper-port", f"{self.folder}/gripper", *arguments]
        return self.world.start(words, env=self.environment, stdout=self.out, stderr=self.out, **how)

    def said(self):
        return pathlib.Path(self.out.name).read_text(encoding="utf-8")

    def wait_for_words(self, words, process):
        def are_said():
            done = process.poll() is not None
            return words in self.said() or (done and self.fail(f"ended without {words!r}: {self.said()}"))

        self.wait_for(are_said, f"{words!r} was never said: {self.said()}")


class Programs(CellTest):
    def test_bad_usage_is_told(self):
        def run(*arguments):
            status, out, err = self.world.run([FINGERTIP_SIMULATE, "--lift", "--ports", self.folder, "--cache", TABLES, *arguments])
            self.assertNotEqual(status, 0)
            return err + out

        self.assertIn("is no disturbance; give pour:", run("--then", "earthquake:9"))
        self.assertIn("is no disturbance", run("--then", "slick:1.2"))
        self.assertIn("2f85 opens to 85.0 mm", run("--width", "84"))
        self.assertIn("2f85", run("--gripper", "claw"))
        pathlib.Path(self.truth_csv).touch()
        self.assertIn("truth.csv", run("--truth", self.truth_csv))
        with self.cell("--overwrite"):
            self.assertIn("another simulation has its ports there; end that one", run())
            self.assertIn("give lift, take, pour", self.tell("dance", None))
            self.assertIn("cannot be", self.tell("knock 0.1", None))  # not lifted yet

    def test_nothing_moves_where_nothing_can_be_recorded(self):
        with self.cell():
            process = self.start("-o", "/dev/full", "--overwrite")
            self.assertEqual(process.wait(), FAILED)
            self.assertIn("No space left on device", self.said())
            self.pass_time(0.5)
            self.assertAlmostEqual(self.now()["width_mm"], 44, delta=1)

    def test_killed_it_leaves_no_process_behind(self):
        with contextlib.suppress(BrokenPipeError), self.cell():
            children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
            self.assertEqual(len(children), 2)
            ends = [os.pidfd_open(int(child)) for child in children]
            self.process.kill()
            self.process.wait()
            for end in ends:
                self.assertTrue(select.select([end], [], [], PATIENCE_s)[0], "a fingertip's process lives on")
                os.close(end)


class Course(CellTest):
    """An object is lifted, becomes slick, slips and is caught."""

    def run_course(self, model):
        with self.cell("--mass", "0.25", "--friction", "0.6", model=model):
            process = self.start("-o", self.csv)
            self.wait_for_event("lift")
            self.pass_time(1.5)
            now = self.now()
            # So slick that somewhat more force is needed than there is, and once it slides a third more.
            self.tell(f"slick {1 - now['least_N'] / (1.02 * now['force_N']):.3f}")
            self.wait_for_event("slip")
            self.wait_for(lambda: not self.now()["slips"], "it slips for ever")
            self.pass_time(0.5)
            process.terminate()
            self.assertEqual(process.wait(), DONE, self.said())
        truth, events = self.truth()
        order = [text.split()[0] for _, text in events]
        self.assertEqual(order[order.index("slick") :][:3], ["slick", "slip", "caught"])
        self.assertEqual(truth["dropped"].max(), 0)
        cap_N = 20
        self.assertLess(truth["peak_N"].max(), OVER_CAP * cap_N)
        lifted = truth["lifted_mm"] > 9.99
        self.assertGreater(np.quantile(truth["load_N"][lifted], 0.01), 0.3)  # carried all the time; it springs up as the slide ends
        # What was recorded is what was.
        rows = grip_file.read_grip(self.csv)
        self.assertLess({"approach", "squeeze", "holding", "slipping"}, set(rows["state"]))
        with open(self.csv, encoding="utf-8") as file:
            zero_us = int(next(line for line in file if line.startswith("# host_zero_us: ")).split()[-1])
        told = np.isfinite(rows["status_us"])
        width_mm = np.interp(rows["status_us"][told] + zero_us, truth["time_us"], truth["width_mm"])
        self.assertLess(np.median(np.abs(rows["width_mm"][told] - width_mm)), 1.2)  # a count, and half of the servo's play
        serials = files.recorded_devices(self.csv)
        self.assertEqual(len(serials), 2)
        for serial in serials:
            finger = files.read_recording(self.csv, serial=serial)
            presses = finger.flag(files.CONTACT) & (finger.time_us > rows["time_us"][rows["state"] == "holding"][0])
            self.assertGreater(presses.sum(), 100)
            force_N = np.interp(finger.time_us[presses] + zero_us, truth["time_us"], truth["force_N"])
            self.assertLess(np.median(np.abs(finger["force_N"][presses] / force_N - 1)), 0.15)

    def test_a_grasp_of_a_kind(self):
        """What is drawn happens: the truth has it, and its need follows it."""
        with self.cell("--kind", "slick", "--seed", "4"):
            process = self.start("-o", self.csv)
            self.wait_for_event("slick")
            self.pass_time(0.5)
            process.terminate()
            self.assertEqual(process.wait(), DONE, self.said())
        truth, events = self.truth()
        with open(self.truth_csv, encoding="utf-8") as file:
            head = dict(line[2:].strip().split(": ", 1) for line in file if line.startswith("# ") and ": " in line)
        self.assertEqual((head["kind"], head["seed"]), ("slick", "4"))
        self.assertNotEqual(head["mass_kg"], "0.3")
        self.assertLess([text for _, text in events].index("lift"), [text for _, text in events].index("slick"))
        need_N = truth["least_N"][truth["least_N"] > 0]
        self.assertGreater(need_N[-1], 1.2 * need_N[0])
        for serial in files.recorded_devices(self.csv):
            finger = files.read_recording(self.csv, serial=serial)
            self.assertGreater(finger["qy_N"][finger.flag(files.TANGENTIAL_VALID)][-1], 1, "the cables leave upwards")

    def test_2f85(self):
        self.run_course("2f85")

    def test_sts3215(self):
        self.run_course("sts3215")


class Again(CellTest):
    def grasp(self, meanwhile=lambda process: None):
        """Of eight seconds: what was recorded, what was true, what was said."""
        with self.cell("--mass", "0.25", "--friction", "0.5", "--then", "slick:0.65@1", "--overwrite"):
            process = self.start("--seconds", "8", "-o", self.csv, "--overwrite")
            meanwhile(process)
            self.assertEqual(process.wait(), DONE, self.said())
        self.world.close()
        self.begin_world()
        self.assertIn("slipping", set(grip_file.read_grip(self.csv)["state"]))
        return [*(pathlib.Path(path).read_bytes() for path in (self.csv, self.truth_csv)), self.said()]

    def test_the_same_grasp_gives_the_same_bytes(self):
        first = self.grasp()
        self.assertTrue(first == self.grasp(), "two runs differ")

        def stop(process):
            """As on a machine that stands for a while, which no clock of this world shows."""
            for each in (process, self.process):
                self.world.sleep(2)
                os.kill(each.pid, signal.SIGSTOP)
                threading.Timer(STOPS_s, os.kill, (each.pid, signal.SIGCONT)).start()

        self.assertTrue(first == self.grasp(stop), "it matters how long a process is stopped")


class Faults:
    """While a paper cup is squeezed, or carried: whatever fails, it is not crushed, and the grip does not open by itself.

    One of each kind of process, line and signal: every fault in every state is test_grasp_kinds.py's, in simulated time."""

    CAP_N = 4.0
    # Of 50 g, which gives way by 0.2 mm a newton.
    CUP = f"--mass 0.05 --stiffness 5 --crushes {OVER_CAP * CAP_N} --friction 0.6 --lift-time 0.3 --opens 2".split()
    RESTS_s = 0.6  # of the world, after what happened

    @contextlib.contextmanager
    def grasp(self, *commands, model="2f85", ends=(DONE,)):
        """What the cell is told comes at the touch, or while the cup is carried."""
        with self.cell(*self.CUP, *(["--by-command"] if self.STATE == "squeeze" else []), model=model):
            if self.STATE == "squeeze" and commands:
                self.tell("at_touch " + "; ".join(commands))
            process = self.start("--cap", str(self.CAP_N))
            if self.STATE == "squeeze":
                self.wait_for(lambda: self.now()["peak_N"] > 0.05, "it never touched")
            else:
                self.wait_for_event("lift")
                self.pass_time(0.6)
                for command in commands:
                    self.tell(command)
            yield process
            # Whatever goes on now would like more force than the cap, where it carries the cup.
            self.pass_time(self.RESTS_s)
            self.assertEqual(self.now()["dropped"], 0)
            self.tell("pour 5", None)
            self.pass_time(2 * self.RESTS_s)
            if process.poll() is None:
                process.terminate()
            self.assertIn(process.wait(), ends, self.said())
            self.pass_time(self.RESTS_s)
        truth, events = self.truth()
        self.assertEqual(truth["crushed"].max(), 0, events)
        self.assertLess(truth["peak_N"].max(), OVER_CAP * self.CAP_N)
        width_mm = truth["width_mm"][truth["peak_N"] > 0.05]
        self.assertLess((width_mm - np.minimum.accumulate(width_mm)).max(), OPENS_mm, events)

    def run_fault(self, *commands, words, **options):
        with self.grasp(*commands, **options) as process:
            for one in words:
                self.wait_for_words(one, process)


class WhileSqueezing(Faults, CellTest):
    STATE = "squeeze"

    def test_a_fingertip_is_killed(self):
        self.run_fault("kill left", words=["left: no frames"])

    def test_the_gripper_talks_rubbish(self):
        self.run_fault("line garbage", words=["the gripper does not answer"], ends=UNABLE)

    def test_a_latency_timer(self):
        self.run_fault("latency_timer 16", words=[" s  holding "])

    def test_killed(self):
        with self.grasp(ends=(-signal.SIGKILL,)) as process:
            process.kill()


class WhileHolding(Faults, CellTest):
    STATE = "hold"

    def test_a_fingertip_hangs(self):
        self.run_fault("freeze right", words=["right: no frames"], ends=(DONE, DROPPED))  # half of what is poured in is unseen

    def test_answers_come_too_late(self):
        self.run_fault("late 400", words=["the gripper does not answer"], ends=(DONE, *UNABLE))

    def test_a_silent_servo(self):
        self.run_fault("line silent", words=["the gripper does not answer"], ends=UNABLE, model="sts3215")

    def test_power_comes_back(self):
        with self.grasp("power off", ends=(FAULT,)) as process:
            self.wait_for_words("the gripper does not answer", process)
            self.tell("power on")
            self.wait_for_words("the width stays", process)

    def test_the_object_is_taken_away(self):
        self.run_fault("take", words=["the gripper keeps its position"], ends=(MISSED, DROPPED))


class Ros2(CellTest):
    """The actions of ROS 2, on a stand-in of rclpy."""

    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch.dict(os.environ, self.environment))
        host_time.use(SimulatedHostTime(self.world))
        ros2_stand_in.install()
        self.node = ros2_stand_in.Node()
        ros2_gripper.GripperAction(self.node)

    def send(self, *gaps_m, max_effort=0.0, parallel=False):
        """A goal; None: it was rejected."""
        goal = (ros2_stand_in.ParallelGripperCommand if parallel else ros2_stand_in.GripperCommand).Goal()
        if parallel:
            goal.command.name, goal.command.position, goal.command.effort, goal.command.velocity = ["jaw"], list(gaps_m), [8.0], [0.05]
        else:
            goal.command.position, goal.command.max_effort = *gaps_m, max_effort
        return self.node.servers["~/parallel_gripper_cmd" if parallel else "~/gripper_cmd"].send(goal)

    def assert_ends(self, handle, status, stalled, reached_goal):
        ended, result = self.node.end(handle)
        self.assertEqual((ended, result.stalled, result.reached_goal), (status, stalled, reached_goal), self.node.said[-1])
        return result

    def test_goals(self):
        with self.cell():
            self.assertIsNone(self.send(0.0, max_effort=8.0), "no grasp runs")
            process = self.start("--wait")
            self.wait_for(lambda: any(pathlib.Path(self.folder).glob("fingertip/*.grasp")), "no socket")
            self.pass_time(1.0)
            self.assertAlmostEqual(self.now()["width_mm"], 44, delta=1)  # it waits
            for gap_m, max_effort in ((0.0, 200.0), (0.12, 0.0), (float("nan"), 0.0), (-0.001, 0.0)):
                self.assertIsNone(self.send(gap_m, max_effort=max_effort), gap_m)
            result = self.assert_ends(self.send(0.042), "succeeded", False, True)
            self.assertAlmostEqual(1e3 * result.position, self.now()["width_mm"], delta=0.5)
            self.assert_ends(self.send(0.06), "succeeded", False, True)
            # Cancelled, the width stays.
            handle = self.send(0.0, max_effort=8.0)
            self.pass_time(0.5)
            self.node.servers["~/gripper_cmd"].cancel(handle)
            self.assert_ends(handle, "canceled", False, False)
            width_mm = self.now()["width_mm"]
            self.pass_time(0.5)
            self.assertAlmostEqual(self.now()["width_mm"], width_mm, delta=1)
            # A second goal aborts the first and goes on.
            first, second = self.send(0.0, max_effort=8.0), self.send(0.0, max_effort=9.0)
            self.assert_ends(first, "aborted", False, False)
            result = self.assert_ends(second, "succeeded", True, False)
            self.assertAlmostEqual(result.effort, self.now()["force_N"], delta=0.5)
            self.assertLess(1.0, max(each.effort for each in second.feedback))
            # What is held stays, whatever is refused.
            self.assertIsNone(self.send(0.0, max_effort=0.1))
            self.assertIsNone(self.send(0.0, 0.07, parallel=True))
            self.assert_ends(self.send(0.0, max_effort=10.0), "succeeded", True, False)
            self.assertEqual(self.assert_ends(self.send(0.07, parallel=True), "succeeded", False, True).state.name, ["jaw"])
            # Nothing there: it closes. Then the grasp ends while it opens.
            self.tell("take")
            self.assert_ends(self.send(0.0, max_effort=8.0), "succeeded", False, True)
            handle = self.send(0.08)
            process.terminate()
            self.assert_ends(handle, "aborted", False, False)
            process.wait()
        for words in ("no `fingertip grasp` runs", "give 0.5 to 100 N", "opens to 85.0 mm", "2 positions", "a new goal"):
            self.assertTrue(any(words in line for line in self.node.said), (words, self.node.said))

    def test_a_grasp_that_has_failed_opens(self):
        """A report may be of before the request."""
        steps = (("fault", 40), ("fault", 40), ("release", 60), ("open", 80))
        grasp = mock.Mock(**{"report.side_effect": [{"state": state, "width_mm": width_mm} for state, width_mm in steps]})
        grasp.states.side_effect = [], [], ["release"], []
        with mock.patch.object(ros2_gripper, "RunningGrasp", return_value=grasp):
            self.assert_ends(self.send(0.08), "succeeded", False, True)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]], verbosity=2)
