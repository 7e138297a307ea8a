"""How long Python takes to read a recording, beside what numpy takes for the same numbers alone."""

import io
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import simulated
from fingertip import files
from fingertip.files import InputError

SECONDS = 10
TIMES = 8  # the rows of the recording, one after the other
REPEATS = 3  # in turn; of each the best counts, since this computer may have other things to do
GOALS = ()


def busy_s(work):
    begun_s = time.process_time()
    work()
    return time.process_time() - begun_s


def rows_of(path):
    """The lines until the rows begin, and the rows."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    begin = next(at for at, line in enumerate(lines) if not line.startswith("#")) + 1
    return lines[:begin], [line for line in lines[begin:] if not line.startswith("#")]


def numbers_alone(rows):
    """For numpy, which knows no empty cells."""
    return "".join(rows).replace(",,", ",nan,").replace(",,", ",nan,").replace(",\n", ",nan\n").encode("ascii")


def measure(build, steps):
    tool = pathlib.Path(build).resolve() / simulated.TOOL
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        environment, path = simulated.environment_of(folder), pathlib.Path(folder) / "press.csv"
        with simulated.simulated(tool, environment):
            for words in (["set", "osr=256", "rate=max"], ["record", path, "--seconds", str(SECONDS)]):
                done = subprocess.run([tool, *words], env=environment, capture_output=True, text=True, check=False)
                if done.returncode != 0:
                    raise InputError(f"fingertip {words[0]} failed: {done.stderr.strip()}")
        head, rows = rows_of(path)
        path.write_text("".join(head + TIMES * rows), encoding="utf-8")
        alone = numbers_alone(TIMES * rows)
        read_s, loadtxt_s = zip(
            *(
                (busy_s(lambda: files.read_recording(path)), busy_s(lambda: np.loadtxt(io.BytesIO(alone), delimiter=",", comments=None)))
                for _ in range(REPEATS)
            )
        )
    count = TIMES * len(rows)
    steps.say(f"{count} rows by Python")
    return {
        "reader_rows": count,
        "reader_us_per_row": round(1e6 * min(read_s) / count, 1),
        "reader_times_loadtxt": round(min(read_s) / min(loadtxt_s), 2),
    }


def text(found):
    return [
        "## Reading",
        "",
        f"A recording of {found['reader_rows']} rows, of fifteen sensors, is read by `fingertip.read_recording`, which judges every cell, and its numbers "
        f"alone by `numpy.loadtxt`: processor time, in turn, the best of {REPEATS}. `reader_times_loadtxt` is the ratio.",
        "",
    ]
