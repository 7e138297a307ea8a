"""real.py on recordings made here, of which the truth is known; the real ones are of others."""

import cmath
import hashlib
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / folder) for folder in ("report/real", "report/measure", "report/shared", "python")]
BUILD = pathlib.Path(sys.argv.pop())

import grids  # noqa: E402
import pace  # noqa: E402

PITCH_MM, WIDTH_MM, PEAK_PA = 6.75, 4.0, 20e3
TURN = math.radians(3.0)  # of the gantry against the board


def write_grid(path, gains=(1.0,) * 8):
    """Gaussian presses every millimetre, as the gantry's file has them: x, y, readings in PSI."""
    up = [(k - 1.5) * PITCH_MM for k in range(4)]
    layout = [(PITCH_MM / 2, y) for y in up] + [(-PITCH_MM / 2, y) for y in reversed(up)]
    lines = ["x_pos,y_pos," + ",".join(f"s{k}" for k in range(8))]
    for row in range(29):
        for column in range(16):
            turn = cmath.rect(1, TURN)
            stage = complex(round((turn * complex(column - 7.5, row - 14)).real + 14, 6), row)  # rows differ by the stage's y
            at = (stage - complex(14, 16)) / turn
            shares = [gain * math.exp(-(abs(complex(x, y) - at) ** 2) / (2 * WIDTH_MM**2)) for gain, (x, y) in zip(gains, layout)]
            values = (stage.real, stage.imag, *(share * PEAK_PA / grids.PA_PER_PSI for share in shares))
            lines.append(",".join(f"{value:.9e}" for value in values))
    path.write_text("\n".join(lines) + "\n")


class Real(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "data/below").mkdir(parents=True)
        self.grid = self.folder / "data/below/grid.csv"
        write_grid(self.grid)
        self.sources = {
            name: {"repository": "a/b", "commit": "c", "terms": "ours", "what": "made by a test", "files": files}
            for name, files in (
                ("grids", [{"name": "grid.csv", "key": "made", "pitch_mm": PITCH_MM, "part": "judges", "sha256": self.checksum()}]),
                ("strips", []),
            )
        }

    def checksum(self):
        return hashlib.sha256(self.grid.read_bytes()).hexdigest()

    def run_tool(self, error=""):
        path = self.folder / "sources.json"
        path.write_text(json.dumps(self.sources))
        words = [sys.executable, ROOT / "host_tools/report/real/real.py", "--build", BUILD, "-o", self.folder / "out", "--pads", "1"]
        done = subprocess.run([*words, "--sources", path, self.folder / "data"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1 if error else 0, done.stderr)
        self.assertIn(error, done.stderr)
        return None if error else json.loads((self.folder / "out/real.json").read_text())

    def test_the_layout_is_found_turned(self):
        grid = grids.Grid(self.grid, PITCH_MM)
        self.assertLess(grid.places_off_mm.max(), 0.01)
        self.assertLess(abs(grid.width_mm - WIDTH_MM).max(), 0.01)
        self.assertFalse(grid.judged.all())
        self.assertFalse((grid.inside & grid.outside).any())

    def test_presses_of_a_gaussian_are_found_where_they_are(self):
        found = self.run_tool()
        self.assertLess(found["raw_inside_p50_mm"], 0.02)
        self.assertLess(found["grids"][0]["raw"]["force_scatter_percent"], 1.0)
        self.assertTrue(found["goals"]["raw_inside_p50_mm"]["met"])
        self.assertIsNone(found["goals"]["phantom_percent_1308"]["met"])
        paced = {(row["presses"], row["way"], row["iterations"]): row for row in found["pace"]}
        self.assertEqual({key[1:] for key in paced if key[0] == "twin"}, {(way, n) for way, _ in pace.WAYS for n in pace.ITERATIONS})
        self.assertEqual(paced["twin", "published", pace.PUBLISHED_ITERATIONS]["run_time"], 1.0)
        self.assertLess(paced["twin", "calibrated", 4]["p50_mm"], paced["twin", "published", 4]["p50_mm"])
        self.assertIn("| a/b | c | ours | made by a test |", (self.folder / "out/real.md").read_text())

    def test_gains_that_differ_move_them_and_a_calibration_mends_it(self):
        write_grid(self.grid, (1.2, 0.8, 1.1, 0.9, 1.0, 1.2, 0.8, 1.0))
        self.sources["grids"]["files"][0]["sha256"] = self.checksum()
        row = self.run_tool()["grids"][0]
        self.assertGreater(row["raw"]["inside_p50_mm"], 0.3)
        self.assertLess(row["calibrated"]["inside_p50_mm"], 0.2 * row["raw"]["inside_p50_mm"])

    def test_another_file_of_that_name_is_not_taken(self):
        self.sources["grids"]["files"][0]["sha256"] = "0" * 64
        self.run_tool("none of the recordings of sources.json is there")

    def test_a_file_of_other_columns_is_refused_by_its_name(self):
        self.grid.write_text("1,2,3\n")
        self.sources["grids"]["files"][0]["sha256"] = self.checksum()
        self.run_tool("grid.csv: rows are not x, y and eight readings")


if __name__ == "__main__":
    unittest.main()
