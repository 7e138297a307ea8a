/* a - b as a + -b: the compiler's library brings its own of 800 bytes, which does the same. Only the
 * sign of a NaN can differ. */
  .syntax unified
  .thumb
  .section .text.float_subtract, "ax", %progbits
  .global __aeabi_fsub
  .type __aeabi_fsub, %function
  .thumb_func
__aeabi_fsub:
  movs r2, #1
  lsls r2, r2, #31
  eors r1, r2
  push {r4, lr}
  bl __aeabi_fadd
  pop {r4, pc}
  .size __aeabi_fsub, . - __aeabi_fsub
