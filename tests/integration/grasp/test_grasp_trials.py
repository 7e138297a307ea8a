"""fingertip_grasp_trials on few grasps: the same seed, the same answer; more grip, fewer drops; words for what it cannot do.

usage: test_grasp_trials.py FINGERTIP_GRASP_TRIALS TABLES [unittest arguments]
"""

import json
import subprocess
import sys
import unittest


def run(*options):
    return subprocess.run([PROGRAM, "--cache", TABLES, *options], capture_output=True, text=True, check=False)


def trials(*options):
    done = run("--objects", "sphere15", *options)
    found = json.loads(done.stdout)
    found.pop("prepared_s")
    found.pop("ran_s")
    return found


class GraspTrials(unittest.TestCase):
    def test_the_same_seed_gives_the_same_however_many_threads(self):
        first = trials("--gripper", "ideal", "--count", "6", "--each")
        self.assertEqual(first, trials("--gripper", "ideal", "--count", "6", "--each", "--jobs", "1"))
        self.assertNotEqual(first["each"], trials("--gripper", "ideal", "--count", "6", "--each", "--first", "6")["each"])
        self.assertEqual(first["each"][4:], trials("--gripper", "ideal", "--count", "2", "--each", "--first", "4")["each"])

    def test_what_hardly_grips_drops(self):
        weak = trials("--mode", "fixed", "--set", "fixed=0.4", "--count", "12", "--gripper", "ideal")
        firm = trials("--mode", "fixed", "--set", "fixed=17", "--count", "12", "--gripper", "ideal")
        self.assertGreaterEqual(weak["drops_percent"], 80)
        self.assertLessEqual(firm["drops_percent"], 10)
        self.assertGreater(firm["peak_p50_N"], 14)
        self.assertLess(weak["peak_p95_N"], 3)

    def test_groups_hold_every_grasp(self):
        found = trials("--count", "10", "--gripper", "ideal")
        for group in ("by_object", "by_friction", "by_mass"):
            self.assertEqual(sum(row["grasps"] for row in found[group].values()), 10)
        self.assertGreaterEqual(sum(row["grasps"] for row in found["by_disturbance"].values()), 10)

    def test_a_still_grasp_settles(self):
        found = trials("--mode", "still", "--still", "6", "--count", "4", "--gripper", "ideal")
        self.assertEqual(found["grasps"], 4)
        self.assertIn("settle_p50_s", found)
        self.assertEqual(sum(row["grasps"] for row in found["by_set"].values()), 4)
        self.assertNotIn("drops_percent", found)

    def test_what_the_grippers_steps_allow_is_better_than_ours(self):
        rms = {
            mode: trials("--mode", mode, "--count", "24", "--gripper", "2f85", "--seed", "3")["by_set"]["8 N and more"]["rms_p50_percent"]
            for mode in ("still", "still-oracle")
        }
        self.assertLess(rms["still-oracle"], 0.8 * rms["still"])

    def test_a_trace_has_a_value_for_each_moment(self):
        found = json.loads(run("--objects", "sphere15", "--gripper", "ideal", "--trace", "2").stdout)
        lengths = {len(values) for values in found["series"].values()}
        self.assertEqual(len(lengths), 1)
        self.assertGreater(lengths.pop(), 500)

    def test_wrong_usage_is_one_line(self):
        for options in (
            ("--count", "0"),
            ("--gripper", "banana"),
            ("--objects", "bananas"),
            ("--mode", "firm"),
            ("--rate", "x"),
            ("--rate", "0"),
            ("--set", "grip=1"),
            ("--set", "fixed"),
            ("--jobs", "0"),
            ("--what", "1"),
        ):
            done = run(*options)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), options)


if __name__ == "__main__":
    PROGRAM, TABLES = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
