/* The clocks of the chip: XOSC 12 MHz, clk_ref 12 MHz, clk_sys and clk_peri 125 MHz, clk_usb 48 MHz, and the 1 us tick
 * of timer and watchdog.
 *
 * These functions run from flash, before the image is in SRAM: they use no variables and call nothing outside clocks.c. */
#pragma once

/* Brings every block but the flash interface into reset and starts watchdog and clocks. Each wait
 * is bounded; without a crystal there is no USB to report it, so a failure starts over. */
void clocks_start(void);

/* Resets the whole chip but its oscillators, through the watchdog. */
_Noreturn void clocks_reset_chip(void);
