/* The firmware on boards/native, for C++, which its headers are not written for. */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "native/native_port.h"
#include "native/sim_array.h"

struct sim_array *storm_firmware_array(void);

/* New sensors, each with a calibration of its own. */
void storm_firmware_power_sensors(uint64_t seed);

/* Their supply fails and comes back. */
void storm_firmware_cut_sensors(void);

/* The chip starts, its clock at clock_us, so long after its last start; flash and sensors are as they are. */
void storm_firmware_start(uint64_t elapsed_us, uint64_t clock_us);

/* Device time. */
enum native_end storm_firmware_run_until(uint64_t t_us);

#ifdef __cplusplus
}
#endif
