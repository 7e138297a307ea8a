/* The vector table in SRAM (ARMv6-M B1.5.3; interrupts: RP2040 datasheet 2.3.2). What nobody
 * handles is a fault. A handler that the image links replaces its weak name here.
 */
  .syntax unified
  .cpu cortex-m0plus
  .thumb

  .macro interrupt handler
  .weak \handler
  .thumb_set \handler, unexpected_exception
  .word \handler
  .endm

  .macro unexpected count
  .rept \count
  .word unexpected_exception
  .endr
  .endm

  .section .vectors, "a"
  .global __vectors
__vectors:
  .word __stack_top
  .word boot_reset
  unexpected 14 /* NMI, HardFault, SVCall, PendSV, SysTick */
  interrupt timer0_irq_handler /* 0 */
  interrupt timer1_irq_handler
  unexpected 3
  interrupt usbctrl_irq_handler /* 5 */
  unexpected 1
  interrupt pio0_irq_handler /* 7 */
  unexpected 3
  interrupt dma0_irq_handler /* 11 */
  unexpected 11
  interrupt i2c0_irq_handler /* 23 */
  unexpected 2
  interrupt usb_service_irq_handler /* 26 */
  unexpected 5

  .section .text.unexpected_exception, "ax"
  .thumb_func
  .type unexpected_exception, %function
unexpected_exception:
  ldr r0, =port_panic
  bx r0
  .ltorg
