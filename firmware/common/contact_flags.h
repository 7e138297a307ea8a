/* written by firmware/wire/line.py from line.toml; change it there.
 *
 * What a contact result reports about itself. The bits travel unchanged in the contact packet.
 *
 * A quantity may be used only under its VALID flag; where the flag is off its field is zero.
 * The warnings leave the numbers in place and state why they deserve less trust.
 */
#pragma once

enum contact_flag {
  CONTACT_FLAG_CONTACT = 1 << 0, /* a sensor is pressed */
  CONTACT_FLAG_FIT_VALID = 1 << 1, /* x, y, p0, sigma, force and residual hold a fit */
  /* the standard deviations of location and force have values */
  CONTACT_FLAG_UNCERTAINTY_VALID = 1 << 2,
  CONTACT_FLAG_SLIP_VALID = 1 << 3, /* the slip distance spans its whole window */
  CONTACT_FLAG_SLIP = 1 << 4, /* the slip distance is above the threshold */
  CONTACT_FLAG_TARED = 1 << 5, /* readings are relative to a measured zero */
  /* all values are those of the frame before: the sensors measured their temperature */
  CONTACT_FLAG_HELD = 1 << 6,
  /* the widths along the axes and their correlation have values */
  CONTACT_FLAG_WIDTHS_VALID = 1 << 7,
  /* warning: the peak is below 20 standard deviations of the noise */
  CONTACT_FLAG_LOW_SIGNAL = 1 << 8,
  CONTACT_FLAG_FLAT = 1 << 9, /* warning: there is pressure without a peak: no location */
  CONTACT_FLAG_UNCERTAIN = 1 << 10, /* warning: location_sd_mm is above the limit that is set */
  CONTACT_FLAG_MODEL = 1 << 11, /* warning: the residual is too large for one Gaussian */
  CONTACT_FLAG_SATURATED = 1 << 12, /* warning: a sensor is beyond its range and was left out */
  /* warning: too few sensors are in their range: the force is at least this */
  CONTACT_FLAG_FORCE_LOWER_BOUND = 1 << 13,
  CONTACT_FLAG_SENSOR_MASKED = 1 << 14, /* warning: a sensor is missing or was left out */
  CONTACT_FLAG_AT_BOUND = 1 << 15, /* warning: the fit stopped at a limit */
  CONTACT_FLAG_ELONGATED = 1 << 16, /* warning: the contact is not round */
  /* warning: the pressure may be a force or a zero that has moved */
  CONTACT_FLAG_ZERO_DOUBTFUL = 1 << 17,
  CONTACT_FLAG_SENSOR_DOUBTFUL = 1 << 18, /* warning: a sensor in use gives reason to doubt it */
  CONTACT_FLAG_CALIBRATED = 1 << 19, /* gains and force scale of a calibration are applied */
  /* the tangential force has values; location and force are corrected for it */
  CONTACT_FLAG_TANGENTIAL_VALID = 1 << 20,
  /* the tangential force is the change since the first touch */
  CONTACT_FLAG_TANGENTIAL_FROM_TOUCH = 1 << 21,
  CONTACT_FLAG_VELOCITY_VALID = 1 << 22, /* the velocity of the contact has values */
  CONTACT_FLAG_MOVING = 1 << 23, /* the speed of the contact is above the threshold */
  /* the contact moves beyond what the tangential force explains, however slowly */
  CONTACT_FLAG_SLIDING = 1 << 24,
  /* warning: the second processor did not estimate the tangential force in time: location and
   * force are not corrected for it */
  CONTACT_FLAG_TANGENTIAL_LATE = 1 << 25,
  /* the contact shape is known: one contact, unless one of the three below is set */
  CONTACT_FLAG_SHAPE_VALID = 1 << 26,
  /* warning: two contacts press, and each has a place and a force: x_mm and y_mm are the place
   * of neither */
  CONTACT_FLAG_TWO_CONTACTS = 1 << 27,
  /* one long contact presses, and its direction and length have values */
  CONTACT_FLAG_EDGE = 1 << 28,
  /* warning: the contact shape is neither one contact nor a long one nor two */
  CONTACT_FLAG_SHAPE_UNKNOWN = 1 << 29,
};
