/* Stage: the flags of the frame (contact/contact.h). Slip is found right after it, by contact_update.
 * Reads findings.frame, .conditioned and .fit. Writes findings.contact_input and, in a held frame, .contact. */
#pragma once

#include "app/findings.h"
#include "wire/packet.h"

/* Gathers what the flags are made of. */
void contact_stage_gather(struct findings *found, bool calibrated);

/* In a held frame the flags are those of the frame before, but for two. */
void contact_stage_hold(struct findings *found);

/* Fills in what this stage knows of a contact packet. */
void contact_stage_put(const struct findings *found, struct wire_contact *packet);
