/* The vector table in SRAM (ARMv6-M B1.5.3; interrupts: RP2040 datasheet 2.3.2), and the priority of
 * each interrupt as NVIC_IPR wants it. An exception without a handler is a fault (fault.S). A handler
 * that the image links replaces its weak name here.
 *
 * The USB controller comes first, for the time of a frame's start counts (TinyUSB reads it before
 * anything else) and so does the time from a SETUP to what answers the next token; and the watchdog's
 * last warning, which must see whatever hangs; and the pulse of the sync pin, some 40 cycles twice a
 * second. What else USB has to do comes before the sensors.
 */
  .syntax unified
  .cpu cortex-m0plus
  .thumb

  .equ FIRST, 0
  .equ SECOND, 0x40
  .equ THIRD, 0x80

  .macro interrupt handler, priority
  .weak \handler
  .thumb_set \handler, unexpected_exception
  .word \handler
  .pushsection .rodata.irq_priorities, "a"
  .byte \priority
  .popsection
  .endm

  .macro unexpected count
  .rept \count
  .word unexpected_exception
  .pushsection .rodata.irq_priorities, "a"
  .byte THIRD
  .popsection
  .endr
  .endm

  .section .rodata.irq_priorities, "a"
  .balign 4
  .global rp2040_irq_priorities
rp2040_irq_priorities:

  .section .vectors, "a"
  .global __vectors
__vectors:
  .word __stack_top
  .word boot_reset
  .rept 14
  .word unexpected_exception /* NMI, HardFault, SVCall, PendSV, SysTick */
  .endr
  interrupt timer0_irq_handler, THIRD /* 0 */
  interrupt timer1_irq_handler, SECOND
  interrupt timer2_irq_handler, FIRST
  interrupt timer3_irq_handler, FIRST
  unexpected 1
  interrupt usbctrl_irq_handler, FIRST /* 5 */
  unexpected 5
  interrupt dma0_irq_handler, THIRD /* 11 */
  unexpected 11
  interrupt i2c0_irq_handler, THIRD /* 23 */
  unexpected 2
  interrupt usb_service_irq_handler, SECOND /* 26 */
  unexpected 5

  /* The assembler resolves a weak alias of a name of another file at once. */
  .section .text.unexpected_exception, "ax"
  .thumb_func
  .type unexpected_exception, %function
unexpected_exception:
  b rp2040_fault
