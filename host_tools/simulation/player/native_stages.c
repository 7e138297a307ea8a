#include "simulation/player/native_stages.h"

#include "app/stages.h"
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

struct native_stages *native_stages_new(const struct calibration *calibration, const struct pad_profile *profile) {
  struct native_stages *all = calloc(1, sizeof *all);
  if (!all) {
    return NULL;
  }
  stages_start(&all->stages);
  all->calibration = *calibration;
  stages_use_calibration(&all->stages, &all->found, &all->calibration);
  if (profile) {
    all->profile = *profile;
    stages_use_profile(&all->stages, &all->profile);
  }
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
