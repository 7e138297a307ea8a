#include "native/sim_array.h"

#include <math.h>
#include <string.h>

static const double STANDARD_PRESSURE_Pa = 101325.0;
static const double ROOM_TEMPERATURE_degC = 25.0;
static const double TWO_PI = 6.28318530717958647692;
static const double LOG_2 = 0.69314718055994530942;
static const double ROOT_OF_HALF = 0.70710678118654752440;

/* splitmix64 */
static uint64_t random_u64(struct sim_array *array) {
  uint64_t z = array->prng += UINT64_C(0x9E3779B97F4A7C15);
  z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
  z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
  return z ^ z >> 31;
}

static double uniform(struct sim_array *array) { return (double)(random_u64(array) >> 11) / 9007199254740992.0; }

/* Libraries differ in the last bits of logarithm and cosine; these are the same on every machine. Within 4e-16 of the true values. */

/* u in (0, 1] */
static double logarithm(double u) {
  int exponent;
  double m = frexp(u, &exponent);
  if (m < ROOT_OF_HALF) {
    m *= 2.0;
    exponent--;
  }
  /* 2 artanh(s); s^2 below 0.03 */
  const double s = (m - 1.0) / (m + 1.0), s2 = s * s;
  double sum = 0.0;
  for (int n = 21; n > 0; n -= 2) {
    sum = sum * s2 + 1.0 / n;
  }
  return exponent * LOG_2 + 2.0 * s * sum;
}

/* cos(2 pi v), v in [0, 1) */
static double cosine_of_turns(double v) {
  const double half = v > 0.5 ? 1.0 - v : v;              /* even about half a turn */
  const double quarter = half > 0.25 ? 0.5 - half : half; /* odd about a quarter */
  const double x = TWO_PI * quarter, x2 = x * x;
  double sum = 1.0;
  for (int n = 22; n > 0; n -= 2) {
    sum = 1.0 - sum * x2 / (n * (n - 1));
  }
  return half > 0.25 ? -sum : sum;
}

static double gaussian(struct sim_array *array) {
  const double u = (double)((random_u64(array) >> 11) + 1) / 9007199254740992.0;
  const double v = (double)(random_u64(array) >> 11) / 9007199254740992.0;
  return sqrt(-2.0 * logarithm(u)) * cosine_of_turns(v);
}

static double temperature_at(const struct sim_array *array, unsigned k, uint64_t t_us) {
  return array->world.temperature_degC ? array->world.temperature_degC(array->world.context, k, t_us) : ROOM_TEMPERATURE_degC;
}

static uint32_t d2_at(const struct sim_array *array, unsigned k, uint64_t t_us, double error_degC) {
  if (array->d2[k] != 0) {
    return array->d2[k];
  }
  return sim_ms5840_d2(array->sensor[k].prom, temperature_at(array, k, t_us) + error_degC);
}

static uint32_t measure(void *context, int type, unsigned osr, uint64_t t_us) {
  struct sim_array *array = context;
  const unsigned k = array->measured_sensor;
  if (type == 2) {
    const double error_degC = array->noise > 0 ? array->noise * sim_ms5840_noise_degC(osr) * gaussian(array) : 0;
    const uint32_t d2 = d2_at(array, k, t_us, error_degC);
    const bool wrong = array->wrong_temperature_share > 0 && uniform(array) < array->wrong_temperature_share;
    return wrong ? d2 ^ UINT32_C(1) << random_u64(array) % 24 : d2;
  }
  if (array->d1[k] != 0) {
    return array->d1[k];
  }
  double pressure_Pa = array->world.pressure_Pa ? array->world.pressure_Pa(array->world.context, k, t_us) : STANDARD_PRESSURE_Pa;
  if (array->noise > 0) {
    pressure_Pa += array->noise * sim_ms5840_noise_Pa(osr) * gaussian(array);
  }
  const uint32_t d1 = sim_ms5840_d1(array->sensor[k].prom, pressure_Pa, d2_at(array, k, t_us, 0));
  return array->noise > 0 ? d1 : d1 + (array->conversions & 1u); /* no sensor repeats itself */
}

void sim_array_init(struct sim_array *array, uint8_t sensor_count, uint64_t seed) {
  memset(array, 0, sizeof *array);
  array->sensor_count = sensor_count;
  array->prng = seed;
  static const uint16_t EXAMPLE[6] = SIM_MS5840_EXAMPLE;
  for (unsigned k = 0; k < sensor_count; k++) {
    /* The datasheet's example, and its neighbours. */
    const uint16_t c[6] = {(uint16_t)(EXAMPLE[0] - 37 * k), (uint16_t)(EXAMPLE[1] + 53 * k), (uint16_t)(EXAMPLE[2] + 17 * k),
                           (uint16_t)(EXAMPLE[3] - 29 * k), (uint16_t)(EXAMPLE[4] + 41 * k), (uint16_t)(EXAMPLE[5] - 13 * k)};
    sim_ms5840_init(&array->sensor[k], c);
  }
}

void sim_array_vary_parts(struct sim_array *array, double share) {
  static const uint16_t TYPICAL[6] = SIM_MS5840_TYPICAL;
  for (unsigned k = 0; k < array->sensor_count; k++) {
    uint16_t c[6];
    for (int i = 0; i < 6; i++) {
      const double word = TYPICAL[i] * (1.0 + share * (2.0 * uniform(array) - 1.0));
      c[i] = word < 65535.0 ? (uint16_t)word : 65535;
    }
    sim_ms5840_init(&array->sensor[k], c);
  }
}

void sim_array_restart_bus(struct sim_array *array, uint64_t elapsed_us) {
  array->operation = SIM_ARRAY_IDLE;
  array->hangs = false;
  array->needs_recovery = false;
  for (unsigned k = 0; k < array->sensor_count; k++) {
    uint64_t *busy_until_us = &array->sensor[k].busy_until_us;
    *busy_until_us -= *busy_until_us < elapsed_us ? *busy_until_us : elapsed_us;
  }
}

static bool strikes(const struct sim_array *array, enum sim_fault_kind kind) {
  return array->fault.kind == kind && array->fault.transfer == array->transfers;
}

/* Faults of one sensor in the transfer under way; false: it neither hears nor answers. */
static bool is_alive(struct sim_array *array, unsigned k) {
  const bool meant = array->operation == SIM_ARRAY_READ || array->fault.sensor == k;
  if (meant && strikes(array, SIM_FAULT_DEAD)) {
    array->dead_transfers[k] = array->fault.count;
  }
  if (meant && strikes(array, SIM_FAULT_POWER_CYCLE)) {
    sim_ms5840_power_cycle(&array->sensor[k]);
  }
  if (meant && strikes(array, SIM_FAULT_BROWN_OUT)) {
    sim_ms5840_brown_out(&array->sensor[k]);
  }
  if (array->dead_transfers[k] > 0) {
    array->dead_transfers[k]--;
    return false;
  }
  return !array->absent[k] && !strikes(array, SIM_FAULT_NACK);
}

static void note_early(struct sim_array *array, unsigned k, uint64_t t_us) {
  const struct sim_ms5840 *sensor = &array->sensor[k];
  const bool disturbs = array->command == 0x00 || array->command >> 4 == 4 || array->command >> 4 == 5;
  if (disturbs && sensor->converting && t_us < sensor->busy_until_us) {
    array->early_reads++;
  }
}

static void broadcast(struct sim_array *array, uint64_t t_us) {
  array->conversions++;
  bool anybody = false;
  for (unsigned k = 0; k < array->sensor_count; k++) {
    if (!is_alive(array, k)) {
      continue;
    }
    array->measured_sensor = (uint8_t)k;
    note_early(array, k, t_us);
    if (sim_ms5840_command(&array->sensor[k], array->command, t_us, measure, array)) {
      anybody = true;
    }
  }
  if (anybody) {
    array->result.acknowledged = first_sensors(array->sensor_count);
  } else {
    array->result.nacks++;
  }
}

static void spoil_bytes(const struct sim_array *array, uint8_t *bytes) {
  for (unsigned i = 0; i < array->byte_count; i++) {
    if (strikes(array, SIM_FAULT_FLIP)) {
      bytes[i] ^= (uint8_t)(array->fault.mask >> (16 - 8 * i));
    }
    if (strikes(array, SIM_FAULT_ZERO)) {
      bytes[i] = 0;
    }
    if (strikes(array, SIM_FAULT_ONES)) {
      bytes[i] = 0xFF;
    }
  }
}

static void read_one(struct sim_array *array, unsigned k, uint64_t t_us) {
  bool acknowledged = is_alive(array, k);
  if (acknowledged && array->nack_share > 0 && uniform(array) < array->nack_share) {
    acknowledged = false;
  }
  if (acknowledged) {
    note_early(array, k, t_us);
    acknowledged = sim_ms5840_read(&array->sensor[k], array->command, array->result.bytes[k], array->byte_count, t_us);
  }
  if (!acknowledged) {
    array->result.nacks++;
    return;
  }
  array->result.acknowledged |= sensor_bit(k);
  spoil_bytes(array, array->result.bytes[k]);
}

static void begin_transfer(struct sim_array *array, uint64_t t_us) {
  array->transfers++;
  const uint32_t broadcast_us = array->parallel ? SIM_ARRAY_PARALLEL_BROADCAST_us : SIM_ARRAY_BROADCAST_us;
  const uint32_t read_us = array->parallel ? SIM_ARRAY_PARALLEL_READ_us : SIM_ARRAY_READ_us;
  array->transfer_end_us = t_us + (array->operation == SIM_ARRAY_COMMAND ? broadcast_us : read_us);
  array->hangs = strikes(array, SIM_FAULT_TIMEOUT) || strikes(array, SIM_FAULT_STUCK);
  if (array->hangs && strikes(array, SIM_FAULT_STUCK)) {
    array->failing_recoveries = array->fault.count;
  }
}

static enum ft_status start(struct sim_array *array, enum sim_array_operation operation, uint8_t command, uint8_t byte_count,
                            uint64_t now_us) {
  if (array->operation != SIM_ARRAY_IDLE) {
    return FT_ERR_BUSY;
  }
  array->operation = operation;
  array->command = command;
  array->byte_count = byte_count;
  array->next_sensor = 0;
  memset(&array->result, 0, sizeof array->result);
  if (!array->needs_recovery) {
    begin_transfer(array, now_us);
  }
  return FT_OK;
}

static enum ft_status start_command(void *context, uint8_t command, uint64_t now_us) {
  return start(context, SIM_ARRAY_COMMAND, command, 0, now_us);
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t byte_count, uint64_t now_us) {
  if (byte_count < 1 || byte_count > ARRAY_BUS_MAX_READ_BYTES) {
    return FT_ERR_ARGUMENT;
  }
  return start(context, SIM_ARRAY_READ, command, byte_count, now_us);
}

static enum ft_status start_recovery(void *context, uint64_t now_us) {
  struct sim_array *array = context;
  array->operation = SIM_ARRAY_RECOVERY;
  array->recoveries++;
  array->hangs = false;
  array->transfer_end_us = now_us + SIM_ARRAY_RECOVERY_us;
  memset(&array->result, 0, sizeof array->result);
  return FT_OK;
}

static enum ft_status end_recovery(struct sim_array *array) {
  if (array->failing_recoveries > 0) {
    array->failing_recoveries--;
    return FT_ERR_STUCK;
  }
  array->needs_recovery = false;
  return FT_OK;
}

/* Everything that has ended on the bus by now_us. */
static enum ft_status advance(struct sim_array *array, uint64_t now_us) {
  if (array->operation == SIM_ARRAY_RECOVERY) {
    return now_us < array->transfer_end_us ? FT_PENDING : end_recovery(array);
  }
  if (array->needs_recovery) {
    return FT_ERR_TIMEOUT;
  }
  while (!array->hangs && now_us >= array->transfer_end_us) {
    const uint64_t t_us = array->transfer_end_us;
    if (array->operation == SIM_ARRAY_COMMAND) {
      broadcast(array, t_us);
      return FT_OK;
    }
    do {
      read_one(array, array->next_sensor, t_us);
      if (++array->next_sensor == array->sensor_count) {
        return FT_OK;
      }
    } while (array->parallel);
    begin_transfer(array, t_us);
  }
  return now_us >= array->transfer_end_us + SIM_ARRAY_TIMEOUT_us ? FT_ERR_TIMEOUT : FT_PENDING;
}

static enum ft_status poll(void *context, uint64_t now_us, struct array_bus_result *result, uint64_t *wake_us) {
  struct sim_array *array = context;
  if (array->operation == SIM_ARRAY_IDLE) {
    return FT_ERR_ARGUMENT;
  }
  const enum ft_status status = advance(array, now_us);
  if (status == FT_PENDING) {
    *wake_us = array->transfer_end_us + (array->operation == SIM_ARRAY_RECOVERY ? 0 : SIM_ARRAY_TIMEOUT_us);
    return FT_PENDING;
  }
  array->operation = SIM_ARRAY_IDLE;
  array->needs_recovery = status != FT_OK;
  if (status == FT_OK) {
    *result = array->result;
  }
  return status;
}

const struct array_bus *sim_array_bus(struct sim_array *array) {
  array->bus = (struct array_bus){
      .context = array,
      .start_command = start_command,
      .start_read = start_read,
      .start_recovery = start_recovery,
      .poll = poll,
  };
  return &array->bus;
}

uint64_t sim_array_next_event_us(const struct sim_array *array) {
  return array->operation == SIM_ARRAY_IDLE || array->hangs || array->needs_recovery ? UINT64_MAX : array->transfer_end_us;
}
