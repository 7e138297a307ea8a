/* The app of scene slip: what it stores and what that changes. */
#include "app_rig.h"
#include "common/contact_flags.h"

void setUp(void) { rig_start(); }

void tearDown(void) { rig_end(); }

static uint8_t keep(uint8_t what) { return ask(COMMAND(KEEP, keep, what)); }

static double gain_of_calibration(unsigned sensor) { return 0.8 + 0.02 * (double)sensor; }

static struct wire_packet calibrate_gains(void) {
  struct wire_packet command =
      calibrate_command((struct calibration){.date_s = 1785931200, .placements = 30, .force_scale = 1.0f, .force_scale_sd = 0.01f});
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    command.body.cmd_calibrate.calibration.sensors[k].gain = (float)gain_of_calibration(k);
  }
  return command;
}

/* Restarts, opens the port and asks. */
static struct wire_info info_after_restart(void) {
  rig_power_up();
  connect_for(300);
  return get_info();
}

/* A pad whose sensors are as sensitive as the calibration says is located and weighed as one of
 * equal sensors is; without the calibration it is not. */
TEST(a_calibration_acts_on_readings_and_force) {
  press.force_N = 5.0;
  press.x_mm = 2.5;
  press.y_mm = -7.0;
  press.from_us = 700000;
  world_gain = gain_of_calibration;
  connect_for(600);
  start_streams(WIRE_STREAM_CONTACT);
  run_for(500);
  struct wire_contact before = newest_contact();
  TEST_ASSERT_FALSE(before.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_TRUE(fabsf(before.force_N - 5.0f) > 0.1f);
  TEST_ASSERT_TRUE(before.force_sd_N > 0.4f); /* the scale of this pad is unknown */

  struct wire_packet command = calibrate_gains(), packet;
  obey(command);
  struct wire_contact after = {0};
  for (run_for(100); next_of_type(WIRE_CONTACT, &packet); after = packet.body.contact) {
    TEST_ASSERT_TRUE_MESSAGE(packet.body.contact.slip_mm < 0.02f, "other gains are no slip");
  }
  TEST_ASSERT_TRUE(after.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 2.5f, after.x_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, -7.0f, after.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 5.0f, after.force_N);

  command.body.cmd_calibrate.calibration.force_scale = 1.25f;
  command.body.cmd_calibrate.calibration.force_scale_sd = 0.125f;
  obey(command);
  run_for(100);
  struct wire_contact scaled = newest_contact();
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.25f * after.force_N, scaled.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.05f, 0.125f * after.force_N, scaled.force_sd_N);
  struct wire_info info = info_after_restart(); /* it outlives power */
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, info.stored);
  TEST_ASSERT_EQUAL_MEMORY(&command.body.cmd_calibrate.calibration, &info.calibration, sizeof info.calibration);

  press.force_N = 0.0;
  obey((struct wire_packet){.type = WIRE_CMD_TARE});
  run_for(100);
  press.force_N = 5.0;
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  TEST_ASSERT_TRUE(newest_contact().flags & CONTACT_FLAG_CALIBRATED);
  obey((struct wire_packet){.type = WIRE_CMD_ERASE_CALIBRATION});
  run_for(100);
  struct wire_contact erased = newest_contact();
  TEST_ASSERT_FALSE(erased.flags & CONTACT_FLAG_CALIBRATED);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, before.x_mm, erased.x_mm);
  TEST_ASSERT_EQUAL_HEX32(0, info_after_restart().stored);
}

/* The pad's shape acts until the user sets a prior, and again when it is taken back. */
TEST(a_calibration_tells_the_fit_the_pads_shape) {
  connect_for(300);
  struct wire_packet command = calibrate_gains();
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
  obey(command);
  TEST_ASSERT_EQUAL_FLOAT(5.552f, app.stages.location.settings.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.06f, app.stages.location.settings.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(3277.0f / 65536.0f, app.stages.location.settings.dip_share);
  TEST_ASSERT_EQUAL_FLOAT(13.954f, app.stages.location.settings.dip_sd_mm);
  TEST_ASSERT_INT_WITHIN(1, 328, app.stages.location.settings.deviations[3].off_x_q15);
  TEST_ASSERT_INT_WITHIN(1, -655, app.stages.location.settings.deviations[3].off_y_q15);
  TEST_ASSERT_EQUAL_INT(-1311, app.stages.location.settings.deviations[14].wider_q15);
  TEST_ASSERT_EQUAL_INT(0, app.stages.location.settings.deviations[14].off_x_q15);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, get_info().prior_width_mm);
  run_for(1100);
  TEST_ASSERT_FLOAT_WITHIN(0.003f, 0.01f, app.stages.contact_settings.force_scale_sd);
  ask(COMMAND(PRIOR, prior, 3.1f, 0.4f));
  TEST_ASSERT_EQUAL_FLOAT(3.1f, app.stages.location.settings.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(13.954f, app.stages.location.settings.dip_sd_mm);
  ask((struct wire_packet){.type = WIRE_CMD_PRIOR});
  TEST_ASSERT_EQUAL_FLOAT(5.552f, app.stages.location.settings.prior_sigma_mm);

  /* A force scale that was found 20 kPa away is doubted by 11 %. */
  calibration->ambient_kPa = 81;
  obey(command);
  run_for(1100);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.11f * calibration->force_scale, app.stages.contact_settings.force_scale_sd);
  struct wire_packet other = command; /* of another array */
  other.body.cmd_calibrate.sensor_count--;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(other));
  calibration->dip_share_q16 = 6554;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(command));
  obey((struct wire_packet){.type = WIRE_CMD_ERASE_CALIBRATION});
  TEST_ASSERT_EQUAL_FLOAT(0.0f, app.stages.location.settings.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, app.stages.location.settings.dip_share);
  TEST_ASSERT_NULL(app.stages.location.settings.deviations);
}

static void set_all(void) {
  ask(COMMAND(RATE, rate, 50000));
  ask(COMMAND(OSR, osr, 512));
  ask(COMMAND(SLIP, slip, 0.5f, 200));
  ask(COMMAND(PRIOR, prior, 3.1f, 0.4f));
  ask(COMMAND(LOCATION_LIMIT, location_limit, 0.8f));
}

TEST(settings_are_kept_when_asked_for_and_forgotten_likewise) {
  connect_for(300);
  const struct wire_info built = get_info();
  set_all();
  TEST_ASSERT_EQUAL_UINT32_MESSAGE(built.rate_mHz, info_after_restart().rate_mHz, "it was not kept");

  set_all();
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, keep(1));
  obey(calibrate_gains());
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

/* A frame that is held after it must not say what was so before: who waits for TARED would go on. */
TEST(after_a_tare_no_frame_says_tared_before_it_is) {
  press.force_N = 5.0;
  connect_for(300);
  ask(COMMAND(OSR, osr, 8192));
  start_streams(WIRE_STREAM_CONTACT);
  int held = 0;
  for (uint32_t i = 0; i < 300; i++) {
    run_for(400 + i * 7 % 50);
    struct wire_packet packet, command = {.type = WIRE_CMD_TARE, .body.cmd_tare = {1}};
    drop_packets();
    send_packet(&command);
    run_for(100);
    TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
    TEST_ASSERT_TRUE(next_of_type(WIRE_CONTACT, &packet));
    held += (packet.body.contact.flags & CONTACT_FLAG_HELD) != 0;
    TEST_ASSERT_EQUAL_HEX32(0, packet.body.contact.flags & (CONTACT_FLAG_TARED | CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID));
  }
  TEST_ASSERT_GREATER_THAN(0, held);
}

/* The answer to a command that stores is late; until then all goes on as before. */
TEST(storing_takes_its_time_and_keeps_nobody_waiting) {
  connect_for(300);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(100);
  struct wire_packet packet, command = calibrate_gains();
  drop_packets();
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
        TEST_ASSERT_EQUAL_UINT16(done ? host_sequence - 2 : host_sequence - 1, packet.body.ack.sequence);
      } else if (packet.type == WIRE_CONTACT) {
        TEST_ASSERT_TRUE(frame == 0 || packet.body.contact.frame == frame + 1);
        frame = packet.body.contact.frame;
        frames++;
        bool calibrated = packet.body.contact.flags & CONTACT_FLAG_CALIBRATED;
        TEST_ASSERT_EQUAL(done == 1, calibrated);
        calibrated_from = calibrated && !calibrated_from ? frames : calibrated_from;
      }
    }
    TEST_ASSERT_EQUAL(done == 1, app.stages.location.calibration != NULL);
  }
  TEST_ASSERT_EQUAL(1, done);
  TEST_ASSERT_EQUAL(1, refused);
  TEST_ASSERT_GREATER_THAN_UINT32(50, frames);
  TEST_ASSERT_LESS_THAN_UINT32(frames, calibrated_from);
  TEST_ASSERT_EQUAL_UINT32(1, get_health().commands_rejected);
}

/* At the slowest rate nothing else wakes the main loop. */
TEST(storing_is_as_quick_at_the_slowest_rate) {
  connect_for(300);
  ask(COMMAND(RATE, rate, WIRE_RATE_MIN_mHz));
  run_for(1000);
  struct wire_packet packet, command = calibrate_gains();
  send_packet(&command);
  for (int ms = 0; ms < 100 && !store_is_writing(&app.store); ms++) {
    run_for(1); /* until the main loop looks at what the host has sent */
  }
  TEST_ASSERT_TRUE(store_is_writing(&app.store));
  run_for(60);
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, packet.body.ack.result);
}

TEST(the_loader_waits_for_what_is_being_stored) {
  connect_for(300);
  struct wire_packet calibrate = calibrate_gains();
  struct wire_packet loader = {.type = WIRE_CMD_LOADER, .body.cmd_loader = {WIRE_LOADER_MAGIC}};
  send_packet(&loader);
  while (app.commands.loader_at_us == 0 || port_now_us() + 2000 < app.commands.loader_at_us) {
    run_for(1);
  }
  send_packet(&calibrate);
  TEST_ASSERT_EQUAL(NATIVE_TIME_UP, native_run_until(app.commands.loader_at_us + 3000, main_round, &app));
  TEST_ASSERT_TRUE(store_is_writing(&app.store));
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));
  TEST_ASSERT_TRUE(info_after_restart().stored & WIRE_STORED_CALIBRATION);
}

TEST(a_flash_that_fails_is_no_calibration) {
  connect_for(300);
  native_flash_wear_out();
  struct wire_packet packet, command = calibrate_gains();
  send_packet(&command);
  run_for(1000);
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, packet.body.ack.result);
  TEST_ASSERT_EQUAL_HEX32(0, get_info().stored);
}

TEST(damage_is_told_and_not_used) {
  connect_for(300);
  obey(calibrate_gains());
  native_flash.bytes[100] ^= 4;
  struct wire_info info = info_after_restart();
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_DAMAGED, info.stored);
  obey(calibrate_gains());
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_CALIBRATION, info_after_restart().stored);
}
