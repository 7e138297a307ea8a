#!/usr/bin/python3
"""Draws where the sensors sit, at 1:1, from firmware/config/geometry.c.

    placement.py            writes boards/placement.svg
    placement.py --check    says whether that file is what would be written
"""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PICTURE = ROOT / "boards/placement.svg"
PACKAGE_mm = 3.3  # of an MS5840, each way (De Clercq et al., RA-L 2022, section III.A)
MARGIN_mm = 14.0
RULER_mm = 50
PRINT = """
#include "config/geometry.h"
#include <stdio.h>
int main(void) {
  printf("[");
  for (int k = 0; k < geometry.sensor_count; k++)
    printf("%s[%.9g, %.9g]", k ? ", " : "", (double)geometry.x_mm[k], (double)geometry.y_mm[k]);
  printf("]");
}
"""


def places():
    """[[x_mm, y_mm]] of the sensors, as the firmware has them."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder, "print.c"), pathlib.Path(folder, "print")
        source.write_text(PRINT)
        subprocess.run(["gcc", f"-I{ROOT / 'firmware'}", source, ROOT / "firmware/config/geometry.c", "-o", program], check=True)
        return json.loads(subprocess.run([program], check=True, stdout=subprocess.PIPE).stdout)


def drawn(sensors):
    """The SVG: one unit is one millimetre; y points up on the pad, down in the picture."""
    reach_x_mm = max([abs(x) for x, _ in sensors] + [RULER_mm / 2]) + MARGIN_mm
    reach_y_mm = max(abs(y) for _, y in sensors) + MARGIN_mm
    width_mm, height_mm = 2 * reach_x_mm, 2 * reach_y_mm
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_mm:g}mm" height="{height_mm:g}mm" '
        f'viewBox="{-reach_x_mm:g} {-reach_y_mm:g} {width_mm:g} {height_mm:g}" role="img" aria-label="Places of the sensors, 1:1">',
        "  <title>Places of the sensors, 1:1</title>",
        "  <style>text { font: 2px sans-serif } path, rect { stroke: #000; stroke-width: 0.15; fill: none }</style>",
        f'  <rect x="{-reach_x_mm:g}" y="{-reach_y_mm:g}" width="{width_mm:g}" height="{height_mm:g}" style="fill: #fff; stroke: none"/>',
    ]
    half_mm = PACKAGE_mm / 2
    for k, (x, y) in enumerate(sensors):
        lines += [
            f'  <rect x="{x - half_mm:g}" y="{-y - half_mm:g}" width="{PACKAGE_mm:g}" height="{PACKAGE_mm:g}"/>',
            f'  <path d="M{x - 2.5:g} {-y:g}h5M{x:g} {-y - 2.5:g}v5"/>',
            f'  <text x="{x + 2:g}" y="{-y - 2:g}">{k}</text>',
        ]
    ruler_y_mm = reach_y_mm - 5
    ticks = "".join(f"M{mm - RULER_mm / 2:g} {ruler_y_mm:g}v{-2 if mm % 10 == 0 else -1}" for mm in range(RULER_mm + 1))
    lines += [
        f'  <path d="M{-RULER_mm / 2:g} {ruler_y_mm:g}h{RULER_mm}{ticks}"/>',
        f'  <text x="{-RULER_mm / 2:g}" y="{ruler_y_mm + 3:g}">{RULER_mm} mm: measure this line before you use the print</text>',
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def main(argv):
    if argv not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    picture = drawn(places())
    if not argv:
        PICTURE.write_text(picture)
    elif not PICTURE.exists() or PICTURE.read_text() != picture:
        print("boards/placement.svg is not what boards/placement.py draws from the geometry; run it", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
