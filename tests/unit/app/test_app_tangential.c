/* Tangential load, from sensors to packets: on the pad that the profile describes. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "support/pad.h"

/* What the object does to the rubber. */
static struct {
  double force_N, qx_N, qy_N;
  double later_qx_N; /* from later_us on */
  uint64_t later_us;
} load;

static struct pad_profile pad;

static double field_Pa(double dx_mm, double dy_mm, uint64_t t_us) {
  const double qx_N = load.later_us != 0 && t_us >= load.later_us ? load.later_qx_N : load.qx_N;
  return pad_pressure_Pa(&pad, 4.0, dx_mm, dy_mm, (struct pad_load){load.force_N, qx_N, load.qy_N});
}

void setUp(void) {
  rig_start();
  world_field_Pa = field_Pa;
  pad = pad_of_12_mm();
  memset(&load, 0, sizeof load);
  press.force_N = load.force_N = 5.0;
  press.x_mm = 1.5;
  press.y_mm = -4.0;
  press.from_us = 1500000;
}

void tearDown(void) {
  rig_end();
  native_set_worker(false, 0);
}

static void store_pad(void) {
  connect_for(300);
  obey(COMMAND(PAD, pad, pad));
}

/* The last contact packet of the time until t_us; its flags hold for all from from_us on. */
static struct wire_contact last_contact(uint64_t from_us, uint64_t t_us, uint32_t high, uint32_t low) {
  struct wire_packet packet;
  struct wire_contact last;
  memset(&last, 0, sizeof last);
  start_streams(WIRE_STREAM_CONTACT);
  run_for((uint32_t)((t_us - port_now_us()) / 1000));
  unsigned count = 0;
  while (next_packet(&packet)) {
    if (packet.type == WIRE_CONTACT && packet.t_us > from_us) {
      last = packet.body.contact;
      TEST_ASSERT_BITS_HIGH(high, last.flags);
      TEST_ASSERT_BITS_LOW(low, last.flags);
      const struct wire_stages *stages = &last.stages;
      TEST_ASSERT_EQUAL_UINT16(stages->convert_us + stages->read_us + stages->queue_us + stages->condition_us + stages->fit_us +
                                   stages->contact_us,
                               stages->total_us);
      count++;
    }
  }
  TEST_ASSERT_GREATER_THAN(10, count);
  return last;
}

static const uint32_t TANGENTIAL = CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_TANGENTIAL_FROM_TOUCH;

/* The Gaussian fit is pulled along by the load; with the profile it is not, and the load is told. */
TEST(a_profile_tells_the_load_and_corrects_the_location) {
  load.qx_N = 1.2;
  load.qy_N = -0.9;
  store_pad();
  struct wire_contact contact = last_contact(1600000, 1800000, CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_TANGENTIAL_FROM_TOUCH);
  TEST_ASSERT_FLOAT_WITHIN(0.15f, 1.2f, contact.qx_N);
  TEST_ASSERT_FLOAT_WITHIN(0.15f, -0.9f, contact.qy_N);
  TEST_ASSERT_FLOAT_WITHIN(0.03f, 0.3f, contact.tangential_ratio);
  TEST_ASSERT_FLOAT_WITHIN(0.2f, 5.0f, contact.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.2f, 1.5f, contact.x_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.2f, -4.0f, contact.y_mm);
  TEST_ASSERT_TRUE(app.found.fit.x_mm > 1.5f + 0.5f);
  TEST_ASSERT_TRUE(app.found.fit.y_mm < -4.0f - 0.4f);
  TEST_ASSERT_TRUE(contact.q_sd_N > 0.0f && contact.location_sd_mm > 0.0f);
  TEST_ASSERT_TRUE(app.found.fit.location_sd_mm < FIT_BIAS_ASSUMED_RATIO * 0.38f * 9.0f);
  TEST_ASSERT_FALSE(app.stages.uncertainty.force.known);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.p0_Pa, contact.p0_Pa);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.sigma_mm, contact.sigma_mm);
}

TEST(without_a_profile_there_is_none_and_the_fit_stays_as_it_is) {
  load.qx_N = 1.2;
  connect_for(300);
  TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
  struct wire_contact contact = last_contact(1600000, 1800000, CONTACT_FLAG_FIT_VALID, TANGENTIAL);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.x_mm, contact.x_mm);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.force_N, contact.force_N);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, contact.qx_N);
}

/* Until the readings have been looked at it is 0.2 of the force: for one frame where they are far apart. */
TEST(a_load_that_is_not_estimated_is_part_of_the_error) {
  for (int kind = 0; kind < 4; kind++) {
    const bool loaded = kind % 2 != 0, slow = kind < 2;
    load.qx_N = loaded ? 1.5 : 0.0;
    rig_power_up();
    connect_for(1300);
    obey(COMMAND(OSR, osr, slow ? 1024 : 256));
    start_streams(WIRE_STREAM_CONTACT);
    run_for(200);
    unsigned frames = 0;
    for (struct wire_packet packet; next_packet(&packet);) {
      const struct wire_contact *contact = &packet.body.contact;
      if (packet.type != WIRE_CONTACT || (contact->flags & (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_HELD)) != CONTACT_FLAG_FIT_VALID) {
        continue;
      }
      frames++;
      if (!slow && frames > FIT_BIAS_PARTS / 2 && frames <= FIT_BIAS_PARTS) {
        continue; /* so sudden a press asks for a temperature, which gives it time */
      }
      const bool uncertain = (contact->flags & CONTACT_FLAG_UNCERTAIN) != 0;
      if (frames <= (slow ? 1 : FIT_BIAS_PARTS)) {
        TEST_ASSERT_TRUE(contact->location_sd_mm > FIT_BIAS_ASSUMED_RATIO * 0.38f * 9.0f && uncertain);
      } else if (loaded) {
        TEST_ASSERT_FLOAT_WITHIN(0.4f, contact->x_mm - 1.5f, contact->location_sd_mm);
        TEST_ASSERT_TRUE(contact->x_mm > 2.2f && uncertain);
      } else {
        TEST_ASSERT_TRUE(contact->location_sd_mm < 0.6f && !uncertain);
      }
    }
    TEST_ASSERT_GREATER_THAN(FIT_BIAS_PARTS + 2, frames);
  }
}

/* One touch, of gains that are alike: what was assumed is less then, and stays so. */
TEST(touches_tell_the_gains_of_a_pad_without_a_calibration) {
  const uint16_t assumed_q16 = (uint16_t)(65536.0f * DEFAULT_GAIN_SD + 0.5f);
  connect_for(1400);
  TEST_ASSERT_EQUAL_UINT16(assumed_q16, app.stages.location.settings.gain_sd_q16[14]);
  run_for(400);
  const uint16_t learnt_q16 = app.stages.location.settings.gain_sd_q16[14];
  TEST_ASSERT_EQUAL_UINT16(learnt_q16, app.stages.location.settings.gain_sd_q16[0]);
  TEST_ASSERT_TRUE(learnt_q16 < 0.95f * assumed_q16 && learnt_q16 > 0.8f * assumed_q16);
  run_for(400);
  TEST_ASSERT_EQUAL_UINT16(learnt_q16, app.stages.location.settings.gain_sd_q16[14]);
  stages_use_calibration(&app.stages, &app.found, NULL); /* as after its erasure */
  TEST_ASSERT_EQUAL_UINT16(assumed_q16, app.stages.location.settings.gain_sd_q16[14]);
}

TEST(a_profile_outlives_power_until_it_is_erased) {
  store_pad();
  for (int restart = 0; restart < 2; restart++) {
    struct wire_info info = get_info();
    TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_PAD, info.stored);
    TEST_ASSERT_EQUAL_MEMORY(&pad, &info.pad, 4 * PAD_PROFILE_FLOATS + 1);
    TEST_ASSERT_NOT_NULL(app.stages.tangential.profile);
    TEST_ASSERT_EQUAL_UINT8(0, app.stages.location.settings.clip_below_sds);
    rig_power_up();
    connect_for(300);
  }
  obey((struct wire_packet){.type = WIRE_CMD_ERASE_PAD});
  TEST_ASSERT_NULL(app.stages.tangential.profile);
  TEST_ASSERT_EQUAL_UINT8(DEFAULT_CLIP_BELOW_SDS, app.stages.location.settings.clip_below_sds);
  TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
  rig_power_up();
  TEST_ASSERT_NULL(app.stages.tangential.profile);
  TEST_ASSERT_EQUAL_UINT8(DEFAULT_CLIP_BELOW_SDS, app.stages.location.settings.clip_below_sds);
}

/* The Gaussian is where the estimate begins, and what is left where there is none. */
TEST(beside_a_profile_the_fit_has_the_dip_and_assumes_no_width) {
  connect_for(300);
  obey(calibrate_command(
      (struct calibration){.force_scale = 1.0f, .sigma_um = 5552, .sigma_sd_um = 60, .dip_share_q16 = 3277, .dip_sd_um = 13954}));
  store_pad();
  TEST_ASSERT_EQUAL_FLOAT(0.0f, app.stages.location.settings.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(3277.0f / 65536.0f, app.stages.location.settings.dip_share);
  TEST_ASSERT_EQUAL_FLOAT(13.954f, app.stages.location.settings.dip_sd_mm);
}

TEST(a_profile_out_of_range_is_refused) {
  connect_for(300);
  pad.thickness_mm = 3.9f;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(COMMAND(PAD, pad, pad)));
  pad = pad_of_12_mm();
  pad.from_touch = 2;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(COMMAND(PAD, pad, pad)));
  TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
  TEST_ASSERT_NULL(app.stages.tangential.profile);
}

/* Of a firmware that knew other ranges. */
TEST(a_stored_profile_out_of_range_does_not_act) {
  connect_for(300);
  pad.thickness_mm = 25.0f;
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_profile(&app.store, &pad));
  run_for(300);
  for (int restart = 0; restart < 2; restart++) {
    TEST_ASSERT_TRUE(app.store.content.has_profile);
    TEST_ASSERT_NULL(app.stages.tangential.profile);
    TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
    rig_power_up();
    connect_for(300);
  }
}

TEST(a_calibration_and_the_scale_of_the_profile_act) {
  load.qx_N = 1.2;
  pad.tangential_scale = 1.5f;
  store_pad();
  obey(calibrate_command((struct calibration){.placements = 20, .force_scale = 1.25f}));
  struct wire_contact contact = last_contact(1600000, 1800000, CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_CALIBRATED, 0);
  const float scale = 1.25f * pad.force_ratio;
  TEST_ASSERT_FLOAT_WITHIN(0.2f, scale * 5.0f, contact.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.2f, 1.5f * scale * 1.2f, contact.qx_N);
  TEST_ASSERT_EQUAL_FLOAT(scale * app.found.tangential->force_N, contact.force_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 1.5f * scale * app.found.tangential->qx_N, contact.qx_N);
  TEST_ASSERT_EQUAL_FLOAT(app.found.tangential_force.location_sd_mm, contact.location_sd_mm);
  TEST_ASSERT_TRUE(app.found.tangential_force.location_sd_mm != app.found.fit.location_sd_mm);
}

TEST(from_touch_tells_what_changed) {
  load.qx_N = 1.2;
  load.later_qx_N = 0.2;
  load.later_us = 1800000;
  pad.from_touch = 1;
  store_pad();
  last_contact(1510000, 1595000, CONTACT_FLAG_FIT_VALID, TANGENTIAL);
  struct wire_contact contact = last_contact(1620000, 1790000, TANGENTIAL, 0);
  TEST_ASSERT_FLOAT_WITHIN(0.1f, 0.0f, contact.qx_N);
  contact = last_contact(1830000, 1980000, TANGENTIAL, 0);
  TEST_ASSERT_FLOAT_WITHIN(0.15f, -1.0f, contact.qx_N);
}

/* While the sensors measure their temperature the frame before goes out again, whole. */
/* Settings are of no pad: the load that was measured from the touch on goes on. */
TEST(keeping_settings_in_a_contact_changes_no_load) {
  pad.from_touch = 1;
  store_pad();
  load.later_us = 1800000;
  load.later_qx_N = 1.5;
  struct wire_contact contact = last_contact(2200000, 2400000, TANGENTIAL, 0);
  TEST_ASSERT_FLOAT_WITHIN(0.15f, 1.5f, contact.qx_N);
  struct wire_packet keep = COMMAND(KEEP, keep, .keep = 1);
  send_packet(&keep);
  contact = last_contact(2400000, 2700000, TANGENTIAL, 0);
  TEST_ASSERT_FLOAT_WITHIN(0.15f, 1.5f, contact.qx_N);
}

TEST(a_held_frame_repeats_the_load) {
  load.qx_N = 1.2;
  struct wire_packet packet;
  store_pad();
  start_streams(WIRE_STREAM_CONTACT);
  run_for((uint32_t)((1700000 - port_now_us()) / 1000));
  drop_packets();
  struct wire_contact before = {0};
  unsigned held = 0;
  run_for(2500);
  while (next_packet(&packet)) {
    const struct wire_contact *contact = &packet.body.contact;
    if (packet.type == WIRE_CONTACT && before.flags && contact->flags & CONTACT_FLAG_HELD) {
      held++;
      TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_TANGENTIAL_VALID, contact->flags);
      TEST_ASSERT_EQUAL_FLOAT(before.qx_N, contact->qx_N);
      TEST_ASSERT_EQUAL_FLOAT(before.x_mm, contact->x_mm);
    }
    before = packet.type == WIRE_CONTACT ? *contact : before;
  }
  TEST_ASSERT_GREATER_THAN(0, held);
}

/* Frames of our own, so near to each other that none waits: the last one again, its pressures above the zero in this share of it. */
static void feed_fast(double share) {
  static struct frame first;
  if (share == 0.0) {
    first = app.found.frame;
    return;
  }
  app.found.frame.number++;
  app.found.frame.t_us += TANGENTIAL_NO_WAIT_us / 2;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    const double zero = app.stages.condition.condition.zero_Pa_q10[k];
    app.found.frame.pressure_Pa_q10[k] = (int32_t)lround(zero + share * (first.pressure_Pa_q10[k] - zero));
  }
  app_process_frame(&app, app.found.frame.t_read_us);
}

TEST(fast_frames_take_the_load_of_the_frame_before) {
  for (int processors = 1; processors <= 2; processors++) {
    tearDown();
    native_set_worker(processors == 2, 10);
    setUp();
    load.qx_N = 1.2;
    store_pad();
    last_contact(1600000, 1800000, CONTACT_FLAG_TANGENTIAL_VALID, 0);
    feed_fast(0.0);
    for (int i = 0; i < 10; i++) {
      feed_fast(1.0);
      TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_TANGENTIAL_VALID, app.found.contact.flags);
    }
    run_for(1); /* of the question of this frame: its processor answers */
    const struct fit_tangential before = app.stages.tangential.job.estimate;
    TEST_ASSERT_TRUE(before.valid);
    const float force_N = app.found.fit.force_N;
    feed_fast(1.25);
    const float share = app.found.fit.force_N / force_N;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.25f, share);
    TEST_ASSERT_EQUAL_FLOAT(before.force_N * share, app.stages.tangential.estimate.force_N);
    TEST_ASSERT_EQUAL_FLOAT(before.qx_N * share, app.stages.tangential.estimate.qx_N);
    TEST_ASSERT_EQUAL_FLOAT(before.q_sd_N * share, app.stages.tangential.estimate.q_sd_N);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 1.5f, app.found.tangential_force.x_mm);
    feed_fast(1.25);
    TEST_ASSERT_FLOAT_WITHIN(0.2f, 6.25f, app.found.tangential_force.force_N);
    feed_fast(3.0); /* another contact's */
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_TANGENTIAL_VALID, app.found.contact.flags);
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_TANGENTIAL_LATE, app.found.contact.flags);
  }
}

TEST(fast_frames_say_that_the_one_before_got_no_answer) {
  tearDown();
  native_set_worker(true, 10);
  setUp();
  store_pad();
  last_contact(1600000, 1800000, CONTACT_FLAG_TANGENTIAL_VALID, 0);
  feed_fast(0.0);
  for (int i = 0; i < 3; i++) {
    feed_fast(1.0);
  }
  native_set_worker(true, UINT64_MAX);
  feed_fast(1.0); /* asks, and has the answer of the frame before */
  TEST_ASSERT_BITS(TANGENTIAL | CONTACT_FLAG_TANGENTIAL_LATE, CONTACT_FLAG_TANGENTIAL_VALID, app.found.contact.flags);
  const unsigned starts = native_worker_starts();
  for (int i = 0; i < 4; i++) {
    feed_fast(1.0);
    TEST_ASSERT_BITS(TANGENTIAL | CONTACT_FLAG_TANGENTIAL_LATE, CONTACT_FLAG_TANGENTIAL_LATE, app.found.contact.flags);
  }
  TEST_ASSERT_EQUAL(starts + 4, native_worker_starts());
}
