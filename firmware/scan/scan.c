#include "scan/scan.h"

#include <string.h>

/* Supply and sensors settle: power-on reset of the family takes under 10 ms (recalled). */
#define POWER_UP_us 10000u
#define TEMPERATURE_INTERVAL_us (SCAN_TEMPERATURE_INTERVAL_ms * 1000u)
#define TEMPERATURE_INTERVAL_MAX_us (SCAN_TEMPERATURE_INTERVAL_MAX_ms * 1000u)
/* After a temperature reading that a sensor missed. */
#define TEMPERATURE_RETRY_us 100000u
#define TEMPERATURE_AT_ONCE_us 1u
/* How soon a temperature that was not taken is tried again. */
#define SLOT_POLL_us 1000u
/* How soon a new rate is noticed while waiting for the next frame of the old one. */
#define RATE_POLL_us 10000u
/* How soon the end of a rest is noticed. */
#define REST_POLL_us 10000u
#define RECOVERY_DELAY_MIN_us 10000u
#define RECOVERY_DELAY_MAX_us 1000000u
/* Transitions in one call: enough for the longest run of states that take no time. */
#define MAX_TRANSITIONS 8
/* A sensor that loses count of the clocks finds its byte not acknowledged and sends no more: what follows reads as
 * ones. All of it does when a sensor missed the command to read, or is far beyond its range; then it is the same again.
 * One code in 65536 ends in sixteen of them by chance, and counts if it is near the sensor's last one, as a torn one
 * hardly is; and one frame of fifteen sensors in three million has four that end in eight. */
#define TORN_MASK 0xFFFFu
#define TORN_TOLERANCE 1024u /* some 45 Pa; two readings at OSR 256 differ by 16 Pa rms */
#define TORN_BYTE 0xFFu
#define TORN_BYTE_SENSORS 4u
#define CODE_MAX 0xFFFFFFu

static void set(_Atomic uint32_t *to, uint32_t value) { atomic_store_explicit(to, value, memory_order_relaxed); }

static void set_map(struct scan_map *to, sensor_map value) {
  for (unsigned i = 0; i < sizeof to->words / sizeof to->words[0]; i++) {
    set(&to->words[i], (uint32_t)(value >> (32 * i)));
  }
}

static void count(_Atomic uint32_t *counter, uint32_t amount) { set(counter, scan_read(counter) + amount); }

/* An interrupt and what it interrupts share one core: the compiler alone must keep the order. */
static void hand_over(_Atomic uint32_t *state, enum scan_slot_state to) {
  atomic_signal_fence(memory_order_seq_cst);
  set(state, to);
}

static const struct ms58xx_osr *get_osr(const struct scan *scan) { return atomic_load_explicit(&scan->osr, memory_order_relaxed); }

enum ft_status scan_init(struct scan *scan, const struct array_bus *bus, const struct scan_settings *settings) {
  if (settings->sensor_count < 1 || settings->sensor_count > FT_MAX_SENSORS || !ms58xx_find_osr(settings->osr)) {
    return FT_ERR_ARGUMENT;
  }
  memset(scan, 0, sizeof *scan);
  scan->bus = bus;
  scan->sensor_count = settings->sensor_count;
  scan->conversion = &scan->conversions[0];
  scan_set_osr(scan, settings->osr);
  scan->conversion->osr = get_osr(scan);
  scan_set_rate_mHz(scan, settings->rate_mHz);
  scan->state = SCAN_WAIT_POWER;
  scan->wait_until_us = POWER_UP_us;
  scan->recovery_delay_us = RECOVERY_DELAY_MIN_us;
  bring_up_init(&scan->bring_up, settings->sensor_count);
  set(&scan->temperature_interval_us, TEMPERATURE_INTERVAL_us);
  scan->readings.presses_are_shared = settings->presses_are_shared;
  return FT_OK;
}

enum ft_status scan_set_osr(struct scan *scan, uint16_t osr) {
  const struct ms58xx_osr *found = ms58xx_find_osr(osr);
  if (!found) {
    return FT_ERR_ARGUMENT;
  }
  atomic_store_explicit(&scan->osr, found, memory_order_relaxed);
  return FT_OK;
}

void scan_set_rate_mHz(struct scan *scan, uint32_t rate_mHz) { set(&scan->period_us, rate_mHz == 0 ? 0 : 1000000000u / rate_mHz); }

void scan_rest(struct scan *scan, bool resting) { set(&scan->must_rest, resting); }

static void wait_in(struct scan *scan, enum scan_state state, uint64_t until_us) {
  scan->state = state;
  scan->wait_until_us = until_us;
}

static void enter(struct scan *scan, enum scan_state state) {
  scan->state = state;
  scan->operation_running = false;
}

static void convert(struct scan *scan, bool is_temperature, bool is_frame) {
  scan->conversion->is_temperature = is_temperature;
  scan->conversion->is_frame = is_frame;
  enter(scan, SCAN_CONVERT);
}

static void begin_bring_up(struct scan *scan, uint64_t now_us) {
  const sensor_map admitted = scan_read_map(&scan->admitted);
  const sensor_map suspects = scan_read_map(&scan->suspects) & admitted;
  set_map(&scan->admitted, admitted & ~suspects);
  bring_up_begin(&scan->bring_up, suspects != 0, now_us);
  enter(scan, SCAN_RESET);
}

static void end_bring_up(struct scan *scan) {
  const struct bring_up_result result = bring_up_end(&scan->bring_up);
  scan->returned |= result.admitted & ~scan_read_map(&scan->admitted);
  set_map(&scan->admitted, result.admitted);
  set_map(&scan->prom_bad, result.bad);
  set(&scan->temperature_within_us, 0); /* the next conversion is one */
  scan->void_next = 0;
  scan->was_zero = 0;
  scan->zero_seen = 0;
  scan->missed_once = 0;
  scan->missed_twice = 0;
  convert(scan, true, false);
}

/* Where the codes of this conversion go; NULL while the main context reads the last ones. */
static struct scan_slot *slot_for(struct scan *scan, const struct scan_conversion *conversion) {
  if (conversion->is_temperature) {
    return scan_read(&scan->temperature_state) == SCAN_SLOT_EMPTY ? &scan->temperature_slot : NULL;
  }
  return scan_read(&scan->slot_state) == SCAN_SLOT_CLAIMED ? NULL : &scan->slot;
}

static bool is_near(uint32_t code, uint32_t last) { return code - last + TORN_TOLERANCE <= 2 * TORN_TOLERANCE; }

/* Judges what came of the last conversion of each sensor, for its admission and for the next
 * reading. Returns the bitmap of those whose reading counts, if its code does. */
static sensor_map judge_answers(struct scan *scan, sensor_map heard, sensor_map zero) {
  const bool single = scan->bus->answers_are_single;
  const sensor_map acknowledged = scan->result.acknowledged & first_sensors(scan->sensor_count);
  sensor_map admitted = scan_read_map(&scan->admitted);
  const sensor_map answered = admitted & acknowledged & heard;
  const sensor_map missed = admitted & ~answered;
  const sensor_map unusable = answered & (zero | scan->void_next);
  zero &= answered;
  admitted &= ~(missed & scan->missed_twice); /* the third in a row */
  admitted &= ~(single || (zero & (zero - 1)) ? zero : zero & scan->was_zero);
  scan->missed_twice = missed & scan->missed_once;
  scan->missed_once = missed;
  scan->was_zero = zero;
  /* What was not read is still there to be read, and the sensor may miss the next command. */
  scan->void_next = single ? 0 : zero | (missed & ~acknowledged);
  scan->wants_admission = (acknowledged & ~admitted) != 0 || admitted == 0 || bring_up_wants_recheck(&scan->bring_up);
  count(&scan->counters.zero_readings, count_sensors(unusable));
  set_map(&scan->present, acknowledged);
  set_map(&scan->admitted, admitted);
  return answered & ~unusable;
}

/* A sensor that measures never has the same code so often. Returns the bitmap of those that do. */
static __attribute__((noinline, cold)) sensor_map find_frozen(struct scan *scan, sensor_map same) {
  for (unsigned n = SCAN_STILL - 1; n > 0; n--) {
    scan->still[n] = scan->still[n - 1] & same;
  }
  scan->still[0] = same;
  const sensor_map frozen = scan->still[SCAN_STILL - 1];
  set_map(&scan->admitted, scan_read_map(&scan->admitted) & ~frozen);
  scan->wants_admission = scan->wants_admission || frozen;
  return frozen;
}

/* Judges the codes in scan->result. Returns the bitmap of those that are measurements. */
static sensor_map take_codes(struct scan *scan, const struct scan_conversion *conversion, uint32_t codes[]) {
  sensor_map zero = 0;
  sensor_map torn = 0;
  sensor_map ends_in_ones = 0;
  sensor_map same = 0;
  sensor_map bit = 1;
  const uint8_t(*bytes)[ARRAY_BUS_MAX_READ_BYTES] = scan->result.bytes;
  for (int left = scan->sensor_count; left > 0; left--, bit <<= 1, bytes++) {
    uint32_t low = (*bytes)[2];
    uint32_t code = (uint32_t)(*bytes)[0] << 16 | (uint32_t)(*bytes)[1] << 8 | low;
    if (code == 0) {
      zero |= bit;
    } else if (low == TORN_BYTE) {
      if (code != CODE_MAX) {
        ends_in_ones |= bit;
        if ((code & TORN_MASK) == TORN_MASK && !(codes && is_near(code, *codes))) {
          torn |= bit;
          code = codes ? *codes : 0; /* the next is held against the last that was whole */
        }
      } else if (conversion->is_temperature) {
        zero |= bit;
      } else if (!codes || *codes != CODE_MAX) {
        torn |= bit;
      }
    } else if (codes && code == *codes) {
      same |= bit;
    }
    if (codes) {
      *codes++ = code;
    }
  }
  const sensor_map usable = judge_answers(scan, conversion->heard, zero);
  ends_in_ones &= usable;
  torn &= usable;
  if (ends_in_ones != 0 && count_sensors(ends_in_ones) >= TORN_BYTE_SENSORS) {
    torn |= ends_in_ones;
  }
  scan->void_next |= scan->bus->answers_are_single ? 0 : torn;
  count(&scan->counters.bus_nacks, count_sensors(torn));
  const sensor_map good = usable & ~torn;
  return codes && !conversion->is_temperature ? good & ~find_frozen(scan, good & same) : good;
}

static __attribute__((noinline)) void take_reading(struct scan *scan, const struct scan_conversion *conversion) {
  struct scan_slot *slot = slot_for(scan, conversion);
  sensor_map good = take_codes(scan, conversion, slot ? slot->code : NULL);
  scan->zero_seen |= conversion->is_temperature ? 0 : scan->was_zero; /* what has no temperature is asked for one anyway */
  if (conversion->is_frame) {
    count(&scan->counters.frames, 1);
    if (good != first_sensors(scan->sensor_count)) {
      count(&scan->counters.frames_incomplete, 1);
    }
    if (!slot || (!conversion->is_temperature && scan_read(&scan->slot_state) == SCAN_SLOT_FULL)) {
      count(&scan->counters.frames_skipped, 1);
    }
  }
  if (conversion->is_temperature) {
    if (!slot || good != scan_read_map(&scan->admitted)) {
      scan->next_temperature_us = conversion->t_begin_us + TEMPERATURE_RETRY_us;
    }
  }
  if (!slot) {
    return;
  }
  slot->conversion = *conversion;
  slot->good = good;
  if (conversion->is_temperature) {
    slot->prom_changed = scan->bring_up.changed;
    slot->returned = scan->returned;
    scan->bring_up.changed = 0;
    scan->returned = 0;
  } else {
    slot->still = scan->still[0];
    slot->zero = (scan_read(&scan->slot_state) == SCAN_SLOT_FULL ? slot->zero : 0) | scan->zero_seen;
    scan->zero_seen = 0;
  }
  hand_over(conversion->is_temperature ? &scan->temperature_state : &scan->slot_state, SCAN_SLOT_FULL);
}

static bool temperature_waits(const struct scan *scan) { return scan_read(&scan->temperature_state) != SCAN_SLOT_EMPTY; }

static uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

static void obey_wish(struct scan *scan, uint64_t now_us) {
  uint32_t within_us = scan_read(&scan->temperature_within_us);
  if (temperature_waits(scan) || within_us == 0) {
    return;
  }
  set(&scan->temperature_within_us, 0);
  scan->next_temperature_us = earlier(scan->next_temperature_us, now_us + within_us - 1);
}

/* When to convert the temperature in the pause before the next frame; UINT64_MAX: not in this one,
 * because it is not due or the pause is too short. */
static uint64_t temperature_in_pause_us(const struct scan *scan, uint64_t now_us) {
  uint32_t slot_us = scan->overhead_us + get_osr(scan)->conversion_us;
  if (scan->next_temperature_us > scan->next_frame_us || scan->next_frame_us - now_us < slot_us + slot_us / 16) {
    return UINT64_MAX;
  }
  return scan->next_frame_us - slot_us - slot_us / 8;
}

/* Between two operations: true if none is to follow for now. */
static bool rest(struct scan *scan, uint64_t now_us) {
  const bool rests = scan_read(&scan->must_rest) != 0;
  set(&scan->rests, rests);
  if (rests) {
    scan->wait_until_us = now_us + REST_POLL_us;
  }
  return rests;
}

/* Decides what comes next once the last reading is here. */
static void leave_idle(struct scan *scan, uint64_t now_us) {
  if (rest(scan, now_us)) {
    return;
  }
  /* A temperature that was read just now still has to go into its slot. */
  bool prom_is_free = !temperature_waits(scan) && !scan->last_was_temperature;
  const bool wants_admission = scan->wants_admission || (scan_read_map(&scan->suspects) & scan_read_map(&scan->admitted)) != 0;
  if (wants_admission && now_us >= scan->bring_up.next_us && prom_is_free) {
    begin_bring_up(scan, now_us);
    return;
  }
  obey_wish(scan, now_us);
  uint32_t period_us = scan_read(&scan->period_us);
  if (period_us != 0) {
    if (scan->next_frame_us > now_us + period_us) {
      scan->next_frame_us = now_us; /* the rate was raised */
    }
    if (now_us < scan->next_frame_us) {
      uint64_t temperature_us = temperature_in_pause_us(scan, now_us);
      if (temperature_us <= now_us) {
        convert(scan, true, false);
      } else {
        scan->wait_until_us = earlier(earlier(scan->next_frame_us, temperature_us), now_us + RATE_POLL_us);
      }
      return;
    }
    bool late = now_us - scan->next_frame_us > period_us;
    scan->next_frame_us = (late ? now_us : scan->next_frame_us) + period_us;
  }
  convert(scan, now_us >= scan->next_temperature_us, true);
}

static enum ft_status start_operation(struct scan *scan, uint64_t now_us) {
  const struct array_bus *bus = scan->bus;
  struct scan_conversion *conversion = scan->conversion;
  switch (scan->state) {
  case SCAN_RESET: return bus->start_command(bus->context, MS58XX_CMD_RESET, now_us);
  case SCAN_READ_PROM: return bus->start_read(bus->context, (uint8_t)(MS58XX_CMD_READ_PROM + 2 * scan->bring_up.word), 2, now_us);
  case SCAN_CONVERT:
    conversion->osr = get_osr(scan);
    conversion->t_begin_us = now_us;
    if (conversion->is_temperature) {
      scan->next_temperature_us = now_us + scan_read(&scan->temperature_interval_us);
    }
    return bus->start_command(
        bus->context, conversion->is_temperature ? conversion->osr->convert_temperature : conversion->osr->convert_pressure, now_us);
  case SCAN_READ_ADC: conversion->t_converted_us = now_us; return bus->start_read(bus->context, MS58XX_CMD_READ_ADC, 3, now_us);
  default: return bus->start_recovery(bus->context, now_us);
  }
}

static void fail_operation(struct scan *scan, enum ft_status why, uint64_t now_us) {
  set_map(&scan->present, 0);
  if (why == FT_ERR_STUCK) {
    set_map(&scan->admitted, 0);
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
  return state == SCAN_RESET || state == SCAN_READ_PROM || state == SCAN_CONVERT || state == SCAN_READ_ADC || state == SCAN_RECOVER;
}

/* Starts what the state asks for, if it asks for anything. */
static void begin_operation(struct scan *scan, uint64_t now_us) {
  if (!state_has_operation(scan->state)) {
    return;
  }
  if (scan->state == SCAN_RECOVER) {
    count(&scan->counters.bus_recoveries, 1);
  }
  if (start_operation(scan, now_us) == FT_OK) {
    scan->operation_running = true;
  } else {
    fail_operation(scan, FT_ERR_TIMEOUT, now_us);
  }
}

/* The codes are in scan->result, and stay there while the next operation runs: nothing is done before that but what it needs. */
static void end_reading(struct scan *scan, uint64_t now_us) {
  struct scan_conversion *read = scan->conversion;
  scan->last_was_temperature = read->is_temperature;
  scan->conversion = &scan->conversions[read == &scan->conversions[0]];
  scan->conversion->osr = read->osr;
  wait_in(scan, SCAN_IDLE, now_us);
  leave_idle(scan, now_us);
  begin_operation(scan, now_us);

  read->t_read_us = now_us;
  read->number = scan->frame_number;
  scan->frame_number += read->is_frame;
  scan->overhead_us = (uint32_t)(now_us - read->t_begin_us) - read->osr->conversion_us;
  take_reading(scan, read);
}

/* From the end of the command to the start of the read. The conversion has its longest time until
 * the sensors see the read's command, and its maximum until the START. */
static uint32_t read_after_us(const struct scan *scan) {
  const struct ms58xx_osr *osr = scan->conversion->osr;
  uint32_t after_us = osr->conversion_us - scan->bus->read_lead_us;
  return after_us > osr->maximum_us ? after_us : osr->maximum_us;
}

static void end_operation(struct scan *scan, uint64_t now_us) {
  switch (scan->state) {
  case SCAN_RESET:
    bring_up_take_reset(&scan->bring_up, scan->result.acknowledged);
    wait_in(scan, SCAN_WAIT_RESET, now_us + MS58XX_RESET_us);
    break;
  case SCAN_READ_PROM:
    if (bring_up_take_word(&scan->bring_up, &scan->result)) {
      enter(scan, SCAN_READ_PROM);
    } else {
      end_bring_up(scan);
    }
    break;
  case SCAN_CONVERT:
    scan->conversion->heard = scan->result.acknowledged;
    scan->conversion->t_us = now_us + scan->conversion->osr->conversion_us / 2u;
    wait_in(scan, SCAN_WAIT_CONVERSION, now_us + read_after_us(scan));
    break;
  case SCAN_READ_ADC: end_reading(scan, now_us); break;
  default: /* SCAN_RECOVER: a conversion may still be running, and a command would spoil it */
    scan->bus_stuck = false;
    scan->recovery_delay_us = RECOVERY_DELAY_MIN_us;
    wait_in(scan, SCAN_WAIT_RECOVERY, now_us + scan->conversion->osr->conversion_us);
    break;
  }
}

static void end_wait(struct scan *scan, uint64_t now_us) {
  switch (scan->state) {
  case SCAN_WAIT_POWER:
    if (!rest(scan, now_us)) {
      begin_bring_up(scan, now_us);
    }
    break;
  case SCAN_WAIT_RESET: enter(scan, SCAN_READ_PROM); break;
  case SCAN_WAIT_CONVERSION: enter(scan, SCAN_READ_ADC); break;
  case SCAN_WAIT_RECOVERY:
    if (rest(scan, now_us)) {
      break;
    }
    if (scan->bus_stuck) {
      enter(scan, SCAN_RECOVER);
    } else if (temperature_waits(scan)) {
      scan->wait_until_us = now_us + SLOT_POLL_us;
    } else {
      begin_bring_up(scan, now_us);
    }
    break;
  default: leave_idle(scan, now_us); break;
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
    if (!scan->operation_running) {
      begin_operation(scan, now_us);
      continue;
    }
    uint64_t wake_us = now_us + SLOT_POLL_us;
    enum ft_status status = scan->bus->poll(scan->bus->context, now_us, &scan->result, &wake_us);
    if (status == FT_PENDING) {
      return wake_us;
    }
    scan->operation_running = false;
    if (status != FT_OK) {
      fail_operation(scan, status, now_us);
      continue;
    }
    bool was_prom = scan->state == SCAN_READ_PROM;
    end_operation(scan, now_us);
    count(&scan->counters.bus_nacks, scan->result.nacks);
    if (was_prom && scan->state != SCAN_READ_PROM) {
      /* Judging the PROMs takes longer than a transfer: the next operation's deadlines must count from a fresh time. */
      break;
    }
  }
  return now_us;
}

/* Sets when the next reading is wanted, if not as planned. */
static void adapt_interval(struct scan *scan, uint32_t news) {
  uint32_t interval_us = scan_read(&scan->temperature_interval_us);
  if (news != 0) {
    set(&scan->temperature_interval_us, TEMPERATURE_INTERVAL_us);
    set(&scan->temperature_within_us, news & READINGS_ASK_AGAIN ? TEMPERATURE_AT_ONCE_us : TEMPERATURE_INTERVAL_us);
  } else if (interval_us < TEMPERATURE_INTERVAL_MAX_us) {
    set(&scan->temperature_interval_us, 2 * interval_us);
  }
}

static void use_temperature(struct scan *scan, const struct scan_slot *slot) {
  const uint32_t apart_us = (uint32_t)(slot->conversion.t_us - scan->temperature_us);
  const struct readings_temperature taken = {
      .prom = scan->bring_up.prom,
      .code = slot->code,
      .good = slot->good,
      .prom_changed = slot->prom_changed,
      .returned = slot->returned,
      .prom_bad = scan_read_map(&scan->prom_bad),
      .admitted = scan_read_map(&scan->admitted),
      /* Six times what a hand warms, without a remainder that is lost each time. */
      .warmed_cC = (int32_t)((uint32_t)(slot->conversion.t_us >> 14) - (uint32_t)(scan->temperature_us >> 14)),
      .is_soon = TEMPERATURE_INTERVAL_us > apart_us,
      .is_patient = scan->bring_up.interval_us > 1000000u,
  };
  scan->temperature_us = slot->conversion.t_us;
  adapt_interval(scan, readings_take_temperature(&scan->readings, scan->sensor_count, &taken));
}

static void fill_head(struct scan *scan, const struct scan_conversion *conversion, struct frame *frame) {
  frame->held = conversion->is_temperature;
  frame->number = conversion->number;
  frame->t_us = conversion->t_us;
  frame->t_begin_us = conversion->t_begin_us;
  frame->t_converted_us = conversion->t_converted_us;
  frame->t_read_us = conversion->t_read_us;
  frame->sensor_count = scan->sensor_count;
  frame->noise_Pa_q10 = conversion->osr->noise_Pa_q10;
  frame->temperature_cC = scan->readings.temperature_cC;
}

/* What scan_step is to know. Before a slot is given back: no admission begins while a temperature waits, and none is asked for twice. */
static void report(struct scan *scan) {
  set_map(&scan->suspects, scan->readings.suspects);
  set(&scan->counters.implausible_readings, scan->readings.left_out);
}

static bool claim(_Atomic uint32_t *state) {
  if (scan_read(state) != SCAN_SLOT_FULL) {
    return false;
  }
  set(state, SCAN_SLOT_CLAIMED);
  atomic_signal_fence(memory_order_seq_cst);
  return true;
}

/* A temperature applies to the frames after it. The frame is claimed while the two are compared:
 * else a newer one could take its place and overtake the temperature. */
bool scan_take(struct scan *scan, struct frame *frame) {
  const struct scan_conversion *temperature = &scan->temperature_slot.conversion;
  const bool waits = temperature_waits(scan);
  bool claimed = claim(&scan->slot_state);
  const bool frame_is_older = claimed && (int32_t)(scan->slot.conversion.number - temperature->number) < 0;
  if (waits && !frame_is_older) {
    if (claimed) {
      hand_over(&scan->slot_state, SCAN_SLOT_FULL);
    }
    claim(&scan->temperature_state);
    const bool is_frame = temperature->is_frame;
    use_temperature(scan, &scan->temperature_slot);
    if (is_frame) {
      fill_head(scan, temperature, frame);
      frame->doubtful |= frame->valid & scan->readings.doubtful;
    }
    report(scan);
    hand_over(&scan->temperature_state, SCAN_SLOT_EMPTY);
    if (is_frame) {
      return true;
    }
    claimed = claim(&scan->slot_state);
  }
  if (!claimed) {
    return false;
  }
  fill_head(scan, &scan->slot.conversion, frame);
  struct readings *readings = &scan->readings;
  const bool asked = readings->asks;
  readings->jolted = readings->jolted || (scan->slot.zero | (readings->counted & ~scan_read_map(&scan->admitted))) != 0;
  readings->still = scan->slot.still;
  if (readings_take_pressures(readings, scan->slot.code, scan->slot.good, frame)) {
    report(scan);
  }
  if (readings->asks && !asked) {
    set(&scan->temperature_within_us, TEMPERATURE_AT_ONCE_us);
  }
  hand_over(&scan->slot_state, SCAN_SLOT_EMPTY);
  return true;
}
