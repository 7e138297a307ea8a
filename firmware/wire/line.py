#!/usr/bin/env python3
"""Writes, from line.toml, what each language needs to know of the line between fingertip and host.

    line.py            write the files
    line.py --check    list which of them differ, and exit with 1

Needs nothing but Python 3.11.
"""

import argparse
import pathlib
import sys
import textwrap

import line_protocol
import line_python
import line_ros
import line_settings
import line_values
import tomllib
from line_names import MADE_BY, SETS, hpp_head

ROOT = pathlib.Path(__file__).resolve().parents[2]
BYTES = {"u8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "u64": 8, "f32": 4, "map": 8, "n": 1}
SENSORS_OF_WORD = 32  # of more a map has 64 bits
C_TYPES = {
    "u8": "uint8_t",
    "u16": "uint16_t",
    "i16": "int16_t",
    "u32": "uint32_t",
    "map": "sensor_map",
    "i32": "int32_t",
    "u64": "uint64_t",
    "f32": "float",
    "n": "uint8_t",
}


class Field:
    """One line of the description."""

    def __init__(self, line, wanted):
        self.name = line["name"]
        kind, _, times = line["type"].partition(" ")
        self.kind, self.times = kind, int(times or 1)
        self.pair = line.get("of")
        self.each = line.get("each")
        self.keys = line.get("keys", self.each)
        self.per_sensor = len(self.pair or self.each or ())
        self.when = tuple(line["when"].split(".")) if "when" in line else None
        self.group = line.get("group")
        self.text = line.get("text", "")
        self.member = (f"{self.group}." if self.group else "") + line.get("c", self.name)
        self.python = line.get("python", self.name)
        self.key = line.get("key", self.name)
        self.range = line.get("range")
        self.is_struct = kind in wanted

    @property
    def type_text(self):
        """As PROTOCOL.md has it."""
        if self.is_struct:
            return self.kind.replace("_", " ")
        if self.per_sensor:
            return f"n x ({' '.join([self.kind] * self.per_sensor)})"
        return {"text": "text 16", "n": "u8"}.get(self.kind, self.kind) + (f" x {self.times}" if self.times > 1 else "")

    @property
    def names_text(self):
        return ", ".join(self.pair or self.each or [self.name])


class Body:
    """A packet, a command, or a part of some."""

    def __init__(self, name, table, wanted):
        self.name = name
        self.type = table.get("type")
        self.python = table["python"]
        self.text = table["text"]
        self.word = table.get("word")
        self.capability = table.get("of")
        self.c_struct = table.get("c_struct")
        self.fields = [Field(line, wanted) for line in table["fields"]]
        self.keys = table.get("keys")
        self.columns = table.get("columns")
        self.sets = table.get("later", {})
        self.lists = table.get("lists", [])

    def field(self, name):
        return next(field for field in self.fields if field.name == name)


class Line:
    def __init__(self, path):
        with open(path, "rb") as file:
            content = tomllib.load(file)
        self.version, self.sensors_max, self.text_bytes, self.loader_magic = (
            content[key] for key in ("version", "sensors_max", "text_bytes", "loader_magic")
        )
        self.flags, self.streams, self.capabilities, self.stored, self.results = (
            content[key] for key in ("flags", "streams", "capabilities", "stored", "results")
        )
        self.ranges = content["ranges"]
        wanted = content["struct"].keys()
        self.structs = {name: Body(name, table, wanted) for name, table in content["struct"].items()}
        self.packets = {name: Body(name, table, wanted) for name, table in content["packet"].items()}
        self.commands = {name: Body(name, table, wanted) for name, table in content["command"].items()}
        self.settings = [line_settings.Setting(each, self) for each in content["settings"]]
        numbers = [body.type for body in (*self.packets.values(), *self.commands.values())]
        for what, values in (("type", numbers), *((key, [each["bit"] for each in getattr(self, key)]) for key in SETS)):
            twice = {value for value in values if values.count(value) > 1}
            if twice:
                raise SystemExit(f"line.py: {what} {sorted(twice)} is there twice")

    def bit(self, when):
        """Of the word that a field names, "flags.FIT_VALID"."""
        return next(each["bit"] for each in getattr(self, when[0]) if each["name"] == when[1])

    def warnings(self):
        return sum(1 << flag["bit"] for flag in self.flags if flag.get("warning"))

    def longest_body(self, sensors):
        """Bytes, with all that a body can hold."""

        def size(fields):
            return sum(
                size(self.structs[field.kind].fields)
                if field.is_struct
                else self.text_bytes
                if field.kind == "text"
                else BYTES[field.kind] * field.times * (field.per_sensor * sensors or 1)
                for field in fields
            )

        return max(size(body.fields) for body in (*self.packets.values(), *self.commands.values()))

    def longest_frame(self):
        """Bytes, delimiter included: with header, CRC, and COBS's byte for each 254."""
        packet = 12 + self.longest_body(self.sensors_max) + 4
        return packet + packet // 254 + 2

    def quantities(self):
        """Fields of contact that hold under a flag and are floats, in the order of the columns."""
        contact = self.packets["contact"]
        first = [contact.field(name) for name in contact.columns if name != "sequence" and contact.field(name).kind == "f32"]
        return first + [field for field in contact.fields if field.kind == "f32" and field not in first]

    def stages(self):
        return [field.name for field in self.packets["contact"].fields if field.group == "stages"]

    def later(self):
        """Columns that are not in recordings of before: {set: fields}."""
        contact = self.packets["contact"]
        sets, name = {each: [] for each in contact.sets}, None
        for field in contact.fields:
            if field.name not in contact.columns and field.name != "frame":
                name = next((each for each, first in contact.sets.items() if first == field.name), name)
                sets[name].append(field)
        return sets


# ---- C


def c_comment(text, indent="  ", width=100):
    if not text:
        return []
    lines = textwrap.wrap(text, width - len(indent) - 6)
    return [
        f"{indent}/* {lines[0]}" + (" */" if len(lines) == 1 else ""),
        *(f"{indent} * {line}" for line in lines[1:-1]),
        *([f"{indent} * {lines[-1]} */"] if len(lines) > 1 else []),
    ]


def c_described(code, text, indent="  "):
    """A declaration with its comment, behind it or above."""
    line = f"{indent}{code} /* {text} */"
    return [line] if text and len(line) <= 100 else [*c_comment(text, indent), indent + code]


def c_bits(title, prefix, entries):
    lines = [*c_comment(title, ""), f"enum wire_{prefix.lower()} {{"]
    for each in entries:
        value = f"1 << {each['bit']}" if "bit" in each else str(each["number"])
        lines += c_described(f"WIRE_{prefix}_{each['name']} = {value},", each["text"])
    return lines


def contact_flags_h(line):
    lines = [
        f"/* {MADE_BY}.",
        " *",
        " * What a contact result reports about itself. The bits travel unchanged in the contact packet.",
        " *",
        " * A quantity may be used only under its VALID flag; where the flag is off its field is zero.",
        " * The warnings leave the numbers in place and state why they deserve less trust.",
        " */",
        "#pragma once",
        "",
        "enum contact_flag {",
    ]
    for flag in line.flags:
        lines += c_described(f"CONTACT_FLAG_{flag['name']} = 1 << {flag['bit']},", "warning: " * bool(flag.get("warning")) + flag["text"])
    return [*lines, "};"]


def c_number(value):
    return f"{value}u" if isinstance(value, int) else f"{value}f"


def c_member(field):
    if field.is_struct:
        return [f"struct {field.kind} {field.name};"]
    if field.pair:
        return [f"{C_TYPES[field.kind]} {name}[FT_MAX_SENSORS];" for name in field.pair]
    if field.kind == "text":
        return [f"char {field.name}[WIRE_TEXT_BYTES];"]
    return [f"{C_TYPES[field.kind]} {field.name}{f'[{field.times}]' if field.times > 1 else ''};"]


def c_struct(name, body, line):
    lines, group, when = [*c_comment(body.text, ""), f"struct {name} {{"], None, None
    groups = {}
    for field in body.fields:
        if field.group:
            if field.group not in groups:
                lines.append(f"  struct wire_{field.group} {field.group};")
            groups.setdefault(field.group, []).append(field)
            continue
        if field.when != when and field.when:
            lines.append(
                f"  /* {field.when[1]} */"
                if field.when[0] == "flags"
                else f"  /* with WIRE_{one(field.when[0])}_{field.when[1]}, else 0 */"
            )
        elif field.when != when:
            lines.append("  /* always */")
        when = field.when
        first, *others = c_member(field)
        lines += c_described(first, field.text) + ["  " + other for other in others]
    before = []
    for group, fields in groups.items():
        before += [
            *c_comment(
                "Where the time of one frame went, us. The stages follow one another without a gap. Values above 65535 saturate.", ""
            ),
            f"struct wire_{group} {{",
        ]
        for field in fields:
            before += c_described(c_member(field)[0], field.text)
        before += ["};", ""]
    return [*before, *lines, "};"]


def one(key):
    return {"capabilities": "CAPABILITY", "stored": "STORED", "streams": "STREAM"}[key]


def bodies_h(line):
    lines = [
        f"/* {MADE_BY}.",
        " *",
        " * The bodies of packets and commands; PROTOCOL.md is the specification. Included by packet.h alone.",
        " */",
        "#pragma once",
        "",
        '#include "common/calibration.h"',
        '#include "common/crash.h"',
        '#include "common/limits.h"',
        '#include "common/pad_profile.h"',
        "",
        "#include <stdint.h>",
        "",
        f"#define WIRE_VERSION {line.version}",
        "",
        "/* Of a packet of more sensors, or whose maps have one beyond these: they are of 64 bits there, and this is added to its version. */",
        f"enum {{ WIRE_SENSORS_OF_WORD = {SENSORS_OF_WORD}, WIRE_WIDE = 128 }};",
        "",
        f"enum {{ WIRE_TEXT_BYTES = {line.text_bytes}, WIRE_MAX_BODY_BYTES = FT_MAX_SENSORS > {SENSORS_OF_WORD} ? "
        f"{line.longest_body(line.sensors_max)} : {line.longest_body(SENSORS_OF_WORD)} }};",
        "",
        "enum wire_type {",
        "  /* device to host */",
    ]
    lines += [f"  WIRE_{body.name.upper()} = 0x{body.type:02X}," for body in line.packets.values()]
    lines += (
        ["  /* host to device */"]
        + [f"  WIRE_CMD_{body.name.upper()} = 0x{body.type:02X}," for body in line.commands.values()]
        + ["};", ""]
    )
    for title, prefix, entries in (
        ("Bits of the stream mask.", "STREAM", line.streams),
        ("What a build can do: cmake/options.cmake.", "CAPABILITY", line.capabilities),
        ("The result code of an acknowledgement.", "RESULT", line.results),
        ("Bits of the word that reports what the fingertip keeps without power.", "STORED", line.stored),
    ):
        lines += c_bits(title, prefix, entries)
        if prefix == "STREAM":
            lines.append(f"  WIRE_STREAM_ALL = {' | '.join('WIRE_STREAM_' + each['name'] for each in entries)},")
        lines += ["};", ""]
    lines += ["/* Ranges of the settings that commands carry; the device answers OUT_OF_RANGE beyond them. */"]
    for name, each in line.ranges.items():
        unit = f"_{each['unit']}" if each["unit"] else ""
        lines += c_comment(each["text"], "")
        if "choices" in each:
            lines += [
                f"#define WIRE_{name}_MIN {each['choices'][0]}u /* and its doubles */",
                f"#define WIRE_{name}_MAX {each['choices'][-1]}u",
            ]
            continue
        lines += [f"#define WIRE_{name}_{end.upper()}{unit} {c_number(each[end])}" for end in ("min", "max", "default") if end in each]
    lines += [f'#define WIRE_LOADER_MAGIC 0x{line.loader_magic:08X}u /* "Boot" */', ""]
    for body in line.packets.values():
        if not body.c_struct:
            lines += [*c_struct(f"wire_{body.name}", body, line), ""]
    for body in line.commands.values():
        if body.fields:
            lines += [*c_struct(f"wire_cmd_{body.name}", body, line), ""]
    lines += ["union wire_body {"]
    lines += [f"  struct {body.c_struct or 'wire_' + body.name} {body.name};" for body in line.packets.values()]
    lines += [f"  struct wire_cmd_{body.name} cmd_{body.name};" for body in line.commands.values() if body.fields]
    lines += ["};", "", "/* The layout of one body. */", "struct wire_layout;"]
    names = [f"wire_{body.name}_layout" for body in line.packets.values()] + [f"cmd_{body.name}_layout" for body in line.commands.values()]
    lines += [f"extern const struct wire_layout {name};" for name in names]
    lines += ["", "/* The commands that every fingertip knows, and those of its capabilities, for its set. */"]
    for capability in dict.fromkeys(body.capability for body in line.commands.values()):
        macro = "WIRE_COMMANDS" + (f"_OF_{capability}" if capability else "")
        entries = [
            f"&cmd_{body.name}_layout"
            for body in sorted(line.commands.values(), key=lambda body: body.type)
            if body.capability == capability
        ]
        lines += [f"#define {macro} \\", *(f"  {entry}, \\" for entry in entries[:-1]), f"  {entries[-1]}"]
    return lines


KINDS = {"u8": "BYTES", "text": "TEXTS", "n": "SENSOR_COUNT", "i16": "U16"}  # others by their own name


def runs_of(body, line, wide, when=None, prefix=""):
    """(kind, count, member, when), consecutive fields of one kind together. wide: maps may have 64 bits."""
    runs = []
    for field in body.fields:
        condition = field.when or when
        member = prefix + field.member
        if field.is_struct:
            runs += runs_of(line.structs[field.kind], line, wide, condition, member + ".")
            continue
        if field.pair:
            run = ("F32_PAIRS" if field.kind == "f32" else "PAIRS", 1, prefix + field.pair[0], condition)
        elif field.each:
            run = (f"SENSORS_{KINDS.get(field.kind, field.kind.upper())}", field.per_sensor, f"{member}[0].{field.each[0]}", condition)
        else:
            kind = "u32" if field.kind == "map" and not wide else field.kind
            run = (KINDS.get(kind, kind.upper()), field.times, member, condition)
        if runs and runs[-1][0] == run[0] and runs[-1][3] == condition and run[0] in ("BYTES", "TEXTS", "U16", "U32", "F32"):
            runs[-1] = (run[0], runs[-1][1] + run[1], *runs[-1][2:])
        else:
            runs.append(run)
    return runs


def run_lines(body, line, where, wide):
    for kind, count, member, when in runs_of(body, line, wide):
        if when:
            yield f"    RUN(WHEN, {line.bit(when)}, {where}.{when[0]}),"
        yield f"    RUN({kind}, {count}, {where}.{member}),"


def layouts_inc(line):
    lines = [
        f"/* {MADE_BY}.",
        " *",
        " * The layouts of all bodies, for packet.c alone. */",
        "",
        f'_Static_assert(FT_MAX_SENSORS == {SENSORS_OF_WORD} || FT_MAX_SENSORS == {line.sensors_max}, "of which WIRE_MAX_BODY_BYTES is made");',
        "",
    ]
    for prefix, bodies in (("wire_", line.packets), ("cmd_", line.commands)):
        for body in bodies.values():
            where = body.name if prefix == "wire_" else "cmd_" + body.name
            name = prefix + body.name
            number = f"WIRE_{'CMD_' if prefix == 'cmd_' else ''}{body.name.upper()}"
            if not body.fields:
                lines.append(f"EMPTY_LAYOUT({name}, {number});")
                continue
            lines.append(f"static const struct run {name}_runs[] = {{")
            wide, narrow = (list(run_lines(body, line, where, each)) for each in (True, False))
            lines += narrow if wide == narrow else ["#if FT_MAX_SENSORS > 32", *wide, "#else", *narrow, "#endif"]
            lines += ["};", f"LAYOUT({name}, {number});"]
    return [
        *lines,
        "",
        "#define ALL_PACKETS \\",
        *(f"  &wire_{body.name}_layout, \\" for body in list(line.packets.values())[:-1]),
        f"  &wire_{list(line.packets)[-1]}_layout",
        "#define ALL_COMMANDS \\",
        "  WIRE_COMMANDS, WIRE_COMMANDS_OF_FIT, WIRE_COMMANDS_OF_SLIP, WIRE_COMMANDS_OF_TANGENTIAL, \\",
        "  WIRE_COMMANDS_OF_SYNC",
    ]


# ---- C++


def line_fields_hpp(line):
    contact, raw, info, health, ack, sync = (line.packets[name] for name in ("contact", "raw", "info", "health", "ack", "sync"))
    lines = [
        *hpp_head(
            "Fields of packets in the order of recordings, and words. No interface.",
            ("cstddef", "cstdint", "string"),
            "fingertip::recording",
        ),
        "/* A value of the packet that the file shows in another unit: shown = raw / scale. */",
        "template <typename Integer> struct Scaled {",
        "  Integer &raw;",
        "  double scale;",
        "  int digits;",
        "};",
        "",
        "/* A float that holds under a flag. */",
        "struct Quantity {",
        "  float &value;",
        "  bool valid;",
        "};",
        "",
        f"inline constexpr std::size_t RAW_COLUMNS = {len(raw.fields) - 2}; /* without those of the sensors */",
        "",
    ]

    def visit_contact(field):
        if field.kind == "f32":
            return f'  visit("{field.name}", Quantity{{contact.{field.member}, (contact.flags & CONTACT_FLAG_{field.when[1]}) != 0}});'
        return f'  visit("{field.name}", contact.{field.member});'

    later = line.later()
    lines += [
        "/* Sets of columns that came later, one after the other; a recording has the first N of them. */",
        f"inline constexpr int LATER_SETS = {len(later)};",
        "",
        "/* Flags of columns that a recording with N of these sets lacks. */",
        "inline constexpr std::uint32_t flags_beyond(int sets) {",
        "  std::uint32_t flags = 0;",
    ]
    for number, fields in enumerate(later.values()):
        flags = " | ".join(f"CONTACT_FLAG_{name}" for name in dict.fromkeys(field.when[1] for field in fields))
        lines.append(f"  flags |= sets > {number} ? 0u : static_cast<std::uint32_t>({flags});")
    lines += [
        "  return flags;",
        "}",
        "",
        "template <typename Visitor>",
        "void visit_contact(Visitor &visit, wire_packet &packet, int sets = LATER_SETS) {",
        "  wire_contact &contact = packet.body.contact;",
    ]
    for name in contact.columns:
        lines.append('  visit("sequence", packet.sequence);' if name == "sequence" else visit_contact(contact.field(name)))
    for number, fields in enumerate(later.values()):
        lines += [f"  if (sets == {number}) {{", "    return;", "  }", *map(visit_contact, fields)]
    lines += ["}", ""]
    lines += [
        "template <typename Visitor>",
        "void visit_raw(Visitor &visit, wire_packet &packet, std::uint8_t sensor_count) {",
        "  wire_raw &raw = packet.body.raw;",
        '  visit("raw_sequence", packet.sequence);',
    ]
    for field in raw.fields:
        if field.kind in ("u32", "map") and field.name != "frame":
            lines.append(f'  visit("{field.key}", raw.{field.name});')
        elif field.name == "temperature_cC":
            lines.append('  visit("temperature_degC", Scaled<std::int16_t>{raw.temperature_cC, 100.0, 2});')
        elif field.pair:
            for column, name in zip(("s", "tare"), field.pair, strict=True):
                lines += [
                    "  for (int k = 0; k < sensor_count; k++) {",
                    f'    visit("{column}" + std::to_string(k) + "_Pa", Scaled<std::int32_t>{{raw.{name}[k], 1024.0, 4}});',
                    "  }",
                ]
    lines += ["}", ""]

    def visitor(name, body, fields, kind):
        return [
            f"template <typename Visitor> void visit_{name}(Visitor &visit, {kind} &{name}) {{",
            *(f'  visit("{field.key}", {name}.{field.member});' for field in fields),
            "}",
            "",
        ]

    lines += visitor("health", health, map(health.field, health.keys), "wire_health") + visitor("ack", ack, ack.fields, "wire_ack")
    lines += visitor("sync", sync, sync.fields, "wire_sync")
    lines += visitor("info", info, map(info.field, info.keys), "wire_info")
    calibration, pad = line.structs["calibration"], line.structs["pad_profile"]
    lines += ["/* What there is only of a calibrated fingertip: numbers, and lists with one for each sensor. */"]
    lines += visitor("calibration", calibration, [field for field in calibration.fields if not field.each], "struct calibration")
    lines += [
        "template <typename Visitor> void visit_sensor_lists(Visitor &visit) {",
        *(
            f'  visit("{key}", &sensor_calibration::{name});'
            for field in calibration.fields
            if field.each
            for key, name in zip(field.keys, field.each, strict=True)
        ),
        "}",
        "",
        "/* What there is only where a pad's profile is stored: numbers, and lists with one for each term. */",
    ]
    lines += visitor("pad", pad, [field for field in pad.fields if field.key.startswith("pad_")], "pad_profile")
    lines += [
        "struct PadList {",
        "  const char *name;",
        "  std::size_t terms;",
        "  float &(*value)(pad_profile &pad, std::size_t term);",
        "};",
        "inline constexpr PadList pad_lists[] = {",
    ]
    for each in pad.lists:
        lines.append(
            f'    {{"{each["key"]}", {each["count"]}, [](pad_profile &pad, std::size_t j) -> float & {{ return pad.{each["member"]}; }}}},'
        )
    lines += [
        "};",
        "",
        "} // namespace fingertip::recording",
        "",
        "namespace fingertip::words {",
        "",
        "struct Word {",
        "  std::uint32_t value; /* a bit, or a number */",
        "  const char *word;",
        "};",
    ]
    for name, prefix, entries, word in (
        ("streams", "WIRE_STREAM_", line.streams, "word"),
        ("capabilities", "WIRE_CAPABILITY_", line.capabilities, "word"),
        ("stored", "WIRE_STORED_", line.stored, "word"),
        ("results", "WIRE_RESULT_", line.results, "word"),
    ):
        lines += [f"inline constexpr Word {name}[] = {{", *(f'    {{{prefix}{each["name"]}, "{each[word]}"}},' for each in entries), "};"]
    lines += [
        "inline constexpr Word commands[] = {",
        *(f'    {{WIRE_CMD_{body.name.upper()}, "{body.word}"}},' for body in line.commands.values()),
        "};",
        "",
        "struct Flag {",
        "  std::uint32_t bit;",
        "  const char *name;",
        "  bool warning;",
        "};",
        "/* Those of state, then the warnings. */",
        "inline constexpr Flag flags[] = {",
    ]
    for flag in sorted(line.flags, key=lambda flag: bool(flag.get("warning"))):
        lines.append(f'    {{CONTACT_FLAG_{flag["name"]}, "{flag["name"]}", {"true" if flag.get("warning") else "false"}}},')
    return [*lines, "};", "", "} // namespace fingertip::words"]


# ---- the page


def line_facts_ts(line):
    lines = [
        f"/** {MADE_BY}. */",
        "",
        f"export const WIRE_VERSION = {line.version};",
        f"export const LOADER_MAGIC = 0x{line.loader_magic:08x};",
        "",
        "export const PacketType = {",
    ]
    lines += [f"  {body.name.upper()}: 0x{body.type:02x}," for body in line.packets.values()]
    lines += [f"  CMD_{body.name.upper()}: 0x{body.type:02x}," for body in line.commands.values()] + ["} as const;", ""]
    for doc, name, entries in (
        ("Bits of the stream mask.", "Stream", line.streams),
        ("What a firmware can do.", "Capability", line.capabilities),
        ("What a fingertip keeps without power.", "Stored", line.stored),
        ("What a frame reports about itself.", "Flag", line.flags),
    ):
        lines += [
            f"/** {doc} */",
            f"export const {name} = {{",
            *(f"  {each['name']}: 1 << {each['bit']}," for each in entries),
            "} as const;",
        ]
    lines += [
        "/** What an acknowledgement reports. */",
        "export const Result = {",
        *(f"  {each['name']}: {each['number']}," for each in line.results),
        "} as const;",
        "",
    ]
    lines += [
        "/** Those of state, then the warnings. warning: the numbers deserve less trust. */",
        "export const FLAGS: readonly { bit: number; name: keyof typeof Flag; warning: boolean; meaning: string }[] = [",
    ]
    for flag in sorted(line.flags, key=lambda flag: bool(flag.get("warning"))):
        lines.append(
            f"  {{ bit: Flag.{flag['name']}, name: '{flag['name']}', warning: {'true' if flag.get('warning') else 'false'}, meaning: {ts_text(flag.get('plain', flag['text']))} }},"
        )
    lines += [
        "];",
        "",
        "/** The quantities of a contact that hold under a flag, in the order of a recording's columns, and that flag. */",
        "export const CONTACT_FLAG = {",
        *(f"  {field.name}: Flag.{field.when[1]}," for field in line.quantities()),
        "} as const;",
        "export type ContactField = keyof typeof CONTACT_FLAG;",
        "export const CONTACT_FIELDS = Object.keys(CONTACT_FLAG) as ContactField[];",
    ]
    return [*lines, "", *line_values.page_packets(line), *line_settings.page_settings(line, ts_text)]


def ts_text(text):
    return f'"{text}"' if "'" in text else f"'{text}'"


FILES = {
    "firmware/common/contact_flags.h": contact_flags_h,
    "firmware/wire/bodies.h": bodies_h,
    "firmware/wire/layouts.inc": layouts_inc,
    "host_tools/library/libfingertip/line_fields.hpp": line_fields_hpp,
    "host_tools/library/libfingertip/line_settings.hpp": line_settings.line_settings_hpp,
    "host_tools/library/libfingertip/line_values.hpp": line_values.line_values_hpp,
    "host_tools/python/fingertip/line.py": line_python.line_py,
    "host_tools/python/fingertip/msg/fingertip_msgs/msg/Contact.msg": line_ros.contact_msg,
    "host_tools/web/src/line/line_facts.ts": line_facts_ts,
}


def written(root):
    """path -> text of each file."""
    line = Line(root / "firmware/wire/line.toml")
    texts = {name: "\n".join(write(line)).rstrip("\n") + "\n" for name, write in FILES.items()}
    page = "firmware/wire/PROTOCOL.md"
    texts[page] = line_protocol.protocol_md(line, (root / page).read_text(encoding="utf-8"))
    return texts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a file differs")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help=argparse.SUPPRESS)
    options = parser.parse_args()
    different = 0
    for name, text in written(options.root).items():
        path = options.root / name
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        different += 1
        if options.check:
            print(f"{name}: is not what line.toml states; python3 firmware/wire/line.py writes it")
        else:
            path.write_text(text, encoding="utf-8")
            print(f"{name}: written")
    return 1 if options.check and different else 0


if __name__ == "__main__":
    sys.exit(main())
