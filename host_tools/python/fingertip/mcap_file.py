"""MCAP files (mcap.dev/spec): written so that a killed writer loses the chunk under way at most, and read up to where they are torn.

Needs the package zstandard, which `pip install "fingertip-tactile[mcap]"` brings.
"""
import os
import struct
import types
import zlib
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from .errors import InputError

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, \
    SUMMARY_OFFSET, DATA_END = range(1, 16)
CHUNK_bytes, CHUNK_ns = 1 << 20, 1_000_000_000  # a chunk ends once it is that large or that long
CHUNK_MOST_bytes = 1 << 26  # of one that is read


def zstandard_module() -> types.ModuleType:
    try:
        import zstandard
    except ImportError:
        raise InputError('MCAP files need the package zstandard; pip install "fingertip-tactile[mcap]"') from None
    return zstandard


def _text(text: str) -> bytes:
    data = text.encode("utf-8")
    return struct.pack("<I", len(data)) + data


def _map(pairs: Mapping[str, str]) -> bytes:
    data = b"".join(_text(key) + _text(value) for key, value in pairs.items())
    return struct.pack("<I", len(data)) + data


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


class _Chunk:
    """The one under way."""

    def __init__(self) -> None:
        self.records = bytearray()
        self.index: dict[int, list[tuple[int, int]]] = {}
        self.first_ns = self.start_ns = self.end_ns = 0


class McapWriter:
    """Times are ns since 1970. write: appends bytes, all or nothing of them; raises what the caller makes of it."""

    def __init__(self, write: Callable[[bytes], None], profile: str, library: str) -> None:
        self._compress = zstandard_module().ZstdCompressor(level=3).compress
        self._write = write
        self._length = 0
        self._schemas: list[bytes] = []
        self._channels: list[bytes] = []
        self._attachments: list[bytes] = []
        self._metadata: list[bytes] = []
        self._chunks: list[bytes] = []
        self._counts: dict[int, int] = {}
        self._span_ns: tuple[int, int] | None = None
        self._chunk = _Chunk()
        self._append(MAGIC + _record(HEADER, _text(profile) + _text(library)))

    def _append(self, data: bytes) -> int:
        """Where it begins."""
        self._write(data)
        self._length += len(data)
        return self._length - len(data)

    def schema(self, name: str, encoding: str, data: bytes) -> int:
        """Its id."""
        number = len(self._schemas) + 1
        record = _record(SCHEMA, struct.pack("<H", number) + _text(name) + _text(encoding) + struct.pack("<I", len(data)) + data)
        self._schemas.append(record)
        self._append(record)
        return number

    def channel(self, topic: str, schema: int, encoding: str, metadata: Mapping[str, str]) -> int:
        """Its id."""
        number = len(self._channels) + 1
        record = _record(CHANNEL, struct.pack("<HH", number, schema) + _text(topic) + _text(encoding) + _map(metadata))
        self._channels.append(record)
        self._append(record)
        return number

    def metadata(self, name: str, pairs: Mapping[str, str]) -> None:
        record = _record(METADATA, _text(name) + _map(pairs))
        at = self._append(record)
        self._metadata.append(_record(METADATA_INDEX, struct.pack("<QQ", at, len(record)) + _text(name)))

    def attachment(self, time_ns: int, name: str, media_type: str, data: bytes) -> None:
        content = struct.pack("<QQ", time_ns, time_ns) + _text(name) + _text(media_type) + struct.pack("<Q", len(data)) + data
        record = _record(ATTACHMENT, content + struct.pack("<I", zlib.crc32(content)))
        at = self._append(record)
        self._attachments.append(_record(ATTACHMENT_INDEX, struct.pack("<QQQQQ", at, len(record), time_ns, time_ns, len(data)) + _text(name)
                                         + _text(media_type)))

    def message(self, channel: int, time_ns: int, data: bytes) -> None:
        chunk = self._chunk
        if chunk.records and (len(chunk.records) >= CHUNK_bytes or abs(time_ns - chunk.first_ns) >= CHUNK_ns):
            self.end_chunk()
            chunk = self._chunk
        if not chunk.records:
            chunk.first_ns = chunk.start_ns = chunk.end_ns = time_ns
        chunk.start_ns = min(chunk.start_ns, time_ns)
        chunk.end_ns = max(chunk.end_ns, time_ns)
        chunk.index.setdefault(channel, []).append((time_ns, len(chunk.records)))
        sequence = self._counts.get(channel, 0)
        self._counts[channel] = sequence + 1
        chunk.records += struct.pack("<BQHIQQ", MESSAGE, 22 + len(data), channel, sequence & 0xFFFFFFFF, time_ns, time_ns)
        chunk.records += data

    def end_chunk(self) -> None:
        """What was written until now outlives the writer."""
        chunk, self._chunk = self._chunk, _Chunk()
        if not chunk.records:
            return
        records = bytes(chunk.records)
        packed = self._compress(records)
        span = struct.pack("<QQ", chunk.start_ns, chunk.end_ns)
        record = _record(CHUNK, span + struct.pack("<QI", len(records), zlib.crc32(records)) + _text("zstd") + struct.pack("<Q", len(packed)) + packed)
        indexes = b""
        places = b""
        for channel, entries in chunk.index.items():
            places += struct.pack("<HQ", channel, self._length + len(record) + len(indexes))
            content = b"".join(struct.pack("<QQ", *entry) for entry in entries)
            indexes += _record(MESSAGE_INDEX, struct.pack("<HI", channel, len(content)) + content)
        at = self._append(record + indexes)
        self._chunks.append(_record(CHUNK_INDEX, span + struct.pack("<QQI", at, len(record), len(places)) + places + struct.pack("<Q", len(indexes))
                                    + _text("zstd") + struct.pack("<QQ", len(packed), len(records))))
        first_ns, last_ns = self._span_ns or (chunk.start_ns, chunk.end_ns)
        self._span_ns = (min(first_ns, chunk.start_ns), max(last_ns, chunk.end_ns))

    def finish(self) -> None:
        """The chunk under way, and the index."""
        self.end_chunk()
        data_end = _record(DATA_END, struct.pack("<I", 0))
        counts = b"".join(struct.pack("<HQ", *pair) for pair in self._counts.items())
        statistics = _record(STATISTICS, struct.pack(
            "<QHIIIIQQI", sum(self._counts.values()), len(self._schemas), len(self._channels), len(self._attachments), len(self._metadata),
            len(self._chunks), *(self._span_ns or (0, 0)), len(counts)) + counts)
        start = self._length + len(data_end)
        summary = offsets = b""
        for opcode, records in ((SCHEMA, self._schemas), (CHANNEL, self._channels), (STATISTICS, [statistics]), (CHUNK_INDEX, self._chunks),
                                (ATTACHMENT_INDEX, self._attachments), (METADATA_INDEX, self._metadata)):
            group = b"".join(records)
            if group:
                offsets += _record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, start + len(summary), len(group)))
                summary += group
        end = summary + offsets + struct.pack("<BQQQ", FOOTER, 20, start, start + len(summary))
        self._append(data_end + end + struct.pack("<I", zlib.crc32(end)) + MAGIC)


class Schema(NamedTuple):
    name: str
    encoding: str
    data: bytes


class Channel(NamedTuple):
    topic: str
    schema: Schema | None
    encoding: str
    metadata: dict[str, str]


class Message(NamedTuple):
    channel: Channel
    time_ns: int
    data: bytes


class _Fields:
    """Reads a record's content from its begin. Raises ValueError where it ends before."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def get(self, form: str) -> tuple[int, ...]:
        if self.at + struct.calcsize(form) > len(self.data):
            raise ValueError("ends within a field")
        values = struct.unpack_from(form, self.data, self.at)
        self.at += struct.calcsize(form)
        return values

    def bytes(self, form: str = "<I") -> bytes:
        length, = self.get(form)
        if self.at + length > len(self.data):
            raise ValueError("ends within a field")
        self.at += length
        return self.data[self.at - length:self.at]

    def text(self) -> str:
        return self.bytes().decode("utf-8")

    def map(self) -> dict[str, str]:
        fields = _Fields(self.bytes())
        pairs = {}
        while fields.at < len(fields.data):
            key = fields.text()
            pairs[key] = fields.text()
        return pairs


class McapReader:
    """The messages of a file in the order in which they were written, from its begin, without its index.

    After the last one torn says whether the file ends within a record. Raises InputError for a file that cannot be
    read, or is none; for a damaged chunk too, unless salvage, which skips and counts it.
    """

    def __init__(self, path: "str | os.PathLike[str]", salvage: bool = False, progress: Callable[[float], None] | None = None) -> None:
        self.path = os.fspath(path)
        self.torn = False
        self.skipped_chunks = 0
        self.metadata: list[tuple[str, dict[str, str]]] = []
        self._salvage = salvage
        self._progress = progress
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._decompress = zstandard_module().ZstdDecompressor().decompress

    def __iter__(self) -> Iterator[Message]:
        try:
            with open(self.path, "rb") as file:
                if file.read(len(MAGIC)) != MAGIC:
                    raise InputError(f"{self.path}: no MCAP file; give one that fingertip has written")
                size = os.fstat(file.fileno()).st_size
                while True:
                    at = file.tell()
                    if self._progress:
                        self._progress(at / size)
                    head = file.read(9)
                    opcode, length = struct.unpack("<BQ", head) if len(head) == 9 else (0, 0)
                    if len(head) < 9 or length > size - at - 9:
                        self.torn = bool(head)  # a killed writer leaves whole chunks
                        return
                    if opcode == DATA_END:
                        return
                    try:
                        yield from self._judge(opcode, file.read(length))
                    except (ValueError, MemoryError) as error:
                        if not self._salvage:
                            raise InputError(f"{self.path}: damaged at byte {at} ({error}); use --salvage to skip the chunk") from None
                        self.skipped_chunks += 1
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; check the path") from None

    def _judge(self, opcode: int, content: bytes) -> Iterator[Message]:
        fields = _Fields(content)
        if opcode == SCHEMA:
            number, = fields.get("<H")
            self._schemas[number] = Schema(fields.text(), fields.text(), fields.bytes())
        elif opcode == CHANNEL:
            number, schema = fields.get("<HH")
            self._channels[number] = Channel(fields.text(), self._schemas.get(schema), fields.text(), fields.map())
        elif opcode == MESSAGE:
            number, _, time_ns, _ = fields.get("<HIQQ")
            if number not in self._channels:
                raise ValueError(f"channel {number} is unknown")
            yield Message(self._channels[number], time_ns, content[fields.at:])
        elif opcode == METADATA:
            self.metadata.append((fields.text(), fields.map()))
        elif opcode == CHUNK:
            yield from self._chunk(fields)

    def _chunk(self, fields: _Fields) -> Iterator[Message]:
        _, _, size, crc = fields.get("<QQQI")
        compression, packed = fields.text(), fields.bytes("<Q")
        if compression not in ("", "zstd"):
            raise ValueError(f'compression "{compression}" is unknown')
        if size > CHUNK_MOST_bytes:
            raise ValueError(f"a chunk of {size} bytes")
        try:
            records = self._decompress(packed, max_output_size=size) if compression else packed
        except zstandard_module().ZstdError as error:
            raise ValueError(str(error)) from None
        if len(records) != size or (crc and zlib.crc32(records) != crc):
            raise ValueError("the CRC is wrong")
        at = 0
        found: list[Message] = []
        while at < size:
            if size - at < 9:
                raise ValueError("ends within a record")
            opcode, length = struct.unpack_from("<BQ", records, at)
            if length > size - at - 9 or opcode == CHUNK:
                raise ValueError("ends within a record")
            found += self._judge(opcode, records[at + 9:at + 9 + length])
            at += 9 + length
        yield from found
