/* The one data type between the sensors and everything that interprets them. */
#pragma once

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

/* Readings of the whole array at one moment. Pressures are absolute, in 1/1024 Pa: an int32
 * reaches 2.1 MPa, and steps of 1 Pa would cost the fit tens of micrometres. */
struct frame {
  uint32_t number;                         /* counts every frame since start */
  uint64_t t_us;                           /* middle of the conversion */
  uint64_t t_begin_us;                     /* first bus activity */
  uint64_t t_converted_us;                 /* conversion over, reading begins */
  uint64_t t_read_us;                      /* last sensor read */
  bool held;                               /* pressures, renewed, restored, valid and saturated are those of the frame before:
                                              the sensors converted their temperature meanwhile */
  uint8_t sensor_count;                    /* 1..FT_MAX_SENSORS */
  int32_t noise_Pa_q10;                    /* rms noise of a reading at this conversion's OSR, 1/1024 Pa */
  int16_t temperature_cC;                  /* mean of the sensors, 0.01 degC; 0 until first measured */
  sensor_map renewed;                      /* bitmap: another sensor than in the frame before, with another zero */
  sensor_map restored;                     /* bitmap: a reset brought back its state, or it stepped alone, since the frame before */
  sensor_map valid;                        /* bitmap: pressure is a measurement */
  sensor_map doubtful;                     /* bitmap: valid, but there is reason to doubt the reading */
  sensor_map unsettled;                    /* bitmap: doubtful until the next temperature and another code */
  sensor_map saturated;                    /* bitmap: beyond the range in which the sensor reads true */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* [sensor]; 0 where not valid */
};
