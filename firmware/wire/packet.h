/* The packets of the wire protocol, and their only encoder and decoder.
 *
 * PROTOCOL.md is the specification. Firmware and host use this same code. A frame on the line is
 *   COBS(header 12 bytes, body, CRC-32/ISO-HDLC of header and body) 0x00
 * and nothing on the line depends on the byte order, the alignment or the structure padding of the machine. Floats are
 * IEEE 754 binary32 and always finite: the encoder refuses others and the decoder rejects them.
 *
 * line.toml describes the bodies; bodies.h has them as structs, with their units and ranges. Each has one constant, its layout, for both
 * directions. Code that encodes or decodes names its layouts, so an image holds those of its own packets and commands only. */
#pragma once

#include "common/status.h"
#include "wire/bodies.h"

#include <stddef.h>
#include <stdint.h>

enum {
  WIRE_HEADER_BYTES = 12,
  WIRE_CRC_BYTES = 4,
  WIRE_MAX_PACKET_BYTES = WIRE_HEADER_BYTES + WIRE_MAX_BODY_BYTES + WIRE_CRC_BYTES,
  /* COBS adds one byte, and one more for each full 254 bytes; then the delimiter. */
  WIRE_MAX_FRAME_BYTES = WIRE_MAX_PACKET_BYTES + WIRE_MAX_PACKET_BYTES / 254 + 2,
};

struct wire_packet {
  uint8_t type;      /* enum wire_type */
  uint16_t sequence; /* counts the packets of one sender, also those it had to drop */
  uint64_t t_us;     /* device time since start; in commands the host's own clock */
  union wire_body body;
};

/* Sets of layouts, ended by NULL: those of all commands, and all there are. */
extern const struct wire_layout *const wire_commands[];
extern const struct wire_layout *const wire_all_layouts[];

/* NULL: the set has no such type. */
const struct wire_layout *wire_find_layout(const struct wire_layout *const *set, uint8_t type);

/* Encodes one packet by its layout, which has its type too, into a complete frame, delimiter included: *length bytes.
 * FT_ERR_ARGUMENT: layout is NULL, sensor_count is 0 or too large, a text is not printable, or a float is not finite;
 * frame is scratch then. Cost: about 40 Cortex-M0+ cycles a byte. */
enum ft_status wire_encode(const struct wire_layout *layout, const struct wire_packet *packet, uint8_t frame[WIRE_MAX_FRAME_BYTES],
                           size_t *length);

/* Decodes the bytes of one frame without its delimiter. The frame buffer is overwritten. FT_ERR_FORMAT: bad COBS, wrong
 * length for the type, or a value that the encoder would refuse. FT_ERR_CRC. FT_ERR_VERSION: another protocol version,
 * the CRC being right. FT_ERR_TYPE: of a type that the set lacks but undamaged; type, sequence and t_us are set, so
 * that the sender can be answered and its sequence followed. */
enum ft_status wire_decode(const struct wire_layout *const *set, uint8_t *frame, size_t length, struct wire_packet *packet);

/* Collects bytes from a line into packets. Resynchronisation: whatever happened, the next frame begins after the next 0x00. */
struct wire_receiver {
  const struct wire_layout *const *set;
  size_t length;
  uint32_t overlong; /* 1 while skipping a frame that is longer than any valid one */
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
};

void wire_receiver_init(struct wire_receiver *receiver, const struct wire_layout *const *set);

/* Takes one byte. FT_PENDING: no frame is complete. FT_OK: *packet is a new packet. Else a damaged frame ended here and was discarded, for
 * the reason given by wire_decode, or FT_ERR_SPACE for an overlong one. Empty frames (two delimiters in a row) are legal fill. */
enum ft_status wire_receive(struct wire_receiver *receiver, uint8_t byte, struct wire_packet *packet);
