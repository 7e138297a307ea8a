/* Results to the bit, in blocks, so that one that differs is known to be of few cases. */
#pragma once

#include "common/crc32.h"
#include "unity.h"

#include <stdint.h>
#include <stdio.h>

enum { GOLDEN_BLOCKS = 8 };

static inline uint32_t golden_join(uint32_t crc, uint32_t next) {
  const uint32_t both[2] = {crc, next};
  return crc32_iso_hdlc((const uint8_t *)both, sizeof both);
}

/* cases: in all; each makes some of found[]. The message has what to put in golden[] where a change was meant. */
static inline void golden_assert(const char *what, uint32_t cases, const uint32_t golden[GOLDEN_BLOCKS],
                                 const uint32_t found[GOLDEN_BLOCKS]) {
  const uint32_t block = cases / GOLDEN_BLOCKS;
  for (uint32_t i = 0; i < GOLDEN_BLOCKS; i++) {
    if (golden[i] == found[i]) {
      continue;
    }
    char text[300];
    int at = snprintf(text, sizeof text, "%s %u to %u differ first; now", what, (unsigned)(i * block), (unsigned)((i + 1) * block - 1));
    for (uint32_t j = 0; j < GOLDEN_BLOCKS; j++) {
      at += snprintf(text + at, sizeof text - (size_t)at, "%s0x%08X", j ? ", " : " {", (unsigned)found[j]);
    }
    snprintf(text + at, sizeof text - (size_t)at, "}");
    TEST_FAIL_MESSAGE(text);
  }
}
