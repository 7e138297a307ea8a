/* Presses whose fits are compared bit by bit between machines. They are drawn from their number with integers alone, so
 * that every machine has the same. */
#pragma once

#include <stdint.h>

/* The order is that of KERNELS in test_fit_bits.py. */
enum fit_bits_kernel {
  FIT_BITS_GRID,       /* fit_grid: the array of the firmware */
  FIT_BITS_MASKED,     /* fit_gaussian: the same with one to eleven sensors left out */
  FIT_BITS_GENERAL,    /* fit_general: the same and other layouts, any subset */
  FIT_BITS_TANGENTIAL, /* fit_tangential after fit_gaussian: pads of 5 to 20 mm, every sensor or not
                        */
  FIT_BITS_BIAS,       /* a look of fit_bias after fit_gaussian: mostly the array of the firmware */
  FIT_BITS_SHAPES,     /* fit_shapes after fit_gaussian: one press or two on 12 mm, every sensor or not */
  FIT_BITS_KERNELS
};

/* Once, before the others. */
void fit_bits_init(void);

/* CRC-32 of every byte of the result. */
uint32_t fit_bits_of(enum fit_bits_kernel kernel, uint32_t press);
