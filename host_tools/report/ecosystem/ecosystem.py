#!/usr/bin/python3
"""How the fingertip goes into programs of others.

    ecosystem.py --build build/host -o build/report

    ecosystem.json    the figures by which that is judged, with their goals
    ecosystem.md      the same to read

Each part is a module beside this one (reporting.report_of_parts).
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import many_machines  # noqa: E402
import mcap_bags  # noqa: E402
import python_package  # noqa: E402
import ros2_dds  # noqa: E402
from fingertip.files import run_tool  # noqa: E402
from reporting import report_of_parts  # noqa: E402

PARTS = (python_package, mcap_bags, ros2_dds, many_machines)


def main(argv):
    return report_of_parts(argv, __doc__, "ecosystem", PARTS)


if __name__ == "__main__":
    sys.exit(run_tool("ecosystem.py", main))
