"""ROS 2 messages without ROS: their definitions (the folder msg beside this module, with what the numbers mean), and CDR bytes."""

import functools
import importlib.resources
import re
import struct
from typing import Any

CDR_LITTLE_ENDIAN = b"\0\1\0\0"
PRIMITIVES = {"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
PRIMITIVES |= {"int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}
_LATER = {"fingertip_msgs/Contact": bytes(4)}  # its last sequence, empty: messages of before end without it
_FIELD = re.compile(r"^([A-Za-z0-9_/]+)(\[\])?\s+([a-z0-9_]+)\s*(?:#.*)?$")


@functools.cache
def _definition(name: str) -> str:
    package, kind = name.split("/")
    return (importlib.resources.files(__package__) / "msg" / package / "msg" / f"{kind}.msg").read_text(encoding="utf-8")


@functools.cache
def fields_of(name: str) -> tuple[tuple[str, str, bool], ...]:
    """(field, type, whether a sequence) of a message, "geometry_msgs/Wrench"."""
    found = filter(None, map(_FIELD.match, _definition(name).splitlines()))
    return tuple((match[3], match[1], bool(match[2])) for match in found)


@functools.cache
def schema_of(name: str) -> str:
    """The definition with all that it needs, as the schema encoding ros2msg has them. name: "geometry_msgs/WrenchStamped"."""
    needed = [name]
    for each in needed:  # grows
        needed += dict.fromkeys(kind for _, kind, _ in fields_of(each) if "/" in kind and kind not in needed)
    return ("=" * 80 + "\n").join(("" if each == name else f"MSG: {each}\n") + _definition(each) for each in needed)


@functools.lru_cache(4096)
def packer_of(codes: tuple[str, ...]) -> struct.Struct:
    """Of struct's codes in this order, each where CDR aligns it."""
    form, at = "<", 0
    for code in codes:
        size = struct.calcsize("<" + code)
        pad = -at % struct.calcsize("<" + code[-1]) if size else 0
        form += "x" * pad + code
        at += pad + size
    return struct.Struct(form)


def _flatten(name: str, message: dict[str, Any], codes: list[str], flat: list[Any]) -> None:
    for field, kind, is_sequence in fields_of(name):
        value = message[field]
        if is_sequence:
            codes.append("I")
            flat.append(len(value))
            if isinstance(value, bytes):
                codes.append(f"{len(value)}s")
                flat.append(value)
            elif kind in PRIMITIVES:
                codes.append(f"{len(value)}{PRIMITIVES[kind]}")
                flat += value
            else:
                for each in value:
                    _flatten(kind, each, codes, flat)
        elif kind == "string":
            text = value.encode("utf-8") + b"\0"
            codes += ("I", f"{len(text)}s")
            flat += (len(text), text)
        elif kind in PRIMITIVES:
            codes.append(PRIMITIVES[kind])
            flat.append(value)
        else:
            _flatten(kind, value, codes, flat)


def encode(name: str, message: dict[str, Any]) -> bytes:
    """As CDR. message: {field: value}, of a message within it {field: {...}}, of a sequence of bytes also bytes."""
    codes: list[str] = []
    flat: list[Any] = []
    _flatten(name, message, codes, flat)
    return CDR_LITTLE_ENDIAN + packer_of(tuple(codes)).pack(*flat)


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def take(self, code: str, count: int = 1) -> tuple[Any, ...]:
        size = struct.calcsize("<" + code)
        self.at += -self.at % size
        if count * size > len(self.data) - self.at:
            raise ValueError("ends within a field")
        values = struct.unpack_from(f"<{count}{code}", self.data, self.at)
        self.at += count * size
        return values

    def value(self, kind: str) -> Any:
        if kind == "string":
            text: bytes = self.take("s", self.take("I")[0])[0]
            if not text:
                raise ValueError("a text without its end")
            return text[:-1].decode("utf-8", "surrogateescape")
        if kind in PRIMITIVES:
            return self.take(PRIMITIVES[kind])[0]
        return self.message(kind)

    def sequence(self, kind: str) -> Any:
        (count,) = self.take("I")
        if kind in PRIMITIVES:
            return self.take(PRIMITIVES[kind], count) if count else ()
        return tuple(self.value(kind) for _ in range(min(count, len(self.data))))

    def message(self, name: str) -> dict[str, Any]:
        return {field: (self.sequence if is_sequence else self.value)(kind) for field, kind, is_sequence in fields_of(name)}


def decode(name: str, data: bytes) -> dict[str, Any]:
    """Back, as dictionaries. Raises ValueError for bytes that are no such message."""
    if data[:4] != CDR_LITTLE_ENDIAN:
        raise ValueError("no CDR of a known kind")
    return _Reader(data[4:] + _LATER.get(name, b"")).message(name)
