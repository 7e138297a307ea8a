"""What a user without a fingertip meets: `fingertip simulate`, the README's example, reading a recording, and a release built twice."""

# real time: how long things take
import io
import os
import subprocess
import sys
import time

import numpy as np
from nightly import ROOT, Programs, job, run
from package import read
from readme_example import environment_of, run_example, runs, simulated

from fingertip import files
from fingertip.files import InputError

TOOL, SECONDS = "host_tools/tool/cli/fingertip", 10
REPEATS = 5  # the best counts: this computer may have other work


def best_s(work, clock=time.monotonic):
    def once():
        begin_s = clock()
        work()
        return clock() - begin_s

    return min(once() for _ in range(REPEATS))


def ready_s(tool, environment):
    with simulated(tool, environment) as after_s:
        return after_s


@job(
    "newcomer",
    ("readme_words", "<=", 600),
    ("help_ms", "<=", 30),
    ("simulate_ready_s", "<=", 2),
    ("simulate_fps", ">=", 1300),
    ("simulate_lost", "<=", 0),
    ("python_example_runs", ">=", 1),
)
def simulate(build):
    tool = build / TOOL
    with Programs(build) as programs:
        environment = environment_of(programs.folder)
        soonest_s = min(ready_s(tool, environment) for _ in range(REPEATS))
        with simulated(tool, environment):
            lines, _ = run_example(environment)
            run(tool, "set", "osr=256", "rate=max", env=environment)
            found = read("sim:", SECONDS)
    return {
        "readme_words": len((ROOT / "README.md").read_text(encoding="utf-8").split()),
        "help_ms": round(1000 * best_s(lambda: run(tool, "--help")), 1),
        "simulate_ready_s": round(soonest_s, 3),
        "simulate_seconds": SECONDS,
        "simulate_fps": round(found["fps"], 1),
        "simulate_lost": found["lost"],
        "python_example_runs": int(runs(lines)),
    }


@job("newcomer")
def reading(build, times=8):
    """A recording by fingertip.read_recording, which judges every cell, and its numbers alone by numpy.loadtxt: processor time."""
    with Programs(build) as programs:
        environment, path = environment_of(programs.folder), programs.folder / "press.csv"
        with simulated(build / TOOL, environment):
            for words in (("set", "osr=256", "rate=max"), ("record", path, "--seconds", SECONDS)):
                run(build / TOOL, *words, env=environment)
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        begin = next(at for at, line in enumerate(lines) if not line.startswith("#")) + 1
        rows = times * [line for line in lines[begin:] if not line.startswith("#")]
        path.write_text("".join(lines[:begin] + rows), encoding="utf-8")
        alone = "".join(rows).replace(",,", ",nan,").replace(",,", ",nan,").replace(",\n", ",nan\n").encode("ascii")
        read_s = best_s(lambda: files.read_recording(path), time.process_time)
        loadtxt_s = best_s(lambda: np.loadtxt(io.BytesIO(alone), delimiter=",", comments=None), time.process_time)
    return {
        "reader_rows": len(rows),
        "reader_us_per_row": round(1e6 * read_s / len(rows), 1),
        "reader_times_loadtxt": round(read_s / loadtxt_s, 2),
    }


@job("newcomer", ("release_differs", "<=", 0))
def release(_):
    """cmake/release.py twice, into folders of different names, without the compiler cache: files whose SHA-256 differs."""
    with Programs(None) as programs:
        found, commits = [], set()
        for name in ("first", "a_second_one"):
            run(sys.executable, ROOT / "cmake/release.py", programs.folder / name, env={**os.environ, "CCACHE_DISABLE": "1"})
            lines = (programs.folder / name / "SHA256SUMS").read_text(encoding="ascii").splitlines()
            found.append({path: digest for digest, path in (line.split("  ", 1) for line in lines)})
            commits.add(subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, check=True).stdout)
    if len(commits) > 1:
        raise InputError("a commit was made between the two releases; run again")
    differ = sorted(name for name in found[0].keys() | found[1].keys() if found[0].get(name) != found[1].get(name))
    return {"release_differs": len(differ), "release_files": len(found[0]), "release_that_differ": differ}
