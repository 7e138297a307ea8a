/* What each set of capabilities streams, obeys and tells: the same tests for every set. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "support/pad.h"

void setUp(void) { rig_start(); }

void tearDown(void) { rig_end(); }

static const uint32_t CAPABILITIES = (FT_WITH_FIT ? WIRE_CAPABILITY_FIT : 0) | (FT_WITH_SLIP ? WIRE_CAPABILITY_SLIP : 0) |
                                     (FT_WITH_RAW_STREAM ? WIRE_CAPABILITY_RAW_STREAM : 0) |
                                     (FT_WITH_TANGENTIAL ? WIRE_CAPABILITY_TANGENTIAL : 0) | (FT_WITH_SYNC ? WIRE_CAPABILITY_SYNC : 0);
static const uint8_t STREAMS = (FT_WITH_FIT ? WIRE_STREAM_CONTACT : 0) | (FT_WITH_RAW_STREAM ? WIRE_STREAM_RAW : 0);

TEST(it_tells_its_capabilities_and_their_settings_only) {
  connect_for(300);
  struct wire_info info = get_info();
  TEST_ASSERT_EQUAL_HEX32(CAPABILITIES, info.capabilities);
  TEST_ASSERT_EQUAL_UINT8(FT_WITH_FIT ? DEFAULT_FIT_ITERATIONS : 0, info.fit_iterations);
  TEST_ASSERT_EQUAL_UINT16(FT_WITH_SLIP ? DEFAULT_SLIP_WINDOW_ms : 0, info.slip_window_ms);
  TEST_ASSERT_EQUAL_FLOAT(FT_WITH_SLIP ? DEFAULT_SLIP_THRESHOLD_mm : 0, info.slip_threshold_mm);
  TEST_ASSERT_EQUAL_FLOAT(FT_WITH_FIT ? DEFAULT_LOCATION_LIMIT_mm : 0, info.location_limit_mm);
  TEST_ASSERT_EQUAL_HEX32(CAPABILITIES, get_health().capabilities);
}

TEST(it_refuses_streams_and_commands_that_it_lacks) {
  connect_for(300);
  for (uint8_t streams = 0; streams <= 8; streams++) {
    bool known = (streams & ~(STREAMS | WIRE_STREAM_HEALTH)) == 0;
    TEST_ASSERT_EQUAL_UINT8(known ? WIRE_RESULT_DONE : WIRE_RESULT_OUT_OF_RANGE, ask(COMMAND(STREAM, stream, streams)));
  }
  start_streams(0);
  const struct {
    struct wire_packet command;
    bool known;
  } commands[] = {{COMMAND(SLIP, slip, 0.5f, 200), FT_WITH_SLIP},
                  {COMMAND(PRIOR, prior, 3.1f, 0.5f), FT_WITH_FIT},
                  {COMMAND(LOCATION_LIMIT, location_limit, 1), FT_WITH_FIT},
                  {{.type = WIRE_CMD_ERASE_CALIBRATION}, FT_WITH_FIT},
                  {COMMAND(SYNC, sync, PORT_SYNC_IN), FT_WITH_SYNC},
                  {COMMAND(PAD, pad, pad_of_12_mm()), FT_WITH_TANGENTIAL},
                  {{.type = WIRE_CMD_ERASE_PAD}, FT_WITH_TANGENTIAL}};
  for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
    TEST_ASSERT_EQUAL_UINT8(commands[i].known ? WIRE_RESULT_DONE : WIRE_RESULT_UNKNOWN_COMMAND, ask(commands[i].command));
  }
}

TEST(it_streams_what_it_has) {
  press.force_N = 5.0;
  press.y_mm = -10.0;
  press.speed_y_mm_s = 40.0;
  press.from_us = 700000;
  connect_for(600);
  start_streams(STREAMS);
  run_for(400);
  struct wire_packet packet;
  unsigned pressed = 0, slips = 0, frames = 0;
  uint32_t before = 0;
  while (next_packet(&packet)) {
    bool is_raw = packet.type == WIRE_RAW;
    TEST_ASSERT_TRUE(is_raw ? FT_WITH_RAW_STREAM : packet.type == WIRE_CONTACT && FT_WITH_FIT);
    const struct wire_contact *contact = &packet.body.contact;
    uint32_t flags = is_raw ? packet.body.raw.flags : contact->flags;
    uint32_t frame = is_raw ? packet.body.raw.frame : contact->frame;
    TEST_ASSERT_EQUAL(0, flags & (uint32_t)(FT_WITH_SLIP ? 0 : CONTACT_FLAG_SLIP | CONTACT_FLAG_SLIP_VALID));
    TEST_ASSERT_EQUAL(0, flags & (uint32_t)(FT_WITH_FIT ? 0 : CONTACT_FLAG_FIT_VALID));
    TEST_ASSERT_TRUE(flags & CONTACT_FLAG_TARED);
    bool first_of_frame = frames == 0 || frame != before;
    if (frames > 0 && first_of_frame) {
      TEST_ASSERT_EQUAL_UINT32(before + 1, frame);
    }
    frames += first_of_frame;
    before = frame;
    if (packet.t_us < press.from_us + 10000) {
      continue; /* this conversion may have seen the press begin */
    }
    pressed += first_of_frame;
    TEST_ASSERT_TRUE(flags & CONTACT_FLAG_CONTACT);
    if (is_raw) {
      int32_t above_Pa_q10 = packet.body.raw.pressure_Pa_q10[7] - packet.body.raw.baseline_Pa_q10[7];
      TEST_ASSERT_GREATER_THAN_INT32(1000 * 1024, above_Pa_q10);
    } else {
      TEST_ASSERT_TRUE(flags & CONTACT_FLAG_FIT_VALID);
      TEST_ASSERT_FLOAT_WITHIN(0.05f, 5.0f, contact->force_N);
      slips += (flags & CONTACT_FLAG_SLIP) != 0;
    }
  }
  TEST_ASSERT_GREATER_THAN(40, pressed);
  TEST_ASSERT_EQUAL(FT_WITH_SLIP, slips > 20);
}

/* Settings that it has; what another firmware has stored beside them stays. */
TEST(it_keeps_settings) {
  connect_for(300);
  struct calibration calibration = {.placements = 20, .force_scale = 1.0f};
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    calibration.sensors[k].gain = 1.0f;
  }
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_calibration(&app.store, &calibration));
  run_for(500);
  const struct pad_profile pad = pad_of_12_mm();
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_profile(&app.store, &pad));
  run_for(500);
  ask(COMMAND(OSR, osr, 512));
  ask(COMMAND(SYNC, sync, PORT_SYNC_SECOND));
  obey(COMMAND(KEEP, keep, 1));
  rig_power_up();
  connect_for(300);
  struct wire_info info = get_info();
  TEST_ASSERT_EQUAL_UINT16(512, info.osr);
  TEST_ASSERT_EQUAL_UINT8(FT_WITH_SYNC ? PORT_SYNC_SECOND : 0, info.sync);
  TEST_ASSERT_EQUAL(FT_WITH_SYNC ? PORT_SYNC_SECOND : PORT_SYNC_OFF, native_sync_mode());
  TEST_ASSERT_EQUAL_HEX32(WIRE_STORED_SETTINGS | (FT_WITH_FIT ? WIRE_STORED_CALIBRATION : 0) | (FT_WITH_TANGENTIAL ? WIRE_STORED_PAD : 0),
                          info.stored);
  TEST_ASSERT_EQUAL_FLOAT(FT_WITH_TANGENTIAL ? 12.0f : 0.0f, info.pad.thickness_mm);
  TEST_ASSERT_EQUAL_FLOAT(12.0f, app.store.content.profile.thickness_mm);
  TEST_ASSERT_EQUAL_UINT16(20, app.store.content.calibration.placements);
}

TEST(it_tares) {
  connect_for(300);
  obey((struct wire_packet){.type = WIRE_CMD_TARE});
  start_streams(STREAMS);
  run_for(300);
  struct wire_packet packet;
  uint32_t flags = 0;
  while (next_packet(&packet)) {
    flags = packet.type == WIRE_RAW ? packet.body.raw.flags : packet.body.contact.flags;
  }
  TEST_ASSERT_TRUE(flags & CONTACT_FLAG_TARED);
}
