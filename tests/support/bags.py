"""Judges the MCAP recordings by three readers that know nothing of this project, with build/venv's Python:

    bags.py TOOL FAKE_DEVICE SECONDS TRUNCATIONS > figures.json

What a bag must say is worked out here from the cells of its CSV file alone.
"""

# real time: a simulated fingertip on a pseudo-terminal
import collections
import csv
import dataclasses
import json
import math
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np
import zstandard

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools/python"))
from fingertip import RecordingWriter, wire  # noqa: E402
from fingertip.errors import InputError  # noqa: E402
from fingertip.line import ALL_OF_WORD, MAPS, SENSORS_MAX  # noqa: E402
from fingertip.mcap_recording import McapLines  # noqa: E402
from mcap.exceptions import McapError  # noqa: E402
from mcap.reader import make_reader  # noqa: E402
from mcap.records import Message  # noqa: E402
from mcap.stream_reader import StreamReader  # noqa: E402
from mcap_ros2.decoder import DecoderFactory  # noqa: E402
from real_time import plugged_in  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

PATIENCE_s = 60


RATE_Hz = 1300
TRUSTED, WARNINGS, CONTACT, TARED = 2, 0x7FF00, 1, 32
TANGENTIAL, FROM_TOUCH = 1 << 20, 1 << 21


def call(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=PATIENCE_s)
    if done.returncode:
        raise InputError(f"{words[1]}: {done.stderr.strip()[-500:]}")
    return done


def record(tool, fake_device, folder, seconds, **options):
    """The paths of a recording of a simulated fingertip by the tool, and of the bytes of its line."""
    port, bag, capture = (pathlib.Path(folder) / name for name in ("port", "told.mcap", "told.ftr"))
    options = {"rate": RATE_Hz, "life": 2 * PATIENCE_s, **options}
    with plugged_in(fake_device, port, *(f"{key}={value}" for key, value in options.items())):
        call(tool, "record", bag, "--port", port, "--seconds", seconds, "--raw-bytes", capture, "--overwrite")
    return bag, capture


def some_packets(seed, frames):
    """An info packet, and contacts with flags as they may come, each with its raw packet or one of them alone."""
    prng = random.Random(seed)

    def number():
        return float(np.float32(prng.choice((0.0, -1e-9, 3.25, 1e6, prng.gauss(0, 10)))))

    xy_mm = tuple(float(value) for k in range(15) for value in (9 * (k // 5 - 1), 9 * (k % 5 - 2)))
    frame = re.sub("#.*", "", (ROOT / "tests/vectors/wire/info_grasp.txt").read_text(encoding="utf-8")).split("frame")[1]
    info = wire.decode(bytes.fromhex(frame)[:-1]).body
    calibration = info.calibration._replace(
        gains_and_sds=tuple(1 + k / 100 for k in range(30)), places_and_widths=tuple(50 * k - 1000 for k in range(45))
    )
    info = info._replace(
        sensors=15, capabilities=31, serial=f"{seed:04d}ABCD", xy_mm=xy_mm, sync=1, stored=1, calibration=calibration, pad=None
    )
    yield wire.Packet(0, 1000, info)
    t_us = 2**33
    for frame in range(frames):
        t_us = 500 if frame == frames // 2 else t_us + prng.randrange(100, 40000)  # it restarts
        some, trusted = prng.getrandbits(25), prng.getrandbits(25) & ~WARNINGS | TRUSTED
        flags = prng.choice((TARED, 0, CONTACT | TARED, some, trusted, TRUSTED | CONTACT | TARED | TANGENTIAL))
        values = {}
        for name, field in wire.layout_of(wire.Contact):
            there, bits = not field.when or flags & field.when[1], SENSORS_MAX if field.is_map else 8 * struct.calcsize(field.code)
            values[name] = (number() if field.code == "f" else prng.getrandbits(bits)) if there else field.absent
        contact = wire.Contact(**{**values, "frame": frame, "flags": flags})
        readings = tuple(prng.randrange(-(2**31), 2**31) for _ in range(30))
        raw = wire.Raw(
            frame, flags, prng.getrandbits(15), prng.getrandbits(15), prng.getrandbits(15), prng.randrange(-4000, 8500), 15, readings
        )
        which = prng.randrange(10)
        if which != 0:
            yield wire.Packet(2 * frame & 0xFFFF, t_us, contact)
        if which != 1:
            yield wire.Packet(2 * frame + 1 & 0xFFFF, t_us, raw)
        if which == 2:
            yield wire.Packet(frame & 0xFFFF, t_us, wire.Health(*range(18), 5, prng.getrandbits(10)))
        if which == 3:
            yield wire.Packet(frame & 0xFFFF, t_us, wire.SyncEdge(frame, frame & 1))


def write_random(path, seed, frames):
    packets = some_packets(seed, frames)
    info = next(packets)
    with RecordingWriter(path, info.body, replace=True) as writer:
        for packet in (info, *packets):
            writer.packet(packet)


def plain(value):
    """A message of any reader as nested dictionaries without constants; floats by their bits, so that NaN equals NaN."""
    if isinstance(value, float):
        return "NaN" if math.isnan(value) else value
    if isinstance(value, (np.generic, int, str, bool)):
        return plain(value.item()) if isinstance(value, np.generic) else value
    if isinstance(value, (list, tuple, np.ndarray, bytes, bytearray)) or type(value).__name__ in ("array", "memoryview"):
        return [plain(each) for each in value]
    fields = getattr(value, "__slots__", None) or vars(value)
    return {name: plain(getattr(value, name)) for name in fields if name.islower() and not name.startswith("_")}


def by_mcap(path):
    """[(topic, log time, message)] by PyPI's mcap with its index and CRCs, messages by mcap-ros2-support."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(channel.topic, message.log_time, plain(decoded)) for _, channel, message, decoded in reader.iter_decoded_messages()]


def by_mcap_stream(path):
    """(topic, log time, bytes) by PyPI's mcap from the begin and without an index, up to where the file breaks off."""
    channels, found = {}, []
    with open(path, "rb") as file:
        try:
            for entry in StreamReader(file, validate_crcs=True).records:
                if isinstance(entry, Message):
                    found.append((channels[entry.channel_id], entry.log_time, entry.data))
                elif type(entry).__name__ == "Channel":
                    channels[entry.id] = entry.topic
        except (McapError, struct.error, EOFError, zstandard.ZstdError):  # the last of a chunk whose end is not there
            pass
    return found


def by_rosbags(path):
    with AnyReader([pathlib.Path(path)]) as reader:
        return [
            (connection.topic, time_ns, plain(reader.deserialize(data, connection.msgtype)))
            for connection, time_ns, data in reader.messages()
        ]


def in_order(messages):
    return sorted(messages, key=lambda each: (each[0], each[1], json.dumps(each[2], sort_keys=True)))


def binary32(text):
    value = float(np.float32(text)) if text else math.nan
    return plain(value)


def expected_contacts(csv_path):
    """Of a recording of one: what must stand on contact, wrench and place, by line number."""
    lines = pathlib.Path(csv_path).read_text(encoding="utf-8").splitlines()
    header, rows = None, {}
    for number, line in enumerate(lines, 1):
        if line.startswith("#"):
            continue
        cells = next(csv.reader([line]))
        if header is None:
            header = cells
            continue
        cell = dict(zip(header, cells))
        sensors = sum(name.startswith("tare") for name in header)
        has_contact, has_raw = cell["sequence"] != "", cell["raw_sequence"] != ""
        message = {"line": number, "device": 0, "time_us": "NaN", "has_contact": has_contact, "has_raw": has_raw}
        for name, text in cell.items():
            if name.endswith("_Pa") and name[0] in "st" and name[-4].isdigit():
                continue
            whole = (
                name in ("t_us", "frame", "flags", "sensors_used", "sequence")
                or (name.endswith("_us"))
                or name in ("raw_sequence", "raw_flags", "valid", "saturated", "doubtful")
            )
            message[name.lower()] = (
                int(text or 0) if whole else plain(float(text or "nan")) if name == "temperature_degC" else binary32(text)
            )
        for name, kind in (("pressure_pa", "s"), ("tare_pa", "tare")):
            message[name] = [round(float(cell[f"{kind}{k}_Pa"]) * 1024) / 1024 for k in range(sensors)] if has_raw else []
        maps = {name: message[name] for name in MAPS}
        message |= {name: each & ALL_OF_WORD for name, each in maps.items()}
        message["beyond"] = [each >> 32 for each in maps.values()] if max(maps.values()) > ALL_OF_WORD else []
        rows[number] = message
    return rows


def expected_wrench(contact):
    """By the rule in geometry_msgs/WrenchStamped's definition: (force, torque, place)."""
    flags, nan = contact["flags"], ["NaN"] * 3
    if flags & (CONTACT | TARED | WARNINGS) == TARED:
        force = torque = [0.0] * 3
    elif flags & (TRUSTED | WARNINGS) != TRUSTED:
        force = torque = nan
    else:
        x_m, y_m, z_N = contact["x_mm"] / 1000, contact["y_mm"] / 1000, -contact["force_n"]
        if flags & (TANGENTIAL | FROM_TOUCH) == TANGENTIAL:
            force = [contact["qx_n"], contact["qy_n"], z_N]
            torque = [y_m * z_N, -x_m * z_N, x_m * force[1] - y_m * force[0]]
        else:
            force, torque = ["NaN", "NaN", z_N], [y_m * z_N, -x_m * z_N, "NaN"]
    trusted = flags & (TRUSTED | WARNINGS) == TRUSTED
    return force, torque, [contact["x_mm"] / 1000, contact["y_mm"] / 1000, 0.0] if trusted else nan


def without_header(message):
    return {key: value for key, value in message.items() if key != "header"}


def differences(csv_path, bag):
    """How many messages, and how many of them one of the readers has otherwise than another, or than the CSV file says."""
    written = by_mcap(bag)
    first, second = in_order(written), in_order(by_rosbags(bag))
    stream = by_mcap_stream(bag)
    differ = sum(a != b for a, b in zip(first, second)) + abs(len(first) - len(second)) + abs(len(first) - len(stream))
    lines = pathlib.Path(csv_path).read_bytes().decode("utf-8").split("\n")[:-1]
    expected = expected_contacts(csv_path)
    by_topic, last_ns = collections.defaultdict(list), 0
    for topic, time_ns, message in written:
        stamp = message["header"]["stamp"]
        last_ns = max(last_ns, stamp["sec"] * 10**9 + stamp["nanosec"])  # log times never step back
        differ += last_ns != time_ns
        by_topic[topic.rsplit("/", 1)[-1]].append((time_ns, without_header(message)))
    contacts = {message["line"]: message for _, message in by_topic["contact"]}
    differ += sum(contacts.get(number) != message for number, message in expected.items()) + len(contacts.keys() - expected.keys())
    others = {message["line"]: message["text"] for _, message in (*by_topic["lines"], *by_topic["periodic"])}
    differ += sum(lines[number - 1] != text for number, text in others.items()) + (len(others) + len(contacts) != len(lines))
    periods = [time_ns // 10**7 for time_ns, _ in by_topic["contact"]]  # a hundred a second have their numbers in other messages, too
    repeated = [row for (_, row), one, before in zip(by_topic["contact"], periods, [-1, *periods]) if one != before]
    for topic, parts in (("wrench", (0, 1)), ("place", (2,))):
        wanted = [expected_wrench(contact) for contact in repeated if contact["has_contact"]]
        told = collections.Counter(json.dumps([wrench[part] for part in parts]) for wrench in wanted)
        found = collections.Counter()
        for _, message in by_topic[topic]:
            vectors = [message["wrench"]["force"], message["wrench"]["torque"]] if topic == "wrench" else [message["point"]]
            found[json.dumps([[vector[axis] for axis in "xyz"] for vector in vectors])] += 1
        differ += sum(((told - found) + (found - told)).values())
    told = collections.Counter(
        json.dumps(
            [binary32(a - b) if row["valid"] >> k & 1 else "NaN" for k, (a, b) in enumerate(zip(row["pressure_pa"], row["tare_pa"]))]
        )
        for row in repeated
        if row["has_raw"]
    )
    found = collections.Counter(
        json.dumps([plain(float(values[3])) for values in np.frombuffer(bytes(message["data"]), "<f4").reshape(-1, 4)])
        for _, message in by_topic["pressures"]
    )
    differ += sum(((told - found) + (found - told)).values())
    health = sum(line.startswith("# packet: health") for line in lines)
    differ += health != sum(bool(message["status"][0]["values"]) for _, message in by_topic["diagnostics"])
    return len(first), differ


def contents(bag):
    """All that a bag holds but how its messages are shared out among chunks, in the order of the file. Tool and package may differ there only:
    the package writes by PyPI's mcap, which puts schemas and channels into the first chunk and ends chunks by other sizes."""
    with open(bag, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, statistics = reader.get_header(), reader.get_summary().statistics
        return (
            header,
            dataclasses.replace(statistics, chunk_count=0),
            [(schema, channel, message) for schema, channel, message in reader.iter_messages(log_time_order=False)],
            [(each.name, list(each.metadata.items())) for each in reader.iter_metadata()],
        )


def of_python(csv_path, bag):
    """The recording as the Python package writes it."""
    writer = McapLines(bag, True)
    for line in pathlib.Path(csv_path).read_bytes().decode("utf-8").split("\n")[:-1]:
        writer.line(line)
    writer.close()


def main(tool, fake_device, seconds, random_frames=3000):
    figures = {"mcap_messages": 0, "mcap_messages_differ": 0, "mcap_bags_differ": 0, "mcap_round_trips_differ": 0}
    with tempfile.TemporaryDirectory(prefix="fingertip-") as name:
        folder = pathlib.Path(name)
        os.environ["XDG_RUNTIME_DIR"] = name
        bag, capture = record(tool, fake_device, folder, seconds, rate=400, calibrated=1, pad=1, drop=97, health=500)
        told = folder / "told.csv"
        call(tool, "convert", bag, told)
        random_csv = folder / "random.csv"
        write_random(random_csv, 7, random_frames)
        for number, path in enumerate((told, random_csv)):
            again, ours, python = (folder / f"{number}{end}" for end in (".csv", ".mcap", "_python.mcap"))
            begin_s = time.process_time()
            of_python(path, python)
            figures["mcap_python_us_per_line"] = round((time.process_time() - begin_s) / path.read_bytes().count(b"\n") * 1e6, 1)
            call(tool, "convert", path, ours)
            call(tool, "convert", python, again)
            figures["mcap_round_trips_differ"] += again.read_bytes() != path.read_bytes()
            figures["mcap_bags_differ"] += contents(ours) != contents(python)
            messages, differ = differences(path, python)
            figures["mcap_messages"] += messages
            figures["mcap_messages_differ"] += differ
        figures["mcap_bags_differ"] += contents(bag) != contents(folder / "0.mcap")
        for start in (capture, bag):
            middle, end = folder / ("middle" + (".mcap" if start is capture else ".csv")), folder / f"end{start.suffix}"
            call(tool, "convert", start, middle)
            call(tool, "convert", middle, end)
            figures["mcap_round_trips_differ"] += end.read_bytes() != start.read_bytes()
            middle.unlink()
        frames = sum(not line.startswith("#") for line in told.read_text(encoding="utf-8").splitlines()) - 1
        sizes = {f"mcap_{name}bytes_per_frame": round(path.stat().st_size / frames) for name, path in (("", bag), ("csv_", told))}
    return figures | sizes
