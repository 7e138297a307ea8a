/* When a result deserves a warning; both kernels judge by the same limits. */
#ifndef FIT_FIT_LIMITS_H
#define FIT_FIT_LIMITS_H

#define FIT_SETTLED_mm 0.02f      /* a larger last step has not settled */
#define FIT_UNCERTAIN_SD_mm 0.25f /* predicted radial standard deviation */
#define FIT_MODEL_RESIDUAL 0.15f  /* of the root of the sum of squared readings */
#define FIT_FLAT_SIGMA 4.9f       /* pitches */
#define FIT_LOW_SIGNAL_SIGMA 20   /* noise standard deviations in the largest reading */
#define FIT_HUGE 1e9f             /* stands for: nothing is known */

#endif
