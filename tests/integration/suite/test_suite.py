"""The report on the test suite counts what ctest counts, on small suites."""
import io
import pathlib
import subprocess
import sys
import tempfile
import unittest
from contextlib import redirect_stdout

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/report/suite"))
import suite  # noqa: E402

PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES NONE)
enable_testing()
add_test(NAME good COMMAND true)
add_test(NAME bad COMMAND {bad})
add_test(NAME absent COMMAND sh -c "exit 77")
set_tests_properties(good PROPERTIES LABELS quick)
set_tests_properties(bad PROPERTIES LABELS host)
set_tests_properties(absent PROPERTIES LABELS browser SKIP_RETURN_CODE 77)
"""


class Suite(unittest.TestCase):
    def small(self, bad):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        pathlib.Path(folder.name, "CMakeLists.txt").write_text(PROJECT.format(bad=bad), encoding="utf-8")
        build = pathlib.Path(folder.name, "build")
        subprocess.run(["cmake", "-S", folder.name, "-B", build], check=True, capture_output=True)
        return build

    def figures(self, build, whole=2, quick=1):
        with redirect_stdout(io.StringIO()) as said:
            steps = suite.Steps()
            figures = suite.summary(suite.run_often(build, None, whole, steps), suite.run_often(build, "quick", quick, steps), suite.labels(build))
        return figures, said.getvalue()

    def test_what_fails_is_counted_and_named_and_what_is_skipped_is_named(self):
        figures, said = self.figures(self.small("false"))
        self.assertEqual((figures["whole_runs"], figures["whole_failures"], figures["whole_failed"]), (2, 2, ["bad"]))
        self.assertEqual((figures["quick_runs"], figures["quick_failures"], figures["skipped"]), (1, 0, ["absent"]))
        self.assertEqual(set(figures["seconds_by_label"]), {"quick", "host", "browser"})
        self.assertIn("whole run 2 of 2, busy: ", said)
        self.assertIn("failed: bad", said)

    def test_seconds_are_of_quiet_runs(self):
        quiet, busy = {"a": (1.0, "run"), "b": (2.0, "run")}, {"a": (50.0, "run"), "b": (60.0, "fail")}
        figures = suite.summary([(True, 120.0, quiet), (False, 600.0, busy)], [(True, 30.0, quiet), (False, 90.0, quiet)], {"a": "quick", "b": "host"})
        self.assertEqual((figures["whole_test_seconds"], figures["whole_minutes"], figures["quick_seconds"]), (3.0, 2.0, 30.0))
        self.assertEqual((figures["whole_failures"], figures["whole_minutes_busy"], figures["longest"]), (1, 10.0, {"b": 2.0, "a": 1.0}))

    def test_no_test_at_all_is_an_error(self):
        with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
            file.write("<testsuite/>")
            file.flush()
            with self.assertRaisesRegex(suite.InputError, "no test was run"):
                suite.read_junit(file.name)

    def test_wrong_calls(self):
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(suite.InputError, "give 1 to 1000"):
            suite.main(["--build", folder, "-o", folder, "--whole", "0"])


if __name__ == "__main__":
    unittest.main()
