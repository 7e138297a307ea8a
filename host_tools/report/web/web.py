#!/usr/bin/python3
"""The page that shows and operates fingertips in a browser.

    web.py --build build/host -o build/report

    web.json    the figures by which it is judged, with their goals
    web.md      the same to read

Each part is a module beside this one (reporting.report_of_parts).
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import cost  # noqa: E402
import in_browser  # noqa: E402
import parity  # noqa: E402
from fingertip.files import run_tool  # noqa: E402
from reporting import report_of_parts  # noqa: E402

PARTS = (in_browser, parity, cost)


def main(argv):
    return report_of_parts(argv, __doc__, "web", PARTS)


if __name__ == "__main__":
    sys.exit(run_tool("web.py", main))
