/* What the fingertip reports about the contact shape: one contact, a long one, or two, as fit_shapes.h
 * distinguishes them, in the scales of the pad. */
#pragma once

#include "contact/tangential.h"
#include "fit/fit_shapes.h"

#include <stdbool.h>
#include <stdint.h>

/* All zeros: nothing yet. A quantity that the shape does not have is zero. */
struct shapes_report {
  enum fit_shape shape;
  uint64_t t_us;          /* of the frame that it is of */
  struct shapes_contact { /* of two, the stronger one first */
    float x_mm, y_mm, location_sd_mm;
    float force_N, force_sd_N; /* scaled, the scale's standard deviation in the second */
  } contact[2];
  float edge_angle_deg, edge_angle_sd_deg; /* -90 to 90, from x towards y */
  float edge_length_mm;
  float chi_square_ratio;             /* ROUND: chi^2 over FIT_SHAPES_ERRORS, at least 1 */
  float from_fit_x_mm, from_fit_y_mm; /* pulled or long: the middle, from the Gaussian's place in
                                         the same frame */
};

/* The fit of the contact shape: a job of worker/worker.h. It holds all that the fit reads, so that the
 * frames that follow leave it alone. */
struct shapes_job {
  const struct fit_array *array;
  const struct worker *before; /* its question ends this job after the part under way; NULL: none does */
  struct fit_shapes_pad pad;
  struct shapes_question {
    bool begins;   /* a contact: forget the one before */
    uint8_t parts; /* to do at most, of those of fit_shapes_part() */
    uint64_t t_us;
    int32_t pressure_Pa_q10[FT_MAX_SENSORS];
    struct fit_settings settings; /* with the pad's dip */
    struct fit_result fit;        /* of the same readings */
    float force_scale, force_scale_sd;
  } question;
  enum fit_shapes_progress progress; /* UNFINISHED: ask the same again */
  struct shapes_report report;       /* the answer, once ANSWERED */
  struct fit_shapes_state state;
  struct fit_shapes_result result;
};

/* A part takes a Cortex-M0+ at 125 MHz this time at most (test emulated.fit_cycles). Where one is
 * under way, the worker's other job may wait for it. */
#define SHAPES_PART_us 350u

/* Parts for frames so far apart: one, or as many as there is time for beside the tangential job, from a
 * whole frame to all that the first answer takes. */
uint8_t shapes_parts(uint64_t apart_us);

/* Answers the question of a struct shapes_job. */
void shapes_estimate(void *job);

/* The one place of a contact. */
struct shapes_location {
  float x_mm, y_mm, location_sd_mm;
};

/* The location to report: that of the tangential estimate, or the Gaussian's where there is none (force NULL). But neither knows a length,
 * nor the Gaussian a tangential force. So of a long contact, and of a pulled one without an estimate, what lies between that location and
 * the middle that the shape has is part of the standard deviation. It is not the place: rubber that remembers makes a round object look
 * long or pulled, with its middle further off. The standard deviation of a round contact grows where its shape leaves residuals. */
struct shapes_location shapes_locate(const struct shapes_report *report, const struct fit_result *fit,
                                     const struct tangential_force *force);

/* The flags that the report adds to those of a contact. */
uint32_t shapes_flags(const struct shapes_report *report);
