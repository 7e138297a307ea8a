"""The report on the test suite counts what ctest counts, on small suites."""

import io
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from contextlib import redirect_stdout

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/report/suite"))
import suite  # noqa: E402

PATIENCE_s = 300
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
            *_, runs = suite.run_all(build, suite.plan(whole, quick), steps, build / "failed")
            figures = suite.summary(*runs, suite.labels(build))
        return figures, said.getvalue()

    def test_what_fails_is_counted_and_named_and_what_is_skipped_is_named(self):
        figures, said = self.figures(self.small("false"))
        self.assertEqual((figures["whole_runs"], figures["whole_failures"], figures["whole_failed"]), (2, 2, ["bad"]))
        self.assertEqual((figures["quick_runs"], figures["quick_failures"], figures["skipped"]), (1, 0, ["absent"]))
        self.assertEqual(set(figures["seconds_by_label"]), {"quick", "host", "browser"})
        self.assertIn("run 3 of 3, whole, busy: ", said)
        self.assertIn("failed: bad", said)

    def test_what_cannot_be_run_has_failed(self):
        for bad in (
            "/nowhere/program",
            "true)\nadd_test(NAME set_up COMMAND false)\nset_tests_properties(set_up PROPERTIES FIXTURES_SETUP rubber)\n"
            "set_tests_properties(bad PROPERTIES FIXTURES_REQUIRED rubber",
        ):
            figures, _ = self.figures(self.small(bad), whole=1)
            self.assertIn("bad", figures["whole_failed"])
            self.assertEqual((figures["whole_failures"], figures["skipped"]), (1, ["absent"]))

    def test_what_a_failed_test_said_is_kept(self):
        build = self.small("sh -c \"echo 'the reason'; exit 1\"")
        self.figures(build)
        self.assertEqual(sorted(path.name for path in (build / "failed").iterdir()), ["whole-1-quiet-bad.txt", "whole-2-busy-bad.txt"])
        self.assertIn("the reason", (build / "failed/whole-1-quiet-bad.txt").read_text())

    def test_a_run_that_ctest_does_not_end_has_failed(self):
        figures, said = self.figures(self.small('sh -c "kill -9 $PPID"'), whole=1, quick=1)
        self.assertEqual((figures["whole_failures"], figures["whole_failed"], figures["quick_failures"]), (1, ["ctest"], 0))
        self.assertIn("failed: ctest", said)

    def test_tests_that_skip_a_part_are_named_with_how_many(self):
        said = {
            "OK (skipped=2)": 2,
            "OK (expected failures=1, skipped=3)": 3,
            "[  SKIPPED ] 1 test, listed below:": 1,
            "# skipped 4": 4,
            "12 Tests 0 Failures 5 Ignored": 5,
            "OK": 0,
            "# skipped 0": 0,
            "12 Tests 0 Failures 0 Ignored": 0,
        }
        tests = {line: suite.Test(1.0, "run", f"before\n{line}\nafter") for line in said}
        self.assertEqual(suite.skipped_in_part([(True, 1.0, tests)]), {line: parts for line, parts in said.items() if parts})

    def test_what_is_said_at_the_end_of_much_is_seen(self):
        figures, _ = self.figures(self.small("sh -c \"seq 2000; echo 'OK (skipped=2)'\""), whole=1)
        self.assertEqual(figures["skipped_in_part"], {"bad": 2})

    def test_the_busy_machine_is_quiet_again_even_if_the_report_is_killed(self):
        with tempfile.TemporaryDirectory() as folder:
            code = f"import os, suite\nwith suite.busy_machine({folder!r}):\n    os.kill(os.getpid(), 9)"
            killed = subprocess.Popen(
                [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, stdout=subprocess.PIPE
            )
            killed.communicate(timeout=PATIENCE_s)  # all that it started holds this open

    def test_seconds_are_of_quiet_runs(self):
        def tests(a_s, b_s, b_status="run"):
            return {"a": suite.Test(a_s, "run", ""), "b": suite.Test(b_s, b_status, "")}

        quiet, busy = tests(1.0, 2.0), tests(50.0, 60.0, "fail")
        figures = suite.summary(
            [(True, 120.0, quiet), (False, 600.0, busy)], [(True, 30.0, quiet), (False, 90.0, quiet)], {"a": "quick", "b": "host"}
        )
        self.assertEqual((figures["whole_test_seconds"], figures["whole_minutes"], figures["quick_seconds"]), (3.0, 2.0, 30.0))
        self.assertEqual((figures["whole_failures"], figures["whole_minutes_busy"], figures["longest"]), (1, 10.0, {"b": 2.0, "a": 1.0}))

    def test_quiet_runs_come_first_and_half_are_busy(self):
        self.assertEqual(suite.plan(3, 2), [("quick", True), (None, True), (None, True), ("quick", False), (None, False)])

    def test_what_ran_before_an_interruption_is_written(self):
        build = self.small("true")
        reports = []
        with (
            tempfile.TemporaryDirectory() as folder,
            redirect_stdout(io.StringIO()),
            unittest.mock.patch.object(suite, "write_json", lambda path, figures: reports.append(figures)),
        ):
            suite.main(["--build", os.path.relpath(build), "-o", folder, "--whole", "2", "--quick", "1"])
        self.assertEqual(
            [(report["quick_runs"], report["whole_runs"], report["whole_failures"]) for report in reports],
            [(1, 0, 0), (1, 1, 0), (1, 2, 0)],
        )

    def test_no_test_at_all_is_an_error(self):
        with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
            file.write("<testsuite/>")
            file.flush()
            with self.assertRaisesRegex(suite.InputError, "no test was run"):
                suite.read_junit(file.name)

    def test_a_folder_without_tests_is_said_at_once(self):
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(suite.InputError, "no tests"):
            suite.main(["--build", folder, "-o", folder])

    def test_wrong_calls(self):
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(suite.InputError, "give 1 to 1000"):
            suite.main(["--build", folder, "-o", folder, "--whole", "0"])


if __name__ == "__main__":
    unittest.main()
