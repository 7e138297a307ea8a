#!/usr/bin/python3
"""The table in boards/BUILD.md of what hardness and thickness of the rubber do, computed by the twin.

rubber.py TWIN            writes it; TWIN: build/host/host_tools/simulation/twin/twin
rubber.py TWIN --check    fails if it differs from what would be written
"""

import math
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import draw  # noqa: E402

PAGE = HERE.parent / "BUILD.md"
RUBBERS = (("Dragon Skin 10", 10), ("15 A, as published", 15), ("Dragon Skin 20", 20), ("VytaFlex 40", 40))
THICK_mm = (6, 9, 12, 15)
FORCE_N = 5
RANGE_kPa = 100  # above the ambient: to the sensor's extended range, 2 bar (firmware/ms58xx/sensors.h)


def width(twin, cache, thick_mm, shore_a):
    """(sigma_mm, force_N at which the peak leaves the sensors' range)"""
    options = f"width --indenter sphere15 --layer {thick_mm} --shore {shore_a} --force {FORCE_N}".split()
    out = subprocess.run([twin, *options, "--cache", cache], check=True, stdout=subprocess.PIPE, text=True).stdout
    found = {name: float(value) for name, value in (word.split("=") for word in out.split())}
    return found["sigma_mm"], FORCE_N * RANGE_kPa / found["peak_kPa"]


def table(twin):
    text = ["| Shore A | rubber | " + " | ".join(f"{mm} mm thick" for mm in THICK_mm) + " |", "|---|---|" + "---|" * len(THICK_mm)]
    with tempfile.TemporaryDirectory() as cache:
        for name, shore_a in RUBBERS:
            cells = [width(twin, cache, mm, shore_a) for mm in THICK_mm]
            text.append(
                f"| {shore_a} | {name} | "
                + " | ".join(f"{sigma_mm:.1f} mm, to {math.floor(force_N)} N" for sigma_mm, force_N in cells)
                + " |"
            )
    return "\n".join(text) + "\n"


def main(argv):
    if not argv or argv[1:] not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    old = PAGE.read_text(encoding="utf-8")
    new = draw.filled(old, "rubber", table(argv[0]), "boards/drawing/rubber.py TWIN")
    if not argv[1:]:
        PAGE.write_text(new, encoding="utf-8")
    elif new != old:
        print("boards/BUILD.md: its table of rubbers is not what boards/drawing/rubber.py computes; run it", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
