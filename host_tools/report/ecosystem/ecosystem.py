#!/usr/bin/python3
"""How the fingertip goes into programs of others.

    ecosystem.py --build build/host -o build/report

    ecosystem.json    the figures by which that is judged, with their goals
    ecosystem.md      the same to read

Each part is a module beside this one: GOALS, measure(build, steps) -> figures by name, and text(figures) -> lines of Markdown.
"""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import python_package  # noqa: E402
from fingertip.files import run_tool, write_text  # noqa: E402
from goals import goal_table_md, judge  # noqa: E402
from reporting import Steps, finish, option_parser, output_folder, write_json  # noqa: E402

PARTS = (python_package,)
GOALS = tuple(goal for part in PARTS for goal in part.GOALS)


def main(argv):
    options = option_parser(__doc__).parse_args(argv)
    out, steps, found = output_folder(options), Steps(), {}
    for part in PARTS:
        found.update(part.measure(pathlib.Path(options.build), steps))
    found = judge(found, GOALS)
    write_json(out / "ecosystem.json", found)
    lines = ["# Ecosystem", "", "Written by `sh cmake/bootstrap.sh report`.", "", *goal_table_md(found), ""]
    write_text(out / "ecosystem.md", "\n".join(lines + [line for part in PARTS for line in part.text(found)]))
    return finish(found, options, ("ecosystem.json", "ecosystem.md"))


if __name__ == "__main__":
    sys.exit(run_tool("ecosystem.py", main))
