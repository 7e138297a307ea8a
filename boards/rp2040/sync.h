/* port/sync.h on a pin of bank 0. Takes PIO1, DMA channels 2 and 3, and alarm 3 of the timer.
 *
 * A state machine watches the pin. An edge is one if the new level is seen 15 times in 0.35 us. Then the machine counts it and pushes its
 * number. One DMA channel fetches the number, and starts another one, which fetches the timer's low word. So no interrupt and no masked
 * section moves a stamp. All of this takes 62 cycles of clk_sys, half a microsecond, so the timer's whole microseconds are the edge's time,
 * rounded. Other DMA and the processor may delay the two transfers by a few cycles each.
 *
 * The two channels write rings that wrap by themselves. A reader that is late finds by the numbers what it has missed. */
#pragma once

/* The board's. */
extern const unsigned sync_pin;

void timer3_irq_handler(void);
