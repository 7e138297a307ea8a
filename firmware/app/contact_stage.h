/* Stage: the flags of the frame (contact/contact.h). Slip is found right after it, by contact_update.
 * Reads findings.frame, .conditioned and .fit. Writes findings.contact_input and, in a held frame, .contact. */
#pragma once

#include "app/findings.h"
#include "wire/packet.h"

/* Collects the input of the flags. */
void contact_stage_collect(struct findings *found, bool calibrated);

/* A held frame repeats the flags of the frame before, except two. */
void contact_stage_hold(struct findings *found);

/* Fills in what this stage knows of a contact packet. */
void contact_stage_fill(const struct findings *found, struct wire_contact *packet);
