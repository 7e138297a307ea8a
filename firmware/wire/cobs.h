/* Consistent Overhead Byte Stuffing (PROTOCOL.md, frame). */
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Bytes without a zero that one code covers, and the code itself */
enum { COBS_RUN = 255 };

/* Encodes in place: the first byte of frame is free, length bytes follow, and room for what COBS adds.
 * Returns the length of the whole with its delimiter. */
static inline size_t cobs_encode(uint8_t *frame, size_t length) {
  uint8_t *code_at = frame;
  uint8_t *at = frame;
  uint8_t *end = frame + 1 + length;
  *end = 0; /* the delimiter, which ends the last search too */
  for (;; code_at = at) {
    do {
      at++;
    } while (*at != 0);
    if (at - code_at >= COBS_RUN && end - code_at > COBS_RUN) {
      at = code_at + COBS_RUN; /* no zero gives its place for the next code */
      end++;
      memmove(at + 1, at, (size_t)(end - at));
    }
    *code_at = (uint8_t)(at - code_at);
    if (at == end) {
      return (size_t)(end + 1 - frame);
    }
  }
}

/* Decodes in place. Returns 0 for bytes that no COBS encoder produces. */
static inline size_t cobs_decode(uint8_t *frame, size_t length) {
  size_t in = 0;
  size_t out = 0;
  while (in < length) {
    uint8_t code = frame[in++];
    if (code == 0 || (size_t)(code - 1) > length - in) {
      return 0;
    }
    for (uint8_t i = 1; i < code; i++) {
      if (frame[in] == 0) {
        return 0;
      }
      frame[out++] = frame[in++];
    }
    if (code != 0xFF && in < length) {
      frame[out++] = 0;
    }
  }
  return out;
}
