/* Internal to the fixed-point kernels: what they share. Pitches are the unit of length, readings have the grid's order
 * [column][row], node numbers count from node (COLUMNS / 2, ROWS / 2). */
#pragma once

#include "fit/fit.h"
#include "fit/fit_fixed.h"
#include "fit/fit_math.h"

#include <stdbool.h>
#include <stdint.h>

/* The rectangle, and its largest size; with FIT_GRID_ANY each thread has its own (fit_types.h). */
#ifdef FIT_GRID_ANY
extern _Thread_local int fit_grid_columns, fit_grid_rows;
#define COLUMNS fit_grid_columns
#define ROWS fit_grid_rows
#define MAX_COLUMNS FIT_GRID_MAX_SIDE
#define MAX_ROWS FIT_GRID_MAX_SIDE
#define MAX_SIDE FIT_GRID_MAX_SIDE
static inline void fit_use_rectangle(const struct fit_grid_shape *grid) {
  COLUMNS = grid->columns;
  ROWS = grid->rows;
}
#else
#define COLUMNS FIT_GRID_COLUMNS
#define ROWS FIT_GRID_ROWS
#define MAX_COLUMNS COLUMNS
#define MAX_ROWS ROWS
#define MAX_SIDE (MAX_COLUMNS > MAX_ROWS ? MAX_COLUMNS : MAX_ROWS)
#define fit_use_rectangle(grid) ((void)(grid))
#endif
#define NODES (COLUMNS * ROWS)
#define MAX_NODES FIT_GRID_MAX_NODES
/* The two sums whose quotient is the amplitude have this many bits less, to stay within 32. */
#define PRODUCT_SHIFT (NODES > 31 ? 1 : 0)
#define ONE_Q26 (1 << 26)
#define NOINLINE __attribute__((noinline))

/* Exponent of the Gaussian: g = 2^(-curvature (k - centre)^2), curvature = log2(e) / (2 sigma^2). */
#define CURVATURE_MIN_Q26 1936353                      /* sigma 5 pitches */
#define CURVATURE_MAX_Q26 (16 * ONE_Q26 - ONE_Q26 / 2) /* sigma 0.2157 pitch */
#define LOG2E_HALF_Q26 48408813

#define LOG2E_HALF ((struct scaled){23637, -15})
#define ONE ((struct scaled){1 << 14, -14})

/* The pressures of one frame in grid order [column][row], the largest from 0.5 to 1; where there is
 * a dip, half of that, so that there is room for what it takes. */
struct readings {
  int32_t shift;   /* Q28 = 1/1024 Pa times 2^shift */
  int32_t largest; /* 1/1024 Pa */
  int32_t largest_q28;
  struct scaled prior_sigma, prior_weight; /* pitches, per pitch; weight 0: none */
  struct scaled prior_sd;                  /* of its row, in units of q28 */
  struct scaled dip_share;                 /* 0: none */
  int32_t dip_curvature;                   /* Q26, of the dip's Gaussian */
  int32_t q28[MAX_NODES], q14[MAX_NODES];
  int32_t residual[MAX_NODES]; /* working memory of the kernel */
};

struct state {
  int32_t x, y;      /* Q26, pitches from the grid's origin node */
  int32_t curvature; /* Q26 */
};

/* 2^-z, z in Q22, result Q30; relative error below 2^-25. */
FIXED_INLINE int32_t exp2_negative(uint32_t z_q22) {
  uint32_t whole = z_q22 >> 22;
  if (whole > 29) {
    return 0;
  }
  uint32_t head = (uint32_t)fit_exp2_table[(z_q22 >> 14) & 255];
  uint32_t rest = z_q22 & 0x3FFF;
  uint32_t minus = rest * (45426 - ((rest * 15743) >> 22)); /* 1 - 2^-rest, Q38 */
  minus = (minus + (1 << 13)) >> 14;                        /* Q24 */
  uint32_t loss = (head >> 16) * minus + (((uint16_t)head * minus) >> 16);
  return (int32_t)((head - (loss >> 8)) >> whole);
}

/* The same within 0.3 %. */
FIXED_INLINE int32_t exp2_rough(uint32_t z_q22) {
  uint32_t whole = z_q22 >> 22;
  return whole > 29 ? 0 : fit_exp2_table[(z_q22 >> 14) & 255] >> whole;
}

/* The exponent of the Gaussian along an axis, Q22, relative to the node nearest to its centre: k (curvature k - slope) with k counted from
 * there, by its differences. It is exactly a parabola, so the rounding of the two coefficients moves centre and width and cannot show in
 * the residual. The 2 more than makes up for both roundings, so it is never negative. */
struct fit_exponent {
  uint32_t value, difference, curvature;
};
/* That of the first node. offset: of the centre from the nearest node, Q26. */
FIXED_INLINE struct fit_exponent fit_exponent_first(int nodes, int origin, int32_t centre, int32_t curvature, int32_t *offset) {
  int32_t nearest = fixed_clamp((centre + (ONE_Q26 >> 1)) >> 26, -origin, nodes - 1 - origin);
  *offset = centre - nearest * ONE_Q26;
  int32_t slope = fixed_mul_q32(curvature, *offset * 8); /* Q22 */
  int32_t curvature_q22 = (curvature >> 4) + 2;
  int32_t k = -origin - nearest;
  return (struct fit_exponent){(uint32_t)k * (uint32_t)(curvature_q22 * k - slope), (uint32_t)(curvature_q22 * (2 * k + 1) - slope),
                               (uint32_t)curvature_q22};
}
FIXED_INLINE void fit_exponent_next(struct fit_exponent *exponent) {
  exponent->value += exponent->difference;
  exponent->difference += 2 * exponent->curvature;
}

/* log2(v / 2^14) in Q15, v = 1 .. 2^14; error below 2^-11. */
FIXED_INLINE int32_t log2_q15(int32_t value) {
  int32_t whole = fixed_bits((uint32_t)value) - 1;
  int32_t position = value * (1 << (22 - whole)); /* 2^22 .. 2^23 */
  int32_t index = (position >> 16) & 63;
  int32_t low = fit_log2_table[index], high = fit_log2_table[index + 1];
  return (whole - 14) * (1 << 15) + low + (((high - low) * (position & 0xFFFF)) >> 16);
}

/* The functions of these names in fit_fixed.h, not inlined: for what is done once a result, where flash counts more than a call. */
uint64_t fit_packed_from(int32_t value, int32_t exponent);
uint64_t fit_packed_sqrt(struct scaled a);
FIXED_INLINE struct scaled fit_scaled_from(int32_t value, int32_t exponent) { return scaled_unpack(fit_packed_from(value, exponent)); }
FIXED_INLINE struct scaled fit_scaled_short(struct scaled a) { return fit_scaled_from(a.mantissa, a.exponent); }
FIXED_INLINE struct scaled fit_scaled_sqrt(struct scaled a) { return scaled_unpack(fit_packed_sqrt(a)); }
int32_t fit_scaled_to_fixed(struct scaled a, int32_t q);
FIXED_INLINE float fit_scaled_float(struct scaled a) { return fit_float(a.mantissa, a.exponent); }

/* usable: bitmap of the sensors, of which those left out read 0. False: nothing positive. */
bool fit_grid_take_readings(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                            const struct fit_settings *settings, struct readings *readings);

/* The dip's Gaussian, a product as the contact's is: its factors at the nodes, Q30. */
struct dip {
  int32_t x[MAX_COLUMNS], y[MAX_ROWS];
};
/* Sets the factors about this contact, whose model is amplitude 2^rise at the centre, and returns the dip's depth
 * there, at most most_q28. curvature: of the dip's Gaussian, Q26; share: its depth, of the contact's. */
int32_t fit_grid_dip(int32_t curvature, struct scaled share, const struct state *at, int32_t amplitude_q28, int32_t rise_q22,
                     int32_t most_q28, struct dip *dip);

/* Adds the dip to the readings of a full rectangle. */
void fit_grid_remove_dip(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct state *at, int32_t amplitude_q28,
                         int32_t rise_q22, struct readings *readings);

/* The model at the centre, where it is amplitude 2^rise: at most most_q28. */
int32_t fit_grid_peak(int32_t amplitude_q28, int32_t rise_q22, struct scaled share, int32_t most_q28);

/* Corrects the readings of the usable sensors by their deviations (fit_settings), about a contact of this peak. */
#define FIT_DEVIATION_PEAK_MAX_Q28 (1 << 30)
void fit_grid_remove_deviations(const struct fit_array *array, const struct fit_settings *settings, sensor_map usable,
                                const struct state *at, int32_t peak_q28, struct readings *readings);

/* The errors of the readings of the sensors in use, units of Q22: base of one of weight 1, by the noise, held to noise_most, and a share
 * model_sd_q16 of the largest reading. The weights of the others are 0. Returns how many are in use. */
struct fit_base {
  int32_t noise_q22, base_q22;
  int32_t squares_q12; /* sum of those of the weights */
};
int fit_grid_weigh(const struct fit_array *array, const struct fit_settings *settings, sensor_map used, const struct readings *readings,
                   int32_t noise_most, int32_t model_sd_q16, int32_t *weight_q12, struct fit_base *base);

/* Sum of the readings, Q20. Of those that are a contact's the largest is 0.5 to 1, and the sum FIT_SUM_MIN_Q20 and more. */
int32_t fit_grid_sum_q20(const int32_t *q28);
#define FIT_SUM_MIN_Q20 (1 << 18)

/* Whether a sum after another is that of another contact: less than a contact has, or four times as much, or a quarter. */
FIXED_INLINE bool fit_is_another_contact(int32_t sum_q20, int32_t before_q20) {
  return sum_q20 < FIT_SUM_MIN_Q20 || before_q20 < FIT_SUM_MIN_Q20 || sum_q20 >> 2 >= before_q20 || before_q20 >> 2 >= sum_q20;
}

/* Readings below zero as they are, where fit_grid_take_readings took them as zero. */
void fit_grid_restore_negative(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, struct readings *readings);

/* Sums over the rows to the end, of FIT_PRODUCTS + 1 each: the products of element a with the three after it in turn, and with the last. */
#define FIT_PRODUCTS 7
extern void (*const fit_sum_products[FIT_PRODUCTS])(const int32_t *row, const int32_t *end, int32_t *sums);

/* value >= 0 and finite. */
uint64_t fit_packed_float(float value);
FIXED_INLINE struct scaled fit_grid_scaled(float value) { return scaled_unpack(fit_packed_float(value)); }

/* sigma in Q26 pitches. */
int32_t fit_grid_sigma(int32_t curvature);
