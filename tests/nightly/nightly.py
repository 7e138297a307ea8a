#!/usr/bin/python3
"""Runs one nightly job and writes what it measured.

    nightly.py --build build/host MODULE.JOB

MODULE is a file beside this one, JOB one of its functions with @job. Figures go to build/report/NAME.json, beside their goals and the figures of
the other jobs of that file. Exit status 1 if a count missed its goal. A figure of time or speed depends on this computer: it is written with its
verdict and fails no test.
"""

# real time: measures how long things take
import contextlib
import importlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
HOST = ROOT / "host_tools"
sys.path[:0] = map(str, (HOST / "report/shared", HOST / "python", *(ROOT / "tests" / name for name in ("support", "web", "checks"))))
import figures  # noqa: E402
from fingertip.files import InputError  # noqa: E402

REPORT = ROOT / "build/report"
PATIENCE_s = 120
OF_TIME = re.compile(r"_(us|ms|s|fps|percent|seconds|minutes|per_s|per_minute|from_nothing)$|_ready_|seconds_|minutes_")


def job(name, *goals):
    """A function of the build folder that returns figures for NAME.json; goals: (figure, '>=' or '<=', limit)."""

    def mark(function):
        function.name, function.goals = name, goals
        return function

    return mark


def run(*call, **options):
    """What it printed."""
    done = subprocess.run([str(part) for part in call], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise InputError(f"{' '.join(map(str, call[:3]))} ... failed: {(done.stderr or done.stdout).strip()[-800:]}")
    return done.stdout


def figures_of(*call, **options):
    """The JSON that a program writes to the file which is its last argument. Its exit status says what the figures say too."""
    with tempfile.TemporaryDirectory(prefix="nightly-") as folder:
        path = pathlib.Path(folder) / "figures.json"
        done = subprocess.run([*map(str, call), path], check=False, **options)
        if not path.exists():
            raise InputError(f"{call[1]} ended with status {done.returncode} and without figures")
        return json.loads(path.read_text(encoding="utf-8"))


def wait_for(condition, what):
    end_s = time.monotonic() + PATIENCE_s
    while not condition():
        if time.monotonic() > end_s:
            raise InputError(f"no {what} within {PATIENCE_s} s")
        time.sleep(0.02)


def busy_s(pid):
    """Processor time of a process."""
    cells = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(cells[11]) + int(cells[12])) / os.sysconf("SC_CLK_TCK")


class Programs(contextlib.ExitStack):
    """A folder and what runs there until the end."""

    def __init__(self, build):
        super().__init__()
        self.build = build
        self.folder = pathlib.Path(self.enter_context(tempfile.TemporaryDirectory(prefix="fingertip-")))
        self.callback(os.environ.pop, "XDG_RUNTIME_DIR", None)
        os.environ["XDG_RUNTIME_DIR"] = str(self.folder)  # for the package in this process
        self.environment = {name: value for name, value in os.environ.items() if name != "FINGERTIP_PORT"}

    def start(self, *call, **options):
        process = subprocess.Popen([str(part) for part in call], env=self.environment, **options)
        self.callback(self.end, process)
        return process

    @staticmethod
    def end(process):
        for number in (signal.SIGCONT, signal.SIGTERM):
            process.send_signal(number)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def fake_device(self, serial, *options):
        """The port of a program that sends what a fingertip of fifteen sensors sends."""
        port = self.folder / f"port_{serial}"
        self.start(self.build / "tests/support/fake_device", port, f"serial={serial}", "life=3600", *options)
        wait_for(port.is_symlink, "simulated fingertip")
        return port


def keep(name, found, goals):
    """Into NAME.json, which other jobs write to as well. The names of counts that missed their goal, and of figures that were not measured."""
    verdicts = {}
    for goal, sign, limit in goals:
        value = found.get(goal)
        met = None if value is None else bool(value <= limit if sign == "<=" else value >= limit)
        verdicts[goal] = {"goal": f"{sign} {limit:g}", "met": met}
        print(f"{ {True: 'met', False: 'MISSED', None: 'not measured'}[met]:12s} {goal:32s} {value}   goal {sign} {limit:g}")
    path = REPORT / f"{name}.json"
    whole = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    figures.add(path, {**json.loads(json.dumps(found)), "goals": {**whole.get("goals", {}), **verdicts}})
    return [goal for goal, verdict in verdicts.items() if not verdict["met"] and (verdict["met"] is None or not OF_TIME.search(goal))]


def main(argv):
    if len(argv) != 3 or argv[0] != "--build" or argv[2].count(".") != 1:
        print(__doc__, file=sys.stderr)
        return 2
    module, function = argv[2].split(".")
    measure = getattr(importlib.import_module(module), function)
    missed = keep(measure.name, measure(pathlib.Path(argv[1]).resolve()), measure.goals)
    print(f"{REPORT / measure.name}.json", *(f"missed: {goal}" for goal in missed), sep="\n")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.modules["nightly"] = sys.modules["__main__"]
    try:
        sys.exit(main(sys.argv[1:]))
    except InputError as error:
        sys.exit(f"nightly.py: {error}")
