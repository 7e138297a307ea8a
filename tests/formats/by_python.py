"""What the Python package makes of each input of the corpus, as by_library says it: usage by_python.py JOBS.json > answers.json."""

import json
import math
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "host_tools/python"))

import numpy as np  # noqa: E402
from fingertip import BadValueError, InputError, read_recording, wire  # noqa: E402
from fingertip.line import CONTACT_COLUMNS, LATER_COLUMNS, RAW_COLUMNS, SENSOR_LISTS, SENSORS_MAX, SETTINGS  # noqa: E402
from fingertip.lines import shortest  # noqa: E402
from fingertip.recording import info_metadata  # noqa: E402
from fingertip.device import setting_commands  # noqa: E402

FLAG_OF = {name: int(field.when[1]) for name, field in wire.layout_of(wire.Contact) if field.when and field.code == "f"}
CONTACT = (*CONTACT_COLUMNS, *LATER_COLUMNS)
KINDS = (
    ("holds several", "several"),
    ("no fingertip", "no such"),
    ("format .* is unknown", "other format"),
    ("no recording|no MCAP file|packed as|as text|save (it|them) as|mcap [a-z]+ FILE", "no recording"),
    (r":\d+: |damaged|torn|no header line|missing", "damaged"),
)


def quantity(name, value, flags):
    """A float under its flag; nothing is there where the library holds 0."""
    absent = math.isnan(value) or (not flags & FLAG_OF[name] and value == 0 and math.copysign(1, value) > 0)
    return "" if absent else shortest(value)


def fixed_point(value, scale, digits):
    raw = math.copysign(math.floor(abs(value) * scale + 0.5), value)
    return f"{raw / scale + 0.0:.{digits}f}"


def contact_text(t_us, frame, value):
    flags = int(value("flags"))
    cells = [quantity(name, value(name), flags) if name in FLAG_OF else str(int(value(name))) for name in CONTACT]
    return {"contact": ",".join([str(min(int(t_us), 2**64 - 1)), str(int(frame)), *cells]) + "," * len(RAW_COLUMNS)}


def raw_text(t_us, frame, value, pressures_Pa, tares_Pa):
    cells = [fixed_point(value(name), 100, 2) if name == "temperature_degC" else str(int(value(name))) for name in RAW_COLUMNS]
    cells += [fixed_point(pressure_Pa, 1024, 4) for pressure_Pa in (*pressures_Pa, *tares_Pa)]
    return {"raw": ",".join([str(min(int(t_us), 2**64 - 1)), str(int(frame)), *len(CONTACT) * [""], *cells])}


def info_of(metadata):
    """The keys of a recording's head that are of an info packet, as the library writes them."""

    def plain(key, text):
        if key in ("serial", "board", "scene", "git", "firmware"):
            return text[:16] if key != "firmware" else ".".join(str(int(part)) for part in text.split("."))
        return " ".join(str(int(word)) if re.fullmatch("-?[0-9]+", word) else shortest(float(word)) for word in text.split())

    stored = int(metadata.get("stored", "0"))
    of_calibration = {key for key in KNOWN_KEYS if key.startswith(("calibration_", "force_scale")) or key in SENSOR_LISTS}
    of_pad = {key for key in KNOWN_KEYS if key.startswith("pad_")}
    known = set(KNOWN_KEYS) - (set() if stored & 1 else of_calibration) - (set() if stored & 16 else of_pad)
    nothing = {"serial": "", "board": "", "scene": "", "git": "", "firmware": "0.0.0"}
    found = []
    for key in filter(known.__contains__, KNOWN_KEYS):
        text = plain(key, metadata.get(key, nothing.get(key, "0")))
        if key in ("x_mm", "y_mm", *SENSOR_LISTS):
            text = " ".join([*(text.split() if key in metadata else ()), *["0"] * SENSORS_MAX][: int(metadata["sensors"])])
        found.append([key, text])
    return found


def some_info():
    calibration = wire.Calibration(0, 0, 1, 0, 0, 0, 0, 0, 0, 30 * (1.0,), 45 * (0,))
    pad = wire.PadProfile(*(field.times * (0.0,) if field.times > 1 else 0 for _, field in wire.layout_of(wire.PadProfile)))
    return wire.Info((0, 0, 0), 15, 31, "", "", "", "", 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 30 * (0.0,), 0.0, 0.0, 0.0, 0, 17, calibration, pad)


KNOWN_KEYS = list(info_metadata(some_info()))


def numbers(fields):
    """What a double may not hold is a text."""
    return {name: str(value) if name == "host_time_us" else value for name, value in fields.items()}


def recording(path, salvage, device, part=None):
    from_s, to_s, _ = part or (0, math.inf, 0)
    found = read_recording(path, salvage=salvage, serial=device or None, from_s=from_s, to_s=to_s)
    rows, columns = [], {name: found[name] for name in ("t_us", "frame", "sequence", "raw_sequence", *CONTACT, *RAW_COLUMNS)}
    for i in range(len(found["t_us"])):

        def value(name):
            return float(columns[name][i])

        parts = []
        if not math.isnan(value("sequence")):
            parts.append(contact_text(value("t_us"), value("frame"), value))
        if not math.isnan(value("raw_sequence")):
            parts.append(raw_text(value("t_us"), value("frame"), value, found.sensors_Pa[i], found.tare_Pa[i]))
        rows += parts if found.time_us is None else [{"time_us": f"{found.time_us[i]:.1f}", "row": part} for part in parts]
    fields = {"health": wire.Health._fields, "ack": wire.Acknowledgement._fields, "sync": wire.SyncEdge._fields, "info": ()}
    packets = [{kind: numbers({name: int(values[name]) for name in ("sequence", "t_us", *fields[kind])})} for kind, values in found.packets]
    if part:
        return {"rows": rows, "has_end": bool(found.end), "skipped": found.skipped_lines}
    has_info = any("info" in packet for packet in packets)
    return {
        "rows": rows,
        "packets": packets,
        "events": [event.encode("utf-8", "surrogateescape").decode("utf-8", "replace") for event in found.events],
        "info": info_of(found.metadata) if has_info else None,
        "has_end": bool(found.end),
        "skipped": found.skipped_lines,
    }


def packet_answer(packet):
    body, told = packet.body, {"sequence": packet.sequence, "t_us": packet.t_us}
    answer = {"other": told}
    if isinstance(body, wire.Contact):
        answer = contact_text(
            packet.t_us, body.frame, lambda name: getattr(body, name, packet.sequence) if name != "sequence" else packet.sequence
        )
    elif isinstance(body, wire.Raw):
        named = {"raw_sequence": packet.sequence, "raw_flags": body.flags, "temperature_degC": body.temperature_cC / 100}
        readings = [value / 1024 for value in body.readings]
        answer = raw_text(
            packet.t_us, body.frame, lambda name: named[name] if name in named else getattr(body, name), readings[0::2], readings[1::2]
        )
    elif isinstance(body, wire.Health):
        answer = {"health": {**told, **{name: value or 0 for name, value in body._asdict().items()}}}
    elif isinstance(body, wire.Acknowledgement):
        answer = {"ack": numbers({**told, **body._asdict()})}
    elif isinstance(body, wire.SyncEdge):
        answer = {"sync": numbers({**told, **body._asdict()})}
    elif isinstance(body, wire.Info):
        answer = {"info": told, "keys": [list(pair) for pair in info_metadata(body).items()]}
    return {**answer, "frame": wire.encode(packet).hex()}


def stream(path):
    decoder = wire.Decoder()
    packets = [packet_answer(packet) for packet in decoder.feed(pathlib.Path(path).read_bytes())]
    return {"packets": packets, "counts": decoder.statistics.text(), "other_version": decoder.other_version}


def setting(text):
    """As the command that Fingertip.set sends."""
    key, _, value = text.partition("=")
    try:
        if key == "prior":
            sigma, _, width = value.partition(":")
            keys = {"prior_sigma_mm": 0.0 if value == "none" else float(sigma), **({"prior_width_mm": float(width)} if width else {})}
            if value != "none" and keys["prior_sigma_mm"] == 0:
                raise BadValueError("none is said by its word")
        else:
            name, kind = {
                "rate": ("rate_Hz", float),
                "osr": ("osr", int),
                "limit": ("location_limit_mm", float),
                "slip_threshold": ("slip_threshold_mm", float),
                "slip_window": ("slip_window_ms", int),
                "sync": ("sync", str),
            }[key]
            keys = {name: 0.0 if value == "max" and key == "rate" else kind(value)}
            if keys == {"rate_Hz": 0.0} and value != "max":
                raise BadValueError("max is said by its word")
    except ValueError:
        raise BadValueError(f"{value} is no number") from None
    now = some_info()._replace(slip_threshold_mm=1.0, slip_window_ms=100)
    (command,) = setting_commands({**{each.argument: None for each in SETTINGS}, **keys}, now)
    return wire.encode(wire.Packet(0, 0, command)).hex()


def answer_to(job):
    try:
        if job["kind"] == "recording":
            return recording(job["input"], job["salvage"], job["device"], job.get("part"))
        return stream(job["input"]) if job["kind"] == "stream" else setting(job["input"])
    except InputError as error:
        text = str(error)
        return {"refused": next((kind for pattern, kind in KINDS if re.search(pattern, text)), "other"), "text": text}
    except BadValueError as error:
        return {"refused": "bad value", "text": str(error)}


if __name__ == "__main__":
    np.seterr(all="ignore")  # a number beyond binary32 is an answer, too
    print(json.dumps({job["name"]: answer_to(job) for job in json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))}))
