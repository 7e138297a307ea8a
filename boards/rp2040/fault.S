/* How every fault ends: what the exception stacked, or port_panic() in its place, goes where a reset
 * leaves it alone, and crash.c makes a record of it.
 *
 * The stack may be what is wrong, so crash.c gets a fresh one, and nothing below is read unless it
 * lies in the stack's bank or in its guard, which a fault handler may read. */
  .syntax unified
  .cpu cortex-m0plus
  .thumb

  .equ FRAME_BYTES, 32
  .equ SIO_CPUID, 0xd0000000
  .equ GUARD_AND_STACK_log2_BYTES, 13

  .section .noinit, "aw", %nobits
  .balign 4
  .global rp2040_fault_frame
rp2040_fault_frame: /* crash.c */
  .space FRAME_BYTES + 8

  .section .text.rp2040_fault, "ax"

  .global port_panic
  .thumb_func
  .type port_panic, %function
port_panic:
  cpsid i
  sub sp, #FRAME_BYTES
  str r0, [sp, #0]
  str r1, [sp, #4]
  str r2, [sp, #8]
  str r3, [sp, #12]
  mov r0, r12
  str r0, [sp, #16]
  mov r0, lr
  str r0, [sp, #20]
  subs r0, #5 /* the BL itself, without the Thumb bit */
  str r0, [sp, #24]
  mrs r0, xpsr
  str r0, [sp, #28]
  movs r1, #0
  mov r0, sp
  b take_note

  /* What no handler wants, hard faults among it */
  .global rp2040_fault
  .thumb_func
  .type rp2040_fault, %function
rp2040_fault:
  /* The watchdog was not fed: its last warning */
  .global timer2_irq_handler
  .thumb_func
  .type timer2_irq_handler, %function
timer2_irq_handler:
  cpsid i
  mrs r1, ipsr
  mov r0, sp

take_note: /* r0: the frame, r1: the exception, 0 for a panic */
  ldr r2, =SIO_CPUID
  ldr r2, [r2]
  cmp r2, #0
  bne park
  ldr r2, =rp2040_fault_frame
  ldr r3, =__stack_guard
  subs r3, r0, r3
  lsrs r3, #GUARD_AND_STACK_log2_BYTES
  beq 1f
  movs r4, #0
  movs r5, #0
  movs r6, #0
  movs r7, #0
  stmia r2!, {r4-r7}
  stmia r2!, {r4-r7}
  b 2f
1:
  mov r3, r0
  ldmia r3!, {r4-r7}
  stmia r2!, {r4-r7}
  ldmia r3!, {r4-r7}
  stmia r2!, {r4-r7}
2:
  str r0, [r2, #0]
  str r1, [r2, #4]
  ldr r3, =__stack_top
  msr msp, r3
  bl rp2040_take_crash

  /* The second processor: the first finds it late, and starts it again. */
park:
  wfi
  b park
  .ltorg
