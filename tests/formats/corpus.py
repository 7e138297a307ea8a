"""The inputs of the test: recordings, CSV and MCAP, of one fingertip and of two; bytes of lines; settings as people type them. Good ones, the
same damaged in ways that have a name, and by chance. All follow from here, from tests/vectors/wire and from tests/fuzz/corpus.

A job is {"name", "kind": "recording" | "stream" | "setting", "input": path or text, "salvage", "device"}, and of some recordings "rows_of", "is_whole", "part", "rows".
"""

import bz2
import gzip
import io
import itertools
import json
import lzma
import pathlib
import random
import re
import struct
import sys
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("tests/support", "tests/fuzz", "host_tools/python")]

import bags  # noqa: E402
import fuzz  # noqa: E402
import lz4.frame  # noqa: E402
import mcap.writer  # noqa: E402
import zstandard  # noqa: E402
from fingertip import RecordingWriter, wire  # noqa: E402
from fingertip.line import LATER_COLUMNS, SHAPE_COLUMNS, Flag  # noqa: E402
from fingertip.mcap_recording import CONTACT_TYPE, LINE_TYPE  # noqa: E402
from fingertip.ros_messages import decode, encode, schema_of  # noqa: E402
from mcap.reader import make_reader  # noqa: E402

CHANCES = 120  # for each seed that chance damages
FRAMES = 8
LONG = 1_200_000  # bytes of a line, more than a reader takes
FAR_lines = 70_000  # more than a reader lets wait for one before them
VERSION_AT, TYPE_AT = 0, 1  # of a packet


class Corpus:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.jobs = []

    def recording(self, name, content, end="csv", devices=("",), rows_of="", is_whole=True, **known):
        """rows_of: the name of a recording with the same rows; all of them if it is_whole. known: rows, their number; part: begin and end in s, rows."""
        path = self.folder / f"{name}.{end}"
        with path.open("xb") as file:  # no name twice
            file.write(content)
        for device in devices:
            for salvage in (False, True):
                words = [name, end, *filter(None, [device]), *["salvage"] * salvage]
                job = {"name": " ".join(words), "kind": "recording", "input": str(path), "salvage": salvage, "device": device}
                same = {"rows_of": " ".join([rows_of, *words[1:]]), "is_whole": is_whole} if rows_of else {}
                self.jobs.append(job | same | known)
        return path

    def stream(self, name, content):
        path = self.folder / f"{name}.ftr"
        path.write_bytes(content)
        self.jobs.append({"name": f"{name} stream", "kind": "stream", "input": str(path), "salvage": False, "device": ""})

    def setting(self, text):
        self.jobs.append({"name": text, "kind": "setting", "input": text, "salvage": False, "device": ""})


def seed_packets():
    """Two good contacts and their readings among others of all flags, as bags has them, and a health packet and an answer."""
    packets = list(bags.some_packets(7, FRAMES))
    packets.insert(5, wire.Packet(3, 2**33, wire.Health(*range(1, 21))))
    packets.insert(9, wire.Packet(4, 2**33, wire.Acknowledgement(0x81, 0, 7, 2**40)))
    packets.insert(10, wire.Packet(5, 2**33, wire.SyncEdge(2**32 - 1, 1)))
    return packets


def seed_recording(folder):
    path = pathlib.Path(folder) / "seed.csv"
    info, *packets = seed_packets()
    with RecordingWriter(path, info.body, replace=True, extra={"started_utc": "2024-05-06T07:08:09Z"}) as writer:
        for packet in (info, *packets):
            writer.packet(packet)
        writer.event("gone 2024-05-06T07:08:10.250Z")
    return path.read_bytes()


def lines_of(text):
    return text.decode("utf-8").split("\n")[:-1]


def text_of(lines):
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")


def header_at(lines):
    return next(at for at, line in enumerate(lines) if line.startswith(("t_us,", "device,")))


def full_row_at(lines):
    """A row with a contact that has a fit, and its readings."""
    names = lines[header_at(lines)].split(",")
    for at in range(header_at(lines) + 1, len(lines)):
        cells = dict(zip(names, lines[at].split(",")))
        if lines[at][0].isdigit() and cells["x_mm"] and cells["raw_sequence"]:
            return at
    raise ValueError("no row with all")


def with_cells(lines, **changes):
    """The full row, with other cells."""
    names, at = lines[header_at(lines)].split(","), full_row_at(lines)
    cells = dict(zip(names, lines[at].split(",")))
    return [*lines[:at], ",".join({**cells, **changes}.values()), *lines[at + 1 :]]


def without_columns(lines, names):
    header = lines[header_at(lines)].split(",")
    kept = [at for at, name in enumerate(header) if name not in names]
    return [",".join(cells[at] for at in kept) if len(cells := line.split(",")) == len(header) else line for line in lines]


# Cells of a row by their columns, comments by their keys, settings by their names.
CELLS, COMMENTS, SETTINGS = json.loads((ROOT / "tests/formats/values.json").read_text(encoding="utf-8")).values()
CELLS["frame"].append("9" * 5000)
LINES = ("# just a comment", "#note:x", "# note:", *(f"# {key}: {value}" for key, values in COMMENTS.items() for value in values))


def csv_cases(corpus, name, text, devices):
    lines = lines_of(text)
    header, row = header_at(lines), full_row_at(lines)

    def add(what, content, same=""):
        corpus.recording(f"{name}_{what}", content if isinstance(content, bytes) else text_of(content), devices=devices, rows_of=same)

    add("whole", text)
    for what, end in {"crlf": b"\r\n", "crcrlf": b"\r\r\n", "cr_only": b"\r"}.items():
        add(what, text.replace(b"\n", end), f"{name}_whole")
    add("devices_with_commas", text.replace(b"AAAA BBBB", b"AAAA, BBBB"), f"{name}_whole")
    add("no_end_line", lines[:-1])
    add("no_line_end", text[:-1])
    for cut in (1, 20, len(lines[row])):
        add(f"torn_row_{cut}", text_of(lines[: row + 1])[:-cut])
    add("torn_blank", text + b"  ")
    add("long_note", [*lines[:row], f"# {LONG * 'x'}", *lines[row:]])
    add("header_of_commas", [*lines[:header], LONG * ",", *lines[header + 1 :]])
    add("blank_lines", [*lines[:row], "", " \t", *lines[row:]])
    add("blank_line_first", ["", *lines])
    add("indented", ["  " + line for line in lines], f"{name}_whole")
    add("indented_rows", ["\t" * line[:1].isdigit() + line for line in lines], f"{name}_whole")
    add("byte_order_mark", b"\xef\xbb\xbf" + text)
    for what, cell in {"semicolons": "{};", "tabs": "{}\t", "quotes": '"{}",', "blanks": " {} ,", "decimal_commas": "{};"}.items():
        rows = [[each.replace(".", "," if "comma" in what else ".") for each in line.split(",")] for line in lines]
        filled = [f'"{line}"' + 9 * cell[-1] if "q" in what else line + 9 * cell[-1] for line in lines]
        add(what, [fill if "#" in fill else "".join(map(cell.format, row)) for fill, row in zip(filled, rows)], f"{name}_whole")
    quoted = [re.sub(r"([^,]*)\.([^,]*)", r'"\1,\2"', line) if line[:1].isdigit() else line + 9 * "," * (line[:1] == "#") for line in lines]
    add("decimal_commas_in_quotes", quoted, f"{name}_whole")
    add("twice", text + text)
    add("note", [*lines[:row], "# 12:30 object placed", "#", *lines[row:]])
    add("no_info_packet", [line for line in lines if "packet: info" not in line])
    add("rows_twice", [*lines[: row + 1], *lines[row:]])
    add("rows_backwards", [*lines[: header + 1], *reversed(lines[header + 1 : -1]), lines[-1]])
    for count in (1, header, header + 1):
        add(f"lines_{count}", lines[:count])
    add("first_line_torn", text_of(lines[:1])[:-1])
    add("empty", b"")
    add("header_twice", [*lines[: header + 1], *lines[header:]])
    add("two_ends", [*lines, lines[-1]])
    for number, format_ in enumerate(("0", "3", "01", "1.0", "1 2", "", "\u0661")):
        add(f"format_{number}", [f"{lines[0].rsplit(' ', 1)[0]} {format_}", *lines[1:]])
    add("scenario", ["# fingertip-scenario 1", *lines[1:]])
    add("other_text", ["hello", *lines[1:]])
    add("first_line_blanks", [lines[0] + "  ", *lines[1:]])
    add("unknown_column", [line + (",colour" if at == header else ",1" if line[:1].isdigit() else "") for at, line in enumerate(lines)])
    add("renamed_column", [line.replace("force_N", "force") if at == header else line for at, line in enumerate(lines)])
    add("column_missing", without_columns(lines, ["q_sd_N"]))
    add("earlier", without_columns(lines, LATER_COLUMNS))
    add("before_shapes", without_columns(lines, SHAPE_COLUMNS))
    flagless = [without_flags(lines[header], line) if line[:1].isdigit() else line for line in lines]
    add("earlier_flags", without_columns(flagless, LATER_COLUMNS))
    add("before_shapes_flags", without_columns(flagless, SHAPE_COLUMNS))
    add("sensors_0", without_columns(lines, [f"{kind}{k}_Pa" for kind in ("s", "tare") for k in range(15)]))
    add("sensors_14", without_columns(lines, ["s14_Pa", "tare14_Pa", "s0_Pa", "tare0_Pa"]))
    add("row_longer", [*lines[:row], lines[row] + ",", *lines[row + 1 :]])
    add("row_shorter", [*lines[:row], lines[row].rsplit(",", 1)[0], *lines[row + 1 :]])
    names = lines[header].split(",")
    first, last = names.index("sequence"), names.index("raw_sequence")
    add("no_contact", with_cells(lines, **dict.fromkeys(names[first:last], "")))
    add("no_raw", with_cells(lines, **dict.fromkeys(names[last:], "")))
    add("no_packet", with_cells(lines, **dict.fromkeys(names[first:], "")))
    for column, values in CELLS.items():
        for number, value in enumerate(values if column in names else ()):
            add(f"cell_{column}_{number}", with_cells(lines, **{column: value}))
    for value in ("0", "3.5"):
        add(f"cell_without_flag_{value}", with_cells(lines, flags="0", x_mm=value))
    for number, comment in enumerate(LINES):
        own = comment.replace("# ", "# 0/", 1) if devices != ("",) else comment
        add(f"comment_{number}", [*lines[:row], own, *lines[row:]])
        add(f"head_{number}", [*lines[:header], own, *lines[header:]])
    prng = random.Random(name)
    for chance in range(CHANCES):
        add(f"chance_{chance}", fuzz.damaged(text, [text], prng))


def without_flags(header, row):
    """Those of the later columns are off."""
    cells = dict(zip(header.split(","), row.split(",")))
    if cells["flags"]:
        later = Flag.TANGENTIAL_VALID | Flag.VELOCITY_VALID | Flag.SHAPE_VALID | Flag.TWO_CONTACTS | Flag.EDGE
        cells["flags"] = str(int(cells["flags"]) & ~later)
    return ",".join(cells.values())


def joint_cases(corpus, text):
    lines = lines_of(text)
    header = header_at(lines)

    def add(what, content):
        corpus.recording(f"two_joint_{what}", text_of(content), devices=("", "AAAA", "bbbb", "CCCC"))

    add("as_it_is", lines)
    add("no_devices", [line for line in lines if not line.startswith("# devices")])
    add("devices_late", [*lines[:1], *lines[2:], lines[1]])
    add("header_of_one", [line.removeprefix("device,time_us,") if at == header else line for at, line in enumerate(lines)])
    changes = [("0,", "00,"), ("0,", "5,"), *(("0,1000.5,", f"0,{time},") for time in ("", "noon", "inf")), ("1,2000.5,", "1,-2000.5,")]
    changes += [("0,", "AAAA,"), ("0,1000.5,41177,", "0,1000.5#"), ("1,2000.5,2990954", "1,2000.5,x"), ("0,1000.5,41177", "0")]
    for number, change in enumerate(changes):
        add(f"row_{number}", [line.replace(*change, 1) if line.startswith(change[0]) else line for line in lines])
    of_one = ("0/end: frames", "1/end: frames", "9/event: x", "00/event: x", "0/a/b: c", "pad 3/4: x")
    for number, comment in enumerate((*of_one, "end: frames", "event: x", "note: 0/event: c", "grip: x", "packet: info sequence=1 t_us=1")):
        add(f"comment_{number}", [*lines[: header + 1], f"# {comment}", *lines[header + 1 :]])


def bag_of(
    path, lines, change=lambda number, name, row: [(name, row)], compression=mcap.writer.CompressionType.ZSTD, chunk=2000, **options
):
    """A bag with the lines and contacts of another, each as change has it: (schema's name, message or bytes)s."""
    with open(path, "wb") as file:
        writer = mcap.writer.Writer(file, chunk_size=chunk, compression=compression, **options)
        writer.start("ros2", "other")
        channels = {}
        for name in (LINE_TYPE, CONTACT_TYPE, "std_msgs/Header"):
            schema = writer.register_schema(name.replace("/", "/msg/"), "ros2msg", schema_of(name).encode())
            channels[name] = writer.register_channel(f"/{name.split('/')[1].lower()}", "cdr", schema)
        for number, (name, row) in enumerate(lines):
            for each, data in change(number, name, row):
                writer.add_message(channels[each], number, data if isinstance(data, bytes) else encode(each, data), number)
        writer.finish()
    return path.read_bytes()


def rewritten(corpus, bag, order=list, only="", pack=bytes, **options):
    """A bag as PyPI's mcap writes it: the messages of these topics in this order, in chunks of a few frames."""
    with open(bag, "rb") as file:
        found = order([each for each in make_reader(file).iter_messages() if re.search(only, each[1].topic)])
    path = corpus.folder / "scratch.mcap"
    with open(path, "wb") as file:
        writer = mcap.writer.Writer(file, **{"chunk_size": 3_000, **options})
        writer.start("ros2", "other")
        channels = {}
        for schema, channel, message in found:
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            writer.add_message(channels[channel.topic], message.log_time, pack(message.data), message.publish_time)
        writer.finish()
    return path.read_bytes()


def in_frames(data):
    """Of zstd, without their sizes."""
    pack = zstandard.ZstdCompressor(write_content_size=False).compress
    return pack(data[:9]) + pack(data[9:])


def cases_by_others(corpus, name, bag, devices):
    """A recording that went through tools of others."""
    prng = random.Random(name)

    def in_blocks(found, of=15):
        blocks = [found[at : at + of] for at in range(0, len(found), of)]
        prng.shuffle(blocks)
        return sum(blocks, [])

    corpus.recording(f"{name}_whole", bag.read_bytes(), "mcap", devices)
    count = itertools.count(1)

    def broken(data):
        return zstandard.compress(data)[: -1 if next(count) % 9 == 0 else None]

    unindexed = {"index_types": mcap.writer.IndexType.NONE, "use_statistics": False, "use_summary_offsets": False}
    for what, how in {
        "by_time": {},
        "by_topic": {"order": lambda found: sorted(found, key=lambda each: each[1].topic)},
        "chunks_shuffled": {"order": in_blocks},
        "chunks_backwards": {"order": lambda found: found[::-1]},
        "chunks_shuffled_unindexed": {"order": in_blocks, **unindexed},
        "shuffled": {"order": lambda found: prng.sample(found, len(found))},
        "one_chunk": {"chunk_size": 10**9},
        "no_chunks_by_time": {"use_chunking": False},
        "messages_packed": {"pack": zstandard.compress},
        "messages_in_frames": {"pack": in_frames},
        "messages_broken": {"pack": broken},
        "topics_broken": {"only": "contact", "pack": broken},
        "topics_only": {"only": "/(contact|wrench|place|pressures)$|diagnostics"},
        "topics_only_no_chunks": {"only": "/(contact|wrench|place|pressures)$", "use_chunking": False},
        "topics_packed": {"only": "contact|pressures", "pack": zstandard.compress},
        "topics_backwards": {"only": "contact|pressures", "order": lambda found: found[::-1], "chunk_size": 1, "enable_crcs": False},
        "contacts_alone": {"only": "contact"},
        "channels_late": {"order": lambda found: sorted(found, key=lambda each: "lines" in each[1].topic), "chunk_size": 1000},
        "front_gone": {"order": lambda found: found[60:]},
        "others_alone": {"only": "wrench|place|diagnostics"},
        "lines_alone": {"only": "lines"},
    }.items():
        data = rewritten(corpus, bag, **how)
        is_whole = not re.search("alone|topics_back|broken|gone", what) and (name == "one_bag" or "topics" not in what)
        corpus.recording(f"{name}_{what}", data, "mcap", devices, f"{name}_whole", is_whole)
        corpus.recording(f"{name}_{what}_cut", data[: len(data) * 2 // 3], "mcap", devices, f"{name}_whole", False)
        if what == "topics_only":
            chunk = make_reader(io.BytesIO(data)).get_summary().chunk_indexes[-2]
            at = chunk.chunk_start_offset + chunk.chunk_length - 9
            damaged = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
            corpus.recording(f"{name}_{what}_damaged", damaged, "mcap", devices, f"{name}_whole", False)
        if what == "topics_backwards":  # an index that lacks a chunk
            at = data.rindex(struct.pack("<Q", make_reader(io.BytesIO(data)).get_summary().chunk_indexes[9].chunk_start_offset)) - 25
            corpus.recording(f"{name}_unlisted", data[:at] + b"\x7f" + data[at + 1 :], "mcap", devices, f"{name}_whole", False)
    for pack in (zstandard.compress, gzip.compress, lz4.frame.compress, bz2.compress, lzma.compress):
        corpus.recording(f"{name}_packed_as_a_whole_by_{pack.__module__.split('.')[0]}", pack(bag.read_bytes()), "mcap", devices)


def part_cases(corpus, text, convert):
    """A second and a half of five: before a restart, and behind it, where times go on by the event's."""
    lines = lines_of(text)
    header, row = header_at(lines), full_row_at(lines)
    rows = [lines[row].replace(lines[row].split(",")[0], str(10**6 + 20_000 * (i % 150)), 1) for i in range(250)]
    rows = [line for i, each in enumerate(rows) for line in (*[f"# event: note {i}"] * (i % 50 == 0), each)]
    rows.insert(rows.index("# event: note 150"), "# event: back 2024-05-06T07:08:13.500Z")
    start, bag, by_package = (corpus.folder / f"start_part.{end}" for end in ("csv", "mcap", "package.mcap"))
    start.write_bytes(text_of([*lines[: header + 1], *rows, lines[-1]]))
    convert(start, bag)
    bags.of_python(start, by_package)
    data = bytearray(bag.read_bytes())
    with open(bag, "rb") as file:
        chunk = make_reader(file).get_summary().chunk_indexes[-1]
    data[chunk.chunk_start_offset + chunk.chunk_length - 9] ^= 1  # in the last second: read by the index, it is not met
    for name, part in (("before", [0.995, 2.495, 150]), ("behind", [4.495, 9, 200])):
        corpus.recording(f"part_{name}", start.read_bytes(), part=part)
        for which, content in (("tool", bag.read_bytes()), ("package", by_package.read_bytes())):
            corpus.recording(f"part_{name}_{which}", content, "mcap", part=part)
        corpus.recording(f"part_{name}_by_topic", rewritten(corpus, bag, lambda found: found[::-1]), "mcap", part=part)
    corpus.recording("part_damaged_behind", bytes(data), "mcap", part=[0.995, 2.495, 150])


def messages_of(path):
    """[(schema's name, message)] of lines and contacts."""
    with open(path, "rb") as file:
        read = make_reader(file).iter_messages(log_time_order=False)
        found = [(schema.name.replace("/msg/", "/"), message.data) for schema, _, message in read]
    return [(name, decode(name, data)) for name, data in found if name in (LINE_TYPE, CONTACT_TYPE)]


def message_cases(corpus, name, bag, devices):
    messages = messages_of(bag)
    full = [at for at, (kind, row) in enumerate(messages) if kind == CONTACT_TYPE and row["has_contact"] and row["has_raw"]]
    where = [at for at in full if messages[at][1]["flags"] & 2 and messages[at][1]["device"] == 0]
    at = where[0] if where else next(at for at, (kind, row) in enumerate(messages) if kind == CONTACT_TYPE)
    scratch = corpus.folder / "scratch.mcap"

    def add(what, change=None, **options):
        def at_its_place(number, kind, row):
            return change(kind, dict(row)) if change and number == at else [(kind, row)]

        corpus.recording(f"{name}_{what}", bag_of(scratch, messages, at_its_place, **options), "mcap", devices)

    nan, inf = float("nan"), float("inf")
    row = messages[at][1]
    pressures = list(row["pressure_pa"])
    for compression in mcap.writer.CompressionType:
        add(f"packed_by_{compression.name}", compression=compression)
    add("no_chunks", use_chunking=False)
    add("no_crc", enable_crcs=False)
    add("no_index", index_types=mcap.writer.IndexType.NONE, use_statistics=False, use_summary_offsets=False)
    add("large_chunks", lambda kind, row: [("std_msgs/Header", bytes(3_000_000)), (kind, row)], chunk=10**8)
    values = {
        "x_mm": (nan, inf),
        "time_us": (inf, -inf, 5.5, nan, 1e300),
        "device": (7,),
        "pressure_pa": (pressures[:-1], *([each, *pressures[1:]] for each in (3e6, -2097152.0, nan, 0.00048828125))),
        "tare_pa": (pressures[:-1], [-3e6, *pressures[1:]]),
        "temperature_degc": (400.0, nan),
        "has_contact": (False,),
        "has_raw": (False,),
        "line": (row["line"] - 1, row["line"] + 5, 1, 0),
        "t_us": (2**53,),
    }
    changes = [{name: value} for name, each in values.items() for value in each]
    changes += [{"flags": 0, "x_mm": nan}, {"flags": 0, "x_mm": 3.5}, {"x_mm": nan, "y_mm": nan, "force_n": nan}]
    counts = (pressures[:-1], [*pressures, 0.0], 33 * [0.0], [])  # other numbers of sensors
    changes += [{"has_contact": False, "has_raw": False}, *({"pressure_pa": each, "tare_pa": each} for each in counts)]
    for number, change in enumerate(changes):
        add(f"message_{'_'.join(change)}_{number}", lambda kind, row, change=change: [(kind, {**row, **change})])
    good = encode(CONTACT_TYPE, row)
    others = (b"\0\0" + good[2:], b"\0\3" + good[2:])  # big endian, with parameters
    for number, data in enumerate((good[:-5], good[:20], b"", good[:4], good + bytes(8), *others)):
        add(f"message_bytes_{number}", lambda kind, row, data=data: [(kind, data)])
    add("message_missing", lambda kind, row: [])
    add("message_twice", lambda kind, row: [(kind, row), (kind, row)])
    add("message_of_others", lambda kind, row: [("std_msgs/Header", b"\0\1\0\0nonsense"), (kind, row)])
    line = {"header": row["header"], "line": row["line"], "torn": False}
    for number, text in enumerate(("# note: x", "1,2,3", "# note: a\nb", "", " ", "# note: \u00e4", "# note: x\r")):
        add(f"line_text_{number}", lambda kind, row, text=text: [(LINE_TYPE, {**line, "text": text})])
    add("line_torn", lambda kind, row: [(LINE_TYPE, {**line, "text": "# note: x", "torn": True})])
    add("line_torn_empty", lambda kind, row: [(LINE_TYPE, {**line, "text": "", "torn": True})])
    plain = encode(LINE_TYPE, {**line, "text": "# note: x"})
    add("line_not_utf8", lambda kind, row: [(LINE_TYPE, plain.replace(b"note", b"\xff\xfe\xfd\xfc"))])
    add("line_without_end", lambda kind, row: [(LINE_TYPE, plain[:-2])])
    length_at = plain.index(b"# note") - 4
    for length in (0, 1, 5, 2**31):
        data = plain[:length_at] + struct.pack("<I", length) + plain[length_at + 4 :]
        add(f"line_length_{length}", lambda kind, row, data=data: [(LINE_TYPE, data)])
    first = next(number for number, (kind, _) in enumerate(messages) if kind == CONTACT_TYPE)
    kept = [messages[first - 1 :], messages[:first], [], messages[: first - 1] + messages[first:], messages[1:]]
    kept.append([(kind, {**row, "has_raw": False}) for kind, row in messages[first:] if kind == CONTACT_TYPE])
    kept.append([messages[0], (LINE_TYPE, {**messages[1][1], "text": " "}), *messages[2:]])
    for number, each in enumerate(kept):
        corpus.recording(f"{name}_kept_{number}", bag_of(scratch, each), "mcap", devices)


def bag_cases(corpus, name, content, devices, chances):
    def add(what, data):
        corpus.recording(f"{name}_{what}", data, "mcap", devices)

    chunks = make_reader(io.BytesIO(content)).get_summary().chunk_indexes
    add("whole", content)
    for chunk in (chunks[0], chunks[-1]):
        start, end = chunk.chunk_start_offset, chunk.chunk_start_offset + chunk.chunk_length
        number = chunks.index(chunk)
        for at in (start, start + 1, start + 5, (start + end) // 2, end - 1, end):
            add(f"cut_{number}_{at - start}", content[:at])
        add(f"without_chunk_{number}", content[:start] + content[end:])
        add(f"chunk_twice_{number}", content[:end] + content[start:])
        sizes = (struct.pack("<QI", 5, 0), struct.pack("<Q", 5), struct.pack("<Q", 1 << 62))  # the first without CRC
        fields = [(start + 1, struct.pack("<Q", 1 << 40)), (start, b"\x7f"), (start + 41, b"lz4x"), *((start + 25, size) for size in sizes)]
        fields += [(start + 33, crc) for crc in (b"\1\2\3\4", bytes(4))]
        for field, (at, data) in enumerate(fields):
            add(f"chunk_{number}_field_{field}", content[:at] + data + content[at + len(data) :])
    add("magic_only", content[:8])
    add("half_a_magic", content[:5])
    add("copied_as_text", content.replace(b"\n", b"\r\n"))
    for behind in (b"hello", content):
        add(f"{len(behind)}_bytes_behind", content + behind)
    add("no_footer", content[: chunks[-1].chunk_start_offset + chunks[-1].chunk_length + chunks[-1].message_index_length])
    prng = random.Random(name)
    for chance in range(chances):
        data = bytearray(content)
        data[prng.randrange(8, chunks[-1].chunk_start_offset + chunks[-1].chunk_length)] ^= 1 << prng.randrange(8)
        if (name, chance) != ("one_of_tool", 89):  # a bit that zstd refuses and fzstd passes over, with the right CRC
            add(f"chance_{chance}", bytes(data))


def inner_cases(corpus, messages, devices):
    """Chunks that are whole, with records in them that are not."""
    path = corpus.folder / "scratch.mcap"
    content = bag_of(path, messages, compression=mcap.writer.CompressionType.NONE, enable_crcs=False, chunk=10**9)
    at = content.index(b"\x05", 60)  # the first message's record
    while content[at + 3 : at + 9] != bytes(6):
        at = content.index(b"\x05", at + 1)
    lengths = ((at + 1, struct.pack("<Q", length)) for length in (1 << 30, 3, 0))
    for number, (place, data) in enumerate((*lengths, (at + 9, b"\x63"), *((at, opcode) for opcode in (b"\x7f", b"\x06", b"\x0f")))):
        corpus.recording(f"inner_{number}", content[:place] + data + content[place + len(data) :], "mcap", devices)


def frame_of(packet):
    data = bytes(packet)
    return wire.cobs_encode(data + struct.pack("<I", zlib.crc32(data))) + b"\0"


def stream_cases(corpus):
    found = fuzz.vectors()
    add = corpus.stream
    for name, (packet, frame) in found.items():
        body = packet[:-4]
        add(name, b"\0" + frame)
        if name.startswith("command_") and name != "command_calibrate":  # a fingertip sends none
            continue
        add(f"{name}_not_joined", frame)
        add(f"{name}_no_delimiter", b"\0" + frame[:-1])
        add(f"{name}_crc", b"\0" + wire.cobs_encode(packet[:-1] + bytes([packet[-1] ^ 1])) + b"\0")
        add(f"{name}_version", b"\0" + frame_of(bytes([body[VERSION_AT] - 1]) + body[1:]))
        add(f"{name}_type", b"\0" + frame_of(body[:TYPE_AT] + b"\x70" + body[TYPE_AT + 1 :]))
        add(f"{name}_longer", b"\0" + frame_of(body + b"\0"))
        add(f"{name}_shorter", b"\0" + frame_of(body[:-1]))
        prng = random.Random(name)
        for chance in range(6):  # another value somewhere in the body, with the right CRC
            changed = bytearray(body)
            changed[prng.randrange(12, max(13, len(body))) % len(body)] ^= 1 << prng.randrange(8)
            if name != "contact_wide" or chance not in (1, 5):  # sensors beyond the 53rd, whose numbers a page rounds
                add(f"{name}_value_{chance}", b"\0" + frame_of(changed))
            cut = bytearray(b"\0" + frame)
            cut[prng.randrange(1, len(cut))] ^= 1 << prng.randrange(8)
            add(f"{name}_chance_{chance}", bytes(cut) + b"\0" + frame)
    contact = found["contact_grasp"][0][:-4]
    for at in range(12, len(contact) - 3, 2):
        for what, value in (("nan", b"\0\0\xc0\x7f"), ("inf", b"\0\0\x80\xff")):
            add(f"contact_{what}_at_{at}", b"\0" + frame_of(contact[:at] + value + contact[at + 4 :]))
    raw = found["raw"][0][:-4]
    for sensors in (0, 1, 14, 16, 32, 33, 255):
        add(f"raw_sensors_{sensors}", b"\0" + frame_of(raw[:34] + bytes([sensors]) + raw[35:]))
        fitting = raw[:34] + bytes([sensors]) + bytes(8 * sensors)
        if len(fitting) < 800:
            add(f"raw_fits_{sensors}", b"\0" + frame_of(fitting))
    info = found["info_grasp"][0][:-4]
    for what, text in (("umlaut", b"\xe4"), ("zero_within", b"a\0b"), ("escape", b"\x1b")):
        add(f"info_text_{what}", b"\0" + frame_of(info[:20] + text + info[20 + len(text) :]))
    add("all", b"\0" + b"".join(frame for _, frame in found.values()))
    frames = [frame for name, (_, frame) in found.items() if not name.startswith("command_")]
    packets = [packet[:-4] for packet, _ in found.values()]
    add("joined_within", frames[0][5:] + b"".join(frames[1:]))
    add("empty", b"")
    add("zeros", bytes(20) + frames[0] + bytes(20) + frames[1])
    add("overlong", b"\0" + b"\1" * 2000 + b"\0" + frames[0])
    add("longest", b"\0" + wire.cobs_encode(bytes(range(1, 256)) * 3 + bytes(68)) + b"\0" + frames[0])
    sequences = (5, 6, 6, 4, 5, 9, 65535, 0, 1, 40000, 3)
    add("sequences", b"\0" + b"".join(frame_of(contact[:2] + struct.pack("<H", number) + contact[4:]) for number in sequences))
    add("backwards", b"\0" + b"".join(frame_of(contact[:4] + struct.pack("<Q", t_us) + contact[12:]) for t_us in (2**40, 2**39, 0, 2**53)))
    add("unknown_between", b"\0" + frames[0] + frame_of(packets[0][:1] + b"\x70\x01\x00" + packets[0][4:]) + frames[1])
    prng = random.Random("streams")
    for chance in range(60):
        data = bytearray(b"\0" + b"".join(prng.sample(frames, 6)))
        for _ in range(prng.randrange(1, 6)):
            at = prng.randrange(len(data))
            data[at : at + prng.randrange(4)] = prng.choice((b"", b"\0", b"\xff", b"\0\0", bytes([prng.randrange(256)])))
        add(f"chance_{chance}", bytes(data))
    add("noise", bytes(prng.randrange(256) for _ in range(4000)))


def fuzz_seed(path):
    content = path.read_bytes()[1:]
    if not content.startswith(b"\x89MCAP0") or schema_of(CONTACT_TYPE).encode() not in content:
        sys.exit(f"{path}: holds no contact message of today; make it again with tests/fuzz/mcap_seeds.py")
    return content


def make(folder, convert):
    """The jobs. convert(path, path): the tool's way from a recording to another."""
    corpus = Corpus(folder)
    one = seed_recording(folder)
    two = (ROOT / "tests/fuzz/corpus/recording/two").read_bytes()[1:]
    csv_cases(corpus, "one", one, ("",))
    csv_cases(corpus, "two", two, ("AAAA", "BBBB"))
    joint_cases(corpus, two)
    for name, text, devices in (("one", one, ("",)), ("two", two, ("AAAA",))):
        start = corpus.folder / f"start_{name}.csv"
        start.write_bytes(text)
        by_tool, by_package = (corpus.folder / f"start_{name}_{by}.mcap" for by in ("tool", "package"))
        convert(start, by_tool)
        bags.of_python(start, by_package)
        bag_cases(corpus, f"{name}_of_tool", by_tool.read_bytes(), devices, 2 * CHANCES)
        bag_cases(corpus, f"{name}_of_package", by_package.read_bytes(), devices, 2 * CHANCES)
        message_cases(corpus, f"{name}_bag", by_tool, devices)
        if name == "one":
            cases_by_others(corpus, "one_bag", by_tool, devices)
            by_lz4 = rewritten(corpus, by_tool, compression=mcap.writer.CompressionType.LZ4)
            bag_cases(corpus, "one_packed_by_lz4", by_lz4, devices, CHANCES)
            inner_cases(corpus, messages_of(by_tool), devices)
    part_cases(corpus, one, convert)
    for path in sorted((ROOT / "tests/formats/found").iterdir()):  # NAME.ROWS.csv: each was once read otherwise by one of the three
        corpus.recording(f"found_{path.stem}", path.read_bytes(), path.suffix[1:], ("BBBB",), rows=int(path.stem.split(".")[1]))
    lines, bag = lines_of(two), corpus.folder / "start_many.mcap"
    rows = [line.replace("000.5", f"{time:03}.5", 1) for time in (*range(40), *range(30, 70)) for line in lines if line[0].isdigit()]
    start.write_bytes(text_of([*lines[: header_at(lines) + 1], *rows, lines[-1]]))
    convert(start, bag)
    cases_by_others(corpus, "many_bag", bag, ("BBBB",))
    notes = len(rows) * ["# note"] * (FAR_lines // len(rows) // len(rows))
    start.write_bytes(text_of([*lines[: header_at(lines) + 1], *(line for row in rows for line in (row, *notes)), lines[-1]]))
    convert(start, bag)
    backwards = rewritten(corpus, bag, lambda found: found[::-1], chunk_size=100_000)
    corpus.recording("many_bag_far_backwards", backwards, "mcap", ("BBBB",), "many_bag_whole")
    for path in sorted((ROOT / "tests/fuzz/corpus/mcap").iterdir()):
        corpus.recording(f"fuzz_{path.name}", fuzz_seed(path), "mcap", ("", "AAAA", "BBBB"))
    for begin in (b"\xd0\xcf\x11\xe0", b"\x93NUMPY", b"MATLAB 5", b"\x89HDF", b"SQLite format 3"):
        corpus.recording(f"begins_{begin.hex()}", begin + bytes(99))
    stream_cases(corpus)
    for name, values in SETTINGS.items():
        for value in values:
            corpus.setting(f"{name}={value}")
    return corpus.jobs
