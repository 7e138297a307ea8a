#!/usr/bin/python3
"""Prints the results of fingertip-evaluate, a column for each pad.

errors.py NAME=SUMMARY.json...
"""

import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
from fingertip.command import InputError, Parser, run_tool  # noqa: E402

ROWS = [
    ("frames a second", lambda s: f"{s['frames_per_s']:.0f}"),
    ("location off by, median", lambda s: f"{s['localisation_median_mm']:.2f} mm"),
    ("location off by, 95 %", lambda s: f"{s['localisation_p95_mm']:.2f} mm"),
    ("force off by, median", lambda s: "-" if s["force_mape_percent"] is None else f"{s['force_mape_percent']:.1f} %"),
    ("slips found", lambda s: f"{s['slip_found']} of {s['slip_found'] + s['slip_missed']}"),
    ("after their start by", lambda s: ", ".join(f"{ms:.0f}" for ms in s["slip_delay_ms"]) + " ms" if s["slip_delay_ms"] else "-"),
    ("frames of slip elsewhere", lambda s: str(s["slip_false"])),
    ("packets lost", lambda s: str(s["dropped_packets"])),
]


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("summaries", nargs="+", metavar="NAME=SUMMARY.json")
    summaries = {}
    for text in parser.parse_args(argv).summaries:
        name, equals, path = text.partition("=")
        if not equals:
            raise InputError(f"{text} is no NAME=SUMMARY.json")
        summaries[name] = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    table = [
        ("what the fingertip measured, against the truth", list(summaries)),
        *((label, [value(summary) for summary in summaries.values()]) for label, value in ROWS),
    ]
    width = max(len(label) for label, _ in table)
    columns = [max(len(cells[i]) for _, cells in table) for i in range(len(summaries))]
    for label, cells in table:
        print(f"{label:<{width}}", *(f"{cell:>{length}}" for cell, length in zip(cells, columns)), sep="   ")
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("errors.py", main))
