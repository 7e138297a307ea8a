"""How soon `fingertip simulate` is ready, how many frames a program gets of it, and whether the README's example runs on it."""

import contextlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time

from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
TOOL = "host_tools/tool/cli/fingertip"
SECONDS = 10
STARTS = 5  # of which the best counts: this computer may have other things to do
LINES = 20  # of the example
PATIENCE_s = 60
GOALS = (
    ("readme_words", "<=", 600),
    ("help_ms", "<=", 30),
    ("simulate_ready_s", "<=", 2),
    ("simulate_fps", ">=", 1300),
    ("simulate_lost", "<=", 0),
    ("python_example_runs", ">=", 1),
)


def example(readme):
    """The first block of the README that is a Python program."""
    for block in re.findall(r"(?:^(?:    .*)?\n)+", readme, re.M):
        if "from fingertip import" in block:
            return textwrap.dedent(block)
    raise InputError("README.md has no example in Python")


def environment_of(folder):
    return {
        **{name: value for name, value in os.environ.items() if name != "FINGERTIP_PORT"},
        "XDG_RUNTIME_DIR": str(folder),
        "MPLBACKEND": "Agg",
        "PYTHONPATH": str(ROOT / "host_tools/python"),
    }


@contextlib.contextmanager
def simulated(tool, environment, *options):
    """Yields in how many seconds it was ready."""
    begun_s = time.monotonic()
    process = subprocess.Popen([tool, "simulate", *options], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        if not process.stdout.readline().startswith("ready: "):
            raise InputError(f"fingertip simulate: {process.communicate()[1].strip()}")
        yield time.monotonic() - begun_s
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()


def run_example(environment):
    """The lines that it printed, and what it wrote to standard error. It runs for ever, and is interrupted after so many lines."""
    program = example((ROOT / "README.md").read_text(encoding="utf-8"))
    process = subprocess.Popen(
        ["/usr/bin/python3", "-u", "-c", program], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    guard = threading.Timer(PATIENCE_s, process.kill)
    guard.start()
    lines = [line for line, _ in zip(iter(process.stdout.readline, ""), range(LINES))]
    process.send_signal(signal.SIGINT)
    err = process.communicate()[1]
    guard.cancel()
    return lines, "" if "KeyboardInterrupt" in err else err


def runs(lines):
    """Places on the pad and forces that a weight of 300 g may have."""
    try:
        values = [tuple(map(float, line.split())) for line in lines]
    except ValueError:
        return False
    return len(values) == LINES and all(len(each) == 3 and abs(each[0]) < 15 and abs(each[1]) < 24 and 0 < each[2] < 5 for each in values)


def help_ms(tool):
    def once():
        begun_s = time.monotonic()
        subprocess.run([tool, "--help"], stdout=subprocess.DEVNULL, check=True)
        return time.monotonic() - begun_s

    return 1000 * min(once() for _ in range(STARTS))


def measure(build, steps):
    tool = pathlib.Path(build).resolve() / TOOL
    if not tool.exists():
        raise InputError(f"{tool} is not there; build it: cmake --build --preset host")
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        environment = environment_of(folder)
        ready_s = []
        for _ in range(STARTS):
            with simulated(tool, environment) as after_s:
                ready_s.append(after_s)
        steps.say(f"a simulated fingertip is ready after {min(ready_s):.2f} s")
        with simulated(tool, environment):
            lines, err = run_example(environment)
            subprocess.run([tool, "set", "osr=256", "rate=max"], env=environment, stdout=subprocess.DEVNULL, check=True)
            read = subprocess.run(
                [sys.executable, ROOT / "host_tools/report/ecosystem/reader.py", "sim:", str(SECONDS)],
                capture_output=True,
                text=True,
                timeout=SECONDS + PATIENCE_s,
                env=environment,
                check=False,
            )
        if read.returncode != 0:
            raise InputError(f"the Python reader failed: {read.stderr.strip()[-500:]}")
        found = json.loads(read.stdout)
        steps.say(
            f"{found['frames']} frames in {SECONDS} s; the README's example " + ("runs" if runs(lines) else f"does not run: {err or lines}")
        )
    return {
        "readme_words": len((ROOT / "README.md").read_text(encoding="utf-8").split()),
        "help_ms": round(help_ms(tool), 1),
        "simulate_ready_s": round(min(ready_s), 3),
        "simulate_seconds": SECONDS,
        "simulate_fps": round(found["fps"], 1),
        "simulate_lost": found["lost"],
        "python_example_runs": int(runs(lines)),
    }


def text(found):
    return [
        "## Without a board",
        "",
        f"`fingertip simulate` starts {STARTS} times, and the fastest counts. Then the Python example of README.md runs as it is printed, until it has printed "
        f"{LINES} lines: each has to be a place on the pad and a force that a weight of 300 g may have. After `fingertip set osr=256 rate=max` a Python "
        f"program takes every frame for {found['simulate_seconds']} s. `readme_words` counts what stands between blanks in README.md.",
        "",
    ]
