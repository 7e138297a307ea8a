/* Both ends of a USB port for the tests of hand-overs. What a host gets is whole writes in their
 * order from some one on, cut off where the port was closed; what it sends arrives, each byte once
 * and in order: else the test fails. */
#pragma once

#include <stddef.h>

/* Opens a port whose transmit ring is about to turn over. */
void usb_open_port(void);

/* Interrupts: the host takes a packet, brings one, closes the port and opens it again. */
void usb_take_packet(void);
void usb_bring_packet(void);
void usb_reopen(void);

/* Main context: writes some bytes; reads some and returns how many. */
void usb_write(void);
size_t usb_read(void);

/* At the end: the host takes all and judges it; main reads all that the host sent. */
void usb_take_all(void);
void usb_judge_session(void);
void usb_judge_reads(void);
