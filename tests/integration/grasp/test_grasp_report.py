"""grasp.py with a program in the place of fingertip_grasp_kinds: what it asks for, judges, writes and refuses."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
# Of each hundred usual and rough grasps one is dropped; peaks are at 1.9 times the need, slides are caught in 30 ms. A gentle one is over the cap, a
# set force settles late on the servo and its width turns. A cup is crushed, and once more where no controller could notice.
PROGRAM = """
import json, sys
given = [word for word in sys.argv[1:] if word != "--loadless"]
options = dict(zip(given[::2], given[1::2]))
slide = {"begin_s": 1.0, "way_mm": 2.0, "peak_N": 3.8, "least_N": 2.0, "reaction_ms": 30.0}
grasp = {"n": 7, "mass_kg": 0.3, "friction": 0.5, "lift_s": 0.2, "dropped": False, "never_held": False, "crushed": False, "hunts": False, "margin": 2.1, "slid_mm": 2.0, "turned_deg": 0.0, "shape": "ball", "slides": 1, "learnt": 0.9,
         "first_N": 4.0, "peak_N": 15.0, "start_N": 4.0, "cap_N": 20.0, "events": ["knock"], "catches": [slide]}
fault = {"fault": "one fingertip gone", "state": "holding", "gripper": "2f85", "object": "paper cup", "begun": True, "untold": False, "reported": "finger_0_stale",
         "ends": "holding", "opened_mm": 0.3, "peak_N": 3.0, "cap_N": 4.0, "crushed": True, "opened": False, "beyond_cap": False, "unsaid": False}
if "--faults" in sys.argv:
    found = {"rows": [fault, {**fault, "gripper": "sts3215", "peak_N": 3.5, "crushed": False}, {**fault, "fault": "both frozen", "untold": True, "beyond_cap": True}]}
else:
    count = int(options["--count"])
    each = [dict(grasp) for _ in range(count)]
    if options["--kind"] == "usual,rough":
        for one in each[: count // 100]:
            one["dropped"] = True
        # Boxes are held by more than balls, plates by more than that; two of each hundred turn unreported.
        for i, one in enumerate(each):
            one["shape"] = ["ball", "box", "plate", "upright", "lying"][i % 5]
            one["margin"] += {"box": 1.0, "plate": 4.0}.get(one["shape"], 0.0)
            one["turned_deg"], one["slides"] = (40.0, i % 100 == 4) if i % 50 == 4 else (0.0, 0)
    if options["--kind"] == "gentle" and "--still" not in options:
        each[0]["peak_N"] = 21.0
    if "--still" in options:
        late = options["--gripper"] == "sts3215"
        each = [{**one, "set_N": 9.0, "settle_s": 1.4 if late else 0.4, "rms_percent": 1.0, "reversals": 0} for one in each]
        each[0]["reversals"] = 4
    if "--then" in options:
        each = [{**one, "before_N": 2.0, "after_N": 2.9, "reported": "", "released": i > 0, "early": i == 1} for i, one in enumerate(each)]
        each[0]["after_N"] = 3.1
    found = {"each": each}
print(json.dumps(found))
"""


class Grasp(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.out = self.folder / "out"
        self.program(PROGRAM)

    def program(self, body):
        path = self.folder / "host_tools/report/grasp/fingertip_grasp_kinds"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!{sys.executable}\n{body}\n")
        path.chmod(0o755)

    def run_tool(self, *options, emulated=("--no-emulated",)):
        words = [sys.executable, ROOT / "host_tools/report/grasp/grasp.py", "--build", self.folder, "-o", self.out, *emulated, *options]
        return subprocess.run(words, capture_output=True, text=True)

    def test_sets_are_judged(self):
        done = self.run_tool("--usual")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads((self.out / "grasp.json").read_text())
        met = {name: goal["met"] for name, goal in found["goals"].items()}
        good = """drops_percent_2f85 drops_percent_servo drops_percent_ideal margin_median_ball margin_median_box peak_over_need_p50_2f85 reaction_ms_2f85 slick_drops_percent_worst
            hunting_percent_worst crushed_percent late_40ms_drops_percent settle_s_2f85 hold_rms_percent_servo"""
        for name in good.split():
            self.assertIs(met[name], True, name)
        for name in "margin_median_plate peak_over_need_p50_ideal over_cap settle_s_servo limit_cycles".split():
            self.assertIs(met[name], False, name)
        self.assertEqual((found["limit_cycles"], found["over_cap"]), (6, 3))
        self.assertEqual((found["one_bad_frame_squeezed"], found["lasting_bad_squeezed_percent"]), (9, 10.0))
        self.assertEqual([found[name] for name in ("place_rises", "pulled_against_over_1.5x", "handed_over_percent")], [3, 3, 93.333])
        kinds = {(row["row"], row["gripper"], row["controller"]): row["grasps"] for row in found["kinds"]}
        for row, grasps in {
            ("usual and rough", "2f85", "paper"): 30,
            ("slick", "ideal", "ours"): 100,
            ("gentle", "2f85", "ours"): 30,
        }.items():
            self.assertEqual(kinds[row], grasps)
        # Three grippers; three rows that are judged, each with four controllers, and nine others.
        self.assertEqual(len(kinds), 3 * (3 * 4 + 8))
        self.assertTrue(found["simulated"])
        self.assertEqual([row["gripper"] for row in found["sets"]], 3 * ["2f85", "sts3215", "ideal"])
        self.assertEqual(
            [(row["shape"], row["grasps"], row["margin_p50"]) for row in found["shapes"][:4]],
            [("ball", 20, 2.1), ("cylinder", 40, 2.1), ("box", 20, 3.1), ("plate", 20, 6.1)],
        )
        self.assertAlmostEqual(found["turned_unreported_percent"], 100 / 99, places=2)  # of what was held
        self.assertIsNone(met["emulated_reaction_ms"])
        self.assertEqual((found["cups_crushed"], met["cups_crushed"], met["faults_beyond_cap"]), (1, False, True))
        self.assertEqual(
            [(row["fault"], row["grasps"], row["peak_N"]) for row in found["faults"]],
            [("one fingertip gone", 2, 3.5), ("both frozen", 1, 3.0)],
        )
        self.assertEqual(found["distributions"][0]["reaction_ms"][-1], 30.0)
        self.assertEqual((self.out / "grasp.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.run_tool("--usual", "--check").returncode, 1)

    def test_what_is_written_to_read(self):
        self.run_tool("--grasps", "5")
        text = (self.out / "grasp.md").read_text()
        words = "Simulated rubber/Nothing was checked on hardware/no load estimated/## By kind/## Set forces/## In a steady hold/## Faults/both frozen | holding | True"
        for each in words.split("/"):
            self.assertIn(each, text)

    def test_refusals(self):
        for options, words in ((("--seed", "5"), "seeds below 1000"), (("--grasps", "0"), "--grasps")):
            done = self.run_tool(*options)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(words, done.stderr)
        self.program(PROGRAM.replace('"begun": True', '"begun": False'))
        self.assertIn("one fingertip gone never began in holding", self.run_tool("--grasps", "1").stderr)
        self.program("print('no')")
        self.assertIn("wrote no JSON", self.run_tool("--grasps", "1").stderr)
        self.program("import sys; sys.exit('the cell is on fire')")
        self.assertIn("on fire", self.run_tool("--grasps", "1").stderr)
        self.assertIn("fingertip_cell_emulated is not there", self.run_tool("--grasps", "1", emulated=()).stderr)
        (self.folder / "host_tools/report/grasp/fingertip_grasp_kinds").unlink()
        self.assertIn("is not there", self.run_tool("--grasps", "1").stderr)


if __name__ == "__main__":
    unittest.main()
