#!/usr/bin/env python3
"""Wraps a raw flash image into UF2 blocks for the USB loader in the RP2040's boot ROM.

usage: bin2uf2.py INPUT.bin OUTPUT.uf2

Format: https://github.com/microsoft/uf2. Family RP2040; 256 bytes a block, the flash page. The last page is padded with zeros. The image
has no holes, which the loader gets wrong (erratum RP2040-E14). After its page each block holds "CRC " and the CRC-32 of all pages, which
the loader does not look at and `fingertip flash` does.
"""

import struct
import sys
import zlib

FLASH_BASE = 0x10000000
FAMILY_RP2040 = 0xE48BFF56
FLAG_FAMILY_PRESENT = 0x2000
PAGE = 256


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: bin2uf2.py INPUT.bin OUTPUT.uf2")
    with open(sys.argv[1], "rb") as file:
        image = file.read()
    if not image:
        sys.exit(f"bin2uf2: {sys.argv[1]} is empty; build the image first")
    pages = [image[i : i + PAGE].ljust(PAGE, b"\0") for i in range(0, len(image), PAGE)]
    check = b"CRC " + struct.pack("<I", zlib.crc32(b"".join(pages)))
    with open(sys.argv[2], "wb") as file:
        for number, page in enumerate(pages):
            head = struct.pack(
                "<8I", 0x0A324655, 0x9E5D5157, FLAG_FAMILY_PRESENT, FLASH_BASE + number * PAGE, PAGE, number, len(pages), FAMILY_RP2040
            )
            file.write((head + page + check).ljust(508, b"\0") + struct.pack("<I", 0x0AB16F30))


if __name__ == "__main__":
    main()
