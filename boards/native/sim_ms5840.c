#include "native/sim_ms5840.h"

#include <math.h>
#include <string.h>

enum { RESET = 0x1E, READ_ADC = 0x00, READ_PROM = 0xA0, CODE_MAX = 0xFFFFFF };

/* Datasheet, "Performance specifications": ADC, resolution rms. Index: low nibble of the convert command over two. */
static const struct {
  unsigned osr;
  uint32_t conversion_us;
  double noise_Pa, noise_degC;
} rows[] = {
#if SIM_SENSOR_MS5837_30BA
    {256, 600, 157.0, 0.012},  {512, 1170, 84.0, 0.009},  {1024, 2280, 54.0, 0.006},
    {2048, 4540, 38.0, 0.004}, {4096, 9040, 28.0, 0.003}, {8192, 18080, 20.0, 0.002},
#else
    {256, 560, 11.0, 0.012},  {512, 1100, 6.2, 0.009},  {1024, 2170, 3.9, 0.006},
    {2048, 4320, 2.8, 0.004}, {4096, 8610, 2.1, 0.003}, {8192, 17200, 1.6, 0.002},
#endif
};
enum { ROWS = sizeof rows / sizeof rows[0] };

static unsigned row_of(unsigned osr) {
  unsigned row = 0;
  while (row < ROWS - 1 && rows[row].osr != osr) {
    row++;
  }
  return row;
}

uint32_t sim_ms5840_conversion_us(unsigned osr) { return rows[row_of(osr)].conversion_us; }
double sim_ms5840_noise_Pa(unsigned osr) { return rows[row_of(osr)].noise_Pa; }
double sim_ms5840_noise_degC(unsigned osr) { return rows[row_of(osr)].noise_degC; }

uint8_t sim_ms5840_crc4(const uint16_t prom[SIM_MS5840_PROM_WORDS]) {
  /* The words without the CRC nibble, and twelve bits 0 of an eighth word, modulo x^4 + x + 1. */
  unsigned remainder = 0;
  for (unsigned bit = 4; bit < 16 * SIM_MS5840_PROM_WORDS + 12; bit++) {
    unsigned next = 0;
    if (bit < 16 * SIM_MS5840_PROM_WORDS) {
      next = (unsigned)prom[bit / 16] >> (15 - bit % 16) & 1u;
    }
    remainder = remainder << 1 | next;
    if ((remainder & 0x10) != 0) {
      remainder ^= 0x13;
    }
  }
  return (uint8_t)remainder;
}

void sim_ms5840_init(struct sim_ms5840 *sensor, const uint16_t c[6]) {
  memset(sensor, 0, sizeof *sensor);
  memcpy(&sensor->prom[1], c, 6 * sizeof c[0]);
  sensor->prom[0] = (uint16_t)(sim_ms5840_crc4(sensor->prom) << 12);
}

void sim_ms5840_power_cycle(struct sim_ms5840 *sensor) {
  sensor->loaded = false;
  sensor->converting = false;
  sensor->spoiled = false;
  sensor->busy_until_us = 0;
  sensor->result = 0;
}

void sim_ms5840_brown_out(struct sim_ms5840 *sensor) {
  const bool loaded = sensor->loaded;
  sim_ms5840_power_cycle(sensor);
  sensor->loaded = loaded;
  sensor->untrimmed = true;
  sensor->share = 0.9375;
}

static void settle(struct sim_ms5840 *sensor, uint64_t t_us) {
  if (!sensor->converting || t_us < sensor->busy_until_us) {
    return;
  }
  sensor->converting = false;
  sensor->result = sensor->spoiled ? sensor->converted - sensor->converted / 8 : sensor->converted;
  sensor->spoiled = false;
}

static bool is_read_command(uint8_t command) {
  return command == READ_ADC || (command >= READ_PROM && command < READ_PROM + 2 * SIM_MS5840_PROM_WORDS);
}

static bool is_resetting(const struct sim_ms5840 *sensor, uint64_t t_us) { return !sensor->converting && t_us < sensor->busy_until_us; }

bool sim_ms5840_command(struct sim_ms5840 *sensor, uint8_t command, uint64_t t_us, sim_ms5840_measure *measure, void *context) {
  settle(sensor, t_us);
  if (is_resetting(sensor, t_us)) {
    return false;
  }
  if (command == RESET) {
    sim_ms5840_power_cycle(sensor);
    sensor->loaded = true;
    sensor->untrimmed = false;
    sensor->busy_until_us = t_us + SIM_MS5840_RESET_us;
    return true;
  }
  const int type = command >> 4 == 4 ? 1 : command >> 4 == 5 ? 2 : 0;
  const unsigned row = (command & 0xFu) / 2;
  if (type != 0 && command % 2 == 0 && row < ROWS) {
    if (!sensor->loaded) {
      return true;
    }
    if (sensor->converting) {
      sensor->spoiled = true;
      return true;
    }
    const uint32_t duration_us = rows[row].conversion_us;
    sensor->converting = true;
    sensor->result = 0;
    sensor->busy_until_us = t_us + duration_us;
    sensor->converted = measure(context, type, rows[row].osr, t_us + duration_us / 2);
    sensor->converted = sensor->untrimmed ? (uint32_t)ceil(sensor->share * sensor->converted) : sensor->converted;
    return true;
  }
  return is_read_command(command);
}

bool sim_ms5840_read(struct sim_ms5840 *sensor, uint8_t command, uint8_t *bytes, unsigned count, uint64_t t_us) {
  settle(sensor, t_us);
  if (is_resetting(sensor, t_us) || !is_read_command(command)) {
    return false;
  }
  uint32_t value = 0; /* left-aligned in 24 bits */
  if (command == READ_ADC) {
    if (sensor->converting) {
      sensor->spoiled = true;
    } else {
      value = sensor->result;
      sensor->result = 0;
    }
  } else if (sensor->loaded) {
    value = (uint32_t)sensor->prom[(command - READ_PROM) / 2] << 8;
  }
  for (unsigned i = 0; i < count; i++) {
    /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): three bytes at most */
    bytes[i] = (uint8_t)(value >> (16 - 8 * i));
  }
  return true;
}

/* First order, and what the second order subtracts. */
struct compensation {
  double temperature; /* 0.01 degC */
  double offset, sensitivity;
};

/* One count of the datasheet's P, and its divisor. */
#if SIM_SENSOR_MS5837_30BA
static const double PRESSURE_COUNT_Pa = 10.0, PRESSURE_DIVISOR = 8192.0;
#else
static const double PRESSURE_COUNT_Pa = 1.0, PRESSURE_DIVISOR = 32768.0;
#endif

/* The datasheet's integers, each quotient rounded down. */
static struct compensation compensate(const uint16_t *prom, uint32_t d2) {
  const double c1 = prom[1], c2 = prom[2], c3 = prom[3], c4 = prom[4], c5 = prom[5], c6 = prom[6];
  const double dt = d2 - c5 * 256.0;
  const double first = 2000.0 + floor(dt * c6 / 8388608.0);
  struct compensation c = {
    .temperature = first,
#if SIM_SENSOR_MS5837_30BA
    .offset = c2 * 65536.0 + floor(c4 * dt / 128.0),
    .sensitivity = c1 * 32768.0 + floor(c3 * dt / 256.0),
#else
    .offset = c2 * 131072.0 + floor(c4 * dt / 64.0),
    .sensitivity = c1 * 65536.0 + floor(c3 * dt / 128.0),
#endif
  };
  const double below = first - 2000.0;
#if SIM_SENSOR_MS5837_30BA
  if (first >= 2000.0) {
    c.temperature -= floor(dt * dt / 68719476736.0);
    c.offset -= floor(below * below / 16.0);
    return c;
  }
  c.temperature -= floor(3.0 * dt * dt / 8589934592.0);
  c.offset -= floor(1.5 * below * below);
  c.sensitivity -= floor(0.625 * below * below);
  if (first < -1500.0) {
    const double beyond = first + 1500.0;
    c.offset -= 7.0 * beyond * beyond;
    c.sensitivity -= 4.0 * beyond * beyond;
  }
#else
  if (first < 1000.0) {
    c.temperature -= floor(14.0 * dt * dt / 34359738368.0);
    c.offset -= floor(35.0 * below * below / 8.0);
    c.sensitivity -= floor(63.0 * below * below / 32.0);
  } else if (first < 2000.0) {
    c.temperature -= floor(12.0 * dt * dt / 34359738368.0);
    c.offset -= floor(30.0 * below * below / 256.0);
  }
#endif
  return c;
}

double sim_ms5840_temperature_degC(const uint16_t *prom, uint32_t d2) { return compensate(prom, d2).temperature / 100.0; }

double sim_ms5840_pressure_Pa(const uint16_t *prom, uint32_t d1, uint32_t d2) {
  const struct compensation c = compensate(prom, d2);
  return PRESSURE_COUNT_Pa * floor((floor(d1 * c.sensitivity / 2097152.0) - c.offset) / PRESSURE_DIVISOR);
}

uint32_t sim_ms5840_d2(const uint16_t *prom, double temperature_degC) {
  uint32_t low = 1, high = CODE_MAX; /* the temperature rises with the code */
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (sim_ms5840_temperature_degC(prom, middle) < temperature_degC) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

uint32_t sim_ms5840_d1(const uint16_t *prom, double pressure_Pa, uint32_t d2) {
  const struct compensation c = compensate(prom, d2);
  const double count = pressure_Pa / PRESSURE_COUNT_Pa;
  const double d1 = (count * PRESSURE_DIVISOR + c.offset) * 2097152.0 / c.sensitivity;
  return (uint32_t)fmin(fmax(round(d1), 1.0), CODE_MAX);
}
