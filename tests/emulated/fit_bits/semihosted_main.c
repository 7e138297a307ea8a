/* fit_bits KERNEL COUNT (host_main.c) for a machine of QEMU: prints by semihosting (ARM, "Semihosting for AArch32 and AArch64"). */
#include "fit_bits.h"

#include <stdlib.h>
#include <string.h>

enum { SYS_WRITE0 = 0x04, SYS_GET_CMDLINE = 0x15, SYS_EXIT = 0x18 };
#define APPLICATION_EXIT 0x20026u

static uint32_t call_host(uint32_t operation, const void *argument) {
  register uint32_t r0 __asm("r0") = operation;
  register const void *r1 __asm("r1") = argument;
  __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

static void print_hex(uint32_t value) {
  char text[10];
  for (int i = 0; i < 8; i++) {
    text[i] = "0123456789abcdef"[value >> (28 - 4 * i) & 15];
  }
  text[8] = '\n';
  text[9] = 0;
  call_host(SYS_WRITE0, text);
}

int main(void) {
  static char line[80];
  struct {
    char *text;
    uint32_t size;
  } command = {line, sizeof line};
  call_host(SYS_GET_CMDLINE, &command);
  fit_bits_init();
  char *word = strchr(line, ' ');
  const enum fit_bits_kernel kernel = (enum fit_bits_kernel)strtoul(word, &word, 10);
  const uint32_t count = strtoul(word, NULL, 10);
  for (uint32_t press = 0; press < count; press++) {
    print_hex(fit_bits_of(kernel, press));
  }
  call_host(SYS_EXIT, (const void *)APPLICATION_EXIT);
  return 0;
}
