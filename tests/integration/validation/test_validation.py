"""The published experiments in short: the chain runs, and what it finds is what physics and the method give.

usage: test_validation.py --build BUILD --boards BOARDS
"""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
import report_case  # noqa: E402


class Validation(report_case.ReportCase):
    NAME = "validation"

    @classmethod
    def setUpClass(cls):
        short = "--indenters sphere6,cube6,sphere12 --scale 0.05 --pads 2 --emulated-seconds 4 --cards 0".split()
        cls.make("--tables", pathlib.Path(report_case.OPTIONS.build) / "contact_tables", *short)

    def test_figures_are_what_physics_and_the_method_give(self):
        for name, low, high in (
            ("samples", 8000, self.found["frames"]),
            ("h12_gain0_median_mm", 0.02, 0.12),
            ("h12_gain10_median_mm", 2 * self.found["h12_gain0_median_mm"], 0.6),
            ("force_mape_raw_percent", 7.8, 10.8),
            ("force_mape_scaled_gain0_percent", 0, 0.5),
            ("h6_prior_p99_mm", 0, 1.5),
            ("h6_bad_unflagged_percent", -1, 0.5),
            ("saturated_samples", 100, math.inf),
            ("saturated_median_mm", 0, 0.1),
            ("slip_steps", 100, math.inf),
            ("slip_success_percent", 85, 100),
            ("emulated_frames", 300, math.inf),
            ("emulated_frames_different", -1, 1),
        ):
            with self.subTest(name):
                self.assertGreater(self.found[name], low)
                self.assertLess(self.found[name], high)
        self.assertEqual(len(self.found["h12_gain10_median_mm_per_pad"]), 2)

    def test_a_stiff_pad_needs_its_width_where_few_sensors_feel(self):
        stiff = {(row["margin_mm"], row["prior"]): row for row in self.found["stiff"] if row["case"] == "gain0"}
        self.assertLess(stiff[0, False]["bad_percent"], 2)
        self.assertGreater(stiff[4.5, False]["bad_percent"], 5)
        self.assertLess(stiff[4.5, True]["bad_percent"], 0.5 * stiff[4.5, False]["bad_percent"])
        self.assertLess(stiff[4.5, True]["bad_unflagged_percent"], 0.5)

    def test_a_dip_costs_until_a_calibration_finds_it(self):
        trust = {row["case"]: row for row in self.found["taps_trust"]}
        self.assertGreater(trust["dip"]["warned_percent"], 3 * trust["gain10"]["warned_percent"])
        self.assertLess(trust["dip calibrated"]["warned_percent"], 0.5 * trust["dip"]["warned_percent"])
        self.assertGreater(self.found["force_scale_dip"], 1.1 * self.found["force_scale_gain10"])
        self.assertLess(self.found["force_mape_dip_calibrated_percent"], 2)
        self.assertLess(self.found["h12_dip_calibrated_median_mm"], 0.13)
        self.assertLess(self.found["h12_dip_calibrated_median_mm"], 0.5 * self.found["h12_dip_median_mm"])
        stiff = {(row["margin_mm"], row["case"], row["prior"]): row for row in self.found["stiff"]}
        self.assertGreater(stiff[4.5, "dip", False]["median_mm"], 1.5 * stiff[4.5, "gain10", False]["median_mm"])
        self.assertEqual({row["case"] for row in self.found["force"]}, {"gain0", "gain10", "dip", "gain10 calibrated", "dip calibrated"})
        self.assertGreater(self.found["slip_success_dip_percent"], 85)
        self.assertGreater(self.found["calibrated_pads"], 5)

    def test_unequal_sensors_cost_most(self):
        budget = {row["effect"]: row["median_mm"] for row in self.found["budget"]}
        spreads = [budget[f"gain spread {gain} %"] for gain in (5, 10, 15)]
        self.assertEqual(spreads, sorted(spreads))
        self.assertGreater(spreads[1], 1.5 * budget["hysteresis 3 %"])

    def test_rubber_that_remembers_and_a_cold_beginning_are_in_the_budget(self):
        budget = {row["effect"]: row for row in self.found["budget"]}
        nothing = budget["nothing but the model"]
        self.assertGreater(budget["each sensor's own part of a hold, 1 %"]["force"]["p95_percent"], 1.2 * nothing["force"]["p95_percent"])
        self.assertGreater(budget["after-effect of 2 %"]["p95_mm"], 1.2 * nothing["p95_mm"])
        self.assertGreater(budget["after-effect of 2 %"]["force"]["mape_percent"], 1.5 * nothing["force"]["mape_percent"])
        cold = budget["warming across a branch of the compensation"]
        self.assertGreater(cold["force"]["mape_percent"], 1.1 * nothing["force"]["mape_percent"])
        self.assertLess(cold["median_mm"], 1.5 * nothing["median_mm"])

    def test_pictures_and_text(self):
        text = (self.folder / "validation.md").read_text()
        self.assertIn("validation_force.png", text)
        self.assertGreater((self.folder / "validation_force.png").stat().st_size, 10000)
        self.assertNotIn("nan", text)
        self.assertFalse((self.folder / "validation_work").exists())

    def test_a_missing_build_is_said(self):
        self.assert_refused("cmake --build", build=self.folder, boards="none")


if __name__ == "__main__":
    report_case.main()
