/* The app of scene slip. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "config/build_info.h"

void setUp(void) { rig_start(); }

void tearDown(void) { rig_end(); }

TEST(nothing_streams_before_a_command) {
  uint8_t byte;
  connect_for(500);
  TEST_ASSERT_EQUAL(0, native_cdc_receive(&byte, 1));
}

TEST(a_press_is_located_and_weighed) {
  press.force_N = 5.0;
  press.x_mm = 2.5;
  press.y_mm = -7.0;
  press.from_us = 700000;
  connect_for(600);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(500);

  struct wire_packet packet;
  struct wire_contact contact = {0};
  int in_contact = 0;
  int held = 0;
  while (next_packet(&packet)) {
    if (packet.type == WIRE_RAW) {
      TEST_ASSERT_EQUAL_HEX32(contact.flags & CONTACT_FLAG_HELD ? 0 : 0x7FFF, packet.body.raw.valid);
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
    TEST_ASSERT_EQUAL_UINT16(stages->total_us, stages->convert_us + stages->read_us + stages->queue_us + stages->condition_us +
                                                   stages->fit_us + stages->contact_us);
    if (!(contact.flags & CONTACT_FLAG_CONTACT)) {
      TEST_ASSERT_EQUAL_FLOAT(0.0f, contact.force_N);
      TEST_ASSERT_TRUE(packet.t_us < press.from_us + 3000);
      continue;
    }
    if (packet.t_us < press.from_us + 40000) {
      continue; /* it begins in no time, which a temperature must confirm */
    }
    in_contact++;
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_TARED,
                            contact.flags & ~(uint32_t)(CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_HELD));
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

TEST(info_tells_what_this_is) {
  connect_for(1500);
  struct wire_info info = get_info();
  TEST_ASSERT_EQUAL_UINT8(15, info.sensor_count);
  TEST_ASSERT_EQUAL_STRING("native", info.board);
  TEST_ASSERT_EQUAL_STRING(build_info.scene, info.scene);
  TEST_ASSERT_EQUAL_FLOAT(9.0f, info.pitch_mm);
  for (int k = 0; k < 15; k++) { /* three strips (De Clercq et al., RA-L 2022) */
    TEST_ASSERT_EQUAL_FLOAT(9.0f * (float)(k / 5 - 1), info.x_mm[k]);
    TEST_ASSERT_EQUAL_FLOAT(9.0f * (float)(k % 5 - 2), info.y_mm[k]);
  }
  TEST_ASSERT_EQUAL_UINT16(1024, info.osr);
  TEST_ASSERT_UINT32_WITHIN(20000, 185000, info.measured_rate_mHz);
  TEST_ASSERT_EQUAL_UINT16(100, info.slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(0.75f, info.slip_threshold_mm);
}

TEST(settings_are_checked_and_kept) {
  connect_for(300);
  const struct {
    struct wire_packet command;
    bool good;
  } cases[] = {{COMMAND(RATE, rate, 0), true},
               {COMMAND(RATE, rate, 100), true},
               {COMMAND(RATE, rate, 2000000), true},
               {COMMAND(RATE, rate, 99), false},
               {COMMAND(RATE, rate, 2000001), false},
               {COMMAND(RATE, rate, 20000), true},
               {COMMAND(OSR, osr, 1000), false},
               {COMMAND(OSR, osr, 256), true},
               {COMMAND(SLIP, slip, 0.009f, 100), false},
               {COMMAND(SLIP, slip, 51.0f, 100), false},
               {COMMAND(SLIP, slip, 1.0f, 4), false},
               {COMMAND(SLIP, slip, 1.0f, 1001), false},
               {COMMAND(SLIP, slip, -1.0f, 100), false},
               {COMMAND(SLIP, slip, 0.5f, 200), true},
               {COMMAND(STREAM, stream, 8), false},
               {COMMAND(PRIOR, prior, 0.0f, 0.5f), false},
               {COMMAND(PRIOR, prior, 3.0f, 0.0f), false},
               {COMMAND(PRIOR, prior, 0.4f, 0.5f), false},
               {COMMAND(PRIOR, prior, 101.0f, 0.5f), false},
               {COMMAND(PRIOR, prior, 3.0f, 101.0f), false},
               {COMMAND(PRIOR, prior, 3.0f, 0.009f), false},
               {COMMAND(PRIOR, prior, 0.0f, 0.0f), true},
               {COMMAND(PRIOR, prior, 3.1f, 0.5f), true},
               {COMMAND(LOCATION_LIMIT, location_limit, 0.009f), false},
               {COMMAND(LOCATION_LIMIT, location_limit, 100.1f), false},
               {COMMAND(LOCATION_LIMIT, location_limit, -1.0f), false},
               {COMMAND(LOCATION_LIMIT, location_limit, 0.8f), true}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(cases[i].good ? WIRE_RESULT_DONE : WIRE_RESULT_OUT_OF_RANGE, ask(cases[i].command));
  }
  const struct wire_info info = get_info();
  TEST_ASSERT_EQUAL_UINT32(20000, info.rate_mHz);
  TEST_ASSERT_EQUAL_UINT16(256, info.osr);
  TEST_ASSERT_EQUAL_UINT16(200, info.slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(0.5f, info.slip_threshold_mm);
  TEST_ASSERT_EQUAL_FLOAT(3.1f, info.prior_sigma_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.5f, info.prior_width_mm);
  TEST_ASSERT_EQUAL_FLOAT(0.8f, info.location_limit_mm);
}

TEST(a_tare_takes_the_present_as_zero) {
  press.force_N = 2.0;
  connect_for(1000); /* the start-up tare took the press for the zero */
  press.force_N = 0.0;
  run_for(20);
  obey((struct wire_packet){.type = WIRE_CMD_TARE});
  run_for(300);
  press.force_N = 4.0;
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  const struct wire_contact last = newest_contact();
  TEST_ASSERT_TRUE(last.flags & CONTACT_FLAG_TARED);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 4.0f, last.force_N);
}

TEST(a_tare_in_contact_is_refused_unless_forced) {
  struct wire_packet tare = {.type = WIRE_CMD_TARE};
  connect_for(1000);
  press.force_N = 3.0;
  run_for(50);
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, ask(tare));
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  struct wire_contact refused = newest_contact();
  TEST_ASSERT_TRUE(refused.flags & CONTACT_FLAG_CONTACT);
  TEST_ASSERT_FLOAT_WITHIN(0.02f, 3.0f, refused.force_N);
  tare.body.cmd_tare.force = 2;
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(tare));
  tare.body.cmd_tare.force = 1;
  obey(tare);
  run_for(100);
  TEST_ASSERT_FALSE(newest_contact().flags & CONTACT_FLAG_CONTACT);
}

TEST(a_tare_without_sensors_is_refused) {
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    array.absent[k] = true;
  }
  connect_for(1000);
  TEST_ASSERT_EQUAL(WIRE_RESULT_NOT_NOW, ask((struct wire_packet){.type = WIRE_CMD_TARE}));
}
