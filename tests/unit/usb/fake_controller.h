/* A USB controller with a host at its other end, for tests: usb_controller.h is implemented here, and host_ functions do single
 * transactions the way a host does, PIDs included. Any breach of the controller's contract fails the running test. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { HOST_NAK = -1, HOST_STALL = -2, HOST_NO_ANSWER = -3 };

void fake_power_on(void);
bool fake_is_attached(void);

/* Interrupts wait until fake_run_interrupts(). */
void fake_hold_interrupts(void);
void fake_run_interrupts(void);

/* A packet that the host takes before the device's next withdrawal, but whose interrupt has not been served by then. */
void fake_take_at_next_withdrawal(void);

bool fake_accepts(uint8_t endpoint);

/* The controller asks by itself whether USB is looked after; how often it was said since power-on that it is. */
void fake_service(void);
unsigned fake_signs_of_life(void);

void host_bus_reset(void);
void host_suspend(void);
void host_resume(void);

/* Bytes of the packet, or HOST_. A toggle that is not the host's own fails the test. */
int host_in(uint8_t endpoint, uint8_t packet[64]);
/* 0, or HOST_. */
int host_out(uint8_t endpoint, const void *bytes, size_t length);

/* A SETUP transaction alone. */
void host_setup(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint16_t length);

/* A whole control transfer, as in USB 2.0 section 8.5.3. Bytes of the answer, or HOST_. */
int host_control_in(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint16_t length, uint8_t *answer);
/* 0, or HOST_. */
int host_control_out(uint8_t type, uint8_t request, uint16_t value, uint16_t index, const void *bytes, uint16_t length);

/* The host sends to this address from now on. */
void host_address(uint8_t address);

/* The host's toggles of all endpoints, or of one, go back to DATA0. */
void host_reset_toggles(void);
void host_reset_toggle(uint8_t endpoint);

/* Whatever it does, the host has the device's toggles from now on: for hosts that keep no rule. */
void host_follow_toggles(void);
