/* The watchdog, and what is known of the last end of the firmware: behind port.h, and behind the faults of fault.S.
 *
 * A record lies in SRAM that a reset by the watchdog leaves alone, under a magic word and a CRC, so that what power-on leaves there is
 * none. Every end but one leaves a record: a fault and a panic take it and reset the chip; where the main loop does not feed the watchdog,
 * an interrupt of the first priority takes it 20 ms before the reset, with the registers of what it interrupted. Where that interrupt
 * cannot run either, the next start makes a record of what the parts noted on their way; of registers it knows nothing. */
#pragma once

/* First thing: finds out how the last life ended, and begins to follow this one. */
void crash_start(void);

/* Once the timer runs. */
void crash_watch(void);
