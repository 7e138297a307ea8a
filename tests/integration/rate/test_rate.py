"""The report on rate and cost in its short form, at night: every figure is there and agrees with the others. By day one of its measurements.

usage: test_rate.py --build BUILD --boards BOARDS Measurement|Rate
"""

import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/rate"), str(ROOT / "tests/support")]
import rate  # noqa: E402, adds the path of the next
import emulated  # noqa: E402
import report_case  # noqa: E402

FIGURES = """parallel_fps_osr256 parallel_fps_osr1024 mux_fps_osr256 mux_fps_osr1024 latency_parallel_us latency_parallel_median_us
    latency_parallel_p99_us latency_parallel_p99_9_us latency_parallel_max_us idle_sleep_percent contact_sleep_percent flash_bytes
    ram_bytes code_in_sram_bytes stack_bytes raw_flash_bytes dropped""".split()


def assert_sound(case, row):
    """Of by_osr."""
    case.assertEqual(row["dropped"], 0)
    case.assertLess(row["fitted_per_s"] + row["held_per_s"], 1e6 / emulated.CONVERSION_us[row["osr"]])
    case.assertLess(row["held_per_s"], 0.05 * row["frames_per_s"])
    for times in (row["latency_us"], row["delivery_us"]):
        course = [times[name] for name in ("median", "p99", "p99_9", "max")]
        case.assertEqual(course, sorted(course))
    case.assertLess(row["latency_us"]["max"], row["delivery_us"]["max"])
    if row["board"] == "pico_parallel":  # what the latencies count from
        case.assertLess(abs(row["convert_us"] - 20 - emulated.CONVERSION_us[row["osr"]] * emulated.MARGIN), 20)
    case.assertGreater(row["latency_us"]["median"], row["read_us"] + row["condition_us"] + row["fit_us"])


class Measurement(unittest.TestCase):
    def test_it_is_sound_and_comes_out_the_same_again(self):
        """Emulated cycles and times, to the last one."""
        tools, board = emulated.Tools(report_case.OPTIONS.build, report_case.OPTIONS.boards), rate.PARALLEL
        folders = [self.enterContext(tempfile.TemporaryDirectory()) for _ in range(2)]
        path = emulated.scenario(folders[0], "wander", 3)
        once, again = (rate.by_osr({(board, 1024): emulated.Measurement(tools, folder, board, 1024, path, 1)}) for folder in folders)
        self.assertEqual(once, again)
        assert_sound(self, *once)


class Rate(report_case.ReportCase):
    NAME = "rate"

    @classmethod
    def setUpClass(cls):
        cls.make("--quick", "--seconds", "1")

    def test_every_figure_is_there_and_judged(self):
        for name in FIGURES:
            self.assertIsNotNone(self.found[name], name)
        for name, *_ in rate.GOALS:
            self.assertIsNotNone(self.found["goals"][name]["met"], name)
            self.assertRegex(self.printed, rf"(?m)^(met|MISSED) +{name} ")

    def test_every_frame_is_fitted_from_a_cold_start_and_arrives(self):
        for name in ("dropped", "sequence_gaps", "packets_dropped", "frames_skipped", "frames_missing", "unfitted"):
            self.assertEqual(self.found[name], 0, name)
        self.assertEqual(self.found["fit_iterations"], 4)
        for row in self.found["by_osr"]:
            assert_sound(self, row)

    def test_two_ways_of_counting_agree(self):
        """Cycles of the whole chip, frames of the stream; cycles and frames of the stage meter."""
        slip = next(row for row in self.found["scenes"] if row["scene"] == "slip")
        stages = slip["cycles_by_stage"].values()  # each rounded
        self.assertLessEqual(abs(sum(stages) - slip["cycles_of_frame"]), len(stages))
        self.assertLess(abs(slip["frames_per_s"]["256"] - self.found["parallel_fps_osr256"]), 3)
        by_chip = (1 - self.found["contact_sleep_percent"] / 100) * emulated.CLOCK_Hz / self.found["parallel_fps_osr256"]
        self.assertLess(abs(by_chip / slip["cycles_of_frame"] - 1), 0.02)

    def test_more_costs_more(self):
        raw, slip = (next(row for row in self.found["scenes"] if row["scene"] == scene) for scene in ("raw", "slip"))
        for name in ("flash_bytes", "ram_bytes", "code_in_sram_bytes", "stack_bytes", "cycles_of_frame"):
            self.assertLess(raw[name], slip[name], name)
        self.assertEqual(raw["cycles_by_stage"]["fit"], 0)
        self.assertGreater(slip["cycles_by_stage"]["fit"], 15000)

    def test_text_and_picture(self):
        self.assertEqual({(self.folder / name).read_bytes()[:8] for name in ("rate.png", "scenes.png")}, {b"\x89PNG\r\n\x1a\n"})
        text = (self.folder / "rate.md").read_text()
        for name, *_ in rate.GOALS:
            self.assertRegex(text, rf"\| {name} \| [0-9.]+ \| [<>]= [0-9]+ \| (met|MISSED) \|")
        tables = text.split("\n\n")
        for table in (part for part in tables if part.startswith("|")):
            self.assertEqual(len({line.count("|") for line in table.strip().split("\n")}), 1, table)

    def test_a_missing_build_and_a_wrong_number_are_one_line(self):
        self.assert_refused("is not there; build it", build=self.folder / "none")
        self.assert_refused("give 1 to 600", "--seconds", "0")


if __name__ == "__main__":
    report_case.main()
