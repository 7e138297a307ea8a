/* CRC-32/ISO-HDLC (polynomial 0x04C11DB7 reflected, init and xor-out 0xFFFFFFFF): the CRC of
 * Ethernet, zlib and PNG. Check value of "123456789": 0xCBF43926.
 * Nibble table: 64 bytes of constants, two look-ups a byte.
 */
#ifndef COMMON_CRC32_H
#define COMMON_CRC32_H

#include <stddef.h>
#include <stdint.h>

uint32_t crc32_iso_hdlc(const uint8_t *bytes, size_t length);

#endif
