/* Whether a part of the firmware has made no progress for too long. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Times are the low word of the timer. A part that runs in an interrupt may have made progress after now_us was read:
 * its time is later then, and it is not overdue. */
static inline bool is_overdue(uint32_t now_us, uint32_t progress_us, uint32_t limit_us) {
  return (int32_t)(now_us - progress_us) > (int32_t)limit_us;
}
