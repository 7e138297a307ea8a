"""The report's contact shapes on few pads: the figures are there, repeatable, and as good as the shapes are meant to be.

usage: test_two_shapes.py BUILD [unittest arguments]
"""

import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools/report" / part) for part in ("shared", "measure", "two", "../python", "../../tests/support")]
import edges  # noqa: E402
import shapes  # noqa: E402
from contacts import Contacts  # noqa: E402
from figures import assert_within  # noqa: E402

# (key, least, most): what a full run finds on seed 40000, of edges on 5000, with room for few pads.
FOUND = (
    ("two_right_percent_8mm", 27, 100),
    ("two_right_percent_12mm", 94, 100),
    ("two_right_percent_10mm_3to1", 80, 100),
    ("one_called_two_percent", 0, 1),
    ("edge_angle_p50_deg_20mm", 0, 1.5),
    ("edge_angle_p50_deg_10mm", 0, 3),
    ("silent_over_1mm_percent", 0, 2.5),
    ("edge_on_round_percent", 0, 5),
    ("edge_on_lime_and_finger_percent", 0, 10),
    ("edges_found_percent", 80, 100),
    ("angle_cover_1sd_percent_min", 30, 90),
    ("angle_cover_1sd_percent_max", 45, 90),
)


class TwoShapes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = shapes.figures(Contacts(BUILD), seed=3, pads=10) | edges.figures(Contacts(BUILD), seed=3, pads=4)

    def test_figures(self):
        assert_within(self, self.found, FOUND)

    def test_every_touch_is_called_something(self):
        for row in self.found["touches"]:
            with self.subTest(row["case"]):
                self.assertEqual(row["touches"], 200)
                called = sum(row[name] for name in ("one", "pulled", "long", "two", "none", "undecided"))
                self.assertAlmostEqual(called, 100, places=6)
                self.assertEqual(row["undecided"], 0)
                self.assertLessEqual(row["two_and_right"], row["two"])
                self.assertLessEqual(row["silent"] + row["warned"], 100)

    def test_round_touches_are_one_and_far_pairs_two(self):
        rows = {row["case"]: row for row in self.found["touches"]}
        self.assertGreater(rows["round"]["one"], 95)
        self.assertLess(rows["round"]["off_p95_mm"], 0.7)
        for moment in ("", "_first"):
            self.assertGreater(rows["two, 12 mm, 1:1"][f"two_and_right{moment}"], 94)
            self.assertGreater(rows["two, 20 mm, 1:1"][f"two_and_right{moment}"], 95)
            self.assertLess(rows["edge20"][f"two{moment}"], 1)
            self.assertLessEqual(rows["cube15"][f"two{moment}"], 1)
            self.assertGreater(rows["two, 8 mm, 3:1, cubes"][f"two_and_right{moment}"], 60)
        self.assertGreater(rows["two, 8 mm, 1:1"]["long"] + rows["two, 8 mm, 1:1"]["two"], 98)

    def test_repeatable_and_seeded(self):
        contacts, case = Contacts(BUILD), shapes.Case("round", ("sphere6",))
        rows = [shapes.row_of(contacts, case, shapes.dipped_pads(contacts, 2, seed), seed) for seed in (3, 3, 4)]
        self.assertEqual(rows[0], rows[1])
        self.assertNotEqual(rows[0], rows[2])


if __name__ == "__main__":
    BUILD = sys.argv.pop(1)
    unittest.main(verbosity=2)
