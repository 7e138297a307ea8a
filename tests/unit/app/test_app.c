/* The app of scene slip. */
#include "app/packets.h"
#include "app_rig.h"
#include "common/bytes.h"
#include "common/contact_flags.h"
#include "common/crc32.h"
#include "config/build_info.h"

void setUp(void) {
  rig_start();
}

void tearDown(void) {
  rig_end();
}

static void nothing_streams_before_a_command(void) {
  uint8_t byte;
  native_cdc_open();
  run_for(500);
  TEST_ASSERT_EQUAL(0, native_cdc_receive(&byte, 1));
}

static void a_press_is_located_and_weighed(void) {
  press.force_N = 5.0;
  press.x_mm = 2.5;
  press.y_mm = -7.0;
  press.from_us = 700000;
  native_cdc_open();
  run_for(600);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(500);

  struct wire_packet packet;
  struct wire_contact contact = {0};
  int in_contact = 0;
  int held = 0;
  while (next_packet(&packet)) {
    if (packet.type == WIRE_RAW) {
      TEST_ASSERT_EQUAL_HEX32(contact.flags & CONTACT_FLAG_HELD ? 0 : 0x7FFF,
                              packet.body.raw.valid);
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(contact.frame, packet.body.raw.frame, "raw follows contact");
      continue;
    }
    TEST_ASSERT_EQUAL(WIRE_CONTACT, packet.type);
    const struct wire_contact last = contact;
    contact = packet.body.contact;
    TEST_ASSERT_TRUE(last.frame == 0 || contact.frame == last.frame + 1);
    const struct wire_stages *stages = &contact.stages;
    if (contact.flags & CONTACT_FLAG_HELD) {
      held++;
      TEST_ASSERT_EQUAL_HEX32(last.flags | CONTACT_FLAG_HELD, contact.flags);
      TEST_ASSERT_EQUAL_FLOAT(last.x_mm, contact.x_mm);
      TEST_ASSERT_EQUAL_FLOAT(last.force_N, contact.force_N);
    }
    TEST_ASSERT_EQUAL_UINT16(stages->total_us, stages->convert_us + stages->read_us +
                                                   stages->queue_us + stages->condition_us +
                                                   stages->fit_us + stages->contact_us);
    if (!(contact.flags & CONTACT_FLAG_CONTACT)) {
      TEST_ASSERT_EQUAL_FLOAT(0.0f, contact.force_N);
      TEST_ASSERT_TRUE(packet.t_us < press.from_us + 3000);
      continue;
    }
    if (packet.t_us < press.from_us + 3000) {
      continue; /* this conversion saw the press begin */
    }
    in_contact++;
    TEST_ASSERT_EQUAL_HEX32(
        CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID |
            CONTACT_FLAG_TARED,
        contact.flags &
            ~(uint32_t)(CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_HELD));
    TEST_ASSERT_EQUAL_HEX32(0x7FFF, contact.sensors_used);
    /* Noise, and the compensation's own rounding. The standard deviations are far larger: they are
     * those of a pad that was never calibrated, and these sensors happen to be alike. */
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 2.5f, contact.x_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, -7.0f, contact.y_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 5.0f, contact.force_N);
    TEST_ASSERT_TRUE(contact.location_sd_mm > 0.1f && contact.location_sd_mm < 1.0f);
  }
  TEST_ASSERT_GREATER_THAN(50, in_contact);
  TEST_ASSERT_EQUAL(1, held);
  TEST_ASSERT_TRUE(contact.flags & CONTACT_FLAG_SLIP_VALID);
  TEST_ASSERT_FALSE(contact.flags & CONTACT_FLAG_SLIP);
}

static void a_moving_contact_slips(void) {
  press.force_N = 5.0;
  press.y_mm = -10.0;
  press.speed_y_mm_s = 40.0;
  press.from_us = 700000;
  native_cdc_open();
  run_for(600);
  start_streams(WIRE_STREAM_CONTACT);
  run_for(400);
  struct wire_packet packet;
  int slipping = 0;
  float last_mm = 0.0f;
  while (next_of_type(WIRE_CONTACT, &packet)) {
    if (packet.body.contact.flags & CONTACT_FLAG_SLIP) {
      slipping++;
      last_mm = packet.body.contact.slip_mm;
      TEST_ASSERT_TRUE(packet.t_us > press.from_us + 90000);
    }
  }
  TEST_ASSERT_GREATER_THAN(20, slipping);
  /* v (window + interval) / 2 with an interval of 5 to 6 ms */
  TEST_ASSERT_FLOAT_WITHIN(0.05f, 40.0f * 0.1055f / 2.0f, last_mm);
}

static void info_tells_what_this_is(void) {
  native_cdc_open();
  run_for(1500);
  struct wire_info info = get_info();
  TEST_ASSERT_EQUAL_UINT8(15, info.sensor_count);
  TEST_ASSERT_EQUAL_STRING("native", info.board);
  TEST_ASSERT_EQUAL_STRING(build_info.scene, info.scene);
  TEST_ASSERT_EQUAL_FLOAT(9.0f, info.pitch_mm);
  TEST_ASSERT_EQUAL_FLOAT(-18.0f, info.y_mm[0]);
  TEST_ASSERT_EQUAL_UINT16(1024, info.osr);
  TEST_ASSERT_UINT32_WITHIN(20000, 185000, info.measured_rate_mHz);
  TEST_ASSERT_EQUAL_UINT16(100, info.slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(0.75f, info.slip_threshold_mm);
}

static void settings_are_checked_and_kept(void) {
  native_cdc_open();
  run_for(300);
  static const struct {
    uint32_t rate_mHz;
    uint8_t result;
  } rates[] = {{0, 0},       {100, 0},  {2000000, 0}, {99, WIRE_RESULT_OUT_OF_RANGE},
               {2000001, 2}, {20000, 0}};
  for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(
        rates[i].result,
        ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {rates[i].rate_mHz}}));
  }
  TEST_ASSERT_EQUAL_UINT32(20000, get_info().rate_mHz);

  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE,
                    ask((struct wire_packet){.type = WIRE_CMD_OSR, .body.cmd_osr = {1000}}));
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE,
                    ask((struct wire_packet){.type = WIRE_CMD_OSR, .body.cmd_osr = {256}}));
  TEST_ASSERT_EQUAL_UINT16(256, get_info().osr);

  static const struct {
    float threshold_mm;
    uint16_t window_ms;
    uint8_t result;
  } slips[] = {{0.009f, 100, 2}, {51.0f, 100, 2}, {1.0f, 4, 2},
               {1.0f, 1001, 2},  {-1.0f, 100, 2}, {0.5f, 200, 0}};
  for (size_t i = 0; i < sizeof slips / sizeof slips[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(
        slips[i].result,
        ask((struct wire_packet){.type = WIRE_CMD_SLIP,
                                 .body.cmd_slip = {slips[i].threshold_mm, slips[i].window_ms}}));
  }
  TEST_ASSERT_EQUAL_UINT16(200, get_info().slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(0.5f, get_info().slip_threshold_mm);

  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE,
                    ask((struct wire_packet){.type = WIRE_CMD_STREAM, .body.cmd_stream = {8}}));
}

static struct wire_packet calibrate_command(void) {
  struct wire_packet command = {.type = WIRE_CMD_CALIBRATE};
  struct wire_cmd_calibrate *body = &command.body.cmd_calibrate;
  body->sensor_count = geometry.sensor_count;
  body->calibration = (struct calibration){
      .date_s = 1785931200, .placements = 30, .force_scale = 1.0f, .force_scale_sd = 0.01f};
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    body->calibration.sensors[k] =
        (struct sensor_calibration){.gain = 0.8f + 0.02f * (float)k, .gain_sd = 0.01f};
  }
  return command;
}

static struct wire_contact last_contact(void) {
  struct wire_packet packet;
  struct wire_contact last = {0};
  while (next_of_type(WIRE_CONTACT, &packet)) {
    last = packet.body.contact;
  }
  return last;
}

static double gain_of_calibration(unsigned sensor) {
  return 0.8 + 0.02 * (double)sensor;
}

/* A pad whose sensors are as sensitive as the calibration says is located and weighed as one of
 * equal sensors is; without the calibration it is not. */
static void a_calibration_acts_on_readings_and_force(void) {
  press.force_N = 5.0;
  press.x_mm = 2.5;
  press.y_mm = -7.0;
  press.from_us = 700000;
  world_gain = gain_of_calibration;
  native_cdc_open();
  run_for(600);
  start_streams(WIRE_STREAM_CONTACT);
  run_for(500);
  struct wire_contact before = last_contact();
  TEST_ASSERT_FALSE(before.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_TRUE(fabsf(before.force_N - 5.0f) > 0.1f);
  TEST_ASSERT_TRUE(before.force_sd_N > 0.4f); /* the scale of this pad is unknown */

  struct wire_packet command = calibrate_command();
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command));
  run_for(100);
  struct wire_contact after = last_contact();
  TEST_ASSERT_TRUE(after.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 2.5f, after.x_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, -7.0f, after.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 5.0f, after.force_N);

  command.body.cmd_calibrate.calibration.force_scale = 1.25f;
  command.body.cmd_calibrate.calibration.force_scale_sd = 0.125f;
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command));
  run_for(100);
  struct wire_contact scaled = last_contact();
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.25f * after.force_N, scaled.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.05f, 0.125f * after.force_N, scaled.force_sd_N);
  struct wire_info info = get_info();
  TEST_ASSERT_TRUE(info.stored & WIRE_STORED_CALIBRATION);
  TEST_ASSERT_EQUAL_MEMORY(&command.body.cmd_calibrate.calibration, &info.calibration,
                           sizeof info.calibration);

  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE,
                    ask((struct wire_packet){.type = WIRE_CMD_ERASE_CALIBRATION}));
  run_for(100);
  struct wire_contact erased = last_contact();
  TEST_ASSERT_FALSE(erased.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, before.x_mm, erased.x_mm);
  TEST_ASSERT_FALSE(get_info().stored & WIRE_STORED_CALIBRATION);
}

/* Restarts, opens the port and asks. */
static struct wire_info info_after_restart(void) {
  rig_power_up();
  native_cdc_open();
  run_for(300);
  return get_info();
}

/* The pad's shape acts until the user sets a prior, and again when it is taken back. */
static void a_calibration_tells_the_fit_the_pads_shape(void) {
  native_cdc_open();
  run_for(300);
  struct wire_packet command = calibrate_command();
  struct calibration *calibration = &command.body.cmd_calibrate.calibration;
  calibration->sigma_um = 5552;
  calibration->sigma_sd_um = 60;
  calibration->dip_share_q16 = 3277;
  calibration->dip_sd_um = 13954;
  calibration->sensors[3].off_x_um = 90; /* a hundredth of a pitch */
  calibration->sensors[3].off_y_um = -180;
  calibration->sensors[14].wider_q15 = -1311;
  calibration->force_scale_sd = 0.01f;
  calibration->ambient_kPa = 101;
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command));
  TEST_ASSERT_EQUAL_FLOAT(5.552f, app.fit_settings.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.06f, app.fit_settings.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(3277.0f / 65536.0f, app.fit_settings.dip_share);
  TEST_ASSERT_EQUAL_FLOAT(13.954f, app.fit_settings.dip_sd_mm);
  TEST_ASSERT_INT_WITHIN(1, 328, app.fit_settings.own[3].off_x_q15);
  TEST_ASSERT_INT_WITHIN(1, -655, app.fit_settings.own[3].off_y_q15);
  TEST_ASSERT_EQUAL_INT(-1311, app.fit_settings.own[14].wider_q15);
  TEST_ASSERT_EQUAL_INT(0, app.fit_settings.own[14].off_x_q15);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, get_info().prior_width_mm);
  run_for(1100);
  TEST_ASSERT_FLOAT_WITHIN(0.003f, 0.01f, app.contact_settings.force_scale_sd);
  ask((struct wire_packet){.type = WIRE_CMD_PRIOR, .body.cmd_prior = {3.1f, 0.4f}});
  TEST_ASSERT_EQUAL_FLOAT(3.1f, app.fit_settings.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(13.954f, app.fit_settings.dip_sd_mm);
  ask((struct wire_packet){.type = WIRE_CMD_PRIOR});
  TEST_ASSERT_EQUAL_FLOAT(5.552f, app.fit_settings.prior_sigma_mm);

  /* A force scale that was found 20 kPa away is doubted by 11 %. */
  calibration->ambient_kPa = 81;
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command));
  run_for(1100);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.11f * calibration->force_scale,
                           app.contact_settings.force_scale_sd);
  calibration->dip_share_q16 = 6554;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(command));
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE,
                    ask((struct wire_packet){.type = WIRE_CMD_ERASE_CALIBRATION}));
  TEST_ASSERT_EQUAL_FLOAT(0.0f, app.fit_settings.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, app.fit_settings.dip_share);
  TEST_ASSERT_NULL(app.fit_settings.own);
}

static void a_calibration_outlives_power(void) {
  native_cdc_open();
  run_for(300);
  struct wire_packet command = calibrate_command();
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command));
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, get_info().stored);
  struct wire_info info = info_after_restart();
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, info.stored);
  TEST_ASSERT_EQUAL_MEMORY(&command.body.cmd_calibrate.calibration, &info.calibration,
                           sizeof info.calibration);
  start_streams(WIRE_STREAM_CONTACT);
  run_for(50);
  TEST_ASSERT_TRUE(last_contact().flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE,
                    ask((struct wire_packet){.type = WIRE_CMD_ERASE_CALIBRATION}));
  TEST_ASSERT_EQUAL_HEX32(0, info_after_restart().stored);
}

static uint8_t keep(uint8_t what) {
  return ask((struct wire_packet){.type = WIRE_CMD_KEEP, .body.cmd_keep = {what}});
}

static void settings_are_kept_when_asked_for_and_forgotten_likewise(void) {
  native_cdc_open();
  run_for(300);
  const struct wire_info built = get_info();
  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {50000}});
  ask((struct wire_packet){.type = WIRE_CMD_OSR, .body.cmd_osr = {512}});
  ask((struct wire_packet){.type = WIRE_CMD_SLIP, .body.cmd_slip = {0.5f, 200}});
  ask((struct wire_packet){.type = WIRE_CMD_PRIOR, .body.cmd_prior = {3.1f, 0.4f}});
  ask((struct wire_packet){.type = WIRE_CMD_LOCATION_LIMIT, .body.cmd_location_limit = {0.8f}});
  TEST_ASSERT_EQUAL_UINT32_MESSAGE(built.rate_mHz, info_after_restart().rate_mHz,
                                   "it was not kept");

  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {50000}});
  ask((struct wire_packet){.type = WIRE_CMD_OSR, .body.cmd_osr = {512}});
  ask((struct wire_packet){.type = WIRE_CMD_SLIP, .body.cmd_slip = {0.5f, 200}});
  ask((struct wire_packet){.type = WIRE_CMD_PRIOR, .body.cmd_prior = {3.1f, 0.4f}});
  ask((struct wire_packet){.type = WIRE_CMD_LOCATION_LIMIT, .body.cmd_location_limit = {0.8f}});
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, keep(1));
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(calibrate_command()));
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, keep(2));
  struct wire_info info = info_after_restart();
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_SETTINGS | WIRE_STORED_CALIBRATION, info.stored);
  TEST_ASSERT_EQUAL_UINT32(50000, info.rate_mHz);
  TEST_ASSERT_EQUAL_UINT16(512, info.osr);
  TEST_ASSERT_EQUAL_FLOAT(0.5f, info.slip_threshold_mm);
  TEST_ASSERT_EQUAL_UINT16(200, info.slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(3.1f, info.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.4f, info.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.8f, info.location_limit_mm);
  TEST_ASSERT_UINT32_WITHIN(1000, 50000, (run_for(2000), get_info().measured_rate_mHz));

  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, keep(0));
  TEST_ASSERT_EQUAL_UINT32_MESSAGE(50000, get_info().rate_mHz, "it goes on until it restarts");
  info = info_after_restart();
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, info.stored);
  TEST_ASSERT_EQUAL_UINT32(built.rate_mHz, info.rate_mHz);
  TEST_ASSERT_EQUAL_UINT16(built.osr, info.osr);
  TEST_ASSERT_EQUAL_FLOAT(built.prior_width_mm, info.prior_width_mm);
}

/* A frame that is held after it must not say what was so before: who waits for TARED would go on.
 */
static void after_a_tare_no_frame_says_tared_before_it_is(void) {
  press.force_N = 5.0;
  native_cdc_open();
  run_for(300);
  ask((struct wire_packet){.type = WIRE_CMD_OSR, .body.cmd_osr = {8192}});
  start_streams(WIRE_STREAM_CONTACT);
  int held = 0;
  for (uint32_t i = 0; i < 300; i++) {
    run_for(400 + i * 7 % 50);
    struct wire_packet packet, command = {.type = WIRE_CMD_TARE, .body.cmd_tare = {1}};
    while (next_packet(&packet)) {
    }
    send_packet(&command);
    run_for(100);
    TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
    TEST_ASSERT_TRUE(next_of_type(WIRE_CONTACT, &packet));
    held += (packet.body.contact.flags & CONTACT_FLAG_HELD) != 0;
    TEST_ASSERT_EQUAL_HEX32(0,
                            packet.body.contact.flags & (CONTACT_FLAG_TARED | CONTACT_FLAG_CONTACT |
                                                         CONTACT_FLAG_FIT_VALID));
  }
  TEST_ASSERT_GREATER_THAN(0, held);
}

/* The answer to a command that stores is late; until then all goes on as before. */
static void storing_takes_its_time_and_keeps_nobody_waiting(void) {
  native_cdc_open();
  run_for(300);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(100);
  struct wire_packet packet, command = calibrate_command();
  while (next_packet(&packet)) {
  }
  send_packet(&command);
  run_for(10);
  send_packet(&command);
  uint32_t frame = 0, frames = 0, calibrated_from = 0;
  int done = 0, refused = 0;
  for (int ms = 0; ms < 300; ms++) {
    run_for(1);
    while (next_packet(&packet)) {
      if (packet.type == WIRE_ACK) {
        done += packet.body.ack.result == WIRE_RESULT_DONE;
        refused += packet.body.ack.result == WIRE_RESULT_NOT_NOW;
        TEST_ASSERT_EQUAL_UINT16(done ? host_sequence - 2 : host_sequence - 1,
                                 packet.body.ack.sequence);
      } else if (packet.type == WIRE_CONTACT) {
        TEST_ASSERT_TRUE(frame == 0 || packet.body.contact.frame == frame + 1);
        frame = packet.body.contact.frame;
        frames++;
        bool calibrated = packet.body.contact.flags & CONTACT_FLAG_CALIBRATED;
        TEST_ASSERT_EQUAL(done == 1, calibrated);
        calibrated_from = calibrated && !calibrated_from ? frames : calibrated_from;
      }
    }
    TEST_ASSERT_EQUAL(done == 1, app.calibration != NULL);
  }
  TEST_ASSERT_EQUAL(1, done);
  TEST_ASSERT_EQUAL(1, refused);
  TEST_ASSERT_GREATER_THAN_UINT32(50, frames);
  TEST_ASSERT_LESS_THAN_UINT32(frames, calibrated_from);
  TEST_ASSERT_EQUAL_UINT32(1, get_health().commands_rejected);
}

/* At the slowest rate nothing else wakes the main loop. */
static void storing_is_as_quick_at_the_slowest_rate(void) {
  native_cdc_open();
  run_for(300);
  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {WIRE_RATE_MIN_mHz}});
  run_for(1000);
  struct wire_packet packet, command = calibrate_command();
  send_packet(&command);
  for (int ms = 0; ms < 100 && !store_is_writing(&app.store); ms++) {
    run_for(1); /* until the main loop looks at what the host has sent */
  }
  TEST_ASSERT_TRUE(store_is_writing(&app.store));
  run_for(60);
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, packet.body.ack.result);
}

static void the_loader_waits_for_what_is_being_stored(void) {
  native_cdc_open();
  run_for(300);
  struct wire_packet calibrate = calibrate_command();
  struct wire_packet loader = {.type = WIRE_CMD_LOADER, .body.cmd_loader = {WIRE_LOADER_MAGIC}};
  send_packet(&loader);
  while (app.loader_at_us == 0 || port_now_us() + 2000 < app.loader_at_us) {
    run_for(1);
  }
  send_packet(&calibrate);
  TEST_ASSERT_EQUAL(NATIVE_TIME_UP, native_run_until(app.loader_at_us + 3000, main_round, &app));
  TEST_ASSERT_TRUE(store_is_writing(&app.store));
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));
  TEST_ASSERT_TRUE(info_after_restart().stored & WIRE_STORED_CALIBRATION);
}

static void a_flash_that_fails_is_no_calibration(void) {
  native_cdc_open();
  run_for(300);
  native_flash_wear_out();
  struct wire_packet packet, command = calibrate_command();
  send_packet(&command);
  run_for(1000);
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, packet.body.ack.result);
  TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
}

static void damage_is_told_and_not_used(void) {
  native_cdc_open();
  run_for(300);
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(calibrate_command()));
  native_flash.bytes[100] ^= 4;
  struct wire_info info = info_after_restart();
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_DAMAGED, info.stored);
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(calibrate_command()));
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, info_after_restart().stored);
}

static void a_calibration_out_of_range_is_refused(void) {
  native_cdc_open();
  run_for(300);
  struct wire_packet good = calibrate_command();
  static const struct {
    size_t offset;
    float value;
  } bad[] = {
      {offsetof(struct calibration, force_scale), 0.09f},
      {offsetof(struct calibration, force_scale), 10.1f},
      {offsetof(struct calibration, force_scale_sd), -0.01f},
      {offsetof(struct calibration, force_scale_sd), 1.1f},
      {offsetof(struct calibration, sensors[14].gain), 0.24f},
      {offsetof(struct calibration, sensors[0].gain), 4.1f},
      {offsetof(struct calibration, sensors[7].gain_sd), -0.1f},
      {offsetof(struct calibration, sensors[7].gain_sd), 0.51f},
  };
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
    struct wire_packet command = good;
    memcpy((uint8_t *)&command.body.cmd_calibrate.calibration + bad[i].offset, &bad[i].value,
           sizeof bad[i].value);
    TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(command));
  }
  static const struct {
    size_t offset;
    int16_t value;
  } bad_places[] = {
      {offsetof(struct calibration, sensors[0].off_x_um), -2001},
      {offsetof(struct calibration, sensors[14].off_y_um), 2001},
      {offsetof(struct calibration, sensors[7].wider_q15), 9831},
  };
  for (size_t i = 0; i < sizeof bad_places / sizeof bad_places[0]; i++) {
    struct wire_packet command = good;
    memcpy((uint8_t *)&command.body.cmd_calibrate.calibration + bad_places[i].offset,
           &bad_places[i].value, sizeof bad_places[i].value);
    TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(command));
  }
  struct wire_packet other = good;
  other.body.cmd_calibrate.sensor_count--;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(other));
  TEST_ASSERT_FALSE(get_info().stored & WIRE_STORED_CALIBRATION);
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(good));
}

static void priors_and_limits_are_checked(void) {
  native_cdc_open();
  run_for(300);
  static const struct {
    float sigma_mm, width_mm;
    uint8_t result;
  } priors[] = {{0.0f, 0.5f, 2},   {3.0f, 0.0f, 2},   {0.4f, 0.5f, 2}, {101.0f, 0.5f, 2},
                {3.0f, 101.0f, 2}, {3.0f, 0.009f, 2}, {0.0f, 0.0f, 0}, {3.1f, 0.5f, 0}};
  for (size_t i = 0; i < sizeof priors / sizeof priors[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(
        priors[i].result,
        ask((struct wire_packet){.type = WIRE_CMD_PRIOR,
                                 .body.cmd_prior = {priors[i].sigma_mm, priors[i].width_mm}}));
  }
  TEST_ASSERT_EQUAL_FLOAT(3.1f, get_info().prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.5f, get_info().prior_width_mm);
  static const float limits[] = {0.009f, 100.1f, -1.0f, 0.8f};
  for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(i < 3 ? WIRE_RESULT_OUT_OF_RANGE : WIRE_RESULT_DONE,
                            ask((struct wire_packet){.type = WIRE_CMD_LOCATION_LIMIT,
                                                     .body.cmd_location_limit = {limits[i]}}));
  }
  TEST_ASSERT_EQUAL_FLOAT(0.8f, get_info().location_limit_mm);
}

static void at_20_Hz_frames_are_50_ms_apart(void) {
  native_cdc_open();
  run_for(300);
  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {20000}});
  start_streams(WIRE_STREAM_CONTACT);
  run_for(200);
  struct wire_packet packet;
  while (next_of_type(WIRE_CONTACT, &packet)) {
  }
  uint64_t before_us = 0;
  int frames = 0;
  run_for(5000);
  while (next_of_type(WIRE_CONTACT, &packet)) {
    if (before_us) {
      TEST_ASSERT_UINT64_WITHIN(1000, 50000, packet.t_us - before_us);
    }
    before_us = packet.t_us;
    frames++;
  }
  TEST_ASSERT_INT_WITHIN(1, 100, frames);
}

static void a_tare_takes_the_present_as_zero(void) {
  press.force_N = 2.0;
  native_cdc_open();
  run_for(1000); /* the start-up tare took the press for the zero */
  press.force_N = 0.0;
  run_for(20);
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask((struct wire_packet){.type = WIRE_CMD_TARE}));
  run_for(300);
  press.force_N = 4.0;
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  struct wire_packet packet;
  struct wire_contact last = {0};
  while (next_of_type(WIRE_CONTACT, &packet)) {
    last = packet.body.contact;
  }
  TEST_ASSERT_TRUE(last.flags & CONTACT_FLAG_TARED);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 4.0f, last.force_N);
}

static void a_tare_in_contact_is_refused_unless_forced(void) {
  struct wire_packet tare = {.type = WIRE_CMD_TARE};
  native_cdc_open();
  run_for(1000);
  press.force_N = 3.0;
  run_for(50);
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, ask(tare));
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  struct wire_contact refused = last_contact();
  TEST_ASSERT_TRUE(refused.flags & CONTACT_FLAG_CONTACT);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 3.0f, refused.force_N);
  tare.body.cmd_tare.force = 2;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(tare));
  tare.body.cmd_tare.force = 1;
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(tare));
  run_for(100);
  TEST_ASSERT_FALSE(last_contact().flags & CONTACT_FLAG_CONTACT);
}

static void a_tare_without_sensors_is_refused(void) {
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    array.absent[k] = true;
  }
  native_cdc_open();
  run_for(1000);
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, ask((struct wire_packet){.type = WIRE_CMD_TARE}));
}

static void damage_is_counted_and_unknown_commands_are_answered(void) {
  native_cdc_open();
  run_for(300);
  static const uint8_t echo[] = {5, 'h', 'e', 'l', 'l', 0, 'x', 0, 0, 0};
  TEST_ASSERT_EQUAL(FT_OK, native_cdc_send(echo, sizeof echo));
  run_for(50);

  /* A command of a later version, type 0xF0 without a body; COBS by hand. */
  uint8_t raw[16] = {WIRE_VERSION, 0xF0};
  bytes_put_u32(raw + 12, crc32_iso_hdlc(raw, 12));
  uint8_t coded[20];
  size_t out = 1, code_at = 0;
  for (int i = 0; i < 16; i++) {
    if (raw[i]) {
      coded[out++] = raw[i];
    } else {
      coded[code_at] = (uint8_t)(out - code_at);
      code_at = out++;
    }
  }
  coded[code_at] = (uint8_t)(out - code_at);
  coded[out++] = 0;
  TEST_ASSERT_EQUAL(FT_OK, native_cdc_send(coded, out));
  run_for(50);
  struct wire_packet packet;
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL_HEX8(0xF0, packet.body.ack.command);
  TEST_ASSERT_EQUAL_UINT8(WIRE_RESULT_UNKNOWN_COMMAND, packet.body.ack.result);
  TEST_ASSERT_EQUAL_UINT32(3, get_health().commands_rejected);
}

static void closing_the_port_ends_the_streams(void) {
  native_cdc_open();
  run_for(300);
  start_streams(WIRE_STREAM_CONTACT);
  native_cdc_close();
  run_for(100);
  struct wire_packet packet;
  while (next_packet(&packet)) {
  }
  wire_receiver_init(&receiver, wire_all_layouts);
  native_cdc_open();
  run_for(200);
  TEST_ASSERT_FALSE(next_packet(&packet));
}

static void a_host_that_does_not_read_loses_whole_packets_and_sees_the_gap(void) {
  native_cdc_open();
  run_for(300);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  native_cdc_stall(true);
  run_for(5000);
  native_cdc_stall(false);
  run_for(100);
  struct wire_packet packet;
  bool first = true;
  uint16_t expected = 0;
  uint32_t missing = 0;
  while (next_packet(&packet)) { /* asserts that no frame is damaged */
    if (!first) {
      missing += (uint16_t)(packet.sequence - expected);
    }
    first = false;
    expected = (uint16_t)(packet.sequence + 1);
  }
  struct wire_health health = get_health();
  TEST_ASSERT_GREATER_THAN_UINT32(1000, health.packets_dropped);
  TEST_ASSERT_EQUAL_UINT32(health.packets_dropped, missing);
}

static void health_comes_each_second(void) {
  native_cdc_open();
  run_for(300);
  start_streams(WIRE_STREAM_HEALTH);
  run_for(5000);
  struct wire_packet packet;
  int count = 0;
  while (next_of_type(WIRE_HEALTH, &packet)) {
    count++;
    TEST_ASSERT_EQUAL_HEX32(0x7FFF, packet.body.health.sensors_present);
    TEST_ASSERT_EQUAL_UINT32(0, packet.body.health.frames_incomplete);
  }
  TEST_ASSERT_INT_WITHIN(1, 5, count);
}

static void the_loader_is_reached_by_command_and_by_touch(void) {
  native_cdc_open();
  run_for(300);
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE,
                    ask((struct wire_packet){.type = WIRE_CMD_LOADER, .body.cmd_loader = {0}}));
  TEST_ASSERT_EQUAL(NATIVE_TIME_UP, run_for(200));
  TEST_ASSERT_EQUAL(
      WIRE_RESULT_DONE,
      ask((struct wire_packet){.type = WIRE_CMD_LOADER, .body.cmd_loader = {WIRE_LOADER_MAGIC}}));
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));

  setUp();
  native_cdc_open();
  run_for(300);
  native_cdc_request_loader();
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));
}

static struct crash_record get_crash(void) {
  struct wire_packet packet;
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask((struct wire_packet){.type = WIRE_CMD_CRASH}));
  TEST_ASSERT_TRUE(next_of_type(WIRE_CRASH, &packet));
  return packet.body.crash;
}

static void the_last_crash_is_told_when_asked_for(void) {
  native_cdc_open();
  run_for(300);
  TEST_ASSERT_EQUAL(CRASH_NONE, get_crash().kind);
  struct crash_record crash = {.kind = CRASH_PANIC, .pc = 0x20000100, .t_us = 7000000};
  native_set_last_crash(&crash);
  TEST_ASSERT_EQUAL(CRASH_PANIC, get_crash().kind);
  TEST_ASSERT_EQUAL_HEX32(0x20000100, get_crash().pc);
  TEST_ASSERT_EQUAL_UINT64(7000000, get_crash().t_us);
  crash.kind = CRASH_NONE;
  native_set_last_crash(&crash);
}

static void what_happens_is_noted_for_the_record_of_a_crash(void) {
  uint8_t detail;
  native_cdc_open();
  run_for(300);
  get_health();
  TEST_ASSERT_EQUAL(CRASH_EVENT_COMMAND, native_last_event(&detail));
  TEST_ASSERT_EQUAL_HEX8(WIRE_CMD_HEALTH, detail);
  native_cdc_close();
  run_for(30);
  TEST_ASSERT_EQUAL(CRASH_EVENT_CLOSED, native_last_event(&detail));
  native_cdc_open();
  ask((struct wire_packet){.type = WIRE_CMD_KEEP, .body.cmd_keep = {1}});
  TEST_ASSERT_EQUAL(CRASH_EVENT_STORED, native_last_event(&detail));
  TEST_ASSERT_EQUAL(0, detail);
}

static void more_failures_in_a_second_than_a_byte_holds_are_noted_as_255(void) {
  uint8_t detail;
  run_for(1500);
  static const struct {
    uint32_t failures;
    uint8_t noted;
  } cases[] = {{5, 5}, {254, 254}, {255, 255}, {256, 255}, {300, 255}};
  for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    atomic_fetch_add(&app.scan.counters.bus_timeouts, cases[i].failures);
    run_for(1200);
    TEST_ASSERT_EQUAL(CRASH_EVENT_BUS, native_last_event(&detail));
    TEST_ASSERT_EQUAL_UINT8(cases[i].noted, detail);
  }
}

static void at_the_slowest_rate_the_watchdog_is_fed(void) {
  native_cdc_open();
  run_for(300);
  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {WIRE_RATE_MIN_mHz}});
  run_for(25000);
}

/* In the frame that is held for the temperature already, and until a temperature says otherwise. */
/* Two supplies dip at once, so that neither steps alone: the temperatures tell it before the zeros
 * give in, half a second later. */
static void test_sensors_that_lost_their_state_are_reset_before_their_zeros_give_in(void) {
  run_for(8000);
  while (array.command >> 4 != 5) { /* the next temperature would come in two seconds */
    native_run_until(port_now_us() + 50, main_round, &app);
  }
  run_for(50);
  const int32_t zero_Pa_q10 = app.condition.zero_Pa_q10[7];
  sim_ms5840_brown_out(&array.sensor[7]);
  sim_ms5840_brown_out(&array.sensor[9]);
  run_for(100);
  TEST_ASSERT_FALSE(app.conditioned.tared);
  TEST_ASSERT_TRUE(array.sensor[7].untrimmed);
  run_for(400);
  TEST_ASSERT_FALSE(array.sensor[7].untrimmed);
  run_for(200);
  TEST_ASSERT_TRUE(app.conditioned.tared);
  TEST_ASSERT_INT32_WITHIN(20 * 1024, zero_Pa_q10, app.condition.zero_Pa_q10[7]);
  TEST_ASSERT_EQUAL_HEX32(0x7FFF, app.frame.valid);
}

static void test_a_sensor_whose_temperature_jumps_is_told_to_be_doubtful(void) {
  press.force_N = 5.0;
  press.from_us = 700000;
  native_cdc_open();
  run_for(600);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(200);
  struct wire_packet packet;
  while (array.command >> 4 != 5) {
    native_run_until(port_now_us() + 50, main_round, &app);
  }
  while (next_packet(&packet)) {
  }
  array.fault = (struct sim_fault){
      .kind = SIM_FAULT_FLIP, .transfer = array.transfers + 1 + 7, .mask = 0x80000};
  run_for(80);
  int held = 0;
  int doubtful = 0;
  while (next_packet(&packet)) {
    if (packet.type == WIRE_CONTACT) {
      held += (packet.body.contact.flags & CONTACT_FLAG_HELD) != 0;
      TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SENSOR_DOUBTFUL | CONTACT_FLAG_FIT_VALID,
                            packet.body.contact.flags);
    } else {
      const bool holds = packet.body.raw.flags & CONTACT_FLAG_HELD;
      TEST_ASSERT_EQUAL_HEX32(holds ? 0 : 1 << 7, packet.body.raw.doubtful);
      doubtful += !holds;
    }
  }
  TEST_ASSERT_EQUAL(1, held);
  TEST_ASSERT_GREATER_THAN(10, doubtful);
  run_for(60);
  while (next_packet(&packet)) {
  }
  run_for(60);
  TEST_ASSERT_TRUE(next_of_type(WIRE_CONTACT, &packet));
  do {
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SENSOR_DOUBTFUL, packet.body.contact.flags);
  } while (next_of_type(WIRE_CONTACT, &packet));
}

static void test_stages_end_at_what_fits(void) {
  TEST_ASSERT_EQUAL_UINT16(0, saturate_u16(0));
  TEST_ASSERT_EQUAL_UINT16(65534, saturate_u16(65534));
  TEST_ASSERT_EQUAL_UINT16(65535, saturate_u16(65535));
  TEST_ASSERT_EQUAL_UINT16(65535, saturate_u16(65536));
  TEST_ASSERT_EQUAL_UINT16(65535, saturate_u16(UINT64_MAX));
}

static void test_uptime_keeps_the_rest_of_each_second(void) {
  native_cdc_open();
  run_for(300);
  ask((struct wire_packet){.type = WIRE_CMD_RATE, .body.cmd_rate = {1300}});
  run_for(100000);
  const uint32_t now_s = (uint32_t)(port_now_us() / 1000000u);
  TEST_ASSERT_UINT32_WITHIN(2, now_s, get_health().uptime_s);
}

static void test_whether_the_watchdog_struck_is_told(void) {
  native_cdc_open();
  run_for(300);
  TEST_ASSERT_EQUAL(0, get_health().watchdog_resets);
  native_start(true);
  native_set_event_source(next_event_us, &array);
  port_set_event_handler(on_event, &app);
  sim_array_init(&array, geometry.sensor_count, 1);
  array.world = (struct sim_world){.pressure_Pa = world_pressure_Pa};
  native_cdc_reset();
  app_start(&app, sim_array_bus(&array));
  native_cdc_open();
  run_for(300);
  TEST_ASSERT_EQUAL(1, get_health().watchdog_resets);
}

/* USB 2.0, 9.6.1: bcdDevice is 0xJJMN. */
static void test_the_port_tells_the_version(void) {
  const uint8_t *version = build_info.version;
  TEST_ASSERT_EQUAL_HEX16(version[0] * 256 + version[1] * 16 + version[2],
                          native_cdc_identity()->device_version_bcd);
}

static void test_what_is_being_stored_is_told(void) {
  native_cdc_open();
  run_for(300);
  struct wire_packet keep = {.type = WIRE_CMD_KEEP, .body.cmd_keep = {1}};
  struct wire_packet info = {.type = WIRE_CMD_INFO};
  send_packet(&keep);
  send_packet(&info);
  run_for(10);
  TEST_ASSERT_TRUE(next_of_type(WIRE_INFO, &info));
  TEST_ASSERT_TRUE(info.body.info.stored & WIRE_STORED_WRITING);
  run_for(500);
  while (next_packet(&info)) {
  }
  TEST_ASSERT_FALSE(get_info().stored & WIRE_STORED_WRITING);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(nothing_streams_before_a_command);
  RUN_TEST(a_press_is_located_and_weighed);
  RUN_TEST(a_moving_contact_slips);
  RUN_TEST(info_tells_what_this_is);
  RUN_TEST(settings_are_checked_and_kept);
  RUN_TEST(a_calibration_acts_on_readings_and_force);
  RUN_TEST(a_calibration_tells_the_fit_the_pads_shape);
  RUN_TEST(a_calibration_outlives_power);
  RUN_TEST(settings_are_kept_when_asked_for_and_forgotten_likewise);
  RUN_TEST(storing_takes_its_time_and_keeps_nobody_waiting);
  RUN_TEST(storing_is_as_quick_at_the_slowest_rate);
  RUN_TEST(after_a_tare_no_frame_says_tared_before_it_is);
  RUN_TEST(the_loader_waits_for_what_is_being_stored);
  RUN_TEST(a_flash_that_fails_is_no_calibration);
  RUN_TEST(damage_is_told_and_not_used);
  RUN_TEST(a_calibration_out_of_range_is_refused);
  RUN_TEST(priors_and_limits_are_checked);
  RUN_TEST(at_20_Hz_frames_are_50_ms_apart);
  RUN_TEST(a_tare_takes_the_present_as_zero);
  RUN_TEST(a_tare_in_contact_is_refused_unless_forced);
  RUN_TEST(a_tare_without_sensors_is_refused);
  RUN_TEST(damage_is_counted_and_unknown_commands_are_answered);
  RUN_TEST(closing_the_port_ends_the_streams);
  RUN_TEST(a_host_that_does_not_read_loses_whole_packets_and_sees_the_gap);
  RUN_TEST(health_comes_each_second);
  RUN_TEST(the_loader_is_reached_by_command_and_by_touch);
  RUN_TEST(the_last_crash_is_told_when_asked_for);
  RUN_TEST(what_happens_is_noted_for_the_record_of_a_crash);
  RUN_TEST(more_failures_in_a_second_than_a_byte_holds_are_noted_as_255);
  RUN_TEST(at_the_slowest_rate_the_watchdog_is_fed);
  RUN_TEST(test_sensors_that_lost_their_state_are_reset_before_their_zeros_give_in);
  RUN_TEST(test_a_sensor_whose_temperature_jumps_is_told_to_be_doubtful);
  RUN_TEST(test_stages_end_at_what_fits);
  RUN_TEST(test_uptime_keeps_the_rest_of_each_second);
  RUN_TEST(test_whether_the_watchdog_struck_is_told);
  RUN_TEST(test_the_port_tells_the_version);
  RUN_TEST(test_what_is_being_stored_is_told);
  return UNITY_END();
}
