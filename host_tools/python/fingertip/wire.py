"""The wire protocol's packets as bytes and back (firmware/wire/PROTOCOL.md), in pure Python; line.py has the packets."""

import functools
import math
import operator
import struct
import typing
import zlib
from collections.abc import Callable
from typing import Any, NamedTuple

from .errors import CrcError, FormatError, PacketError, PacketVersionError, UnknownTypeError
from .line import *  # the packets, which belong to this module for its users

_HEADER = struct.Struct("<BBHQ")
_CRC = _FLAGS = struct.Struct("<I")
# CRC-32/ISO-HDLC over anything and its own CRC.
_CRC_RESIDUE = 0x2144DF1C
_LONGEST_RUN = 255
_MAPS = {0: "I", WIDE: "Q"}  # struct's code of one, by what the version has
_TYPE_OF: dict[type[Body], int] = {body: number for number, body in TYPES.items()}


class Packet(NamedTuple):
    """t_us: device time; of a command any clock of the host, which comes back in its acknowledgement."""

    sequence: int
    t_us: int
    body: Body


Layout = tuple[tuple[str, Wire], ...]


@functools.cache
def layout_of(body: Any) -> Layout:
    """The fields of a body, its type, in their order on the line."""
    hints = typing.get_type_hints(body, include_extras=True)
    return tuple((name, next(each for each in typing.get_args(hints[name])[1:] if isinstance(each, Wire))) for name in body._fields)


def _text(field: bytes) -> str:
    text = field.rstrip(b"\0")
    if any(not 0x20 <= byte <= 0x7E for byte in text):
        raise FormatError("a text that is not printable ASCII")
    return text.decode("ascii")


def _is_left_out(wire: Wire, values: dict[str, Any]) -> bool:
    return wire.when is not None and not values[wire.when[0]] & wire.when[1]


def _get(body: Any, data: bytes, at: int, sensors: int) -> tuple[Any, int]:
    """A body that begins at this offset of a packet, and where it ends. Raises struct.error where the bytes end before."""
    values: dict[str, Any] = {}
    for name, wire in layout_of(body):
        if _is_left_out(wire, values):
            values[name] = wire.absent
        elif wire.code in NESTED:
            values[name], at = _get(NESTED[wire.code], data, at, sensors)
        elif wire.code == "n":
            sensors = values[name] = data[at] if at < len(data) else 0
            if not 1 <= sensors <= SENSORS_MAX:
                raise FormatError(f"{sensors} sensors")
            at += 1
        else:
            count = wire.times * (sensors if wire.each_sensor else 1)
            code = _MAPS[data[0] & WIDE] if wire.is_map else wire.code
            form = f"<{code}" if count == 1 and not wire.each_sensor else f"<{count}{code}"
            found = struct.unpack_from(form, data, at)
            at += struct.calcsize(form)
            if wire.code == "f" and not all(map(math.isfinite, found)):
                raise FormatError(f"{name} is not finite")
            if wire.code == "16s":
                found = (_text(found[0]),)
            values[name] = found if wire.times > 1 else found[0]
    return body(**values), at


def _is_wide(body: Any) -> bool:
    most = {
        name: ALL_OF_WORD if wire.is_map else SENSORS_OF_WORD for name, wire in layout_of(body.__class__) if wire.is_map or wire.code == "n"
    }
    return any(getattr(body, name) > number for name, number in most.items())


def _put(body: Any, sensors: int, wide: int) -> bytes:
    data = b""
    values: dict[str, Any] = body._asdict()
    for name, wire in layout_of(body.__class__):
        value = values[name]
        if _is_left_out(wire, values):
            continue
        if wire.code in NESTED:
            data += _put(value, sensors, wide)
            continue
        if wire.code == "n":
            if not 1 <= value <= SENSORS_MAX:
                raise FormatError(f"{value} sensors")
            sensors = value
            data += bytes([value])
            continue
        items: tuple[Any, ...] = value if wire.times > 1 else (value,)
        if len(items) != wire.times * (sensors if wire.each_sensor else 1):
            raise FormatError(f"{name} has {len(items)} values")
        if wire.code == "16s":
            items = (value.encode("ascii", "replace"),)
            if _text(items[0]) != value or len(items[0]) > 16:
                raise FormatError(f'{name} is "{value}"')
        try:
            data += struct.pack("<" + (_MAPS[wide] if wire.is_map else wire.code) * len(items), *items)
        except (struct.error, OverflowError, TypeError):
            raise FormatError(f"{name} is {value}") from None
        if wire.code == "f" and not all(map(math.isfinite, items)):
            raise FormatError(f"{name} is not finite")
    return data


def cobs_encode(packet: bytes) -> bytes:
    """Without zeros, and without the delimiter."""
    coded = bytearray()
    runs = packet.split(b"\0")
    for number, run in enumerate(runs):
        while len(run) >= _LONGEST_RUN - 1:
            coded.append(_LONGEST_RUN)
            coded += run[: _LONGEST_RUN - 1]
            run = run[_LONGEST_RUN - 1 :]
            if not run and number == len(runs) - 1:
                return bytes(coded)  # a full run at the end needs no other
        coded.append(len(run) + 1)
        coded += run
    return bytes(coded)


def cobs_decode(frame: bytes) -> bytearray:
    """A frame without its delimiter. Raises FormatError for bytes that no encoder produces."""
    if 0 in frame:
        raise FormatError("a zero in a frame")
    data = bytearray(frame)
    at, end, full_runs = 0, len(data), []
    while at < end:  # in place: all codes but the first become the zeros that they replace
        code = data[at]
        data[at] = 0
        at += code
        if code == _LONGEST_RUN:
            full_runs.append(at)
    if at > end:
        raise FormatError("a frame that ends within a run")
    for after in reversed(full_runs):  # which is no zero
        del data[after : after + 1]
    del data[:1]
    return data


def encode(packet: Packet, version: int = VERSION) -> bytes:
    """The frame on the line, with its delimiter. Raises FormatError for a value that the protocol does not allow."""
    wide = WIDE * _is_wide(packet.body)
    try:
        head = _HEADER.pack(version | wide, _TYPE_OF[type(packet.body)], packet.sequence, packet.t_us)
    except struct.error:
        raise FormatError(f"sequence {packet.sequence} or time {packet.t_us} us") from None
    data = head + _put(packet.body, 0, wide)
    return cobs_encode(data + _CRC.pack(zlib.crc32(data))) + b"\0"


class _FixedLayout(NamedTuple):
    """Header and body of one shape at once."""

    unpacker: struct.Struct
    order: Callable[[tuple[Any, ...]], tuple[Any, ...]]  # a body's fields out of what was unpacked, behind it NaN and 0
    floats: int  # from here on


class _ContactLayouts(dict[int, _FixedLayout]):
    """By which of the flags are set under which something is there."""

    FIELDS = layout_of(Contact)
    MASK = functools.reduce(operator.or_, (int(wire.when[1]) for _, wire in FIELDS if wire.when))

    def __missing__(self, mask: int) -> _FixedLayout:
        there = [(name, wire) for name, wire in self.FIELDS if not wire.when or mask & wire.when[1]]
        unpacker = struct.Struct("<BBHQ" + "".join(_MAPS[0] if wire.is_map else wire.code for _, wire in there))
        places = {name: 4 + i for i, (name, _) in enumerate(there)}
        nan = 4 + len(there)
        order = [places.get(name, nan if wire.code == "f" else nan + 1) for name, wire in self.FIELDS]
        floats = next((4 + i for i, (_, wire) in enumerate(there) if wire.code == "f"), nan)
        self[mask] = layout = _FixedLayout(unpacker, operator.itemgetter(*order), floats)
        return layout


class _RawLayouts(dict[int, struct.Struct]):
    """By the number of sensors."""

    def __missing__(self, sensors: int) -> struct.Struct:
        self[sensors] = unpacker = struct.Struct(f"<BBHQIIIIIhB{2 * sensors}i")
        return unpacker


_contact_layouts = _ContactLayouts()
_raw_layouts = _RawLayouts()
_ABSENT = (math.nan, 0)
_new = tuple.__new__  # of a NamedTuple, without its detours
_FLAGS_AT, _SENSORS_AT = _HEADER.size + 4, _HEADER.size + 22
_FIRST_READING = 4 + len(Raw._fields) - 1


def decode(frame: bytes) -> Packet:
    """A frame without its delimiter. Raises CrcError, FormatError, PacketVersionError or UnknownTypeError."""
    if len(frame) > MAX_FRAME_BYTES:
        raise FormatError("a frame that is too long")
    data = cobs_decode(frame)
    length = len(data) - _CRC.size
    if length < _HEADER.size:
        raise FormatError("a frame that is too short")
    if zlib.crc32(data) != _CRC_RESIDUE:
        raise CrcError("the CRC is wrong")
    version, number, sequence, t_us = _HEADER.unpack_from(data)
    if version & ~WIDE != VERSION:
        raise PacketVersionError(version)
    # Of the packets of a stream all fields at once: in a few microseconds.
    if number == CONTACT and version == VERSION and length >= _FLAGS_AT + 4:
        unpacker, order, floats = _contact_layouts[_FLAGS.unpack_from(data, _FLAGS_AT)[0] & _ContactLayouts.MASK]
        if unpacker.size == length:
            values = unpacker.unpack_from(data)
            if math.isfinite(sum(values[floats:])):  # or one of them is not: binary32 does not overflow in binary64
                return _new(Packet, (sequence, t_us, _new(Contact, order(values + _ABSENT))))
    if number == RAW and version == VERSION and length > _SENSORS_AT and 1 <= data[_SENSORS_AT] <= SENSORS_MAX:
        unpacker = _raw_layouts[data[_SENSORS_AT]]
        if unpacker.size == length:
            values = unpacker.unpack_from(data)
            return _new(Packet, (sequence, t_us, _new(Raw, (*values[4:_FIRST_READING], values[_FIRST_READING:]))))
    body = TYPES.get(number)
    if body is None:
        raise UnknownTypeError(number, sequence)
    try:
        found, at = _get(body, bytes(data[:length]), _HEADER.size, 0)
    except struct.error:
        at = -1
        found = None
    if at != length or found is None:
        raise FormatError("a body of another length")
    return Packet(sequence, t_us, found)


class LineStatistics:
    """The counts of a line, and of what went wrong on it, as at the end of fingertip's recordings. Nothing is ever dropped without being counted.

    bytes; packets: undamaged and of a known type; dropped_packets: missing from the sequence; out_of_order: repeated, or older than
    one before; crc_errors; format_errors: no frame of this protocol; version_errors; unknown_types: undamaged, of a newer firmware.
    """

    COUNTS = ("packets", "dropped_packets", "out_of_order", "crc_errors", "format_errors", "version_errors", "unknown_types")
    __slots__ = ("bytes", *COUNTS)

    def __init__(self) -> None:
        self.bytes = self.packets = self.dropped_packets = self.out_of_order = 0
        self.crc_errors = self.format_errors = self.version_errors = self.unknown_types = 0

    def __add__(self, other: "LineStatistics") -> "LineStatistics":
        return self._with(other, 1)

    def __sub__(self, other: "LineStatistics") -> "LineStatistics":
        return self._with(other, -1)

    def _with(self, other: "LineStatistics", sign: int) -> "LineStatistics":
        result = LineStatistics()
        for name in self.__slots__:
            setattr(result, name, getattr(self, name) + sign * getattr(other, name))
        return result

    def text(self) -> str:
        """packets=7 dropped_packets=0 ..."""
        return " ".join(f"{name}={getattr(self, name)}" for name in self.COUNTS)

    def __repr__(self) -> str:
        return f"LineStatistics({self.text()})"


class Decoder:
    """Bytes of the line to packets, with an account of everything that went wrong on the way.

    After any damage it goes on after the next 0x00. The frame that is under way when it joins is torn by nature: its failure counts
    as nothing.
    """

    def __init__(self) -> None:
        self.statistics = LineStatistics()
        self.other_version = 0
        self.listener: Callable[[Packet | None, bytes], None] | None = None
        """Called with each packet and its frame, without the delimiter; nothing: the line was interrupted, and begins again."""
        self.restart()

    def restart(self) -> None:
        """The line was interrupted: join again, and expect no particular sequence number."""
        if self.listener:
            self.listener(None, b"")
        self._rest = b""
        self._joining = True
        self._expected = -1

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that these bytes complete, in order."""
        statistics = self.statistics
        statistics.bytes += len(data)
        frames = (self._rest + data).split(b"\0")
        self._rest = frames.pop()[: MAX_FRAME_BYTES + 1]  # cut, it is still too long
        packets: list[Packet] = []
        for frame in frames:
            if frame:
                packet = self._judge(frame)
                if packet is not None:
                    statistics.packets += 1
                    if packet[0] != self._expected:
                        self._follow(packet[0])
                    else:
                        self._expected = packet[0] + 1 & 0xFFFF
                    packets.append(packet)
                    if self.listener:
                        self.listener(packet, frame)
            self._joining = False
        return packets

    def _judge(self, frame: bytes) -> Packet | None:
        try:
            return decode(frame)
        except UnknownTypeError as error:
            self.statistics.unknown_types += 1
            self._follow(error.sequence)
        except PacketVersionError as error:
            self.statistics.version_errors += 1
            self.other_version = error.version
        except CrcError:
            self.statistics.crc_errors += not self._joining
        except PacketError:
            self.statistics.format_errors += not self._joining
        return None

    def _follow(self, sequence: int) -> None:
        if self._expected >= 0:
            ahead = sequence - self._expected & 0xFFFF
            if ahead < 0x8000:
                self.statistics.dropped_packets += ahead
            else:
                self.statistics.out_of_order += 1
        self._expected = sequence + 1 & 0xFFFF
