#!/usr/bin/python3
"""Whether the test suite is green on a busy machine as on a quiet one, and what it takes.

    suite.py --build build/host -o build/report

    suite.json    the figures by which that is judged, with their goals
    suite.md      the same to read

The whole suite and the quick tests run over and over, quiet and busy in turn: busy is beside four processes that compute and one
that writes to the disk all the time. Nothing is run again because it failed. Seconds are of quiet runs: ctest's times added up for
the tests, minutes and seconds on the wall for a run, on as many jobs as there are processors. Mutants are those of the last report
of reliability in the output folder.
"""
import contextlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python"), str(ROOT / "tests/checks")]
from check_sources import waits  # noqa: E402
from fingertip.files import InputError, run_tool, write_text  # noqa: E402
from goals import goal_table_md, judge  # noqa: E402
from reporting import Steps, finish, option_parser, output_folder, write_json  # noqa: E402
from tables import table_md  # noqa: E402

GOALS = (("whole_runs", ">=", 6), ("whole_failures", "<=", 0), ("quick_runs", ">=", 20), ("quick_failures", "<=", 0), ("quick_seconds", "<=", 60),
         ("whole_test_seconds", "<=", 1400), ("whole_minutes", "<=", 12), ("sleeps", "<=", 0), ("retries", "<=", 0),
         ("mutants_survive_percent", "<=", 4))
BUSY_PROCESSES = 4
LONGEST = 15  # tests that are listed
BURN = "while True: pass"
# Rewrites a file of 256 MB again and again, to the disk.
WRITE = """
import os, sys
block = os.urandom(1 << 20)
with open(sys.argv[1], "wb", buffering=0) as file:
    while True:
        file.seek(0)
        for _ in range(256):
            file.write(block)
        os.fsync(file)
"""


@contextlib.contextmanager
def busy_machine(folder):
    calls = [(BURN,)] * BUSY_PROCESSES + [(WRITE, os.path.join(folder, "busy"))]
    processes = [subprocess.Popen([sys.executable, "-c", *call]) for call in calls]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@contextlib.contextmanager
def quiet_machine(_):
    yield


def read_junit(path):
    """name -> (seconds, "run", "fail" or "skipped") of each test that ctest wrote down."""
    tests = {}
    for case in xml.etree.ElementTree.parse(path).iter("testcase"):
        status = {"run": "run", "fail": "fail"}.get(case.get("status"), "skipped")
        tests[case.get("name")] = (float(case.get("time", 0)), status)
    if not tests:
        raise InputError(f"{path}: no test was run")
    return tests


def labels(build):
    """name -> label of each test."""
    done = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True)
    named = {}
    for test in json.loads(done.stdout)["tests"]:
        for each in test.get("properties", []):
            if each["name"] == "LABELS":
                named[test["name"]], = each["value"]
    return named


def run_suite(build, only, machine):
    """All tests, or those of a label, once. Seconds on the wall, and what read_junit returns."""
    with tempfile.TemporaryDirectory(prefix="fingertip-suite-") as folder, machine(folder):
        result = os.path.join(folder, "result.xml")
        begun_s = time.monotonic()
        subprocess.run(["ctest", "--test-dir", build, "-j", str(os.cpu_count()), "--output-on-failure", "--output-junit", result,
                        *(["-L", f"^{only}$"] if only else [])], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return time.monotonic() - begun_s, read_junit(result)


def run_often(build, only, count, steps):
    """Of each run: is it quiet, its seconds, its tests."""
    runs = []
    for i in range(count):
        is_quiet = i % 2 == 0
        seconds, tests = run_suite(build, only, quiet_machine if is_quiet else busy_machine)
        runs.append((is_quiet, seconds, tests))
        failed = [name for name, (_, status) in tests.items() if status == "fail"]
        steps.say(f"{only or 'whole'} run {i + 1} of {count}, {'quiet' if is_quiet else 'busy'}: {seconds / 60:.1f} min, {len(tests)} tests"
                  + (f", failed: {', '.join(failed)}" if failed else ""))
    return runs


def failed_in(runs):
    return sorted({name for _, _, tests in runs for name, (_, status) in tests.items() if status == "fail"})


def summary(whole, quick, named):
    """Figures of the runs. named: name -> label."""
    quiet = [(seconds, tests) for is_quiet, seconds, tests in whole if is_quiet]
    times = {name: max(tests[name][0] for _, tests in quiet if name in tests) for _, tests in quiet for name in tests}
    by_label = {}
    for name, seconds in times.items():
        by_label[named.get(name, "none")] = by_label.get(named.get(name, "none"), 0) + seconds
    quick_s = [seconds for is_quiet, seconds, _ in quick if is_quiet]
    return {
        "whole_runs": len(whole), "whole_failures": sum(any(status == "fail" for _, status in tests.values()) for _, _, tests in whole),
        "whole_failed": failed_in(whole), "whole_tests": len(times),
        "whole_test_seconds": max((sum(s for s, _ in tests.values()) for _, tests in quiet), default=None),
        "whole_minutes": max((seconds / 60 for seconds, _ in quiet), default=None),
        "whole_minutes_busy": max((seconds / 60 for is_quiet, seconds, _ in whole if not is_quiet), default=None),
        "quick_runs": len(quick), "quick_failures": sum(any(status == "fail" for _, status in tests.values()) for _, _, tests in quick),
        "quick_failed": failed_in(quick), "quick_seconds": max(quick_s, default=None),
        "skipped": sorted({name for _, _, tests in whole for name, (_, status) in tests.items() if status == "skipped"}),
        "seconds_by_label": dict(sorted(by_label.items())),
        "longest": dict(sorted(times.items(), key=lambda item: -item[1])[:LONGEST]),
    }


def surviving_mutants(out):
    """Percent, by the last report of reliability; None: there is none."""
    path = out / "reliability.json"
    return json.loads(path.read_text(encoding="utf-8")).get("mutants_survive_percent") if path.is_file() else None


def text(found):
    tests = [[name, f"{seconds:.1f}"] for name, seconds in found["longest"].items()]
    parts = [[label, f"{seconds:.0f}"] for label, seconds in found["seconds_by_label"].items()]
    failed = sorted({*found["whole_failed"], *found["quick_failed"]})
    return "\n".join(["# The test suite", "", "Written by `sh cmake/bootstrap.sh report suite`.", "", *goal_table_md(found), "",
                      f"Failed: {', '.join(failed) or 'none'}. Skipped: {', '.join(found['skipped']) or 'none'}.", "",
                      *table_md(("label", "seconds"), parts), "", *table_md(("longest tests", "seconds"), tests), ""])


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--whole", type=int, default=6, metavar="N", help="runs of the whole suite (default: %(default)s)")
    parser.add_argument("--quick", type=int, default=20, metavar="N", help="runs of the quick tests (default: %(default)s)")
    options = parser.parse_args(argv)
    for name in ("whole", "quick"):
        if not 1 <= getattr(options, name) <= 1000:
            raise InputError(f"--{name} {getattr(options, name)} is out of range; give 1 to 1000")
    out = output_folder(options)
    steps = Steps()
    found = waits(ROOT)
    figures = summary(run_often(options.build, None, options.whole, steps), run_often(options.build, "quick", options.quick, steps),
                      labels(options.build))
    figures |= {"sleeps": sum(what == "sleep" for _, _, what in found), "retries": sum(what == "retry" for _, _, what in found),
                "mutants_survive_percent": surviving_mutants(out)}
    figures = judge(figures, GOALS)
    write_json(out / "suite.json", figures)
    write_text(out / "suite.md", text(figures))
    return finish(figures, options, ("suite.json", "suite.md"))


if __name__ == "__main__":
    sys.exit(run_tool("suite.py", main))
