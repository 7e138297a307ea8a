/* The 64-bit microsecond counter and its alarms (RP2040 datasheet 4.6). */
#pragma once

#include "rp2040/reg.h"

#define TIMER_BASE 0x40054000u
#define TIMER_ALARM0 REG32(TIMER_BASE + 0x10u) /* fires when the low word becomes equal to it */
#define TIMER_ALARM1 REG32(TIMER_BASE + 0x14u)
#define TIMER_ALARM2 REG32(TIMER_BASE + 0x18u)
#define TIMER_ALARM3 REG32(TIMER_BASE + 0x1cu)
#define TIMER_ARMED REG32(TIMER_BASE + 0x20u) /* writing a 1 disarms */
#define TIMER_TIMERAWH REG32(TIMER_BASE + 0x24u)
#define TIMER_TIMERAWL_ADDRESS (TIMER_BASE + 0x28u)
#define TIMER_TIMERAWL REG32(TIMER_TIMERAWL_ADDRESS)
#define TIMER_INTR REG32(TIMER_BASE + 0x34u) /* writing a 1 clears */
#define TIMER_INTE (TIMER_BASE + 0x38u)
#define TIMER_ALARM0_BIT (1u << 0)
#define TIMER_ALARM1_BIT (1u << 1)
#define TIMER_ALARM2_BIT (1u << 2)
#define TIMER_ALARM3_BIT (1u << 3)
