#!/usr/bin/env python3
"""Checks a linked RP2040 image: that the boot ROM will start it, that it lies where it should, and
that it holds nothing that the firmware's rules forbid.

usage: check_image.py IMAGE.elf [--bin IMAGE.bin] [--flash-limit BYTES] [--json FILE]

Prints the sizes; --json writes them. Exit 1 and one line for the first thing that is wrong.
"""

import argparse
import binascii
import json
import re
import struct

from elf import Elf, fail

FLASH = (0x10000000, 2 * 1024 * 1024)
RAM = (0x20000000, 256 * 1024)
SCRATCH_Y = (0x20041000, 4 * 1024)
REGIONS = {".boot2": FLASH, ".boot": FLASH, ".stack": SCRATCH_Y}
REGIONS |= dict.fromkeys((".vectors", ".text", ".rodata", ".data", ".bss", ".noinit"), RAM)
BOOT_EXCEPTIONS = 16
VECTORS = 48

# Why a symbol may not be in an image, and its names.
FORBIDDEN = {
    "double arithmetic; write float constants with an f and call the f functions": re.compile(
        r"__aeabi_(c?d|[a-z0-9]+2d)[a-z0-9]*|__[a-z]+df[a-z0-9]*|__df[a-z0-9]*|__(ieee754|kernel)_[a-z0-9]+(?<!f)"
        r"|(sqrt|cbrt|hypot|exp|exp2|expm1|log|log2|log10|log1p|pow|sin|cos|tan|asin|acos|atan|atan2|sinh|cosh"
        r"|tanh|floor|ceil|round|trunc|rint|lround|lrint|fmod|fma|fabs|ldexp|frexp|scalbn|copysign|erf)"
    ),
    "memory allocation; give the memory to the caller": re.compile(
        r"_?(malloc|calloc|realloc|free|memalign|aligned_alloc|posix_memalign)(_r)?|_?sbrk(_r)?|alloca"
    ),
    "stdio; the firmware has no console": re.compile(
        r"_?[vfsdna]*i?(printf|scanf)(_r|_i|_float|_common)?|f?put[sc](har)?(_r)?|f?get[sc](har)?|f(open|close|read|write"
        r"|flush|seek)(_r)?|_(write|read|close|lseek|fstat|isatty|open)(_r)?|__s(init|flush.*|init_.*)|perror"
    ),
    "a way out of the firmware; use port_panic()": re.compile(
        r"_?exit|abort|atexit|raise|_?kill|__assert(_func)?|(long|set)jmp|__register_exitproc"
    ),
}


def crc32_mpeg2(data):
    """The reflected CRC-32 of binascii over mirrored bytes, mirrored back: shares no code with boot2_checksum.py."""
    mirrored = bytes(int(f"{byte:08b}"[::-1], 2) for byte in data)
    return int(f"{binascii.crc32(mirrored) ^ 0xFFFFFFFF:032b}"[::-1], 2)


def check_boot2(elf):
    boot2 = elf.bytes_of(".boot2")
    if elf.section(".boot2").address != FLASH[0] or len(boot2) != 256:
        fail(f".boot2 must be the first 256 bytes of flash, not {len(boot2)} at {elf.section('.boot2').address:#x}")
    stored, computed = struct.unpack("<I", boot2[252:])[0], crc32_mpeg2(boot2[:252])
    if stored != computed:
        fail(f"the CRC of .boot2 is {stored:#010x} but must be {computed:#010x}; see cmake/boot2_checksum.py")


def check_regions(elf):
    for s in elf.sections:
        if not s.allocated or not s.size:
            continue
        if s.name not in REGIONS:
            fail(f"section {s.name} is unknown; place it in boards/rp2040/rp2040.ld")
        origin, length = REGIONS[s.name]
        if not origin <= s.address or s.end > origin + length:
            fail(f"section {s.name} ({s.address:#x} to {s.end:#x}) is outside {origin:#x} to {origin + length:#x}")
    for load, _, data in elf.segments:
        if not FLASH[0] <= load or load + len(data) > sum(FLASH):
            fail(f"a segment loads at {load:#x} to {load + len(data):#x}, outside the flash")


def is_code_in(address, section):
    return address & 1 and section.address <= address - 1 < section.end


def check_vectors(elf):
    boot, text = elf.section(".boot"), elf.section(".text")
    stack_top, stack_limit = elf.value("__stack_top"), elf.value("__stack_limit")
    if stack_top % 8 or not SCRATCH_Y[0] <= stack_limit < stack_top <= sum(SCRATCH_Y):
        fail(f"the stack ({stack_limit:#x} to {stack_top:#x}) is not in its bank, or not aligned to 8 bytes")
    if boot.address != FLASH[0] + 256:
        fail(f"the vector table of the start-up code is at {boot.address:#x}, not {FLASH[0] + 256:#x}")
    first = struct.unpack_from(f"<{BOOT_EXCEPTIONS}I", elf.bytes_of(".boot"))
    table = struct.unpack_from(f"<{VECTORS}I", elf.bytes_of(".vectors").ljust(4 * VECTORS, b"\0"))
    if elf.section(".vectors").address % 256 or elf.section(".vectors").size != 4 * VECTORS:
        fail(f".vectors must hold {VECTORS} words at a multiple of 256")
    for name, words in (("start-up", first), ("SRAM", table)):
        if words[0] != stack_top:
            fail(f"the {name} vector table starts with stack pointer {words[0]:#x}, not {stack_top:#x}")
        if not is_code_in(words[1], boot):
            fail(f"the {name} reset vector {words[1]:#x} is no Thumb code in flash")
    for i, word in enumerate(first[2:], 2):
        if not is_code_in(word, boot):
            fail(f"start-up vector {i} is {word:#x}: no Thumb code in flash")
    for i, word in enumerate(table[2:], 2):
        if not is_code_in(word, text):
            fail(f"SRAM vector {i} is {word:#x}: no Thumb code in SRAM")


def check_symbols(elf):
    for symbol in elf.symbols:
        if symbol.is_file or symbol.name.startswith("$"):
            continue
        for reason, pattern in FORBIDDEN.items():
            if pattern.fullmatch(symbol.name):
                fail(f"the image contains {symbol.name}: {reason} (the map file tells who needs it)")


def flash_image(elf):
    image = bytearray(max(load + len(data) for load, _, data in elf.segments) - FLASH[0])
    for load, _, data in elf.segments:
        image[load - FLASH[0] : load - FLASH[0] + len(data)] = data
    return bytes(image)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("elf")
    parser.add_argument("--bin", help="the raw image: must be what the ELF file loads")
    parser.add_argument("--flash-limit", type=int, help="bytes that the image may have")
    parser.add_argument("--json", help="write the sizes to this file")
    args = parser.parse_args()

    elf = Elf(args.elf)
    check_boot2(elf)
    check_regions(elf)
    check_vectors(elf)
    check_symbols(elf)
    image = flash_image(elf)
    if args.bin:
        with open(args.bin, "rb") as file:
            if file.read() != image:
                fail(f"{args.bin} differs from what {args.elf} loads; build again")

    size = lambda *names: sum(elf.section(name).size for name in names)
    sizes = {
        "flash_bytes": len(image),
        "start_up_bytes": size(".boot2", ".boot"),
        "ram_bytes": elf.section(".noinit").end - RAM[0],
        "code_in_sram_bytes": size(".vectors", ".text"),
        "constants_in_sram_bytes": size(".rodata"),
        "variables_bytes": size(".data", ".bss", ".noinit"),
        "stack_reserved_bytes": elf.value("__stack_top") - elf.value("__stack_limit"),
    }
    for name, value in sizes.items():
        print(f"{name:28}{value:8}")
    if args.flash_limit and len(image) > args.flash_limit:
        fail(f"the image has {len(image)} bytes; {args.flash_limit} are allowed")
    if args.json:
        with open(args.json, "w") as file:
            json.dump(sizes, file, indent=2)
            file.write("\n")


if __name__ == "__main__":
    main()
