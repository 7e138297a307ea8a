#!/usr/bin/env python3
"""Pads the second boot stage to 252 bytes and appends the CRC that the boot ROM demands.

usage: boot2_checksum.py INPUT.bin OUTPUT.bin

RP2040 datasheet 2.8.1.3.1: CRC-32 with polynomial 0x04c11db7, start 0xffffffff, nothing reflected,
no final inversion, over the first 252 bytes; stored in the last four, little-endian.
"""

import sys

SIZE = 256


def crc32_mpeg2(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: boot2_checksum.py INPUT.bin OUTPUT.bin")
    with open(sys.argv[1], "rb") as file:
        code = file.read()
    if not code or len(code) > SIZE - 4:
        sys.exit(f"boot2_checksum: {sys.argv[1]} has {len(code)} bytes; 1 to {SIZE - 4} fit")
    code = code.ljust(SIZE - 4, b"\0")
    with open(sys.argv[2], "wb") as file:
        file.write(code + crc32_mpeg2(code).to_bytes(4, "little"))


if __name__ == "__main__":
    main()
