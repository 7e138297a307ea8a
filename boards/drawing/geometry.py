"""The sensors' places, as the firmware has them (boards/pads)."""

import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE_mm = 3.3  # of an MS5840, each way (De Clercq et al., RA-L 2022, section III.A)
PACKAGE_HIGH_mm = 1.7  # there


def places(root=ROOT):
    """[[x_mm, y_mm]] of the sensors."""
    pad = json.loads((root / "boards/pads/3x5.json").read_text(encoding="utf-8"))
    columns, rows, pitch_mm = pad["columns"], pad["rows"], pad["pitch_mm"]
    return [[pitch_mm * (k // rows - (columns - 1) / 2), pitch_mm * (k % rows - (rows - 1) / 2)] for k in range(columns * rows)]
