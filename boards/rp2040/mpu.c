#include "rp2040/mpu.h"

#include "rp2040/reg.h"

/* The memory protection unit of the core (ARMv6-M Architecture Reference Manual B3.5). */
#define MPU_CTRL REG32(0xe000ed94u)
#define MPU_CTRL_DEFAULT_MAP (1u << 2) /* where no region is */
#define MPU_CTRL_ENABLE (1u << 0)      /* but in fault handlers */
#define MPU_RBAR REG32(0xe000ed9cu)    /* base address, aligned to the size */
#define MPU_RBAR_REGION(number) (1u << 4 | (number))
#define MPU_RASR REG32(0xe000eda0u)
#define MPU_RASR_NO_ACCESS (1u << 28) /* and no execution */
#define MPU_RASR_READ_ONLY (6u << 24)
#define MPU_RASR_NORMAL (1u << 17)                           /* memory, from which code runs */
#define MPU_RASR_EIGHTHS(count) (0xff00u << (count)&0xff00u) /* in force: the first of them */
#define MPU_RASR_BYTES(log2) (((log2)-1u) << 1)
#define MPU_RASR_ENABLE (1u << 0)

/* Protects from the start of SRAM on. Each region covers eighths of its size; the next one, an eighth in size, covers the rest. */
static void protect_writes(uint32_t end) {
  extern const uint32_t __image_start[];
  uint32_t at = (uint32_t)(uintptr_t)__image_start;
  uint32_t region = 2;
  for (uint32_t log2 = 18; log2 >= 9; log2 -= 3) {
    uint32_t eighths = (end - at) >> (log2 - 3);
    MPU_RBAR = at | MPU_RBAR_REGION(region);
    MPU_RASR = MPU_RASR_READ_ONLY | MPU_RASR_NORMAL | MPU_RASR_EIGHTHS(eighths) | MPU_RASR_BYTES(log2) | MPU_RASR_ENABLE;
    at += eighths << (log2 - 3);
    region++;
  }
}

void mpu_disable(void) {
  MPU_CTRL = 0;
  __asm volatile("dsb\n isb" ::: "memory");
}

void mpu_protect(const uint32_t *stack_guard, uint32_t log2_bytes, const void *writable) {
  MPU_RBAR = (uint32_t)(uintptr_t)stack_guard | MPU_RBAR_REGION(0u);
  MPU_RASR = MPU_RASR_NO_ACCESS | MPU_RASR_BYTES(log2_bytes) | MPU_RASR_ENABLE;
  MPU_RBAR = MPU_RBAR_REGION(1u);
  MPU_RASR = MPU_RASR_NO_ACCESS | MPU_RASR_BYTES(8u) | MPU_RASR_ENABLE;
  protect_writes((uint32_t)(uintptr_t)writable);
  MPU_CTRL = MPU_CTRL_DEFAULT_MAP | MPU_CTRL_ENABLE;
  __asm volatile("dsb\n isb" ::: "memory");
}
