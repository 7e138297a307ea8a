/* Vector table and start for the machines of QEMU: .data lies in the image, in RAM. */
  .syntax unified
  .thumb
  .section .vectors, "a"
  .word stack_top
  .word start + 1
  .rept 14
  .word fault + 1
  .endr

  .text
  .thumb_func
fault:
  bkpt 0xff /* QEMU ends the run: this is no call of semihosting */
  .thumb_func
  .global start
start:
#ifdef __ARM_FP
  ldr r0, =0xe000ed88 /* CPACR: full access to the floating-point unit */
  ldr r1, [r0]
  ldr r2, =0x00f00000
  orrs r1, r1, r2
  str r1, [r0]
  dsb
  isb
#endif
  ldr r0, =data_start
  ldr r1, =data_end
  ldr r2, =data_load
  b 2f
1: ldmia r2!, {r3}
  stmia r0!, {r3}
2: cmp r0, r1
  blo 1b
  ldr r1, =bss_end
  movs r3, #0
  b 4f
3: stmia r0!, {r3}
4: cmp r0, r1
  blo 3b
  bl main
  b fault
  .ltorg
