/* port/sync.h on the host: edges come from the test, and pulses go nowhere. */
#pragma once

#include "port/sync.h"

/* Start-up: the pin is off, and no edge waits. */
void native_sync_reset(void);

/* The pin changes now, if its edges are stamped; else nothing happens. */
void native_sync_edge(void);

enum port_sync native_sync_mode(void);

/* Rises of the pin since start-up. */
unsigned native_sync_pulses(void);
