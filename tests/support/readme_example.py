"""The README's Python example on what `fingertip simulate` simulates."""

import contextlib
import os
import pathlib
import re
import signal
import subprocess
import textwrap
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
LINES = 20  # of the example
PATIENCE_s = 60


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
            raise AssertionError(f"fingertip simulate: {process.communicate()[1].strip()}")
        yield time.monotonic() - begun_s
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()


def run_example(environment):
    """The lines that it printed, and what it wrote to standard error. It is interrupted after LINES lines."""
    blocks = re.findall(r"(?:^(?:    .*)?\n)+", (ROOT / "README.md").read_text(encoding="utf-8"), re.M)
    program = textwrap.dedent(next(block for block in blocks if "from fingertip import" in block))
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
    """Whether these are locations on the pad and forces that a weight of 300 g may have."""
    try:
        values = [tuple(map(float, line.split())) for line in lines]
    except ValueError:
        return False
    return len(values) == LINES and all(len(each) == 3 and abs(each[0]) < 15 and abs(each[1]) < 24 and 0 < each[2] < 5 for each in values)
