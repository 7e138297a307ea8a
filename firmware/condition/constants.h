/* The constants of the condition: meaning, unit, source. "Strips": the recordings of real strips of barometers under rubber, which
 * host_tools/report/real judges. "Choice": any value near it gives the same. ZERO.md lists what half and twice of them changes. */
#pragma once

#include "condition/fixed.h"

/* Time. */
#define UPDATE_ms 64      /* between two updates of a sensor; choice, a seventh and less of its time constants, but for REMAINDER_DOWN_ms */
#define STEP_MAX_ms 16383 /* a longer gap counts as this; range of the products */
#define AGE_MAX_ms ((uint32_t)SECONDS(86400)) /* an age stops there; range */
#define SLOW_ms SECONDS(1)                    /* low pass of the readings; choice */

/* Range. */
#define PRESSURE_MAX (INT32_C(1) << 29) /* 1/1024 Pa, 0.5 MPa: most that is multiplied by a share */
#define BASELINE_MAX (INT32_C(1) << 30) /* 1/1024 Pa, 1 MPa: the part ends near 0.5 MPa */
#define SUM_RANGE (INT32_C(1) << 23)    /* 1/1024 Pa, 8 kPa: a reading in a mean, so that 255 of them fit */

/* Gate: opens above OPEN, closes below CLOSE, each plus SIGMA standard deviations of the noise. */
#define GATE_OPEN_Pa 132   /* temperature: 60 Pa of compensation step, 24 to 48 Pa of lag (data sheet) */
#define GATE_OPEN_SIGMA 6  /* choice */
#define GATE_CLOSE_Pa 90   /* below OPEN, so that it does not flicker */
#define GATE_CLOSE_SIGMA 4 /* choice */

/* Tare. */
#define ZERO_TARE_FRAMES 16                  /* readings of a tare, 0.08 s at 206 frames/s; choice */
#define TARE_FEWEST 3                        /* readings, if they took TARE_SLOW_ms: one is left without the extremes */
#define TARE_SLOW_ms SECONDS(1)              /* so at rates below 16 Hz */
#define TARE_WAITS_ms ((uint32_t)SECONDS(8)) /* for a contact of others to end: wrong zeros may make that contact */
#define FOUND_OUT_ms ((uint32_t)SECONDS(5))  /* a lost state or a wrong temperature shows within it (readings.h) */
#define ZERO_COLD_Pa 350                     /* spread after power-up; strips: twice 0.16 kPa of rise */
#define ZERO_WARM_Pa 60                      /* spread of a sensor that was steady before; choice */

/* Settling of the baseline. */
#define SETTLE_ms MS(500)                         /* time constant of the spread; choice */
#define SETTLE_LONGEST_ms ((uint32_t)SECONDS(15)) /* a sensor that creeps counts as settled then; choice */
#define SETTLED_Pa 8                              /* and a sigma: a smaller spread is none */
#define SETTLE_SLOW 3                             /* times what the reading moves in a second: the spread's goal; choice */

/* Following. */
#define SLEW_SHIFT 1                               /* 0.5 Pa/s; strips at rest: 130 to 210 Pa in 16 min, 0.22 Pa/s at most */
#define FOLLOW_ms SECONDS(2)                       /* time constant of the baseline; choice */
#define KEEP_DOWN_SHIFT 2                          /* a quarter of a remainder downward: what dipped comes back */
#define DRIFT_GOES_ON_ms ((uint32_t)SECONDS(3600)) /* the drift before a contact holds in it for an hour; choice */
#define STILL_SIGMA 3                              /* a rise of 3 sigma between two updates is no remainder's */
#define FALL_SHIFT 2                               /* nor a fall by a quarter of the pressure */

/* Below the zero: the baseline was taken under a press. */
#define ZERO_BELOW_s 10                /* strips: dips come back within it */
#define BELOW_ms SECONDS(ZERO_BELOW_s) /* the same */
#define FAR_BELOW_Pa 1000              /* farther below no wait is needed; choice */
#define FAR_BELOW_ms MS(500)           /* but this; choice */
#define BULGE_SHIFT 3                  /* an eighth of a press: what is less may be rubber that bulged beside it; defaults.h: 1.5 % */

/* What rubber keeps of a press (strips: 0.4 to 13 % above, 1 to 15 % below, for 0.5 to 20 s). */
#define MEMORY_ms SECONDS(20)  /* time constant of the memory */
#define SATURATED_Pa 100000    /* counts for a press beyond the range of a sensor */
#define BESIDE_SHIFT 7         /* 0.8 kPa: what the sensor beside it measures at least, at a width of a third of the pitch */
#define BAND_SHIFT 3           /* an eighth of the memory may remain; ZERO.md: a sixteenth and a quarter fail */
#define DIP_SHIFT 2            /* a quarter may be missing */
#define REOPEN_SHIFT 4         /* a sixteenth: what a sudden press must exceed after FRESH_ms */
#define HOLD_ms SECONDS(3)     /* time constant of a hold's own part; strips: 1 to 4 s */
#define RELEASED_ms SECONDS(2) /* of what is released, and so of what is retained; strips: the middle of 1 to 4 s */
#define HYSTERESIS_SD 1311     /* 2 % is the sd until releases show it; the twin's after-effect: 2.3 % rms */
#define HYSTERESIS_MIN 328     /* 0.5 %: releases may hide it (pads 21 to 24, gains alone) */
#define HYSTERESIS_MAX 16384   /* a quarter; range */
#define HYSTERESIS_FORCE 3277  /* a twentieth: twice the sd that it shows is the band of all, an eighth */
#define HYSTERESIS_SHOWS_ms ((uint32_t)MS(200)) /* after a contact; the remainder follows in 100 ms */
#define HYSTERESIS_LEAST_Pa 1000                /* less shows nothing beside noise and drift */
#define HYSTERESIS_HIDES_Pa 32                  /* of more the zero has too much for a sensor to rest there; choice */
#define LEARN_SHIFT 2                           /* a quarter of what each release shows; choice */
#define RETAINED_LEARNT_MOST 16                 /* releases in the mean of what a sensor retains; twin, seeds 101 to 104 */
#define UNSURE_SHIFT 2                          /* a quarter of what it retains is unsure: it fades in unlike times */
#define CROSS_SHIFT 2                           /* all but a quarter of the strongest memory counts for all; strips, ZERO.md */
#define FRESH_ms ((uint32_t)SECONDS(2))         /* after a contact: a remainder may rise */
#define REMAINDER_ms MS(700)                    /* time constant of a remainder; strips: 0.5 s at least */
#define REMAINDER_DOWN_ms MS(100)               /* the same when a force goes at last */
#define KEEP_SHIFT 8                            /* 1/256 of the memory in a second: the baseline takes over the remainder, */
#define CREEP_SHIFT 10                          /* 1/1024: what the remainder does not follow, */
#define DRIFTED_SHIFT 3                         /* and an eighth of what may have drifted */
#define DRIFT_SHIFT 2                           /* 0.24 Pa/s: drift of a contact; strips: 0.22 Pa/s */
#define DRIFT_MAX_Pa 900                        /* of that in an hour */
#define DRIFTED_ms SECONDS(8)                   /* time constant with which it fades after the contact; choice */

/* Doubt: a force and a zero that has moved look alike. */
#define WANDER_ms SECONDS(120) /* without evidence a doubt fades in minutes; choice */
#define RETURN_MAX_Pa 1000     /* counted of a dip that may come back; choice */
#define CREEPING_SHIFT 4       /* 16 Pa/s: a slower rise may be a drift; strips crept by 2 kPa in minutes */
#define CREPT_MAX_Pa 2500      /* of those 2 kPa and a quarter */
#define TAKEN_FACTOR 3         /* a contact of 3 times what its zeros took is off by a third; at 4 a strip fails */

/* Drift in idle time: the baseline's, from snapshots. */
#define SNAPSHOTS 8                                   /* of the baseline; after the eighth every other one goes */
#define SNAPSHOT_ms ((uint32_t)SECONDS(4))            /* interval, at first */
#define SNAPSHOT_LONGEST_ms ((uint32_t)SECONDS(64))   /* at last: 8 of them span 512 s */
#define IDLE_AFTER_TARE_ms ((uint32_t)SECONDS(3))     /* begin of idle time after a tare, */
#define IDLE_AFTER_RELEASE_ms ((uint32_t)SECONDS(60)) /* and after a contact: what rubber keeps goes slowly */
#define IDLE_LAG_Pa 2                                 /* and half a sigma: most that an idle reading is above the baseline */
#define DRIFT_LEAST_s 8                               /* shorter times show no drift */
#define DRIFT_LONGEST_s 512                           /* longer ones count as this; range of the products */
#define DRIFT_CHANGE_MAX_Pa 300                       /* of the baseline in idle time; range: 0.5 Pa/s for 512 s is less */
#define DRIFT_FASTEST_q12 1280                        /* 0.31 Pa/s: at more the baseline is too slow to know the drift after a minute */
#define DRIFT_SD_mPa_s 250                            /* standard deviation of drifts; strips: 0.22 Pa/s at most */
#define BASELINE_SD_mPa 1000                          /* of a change of the baseline between two snapshots */
