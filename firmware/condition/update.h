/* One pass over all that is remembered of one sensor: condition.h has the meaning of each part. For condition.c only. */
#pragma once

#include "condition/condition.h"

/* Updates sensor k with the frame just processed. */
void update_sensor(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned, uint8_t k);

/* Begins a tare of sensor k: until it ends there is no answer from it. The new baseline may be off by the spread. */
void update_begin_tare(struct condition *condition, uint8_t k, int32_t spread_Pa_q10);

/* Whether the pressure of sensor k is more than its zero may have moved: sets its bits of firm and sudden. */
void update_compare(struct condition *condition, uint8_t k, int32_t pressure_Pa_q10);

/* By how far a barometer may drift in a contact of this length. */
int32_t update_drift_in(uint32_t pressed_ms);
