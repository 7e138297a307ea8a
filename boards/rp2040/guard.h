/* What the memory protection unit of the processor that calls this holds back. */
#pragma once

#include <stdint.h>

/* A stack that grows into the 2^log2_bytes from stack_guard on, a null pointer, and a write to SRAM below the last 64 bytes before writable
 * are faults instead of silent damage. As pico-sdk's runtime_init_stack_guard.c. DMA is not held back. */
void guard_memory(const uint32_t *stack_guard, uint32_t log2_bytes, const void *writable);

/* Holds nothing back any more. */
void guard_end(void);
