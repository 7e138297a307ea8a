"""What may be in a line of a recording. What libfingertip refuses is refused here too (recording_reader.cpp; the test formats)."""

import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from .cells import cells_of
from .columns import Array
from .frames import Q10
from .line import CONTACT_COLUMNS, LATER_COLUMNS, RAW_COLUMNS, SENSOR_LISTS, SENSORS_MAX, SHAPE_COLUMNS, TANGENTIAL_COLUMNS
from .line import MAPS, SENSORS_OF_WORD, Acknowledgement, Calibration, Contact, Health, Info, PadProfile, SyncEdge, Wire
from .wire import layout_of

_LARGEST = {"B": 2**8 - 1, "n": 2**8 - 1, "h": 2**15 - 1, "H": 2**16 - 1, "I": 2**32 - 1, "Q": 2**64 - 1}
_LEAST = {"h": -(2**15)}  # of the others 0
_WHOLE = re.compile("-?[0-9]+")
_NUMBER = re.compile(r"-?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_BINARY32 = 2.0**-150, 2.0**128 - 2.0**103  # not above the first it becomes 0, from the second on infinite
_BINARY64 = 0.0, math.inf
_PAD_LISTS = {
    "pad_shares": 2,
    "pad_sds_mm": 2,
    "pad_moments_mm": 3,
    "pad_moment_sds_mm": 3,
    **{f"pad_{name}": 3 for name in PadProfile._fields if name.startswith("edge_")},
}
LISTS = {**dict.fromkeys(("x_mm", "y_mm", *SENSOR_LISTS), SENSORS_MAX), **_PAD_LISTS}
_SCALARS = {
    prefix + name: wire.code
    for body, prefix in ((Info, ""), (Calibration, ""), (PadProfile, "pad_"))
    for name, wire in layout_of(body)
    if wire.code in "BnHIf" and wire.times == 1
}
_OF_CALIBRATION = [name for name, _ in layout_of(Calibration) if name in _SCALARS and not name.startswith("force_scale")]
_SCALARS |= {f"calibration_{name}": _SCALARS.pop(name) for name in _OF_CALIBRATION}
_PACKETS = {
    kind: {"sequence": "H", "t_us": "Q", **{name: wire.code for name, wire in layout_of(body)}}
    for kind, body in (("health", Health), ("ack", Acknowledgement), ("sync", SyncEdge))
}
_PACKETS["info"] = {"sequence": "H", "t_us": "Q"}


JOINT_COLUMNS = "device,time_us,"
UNKNOWN_HEADER = "unknown header: columns moved, renamed, missing, or added?"
LINE_MOST_bytes = 1 << 20  # a longer one is read as torn
# What a file begins with whose first line, a comment, or header a spreadsheet has saved.
OF_SPREADSHEETS = re.compile(
    rb'(?:\xef\xbb\xbf)?(?:"|[^\n]*[;,\t]\r*\n|(?:[ \t\r]*(?:#[^\n]*)?\n)*[ \t]*[^#\s](?:[^\n]*[;\t "]|[^\n]*,\r*\n))'
)


def _plain(text: str, separator: str) -> str:
    """Without quotes, between commas, with decimal points. Commas beside points part thousands, and stay: too many cells."""
    parts = text.split('"')
    parts[::2] = [part.replace(separator, "\n") for part in parts[::2]]  # outside of quotes
    return "".join(parts).replace(",", "," if "." in text else ".").replace("\n", ",")


def restored(lines: Iterable[str]) -> Iterator[str]:
    """Lines as they were before a spreadsheet saved them: between semicolons, tabs or commas, with quotes, blanks and decimal commas, filled
    up with empty cells. An empty one follows a last line that is whole."""
    fill, separator, commas, is_whole = "", ",", -1, False
    for number, text in enumerate(line.rstrip("\r").lstrip(" \t") for line in lines):
        quoted = re.match('"(#(?:[^"]|"")*)"?', text)
        rest = text[quoted.end() :] if quoted else text
        kept = rest.rstrip(',;\t"' if quoted else ",;\t")
        fill, is_whole = rest[len(kept) :] if number == 0 else fill, False
        if len(text) > LINE_MOST_bytes:
            pass
        elif quoted or text.startswith("#"):
            is_whole = (text.count('"') % 2 == 0 if quoted else bool(fill)) and rest[len(kept) :] == fill
            if quoted:
                text = quoted[1].replace('""', '"') + kept
            else:
                text = kept if fill else text
                text = _plain(text, separator) if separator != "," and separator in text else text  # cells, as a grasp's
        elif text.strip(" \t\r"):
            separator = next((c for c in text if c in ";\t" and "," not in text), ",") if commas < 0 else separator
            text = re.sub("[ \t]", "", _plain(text, separator))
            used = len(text.rstrip(","))
            text = text[: used and max(used, len(text) - max(0, text.count(",") - commas))]
            commas = text.count(",") if commas < 0 else commas
        yield text
    if is_whole:
        yield ""


def whole(name: str, cell: str, code: str) -> int:
    """A whole number of struct's code. Raises ValueError."""
    if not _WHOLE.fullmatch(cell) or (code == "Q" and cell[0] == "-"):
        raise ValueError(f'{name} is "{cell}"')
    if not _LEAST.get(code, 0) <= int(cell) <= _LARGEST[code]:
        raise ValueError(f"{name} is out of range")
    return int(cell)


def number(name: str, cell: str, limits: tuple[float, float] = _BINARY64) -> float:
    """A finite number, which is 0 only where it is written so. Raises ValueError."""
    value = float(cell) if _NUMBER.fullmatch(cell) else math.nan
    if not abs(value) < limits[1] or (abs(value) <= limits[0] and re.search("[1-9]", re.split("[eE]", cell)[0])):
        raise ValueError(f'{name} is "{cell}"; a finite number is needed')
    return value


def _scaled(name: str, cell: str, scale: float, bits: int) -> float:
    value = number(name, cell)
    if abs(value) > 1e12:
        raise ValueError(f'{name} is "{cell}"')
    if not -(2 ** (bits - 1)) <= math.copysign(math.floor(abs(value) * scale + 0.5), value) < 2 ** (bits - 1):
        raise ValueError(f"{name} is out of range")
    return value


def judge_key(key: str, value: str) -> None:
    """A comment "# key: value" of an info packet; any other key is fine. Raises ValueError."""
    if key in ("serial", "board", "scene", "git"):
        if not (value.isascii() and (value.isprintable() or not value)):
            raise ValueError(f"{key} is no printable ASCII")
    elif key == "firmware":
        if value.count(".") != 2:
            raise ValueError(f'firmware is "{value}"')
        for part in value.split("."):
            whole(key, part, "B")
    elif key in LISTS:
        words = value.split(" ") if value else []
        if len(words) > LISTS[key]:
            raise ValueError(f"{key} has too many values")
        for word in words:
            if SENSOR_LISTS.get(key) == "h":
                whole(key, word, "h")
            else:
                number(key, word, _BINARY32)
    elif key in _SCALARS:
        if _SCALARS[key] == "f":
            number(key, value, _BINARY32)
        else:
            whole(key, value, _SCALARS[key])


def serials_of(text: str) -> list[str]:
    """Of a joint recording's fingertips, "A B"; people write "A, B"."""
    return text.replace(",", " ").split()


def counts_of(text: str) -> dict[str, str]:
    """Of "key=value key=value". Raises ValueError."""
    counts: dict[str, str] = {}
    for pair in text.split(" "):
        key, separator, value = pair.partition("=")
        if not separator:
            raise ValueError(f'"{pair}" is not key=value')
        counts.setdefault(key, value)
    return counts


def packet_of(text: str) -> tuple[str, dict[str, str]]:
    """A comment of a packet: its kind, and {field: whole number as it is written}. Raises ValueError."""
    kind, _, rest = text.partition(" ")
    fields = counts_of(rest) if rest else {}
    if kind not in _PACKETS:
        raise ValueError(f'packet "{kind}" is unknown')
    for name, code in _PACKETS[kind].items():
        if name not in fields:
            raise ValueError(f"{name} is missing")
        whole(name, fields[name], code)
    return kind, fields


def header_text(sensors: int) -> str:
    """The row of columns."""
    pressures = (f"{kind}{k}_Pa" for kind in ("s", "tare") for k in range(sensors))
    return ",".join(["t_us", "frame", *CONTACT_COLUMNS, *LATER_COLUMNS, *RAW_COLUMNS, *pressures])


class Rows:
    """The rows under a header, from t_us on. Raises ValueError where it is none."""

    def __init__(self, header: str) -> None:
        there = tuple(name for columns in (TANGENTIAL_COLUMNS, SHAPE_COLUMNS) if f",{columns[0]}," in header for name in columns)
        self._first_raw = 2 + len(CONTACT_COLUMNS) + len(there)
        first_sensor = self._first_raw + len(RAW_COLUMNS)
        self.sensors = max(0, (header.count(",") + 1 - first_sensor) // 2)
        pressures = (f"{kind}{k}_Pa" for kind in ("s", "tare") for k in range(self.sensors))
        self.names = ["t_us", "frame", *CONTACT_COLUMNS, *there, *RAW_COLUMNS, *pressures]
        if header != ",".join(self.names) or self.sensors > SENSORS_MAX:
            raise ValueError(UNKNOWN_HEADER)
        wires = {"sequence": Wire("H"), **dict(layout_of(Contact))}
        contact = [wires[name] for name in self.names[2 : self._first_raw]]
        self._codes = ["Q", "I", *(wire.code for wire in contact), "H", "I", *"Q" * 3, "h", *"i" * 2 * self.sensors]
        self.codes = dict(zip(self.names, self._codes))
        self._flags = {at: int(wire.when[1]) for at, wire in enumerate(contact, 2) if wire.code == "f" and wire.when}
        self._floats, self._bits = list(self._flags), np.array(list(self._flags.values()), np.uint32)
        self._whole = [at for at, wire in enumerate(contact, 2) if wire.code != "f"]
        most = {"f": 3.4e38, "h": 327.67, "i": 2097151.999}  # what is beyond is judged by values
        self._high = np.array([most.get(code) or np.nextafter(_LARGEST[code] + 1.0, 0) for code in self._codes])
        of_absent = {wires[name].when for name in LATER_COLUMNS if name not in there}
        self._untold = sum(int(when[1]) for when in of_absent if when)  # flags of columns that are not there
        self._is_whole = np.array([code not in "fhi" for code in self._codes])

    def table(self, lines: bytes) -> Array | None:
        """As values of each row, many times as fast; None where one of them is not written as writers write most: values judges it then."""
        found = cells_of(lines, len(self.names), self._is_whole)
        if found is None or not self.sensors:
            return None
        (table, odd), first_raw = found, self._first_raw
        texts = lines.decode("utf-8", "surrogateescape").split("\n") if len(odd) else []
        for row in odd.tolist():
            try:
                table[row] = self.values(texts[row])
            except ValueError:
                return None
        if (np.abs(table) > self._high).any():
            return None
        empty = np.isnan(table)
        has_contact, has_raw = ~empty[:, 2:3], ~empty[:, first_raw : first_raw + 1]
        flags = np.nan_to_num(table[:, 3:4]).astype(np.uint32)
        wrong = (
            empty[:, :2],
            ~(has_contact | has_raw),
            empty[:, self._whole] == has_contact,
            ~(empty[:, 2:first_raw] | has_contact),
            empty[:, first_raw:] == has_raw,
            empty[:, self._floats] & ((flags & self._bits) != 0),
            flags & self._untold,
        )
        return None if any(each.any() for each in wrong) else table

    def of_contacts(self, found: npt.NDArray[Any], sensors: int) -> tuple[Array, npt.NDArray[np.bool_]]:
        """As table, of messages fingertip_msgs/Contact with this number of pressures, by the names of their fields; and whether each is a row of
        this recording."""
        has_contact, has_raw = found["has_contact"] != 0, found["has_raw"] != 0
        first_raw, last = self._first_raw, self._first_raw + len(RAW_COLUMNS)
        table = np.full((len(found), len(self.names)), math.nan)
        for at in range(last - 1):
            table[:, at] = found[self.names[at].lower()]
        for word, name in enumerate(MAPS):
            table[:, self.names.index(name)] += found["beyond"][:, word] * 2.0**SENSORS_OF_WORD * (found["beyond_count"] > 0)
        floats = table[:, self._floats]
        wrong = np.isinf(floats) | (np.isnan(floats) & ((found["flags"][:, None] & self._bits) != 0))
        fine = (has_contact | has_raw) & ~(has_contact & (wrong.any(axis=1) | ((found["flags"] & self._untold) != 0)))
        table[~has_contact, 2:first_raw] = math.nan
        fine &= ~has_raw | ((found["pressure_pa_count"] == self.sensors) & (found["tare_pa_count"] == self.sensors) & (sensors > 0))
        if sensors:
            table[:, last - 1] = found["temperature_degc"]
            table[:, last : last + sensors], table[:, last + sensors :] = found["pressure_pa"], found["tare_pa"]
            scaled = np.rint(table[:, last - 1 :] * np.where(np.arange(1 + 2 * sensors) == 0, 100, Q10))
            most = np.where(np.arange(1 + 2 * sensors) == 0, 2.0**15, 2.0**31)
            fine &= ~has_raw | ((scaled >= -most) & (scaled < most)).all(axis=1)
        table[~has_raw, first_raw:] = math.nan
        return table, fine

    def tables(self, lines: bytes) -> Iterator[Array | ValueError]:
        """All of them in their order: a count of rows, or what is wrong with one."""
        table = self.table(lines)
        if table is not None:
            yield table
            return
        middle = lines.find(b"\n", len(lines) // 2) + 1 or lines.find(b"\n") + 1
        middle = middle if middle < len(lines) else lines.find(b"\n") + 1
        if middle < len(lines):
            yield from self.tables(lines[:middle])
            yield from self.tables(lines[middle:])
            return
        try:
            yield np.array([self.values(lines[:-1].decode("utf-8", "surrogateescape"))])
        except ValueError as error:
            yield error

    def values(self, text: str) -> list[float]:
        """A row's cells as numbers, NaN where they are empty. Raises ValueError where libfingertip finds no row in it."""
        cells = text.split(",")
        if len(cells) != len(self.names):
            cause = "; separators of thousands, decimal commas, or more cells?" if len(cells) > len(self.names) else ""
            raise ValueError(f"{len(cells)} columns where the header has {len(self.names)}{cause}")
        first_raw = self._first_raw
        has_contact, has_raw = any(cells[2:first_raw]), any(cells[first_raw:])
        if not has_contact and not has_raw:
            raise ValueError("a row without a packet")
        if has_raw and not self.sensors:
            raise ValueError("pressures in a recording without sensors")
        if has_contact and whole("flags", cells[3], "I") & self._untold:
            raise ValueError("its flags need columns that are not there")
        there = [True, True, *(first_raw - 2) * [has_contact], *(len(cells) - first_raw) * [has_raw]]
        return [self._cell(at, cell, cells) if there[at] else math.nan for at, cell in enumerate(cells)]

    def _cell(self, at: int, cell: str, cells: list[str]) -> float:
        name, code = self.names[at], self._codes[at]
        if code == "f":
            return number(name, cell, _BINARY32) if cell or int(cells[3]) & self._flags[at] else math.nan
        if code in "hi":
            return _scaled(name, cell, 100 if code == "h" else Q10, 16 if code == "h" else 32)
        return whole(name, cell, code)
