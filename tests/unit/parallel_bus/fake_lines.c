#include "fake_lines.h"

#include <string.h>

struct fake_lines fake;

enum { MAX_CELLS = 64, RISE_ns = 426, FALL_ns = 180, HOLD_ns = 300 };
static const int STEP_ns[WAVE_STEPS_PER_CELL] = {WAVE_STEP0_ns, WAVE_STEP1_ns, WAVE_STEP2_ns, WAVE_STEP3_ns};

static struct sensor {
  enum { IDLE, ADDRESS, RECEIVE, SEND, IGNORE } state;
  unsigned clock; /* of the byte, 0 to 9 */
  uint8_t shift;
  uint8_t command;
  unsigned index; /* of the byte that is sent */
  bool zeros;     /* sends those instead */
  bool acknowledged;
  bool low;
} sensors[BOARD_SENSOR_COUNT];

static struct {
  bool active;
  uint64_t end_us;
  uint16_t *samples;
  uint16_t sampled[MAX_CELLS];
  unsigned cells;
} wave;

static uint16_t pulled; /* lines, by us */
static int64_t time_ns; /* of the step */
static int64_t scl_fell_ns, scl_rose_ns, sda_changed_ns[BOARD_SENSOR_COUNT];
static int64_t sda_fell_ns;
static int64_t sda_rose_ns[BOARD_SENSOR_COUNT]; /* with SCL high: the STOP */

static bool misused_if(bool misused, const char *how) {
  fake.misuses += misused;
  fake.misuse = misused ? how : fake.misuse;
  return misused;
}

void fake_lines_power_up(void) {
  memset(&fake, 0, sizeof fake);
  memset(sensors, 0, sizeof sensors);
  memset(&wave, 0, sizeof wave);
  pulled = 0;
  fake.opens = true;
}

uint8_t fake_byte(unsigned sensor, uint8_t command, unsigned index) { return (uint8_t)(0x35u + 29u * sensor + 3u * command + 71u * index); }

void fake_lose_its_place(unsigned sensor) { sensors[sensor] = (struct sensor){.state = SEND, .clock = 3, .zeros = true, .low = true}; }

uint64_t fake_lines_next_event_us(void) { return wave.active && !fake.hangs ? wave.end_us : UINT64_MAX; }

static uint16_t levels(void) {
  uint16_t low = pulled | fake.held_low;
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    if (sensors[k].low && (fake.missing >> k & 1) == 0) {
      low |= (uint16_t)(1u << k);
    }
  }
  return (uint16_t)~low | fake.held_high;
}

static void send_bit(struct sensor *sensor, unsigned k) {
  const uint8_t byte = sensor->zeros ? 0 : fake_byte(k, sensor->command, sensor->index);
  sensor->low = (byte >> (7 - sensor->clock) & 1) == 0;
}

static void on_scl_rise(struct sensor *sensor, bool sda) {
  if (sensor->state == IDLE || sensor->state == IGNORE) {
    return;
  }
  sensor->clock++;
  if (sensor->clock <= 8) {
    sensor->shift = (uint8_t)(sensor->shift << 1 | sda);
  } else {
    sensor->acknowledged = !sda;
  }
}

static void on_scl_fall(struct sensor *sensor, unsigned k) {
  if (sensor->clock == 8) {
    if (sensor->state == ADDRESS && sensor->shift >> 1 != BOARD_SENSOR_ADDRESS) {
      sensor->state = IGNORE;
    } else if (sensor->state == RECEIVE) {
      sensor->command = sensor->shift;
      fake.commands[k] = sensor->shift;
      fake.received[k]++;
      sensor->index = 0;
    }
    sensor->low = sensor->state == ADDRESS || (sensor->state == RECEIVE && (fake.deaf >> k & 1) == 0);
    return;
  }
  sensor->low = false;
  if (sensor->clock == 9) {
    sensor->clock = 0;
    if (sensor->state == ADDRESS) {
      sensor->state = sensor->shift & 1 ? SEND : RECEIVE;
    } else if (sensor->state == SEND) {
      sensor->index++;
      if (!sensor->acknowledged) {
        sensor->state = IGNORE;
      }
    }
  }
  if (sensor->state == SEND) {
    send_bit(sensor, k);
  }
}

static void check_scl_edge(bool rises) {
  if (rises) {
    misused_if(time_ns - scl_fell_ns < 1300 + FALL_ns, "tLOW");
    for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
      misused_if(time_ns - sda_changed_ns[k] < 100 + RISE_ns, "tSU;DAT");
    }
    scl_rose_ns = time_ns;
    fake.clocks++;
  } else {
    misused_if(time_ns - scl_rose_ns < 600 + RISE_ns, "tHIGH");
    misused_if(time_ns - sda_fell_ns < 600 + FALL_ns, "tHD;STA");
    scl_fell_ns = time_ns;
  }
}

static void check_sda_edge(unsigned k, bool rises, bool scl) {
  sda_changed_ns[k] = time_ns;
  if (!scl) {
    misused_if(time_ns - scl_fell_ns < HOLD_ns, "tHD;DAT");
    return;
  }
  misused_if(time_ns - scl_rose_ns < 600 + RISE_ns, rises ? "tSU;STO" : "tSU;STA");
  *(rises ? &fake.stops : &fake.starts) |= (uint16_t)(1u << k);
  if (rises) {
    fake.stops_of_first += k == 0;
    sda_rose_ns[k] = time_ns;
  } else {
    sda_fell_ns = time_ns;
    misused_if(time_ns - sda_rose_ns[k] < 1300 + RISE_ns, "tBUF");
  }
}

static void clock_sensors(bool rises, uint16_t now) {
  const unsigned number = fake.clocks;
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    unsigned times = 1;
    if ((fake.slips >> k & 1) != 0 && number == fake.slip_clock) {
      times = fake.slip_doubles ? 2 : 0;
    }
    for (unsigned i = 0; i < times; i++) {
      if (rises) {
        on_scl_rise(&sensors[k], now >> k & 1);
        if (i + 1 < times) {
          on_scl_fall(&sensors[k], k);
        }
      } else if (i == 0) {
        on_scl_fall(&sensors[k], k);
      }
    }
  }
}

static void take_step(uint16_t step) {
  const uint16_t before = levels();
  const uint16_t pulled_before = pulled;
  pulled = step;
  const uint16_t after = levels();
  const bool scl = after >> BOARD_PIN_SCL & 1;
  const bool scl_changed = ((before ^ after) >> BOARD_PIN_SCL & 1) != 0;
  misused_if((pulled_before ^ step) >> BOARD_PIN_SCL != 0 && ((pulled_before ^ step) & BOARD_SDA_LINES) != 0, "SCL and SDA at once");
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    if (((pulled_before ^ step) >> k & 1) != 0) {
      check_sda_edge(k, (step >> k & 1) == 0, scl);
    }
    if (((before ^ after) >> k & 1) != 0 && scl) {
      sensors[k].low = false;
      sensors[k].zeros = false;
      sensors[k].clock = 0;
      sensors[k].state = after >> k & 1 ? IDLE : ADDRESS;
    }
  }
  if (scl_changed) {
    check_scl_edge(scl);
    clock_sensors(scl, after);
  }
}

enum ft_status wave_player_open(void) {
  fake.opened++;
  wave.active = false;
  pulled = 0;
  return fake.opens ? FT_OK : FT_ERR_TIMEOUT;
}

void wave_player_start(const uint16_t *steps, uint16_t *samples, unsigned cell_count) {
  if (misused_if(wave.active || cell_count == 0 || cell_count % 2 != 0 || cell_count > MAX_CELLS || (uintptr_t)steps % 4 != 0 ||
                     (uintptr_t)samples % 4 != 0,
                 "wave_player_start")) {
    return;
  }
  fake.waves++;
  fake.clocks = 0;
  fake.starts = fake.stops = 0;
  fake.stops_of_first = 0;
  time_ns = 10000; /* of idle lines before it */
  scl_fell_ns = scl_rose_ns = sda_fell_ns = 0;
  memset(sda_rose_ns, 0, sizeof sda_rose_ns);
  memset(sda_changed_ns, 0, sizeof sda_changed_ns);
  for (unsigned cell = 0; cell < cell_count; cell++) {
    for (unsigned i = 0; i < WAVE_STEPS_PER_CELL; i++) {
      take_step(steps[cell * WAVE_STEPS_PER_CELL + i]);
      time_ns += STEP_ns[i];
      if (i == 0) {
        wave.sampled[cell] = levels();
      }
    }
  }
  misused_if(pulled != 0, "a line is left low");
  fake.slips = 0;
  wave.active = true;
  wave.samples = samples;
  wave.cells = cell_count;
  wave.end_us = fake.now_us + cell_count * WAVE_CELL_ns / 1000u;
}

/* Nothing is known before it is in memory. */
unsigned wave_player_sampled(void) {
  if (!wave.active) {
    return wave.cells;
  }
  const uint64_t began_us = wave.end_us - wave.cells * WAVE_CELL_ns / 1000u;
  const unsigned pairs = (unsigned)((fake.now_us - began_us) * 1000u / (2 * WAVE_CELL_ns));
  const unsigned cells = 2 * pairs < wave.cells && !fake.hangs ? 2 * pairs : 0;
  memcpy(wave.samples, wave.sampled, cells * sizeof wave.sampled[0]);
  return cells;
}

bool wave_player_has_ended(void) {
  if (wave.active && fake.now_us >= wave.end_us && !fake.hangs) {
    memcpy(wave.samples, wave.sampled, wave.cells * sizeof wave.sampled[0]);
    wave.active = false;
  }
  return !wave.active;
}
