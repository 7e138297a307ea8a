/* usage: fit_bits KERNEL COUNT: prints the CRC of each of the first COUNT presses. */
#include "fit_bits.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
  if (argc != 3) {
    fputs("usage: fit_bits KERNEL COUNT\n", stderr);
    return 2;
  }
  int kernel = atoi(argv[1]);
  fit_bits_init();
  for (uint32_t press = 0; press < strtoul(argv[2], NULL, 10); press++) {
    printf("%08x\n", (unsigned)fit_bits_of((enum fit_bits_kernel)kernel, press));
  }
  return 0;
}
