"""The report shear on few pads and runs: its tables are near what a full run is held to, repeatable, and all of it is written and drawn; a lift is no slide, a slide is found soon, and motion alone cannot distinguish them.

usage: test_shear.py ShearStatic|ShearMotion BUILD
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools/report" / part) for part in ("shared", "measure", "shear", "../python", "../../tests/support")]
import motion  # noqa: E402
import static  # noqa: E402
from contacts import Contacts  # noqa: E402
from figures import assert_within  # noqa: E402

BUILD = sys.argv.pop()
CONTACTS = Contacts(BUILD)

SHEAR = ROOT / "host_tools/report/shear/shear.py"

# (key, least, most): what a full run finds, with room for few pads.
LIMITS = (
    ("ratio_error_p50", 0.005, 0.014),
    ("ratio_error_p95", 0.02, 0.04),
    ("vector_error_p50", 0.008, 0.015),
    ("vector_error_p95", 0.03, 0.05),
    ("direction_p90_deg", 3, 5),
    ("location_loaded_median_mm", 0.05, 0.1),
    ("location_loaded_without_mm", 0.95, 1.1),
    ("location_price_mm", -0.09, -0.02),
    ("equal_ratio_error_p50", 0.005, 0.011),
    ("equal_vector_error_p50", 0.008, 0.014),
    ("equal_location_loaded_mm", 0.04, 0.075),
    ("loaded_valid_percent", 97, 100),
    ("q_cover_1sd", 65, 98),
    ("q_cover_2sd", 96, 100),
    ("location_cover_1sd", 60, 98),
    ("location_cover_2sd", 92, 100),
    ("force_p50_percent", 0.1, 0.6),
    ("force_without_p50_percent", 1, 2.2),
    ("screw_ratio", 0.005, 0.02),
    ("screw_change_p95", 0.001, 0.012),
    ("increment_error_p50_13mm", 0.03, 0.06),
    ("increment_error_p50_9mm", 0.015, 0.045),
    ("zero_error_p50_9mm", 0.1, 0.18),
    ("zero_error_p50_own_tables", 0.01, 0.036),
    ("increment_error_p50_own_tables_9mm", 0.01, 0.03),
    ("elongated_false_percent", 0, 2),
    ("raw_beyond_2sd_percent", 0, 10),
    ("cast_vector_error_p95", 0.03, 0.06),
    ("learned_ratio_error_p50", 0.005, 0.02),
    ("learned_ratio_error_p95", 0.02, 0.06),
    ("learned_valid_percent", 88, 100),
    ("wrong_thickness_warned_percent", 90, 100),
    ("right_thickness_warned_percent", 0, 5),
)


def run(*options):
    command = [sys.executable, str(SHEAR), "--build", BUILD, "--parts", "static", *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


class ShearStatic(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        # The objects on each other thickness take seconds to solve.
        cls.done = run("--pads", "20", "--few", "--seed", "3", "-o", str(cls.out))
        cls.found = json.loads((cls.out / "shear.json").read_text())

    def rows(self, table, key):
        return {row[key]: row for row in self.found[table]}

    def test_limits(self):
        assert_within(self, self.found, LIMITS)

    def test_a_load_moves_the_gaussian_by_its_share_of_the_thickness(self):
        without = {(row["pad"], row["load"]): row["location_without_p50_mm"] for row in self.found["taps"]}
        self.assertAlmostEqual(without["equal gains", 0.1], 0.1 * 12 * 0.29, delta=0.06)
        self.assertAlmostEqual(without["equal gains", 0.3], 0.3 * 12 * 0.29, delta=0.06)

    def test_places_objects_and_pads_differ_as_they_should(self):
        place = self.rows("by_place", "case")
        self.assertLess(place["inner"]["vector_error_p50"], 0.7 * place["corner"]["vector_error_p50"])
        self.assertEqual(sum(place[name]["touches"] for name in ("inner", "border", "corner")), 20 * 50)
        self.assertEqual(sum(cell["touches"] for cell in self.found["map"]), 20 * 50)
        self.assertEqual(sum(row["touches"] for row in self.found["where_misses_lie"]), 20 * 50)
        named = self.rows("by_object", "case")
        self.assertLess(named["sphere15, Q/F 0.3"]["vector_error_p50"], 0.5 * named["cylinder12, Q/F 0.3"]["vector_error_p50"])
        self.assertIn("cube15, Q/F 0", named)
        zero = {
            row["overhang_mm"]: row["zero_error_p50"]
            for row in self.found["by_overhang"]
            if (row["profile"], row["place"]) == ("thickness", "anywhere")
        }
        self.assertEqual([zero[mm] for mm in sorted(zero, reverse=True)], sorted(zero.values()))
        row = self.rows("by_thickness", "case")
        self.assertLess(row["12 mm, set 12 mm, Q/F 0"]["vector_error_p50"], 0.6 * row["12 mm, set 13.2 mm, Q/F 0"]["vector_error_p50"])

    def test_the_same_seed_gives_the_same_and_another_another(self):
        once, again = (static.figures(CONTACTS, seed=3, pads=4, tables=("objects", "screws", "taps")) for _ in range(2))
        self.assertEqual(once, again)
        other = static.figures(CONTACTS, seed=4, pads=4, tables=("objects",))
        self.assertNotEqual(once["by_object"], other["by_object"])

    def test_wrong_usage_is_an_error(self):
        for options in (("--pads", "0"), ("--pads", "x"), ("--what", "1")):
            done = run("-o", str(self.out / "wrong"), *options)
            self.assertNotEqual(done.returncode, 0)
            self.assertEqual(done.stdout, "")

    def test_all_of_it_is_written_and_drawn(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        text = (self.out / "shear.md").read_text()
        for title in ("By pad and tangential force", "Where the misses lie", "Pads that end", "Screws"):
            self.assertIn(f"## {title}\n", text)
        self.assertGreater(len((self.out / "shear.png").read_bytes()), 50000)


def figures(seed, pads):
    return motion.figures(CONTACTS, seed, pads, motion.CASES[:1])


class ShearMotion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = figures(seed=5, pads=60)
        (cls.case,) = cls.found["motion_cases"]

    def test_no_lift_is_a_slide(self):
        for duration in ("100ms", "300ms", "1s"):
            self.assertEqual(self.case[f"lifts_{duration}"], 60)
            self.assertEqual(self.found[f"lift_false_slides_{duration}"], 0)
        self.assertEqual(self.case["sliding_false_in_slides"], 0)

    def test_motion_alone_takes_brisk_lifts_for_slides(self):
        self.assertGreater(self.case["eq7_false_100ms"], 15)
        self.assertGreater(self.case["moving_false_100ms"], 10)

    def test_slides_are_found_soon(self):
        self.assertGreater(self.case["slips"], 30)
        self.assertGreaterEqual(self.found["slide_found_percent"], 97)
        self.assertLess(self.found["slide_latency_p95_ms"], 40)  # a full run: 32
        self.assertLess(self.found["slide_since_shown_p95_ms"], 20)  # 15
        self.assertLess(self.case["sliding_lasts_p95_ms"], 70)  # 58
        self.assertGreaterEqual(self.case["sliding_found_percent"], self.case["eq7_found_percent"])

    def test_slow_slides_are_found(self):
        self.assertGreaterEqual(self.case["slow_slips"], 1)
        self.assertEqual(self.case["sliding_slow_found_percent"], 100)
        self.assertEqual(self.case["moving_slow_found_percent"], 0)

    def test_the_same_seed_gives_the_same_and_another_another(self):
        with mock.patch.object(motion, "CALIBRATIONS", 2):
            once, again, other = (figures(seed, pads=1)["motion_cases"] for seed in (6, 6, 7))
        self.assertEqual(once, again)
        self.assertNotEqual(once, other)


if __name__ == "__main__":
    unittest.main()
