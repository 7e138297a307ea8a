/* From the second boot stage to main: everything that runs from flash.
 *
 * Paints the stack, starts the clocks, copies the image to SRAM, where everything else runs, zeroes
 * .bss and takes the vector table in SRAM into use. The symbols are the linker script's.
 */
  .syntax unified
  .cpu cortex-m0plus
  .thumb

  .equ SCB_VTOR, 0xe000ed08
  .equ MPU_CTRL, 0xe000ed94
  .equ PSM_FRCE_OFF, 0x40010004
  .equ PSM_PROC1, 1 << 16
  .equ STACK_PAINT, 0x5aa5c33c /* port.c counts it */

  .section .boot_vectors, "a"
  .word __stack_top
  .word boot_reset
  .rept 14
  .word boot_fault
  .endr

  .section .boot_text, "ax"
  .global boot_reset
  .thumb_func
  .type boot_reset, %function
boot_reset:
  cpsid i

  ldr r0, =MPU_CTRL /* a debugger may come here while code is read-only */
  movs r1, #0
  str r1, [r0]
  dsb
  isb

  ldr r0, =PSM_FRCE_OFF /* and the second processor may run, in what is copied over below */
  ldr r2, =PSM_PROC1
  str r2, [r0]
  ldr r2, [r0] /* so that it is in force (pico-sdk, multicore_reset_core1) */
  str r1, [r0]

  ldr r0, =__stack_limit
  mov r1, sp
  ldr r2, =STACK_PAINT
1:
  stmia r0!, {r2}
  cmp r0, r1
  blo 1b

  bl clocks_start

  ldr r0, =__image_start
  ldr r1, =__image_end
  ldr r2, =__image_load
  b 3f
2:
  ldmia r2!, {r3}
  stmia r0!, {r3}
3:
  cmp r0, r1
  blo 2b

  ldr r0, =__bss_start
  ldr r1, =__bss_end
  movs r2, #0
  b 5f
4:
  stmia r0!, {r2}
5:
  cmp r0, r1
  blo 4b

  ldr r0, =__vectors
  ldr r1, =SCB_VTOR
  str r0, [r1]
  dsb
  cpsie i

  ldr r0, =boot_main
  bx r0

  /* Before the SRAM copy is complete, a fault can only start over. */
  .thumb_func
  .type boot_fault, %function
boot_fault:
  bl clocks_reset_chip

  .ltorg

  /* In SRAM: port_start ends execution in place. */
  .section .text.boot_main, "ax"
  .thumb_func
  .type boot_main, %function
boot_main:
  bl port_start
  bl main
  bl port_panic
