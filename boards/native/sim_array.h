/* A simulated array of MS5840 behind array_bus, with bus times like those of multiplexers and a fault on request at any transfer. Time is
 * the caller's: nothing happens but at poll(), and each transfer is then applied at the time at which it ended on the bus.
 *
 * Transfers are counted from 1: each broadcast of a command is one, each read of one sensor is one. After start_*
 * advance time to the earlier of *wake_us and sim_array_next_event_us(), and poll. */
#pragma once

#include "array_bus/array_bus.h"
#include "native/sim_ms5840.h"

#include <stdbool.h>
#include <stdint.h>

/* Three selections and a write, as behind three multiplexers; a selection and a read of 3 bytes. */
#define SIM_ARRAY_BROADCAST_us 200u
#define SIM_ARRAY_READ_us 193u
/* With a data line for each sensor, which are then read all at once. */
#define SIM_ARRAY_PARALLEL_BROADCAST_us 46u
#define SIM_ARRAY_PARALLEL_READ_us 130u
/* From the end that a transfer should have had to FT_ERR_TIMEOUT. */
#define SIM_ARRAY_TIMEOUT_us 300u
#define SIM_ARRAY_RECOVERY_us 150u

enum sim_fault_kind {
  SIM_FAULT_NONE,
  SIM_FAULT_NACK,        /* no acknowledgement; a command is not heard */
  SIM_FAULT_DEAD,        /* the sensor hears and answers nothing for count transfers to it */
  SIM_FAULT_TIMEOUT,     /* the transfer never ends; one recovery helps */
  SIM_FAULT_STUCK,       /* the same, and count recoveries fail before one helps */
  SIM_FAULT_FLIP,        /* bits of mask are inverted in the bytes read, MSB first in 24 bits */
  SIM_FAULT_ZERO,        /* the bytes read are 0 */
  SIM_FAULT_ONES,        /* the bytes read are 0xFF */
  SIM_FAULT_POWER_CYCLE, /* the sensor's supply fails just before the transfer */
  SIM_FAULT_BROWN_OUT,   /* the sensor's supply dips just before the transfer */
};

struct sim_fault {
  enum sim_fault_kind kind;
  uint32_t transfer; /* at which it strikes */
  uint32_t count;
  uint32_t mask;
  uint8_t sensor; /* DEAD, POWER_CYCLE and BROWN_OUT at a broadcast: which one. Reads name their
                     own. FLIP, ZERO and ONES concern reads only */
};

/* What the sensors feel. */
struct sim_world {
  void *context;
  double (*pressure_Pa)(void *context, unsigned sensor, uint64_t t_us);      /* absolute */
  double (*temperature_degC)(void *context, unsigned sensor, uint64_t t_us); /* NULL: 25 degC */
};

struct sim_array {
  /* The test's, at any time */
  struct sim_fault fault;
  struct sim_world world;
  double noise;                   /* times the datasheet's; 0 = none */
  uint32_t d1[FT_MAX_SENSORS];    /* [sensor] code instead of the world's pressure; 0 = none */
  uint32_t d2[FT_MAX_SENSORS];    /* [sensor] code instead of the world's temperature; 0 = none */
  double nack_share;              /* of the reads of one sensor: not acknowledged, at random. The bus does not
                                     ask again */
  double wrong_temperature_share; /* of the temperatures of one sensor: one bit inverted, at random */
  struct sim_ms5840 sensor[FT_MAX_SENSORS];
  bool absent[FT_MAX_SENSORS]; /* [sensor] not fitted */
  bool parallel;               /* a data line for each sensor, no multiplexers */

  /* To look at */
  uint32_t transfers;
  uint32_t recoveries;
  uint32_t early_reads; /* ADC reads and conversions during a conversion */

  /* Private */
  struct array_bus bus;
  uint8_t sensor_count;
  enum sim_array_operation { SIM_ARRAY_IDLE, SIM_ARRAY_COMMAND, SIM_ARRAY_READ, SIM_ARRAY_RECOVERY } operation;
  uint8_t command, byte_count, next_sensor;
  uint32_t conversions;
  uint64_t transfer_end_us;
  bool hangs; /* the transfer under way never ends */
  bool needs_recovery;
  uint32_t failing_recoveries;
  uint32_t dead_transfers[FT_MAX_SENSORS]; /* [sensor] left to ignore */
  uint64_t prng;
  uint8_t measured_sensor;
  struct array_bus_result result;
};

/* 1..FT_MAX_SENSORS sensors, each with a PROM of its own, just powered up at 101325 Pa, noiseless.
 * seed: of the noise. */
void sim_array_init(struct sim_array *array, uint8_t sensor_count, uint64_t seed);

/* Draws new calibrations for every sensor, each word up to `share` (below 1) off the typical part's. The sensors are as after power-up. */
void sim_array_vary_parts(struct sim_array *array, double share);

/* The bus driver starts again, and its time at 0; the argument is the time since its last start: what was under
 * way on the bus is no more, what the sensors do goes on. */
void sim_array_restart_bus(struct sim_array *array, uint64_t elapsed_us);

/* The array as the firmware sees it; valid as long as *array stays where it is. */
const struct array_bus *sim_array_bus(struct sim_array *array);

/* When the bus next makes progress; UINT64_MAX if it does not. */
uint64_t sim_array_next_event_us(const struct sim_array *array);
