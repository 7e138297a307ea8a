"""The wire protocol's packets as bytes and back (firmware/wire/PROTOCOL.md, version 5), in pure Python.

Each body is a NamedTuple whose annotations are the layout on the line, for both directions: adding a field to a class adds it to
the codec. A quantity that is there only under a bit of another field is NaN (a float) or None without it.
"""
import functools
import math
import operator
import struct
import typing
import zlib
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from .errors import CrcError, FormatError, PacketError, PacketVersionError, UnknownTypeError
from .names import Capability, Flag, Stored

VERSION = 5
MAX_FRAME_BYTES = 836  # longer is damage
SENSORS_MAX = 32
LOADER_MAGIC = 0x746F6F42
_HEADER = struct.Struct("<BBHQ")
_CRC = _FLAGS = struct.Struct("<I")
# CRC-32/ISO-HDLC over anything and its own CRC.
_CRC_RESIDUE = 0x2144DF1C
_LONGEST_RUN = 255


class Wire(NamedTuple):
    """How a field travels: struct's code, how many of it, whether once for each sensor, and under which bit of which field."""

    code: str
    times: int = 1
    each_sensor: bool = False
    when: tuple[str, int] | None = None
    absent: Any = None


def _quantity(flag: Flag) -> Wire:
    return Wire("f", when=("flags", flag), absent=math.nan)


_STORED_CALIBRATION = ("stored", int(Stored.CALIBRATION))
_STORED_PAD = ("stored", int(Stored.PAD))
_WITH_FIT = ("capabilities", int(Capability.FIT))
_WITH_SLIP = ("capabilities", int(Capability.SLIP))

U8 = Annotated[int, Wire("B")]
U16 = Annotated[int, Wire("H")]
U32 = Annotated[int, Wire("I")]
U64 = Annotated[int, Wire("Q")]
I16 = Annotated[int, Wire("h")]
F32 = Annotated[float, Wire("f")]
Three = Annotated[tuple[float, ...], Wire("f", 3)]
Text = Annotated[str, Wire("16s")]
SensorCount = Annotated[int, Wire("n")]
Fit = Annotated[float, _quantity(Flag.FIT_VALID)]
Uncertainty = Annotated[float, _quantity(Flag.UNCERTAINTY_VALID)]
Widths = Annotated[float, _quantity(Flag.WIDTHS_VALID)]
Tangential = Annotated[float, _quantity(Flag.TANGENTIAL_VALID)]
Velocity = Annotated[float, _quantity(Flag.VELOCITY_VALID)]
IfFit = Annotated[float, Wire("f", when=_WITH_FIT, absent=math.nan)]


class Contact(NamedTuple):
    """One judged frame."""

    frame: U32
    flags: U32
    convert_us: U16
    read_us: U16
    queue_us: U16
    condition_us: U16
    fit_us: U16
    contact_us: U16
    total_us: U16
    sensors_used: Annotated[int, Wire("I", when=("flags", Flag.FIT_VALID), absent=0)]
    x_mm: Fit
    y_mm: Fit
    p0_Pa: Fit
    sigma_mm: Fit
    force_N: Fit
    residual_rms_Pa: Fit
    location_sd_mm: Uncertainty
    force_sd_N: Uncertainty
    slip_mm: Annotated[float, _quantity(Flag.SLIP_VALID)]
    sigma_x_mm: Widths
    sigma_y_mm: Widths
    width_correlation: Widths
    qx_N: Tangential
    qy_N: Tangential
    q_sd_N: Tangential
    tangential_ratio: Tangential
    vx_mm_s: Velocity
    vy_mm_s: Velocity


class Raw(NamedTuple):
    """The readings of one frame. readings: for each sensor absolute pressure and tare, both in 1/1024 Pa."""

    frame: U32
    flags: U32
    valid: U32
    saturated: U32
    doubtful: U32
    temperature_cC: I16
    sensors: SensorCount
    readings: Annotated[tuple[int, ...], Wire("i", 2, each_sensor=True)]


class Calibration(NamedTuple):
    """Gains (pressure = reading / gain) and force scale. date_s: Unix time; gains_and_sds: of each sensor in turn."""

    date_s: U32
    placements: U16
    force_scale: F32
    force_scale_sd: F32
    gains_and_sds: Annotated[tuple[float, ...], Wire("f", 2, each_sensor=True)]

    @property
    def gains(self) -> tuple[float, ...]:
        return self.gains_and_sds[0::2]

    @property
    def gain_sds(self) -> tuple[float, ...]:
        """Relative standard deviations of the gains."""
        return self.gains_and_sds[1::2]


class PadProfile(NamedTuple):
    """How the rubber of a pad spreads what presses and what pulls (firmware/common/pad_profile.h has meaning and ranges)."""

    thickness_mm: F32
    overhang_mm: F32
    normal: Annotated[tuple[float, ...], Wire("f", 4)]  # share and sd_mm of each of two terms
    tangential: Annotated[tuple[float, ...], Wire("f", 6)]  # moment_mm and sd_mm of each of three terms
    spread_mm2: F32
    spread_sd_mm2: F32
    force_ratio: F32
    tangential_scale: F32
    tangential_scale_sd: F32
    edge_ratio_x: Three
    edge_ratio_y: Three
    edge_gain_x: Three
    edge_gain_y: Three
    edge_place_x_mm: Three
    edge_place_y_mm: Three
    edge_pull_x_mm: Three
    edge_pull_y_mm: Three
    edge_force: Three
    from_touch: U8


class Info(NamedTuple):
    """Who a fingertip is, how it is set, and what it keeps.

    rate_mHz: requested, 0 is as fast as the sensors allow; measured_rate_mHz: over the last second. xy_mm: x and y of each sensor in
    turn. prior_sigma_mm and prior_width_mm: 0 and 0 is no prior. What the firmware cannot do is None or NaN.
    """

    firmware: Annotated[tuple[int, ...], Wire("B", 3)]
    sensors: SensorCount
    capabilities: Annotated[int, Wire("I")]
    git: Text
    board: Text
    scene: Text
    serial: Text
    rate_mHz: U32
    measured_rate_mHz: U32
    osr: U16
    temperature_interval_ms: U16
    streams: U8
    fit_iterations: Annotated[int | None, Wire("B", when=_WITH_FIT)]
    slip_window_ms: Annotated[int | None, Wire("H", when=_WITH_SLIP)]
    slip_threshold_mm: Annotated[float, Wire("f", when=_WITH_SLIP, absent=math.nan)]
    pitch_mm: F32
    xy_mm: Annotated[tuple[float, ...], Wire("f", 2, each_sensor=True)]
    prior_sigma_mm: IfFit
    prior_width_mm: IfFit
    location_limit_mm: IfFit
    stored: U32
    calibration: Annotated[Calibration | None, Wire("Calibration", when=_STORED_CALIBRATION)]
    pad: Annotated[PadProfile | None, Wire("PadProfile", when=_STORED_PAD)]

    @property
    def x_mm(self) -> tuple[float, ...]:
        """Of each sensor, across the strips, from the centre of the pad."""
        return self.xy_mm[0::2]

    @property
    def y_mm(self) -> tuple[float, ...]:
        """Of each sensor, along the strips, from the centre of the pad."""
        return self.xy_mm[1::2]


class Health(NamedTuple):
    """Counters since start, which wrap at 2^32, and present state. sensors_present, sensors_prom_bad: bitmaps."""

    capabilities: U32
    uptime_s: U32
    frames: U32
    frames_incomplete: U32
    frames_skipped: U32
    packets_sent: U32
    packets_dropped: U32
    commands_done: U32
    commands_rejected: U32
    bus_nacks: U32
    bus_timeouts: U32
    bus_recoveries: U32
    zero_readings: U32
    implausible_readings: U32
    sensors_present: U32
    sensors_prom_bad: U32
    watchdog_resets: U32
    cpu_busy_permille: U16
    stack_free_bytes: U16
    fit_failures: Annotated[int | None, Wire("I", when=_WITH_FIT)]


class Acknowledgement(NamedTuple):
    """command: its type; command_sequence, host_time_us: those of its header."""

    command: U8
    result: U8
    command_sequence: U16
    host_time_us: U64


class Crash(NamedTuple):
    """How the firmware last came to an end since power-on; kind 0: it did not. event_ages: in 1024 us; end_us: since the start before it."""

    kind: U8
    exception: U8
    vector: U8
    activity: U8
    stuck: U8
    events: Annotated[tuple[int, ...], Wire("B", 8)]
    event_details: Annotated[tuple[int, ...], Wire("B", 8)]
    r0: U32
    r1: U32
    r2: U32
    r3: U32
    r12: U32
    lr: U32
    pc: U32
    xpsr: U32
    sp: U32
    event_ages: Annotated[tuple[int, ...], Wire("I", 8)]
    end_us: U64


class SetStreams(NamedTuple):
    streams: U8


class Tare(NamedTuple):
    force: U8


class SetRate(NamedTuple):
    rate_mHz: U32


class SetOsr(NamedTuple):
    osr: U16


class SetSlip(NamedTuple):
    threshold_mm: F32
    window_ms: U16


class AskInfo(NamedTuple):
    pass


class AskHealth(NamedTuple):
    pass


class Loader(NamedTuple):
    magic: U32


class StoreCalibration(NamedTuple):
    sensors: SensorCount
    calibration: Annotated[Calibration, Wire("Calibration")]


class EraseCalibration(NamedTuple):
    pass


class Keep(NamedTuple):
    keep: U8


class SetPrior(NamedTuple):
    sigma_mm: F32
    width_mm: F32


class SetLocationLimit(NamedTuple):
    limit_mm: F32


class StorePad(NamedTuple):
    profile: Annotated[PadProfile, Wire("PadProfile")]


class ErasePad(NamedTuple):
    pass


class AskCrash(NamedTuple):
    pass


Body = (Contact | Raw | Info | Health | Acknowledgement | Crash | SetStreams | Tare | SetRate | SetOsr | SetSlip | AskInfo | AskHealth | Loader
        | StoreCalibration | EraseCalibration | Keep | SetPrior | SetLocationLimit | StorePad | ErasePad | AskCrash)
CONTACT, RAW = 0x01, 0x02
TYPES: dict[int, type[Body]] = {
    CONTACT: Contact, RAW: Raw, 0x03: Info, 0x04: Health, 0x05: Acknowledgement, 0x06: Crash,
    0x80: SetStreams, 0x81: Tare, 0x82: SetRate, 0x83: SetOsr, 0x84: SetSlip, 0x85: AskInfo, 0x86: AskHealth, 0x87: Loader,
    0x88: StoreCalibration, 0x89: EraseCalibration, 0x8A: Keep, 0x8B: SetPrior, 0x8C: SetLocationLimit, 0x8D: StorePad, 0x8E: ErasePad,
    0x8F: AskCrash,
}
_TYPE_OF: dict[type[Body], int] = {body: number for number, body in TYPES.items()}
_NESTED: dict[str, Any] = {"Calibration": Calibration, "PadProfile": PadProfile}


class Packet(NamedTuple):
    """t_us: device time; of a command any clock of the host, which comes back in its acknowledgement."""

    sequence: int
    t_us: int
    body: Body


Layout = tuple[tuple[str, Wire], ...]
_layouts: dict[Any, Layout] = {}


def layout_of(body: Any) -> Layout:
    """The fields of a body, its type, in their order on the line."""
    if body not in _layouts:
        _layouts[body] = _layout_of(body)
    return _layouts[body]


def _layout_of(body: Any) -> Layout:
    hints = typing.get_type_hints(body, include_extras=True)
    return tuple((name, next(each for each in typing.get_args(hints[name])[1:] if isinstance(each, Wire)))
                 for name in body._fields)


def _text(field: bytes) -> str:
    text = field.rstrip(b"\0")
    if any(not 0x20 <= byte <= 0x7E for byte in text):
        raise FormatError("a text that is not printable ASCII")
    return text.decode("ascii")


def _is_left_out(wire: Wire, values: dict[str, Any]) -> bool:
    return wire.when is not None and not values[wire.when[0]] & wire.when[1]


def _get(body: type[Any], data: bytes, at: int, sensors: int) -> tuple[Any, int]:
    """A body that begins at this offset, and where it ends. Raises struct.error where the bytes end before."""
    values: dict[str, Any] = {}
    for name, wire in layout_of(body):
        if _is_left_out(wire, values):
            values[name] = wire.absent
        elif wire.code in _NESTED:
            values[name], at = _get(_NESTED[wire.code], data, at, sensors)
        elif wire.code == "n":
            sensors = values[name] = data[at] if at < len(data) else 0
            if not 1 <= sensors <= SENSORS_MAX:
                raise FormatError(f"{sensors} sensors")
            at += 1
        else:
            count = wire.times * (sensors if wire.each_sensor else 1)
            form = f"<{wire.code}" if count == 1 and not wire.each_sensor else f"<{count}{wire.code}"
            found = struct.unpack_from(form, data, at)
            at += struct.calcsize(form)
            if wire.code == "f" and not all(map(math.isfinite, found)):
                raise FormatError(f"{name} is not finite")
            if wire.code == "16s":
                found = (_text(found[0]),)
            values[name] = found if wire.times > 1 else found[0]
    return body(**values), at


def _put(body: Any, sensors: int) -> bytes:
    data = b""
    values: dict[str, Any] = body._asdict()
    for name, wire in layout_of(type(body)):
        value = values[name]
        if _is_left_out(wire, values):
            continue
        if wire.code in _NESTED:
            data += _put(value, sensors)
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
            data += struct.pack("<" + wire.code * len(items), *items)
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
            coded += run[:_LONGEST_RUN - 1]
            run = run[_LONGEST_RUN - 1:]
            if not run and number == len(runs) - 1:
                return bytes(coded)  # a full run at the end needs no other
        coded.append(len(run) + 1)
        coded += run
    return bytes(coded)


def cobs_decode(frame: bytes) -> bytes:
    """A frame without its delimiter. Raises FormatError for bytes that no encoder produces."""
    if 0 in frame:
        raise FormatError("a zero in a frame")
    packet = bytearray()
    at, end = 0, len(frame)
    while at < end:
        code = frame[at]
        if at + code > end:
            raise FormatError("a frame that ends within a run")
        packet += frame[at + 1:at + code]
        at += code
        if code != _LONGEST_RUN and at < end:
            packet.append(0)
    return bytes(packet)


def encode(packet: Packet, version: int = VERSION) -> bytes:
    """The frame on the line, with its delimiter. Raises FormatError for a value that the protocol does not allow."""
    try:
        head = _HEADER.pack(version, _TYPE_OF[type(packet.body)], packet.sequence, packet.t_us)
    except struct.error:
        raise FormatError(f"sequence {packet.sequence} or time {packet.t_us} us") from None
    data = head + _put(packet.body, 0)
    return cobs_encode(data + _CRC.pack(zlib.crc32(data))) + b"\0"


def decode(frame: bytes) -> Packet:
    """A frame without its delimiter. Raises CrcError, FormatError, PacketVersionError or UnknownTypeError."""
    if len(frame) > MAX_FRAME_BYTES:
        raise FormatError("a frame that is too long")
    data = cobs_decode(frame)
    if len(data) < _HEADER.size + _CRC.size:
        raise FormatError("a frame that is too short")
    if zlib.crc32(data) != _CRC_RESIDUE:
        raise CrcError("the CRC is wrong")
    version, number, sequence, t_us = _HEADER.unpack_from(data)
    if version != VERSION:
        raise PacketVersionError(version)
    body = TYPES.get(number)
    if body is None:
        raise UnknownTypeError(number, sequence)
    end = len(data) - _CRC.size
    try:
        found, at = _get(body, data[:end], _HEADER.size, 0)
    except struct.error:
        at = -1
        found = None
    if at != end or found is None:
        raise FormatError("a body of another length")
    return Packet(sequence, t_us, found)


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
        unpacker = struct.Struct("<BBHQ" + "".join(wire.code for _, wire in there))
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
_FLAGS_AT = 1 + _HEADER.size + 4
_SENSORS_AT = 1 + _HEADER.size + 22
_FIRST_READING = 4 + len(Raw._fields) - 1


def decode_stream_packet(frame: bytes) -> Packet | None:
    """As decode, in a few microseconds, for a contact or a raw packet; nothing for whatever is not one, or has runs of 254 bytes."""
    data = bytearray(frame)
    at, end = 0, len(data)
    if _LONGEST_RUN in frame:  # perhaps as a code
        while at < end:
            if data[at] == _LONGEST_RUN:
                return None
            at += data[at]
        at = 0
    while at < end:  # in place: all codes but the first become the zeros that they stand for
        code = data[at]
        data[at] = 0
        at += code
    if at != end or end < 1 + _HEADER.size + _CRC.size or zlib.crc32(memoryview(data)[1:]) != _CRC_RESIDUE or data[1] != VERSION:
        return None
    length = end - 1 - _CRC.size
    number = data[2]
    if number == CONTACT and length >= _HEADER.size + 22:
        mask = _FLAGS.unpack_from(data, _FLAGS_AT)[0] & _ContactLayouts.MASK
        unpacker, order, floats = _contact_layouts[mask]
        if unpacker.size != length:
            return None
        values = unpacker.unpack_from(data, 1)
        # not finite if one of them is not: binary32 does not overflow in binary64
        if not math.isfinite(sum(values[floats:])):
            return None
        return _new(Packet, (values[2], values[3], _new(Contact, order(values + _ABSENT))))
    if number == RAW and length >= _HEADER.size + 23:
        sensors = data[_SENSORS_AT]
        if not 1 <= sensors <= SENSORS_MAX:
            return None
        unpacker = _raw_layouts[sensors]
        if unpacker.size != length:
            return None
        values = unpacker.unpack_from(data, 1)
        return _new(Packet, (values[2], values[3], _new(Raw, (*values[4:_FIRST_READING], values[_FIRST_READING:]))))
    return None


class LineStatistics:
    """What a line has said, and what went wrong on it, as fingertip's recordings end with. Nothing is ever dropped without being counted.

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
        """Told each packet with its frame, without the delimiter; nothing: the line was interrupted, and begins anew."""
        self._rest = b""
        self._joining = True
        self._expected = -1

    def restart(self) -> None:
        """The line was interrupted: join anew, and expect no particular sequence number."""
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
        self._rest = frames.pop()[:MAX_FRAME_BYTES + 1]  # cut, it is still too long
        packets: list[Packet] = []
        for frame in frames:
            if frame:
                packet = decode_stream_packet(frame) if len(frame) <= MAX_FRAME_BYTES else None
                if packet is None:
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
