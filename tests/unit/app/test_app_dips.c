/* Supplies of sensors that dip amid a press: one to all of them, at any phase of a frame, behind multiplexers and with
 * a data line each. In the environment DIPS, "EVERY SEED": each EVERYth of the cases where the codes step, and a
 * fifth as many where they do something else, on sensors drawn by SEED. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "support/random.h"

#include <stdlib.h>

#define FORCE_N 5.5
#define RAW_MAX_Pa 2500.0 /* a tenth of the press's peak */
enum { SHARES = 6, PHASES = 16, EVERY = 61, FEWER = 5, FOLLOWED_ms = 2500, RESET_MAX_ms = 30, AGAIN_ms = 40, RAMP_ms = 200 };

/* What the codes do: step, go to their share and no conversion is lost, the same with the conversion, stay as at rest, step again. */
enum kind { STEP, RAMP, LOSS_AND_RAMP, FREEZE, TWICE, KINDS };
static const char *const kinds[] = {"step", "ramp", "loss_and_ramp", "freeze", "twice"};

static const double shares[SHARES] = {0.5, 0.7, 0.83, 0.9375, 0.97, 1.03}; /* of the true codes */
static const uint32_t warnings = CONTACT_FLAG_SENSOR_DOUBTFUL | CONTACT_FLAG_ZERO_DOUBTFUL | CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL |
                                 CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT | CONTACT_FLAG_LOW_SIGNAL;

struct found {
  unsigned cases, wrong_unflagged_frames, false_slips, raw_valid_wrong, reset_ms_max, never_trusted;
};

static double scale = 1.0; /* of all pressures */
static double scaled_pressure_Pa(void *context, unsigned sensor, uint64_t t_us) { return scale * world_pressure_Pa(context, sensor, t_us); }

static void press_for(double force_N, uint32_t idle_ms, uint32_t ms) {
  rig_start();
  array.world.pressure_Pa = scaled_pressure_Pa;
  press.force_N = force_N;
  press.x_mm = 2.1;
  press.y_mm = 3.3;
  press.from_us = 1000 * idle_ms + 300000;
  connect_for(idle_ms);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(ms);
}

/* Fewer than four sensors give no force, and say so. */
static bool is_wrong(const struct wire_contact *contact, bool few_are_left) {
  const uint32_t excuses = warnings | (few_are_left ? CONTACT_FLAG_SENSOR_MASKED : 0);
  if (!(contact->flags & CONTACT_FLAG_FIT_VALID)) {
    return !(contact->flags & excuses);
  }
  return !(contact->flags & warnings) && (fabs((double)contact->force_N - FORCE_N) > 0.1 * FORCE_N ||
                                          hypot((double)contact->x_mm - press.x_mm, (double)contact->y_mm - press.y_mm) > 0.6);
}

static void dip_one(enum kind kind, unsigned k, double share) {
  struct sim_ms5840 *sensor = &array.sensor[k];
  const struct sim_ms5840 before = *sensor;
  sim_ms5840_brown_out(sensor);
  if (kind == RAMP) {
    *sensor = before;
    sensor->untrimmed = true;
  }
  sensor->share = kind == STEP || kind == TWICE ? share : 1.0;
  array.d1[k] = kind == FREEZE ? sim_ms5840_d1(sensor->prom, AMBIENT_Pa, sim_ms5840_d2(sensor->prom, 25.0)) : 0;
}

static void follow_one(enum kind kind, unsigned k, double share, unsigned ms) {
  struct sim_ms5840 *sensor = &array.sensor[k];
  array.d1[k] = sensor->untrimmed ? array.d1[k] : 0;
  if (kind == RAMP || kind == LOSS_AND_RAMP) {
    sensor->share = ms < RAMP_ms ? 1.0 + (share - 1.0) * ms / RAMP_ms : share;
  } else if (kind == TWICE && ms == AGAIN_ms) {
    dip_one(kind, k, share);
  }
}

/* The zero of a sensor that was tared in the five seconds before is taken again after the contact (condition.h). */
static void dip(enum kind kind, uint32_t idle_ms, unsigned count, unsigned first, uint32_t phase_us, double share, struct found *found) {
  const uint8_t sensors = geometry.sensor_count;
  press_for(FORCE_N, idle_ms, 1500);
  native_run_until(port_now_us() + phase_us, main_round, &app);
  drop_packets();
  for (unsigned k = first; k < first + count; k++) {
    dip_one(kind, k % sensors, share);
  }
  unsigned reset_ms = 0;
  bool trusted = false;
  for (unsigned ms = 1; ms <= FOLLOWED_ms; ms++) {
    for (unsigned k = first; k < first + count; k++) {
      follow_one(kind, k % sensors, share, ms);
    }
    run_for(1);
    for (unsigned k = 0; k < sensors; k++) {
      reset_ms = array.sensor[k].untrimmed ? ms + 1 : reset_ms;
    }
    for (struct wire_packet p; next_packet(&p);) {
      if (p.type == WIRE_CONTACT) {
        trusted = (p.body.contact.flags & (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_SENSOR_MASKED | warnings)) == CONTACT_FLAG_FIT_VALID;
        found->wrong_unflagged_frames += is_wrong(&p.body.contact, sensors - count < 4);
        found->false_slips += (p.body.contact.flags & CONTACT_FLAG_SLIP) != 0;
      }
      const sensor_map believed = p.type == WIRE_RAW ? p.body.raw.valid & ~p.body.raw.doubtful : 0;
      for (unsigned k = 0; k < sensors; k++) {
        const double off_Pa = p.body.raw.pressure_Pa_q10[k] / 1024.0 - world_pressure_Pa(NULL, k, port_now_us());
        found->raw_valid_wrong += (believed >> k & 1) && fabs(off_Pa) > RAW_MAX_Pa;
      }
    }
  }
  found->reset_ms_max = reset_ms > found->reset_ms_max ? reset_ms : found->reset_ms_max;
  found->never_trusted += !trusted && idle_ms > 5000;
  found->cases++;
}

TEST(dips_are_found_and_no_frame_is_wrong_without_a_warning) {
  unsigned every = EVERY;
  unsigned long long seed = 1;
  const char *asked = getenv("DIPS");
  TEST_ASSERT_TRUE(!asked || sscanf(asked, "%u %llu", &every, &seed) == 2);
  struct random random = {seed};
  for (unsigned i = 0; i < KINDS * 2 * SHARES; i++) {
    const unsigned share = i / 2 % SHARES, kind = i / 2 / SHARES;
    struct found found = {0};
    rig_is_parallel = i % 2;
    for (unsigned n = 0; n < 15 * PHASES; n++) {
      const unsigned first = random_below(&random, geometry.sensor_count), phases_us = rig_is_parallel ? 2460 : 4900;
      if ((15 * PHASES * i + n + seed) % (kind == STEP ? every : FEWER * every) == 0) {
        dip((enum kind)kind, n % 3 ? 5600 : 600, 1 + n / PHASES, first, n % PHASES * phases_us / PHASES + 1, shares[share], &found);
      }
    }
    printf("{\"board\":\"%s\",\"kind\":\"%s\",\"share\":%.4f,\"cases\":%u,\"wrong_unflagged_frames\":%u,\"false_slips\":%u,"
           "\"raw_valid_wrong\":%u,\"reset_ms_max\":%u,\"never_trusted\":%u}\n",
           i % 2 ? "pico_parallel" : "pico_mux", kinds[kind], shares[share], found.cases, found.wrong_unflagged_frames, found.false_slips,
           found.raw_valid_wrong, found.reset_ms_max, found.never_trusted);
    TEST_ASSERT_TRUE(asked || found.wrong_unflagged_frames + found.false_slips == 0);
    TEST_ASSERT_TRUE(asked || kind != STEP || (found.cases > 0 && found.raw_valid_wrong + found.never_trusted == 0));
    TEST_ASSERT_TRUE(asked || kind != STEP || found.reset_ms_max <= RESET_MAX_ms); /* a slow ramp is not found as soon */
  }
}

/* Parts of another range read a twentieth. */
TEST(an_array_of_another_range_is_not_trusted) {
  scale = 0.05;
  press_for(20.0, 600, 2500);
  unsigned trusted = 0, frames = 0;
  for (struct wire_packet p; next_of_type(WIRE_CONTACT, &p); frames++) {
    trusted += (p.body.contact.flags & (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_SENSOR_DOUBTFUL)) == CONTACT_FLAG_FIT_VALID;
  }
  printf("{\"wrong_range_frames\":%u,\"wrong_range_trusted\":%u}\n", frames, trusted);
  TEST_ASSERT_EQUAL(0, trusted);
  TEST_ASSERT_GREATER_THAN(100, frames);
  scale = 1.0;
}
