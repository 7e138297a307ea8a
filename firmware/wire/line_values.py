"""Packets as numbers by their names, as line.py writes them for the library's C interface and for the page."""

import dataclasses

from line_names import hpp_head

BYTES = {"u8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "u64": 8, "f32": 4, "map": 8, "text": 1}


@dataclasses.dataclass
class Value:
    """A field as programs in other languages have it: its name, and where the C struct holds it."""

    name: str
    kind: str
    member: str
    count: int = 1
    per_sensor: bool = False
    stride: str = ""
    text: str = ""


def values_of(body, line, where, part=""):
    values = []
    for field in body.fields:
        member = f"{where}.{field.member}"
        if field.is_struct:
            values += values_of(line.structs[field.kind], line, member, field.kind)
        elif field.pair:
            values += [Value(name, field.kind, f"{where}.{name}", per_sensor=True, text=field.text) for name in field.pair]
        elif field.each:
            values += [
                Value(name, field.kind, f"{member}[0].{name}", per_sensor=True, stride="sizeof(sensor_calibration)", text=field.text)
                for name in field.each
            ]
        else:
            # Two names would be there twice: those of the header. A part's own are those that recordings have.
            name = (
                field.key
                if field.key != field.name
                else field.python
                if field.name in ("sequence", "t_us")
                else f"pad_{field.name}"
                if part == "pad_profile"
                else field.name
            )
            name = field.name if field.kind == "n" or body.name == "raw" else name
            count = line.text_bytes if field.kind == "text" else field.times
            values.append(Value(name, "u8" if field.kind == "n" else field.kind, member, count, text=field.text))
    return values


def all_values(line):
    """(name in C, body, its values) of each packet and command; the header is not among them."""
    bodies = [*((body.name, body) for body in line.packets.values()), *((f"cmd_{body.name}", body) for body in line.commands.values())]
    return [(name, body, values_of(body, line, f"body.{name}")) for name, body in bodies]


def line_values_hpp(line):
    lines = [
        *hpp_head("Where wire_packet holds each field, for fingertip.cpp alone.", ("cstddef", "cstdint"), "fingertip::values"),
        "enum class Kind : std::uint8_t { u8, u16, i16, u32, i32, u64, f32, text };",
        "",
        "/* count numbers, stride bytes apart; a text is one. */",
        "struct Field {",
        "  const char *name;",
        "  Kind kind;",
        "  std::uint16_t offset, count, stride;",
        "};",
        "",
    ]
    for where, _, values in all_values(line):
        lines.append(f"inline constexpr Field {where}_fields[] = {{")
        lines += [
            '    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},',
            '    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},',
        ]
        for value in values:
            count = "FT_MAX_SENSORS" if value.per_sensor else value.count
            stride, kind = value.stride or BYTES[value.kind], "u64" if value.kind == "map" else value.kind
            lines.append(f'    {{"{value.name}", Kind::{kind}, offsetof(wire_packet, {value.member}), {count}, {stride}}},')
        lines += ["};"]
    lines += [
        "",
        "struct Packet {",
        "  std::uint8_t type;",
        "  const Field *fields;",
        "  std::size_t count;",
        "};",
        "",
        "inline constexpr Packet packets[] = {",
    ]
    for where, body, _ in all_values(line):
        lines.append(f"    {{0x{body.type:02X}, {where}_fields, sizeof {where}_fields / sizeof *{where}_fields}},")
    return [*lines, "};", "", "} // namespace fingertip::values"]


# ---- the page


def page_packets(line):
    """What a packet is in the page: src/core.ts fills it in by these names."""

    def type_of(value, array):
        return "string" if value.kind == "text" else array if value.per_sensor or value.count > 1 else "number"

    lines = [
        "interface Header {",
        "  sequence: number;",
        "  /** Device time since start; in commands the host's own clock. */",
        "  t_us: number;",
        "}",
    ]
    commands = []
    for _, body, values in all_values(line):
        if body in line.commands.values():
            commands.append(
                " ".join(
                    [
                        f"  | {{ type: 0x{body.type:02x};",
                        *(f"{value.name}: {type_of(value, 'ArrayLike<number>')};" for value in values),
                        "}",
                    ]
                )
            )
            continue
        lines += [f"/** {body.text} */", f"export interface {body.name.capitalize()} extends Header {{", f"  type: 0x{body.type:02x};"]
        for value in values:
            lines += [f"  /** {value.text} */"] * bool(value.text) + [f"  {value.name}: {type_of(value, 'Float64Array')};"]
        lines.append("}")
    return [
        *lines,
        f"export type DevicePacket = {' | '.join(body.name.capitalize() for body in line.packets.values())};",
        "/** What a command carries. */",
        "export type Command =",
        *commands[:-1],
        commands[-1] + ";",
    ]
