/* Interrupt numbers (RP2040 datasheet 2.3.2) and the interrupt controller of the core (2.4.8). */
#pragma once

enum rp2040_irq {
  RP2040_IRQ_TIMER_0 = 0,
  RP2040_IRQ_TIMER_1 = 1,
  RP2040_IRQ_TIMER_2 = 2,
  RP2040_IRQ_TIMER_3 = 3,
  RP2040_IRQ_USBCTRL = 5,
  RP2040_IRQ_DMA_0 = 11,
  RP2040_IRQ_I2C0 = 23,
  RP2040_IRQ_USB_SERVICE = 26, /* wired to no block: for software */
};

/* Gives every line its priority (vectors.S). */
void rp2040_irq_set_priorities(void);

/* Forgets what is pending on the line and lets it interrupt. */
void rp2040_irq_enable(unsigned irq);

void rp2040_irq_disable(unsigned irq);

/* Lets the line interrupt now, as if its block had asked for it. */
void rp2040_irq_pend(unsigned irq);
