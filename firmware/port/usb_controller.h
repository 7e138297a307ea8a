/* The seam between a USB device and the controller that the board provides at link time: a full-speed device controller
 * with the control endpoint and a few others of 64 bytes at most.
 *
 * An endpoint is named by its address: number, and bit 7 for IN (device to host). Each holds at most one packet. The
 * controller owns the data toggles: a SETUP sets endpoint 0 to DATA1, and opening or unstalling another endpoint sets
 * it to DATA0; each acknowledged packet turns it.
 *
 * usb_controller_start() and usb_controller_request_service() belong to the main context. All other functions are
 * called from the usb_device_on_ functions only, which the controller calls in interrupt context, one at a time. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { USB_MAX_PACKET_BYTES = 64, USB_SETUP_BYTES = 8, USB_ENDPOINT_IN = 0x80 };

/* As in bmAttributes of an endpoint descriptor. */
enum usb_endpoint_type { USB_ENDPOINT_BULK = 2, USB_ENDPOINT_INTERRUPT = 3 };

/* Device to controller ------------------------------------------------------------------------- */

/* Starts the controller and shows the device to the host. */
void usb_controller_start(void);

/* Has usb_device_on_service() called soon. */
void usb_controller_request_service(void);

/* The address to answer to from now on. */
void usb_controller_set_address(uint8_t address);

/* Makes the endpoint answer, empty, at DATA0, not stalled. Withdraws what it held. */
void usb_controller_open(uint8_t endpoint, enum usb_endpoint_type type);

/* Closes all endpoints but the control endpoint. */
void usb_controller_close_all(void);

/* Offers a packet to the host; the bytes are copied, in whole words: they are aligned to them and
 * readable up to the end of the last. The endpoint must hold none. */
void usb_controller_send(uint8_t endpoint, const uint8_t *bytes, size_t length);

/* Accepts one packet from the host. No effect if the endpoint does so already. */
void usb_controller_receive(uint8_t endpoint);

/* Withdraws the packet that the endpoint offers. True: it was withdrawn and the host has not got
 * it. False: there is none, or no more; usb_device_on_sent() will not be called for it. */
bool usb_controller_withdraw(uint8_t endpoint);

/* Answers the host with STALL, and withdraws what the endpoint held. Endpoint 0 (both directions)
 * recovers with the next SETUP, the others when unstalled. */
void usb_controller_stall(uint8_t endpoint);
void usb_controller_unstall(uint8_t endpoint);

/* Controller to device ------------------------------------------------------------------------- */

/* The host has reset the bus: address 0, only the control endpoint open, nothing under way. */
void usb_device_on_bus_reset(void);

/* A SETUP packet. The control endpoint has forgotten what it held. */
void usb_device_on_setup(const uint8_t packet[USB_SETUP_BYTES]);

/* The host has acknowledged the packet of this endpoint. */
void usb_device_on_sent(uint8_t endpoint);

/* A packet has arrived; the endpoint accepts no other until usb_controller_receive(). */
void usb_device_on_received(uint8_t endpoint, const uint8_t *bytes, size_t length);

/* The bus is idle: the host sleeps or has gone. Ends with any traffic. */
void usb_device_on_suspend(void);
void usb_device_on_resume(void);

/* The answer to usb_controller_request_service(); without a request too at least each 0.3 s, also
 * while the bus sleeps, is silent, or is not there. */
void usb_device_on_service(void);
