/* The whole firmware in this process, on simulated sensors and in simulated time: firmware/app on
 * boards/native. One at a time, since the board is one.
 *
 * The host's end of the line is native_cdc.h. Nothing takes time but the bus and the conversions. */
#pragma once

#include "common/pad_profile.h"
#include "native/sim_array.h"

#include <stdbool.h>
#include <stdint.h>

struct native_fingertip_settings {
  uint64_t seed;                 /* of noise and calibration */
  double noise;                  /* times the datasheet's */
  double prom_spread;            /* every calibration word of every sensor is off the typical part's by up to
                                    this share; the firmware reads it and calculates with it */
  const struct pad_profile *pad; /* the profile in use, which outlives the fingertip; NULL: the stored one */
  struct sim_world world;
  sensor_map absent;    /* bitmap of the sensors that are not fitted */
  bool parallel_bus;    /* a data line for each sensor (sim_array.h): faster than multiplexers */
  const uint8_t *flash; /* [NATIVE_FLASH_BYTES] what it had kept (native_flash.h); NULL: nothing */
};

#ifdef __cplusplus
extern "C" {
#endif

/* Powers up at time 0. False: there is a pad, and this build reports no tangential force. */
bool native_fingertip_start(const struct native_fingertip_settings *settings);

/* Runs to t_us. False: the firmware left for the loader or panicked. */
bool native_fingertip_run_until(uint64_t t_us);

#ifdef __cplusplus
}
#endif
