#!/usr/bin/python3
"""Whether the test suite is green on a busy machine as on a quiet one, and what it takes.

    suite.py --build build/host -o build/report

    suite.json      the figures by which that is judged, with their goals
    suite.md        the same to read
    suite_failed    what the tests that failed said, a file for each

The whole suite and the quick tests run over and over, first quiet, then busy: beside as many processes that compute as there are
processors, and one that writes to the disk all the time. The files are written after each run, so an interruption loses one run. Nothing is run again because it failed. A
test that cannot be run has failed; skipped is only what says so itself. Seconds are of quiet runs: ctest's times added up for the tests,
minutes and seconds on the wall for a run, on as many jobs as there are processors. Mutants are those of the last report of reliability in the output folder.
"""

import collections
import contextlib
import json
import os
import pathlib
import re
import shutil
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

GOALS = (
    ("whole_runs", ">=", 6),
    ("whole_failures", "<=", 0),
    ("quick_runs", ">=", 20),
    ("quick_failures", "<=", 0),
    ("quick_seconds", "<=", 60),
    ("whole_test_seconds", "<=", 1400),
    ("whole_minutes", "<=", 12),
    ("sleeps", "<=", 0),
    ("retries", "<=", 0),
    ("mutants_survive_percent", "<=", 4),
)
LONGEST = 15  # tests that are listed
# Both end with the report, however that ends: its process is the first argument.
BURN = """
import os, sys
while os.getppid() == int(sys.argv[1]):
    for _ in range(1000000):
        pass
"""
# Rewrites a file of 256 MB again and again, to the disk.
WRITE = """
import os, sys
block = os.urandom(1 << 20)
with open(sys.argv[2], "wb", buffering=0) as file:
    while os.getppid() == int(sys.argv[1]):
        file.seek(0)
        for _ in range(256):
            file.write(block)
        os.fsync(file)
"""


@contextlib.contextmanager
def busy_machine(folder):
    own = str(os.getpid())
    calls = [(BURN, own)] * os.cpu_count() + [(WRITE, own, os.path.join(folder, "busy"))]
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


Test = collections.namedtuple("Test", "seconds status output")  # status: "run", "fail" or "skipped"
# How test programs say that a part of them was skipped, and how much.
IN_PART = re.compile(r"^OK \(.*skipped=(\d+)|^\[  SKIPPED \] (\d+) test|^(?:#|\u2139) skipped ([1-9]\d*)|\b([1-9]\d*) Ignored", re.M)


def status_of(case):
    """Not run is skipped if the test itself said so, and a failure if its program or its fixture is missing."""
    status = case.get("status")
    if status == "notrun":
        skipped = case.find("skipped")
        return "skipped" if skipped is not None and skipped.get("message", "").startswith("SKIP_") else "fail"
    return {"run": "run", "disabled": "skipped"}.get(status, "fail")


def read_junit(path):
    """name -> Test, of each that ctest wrote down."""
    tests = {
        case.get("name"): Test(float(case.get("time", 0)), status_of(case), case.findtext("system-out") or "")
        for case in xml.etree.ElementTree.parse(path).iter("testcase")
    }
    if not tests:
        raise InputError(f"{path}: no test was run")
    return tests


def labels(build):
    """name -> label of each test."""
    done = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True)
    tests = json.loads(done.stdout)["tests"] if done.returncode == 0 else []
    if not tests:
        raise InputError(f"{build}: no tests are there; sh cmake/bootstrap.sh test builds them")
    return {test["name"]: each["value"][0] for test in tests for each in test.get("properties", []) if each["name"] == "LABELS"}


def run_suite(build, only, machine):
    """All tests, or those of a label, once. Seconds on the wall, and what read_junit returns."""
    build = os.path.abspath(build)  # ctest takes paths as of its folder
    with tempfile.TemporaryDirectory(prefix="suite-", dir=build) as folder, machine(folder):  # on the disk that the tests are on
        result = os.path.join(folder, "result.xml")
        begun_s = time.monotonic()
        done = subprocess.run(
            [
                "ctest",
                "--test-dir",
                build,
                "-j",
                str(os.cpu_count() + 1),
                "--output-junit",
                result,
                "--test-output-truncation",
                "head",
                *(["-L", f"^{only}$"] if only else []),
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        seconds = time.monotonic() - begun_s
        if not os.path.exists(result):
            return seconds, {"ctest": Test(seconds, "fail", f"ended with status {done.returncode}\n{done.stderr}")}
        return seconds, read_junit(result)


def plan(whole, quick):
    """(label or None, is it quiet) of each run: quiet ones first, so that the machine must be left alone for the first part only."""
    return [
        (only, is_quiet)
        for is_quiet in (True, False)
        for only, count in (("quick", quick), (None, whole))
        for _ in range((count + 1) // 2 if is_quiet else count // 2)
    ]


def run_all(build, planned, steps, kept):
    """Yields, after each run, all runs so far: whole and quick, each a list of (is it quiet, its seconds, its tests).
    kept: folder for what failed tests say."""
    runs = {None: [], "quick": []}
    for i, (only, is_quiet) in enumerate(planned):
        machine = "quiet" if is_quiet else "busy"
        seconds, tests = run_suite(build, only, quiet_machine if is_quiet else busy_machine)
        runs[only].append((is_quiet, seconds, tests))
        failed = [name for name, test in tests.items() if test.status == "fail"]
        for name in failed:
            kept.mkdir(exist_ok=True)
            write_text(kept / f"{only or 'whole'}-{len(runs[only])}-{machine}-{name}.txt", tests[name].output)
        steps.say(
            f"run {i + 1} of {len(planned)}, {only or 'whole'}, {machine}: {seconds / 60:.1f} min, {len(tests)} tests"
            + (f", failed: {', '.join(failed)}" if failed else "")
        )
        yield runs[None], runs["quick"]


def named_with(status, runs):
    return sorted({name for _, _, tests in runs for name, test in tests.items() if test.status == status})


def failures(runs):
    """How many runs."""
    return sum(any(test.status == "fail" for test in tests.values()) for _, _, tests in runs)


def skipped_in_part(runs):
    """name -> how many of its parts a test skipped, at most."""
    found = {}
    for _, _, tests in runs:
        for name, test in tests.items():
            parts = sum(int(next(filter(None, match.groups()))) for match in IN_PART.finditer(test.output))
            if parts and test.status == "run":
                found[name] = max(parts, found.get(name, 0))
    return dict(sorted(found.items()))


def summary(whole, quick, named):
    """Figures of the runs. named: name -> label."""
    quiet = [(seconds, tests) for is_quiet, seconds, tests in whole if is_quiet]
    times = {name: max(tests[name].seconds for _, tests in quiet if name in tests) for _, tests in quiet for name in tests}
    by_label = {}
    for name, seconds in times.items():
        by_label[named.get(name, "none")] = by_label.get(named.get(name, "none"), 0) + seconds
    return {
        "whole_runs": len(whole),
        "whole_failures": failures(whole),
        "whole_failed": named_with("fail", whole),
        "whole_tests": len(times),
        "whole_test_seconds": max((sum(test.seconds for test in tests.values()) for _, tests in quiet), default=None),
        "whole_minutes": max((seconds / 60 for seconds, _ in quiet), default=None),
        "whole_minutes_busy": max((seconds / 60 for is_quiet, seconds, _ in whole if not is_quiet), default=None),
        "quick_runs": len(quick),
        "quick_failures": failures(quick),
        "quick_failed": named_with("fail", quick),
        "quick_seconds": max((seconds for is_quiet, seconds, _ in quick if is_quiet), default=None),
        "skipped": named_with("skipped", whole),
        "skipped_in_part": skipped_in_part(whole),
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
    in_part = ", ".join(f"{name} ({parts})" for name, parts in found["skipped_in_part"].items())
    return "\n".join(
        [
            "# The test suite",
            "",
            "Written by `sh cmake/bootstrap.sh report suite`.",
            "",
            *goal_table_md(found),
            "",
            f"Failed: {', '.join(failed) or 'none'}. Skipped: {', '.join(found['skipped']) or 'none'}. Skipped in part: {in_part or 'none'}.",
            "",
            *table_md(("label", "seconds"), parts),
            "",
            *table_md(("longest tests", "seconds"), tests),
            "",
        ]
    )


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--whole", type=int, default=6, metavar="N", help="runs of the whole suite (default: %(default)s)")
    parser.add_argument("--quick", type=int, default=20, metavar="N", help="runs of the quick tests (default: %(default)s)")
    options = parser.parse_args(argv)
    for name in ("whole", "quick"):
        if not 1 <= getattr(options, name) <= 1000:
            raise InputError(f"--{name} {getattr(options, name)} is out of range; give 1 to 1000")
    named = labels(options.build)
    out = output_folder(options)
    kept = out / "suite_failed"
    shutil.rmtree(kept, ignore_errors=True)  # of the last report
    steps = Steps()
    found = waits(ROOT)
    counted = {
        "sleeps": sum(what == "sleep" for _, _, what in found),
        "retries": sum(what == "retry" for _, _, what in found),
        "mutants_survive_percent": surviving_mutants(out),
    }
    for whole, quick in run_all(options.build, plan(options.whole, options.quick), steps, kept):
        figures = judge(summary(whole, quick, named) | counted, GOALS)
        write_json(out / "suite.json", figures)
        write_text(out / "suite.md", text(figures))
    return finish(figures, options, ("suite.json", "suite.md"))


if __name__ == "__main__":
    sys.exit(run_tool("suite.py", main))
