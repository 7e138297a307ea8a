#include "simulation/player/native_stages.h"

#include "app/stages.h"
#include "common/contact_flags.h"
#include "config/geometry.h"

#include <stdlib.h>
#include <string.h>

struct native_stages {
  struct stages stages;
  struct findings found;
  struct scan scan; /* only asked for temperatures, which never come */
  struct calibration calibration;
  struct pad_profile profile;
  uint64_t second_us; /* the last one's */
};

static struct native_stages *started(void) {
  struct native_stages *all = calloc(1, sizeof *all);
  if (all) {
    stages_start(&all->stages);
  }
  return all;
}

/* NULL: none. */
static void use(struct native_stages *all, const struct calibration *calibration, const struct pad_profile *profile) {
  if (calibration) {
    all->calibration = *calibration;
  }
  stages_use_calibration(&all->stages, &all->found, calibration ? &all->calibration : NULL);
  if (profile) {
    all->profile = *profile;
    stages_use_profile(&all->stages, &all->profile);
  }
}

struct native_stages *native_stages_new(const struct calibration *calibration, const struct pad_profile *profile) {
  struct native_stages *all = started();
  if (all) {
    use(all, calibration, profile);
  }
  return all;
}

struct native_stages *native_stages_of(const struct wire_info *info) {
  const struct ms58xx_osr *osr = ms58xx_find_osr(info->osr);
  struct native_stages *all = started();
  if (!all || !osr || fit_array_init(&all->stages.location.array, info->sensor_count, info->x_mm, info->y_mm, info->pitch_mm) != FT_OK) {
    free(all);
    return NULL;
  }
  all->found.frame.noise_Pa_q10 = osr->noise_Pa_q10;
  all->stages.location.settings.iterations = info->fit_iterations;
  stages_use_settings(&all->stages, &(struct store_settings){.slip_threshold_mm = info->slip_threshold_mm,
                                                             .slip_window_ms = info->slip_window_ms,
                                                             .prior_sigma_mm = info->prior_sigma_mm,
                                                             .prior_width_mm = info->prior_width_mm,
                                                             .location_limit_mm = info->location_limit_mm});
  use(all, info->stored & WIRE_STORED_CALIBRATION ? &info->calibration : NULL, info->stored & WIRE_STORED_PAD ? &info->pad : NULL);
  return all;
}

void native_stages_free(struct native_stages *all) { free(all); }

void native_stages_frame(struct native_stages *all, uint64_t t_us, const int32_t *pressure_Pa_q10, int32_t noise_Pa_q10,
                         struct wire_packet *packet) {
  struct frame *frame = &all->found.frame;
  frame->number++;
  frame->t_us = frame->t_begin_us = frame->t_converted_us = frame->t_read_us = t_us;
  frame->sensor_count = geometry.sensor_count;
  frame->noise_Pa_q10 = noise_Pa_q10;
  frame->valid = first_sensors(geometry.sensor_count);
  memcpy(frame->pressure_Pa_q10, pressure_Pa_q10, geometry.sensor_count * sizeof frame->pressure_Pa_q10[0]);
  stages_process(&all->stages, &all->found, (uint32_t)t_us);
  memset(packet, 0, sizeof *packet);
  packet->type = WIRE_CONTACT;
  packet->t_us = t_us;
  stages_fill_contact(&all->stages, &all->found, &packet->body.contact);
  stages_after_send(&all->stages, &all->found, &all->scan);
  if (t_us >= all->second_us + 1000000u) {
    all->second_us = t_us;
    stages_each_second(&all->stages, &all->found);
  }
}

void native_stages_tare(struct native_stages *all) { condition_tare(&all->stages.condition.condition); }

void native_stages_repeat(struct native_stages *all, const struct wire_packet *packet, bool held, struct wire_contact *contact) {
  const struct wire_raw *raw = &packet->body.raw;
  struct frame *frame = &all->found.frame;
  frame->number = raw->frame;
  frame->t_us = packet->t_us;
  frame->held = held;
  frame->sensor_count = raw->sensor_count;
  frame->temperature_cC = raw->temperature_cC;
  frame->valid = raw->valid;
  frame->saturated = raw->saturated;
  frame->doubtful = held && (raw->flags & CONTACT_FLAG_SENSOR_DOUBTFUL) ? ~(sensor_map)0 : raw->doubtful; /* a held one has no map */
  frame->unsettled = raw->doubtful == raw->valid ? raw->valid : 0; /* what has moved is doubted whole (scan/readings.h) */
  memcpy(frame->pressure_Pa_q10, raw->pressure_Pa_q10, sizeof frame->pressure_Pa_q10);
  stages_process(&all->stages, &all->found, 0);
  const struct wire_stages stages = contact->stages;
  stages_fill_contact(&all->stages, &all->found, contact);
  contact->stages = stages;
  stages_after_send(&all->stages, &all->found, &all->scan);
}
