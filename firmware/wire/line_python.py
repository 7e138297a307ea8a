"""Packets of line.toml as the Python package has them."""

import textwrap

import line_settings
from line_names import MADE_BY, SETS

STRUCT_CODES = {"u8": "B", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "f32": "f", "map": "Q", "n": "n", "text": "16s"}


def py_wire(field, line):
    if field.is_struct:
        kind = line.structs[field.kind].python
        when = f", when={py_when(field)}" if field.when else ""
        return f'Annotated[{kind}{" | None" if field.when else ""}, Wire("{kind}"{when})]'
    code = STRUCT_CODES[field.kind]
    base = {"f32": "float", "text": "str"}.get(field.kind, "int")
    if field.times > 1 or field.per_sensor:
        base = f"tuple[{base}, ...]"
    wire = (
        f'"{code}"'
        + (f", {field.times}" if field.times > 1 else "")
        + (f", {field.per_sensor}, each_sensor=True" if field.per_sensor else "")
        + ", is_map=True" * (field.kind == "map")
    )
    if field.when:
        absent = "math.nan" if field.kind == "f32" else "0" if field.when[0] == "flags" else None
        base += "" if absent else " | None"
        wire += f", when={py_when(field)}" + (f", absent={absent}" if absent else "")
    return f"Annotated[{base}, Wire({wire})]"


def py_when(field):
    return f'("{field.when[0]}", {SETS[field.when[0]]}.{field.when[1]})'


def py_doc(text, indent="    ", width=140):
    if len(text) <= width - len(indent) - 6:
        return [f'{indent}"""{text}"""']
    return [f'{indent}"""' + f"\n{indent}".join(textwrap.wrap(text, width - len(indent) - 3)), f'{indent}"""']


def py_class(body, line):
    lines = [f"class {body.python}(NamedTuple):", *py_doc(body.text), ""]
    for field in body.fields:
        lines += [f"    {field.python}: {py_wire(field, line)}", *(py_doc(field.text) if field.text else [])]
    if not body.fields:
        lines.pop()
    for field in body.fields:
        names = field.keys or (field.pair if field.kind == "f32" else None) or ()
        for i, name in enumerate(names):
            lines += [
                "",
                "    @property",
                f"    def {name}(self) -> tuple[{'float' if field.kind == 'f32' else 'int'}, ...]:",
                '        """Of each sensor."""',
                f"        return self.{field.python}[{i}::{field.per_sensor}]",
            ]
    return [*lines, "", ""]


def line_py(line):
    lines = [
        f'"""{MADE_BY}.',
        "",
        "The packets of the line between a fingertip and its host (firmware/wire/PROTOCOL.md), and the names of what they number. The annotations of a",
        "body are its layout, for both directions. A quantity that is there only under a bit of another field is NaN (a float) or None without it.",
        '"""',
        "import enum",
        "import math",
        "from typing import TYPE_CHECKING, Annotated, Any, NamedTuple",
        "",
        "from .flags import Flags",
        "",
        "if TYPE_CHECKING:",
        "    import numpy as np",
        "    import numpy.typing as npt",
        "",
        f"VERSION = {line.version}",
        f"SENSORS_MAX = {line.sensors_max}",
        "SENSORS_OF_WORD, ALL_OF_WORD = 32, (1 << 32) - 1",
        "WIDE = 128",
        '"""Of a version: the packet is of more sensors, or a map of it has one beyond these, so that its maps have 64 bits."""',
        f"MAX_FRAME_BYTES = {line.longest_frame()}  # longer is damage",
        f"LOADER_MAGIC = 0x{line.loader_magic:08X}",
        "",
        "",
        "class Wire(NamedTuple):",
        '    """How a field travels: struct\'s code, how many of it, whether once for each sensor, under which bit of which field; of a map, that of a wide one."""',
        "",
        "    code: str",
        "    times: int = 1",
        "    each_sensor: bool = False",
        "    when: tuple[str, int] | None = None",
        "    absent: Any = None",
        "    is_map: bool = False",
        "",
        "",
    ]

    def bits(name, doc, entries, before=(), after=()):
        text = [f"class {name}(Flags):", f'    """{doc}"""', "", *before]
        for each in entries:
            warning = "warning: " if each.get("warning") else ""
            text.append(f"    {each['name']} = 1 << {each['bit']}  #: {warning}{each['text']}")
        return [*text, *after, "", ""]

    lines += bits(
        "Flag",
        "What a frame reports about itself. A quantity may be used only under its VALID flag; without it, it is NaN here.",
        line.flags,
    )
    lines += [
        f"WARNINGS = Flag(0x{line.warnings():X})",
        '"""The numbers are there, but deserve less trust: look at these before you use them."""',
        "",
        "",
    ]
    lines += bits(
        "Streams",
        "What a fingertip sends unasked.",
        line.streams,
        ["    NONE = 0"],
        [f"    ALL = {' | '.join(each['name'] for each in line.streams)}"],
    )
    lines += bits("Capability", "What a firmware can do.", line.capabilities) + bits(
        "Stored", "What a fingertip keeps without power.", line.stored
    )
    lines += [
        "class Result(enum.IntEnum):",
        '    """What an acknowledgement reports."""',
        "",
        *(f"    {each['name']} = {each['number']}  #: {each['text']}" for each in line.results),
        "",
        "",
    ]
    for body in (*line.structs.values(), *line.packets.values(), *line.commands.values()):
        lines += py_class(body, line)
    bodies = [*line.packets.values(), *line.commands.values()]
    lines += [
        f"Body = {bodies[0].python} | " + " | ".join(body.python for body in bodies[1:]),
        f"CONTACT, RAW = 0x{line.packets['contact'].type:02x}, 0x{line.packets['raw'].type:02x}",
        "TYPES: dict[int, type[Body]] = {",
        *(f"    0x{body.type:02X}: {body.python}," for body in bodies),
        "}",
        "NESTED: dict[str, Any] = {" + ", ".join(f'"{body.python}": {body.python}' for body in line.structs.values()) + "}",
        "",
        "",
    ]
    lines += line_settings.python_settings(line)
    contact, raw = line.packets["contact"], line.packets["raw"]
    lines += [
        "# Columns of recordings, and what their comments have of an info packet.",
        py_tuple("STAGES", line.stages()[:-1]),
        py_tuple("MAPS", [field.key for body in (contact, raw) for field in body.fields if field.kind == "map"]),
        py_tuple("CONTACT_COLUMNS", contact.columns),
        *(
            py_tuple(f"{name}_COLUMNS", [field.name for field in fields], "NaN in recordings of before there were any")
            for name, fields in line.later().items()
        ),
        "LATER_COLUMNS = (" + ", ".join(f"*{name}_COLUMNS" for name in line.later()) + ")",
        py_tuple(
            "RAW_COLUMNS",
            [
                "raw_sequence",
                *(field.key for field in raw.fields if field.kind in ("u32", "map") and field.name != "frame"),
                "temperature_degC",
            ],
        ),
        py_tuple("INFO_KEYS", [line.packets["info"].field(name).python for name in line.packets["info"].keys]),
        "# Of a calibration, one value for each sensor, and struct's code of it.",
        "SENSOR_LISTS = {"
        + ", ".join(
            f'"{key}": "{STRUCT_CODES[field.kind]}"' for field in line.structs["calibration"].fields if field.each for key in field.keys
        )
        + "}",
        "",
        "",
    ]
    lines += [
        "class ContactQuantities:",
        '    """The quantities of a contact packet by their names; NaN without their flag, or without a packet."""',
        "",
        "    __slots__ = ()",
        "    contact: Contact",
    ]
    for field in contact.fields:
        if field.when:
            lines += [
                "",
                "    @property",
                f"    def {field.name}(self) -> {'float' if field.kind == 'f32' else 'int'}:",
                *py_doc(field.text[0].upper() + field.text[1:] + ".", "        "),
                f"        return self.contact.{field.name}",
            ]
    return [*lines, "", "", *py_arrays(line)]


def py_arrays(line):
    """The class of a block's arrays."""
    contact, raw = line.packets["contact"], line.packets["raw"]
    lines = ["class BlockQuantities:", '    """The quantities of both packets by their names, an array each."""', ""]
    for field in (*contact.fields, *raw.fields):
        if (field.kind in ("f32", "map") or field.kind.startswith("u")) and field.name not in ("frame", "flags"):
            lines.append(f'    {field.name}: "npt.NDArray[np.{"float64" if field.kind == "f32" else "int64"}]"')
    return lines


def py_tuple(name, words, comment=""):
    body = textwrap.wrap(", ".join(f'"{word}"' for word in words), 140)
    return f"{name} = ({' # ' + comment if comment else ''}\n    " + "\n    ".join(body) + ")"
