/* What a contact result says about itself. The bits travel unchanged in the contact packet.
 *
 * A quantity may be used only under its VALID flag; where the flag is off its field is zero.
 * The warnings leave the numbers in place and say why they deserve less trust.
 */
#ifndef COMMON_CONTACT_FLAGS_H
#define COMMON_CONTACT_FLAGS_H

enum contact_flag {
  /* State */
  CONTACT_FLAG_CONTACT = 1 << 0,           /* some sensor is pressed: the gate is open */
  CONTACT_FLAG_FIT_VALID = 1 << 1,         /* x, y, p0, sigma, force and residual hold a fit */
  CONTACT_FLAG_UNCERTAINTY_VALID = 1 << 2, /* the standard deviations hold values */
  CONTACT_FLAG_SLIP_VALID = 1 << 3,        /* the slip distance spans its whole window */
  CONTACT_FLAG_SLIP = 1 << 4,              /* slip distance above the threshold */
  CONTACT_FLAG_TARED = 1 << 5,             /* readings are relative to a measured zero */
  CONTACT_FLAG_HELD = 1 << 6, /* all of the frame before: the sensors measured temperature */
  CONTACT_FLAG_WIDTHS_VALID = 1 << 7, /* the widths along the axes and their correlation */

  /* Warnings */
  CONTACT_FLAG_LOW_SIGNAL = 1 << 8, /* peak below 20 noise standard deviations */
  CONTACT_FLAG_FLAT = 1 << 9,       /* pressure without a peak: no location */
  CONTACT_FLAG_UNCERTAIN = 1 << 10, /* location_sd_mm exceeds the limit that is set */
  CONTACT_FLAG_MODEL = 1 << 11,     /* residual too large for one Gaussian */
  CONTACT_FLAG_SATURATED = 1 << 12, /* a sensor is beyond its range; it was left out */
  CONTACT_FLAG_FORCE_LOWER_BOUND = 1
                                   << 13, /* too few unsaturated sensors: force is at least this */
  CONTACT_FLAG_SENSOR_MASKED = 1 << 14,   /* a sensor is missing or was left out */
  CONTACT_FLAG_AT_BOUND = 1 << 15,        /* the fit stopped at a limit of its box */
  CONTACT_FLAG_ELONGATED = 1 << 16,       /* the contact is not round: longer along one direction */
  CONTACT_FLAG_ZERO_DOUBTFUL = 1 << 17,   /* what is pressed, or is not, cannot be told from a zero
                                             that has moved */
  CONTACT_FLAG_SENSOR_DOUBTFUL = 1 << 18, /* a sensor in use gives reason to doubt it */

  /* State, continued */
  CONTACT_FLAG_CALIBRATED = 1 << 19,       /* gains and force scale of a calibration act */
  CONTACT_FLAG_TANGENTIAL_VALID = 1 << 20, /* the tangential load has values; location, force and
                                              their standard deviations are corrected for it */
  CONTACT_FLAG_TANGENTIAL_FROM_TOUCH = 1 << 21, /* it is what changed since the first touch */
  CONTACT_FLAG_VELOCITY_VALID = 1 << 22,        /* the velocity of the contact has values */
  CONTACT_FLAG_MOVING = 1 << 23,                /* its speed is above the threshold */
  CONTACT_FLAG_SLIDING = 1 << 24, /* it moves, however slowly, beyond what the load explains */
};

#endif
