/* Bringing the device up as Linux does, for tests that need one. */
#pragma once

#include <stdint.h>

/* A device that has just been plugged in; from its start if it is the first of the program. */
void plug_in(void);

/* Bus reset, address, configuration 1. */
void enumerate(void);

void set_dtr(int on);

/* Raises DTR, and reads what comes first after that. */
void open_port(void);

void set_baud(uint32_t baud);
