/* The computing part of the firmware on pressures that a fingertip has sent: what should its contact packets have been? */
#pragma once

#include "wire/packet.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* From the info packet: layout, OSR, slip settings, iterations, prior, limit, calibration.
 * False: it cannot be; the packet is not to be trusted. */
bool repeat_begin(const struct wire_info *info);

/* A tare command was obeyed. */
void repeat_tare(void);

/* Fills in the contact packet to this raw packet; stages are left as they are. held: no new pressures came. */
void repeat_frame(const struct wire_packet *raw, bool held, struct wire_contact *contact);

#ifdef __cplusplus
}
#endif
