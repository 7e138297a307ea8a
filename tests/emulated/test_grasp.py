"""A grasp with two emulated fingertips that run their release image: what slips is caught, and how soon in emulated time; and what the
lock step refuses.

usage: test_grasp.py --image F.bin --world FINGERTIP_CELL_EMULATED --tables FOLDER --node NODE
"""

import argparse
import subprocess
import sys
import unittest

from emulation import MAIN, ROOT, main

sys.path.insert(0, str(ROOT / "host_tools/report/grasp"))
import emulated_grasp  # noqa: E402

OPTIONS = argparse.Namespace()
SLID_mm = 12.0  # the fingers move 47 ms after the slide began; friction then needs some way to stop it
REACTION_ms, TOLD_ms = 60.0, 20.0
AT_CAP = 1 << 9
BYTES_OF_ANSWER = 4 + 2 * (8 * 15 + 4)


def grasp(*options):
    found = emulated_grasp.grasp(OPTIONS.node, OPTIONS.image, OPTIONS.world, OPTIONS.tables, *options)
    found.pop("wall_s")
    return found


class Grasp(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = grasp()
        cls.slip = cls.found["slip"]

    def test_what_slips_is_caught_in_time(self):
        found, slip = self.found, self.slip
        self.assertFalse(found["dropped"])
        self.assertEqual(found["slips"], 1)
        self.assertGreater(slip["way_mm"], 1.0)
        self.assertLess(found["slid_mm"], SLID_mm)
        self.assertGreater(slip["begin_s"], found["lift_s"] + 0.5)
        self.assertLess(slip["reaction_ms"], REACTION_ms)
        self.assertEqual(found["trouble"] & ~AT_CAP, 0)

    def test_one_thing_comes_after_the_other(self):
        slip = self.slip
        course = [0.0, *(slip[name] for name in emulated_grasp.COURSE)]
        self.assertEqual(course, sorted(course))
        self.assertLess(slip["sent_ms"], TOLD_ms)
        # Half a conversion, the bus, the fit, the line.
        self.assertTrue(1.5 < slip["sent_ms"] - slip["measured_ms"] < 5.0, course)

    def test_every_frame_came(self):
        asked_s, end_s = self.found["asked_s"], self.found["end_s"]
        for finger, board in zip(self.found["fingers"], self.found["boards"]):
            self.assertEqual((finger["lost_packets"], finger["damaged_packets"], board["warnings"]), (0, 0, []))
            self.assertGreater(finger["frames"], 400 * (end_s - asked_s))
            self.assertGreater(finger["loads"], 395 * (end_s - self.found["holding_s"]))
            self.assertLess(finger["clock_uncertainty_us"], 500)

    def test_it_is_the_same_each_time_and_without_the_fall_nothing_slips(self):
        self.assertEqual(grasp(), self.found)
        calm = grasp("--friction-falls", "0")
        self.assertEqual((calm["dropped"], calm["slips"], calm["slip"]), (False, 0, None))
        self.assertLess(calm["slid_mm"], 0.1)


class LockStep(unittest.TestCase):
    def refused(self, words, *program, options=()):
        lockstep = [OPTIONS.node, MAIN.with_name("lockstep.mjs"), "--image", OPTIONS.image, "--board", emulated_grasp.BOARD]
        done = subprocess.run([*lockstep, *options, "--", *program], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
        self.assertIn(words, done.stderr)

    def test_programs_that_fail(self):
        python = (sys.executable, "-c")
        self.refused("cannot be run (ENOENT)", "/no/such/program")
        self.refused("ended with 3", *python, "raise SystemExit(3)")
        self.refused("ended before it was over", *python, "pass")
        self.refused("begins an answer with 7", *python, "import sys; sys.stdout.buffer.write(bytes([7, 0, 0, 0]))")
        self.refused("a pressure of NaN", *python, f"import sys; sys.stdout.buffer.write(bytes(4) + b'\\xff' * {BYTES_OF_ANSWER})")
        self.refused("its result is no JSON", *python, "import sys; sys.stdout.buffer.write(bytes([1, 0, 0, 0]) + b'no')")
        self.refused(
            "is not over after 0.001 s",
            *python,
            f"import sys; sys.stdout.buffer.write(bytes(9 * {BYTES_OF_ANSWER}))",
            options=("--seconds", "0.001"),
        )

    def test_wrong_usage(self):
        for words, options in (
            ("--boards", ("--boards", "0")),
            ("--clock-ppm", ("--clock-ppm", "fast")),
            ("3 numbers for 2 boards", ("--clock-ppm", "1,2,3")),
            ("--seconds", ("--seconds", "0")),
            ("see --help", ("--pace", "1")),
        ):
            self.refused(words, "true", options=options)
        self.refused("no program is named")


if __name__ == "__main__":
    main(OPTIONS, "image", "world", "tables", "node")
