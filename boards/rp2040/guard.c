#include "rp2040/guard.h"

#include "rp2040/mpu_regs.h"

/* From the start of SRAM up to __code_end: vectors, code and constants. Each region covers eighths
 * of its size, and the next one, of the size of an eighth, what is left. */
static void guard_code(void) {
  extern const uint32_t __image_start[], __code_end[];
  uint32_t at = (uint32_t)(uintptr_t)__image_start;
  uint32_t end = (uint32_t)(uintptr_t)__code_end;
  uint32_t region = 2;
  for (uint32_t log2 = 18; log2 >= 9; log2 -= 3) {
    uint32_t eighths = (end - at) >> (log2 - 3);
    MPU_RBAR = at | MPU_RBAR_REGION(region);
    MPU_RASR =
        MPU_RASR_READ_ONLY | MPU_RASR_NORMAL | MPU_RASR_EIGHTHS(eighths) | MPU_RASR_BYTES(log2) | MPU_RASR_ENABLE;
    at += eighths << (log2 - 3);
    region++;
  }
}

void guard_memory(const uint32_t *stack_guard, uint32_t log2_bytes) {
  MPU_RBAR = (uint32_t)(uintptr_t)stack_guard | MPU_RBAR_REGION(0u);
  MPU_RASR = MPU_RASR_NO_ACCESS | MPU_RASR_BYTES(log2_bytes) | MPU_RASR_ENABLE;
  MPU_RBAR = MPU_RBAR_REGION(1u);
  MPU_RASR = MPU_RASR_NO_ACCESS | MPU_RASR_BYTES(8u) | MPU_RASR_ENABLE;
  guard_code();
  MPU_CTRL = MPU_CTRL_DEFAULT_MAP | MPU_CTRL_ENABLE;
  __asm volatile("dsb\n isb" ::: "memory");
}
