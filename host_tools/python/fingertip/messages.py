"""The ROS 2 messages of a fingertip's frames and state, as bytes: those of MCAP recordings and those of topics."""

import math
import operator
import re
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from .line import ALL_OF_WORD, MAPS, SENSORS_OF_WORD, WARNINGS, Flag
from .ros_messages import CDR_LITTLE_ENDIAN, PRIMITIVES, encode, fields_of, packer_of

CONTACT_TYPE, LINE_TYPE, WRENCH_TYPE, PLACE_TYPE, PRESSURES_TYPE, DIAGNOSTICS_TYPE = (
    "fingertip_msgs/Contact",
    "fingertip_msgs/Line",
    "geometry_msgs/WrenchStamped",
    "geometry_msgs/PointStamped",
    "sensor_msgs/PointCloud2",
    "diagnostic_msgs/DiagnosticArray",
)
TYPES = (CONTACT_TYPE, LINE_TYPE, WRENCH_TYPE, PLACE_TYPE, PRESSURES_TYPE, DIAGNOSTICS_TYPE)
FRAME_TOPICS = {"contact": CONTACT_TYPE, "wrench": WRENCH_TYPE, "place": PLACE_TYPE, "pressures": PRESSURES_TYPE}
_JUDGED = int(Flag.FIT_VALID | WARNINGS)
_TANGENTIAL = int(Flag.TANGENTIAL_VALID | Flag.TANGENTIAL_FROM_TOUCH)
_NOTHING = int(Flag.CONTACT | Flag.TARED | WARNINGS)
_CONTACT = [(name, kind) for name, kind, is_sequence in fields_of(CONTACT_TYPE)[1:] if not is_sequence]  # behind the header
_CONTACT_CODES = tuple(PRIMITIVES[kind] for _, kind in _CONTACT)
_contact_values = operator.itemgetter(*(name for name, _ in _CONTACT))


def name_in_ros(serial: str) -> str:
    """As a part of topics and coordinate frames."""
    name = re.sub("[^A-Za-z0-9_]", "_", serial) or "unknown"
    return "s" + name if name[0].isdigit() else name


def stamp(time_ns: int) -> dict[str, int]:
    return {"sec": time_ns // 10**9, "nanosec": time_ns % 10**9}


def _wrench(flags: int, x_mm: float, y_mm: float, force_N: float, qx_N: float, qy_N: float) -> tuple[float, ...]:
    """geometry_msgs/Wrench of a contact packet, as its definition has it: force, then torque."""
    if flags & _NOTHING == Flag.TARED:
        return (0.0,) * 6
    if flags & _JUDGED != Flag.FIT_VALID:
        return (math.nan,) * 6
    x_m, y_m = x_mm / 1000, y_mm / 1000
    x_N, y_N = (qx_N, qy_N) if flags & _TANGENTIAL == Flag.TANGENTIAL_VALID else (math.nan, math.nan)
    return x_N, y_N, -force_N, y_m * -force_N, -x_m * -force_N, x_m * y_N - y_m * x_N


def _location(flags: int, x_mm: float, y_mm: float) -> tuple[float, ...]:
    """geometry_msgs/Point of a contact packet."""
    return (x_mm / 1000, y_mm / 1000, 0.0) if flags & _JUDGED == Flag.FIT_VALID else (math.nan,) * 3


def health_status(serial: str, sensors: int, fields: dict[str, str]) -> dict[str, Any]:
    """diagnostic_msgs/DiagnosticStatus of a health packet."""
    present, bad = (int(fields.get(name, "0")) for name in ("sensors_present", "sensors_prom_bad"))
    missing = " ".join(str(k) for k in range(sensors) if not present >> k & 1)
    doubtful = " ".join(str(k) for k in range(sensors) if bad >> k & 1)
    found = (f"sensors missing: {missing}" * bool(missing), f"damaged PROM of sensors: {doubtful}" * bool(doubtful))
    troubles = [text for text in found if text]
    status = {"level": 1 if troubles else 0, "name": f"fingertip {serial}", "message": "; ".join(troubles) or "all sensors are there"}
    return status | {"hardware_id": serial, "values": [{"key": key, "value": value} for key, value in fields.items()]}


def warning_status(serial: str, warnings: int) -> dict[str, Any]:
    """diagnostic_msgs/DiagnosticStatus of a contact packet's warnings."""
    names = " ".join(flag.name or "" for flag in Flag if flag & WARNINGS & warnings)
    status = {"level": 1 if names else 0, "name": f"fingertip {serial} contact", "message": names or "no warning"}
    return status | {"hardware_id": serial, "values": []}


def _as_binary32(*values: float) -> tuple[float, ...]:
    """As the fingertip sent them."""
    form = f"<{len(values)}f"
    return struct.unpack(form, struct.pack(form, *values))


class FrameMessages:
    """The messages of one fingertip's frames. place_sensors before the first pressures; without, there are none."""

    def __init__(self, serial: str) -> None:
        self.serial = serial
        self.frame_id = "fingertip_" + name_in_ros(serial)
        self.warnings: int | None = None
        self._cloud: npt.NDArray[np.float32] | None = None
        self._cloud_head = b""
        text = self.frame_id.encode("ascii") + b"\0"
        self._codes, self._text = ("i", "I", "I", f"{len(text)}s"), (len(text), text)
        self._packers: dict[int, struct.Struct] = {}
        self._six, self._three = (packer_of((*self._codes, *"d" * count)) for count in (6, 3))

    def place_sensors(self, x_mm: "list[float] | tuple[float, ...]", y_mm: "list[float] | tuple[float, ...]", sensors: int) -> None:
        """Of raw packets with that number of sensors."""
        self._cloud = None
        if min(len(x_mm), len(y_mm)) < sensors or not sensors:
            return
        points = np.zeros((sensors, 4), np.float32)
        points[:, 0], points[:, 1] = (np.array(values[:sensors]) / 1000 for values in (x_mm, y_mm))
        fields = [{"name": each, "offset": 4 * i, "datatype": 7, "count": 1} for i, each in enumerate(("x", "y", "z", "pressure_pa"))]
        cloud = {"header": {"stamp": stamp(0), "frame_id": self.frame_id}, "height": 1, "width": sensors, "fields": fields}
        cloud |= {"is_bigendian": False, "point_step": 16, "row_step": 16 * sensors, "data": points.tobytes(), "is_dense": False}
        self._cloud, self._cloud_head = points, encode(PRESSURES_TYPE, cloud)[12 : -points.nbytes - 1]

    def of(self, time_ns: int, row: dict[str, Any], is_repeated: bool = True) -> Iterator[tuple[str, bytes]]:
        """(type, bytes) of a frame. row: fingertip_msgs/Contact without its header. is_repeated: other types than Contact have its numbers, too."""
        head, valid = (time_ns // 10**9, time_ns % 10**9, *self._text), row["valid"]
        pressures, tares = row["pressure_pa"], row["tare_pa"]
        packer = self._packers.get(len(pressures))
        if packer is None:
            lists = ("I", f"{len(pressures)}d") * 2
            packer = self._packers[len(pressures)] = packer_of((*self._codes, *_CONTACT_CODES, *lists, "I"))
        beyond = [row[name] >> SENSORS_OF_WORD for name in MAPS]
        if any(beyond):
            row = row | {name: row[name] & ALL_OF_WORD for name in MAPS}
        body = packer.pack(*head, *_contact_values(row), len(pressures), *pressures, len(tares), *tares, len(beyond) * any(beyond))
        body += struct.pack(f"<{len(beyond)}I", *beyond) * any(beyond)
        yield CONTACT_TYPE, CDR_LITTLE_ENDIAN + body
        flags = row["flags"]
        if is_repeated and row["has_contact"]:
            x_mm, y_mm, *forces_N = _as_binary32(row["x_mm"], row["y_mm"], row["force_n"], row["qx_n"], row["qy_n"])
            yield WRENCH_TYPE, CDR_LITTLE_ENDIAN + self._six.pack(*head, *_wrench(flags, x_mm, y_mm, *forces_N))
            yield PLACE_TYPE, CDR_LITTLE_ENDIAN + self._three.pack(*head, *_location(flags, x_mm, y_mm))
        if is_repeated and row["has_raw"] and self._cloud is not None and len(self._cloud) == len(pressures):
            self._cloud[:, 3] = [a - b if valid >> k & 1 else math.nan for k, (a, b) in enumerate(zip(pressures, tares))]
            yield PRESSURES_TYPE, CDR_LITTLE_ENDIAN + struct.pack("<iI", *head[:2]) + self._cloud_head + self._cloud.tobytes() + b"\0"
        if row["has_contact"] and self.warnings != flags & WARNINGS:
            self.warnings = flags & WARNINGS
            yield DIAGNOSTICS_TYPE, diagnostics(time_ns, warning_status(self.serial, self.warnings))


def diagnostics(time_ns: int, status: dict[str, Any]) -> bytes:
    """diagnostic_msgs/DiagnosticArray of one status."""
    return encode(DIAGNOSTICS_TYPE, {"header": {"stamp": stamp(time_ns), "frame_id": ""}, "status": [status]})
