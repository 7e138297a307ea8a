#!/usr/bin/python3
"""How much the fingertip and its tools stand.

    reliability.py --build build/host -o build/report

    reliability.json    the figures by which that is judged, with their goals
    reliability.md      the same to read

Each part is a module beside this one (reporting.report_of_parts).
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import analysis  # noqa: E402
import fuzzing  # noqa: E402
import same_bits  # noqa: E402
import second_core  # noqa: E402
import shared_clock  # noqa: E402
import silicon  # noqa: E402
import soaking  # noqa: E402
from fingertip.files import run_tool  # noqa: E402
from reporting import report_of_parts  # noqa: E402

PARTS = (same_bits, second_core, silicon, shared_clock, fuzzing, soaking, analysis)


def main(argv):
    return report_of_parts(argv, __doc__, "reliability", PARTS)


if __name__ == "__main__":
    sys.exit(run_tool("reliability.py", main))
