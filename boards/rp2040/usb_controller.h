/* Interrupt vectors of the USB controller behind port/usb_controller.h. */
#pragma once

#include <stdbool.h>

/* The board's: nothing is connected to GPIO15 and GPIO16 has not their function 8, so the
 * controller of a chip older than revision B2 may borrow them (erratum E5). */
extern const bool usb_controller_has_gpio15;

void usbctrl_irq_handler(void);

/* A line without a block: what usbctrl_irq_handler() leaves, and usb_controller_request_service(). */
void usb_service_irq_handler(void);

/* TIMER alarm 1: the watch over the controller. */
void timer1_irq_handler(void);
