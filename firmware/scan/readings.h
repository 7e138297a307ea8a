/* From codes to readings, and which of them to believe. Main context; no bus, and no time but the frame's.
 *
 * Temperatures. A value follows each sensor's, no faster than a pad warms (warmed_cC). A temperature that is READINGS_MOVED_cC from it is
 * not used, so that a supply that sags slowly is found as well. The last one stays in use, the sensor is doubtful, and the next one is
 * asked for at once: each degree is worth some 240 Pa. Two of them that agree come from a sensor that has lost its state, whatever the
 * others do. So does one after a jolt (see Moves). The sensor becomes a suspect. The first
 * temperature of a sensor must be near the others', but after a reset near its own last: it may have lost its state
 * again, and so may most others (supplies that dip once do so twice). If resets do not help for a second, and it reports
 * the same twice, it is believed. Far from the others' it stays doubtful.
 *
 * Moves. A sensor whose supply dips may go on with codes that are off, at once or ever more: 1 % of a code is 2.6 kPa
 * and 2.7 degC. So only a temperature vouches for pressures that have moved. It is asked for once all sensors together have moved by
 * half of READINGS_MOVED_Pa since the last one. If it comes too late, they are used, but all of them are doubtful until it comes. So they
 * are when one of them moves by READINGS_JOLT_Pa_q10 at once, or has lost its admission. While a temperature moves by half of
 * READINGS_MOVED_cC the doubt lasts. A code that is that of the frame before is no other reading, and as doubtful as it was there. Codes
 * that are off while the temperature's are right look like a force: only the fit's residual shows them.
 *
 * Pressures. A pressure below zero is left out. A second in a row makes the sensor a suspect. A large step of one
 * sensor alone is left out as well, since rubber passes any press on to its neighbours. If the next reading is back,
 * that was all. A second in a row makes the sensor a suspect. Steps beside which others move count at once. So
 * does every step while a sensor is missing, since that one may have measured it.
 *
 * A suspect is left out until it has been reset and its PROM read again. Then its temperature and its pressure count as its first. Its zero
 * still holds, since it is the same sensor, unless it was measured shortly before (condition.h). The same holds for a sensor whose pressure
 * has stepped alone, for example when it was reset for another's sake, or when it returns.
 *
 * A sensor whose temperature is apart from the others' (common/apart.h) since it came is doubtful until it has read
 * like them twice in a row: its PROM may be wrong in spite of its CRC.
 *
 * A sensor whose PROM has a wrong CRC is used, since one genuine part is known to have one. It is doubtful. It must
 * first have read like the others at two temperatures in a row, where there are three to compare with. */
#pragma once

#include "common/limits.h"
#include "frame/frame.h"
#include "ms58xx/ms58xx.h"

#include <stdbool.h>
#include <stdint.h>

/* Two temperatures of a sensor that has lost its state, or those before and after its reset: it warms by less meanwhile. */
#define READINGS_TEMPERATURE_SAME_cC 100
/* Sensors of one pad at rest: two parts of +-2 degC, and a warm object at one end. Further off,
 * a temperature must agree with a second one, no more. */
#define READINGS_TEMPERATURE_NEAR_cC 500
#define READINGS_TEMPERATURE_APART_cC 50
/* Of one sensor, from one reading to the next. */
#define READINGS_STEP_Pa_q10 (MS58XX_STEP_Pa * 1024)
/* All others have moved by less: this factor times the noise of a reading (two of them differ by 1.4 of it rms), or
 * such a part of the step. Of 785 steps beyond 8 kPa that taps of a sphere of 6 mm make from one frame to the next at
 * 20 and 57 frames/s in a simulated pad of 6 mm with a pitch of 9 mm, up to 6 mm outside the array, the loneliest moves
 * a neighbour by 64 Pa and 1/160; on 12 mm by 3.1 kPa and a quarter. At 410 frames/s and more none is so fast. */
#define READINGS_STILL_NOISES 6
/* Codes that are 3 % off make 8 kPa. */
#define READINGS_JOLT_Pa_q10 (MS58XX_STEP_Pa * 768)
/* Less is no change of the force by a tenth, or of the place by 0.6 mm, in a press of 5 N. */
#define READINGS_MOVED_Pa (MS58XX_STEP_Pa / 2)
/* Codes that are 0.1 % off make that, and 240 Pa. It is twenty times the noise of a temperature at OSR 256. */
#define READINGS_MOVED_cC 25
/* From one temperature to the next that a move asks for, on the average: each takes the place of a frame. After a rest four may follow
 * each other, since a press that begins moves by READINGS_MOVED_Pa every few frames. It is asked for three frames early: one runs by
 * then, the next is its own, and the main context may be late by one. */
#define READINGS_MOVED_FRAMES 32
#define READINGS_FRAMES_MAX (4 * READINGS_MOVED_FRAMES)
#define READINGS_ASK_FRAMES (READINGS_MOVED_FRAMES - 3)
#define READINGS_ALONE 256
#define READINGS_APART_Pa_q10 (FT_APART_MAX_Pa * 1024)

struct readings {
  bool presses_are_shared; /* see scan_settings */
  uint8_t newest;
  int16_t temperature_cC; /* mean of the last that were used */
  uint8_t doubts_in_a_row;
  sensor_map has_thermal; /* bitmap */
  sensor_map renewed;     /* bitmap: another sensor since the last frame */
  sensor_map restored;    /* bitmap: since the last frame, as in frame.h */
  sensor_map doubted;     /* bitmap: the last temperature was not used */
  sensor_map strange;     /* bitmap: a temperature that is not near the others' is in use */
  sensor_map unproven;    /* bitmap: the PROM's CRC differs and the sensor has not read like others */
  sensor_map was_near;    /* bitmap: an unproven one did, at the last temperature */
  sensor_map doubtful;    /* bitmap: used, and to be flagged */
  sensor_map has_last;    /* bitmap: last_Pa_q10 holds a reading, of before it lost its state */
  sensor_map counted;     /* bitmap: and was in the last frame */
  sensor_map awaited;     /* bitmap: last_Pa_q10 is of before a reset */
  uint32_t last_sum;      /* of the pressures of the last frame, modulo 2^32 */
  sensor_map still;       /* bitmap: the code is that of the frame before. Set by the caller */
  bool jolted;            /* at once: set by the caller, too */
  bool moved;             /* all are doubtful until their temperature shows that they kept their state */
  bool asks;              /* the next temperature is wanted at once */
  uint8_t frames;         /* not used up by temperatures, READINGS_MOVED_FRAMES each */
  sensor_map was_low;     /* bitmap: the last pressure was below zero */
  sensor_map alone;       /* bitmap of one sensor: its last pressure stepped alone */
  sensor_map suspects;    /* bitmap: want a reset */
  sensor_map known;       /* bitmap: had a temperature, and has been there since */
  sensor_map pardoned;    /* bitmap: resets have not helped */
  uint32_t left_out;      /* since start: pressures below zero or that stepped alone */
  sensor_map alike;       /* bitmap: has read the others' temperature since it came */
  sensor_map was_alike;   /* bitmap: at the last temperature */
  sensor_map apart;       /* bitmap: see readings_doubt() */
  struct ms58xx_thermal thermal[FT_MAX_SENSORS];
  int32_t doubted_cC[FT_MAX_SENSORS];     /* [sensor] the temperature that was not used */
  int32_t steady_cC[FT_MAX_SENSORS];      /* [sensor] follows its temperature, as fast as a pad warms */
  int32_t vouched_Pa_q10[FT_MAX_SENSORS]; /* [sensor] the last that counted when the last temperature came */
  int32_t last_Pa_q10[2][FT_MAX_SENSORS]; /* [newest][sensor] the last that counted */
};

/* What a conversion of the temperature brought. */
struct readings_temperature {
  const struct ms58xx_prom *prom; /* [sensor] */
  const uint32_t *code;           /* [sensor] */
  sensor_map good;                /* bitmap: the code is a measurement */
  sensor_map prom_changed;        /* bitmap: another sensor than before */
  sensor_map returned;            /* bitmap: was reset, perhaps after long */
  sensor_map prom_bad;            /* bitmap: the CRC differs */
  sensor_map admitted;            /* bitmap */
  int32_t warmed_cC;              /* most by which a pad warms in the time since the one before */
  bool is_soon;                   /* after the one before: nothing was away for long */
  bool is_patient;                /* resets have not helped for a second */
};

enum readings_news {
  READINGS_MOVED = 1,     /* the temperature changes */
  READINGS_ASK_AGAIN = 2, /* at once: one is in doubt */
};

/* Returns a bitmap of readings_news. Cost: some 800 Cortex-M0+ cycles a sensor. */
uint32_t readings_take_temperature(struct readings *readings, uint8_t sensor_count, const struct readings_temperature *taken);

/* These are apart from the others at rest (condition/plausibility.h), and are doubtful until a call states
 * otherwise. That takes effect with the next temperature; a new doubt does so at once. */
void readings_doubt(struct readings *readings, sensor_map apart);

/* Fills in pressures, valid, doubtful, unsettled, saturated, renewed and restored. The frame still holds the one before. code: [sensor];
 * good: bitmap. Returns whether it left any out: left_out and perhaps suspects have changed. Cost: some 140 Cortex-M0+ cycles a sensor. */
bool readings_take_pressures(struct readings *readings, const uint32_t code[], sensor_map good, struct frame *frame);
