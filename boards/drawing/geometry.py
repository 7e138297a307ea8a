"""The sensors' places, as the firmware has them (firmware/config/geometry.c)."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE_mm = 3.3  # of an MS5840, each way (De Clercq et al., RA-L 2022, section III.A)
PACKAGE_HIGH_mm = 1.7  # there


def places(root=ROOT):
    """[[x_mm, y_mm]] of the sensors."""
    text = (root / "firmware/config/geometry.c").read_text(encoding="utf-8")
    x_mm, y_mm = (re.search(rf"\.{axis}_mm = {{([^}}]*)}}", text)[1].split(",") for axis in "xy")
    return [[float(x), float(y)] for x, y in zip(x_mm, y_mm, strict=True)]
