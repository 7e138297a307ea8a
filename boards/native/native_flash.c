#include "native/native_flash.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PROGRAM_POLLS = 2, ERASE_POLLS = 4 };

enum operation { NONE, PROGRAM, ERASE };

struct native_flash native_flash;

static struct {
  enum operation operation;
  unsigned polls_left;
  uint32_t at;
  const uint8_t *bytes;
  size_t length;
  uint64_t steps, cut_at;
  bool dead, worn_out;
  bool resolves_at_power_up; /* unstable bits: else at each reading */
  uint64_t random;
} state;

static _Noreturn void stop(const char *why) {
  (void)fprintf(stderr, "native_flash: %s\n", why);
  abort();
}

/* xorshift64* (Vigna, 2016) */
static uint64_t random_u64(void) {
  state.random ^= state.random >> 12;
  state.random ^= state.random << 25;
  state.random ^= state.random >> 27;
  return state.random * UINT64_C(2685821657736338717);
}

static uint8_t random_bits(void) { return (uint8_t)(random_u64() >> 56); }

/* Eight bits, each set with a chance of n in 256. */
static uint8_t bits_with_chance(unsigned chance) {
  uint8_t bits = 0;
  for (int i = 0; i < 8; i++) {
    bits = (uint8_t)(bits << 1 | (random_bits() < chance));
  }
  return bits;
}

void native_flash_reset(uint64_t seed) {
  memset(&state, 0, sizeof state);
  state.random = seed + UINT64_C(0x9E3779B97F4A7C15);
  state.cut_at = UINT64_MAX;
  memset(native_flash.bytes, 0xFF, sizeof native_flash.bytes);
  memset(native_flash.unstable, 0, sizeof native_flash.unstable);
}

/* How far the bits have come when power is lost, of 256: those that have arrived, and those on their way, which read as they like. */
struct progress {
  unsigned arrived, torn;
};

static struct progress some_progress(void) {
  switch (random_bits() & 3) {
  case 0: return (struct progress){0, 1};   /* hardly begun */
  case 1: return (struct progress){255, 1}; /* nearly done */
  default: return (struct progress){random_bits(), random_bits()};
  }
}

static void cut_bits(uint32_t at, uint8_t changing, uint8_t to, struct progress progress) {
  uint8_t *value = &native_flash.bytes[at];
  uint8_t torn = changing & bits_with_chance(progress.torn);
  uint8_t arrived = changing & bits_with_chance(progress.arrived + (progress.arrived == 255));
  *value = (uint8_t)((*value & ~arrived) | (to & arrived));
  native_flash.unstable[at] = (uint8_t)((native_flash.unstable[at] & ~arrived) | torn);
}

static void cut_power(void) {
  state.dead = true;
  const struct progress progress = some_progress();
  if (state.operation == PROGRAM) {
    for (size_t i = 0; i < state.length; i++) {
      uint32_t at = state.at + (uint32_t)i;
      cut_bits(at, (native_flash.bytes[at] | native_flash.unstable[at]) & (uint8_t)~state.bytes[i], 0, progress);
    }
  } else if (state.operation == ERASE) {
    /* All bits are programmed first, then all are erased. */
    bool erasing = random_bits() & 1;
    for (uint32_t at = state.at; at < state.at + PORT_FLASH_SECTOR_BYTES; at++) {
      if (erasing) {
        native_flash.bytes[at] = 0;
        native_flash.unstable[at] = 0;
      }
      cut_bits(at, 0xFF, erasing ? 0xFF : 0, progress);
    }
  }
  state.operation = NONE;
}

/* False: power is lost at this step, or was. */
static bool take_step(void) {
  if (!state.dead && state.steps++ == state.cut_at) {
    cut_power();
  }
  return !state.dead;
}

void native_flash_cut_after(uint64_t steps) { state.cut_at = state.steps + steps; }

bool native_flash_is_dead(void) { return state.dead; }

void native_flash_power_up(void) {
  if (!state.dead) {
    cut_power();
  }
  state.dead = false;
  state.cut_at = UINT64_MAX;
  state.resolves_at_power_up = random_bits() & 1;
  for (size_t i = 0; i < NATIVE_FLASH_BYTES; i++) {
    if (native_flash.unstable[i]) {
      native_flash.bytes[i] ^= native_flash.unstable[i] & random_bits();
    }
  }
}

void native_flash_wear_out(void) { state.worn_out = true; }

static void begin(enum operation operation, uint32_t at, const uint8_t *bytes, size_t length, unsigned polls) {
  if (state.operation != NONE && !state.dead) {
    stop("an operation begins while another one is under way");
  }
  state.operation = operation;
  state.at = at;
  state.bytes = bytes;
  state.length = length;
  state.polls_left = polls;
  take_step();
}

void port_flash_erase(unsigned sector) {
  if (sector >= PORT_FLASH_SECTORS) {
    stop("no such sector");
  }
  begin(ERASE, sector * PORT_FLASH_SECTOR_BYTES, NULL, 0, ERASE_POLLS);
}

void port_flash_program(uint32_t at, const uint8_t *bytes, size_t length) {
  if (length == 0 || at + length > NATIVE_FLASH_BYTES || at / PORT_FLASH_PAGE_BYTES != (at + length - 1) / PORT_FLASH_PAGE_BYTES) {
    stop("a page's end is passed");
  }
  begin(PROGRAM, at, bytes, length, PROGRAM_POLLS);
}

static void complete(void) {
  if (state.operation == ERASE) {
    memset(native_flash.bytes + state.at, 0xFF, PORT_FLASH_SECTOR_BYTES);
    memset(native_flash.unstable + state.at, 0, PORT_FLASH_SECTOR_BYTES);
  } else if (!state.worn_out) {
    for (size_t i = 0; i < state.length; i++) {
      native_flash.bytes[state.at + i] &= state.bytes[i];
      native_flash.unstable[state.at + i] &= state.bytes[i];
    }
  }
  state.operation = NONE;
}

bool port_flash_poll(void) {
  if (state.dead) {
    return true;
  }
  if (state.operation == NONE) {
    return false;
  }
  if (!take_step()) {
    return true;
  }
  if (--state.polls_left == 0) {
    complete();
  }
  return state.operation != NONE;
}

void port_flash_read(uint32_t at, uint8_t *bytes, size_t length) {
  if (state.operation != NONE && !state.dead) {
    stop("read while an operation is under way");
  }
  if (length > PORT_FLASH_READ_BYTES || at + length > NATIVE_FLASH_BYTES) {
    stop("a reading too long");
  }
  for (size_t i = 0; i < length; i++) {
    uint8_t torn = native_flash.unstable[at + i];
    bytes[i] = state.dead ? 0xFF : native_flash.bytes[at + i];
    if (torn && !state.resolves_at_power_up) {
      bytes[i] ^= torn & random_bits();
    }
  }
}
