#include "rp2040/resets.h"

#include "rp2040/reg.h"

#define RESETS_RESET 0x4000c000u
#define RESETS_RESET_DONE 0x4000c008u

/* A release takes a few cycles of the block's own clock, which is 12 MHz at the slowest. */
enum { RELEASE_POLLS = 1000 };

void resets_assert(uint32_t blocks) { REG32_SET(RESETS_RESET) = blocks; }

enum ft_status resets_release(uint32_t blocks) {
  REG32_CLEAR(RESETS_RESET) = blocks;
  for (int polls = 0; polls < RELEASE_POLLS; polls++) {
    if ((~REG32(RESETS_RESET_DONE) & blocks) == 0)
      return FT_OK;
  }
  return FT_ERR_TIMEOUT;
}
