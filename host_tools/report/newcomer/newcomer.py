#!/usr/bin/python3
"""What somebody meets who has no fingertip yet.

    newcomer.py --build build/host -o build/report [--release]

--release: builds a release twice, and compares.

    newcomer.json    the figures by which that is judged, with their goals
    newcomer.md      the same to read
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import reading  # noqa: E402
import released  # noqa: E402
import simulated  # noqa: E402
import validated  # noqa: E402
from fingertip.files import run_tool  # noqa: E402
from reporting import report_of_parts  # noqa: E402


def main(argv):
    released.wanted = "--release" in argv
    return report_of_parts([word for word in argv if word != "--release"], __doc__, "newcomer", (simulated, validated, reading, released))


if __name__ == "__main__":
    sys.exit(run_tool("newcomer.py", main))
