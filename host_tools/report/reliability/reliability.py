#!/usr/bin/python3
"""How much the fingertip and its tools stand.

    reliability.py --build build/host -o build/report

    reliability.json    the figures by which that is judged, with their goals
    reliability.md      the same to read

Each part is a module beside this one: GOALS, measure(steps) -> figures by name, and text(figures) -> lines of Markdown.
"""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import analysis  # noqa: E402
import fuzzing  # noqa: E402
import soaking  # noqa: E402
from fingertip.files import run_tool, write_text  # noqa: E402
from goals import goal_table_md, judge  # noqa: E402
from reporting import Steps, finish, option_parser, output_folder, write_json  # noqa: E402

PARTS = (fuzzing, soaking, analysis)
GOALS = tuple(goal for part in PARTS for goal in part.GOALS)


def main(argv):
    options = option_parser(__doc__).parse_args(argv)
    out, steps, found = output_folder(options), Steps(), {}
    for part in PARTS:
        found.update(part.measure(steps))
    found = judge(found, GOALS)
    write_json(out / "reliability.json", found)
    lines = ["# Reliability", "", "Written by `sh cmake/bootstrap.sh report`.", "", *goal_table_md(found), ""]
    write_text(out / "reliability.md", "\n".join(lines + [line for part in PARTS for line in part.text(found)]))
    return finish(found, options, ("reliability.json", "reliability.md"))


if __name__ == "__main__":
    sys.exit(run_tool("reliability.py", main))
