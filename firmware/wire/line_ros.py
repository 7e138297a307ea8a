"""The contact packet of line.toml as a message of ROS 2."""

from line_names import MADE_BY

ROS_TYPES = {"u16": "uint16", "u32": "uint32", "map": "uint32", "f32": "float32"}


def contact_msg(line):
    contact, raw = line.packets["contact"], line.packets["raw"]

    def described(code, text):
        return f"{code:<27} # {text}" if text else code

    def of(field):
        return described(f"{ROS_TYPES[field.kind]} {field.key.lower()}", field.text)

    lines = [
        f"# {MADE_BY}.",
        "#",
        "# A frame of a fingertip: its contact packet, its raw packet, or both, unchanged. NaN is what there is not: a quantity whose flag is off.",
        "# Use a number only if its flag is on, and no warning: flags & (FIT_VALID | WARNINGS) == FIT_VALID.",
        "",
        described("std_msgs/Header header", "as log time: begin of the recording, and what the clocks show since then"),
        described(
            "uint64 line", "of the recording, from 1, 0 outside of one; counts those of fingertip_msgs/Line and of other fingertips too"
        ),
        described("uint32 device", "number of the fingertip in a recording of several"),
        described("float64 time_us", "on the recorder's clock, since the recording's host_zero_us; NaN in a recording of one"),
        described("uint64 t_us", "on the fingertip's clock: the middle of the sensors' conversion"),
        described("uint32 frame", "number, from the fingertip's start"),
        "",
        described("bool has_contact", "without: all below, until raw_sequence, is 0 and NaN"),
        described("uint16 sequence", "of the packet"),
        "uint32 flags",
    ]
    for flag in line.flags:
        lines.append(described(f"uint32 {flag['name']}={1 << flag['bit']}", "warning: " * bool(flag.get("warning")) + flag["text"]))
    lines.append(described(f"uint32 WARNINGS={line.warnings()}", "all of them"))
    lines += [of(contact.field(name)) for name in contact.columns if name not in ("sequence", "flags")] + [
        of(field) for fields in line.later().values() for field in fields
    ]
    lines += ["", described("bool has_raw", "without: all below is 0, NaN and empty"), "uint16 raw_sequence"]
    maps = [field.key for body in (contact, raw) for field in body.fields if field.kind == "map"]
    lines += [of(field) for field in raw.fields if field.kind in ("u32", "map") and field.name != "frame"]
    return [
        *lines,
        described("float64 temperature_degc", "mean of the sensors; 0 until measured"),
        described("float64[] pressure_pa", "absolute, as measured; exact multiples of 1/1024"),
        described("float64[] tare_pa", "the zero of each sensor"),
        described("uint32[] beyond", f"{', '.join(maps)}: their bits from 32 on; empty where there are none"),
    ]
