#!/usr/bin/python3
"""Other arrays than the boards' own: the accuracy of the fit, which images are built, and what they take in the emulator (text.md.in).

pads.py --build build/host -o build/report    writes pads.json and pads.md
"""

import pathlib
import re
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/fit", "report/rate", "report/shared", "report/measure", "python")]
import arrays  # noqa: E402, adds the path of the next
import presses  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from measure import Measure, q10  # noqa: E402
from presentation import judge  # noqa: E402
from reporting import Steps, built, option_parser, output_folder, publish  # noqa: E402

NOISE_Pa, ITERATIONS = 5.0, 7
STACK_MAX_bytes = int(re.search(r"> \d+ \? (\d+)", (ROOT / "firmware/common/limits.h").read_text(encoding="utf-8")).group(1))
OBSERVABLE = [*map(arrays.size_of, arrays.RECTANGLES[1:]), (6, 5)]


def p99_9_um(measure, columns, rows, count, random):
    compared, (column, row) = presses.Compared(measure), np.divmod(np.arange(columns * rows), rows)
    compared.x_mm, compared.y_mm = arrays.PITCH_mm * (column - (columns - 1) / 2), arrays.PITCH_mm * (row - (rows - 1) / 2)
    x_mm, y_mm = (random.uniform(places.min(), places.max(), count) for places in (compared.x_mm, compared.y_mm))
    sigma_mm, p0_Pa = random.uniform(3.5, 8.0, count), 10.0 ** random.uniform(3.7, 4.7, count)
    pressure_Pa = presses.gaussian_Pa(compared.x_mm, compared.y_mm, x_mm, y_mm, sigma_mm, p0_Pa)
    readings = q10(pressure_Pa + NOISE_Pa * random.normal(size=pressure_Pa.shape))
    best = compared.optimum(readings, np.full(count, (1 << columns * rows) - 1, np.uint64), np.full(count, NOISE_Pa))
    settings = measure.settings(noise_Pa=NOISE_Pa, iterations=ITERATIONS, clip_below_sds=0)
    found = measure.fit(measure.array(compared.x_mm, compared.y_mm, arrays.PITCH_mm), settings, readings)
    judged = best["observable"] & ~best["at_bound"]
    assert judged.mean() > 0.9, "too few presses are judged"
    return float(np.quantile(1000 * np.hypot(found["x_mm"] - best["x_mm"], found["y_mm"] - best["y_mm"])[judged], 0.999))


def main(argv):
    options, seed, count = option_parser(__doc__).parse_args(argv), 11, 10000
    out, measure, random = output_folder(options), Measure(options.build), np.random.default_rng(seed)
    found = {f"p99_9_um_{columns}x{rows}": p99_9_um(measure, columns, rows, count, random) for columns, rows in OBSERVABLE}
    goals = [(name, "<=", 1) for name in found] + [("pads_built", ">=", 8), ("stack_bytes_max", "<=", STACK_MAX_bytes)]
    with tempfile.TemporaryDirectory() as folder:
        rows, pads = arrays.measure(folder, built(options.build, "tests/support/command_frame"), Steps())
    found["stack_bytes_max"] = max(row["stack_bytes"] for row in rows)
    found = judge(found | {"pads_built": len(pads)}, goals) | {"pads": pads, "arrays": rows, "presses": count, "seed": seed}
    return publish(found, options, "pads", {})


if __name__ == "__main__":
    sys.exit(run_tool("pads.py", main))
