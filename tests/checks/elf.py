"""What the image checks need of a 32-bit little-endian ELF file: sections, segments, symbols."""

import struct
import sys


def fail(message):
    sys.exit(f"{sys.argv[0].rsplit('/', 1)[-1].removesuffix('.py')}: {message}")


class Section:
    def __init__(self, name, kind, flags, address, offset, size):
        self.name, self.kind, self.flags = name, kind, flags
        self.address, self.offset, self.size = address, offset, size
        self.end = address + size
        self.allocated = bool(flags & 2)
        self.has_bytes = kind != 8


class Symbol:
    def __init__(self, name, value, size, info, section):
        self.name, self.value, self.size = name, value, size
        self.is_function = info & 15 == 2
        self.is_file = info & 15 == 4
        self.section = section


class Elf:
    def __init__(self, path):
        try:
            with open(path, "rb") as file:
                self.data = data = file.read()
        except OSError as error:
            fail(f"{path}: {error.strerror}; build the image first")
        if data[:6] != b"\x7fELF\x01\x01" or struct.unpack_from("<H", data, 18)[0] != 40:
            fail(f"{path}: not a 32-bit little-endian ARM ELF file")
        self.entry, ph, sh = struct.unpack_from("<3I", data, 24)
        ph_size, ph_count, sh_size, sh_count, names = struct.unpack_from("<5H", data, 42)
        heads = [struct.unpack_from("<10I", data, sh + i * sh_size) for i in range(sh_count)]
        text = lambda table, at: data[heads[table][4] + at :].split(b"\0", 1)[0].decode()
        self.sections = [Section(text(names, h[0]), h[1], h[2], h[3], h[4], h[5]) for h in heads]
        # Loaded segments: (load address, run address, bytes)
        self.segments = []
        for i in range(ph_count):
            kind, offset, vaddr, paddr, size, *_ = struct.unpack_from("<8I", data, ph + i * ph_size)
            if kind == 1 and size:
                self.segments.append((paddr, vaddr, data[offset : offset + size]))
        self.symbols = []
        for h in heads:
            if h[1] != 2:
                continue
            for at in range(h[4], h[4] + h[5], 16):
                name, value, size, info, _, index = struct.unpack_from("<3I2BH", data, at)
                self.symbols.append(Symbol(text(h[6], name), value, size, info, index))

    def section(self, name):
        found = [s for s in self.sections if s.name == name]
        return found[0] if found else fail(f"the image has no section {name}")

    def bytes_of(self, name):
        s = self.section(name)
        return self.data[s.offset : s.offset + s.size] if s.has_bytes else b""

    def bytes_at(self, name, size):
        """Of the symbol, in whatever section it is."""
        at = self.value(name)
        s = next((s for s in self.sections if s.allocated and s.has_bytes and s.address <= at < s.end), None)
        return self.data[s.offset + at - s.address :][:size] if s else fail(f"{name} is in no section")

    def value(self, name):
        found = [s.value for s in self.symbols if s.name == name]
        return found[0] if found else fail(f"the image has no symbol {name}")
