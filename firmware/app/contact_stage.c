#include "app/contact_stage.h"

#include "common/contact_flags.h"

static bool is_sensor_doubtful(const struct findings *found) { return (found->frame.doubtful & found->conditioned.usable) != 0; }

void contact_stage_collect(struct findings *found, bool calibrated) {
  const struct frame *frame = &found->frame;
  const struct conditioned *conditioned = &found->conditioned;
  struct contact_input *input = &found->contact_input;
  *input = (struct contact_input){
      .t_us = frame->t_us,
      .contact = conditioned->contact,
      .tared = conditioned->tared,
      .zero_doubtful = conditioned->zero_doubtful,
      .sensor_doubtful = is_sensor_doubtful(found),
      .masked = conditioned->usable != first_sensors(frame->sensor_count),
      .calibrated = calibrated,
      .unsettled = frame->unsettled,
      .saturated = frame->saturated,
      .fit = conditioned->contact ? &found->fit : NULL,
  };
}

void contact_stage_hold(struct findings *found) {
  found->contact.flags |= CONTACT_FLAG_HELD;
  found->contact.flags |= is_sensor_doubtful(found) ? (uint32_t)CONTACT_FLAG_SENSOR_DOUBTFUL : 0;
}

static uint16_t saturated(uint64_t value) { return value < UINT16_MAX ? (uint16_t)value : UINT16_MAX; }

void contact_stage_fill(const struct findings *found, struct wire_contact *packet) {
  const struct frame *frame = &found->frame;
  packet->frame = frame->number;
  packet->flags = found->contact.flags;
  packet->stages = (struct wire_stages){
      .convert_us = saturated(frame->t_converted_us - frame->t_begin_us),
      .read_us = saturated(frame->t_read_us - frame->t_converted_us),
      .queue_us = saturated(found->taken_us - (uint32_t)frame->t_read_us),
      .condition_us = saturated(found->spent_us[CRASH_AT_CONDITION]),
      .fit_us = saturated(found->spent_us[CRASH_AT_FIT]),
      .contact_us = saturated(found->spent_us[CRASH_AT_CONTACT]),
      .total_us = saturated(found->since_us - (uint32_t)frame->t_begin_us),
  };
  packet->slip_mm = found->contact.slip_mm;
}
