/* A polling CDC ACM device for the test images: echoes bulk OUT, streams when STREAM is defined. Single buffers. */
#pragma once
#include "rig.h"

#define DPRAM(offset) REG(0x50100000 + (offset))
#define USB(offset) REG(0x50110000 + (offset))
#define IN_CTL(ep) DPRAM(0x80 + 8 * (ep))
#define OUT_CTL(ep) DPRAM(0x84 + 8 * (ep))

#ifndef PULLUP_BITS
#define PULLUP_BITS (1u << 16 | 1u << 29)
#endif
#ifndef MUXING
#define MUXING 9
#endif
#ifndef POWER
#define POWER 0xc
#endif
#ifndef ARM
#define ARM(control, value)                                                                                                                \
  do {                                                                                                                                     \
    (control) = (value);                                                                                                                   \
    __asm volatile("nop\n nop\n nop\n nop\n nop\n nop");                                                                                   \
    (control) = (value) | 1 << 10;                                                                                                         \
  } while (0)
#endif

static const uint8_t device_descriptor[18] = {18, 1, 0, 2, 2, 2, 0, 64, 0x34, 0x12, 0x78, 0x56, 0, 1, 1, 2, 3, 1};
static const uint8_t configuration[] = {9, 2,    67, 0,  2, 1, 0,    0x80, 50, 9,    4,    0,  0, 1, 2, 2, 1,    0, 5,  0x24, 0,  0x10, 1,
                                        5, 0x24, 1,  0,  1, 4, 0x24, 2,    2,  5,    0x24, 6,  0, 1, 7, 5, 0x81, 3, 8,  0,    16, 9,    4,
                                        1, 0,    2,  10, 0, 0, 0,    7,    5,  0x82, 2,    64, 0, 0, 7, 5, 0x02, 2, 64, 0,    0};
static const uint8_t strings[4][6] = {{4, 3, 9, 4}, {6, 3, 'M', 0, 'f', 0}, {6, 3, 'P', 0, 'r', 0}, {6, 3, 'S', 0, '1', 0}};

static uint32_t pid_in0, pid_in2, pid_out2, new_address, configured, dtr, sent, baud;

static inline void copy_in(uint32_t at, const uint8_t *from, int n) {
  for (int i = 0; i < n; i++)
    ((volatile uint8_t *)0x50100000)[at + i] = from[i];
}

static inline void in0(const uint8_t *data, int n) {
  copy_in(0x100, data, n);
  ARM(IN_CTL(0), 1u << 15 | pid_in0 << 13 | (uint32_t)n);
  pid_in0 ^= 1;
}

static inline void arm_out2(void) {
  ARM(OUT_CTL(2), pid_out2 << 13 | 64);
  pid_out2 ^= 1;
}

static inline void setup(void) {
  const uint32_t head = DPRAM(0), tail = DPRAM(4);
  const uint32_t type = head & 0xff, request = head >> 8 & 0xff, value = head >> 16, length = tail >> 16;
  USB(0x50) = 1 << 17;
  pid_in0 = 1;
  if (type == 0x80 && request == 6) {
    const uint8_t *from = 0;
    uint32_t n = 0;
    if (value == 0x100)
      from = device_descriptor, n = 18;
    if (value == 0x200)
      from = configuration, n = sizeof configuration;
    if (value >> 8 == 3 && (value & 0xff) < 4)
      from = strings[value & 0xff], n = from[0];
    if (!from) {
      USB(0x68) = 1;
      IN_CTL(0) = 1 << 11;
      return;
    }
    if (n > length)
      n = length;
    const uint32_t first = n > 64 ? 64 : n;
    in0(from, (int)first);
    if (n > 64) {
      while (!(USB(0x58) & 1)) {
      }
      USB(0x58) = 1;
      in0(from + 64, (int)(n - 64));
    }
    ARM(OUT_CTL(0), 1 << 13);
  } else if (type == 0 && request == 5) {
    new_address = value;
    in0(0, 0);
  } else if (type == 0 && request == 9) {
    configured = 1;
#ifndef NO_ENABLE
    DPRAM(0x08) = 1u << 31 | 1 << 29 | 3 << 26 | 0x180;
    DPRAM(0x10) = 1u << 31 | 1 << 29 | 2 << 26 | 0x1c0;
    DPRAM(0x14) = 1u << 31 | 1 << 29 | 2 << 26 | 0x200;
    pid_in2 = pid_out2 = 0;
    arm_out2();
#endif
    in0(0, 0);
  } else if (type == 0x21 && length) {
    ARM(OUT_CTL(0), 1 << 13 | 64);
    while (!(USB(0x58) & 2)) {
    }
    USB(0x58) = 2;
    baud = DPRAM(0x100);
    in0(0, 0);
  } else if (type == 0x21) {
    if (request == 0x22)
      dtr = value & 1;
    in0(0, 0);
  }
}

static inline void usb_start(void) {
  unreset(1 << 24);
  for (uint32_t at = 0; at < 0x100; at += 4)
    DPRAM(at) = 0;
  pid_in0 = pid_in2 = pid_out2 = new_address = configured = dtr = sent = baud = 0;
  USB(0x74) = MUXING;
  USB(0x78) = POWER;
  USB(0x40) = 1;
  USB(0x4c) = PULLUP_BITS;
}

static inline void bulk_in(const uint8_t *data, int n) {
  copy_in(0x1c0, data, n);
  ARM(IN_CTL(2), 1u << 15 | pid_in2 << 13 | (uint32_t)n);
  pid_in2 ^= 1;
}

static inline void usb_poll(void) {
  const uint32_t status = USB(0x50);
  if (status & 1 << 19) {
    USB(0x50) = 1 << 19;
    USB(0) = 0;
    configured = 0;
    for (uint32_t at = 0x08; at < 0x100; at += 4)
      DPRAM(at) = 0;
  }
  if (status & 1 << 17)
    setup();
  const uint32_t done_buffers = USB(0x58);
  if (done_buffers & 1) {
    USB(0x58) = 1;
#ifndef NO_ADDRESS
    if (new_address)
      USB(0) = new_address, new_address = 0;
#endif
  }
  if (done_buffers & 2)
    USB(0x58) = 2;
  if (done_buffers & 1 << 4)
    USB(0x58) = 1 << 4;
  if (done_buffers & 1 << 5 && !(IN_CTL(2) & 1 << 10)) {
    USB(0x58) = 1 << 5;
    const int n = OUT_CTL(2) & 0x3ff;
    uint8_t bytes[64];
    for (int i = 0; i < n; i++)
      bytes[i] = ((volatile uint8_t *)0x50100200)[i];
    bulk_in(bytes, n);
    arm_out2();
  }
#ifdef STREAM
  if (configured && dtr && !(IN_CTL(2) & 1 << 10)) {
    uint8_t bytes[64];
    for (int i = 0; i < 64; i++)
      bytes[i] = (uint8_t)sent++;
    bulk_in(bytes, 64);
  }
#endif
}
