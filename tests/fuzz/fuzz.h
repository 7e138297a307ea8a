/* What every fuzz target is made of: one function that takes bytes, a reader for them, and a check that stops the program. Bytes and runs
 * are counted by fuzz.c in the file that the environment's FINGERTIP_FUZZ_COUNT names, also where a run ends the program. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The target: the same bytes always do the same. */
void fuzz_one(const uint8_t *bytes, size_t length);

#ifdef __cplusplus
}
#endif

#define FUZZ_CHECK(condition)                                                                                                              \
  do {                                                                                                                                     \
    if (!(condition)) {                                                                                                                    \
      fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition);                                                       \
      abort();                                                                                                                             \
    }                                                                                                                                      \
  } while (0)

/* Takes an input apart from its front; behind its end there are zeros. */
struct fuzz_input {
  const uint8_t *at, *end;
};

static inline size_t fuzz_left(const struct fuzz_input *input) { return (size_t)(input->end - input->at); }

static inline uint8_t fuzz_u8(struct fuzz_input *input) { return input->at < input->end ? *input->at++ : 0; }

static inline uint64_t fuzz_bits(struct fuzz_input *input, unsigned bytes) {
  uint64_t value = 0;
  for (unsigned i = 0; i < bytes; i++) {
    value |= (uint64_t)fuzz_u8(input) << (8 * i);
  }
  return value;
}

static inline uint16_t fuzz_u16(struct fuzz_input *input) { return (uint16_t)fuzz_bits(input, 2); }

static inline uint32_t fuzz_u32(struct fuzz_input *input) { return (uint32_t)fuzz_bits(input, 4); }

static inline uint64_t fuzz_u64(struct fuzz_input *input) { return fuzz_bits(input, 8); }

/* As many as there are, `length` at most. */
static inline const uint8_t *fuzz_bytes(struct fuzz_input *input, size_t *length) {
  const uint8_t *bytes = input->at;
  *length = *length < fuzz_left(input) ? *length : fuzz_left(input);
  input->at += *length;
  return bytes;
}
