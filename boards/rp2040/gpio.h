/* Pins of bank 0: function, pad and level (RP2040 datasheet 2.19 IO_BANK0 and PADS_BANK0, 2.3.1.2 SIO). IO_BANK0 and
 * PADS_BANK0 must be out of reset. */
#pragma once

#include <stdbool.h>

/* FUNCSEL values, datasheet table 279 */
enum gpio_function {
  GPIO_FUNCTION_I2C = 3,
  GPIO_FUNCTION_SIO = 5,
  GPIO_FUNCTION_PIO0 = 6,
  GPIO_FUNCTION_USB = 8, /* for tests of the controller */
  GPIO_FUNCTION_NULL = 31,
};

enum gpio_pull { GPIO_PULL_NONE, GPIO_PULL_UP, GPIO_PULL_DOWN };

/* Pad of a pin: input enabled with Schmitt trigger, output enabled with 4 mA and slow edges. */
void gpio_set_pad(unsigned pin, enum gpio_pull pull);

void gpio_set_function(unsigned pin, enum gpio_function function);

/* The same, but the pin is never driven, and the function reads it as high. */
void gpio_set_function_reading_high(unsigned pin, enum gpio_function function);

/* Under GPIO_FUNCTION_SIO: the level to drive, and whether to drive it. */
void gpio_write(unsigned pin, bool high);
void gpio_drive(unsigned pin, bool enabled);

/* The level on the pad, whatever its function. */
bool gpio_read(unsigned pin);
