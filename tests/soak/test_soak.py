"""soak.py with a stand-in for fingertip_soak: what it runs, keeps, counts and says."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [
    str(HERE),
    str(ROOT / "host_tools/report/reliability"),
    str(ROOT / "host_tools/report/shared"),
    str(ROOT / "host_tools/python"),
]
import soak  # noqa: E402
import soaking  # noqa: E402
from goals import judge  # noqa: E402

PROGRAM = """#!/usr/bin/python3
import json, sys
seed, seconds = (sys.argv[sys.argv.index(name) + 1] for name in ("--seed", "--seconds"))
found = {name: 1 for name in %r} | {name: 0.5 for name in %r} | {name: 0 for name in %r}
found |= {"seed": int(seed), "seconds": float(seconds), "findings": [], "recovery": {"garbage": {"bouts": 2, "worst_s": float(seed)}}}
%s
print(json.dumps(found))
sys.exit(bool(found["findings"]))
"""


class Soak(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        for board in soak.EMULATED:
            image = self.folder / f"{board}/fingertip-{board}.bin"
            image.parent.mkdir()
            image.write_text(board)
        self.program()

    def program(self, does=""):
        path = self.folder / "tests/soak/fingertip_soak"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(PROGRAM % (soak.SUMS, soak.WORST, soak.COUNTS, does))
        path.chmod(0o755)

    def soak(self, *options):
        done = subprocess.run(
            [
                sys.executable,
                HERE / "soak.py",
                "--build",
                self.folder,
                "--boards",
                self.folder,
                "-o",
                self.folder / "out",
                "--json",
                self.folder / "found.json",
                *map(str, options),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
        return done, json.loads((self.folder / "found.json").read_text()) if done.returncode < 2 else None

    def test_episodes_add_up(self):
        done, found = self.soak("--kinds", "native", "--episodes", 3, "--seconds", 1200, "--seed", 5)
        self.assertEqual((done.returncode, found["soak_hours_native"], found["soak_hours_emulated"]), (0, 1, 0), done.stderr)
        self.assertEqual([line.split()[2] for line in sorted(done.stdout.splitlines()[:3])], ["5", "6", "7"])
        self.assertEqual((found["hangs"], found["wrong_unflagged"], found["worst_recovery_s"]), (0, 0, 7))
        self.assertEqual(
            found["recovery"], [{"fault": "garbage", "native_bouts": 6, "native_worst_s": 7, "emulated_bouts": 0, "emulated_worst_s": None}]
        )

    def test_a_steady_one_is_of_its_bench(self):
        self.program('found["frames"] = 7 if "--steady" in sys.argv else 1')
        _, found = self.soak("--kinds", "steady_native", "--episodes", 1, "--seed", 1)
        rows = {row["bench"]: row for row in found["soak"]}
        self.assertEqual((rows["steady_native"]["frames"], rows["steady_native"]["seconds"], rows["native"]["episodes"]), (7, 3600, 0))
        self.assertEqual(found["recovery"][0]["native_bouts"], 2)

    def test_what_is_found_is_kept_with_the_command_that_does_it_again(self):
        self.program('found |= {"wrong_unflagged": 4, "findings": ["wrong at 3 s: frame 7"]} if seed == "2" else {}')
        done, found = self.soak("--kinds", "native", "--episodes", 3, "--seed", 1)
        self.assertEqual((done.returncode, found["wrong_unflagged"], found["findings"]), (1, 4, ["native, seed 2: wrong at 3 s: frame 7"]))
        self.assertIn("FOUND 4 wrong_unflagged", done.stdout)
        [kept] = (self.folder / "out/findings").iterdir()
        lines = kept.read_text().splitlines()
        self.assertEqual(lines[0], "wrong at 3 s: frame 7")
        self.assertEqual(
            json.loads(subprocess.run(lines[-1].split(), capture_output=True, text=True, check=False).stdout)["wrong_unflagged"], 4
        )

    def test_a_program_that_ends_without_a_word_is_a_hang(self):
        self.program('sys.exit("native_port: no time passes")')
        done, found = self.soak("--kinds", "native", "--episodes", 1, "--seed", 1)
        self.assertEqual((done.returncode, found["hangs"]), (1, 1))
        self.assertIn("no time passes", found["findings"][0])

    def test_earlier_episodes_of_the_same_program_count(self):
        self.soak("--kinds", "native", "--episodes", 2, "--seed", 1)
        _, found = self.soak("--least", 0, 0.5)
        self.assertEqual((found["soak_hours_native"], found["soak_episodes_now"]), (0.5, 1))
        self.program("found['frames'] = 2")
        _, found = self.soak("--least", 0, 0.5)
        self.assertEqual((found["soak_hours_native"], found["soak_episodes_now"]), (0.5, 3))

    def test_the_report_says_what_was_found(self):
        _, found = self.soak("--kinds", "native", "--episodes", 1, "--seed", 1)
        cuts = {
            "power_cuts": 3,
            "power_cuts_not_started": 1,
            "power_cuts_wrong_values": 0,
            "power_cut_kinds": [{"board": "pico_mux", "cut": "erase", "cuts": 3}],
            "power_cut_findings": ["erase cut at 1 ms: it did not stream again"],
        }
        steady = {
            "steady": [{"bench": "native", "frames": 4711, "late": 2}],
            "steady_native_s": 3600,
            "steady_findings": 1,
            "steady_what": ["steady_native, seed 1: late"],
            "steady_lost": 0,
            "steady_late": 2,
        }
        found = {**found, "soak_findings": ["native, seed 9: hang"], **cuts, **steady}
        judged = judge(found, soaking.GOALS)["goals"]
        self.assertEqual(
            [name for name, goal in judged.items() if not goal["met"]],
            ["soak_hours_emulated", "soak_hours_native", "power_cuts", "power_cuts_not_started", "steady_findings", "steady_late"],
        )
        text = "\n".join(soaking.text(found))
        for what in (
            "native, seed 9: hang",
            "erase cut at 1 ms",
            "| garbage | 2 |",
            "| native | 4711 |",
            "steady_native, seed 1: late",
            "| pico_mux | erase | 3 |",
        ):
            self.assertIn(what, text)


if __name__ == "__main__":
    unittest.main()
