/* Inside the fixed-point kernels alone: how an error of each reading moves the result. Errors that
 * are the same for every sensor, as the noise, need no more than the norms of the columns
 * (fit_grid_conclude); those of the gains are each sensor's own, and the model's own error has a
 * shape. So the kernel hands over the sensors one by one. fit_limits.h lists the errors.
 */
#ifndef FIT_FIT_GRID_SPREAD_H
#define FIT_FIT_GRID_SPREAD_H

#include "fit/fit_grid_solve.h"

/* Of the columns p1, p2, p3 of struct fit_system, times e: value = integer * 2^-q. */
struct fit_columns_q {
  int32_t q1, q2, q3;
};

struct fit_spread {
  /* How far one unit of a column moves x and y (pitches, times 2^(location_exponent - 15)) and the
   * force (its share times sigma^2, times 2^(force_exponent - 15)), if the readings' unit is that
   * of Q28. */
  int32_t x1, x2, x3, y2, y3, location_exponent;
  int32_t f0, f1, f2, f3, force_exponent;
  struct scaled inverse_mass, inverse1, inverse2, inverse3; /* of the norms, of all four columns */
  struct scaled amplitude, softness;                        /* the latter 1 / stiffness */
  /* dF / F is that of e, p1, p2 and p3 times 1, off_x, off_y (Q26) and lift_q24. */
  int32_t off_x, off_y, lift_q24;
  int32_t gain_shift;  /* gains Q16 are used with this number of bits more */
  int32_t shape_shift; /* the model error's shape in Q(21 - shape_shift) */
  /* Sums over the sensors. */
  uint32_t gains;    /* of the squared errors of the readings */
  uint32_t by_gains; /* of the squares of what they make of x and y */
  uint32_t force_by_gains;
  struct scaled location_variance, force_variance; /* of all of this, once it is concluded */
  struct scaled apart;                   /* square of how far another shape of the contact would move it, pitches */
  int32_t shape_x, shape_y, shape_force; /* what the model error's shape makes of these */
};

/* The square of a number of 15 bits, so that those of all sensors and of two coordinates add up. */
#define SPREAD_SQUARE_SHIFT (NODES > 15 ? 6 : 5)

#define FIT_DIP_ERROR_Q16 ((int32_t)(FIT_DIP_ERROR * 65536.0f))

/* The columns have at most 1.5 * 2^15. */
void fit_grid_begin_spread(const struct fit_settings *settings, const struct fit_system *system,
                           const struct fit_columns_q *columns, struct fit_spread *spread);

/* The variances that the sums make: pitches squared, share of the force squared. */
void fit_grid_end_spread(const struct fit_settings *settings, const struct fit_system *system,
                         struct fit_spread *spread);

/* The readings' room is used for what each sensor does, in the order of the nodes. In: its e (Q15)
 * in q28. Out: the error that its gain makes of its reading in q14, the share of the amplitude
 * times 2^(16 + gain_shift); the model error's shape in residual; both of 15 bits. */
void fit_grid_set_errors(const struct fit_grid_shape *grid, const struct fit_settings *settings, const struct state *at,
                         struct readings *room, struct fit_spread *spread);

/* By how much a unit of each reading moves something, 15 bits, in q28: adds what the errors do. */
void fit_grid_add_moves(const struct readings *room, uint32_t *by_gains, int32_t *by_shape);

/* Values of up to 15 bits in one unit, the largest of 13 bits. Returns the exponent of that unit.
 */
int32_t fit_grid_align(const struct scaled *values, int count, int32_t *aligned);

#endif
