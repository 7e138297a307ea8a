#include "contact/shapes.h"

#include "common/contact_flags.h"
#include "fit/fit_math.h"
#include "port/divide.h"
#include "worker/worker.h"

#include <math.h>
#include <string.h>

#define DEGREES_PER_RAD 57.29578f

uint8_t shapes_parts(uint64_t apart_us) {
  const uint8_t most = FIT_SHAPES_FRAMES * FIT_SHAPES_PARTS;
  const uint32_t load_us = apart_us < TANGENTIAL_SLOW_us ? TANGENTIAL_TIMEOUT_us : TANGENTIAL_SLOW_TIMEOUT_us;
  if (apart_us >= load_us + most * SHAPES_PART_us) {
    return most;
  }
  const int32_t parts = port_divide((int32_t)apart_us - (int32_t)load_us, SHAPES_PART_us);
  return parts < FIT_SHAPES_PARTS ? 1 : (uint8_t)parts;
}

/* atan(z) of 0..1 within 1e-5 (Abramowitz and Stegun 4.4.49), the same bits on every machine. */
static float arc_tangent(float z) {
  const float z2 = z * z;
  return z * (0.999866f + z2 * (-0.3302995f + z2 * (0.180141f + z2 * (-0.085133f + z2 * 0.0208351f))));
}

/* The angle of (along_x, along_y), along_x >= 0. */
static float direction_deg(float along_x, float along_y) {
  const float y = fabsf(along_y);
  float angle_rad = y <= along_x ? arc_tangent(along_x > 0.0f ? y / along_x : 0.0f) : 1.5707963f - arc_tangent(along_x / y);
  return DEGREES_PER_RAD * (along_y < 0.0f ? -angle_rad : angle_rad);
}

static struct shapes_contact contact_of(const struct shapes_question *question, const struct fit_shapes_result *result, int c) {
  return (struct shapes_contact){
      .x_mm = result->x_mm[c],
      .y_mm = result->y_mm[c],
      .location_sd_mm = result->location_sd_mm[c],
      .force_N = question->force_scale * result->force_N[c],
      .force_sd_N = fit_quadrature(question->force_scale, result->force_sd_N[c], question->force_scale_sd, result->force_N[c]),
  };
}

static void put_report(const struct shapes_question *question, const struct fit_shapes_result *result, struct shapes_report *report) {
  memset(report, 0, sizeof *report);
  report->shape = result->shape;
  report->t_us = question->t_us;
  if (result->shape == FIT_SHAPE_TWO) {
    report->contact[0] = contact_of(question, result, 0);
    report->contact[1] = contact_of(question, result, 1);
  } else if (result->shape == FIT_SHAPE_ELONGATED) {
    report->edge_angle_deg = direction_deg(result->along_x, result->along_y);
    report->edge_angle_sd_deg = DEGREES_PER_RAD * result->angle_sd_rad;
    report->edge_length_mm = result->length_mm;
  }
  if (result->shape == FIT_SHAPE_ROUND) {
    const float chi_square = fminf(result->chi_square[0], result->chi_square[1]);
    report->chi_square_ratio = fmaxf(chi_square / (float)FIT_SHAPES_ERRORS, 1.0f);
  }
  if (result->shape == FIT_SHAPE_TANGENTIAL || result->shape == FIT_SHAPE_ELONGATED) {
    report->from_fit_x_mm = result->x_mm[0] - question->fit.x_mm;
    report->from_fit_y_mm = result->y_mm[0] - question->fit.y_mm;
  }
}

void shapes_estimate(void *job) {
  struct shapes_job *own = job;
  const struct shapes_question *question = &own->question;
  if (question->begins) {
    memset(&own->state, 0, sizeof own->state);
  }
  int parts = question->parts;
  bool goes_on;
  do {
    own->progress =
        fit_shapes_part(own->array, &own->pad, question->pressure_Pa_q10, &question->settings, &question->fit, &own->state, &own->result);
    parts--;
    const bool knows = own->progress == FIT_SHAPES_ANSWERED && own->result.shape != FIT_SHAPE_UNDECIDED;
    /* What is begun is ended with the same readings, so the next one begins only if it ends here. */
    goes_on = own->progress == FIT_SHAPES_UNFINISHED ? parts > 0 : parts >= FIT_SHAPES_PARTS && !knows;
  } while (goes_on && (!own->before || worker_is_free(own->before)));
  /* A shape that is none of these is fitted from the beginning again, and stays so until it is known. */
  const bool again =
      own->result.shape == FIT_SHAPE_UNDECIDED && !question->begins && own->report.shape == FIT_SHAPE_NONE && own->state.frames > 0;
  if (own->progress == FIT_SHAPES_ANSWERED && !again) {
    put_report(question, &own->result, &own->report);
  }
}

struct shapes_location shapes_locate(const struct shapes_report *report, const struct fit_result *fit,
                                     const struct tangential_force *force) {
  struct shapes_location place = {fit->x_mm, fit->y_mm, fit->location_sd_mm};
  if (force) {
    place = (struct shapes_location){force->x_mm, force->y_mm, force->location_sd_mm};
  }
  const bool is_pulled = report->shape == FIT_SHAPE_TANGENTIAL;
  if (report->shape == FIT_SHAPE_ROUND) {
    place.location_sd_mm *= report->chi_square_ratio;
  } else if (report->shape == FIT_SHAPE_ELONGATED || (is_pulled && !force)) {
    const float dx_mm = fabsf(fit->x_mm + report->from_fit_x_mm - place.x_mm);
    const float dy_mm = fabsf(fit->y_mm + report->from_fit_y_mm - place.y_mm);
    place.location_sd_mm = fit_quadrature(1.0f, place.location_sd_mm, 1.0f, fit_quadrature(1.0f, dx_mm, 1.0f, dy_mm));
  }
  return place;
}

uint32_t shapes_flags(const struct shapes_report *report) {
  switch (report->shape) {
  case FIT_SHAPE_ROUND:
  case FIT_SHAPE_TANGENTIAL: return CONTACT_FLAG_SHAPE_VALID;
  case FIT_SHAPE_ELONGATED: return CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE;
  case FIT_SHAPE_TWO: return CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS;
  case FIT_SHAPE_NONE: return CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_SHAPE_UNKNOWN;
  default: return 0;
  }
}
