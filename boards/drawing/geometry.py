"""A pad, as boards/pads/README.md has it."""

import dataclasses
import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE_mm = 3.3  # of a sensor, each way (De Clercq et al., RA-L 2022, section III.A; TE's data sheet of the MS5837-30BA)
SENSORS = {"ms5840": ("MS5840-02BA", 1.7), "ms5837_30ba": ("MS5837-30BA", 2.75)}  # key of parts.json; height in mm, there
# Where the pad says nothing: the layer of most figures in host_tools/report, and three quarters of it (host_tools/README.md, "Tangential force").
RUBBER = {"thickness_mm": 12.0, "overhang_mm": 9.0}


@dataclasses.dataclass
class Pad:
    name: str
    places: list  # [x_mm, y_mm] of each sensor
    pitch_mm: float
    part: str  # of the sensors
    high_mm: float  # of a sensor
    thickness_mm: float
    overhang_mm: float
    strip_mm: tuple = None  # width and length, if it is one strip on a circuit board of its own


def descriptor(folder):
    """Of a circuit board: its board's, but for what a board.json in the folder itself has."""
    paths = folder.with_name("board.json"), *folder.glob("board.json")
    found, *own = (json.loads(path.read_text(encoding="utf-8")) for path in paths)
    for other in own:
        found |= other | {"wiring": found["wiring"] | other.get("wiring", {})}
    return found


def pad(path):
    found = json.loads(path.read_text(encoding="utf-8"))
    places, columns, rows, pitch_mm = (found.get(key) for key in ("places_mm", "columns", "rows", "pitch_mm"))
    if not places:
        places = [[pitch_mm * (k // rows - (columns - 1) / 2), pitch_mm * (k % rows - (rows - 1) / 2)] for k in range(columns * rows)]
    return Pad(found["name"], places, pitch_mm, *SENSORS[found["sensor"]], **RUBBER | found.get("rubber", {}))


def pads_of(descriptor, root=ROOT):
    """A circuit board's pad; and where such boards lie on the base plate: one for all sensors, or one for each strip, if the board has `strip_mm`."""
    whole, count = pad(root / f"boards/pads/{descriptor['pad']}.json"), descriptor["wiring"]["sensor_count"]
    if "strip_mm" not in descriptor:
        return whole, [(0, 0)]
    middles = [[sum(axis) / count for axis in zip(*whole.places[k : k + count])] for k in range(0, len(whole.places), count)]
    places = [[x - middles[0][0], y - middles[0][1]] for x, y in whole.places[:count]]
    return dataclasses.replace(whole, places=places, strip_mm=tuple(descriptor["strip_mm"])), middles
