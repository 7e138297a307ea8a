/* Memory protection, for the processor that calls it. */
#pragma once

#include <stdint.h>

/* A stack that grows into the 2^log2_bytes from stack_guard on, a null pointer, and a write to SRAM below the last 64 bytes before writable
 * are faults instead of silent damage, as by pico-sdk's runtime_init_stack_guard.c. DMA is not restricted. */
void mpu_protect(const uint32_t *stack_guard, uint32_t log2_bytes, const void *writable);

/* Ends the protection. */
void mpu_disable(void);
