/* The event interrupt of port.h. What leads to it has one priority, so its handlers never nest;
 * those of USB come above them, and share nothing with them. */
#pragma once

/* Calls the handler that port_set_event_handler() installed. From an interrupt handler. */
void rp2040_event(void);

/* Interrupt vector of TIMER alarm 0. */
void timer0_irq_handler(void);

/* Prepares what port.h offers. Called once, before main. */
void port_start(void);
