#include "scan/scan.h"

#include <string.h>

/* Supply and sensors settle: power-on reset of the family takes under 10 ms (recalled). */
#define POWER_UP_us 10000u
/* Between two admissions; doubled while one leaves a sensor out, as each costs some 50 ms of
 * frames. */
#define ADMISSION_INTERVAL_MIN_us 1000000u
#define ADMISSION_INTERVAL_MAX_us 8000000u
#define PROM_PASSES 3
/* After a temperature reading that a sensor missed, or one in doubt. */
#define RETRY_TEMPERATURE_FRAMES 8u
/* At slow rates: the pressures of a pad that warms by 0.1 degC/s stay within some 12 Pa. */
#define TEMPERATURE_RATE_MIN_mHz 2000u
/* A larger step in half a second is no change of temperature. 1 degC is worth some 240 Pa. */
#define TEMPERATURE_STEP_MAX_cC 100
/* How soon a full slot is looked at again. */
#define SLOT_POLL_us 50u
/* How soon a new rate is noticed while waiting for the next frame of the old one. */
#define RATE_POLL_us 10000u
#define RECOVERY_DELAY_MIN_us 10000u
#define RECOVERY_DELAY_MAX_us 1000000u
/* Transitions in one call: enough for the longest run of states that take no time. */
#define MAX_TRANSITIONS 8

static void count(_Atomic uint32_t *counter, uint32_t amount) {
  uint32_t value = atomic_load_explicit(counter, memory_order_relaxed);
  atomic_store_explicit(counter, value + amount, memory_order_relaxed);
}

static uint32_t get(const _Atomic uint32_t *value) {
  return atomic_load_explicit(value, memory_order_relaxed);
}

static void set(_Atomic uint32_t *to, uint32_t value) {
  atomic_store_explicit(to, value, memory_order_relaxed);
}

static uint32_t all_sensors(const struct scan *scan) {
  return UINT32_MAX >> (FT_MAX_SENSORS - scan->sensor_count);
}

static uint32_t count_bits(uint32_t bitmap) {
  uint32_t bits = 0;
  for (; bitmap; bitmap &= bitmap - 1) {
    bits++;
  }
  return bits;
}

enum ft_status scan_init(struct scan *scan, const struct array_bus *bus,
                         const struct scan_settings *settings) {
  if (settings->sensor_count < 1 || settings->sensor_count > FT_MAX_SENSORS ||
      settings->temperature_interval < 1 || !ms5840_find_osr(settings->osr)) {
    return FT_ERR_ARGUMENT;
  }
  memset(scan, 0, sizeof *scan);
  scan->bus = bus;
  scan->sensor_count = settings->sensor_count;
  scan->temperature_interval = settings->temperature_interval;
  scan->conversion = ms5840_find_osr(settings->osr);
  set(&scan->osr, settings->osr);
  set(&scan->rate_mHz, settings->rate_mHz);
  scan->state = SCAN_WAIT_POWER;
  scan->wait_until_us = POWER_UP_us;
  scan->recovery_delay_us = RECOVERY_DELAY_MIN_us;
  scan->admission_interval_us = ADMISSION_INTERVAL_MIN_us;
  return FT_OK;
}

enum ft_status scan_set_osr(struct scan *scan, uint16_t osr) {
  if (!ms5840_find_osr(osr)) {
    return FT_ERR_ARGUMENT;
  }
  set(&scan->osr, osr);
  return FT_OK;
}

void scan_set_rate_mHz(struct scan *scan, uint32_t rate_mHz) {
  set(&scan->rate_mHz, rate_mHz);
}

static void wait_in(struct scan *scan, enum scan_state state, uint64_t until_us) {
  scan->state = state;
  scan->wait_until_us = until_us;
}

static void enter(struct scan *scan, enum scan_state state) {
  scan->state = state;
  scan->operation_running = false;
}

static void begin_admission(struct scan *scan, uint64_t now_us) {
  scan->next_admission_us = now_us + scan->admission_interval_us;
  scan->prom_pass = 0;
  scan->prom_word = 0;
  scan->prom_answered = all_sensors(scan);
  scan->prom_good = 0;
  enter(scan, SCAN_RESET);
}

/* Another PROM is another sensor: nothing that was known of this one holds. */
static void store_prom(struct scan *scan, uint8_t k) {
  if (memcmp(&scan->prom[k], &scan->prom_read[k], sizeof scan->prom[k]) != 0) {
    scan->prom[k] = scan->prom_read[k];
    scan->prom_changed |= UINT32_C(1) << k;
  }
}

/* Judges one complete reading of all PROMs. What is good is kept; what is not is read again, and
 * after the last pass a PROM with a wrong CRC is used and reported. */
static void end_prom_pass(struct scan *scan) {
  uint32_t differs = 0;
  uint32_t blank = 0;
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    if (!(scan->prom_answered & bit) || (scan->prom_good & bit)) {
      continue;
    }
    switch (ms5840_check_prom(&scan->prom_read[k])) {
    case MS5840_PROM_GOOD:
      scan->prom_good |= bit;
      store_prom(scan, k);
      break;
    case MS5840_PROM_CRC_DIFFERS:
      differs |= bit;
      break;
    case MS5840_PROM_BLANK:
      blank |= bit;
      break;
    }
  }
  scan->prom_pass++;
  if (scan->prom_good != all_sensors(scan) && scan->prom_pass < PROM_PASSES) {
    scan->prom_word = 0;
    scan->prom_answered = all_sensors(scan);
    enter(scan, SCAN_READ_PROM);
    return;
  }
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    if (differs & (UINT32_C(1) << k)) {
      store_prom(scan, k);
    }
  }
  uint32_t admitted = scan->prom_good | differs;
  if (admitted == all_sensors(scan)) {
    scan->next_admission_us -= scan->admission_interval_us - ADMISSION_INTERVAL_MIN_us;
    scan->admission_interval_us = ADMISSION_INTERVAL_MIN_us;
  } else if (scan->admission_interval_us < ADMISSION_INTERVAL_MAX_us) {
    scan->admission_interval_us *= 2;
  }
  set(&scan->admitted, admitted);
  set(&scan->prom_bad, differs | blank);
  scan->void_next = 0;
  enter(scan, SCAN_CONVERT_TEMPERATURE);
}

static void take_prom_word(struct scan *scan) {
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    const uint8_t *bytes = scan->result.bytes[k];
    scan->prom_read[k].word[scan->prom_word] = (uint16_t)(bytes[0] << 8 | bytes[1]);
  }
  scan->prom_answered &= scan->result.acknowledged;
  scan->prom_word++;
  if (scan->prom_word < MS5840_PROM_WORDS) {
    enter(scan, SCAN_READ_PROM);
  } else {
    end_prom_pass(scan);
  }
}

static void take_codes(struct scan *scan, uint64_t now_us) {
  struct scan_slot *slot = &scan->filling;
  uint32_t acknowledged = scan->result.acknowledged & all_sensors(scan);
  uint32_t admitted = get(&scan->admitted) & acknowledged;
  uint32_t zero = 0;
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    const uint8_t *bytes = scan->result.bytes[k];
    slot->code[k] = (uint32_t)bytes[0] << 16 | (uint32_t)bytes[1] << 8 | bytes[2];
    if (slot->code[k] == 0 || (slot->is_temperature && slot->code[k] == 0xFFFFFF)) {
      zero |= UINT32_C(1) << k;
    }
  }
  uint32_t unusable = admitted & (zero | scan->void_next);
  count(&scan->counters.zero_readings, count_bits(unusable));
  slot->good = admitted & ~unusable;
  admitted &= ~(zero & scan->void_next); /* twice in a row: it has lost its reset */
  scan->void_next = admitted & zero;
  slot->t_read_us = now_us;
  set(&scan->present, acknowledged);
  set(&scan->admitted, admitted);
}

/* The slot is empty when this is called. */
static void deliver(struct scan *scan) {
  scan->slot = scan->filling;
  atomic_store_explicit(&scan->slot_full, 1, memory_order_release);
}

static bool slot_is_empty(const struct scan *scan) {
  return !atomic_load_explicit(&scan->slot_full, memory_order_acquire);
}

/* The frames that may still pass before the next temperature. */
static void limit_frames_to_temperature(struct scan *scan) {
  uint32_t limit = scan->frames_to_temperature;
  uint32_t rate_mHz = get(&scan->rate_mHz);
  if (rate_mHz != 0 && limit > 1u + rate_mHz / TEMPERATURE_RATE_MIN_mHz) {
    limit = 1u + rate_mHz / TEMPERATURE_RATE_MIN_mHz;
  }
  if (get(&scan->temperature_doubted) != 0 && limit > RETRY_TEMPERATURE_FRAMES) {
    limit = RETRY_TEMPERATURE_FRAMES;
  }
  set(&scan->temperature_doubted, 0);
  scan->frames_to_temperature = limit;
}

/* Decides what comes next once the last reading has been taken. */
static void leave_idle(struct scan *scan, uint64_t now_us) {
  if (!slot_is_empty(scan)) {
    scan->wait_until_us = now_us + SLOT_POLL_us;
    return;
  }
  uint32_t waiting = get(&scan->present) & ~get(&scan->admitted);
  bool nobody = get(&scan->present) == 0;
  if ((waiting || nobody) && now_us >= scan->next_admission_us) {
    begin_admission(scan, now_us);
    return;
  }
  limit_frames_to_temperature(scan);
  if (scan->frames_to_temperature == 0) {
    enter(scan, SCAN_CONVERT_TEMPERATURE);
    return;
  }
  uint32_t rate_mHz = get(&scan->rate_mHz);
  if (rate_mHz != 0) {
    uint32_t period_us = 1000000000u / rate_mHz;
    if (scan->next_frame_us > now_us + period_us) {
      scan->next_frame_us = now_us; /* the rate was raised */
    }
    if (now_us < scan->next_frame_us) {
      uint64_t look_us = now_us + RATE_POLL_us;
      scan->wait_until_us = scan->next_frame_us < look_us ? scan->next_frame_us : look_us;
      return;
    }
    bool late = now_us - scan->next_frame_us > period_us;
    scan->next_frame_us = (late ? now_us : scan->next_frame_us) + period_us;
  }
  enter(scan, SCAN_CONVERT_PRESSURE);
}

static enum ft_status start_operation(struct scan *scan, uint64_t now_us) {
  const struct array_bus *bus = scan->bus;
  switch (scan->state) {
  case SCAN_RESET:
    return bus->start_command(bus->context, MS5840_CMD_RESET, now_us);
  case SCAN_READ_PROM:
    return bus->start_read(bus->context, (uint8_t)(MS5840_CMD_READ_PROM + 2 * scan->prom_word), 2,
                           now_us);
  case SCAN_CONVERT_TEMPERATURE:
    scan->conversion = ms5840_find_osr((uint16_t)get(&scan->osr));
    scan->filling.is_temperature = true;
    return bus->start_command(bus->context, scan->conversion->convert_temperature, now_us);
  case SCAN_CONVERT_PRESSURE:
    scan->conversion = ms5840_find_osr((uint16_t)get(&scan->osr));
    scan->filling.is_temperature = false;
    scan->filling.noise_Pa_q10 = scan->conversion->noise_Pa_q10;
    scan->filling.t_begin_us = now_us;
    return bus->start_command(bus->context, scan->conversion->convert_pressure, now_us);
  case SCAN_READ_TEMPERATURE:
  case SCAN_READ_PRESSURE:
    scan->filling.t_converted_us = now_us;
    return bus->start_read(bus->context, MS5840_CMD_READ_ADC, 3, now_us);
  default:
    return bus->start_recovery(bus->context, now_us);
  }
}

static void end_operation(struct scan *scan, uint64_t now_us) {
  switch (scan->state) {
  case SCAN_RESET:
    wait_in(scan, SCAN_WAIT_RESET, now_us + MS5840_RESET_us);
    break;
  case SCAN_READ_PROM:
    take_prom_word(scan);
    break;
  case SCAN_CONVERT_TEMPERATURE:
    wait_in(scan, SCAN_WAIT_TEMPERATURE, now_us + scan->conversion->conversion_us);
    break;
  case SCAN_CONVERT_PRESSURE:
    scan->filling.t_us = now_us + scan->conversion->conversion_us / 2u;
    wait_in(scan, SCAN_WAIT_PRESSURE, now_us + scan->conversion->conversion_us);
    break;
  case SCAN_READ_TEMPERATURE:
    take_codes(scan, now_us);
    scan->frames_to_temperature = scan->filling.good == get(&scan->admitted)
                                      ? scan->temperature_interval
                                      : RETRY_TEMPERATURE_FRAMES;
    scan->filling.prom_changed = scan->prom_changed;
    scan->prom_changed = 0;
    deliver(scan);
    wait_in(scan, SCAN_IDLE, now_us);
    break;
  case SCAN_READ_PRESSURE:
    take_codes(scan, now_us);
    scan->filling.number = scan->frame_number++;
    scan->frames_to_temperature--;
    count(&scan->counters.frames, 1);
    if (scan->filling.good != all_sensors(scan)) {
      count(&scan->counters.frames_incomplete, 1);
    }
    deliver(scan);
    wait_in(scan, SCAN_IDLE, now_us);
    break;
  default: /* SCAN_RECOVER: a conversion may still be running, and a command would spoil it */
    scan->bus_stuck = false;
    scan->recovery_delay_us = RECOVERY_DELAY_MIN_us;
    wait_in(scan, SCAN_WAIT_RECOVERY, now_us + scan->conversion->conversion_us);
    break;
  }
}

static void fail_operation(struct scan *scan, enum ft_status why, uint64_t now_us) {
  if (why == FT_ERR_STUCK) {
    set(&scan->present, 0);
    scan->bus_stuck = true;
    wait_in(scan, SCAN_WAIT_RECOVERY, now_us + scan->recovery_delay_us);
    scan->recovery_delay_us *= 2;
    if (scan->recovery_delay_us > RECOVERY_DELAY_MAX_us) {
      scan->recovery_delay_us = RECOVERY_DELAY_MAX_us;
    }
    return;
  }
  count(&scan->counters.bus_timeouts, 1);
  enter(scan, SCAN_RECOVER);
}

static bool state_has_operation(enum scan_state state) {
  switch (state) {
  case SCAN_RESET:
  case SCAN_READ_PROM:
  case SCAN_CONVERT_TEMPERATURE:
  case SCAN_READ_TEMPERATURE:
  case SCAN_CONVERT_PRESSURE:
  case SCAN_READ_PRESSURE:
  case SCAN_RECOVER:
    return true;
  default:
    return false;
  }
}

static void end_wait(struct scan *scan, uint64_t now_us) {
  switch (scan->state) {
  case SCAN_WAIT_POWER:
    begin_admission(scan, now_us);
    break;
  case SCAN_WAIT_RESET:
    enter(scan, SCAN_READ_PROM);
    break;
  case SCAN_WAIT_TEMPERATURE:
    enter(scan, SCAN_READ_TEMPERATURE);
    break;
  case SCAN_WAIT_PRESSURE:
    enter(scan, SCAN_READ_PRESSURE);
    break;
  case SCAN_WAIT_RECOVERY:
    if (scan->bus_stuck) {
      enter(scan, SCAN_RECOVER);
    } else if (slot_is_empty(scan)) {
      begin_admission(scan, now_us);
    } else {
      scan->wait_until_us = now_us + SLOT_POLL_us;
    }
    break;
  default:
    leave_idle(scan, now_us);
    break;
  }
}

uint64_t scan_step(struct scan *scan, uint64_t now_us) {
  for (int transition = 0; transition < MAX_TRANSITIONS; transition++) {
    if (!state_has_operation(scan->state)) {
      if (now_us < scan->wait_until_us) {
        return scan->wait_until_us;
      }
      end_wait(scan, now_us);
      continue;
    }
    enum ft_status status;
    if (!scan->operation_running) {
      if (scan->state == SCAN_RECOVER) {
        count(&scan->counters.bus_recoveries, 1);
      }
      status = start_operation(scan, now_us);
      if (status != FT_OK) {
        fail_operation(scan, FT_ERR_TIMEOUT, now_us);
        continue;
      }
      scan->operation_running = true;
    }
    uint64_t wake_us = now_us + SLOT_POLL_us;
    status = scan->bus->poll(scan->bus->context, now_us, &scan->result, &wake_us);
    if (status == FT_PENDING) {
      return wake_us;
    }
    scan->operation_running = false;
    if (status == FT_OK) {
      count(&scan->counters.bus_nacks, scan->result.nacks);
      end_operation(scan, now_us);
    } else {
      fail_operation(scan, status, now_us);
    }
    /* Judging the PROMs takes longer than a transfer: the next operation's deadlines must count
     * from a fresh time. */
    break;
  }
  return now_us;
}

static void use_temperature(struct scan *scan, const struct scan_slot *slot) {
  scan->has_thermal &= ~slot->prom_changed;
  scan->renewed |= slot->prom_changed;
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    if (!(slot->good & bit)) {
      continue;
    }
    const struct ms5840_thermal *last = &scan->thermal[k];
    bool has_last = scan->has_thermal & bit;
    struct ms5840_thermal thermal;
    ms5840_compensate_temperature(&scan->prom[k], slot->code[k],
                                  has_last ? last->branch : MS5840_BRANCH_UNKNOWN, &thermal);
    int32_t step_cC = thermal.first_order_cC - last->first_order_cC;
    bool jumped = step_cC > TEMPERATURE_STEP_MAX_cC || step_cC < -TEMPERATURE_STEP_MAX_cC;
    if (has_last && jumped && !(scan->doubted & bit)) {
      scan->doubted |= bit;
      set(&scan->temperature_doubted, 1);
      continue;
    }
    scan->doubted &= ~bit;
    scan->thermal[k] = thermal;
    scan->has_thermal |= bit;
  }
}

static void fill_frame(struct scan *scan, const struct scan_slot *slot, struct frame *frame) {
  memset(frame, 0, sizeof *frame);
  frame->number = slot->number;
  frame->t_us = slot->t_us;
  frame->t_begin_us = slot->t_begin_us;
  frame->t_converted_us = slot->t_converted_us;
  frame->t_read_us = slot->t_read_us;
  frame->sensor_count = scan->sensor_count;
  frame->noise_Pa_q10 = slot->noise_Pa_q10;
  frame->renewed = scan->renewed;
  scan->renewed = 0;
  int32_t temperature_sum_cC = 0;
  int32_t temperatures = 0;
  for (uint8_t k = 0; k < scan->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    if (scan->has_thermal & bit) {
      temperature_sum_cC += scan->thermal[k].temperature_cC;
      temperatures++;
    }
    if (!(slot->good & scan->has_thermal & bit)) {
      continue;
    }
    frame->pressure_Pa_q10[k] = ms5840_compensate_pressure(&scan->thermal[k], slot->code[k]);
    frame->valid |= bit;
    if (frame->pressure_Pa_q10[k] > MS5840_MAX_PRESSURE_Pa * 1024) {
      frame->saturated |= bit;
    }
  }
  if (temperatures > 0) {
    frame->temperature_cC = (int16_t)(temperature_sum_cC / temperatures);
  }
}

bool scan_take(struct scan *scan, struct frame *frame) {
  if (!atomic_load_explicit(&scan->slot_full, memory_order_acquire)) {
    return false;
  }
  bool is_frame = !scan->slot.is_temperature;
  if (is_frame) {
    fill_frame(scan, &scan->slot, frame);
  } else {
    use_temperature(scan, &scan->slot);
  }
  atomic_store_explicit(&scan->slot_full, 0, memory_order_release);
  return is_frame;
}
