/* What the test images share: registers by address, clock tree, timer, I2C. No .data; .bss is not cleared. */
#pragma once
#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(address))
#define SET(address) REG((address) + 0x2000)
#define CLR(address) REG((address) + 0x3000)

void main(void);

void *memset(void *to, int value, unsigned n);
void *memset(void *to, int value, unsigned n) {
  for (unsigned i = 0; i < n; i++)
    ((volatile uint8_t *)to)[i] = (uint8_t)value;
  return to;
}

static inline void unreset(uint32_t bits) {
  CLR(0x4000c000) = bits;
  while ((REG(0x4000c008) & bits) != bits) {
  }
}

/* Crystal, both PLLs (125 and 48 MHz), clk_sys, clk_usb, 1 MHz tick. */
static inline void start_clocks(void) {
  REG(0x4002400c) = 47;
  REG(0x40024000) = 0xfabaa0;
  while (!(REG(0x40024004) & 0x80000000)) {
  }
  REG(0x40008030) = 2;
  while (!(REG(0x40008038) & 4)) {
  }
  unreset(1 << 12 | 1 << 13);
  const uint32_t base[2] = {0x40028000, 0x4002c000};
  const uint32_t fbdiv[2] = {125, 100};
  const uint32_t prim[2] = {6 << 16 | 2 << 12, 5 << 16 | 5 << 12};
  for (int i = 0; i < 2; i++) {
    REG(base[i] + 8) = fbdiv[i];
    CLR(base[i] + 4) = 1 | 32;
    while (!(REG(base[i]) & 0x80000000)) {
    }
    REG(base[i] + 12) = prim[i];
    CLR(base[i] + 4) = 8;
  }
  REG(0x4000803c) = 1;
  while (!(REG(0x40008044) & 2)) {
  }
  REG(0x40008054) = 1 << 11;
  REG(0x4005802c) = 0x200 | 12;
}

static inline uint32_t now_us(void) { return REG(0x40054028); }

static inline void wait_us(uint32_t us) {
  const uint32_t start = now_us();
  while (now_us() - start < us) {
  }
}

/* I2C0 on GPIO4 and 5 at 400 kHz. */
static inline void start_i2c(void) {
  unreset(1 << 3 | 1 << 5 | 1 << 8);
  for (int pin = 4; pin <= 5; pin++) {
    REG(0x4001c004 + 4 * pin) = 0x4a;
    REG(0x40014004 + 8 * pin) = 3;
  }
  REG(0x40044000) = 0x65;
  REG(0x4004401c) = 126;
  REG(0x40044020) = 187;
  REG(0x400440a0) = 11;
  REG(0x4004407c) = 38;
}

/* Write n bytes, then read m with a STOP between; returns IC_TX_ABRT_SOURCE, 0 if all went well. */
static inline uint32_t i2c_run(uint32_t address, const uint8_t *out, int n, uint8_t *in, int m) {
  REG(0x4004406c) = 0;
  while (REG(0x4004409c) & 1) {
  }
  REG(0x40044004) = address;
  REG(0x4004406c) = 1;
  for (int i = 0; i < n; i++)
    REG(0x40044010) = out[i] | (i == n - 1 ? 0x200 : 0);
  for (int i = 0; i < m; i++)
    REG(0x40044010) = 0x100 | (i == m - 1 ? 0x200 : 0);
  int stops = (n > 0) + (m > 0);
  int got = 0;
  while (stops) {
    if (REG(0x40044034) & 64) {
      const uint32_t source = REG(0x40044080);
      while (!(REG(0x40044034) & 512)) {
      }
      (void)REG(0x40044060);
      (void)REG(0x40044054);
      return source;
    }
    if (REG(0x40044034) & 512) {
      (void)REG(0x40044060);
      stops--;
    }
    while (REG(0x40044078)) {
      const uint8_t byte = (uint8_t)REG(0x40044010);
      if (got < m)
        in[got] = byte;
      got++;
    }
  }
  return 0;
}

/* Results for the test: RAM words from 0x20030000 on. */
#define RESULT(i) REG(0x20030000 + 4 * (i))
/* The end: the test catches this breakpoint as "entered the USB boot loader". */
static inline void done(void) { __asm volatile("bkpt 0x42"); }

void reset_entry(void);
void reset_entry(void) {
  main();
  for (;;) {
  }
}
/* An image with interrupts defines HAS_ISR and isr(). */
void isr(void);
#ifndef HAS_ISR
void isr(void) { __asm volatile("bkpt 1"); }
#endif
__attribute__((section(".vectors"), used))
const void *const vectors[48] = {(void *)0x20010000, (void *)reset_entry, [2 ... 47] = (void *)isr};
