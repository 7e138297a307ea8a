/* Interrupt vectors of the USB controller behind port/usb_controller.h. */
#ifndef RP2040_USB_CONTROLLER_H
#define RP2040_USB_CONTROLLER_H

void usbctrl_irq_handler(void);

/* A line without a block: what usbctrl_irq_handler() leaves, and usb_controller_request_service().
 */
void usb_service_irq_handler(void);

/* TIMER alarm 1: the watch over the controller. */
void timer1_irq_handler(void);

#endif
