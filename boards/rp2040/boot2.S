/* Second boot stage (RP2040 datasheet 2.8.1.3). The boot ROM copies these 256 bytes to the end of
 * SRAM, checks their CRC and enters at the first one. They set up execution in place with the plain
 * serial read (03h) that every SPI flash knows, and start the image behind them.
 *
 * Slow, and fast enough: the image is copied to SRAM once, at clk_sys / 4 = 31.25 MHz (W25Q16JV: 50
 * MHz for this command). Registers: datasheet 4.10.13.
 */
  .syntax unified
  .cpu cortex-m0plus
  .thumb

  .equ IMAGE_VECTORS, 0x10000100
  .equ SCB_VTOR, 0xe000ed08

  .equ SSI_BASE, 0x18000000
  .equ SSI_CTRLR0, 0x00
  .equ SSI_CTRLR1, 0x04
  .equ SSI_SSIENR, 0x08
  .equ SSI_BAUDR, 0x14
  .equ SSI_SPI_CTRLR0, 0xf4

  .equ CTRLR0_32_CLOCKS_A_FRAME, 31 << 16
  .equ CTRLR0_EEPROM_READ, 3 << 8 /* send instruction and address, then receive */
  .equ SPI_CTRLR0_READ_03H, 0x03 << 24
  .equ SPI_CTRLR0_INSTRUCTION_8_BITS, 2 << 8
  .equ SPI_CTRLR0_ADDRESS_24_BITS, 6 << 2

  .section .boot2, "ax"
  .global boot2
  .thumb_func
boot2:
  ldr r3, =SSI_BASE
  movs r0, #0
  str r0, [r3, #SSI_SSIENR] /* the others are written only while disabled */
  str r0, [r3, #SSI_CTRLR1] /* one frame a read */
  movs r1, #4
  str r1, [r3, #SSI_BAUDR]
  ldr r1, =(CTRLR0_32_CLOCKS_A_FRAME | CTRLR0_EEPROM_READ)
  str r1, [r3, #SSI_CTRLR0]
  ldr r1, =(SPI_CTRLR0_READ_03H | SPI_CTRLR0_INSTRUCTION_8_BITS | SPI_CTRLR0_ADDRESS_24_BITS)
  ldr r2, =(SSI_BASE + SSI_SPI_CTRLR0)
  str r1, [r2]
  movs r0, #1
  str r0, [r3, #SSI_SSIENR]

  ldr r0, =IMAGE_VECTORS
  ldr r1, =SCB_VTOR
  str r0, [r1]
  ldmia r0!, {r1, r2}
  msr msp, r1
  bx r2

  .ltorg
