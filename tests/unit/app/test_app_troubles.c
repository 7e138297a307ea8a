/* The app of scene slip: commands and hosts that fail, health, crashes and what is reported of them. */
#include "app_rig.h"
#include "config/build_info.h"
#include "unit/wire/wire_samples.h"

void setUp(void) { rig_start(); }

void tearDown(void) { rig_end(); }

TEST(damage_is_counted_and_unknown_commands_are_answered) {
  connect_for(300);
  static const uint8_t echo[] = {5, 'h', 'e', 'l', 'l', 0, 'x', 0, 0, 0};
  TEST_ASSERT_EQUAL(FT_OK, native_cdc_send(echo, sizeof echo));
  run_for(50);

  /* A command of a later version, type 0xF0 without a body. */
  uint8_t raw[16] = {WIRE_VERSION, 0xF0}, coded[20] = {0};
  TEST_ASSERT_EQUAL(FT_OK, native_cdc_send(coded, seal(raw, 12, coded) + 1));
  run_for(50);
  struct wire_packet packet;
  TEST_ASSERT_TRUE(next_of_type(WIRE_ACK, &packet));
  TEST_ASSERT_EQUAL_HEX8(0xF0, packet.body.ack.command);
  TEST_ASSERT_EQUAL_UINT8(WIRE_RESULT_UNKNOWN_COMMAND, packet.body.ack.result);
  TEST_ASSERT_EQUAL_UINT32(3, get_health().commands_rejected);
}

TEST(closing_the_port_ends_the_streams) {
  connect_for(300);
  start_streams(WIRE_STREAM_CONTACT);
  native_cdc_close();
  run_for(100);
  struct wire_packet packet;
  drop_packets();
  wire_receiver_init(&receiver, wire_all_layouts);
  connect_for(200);
  TEST_ASSERT_FALSE(next_packet(&packet));
  native_cdc_close(); /* and the next host asks before the main loop has seen it */
  native_cdc_open();
  start_streams(WIRE_STREAM_CONTACT);
  run_for(100);
  TEST_ASSERT_TRUE(next_of_type(WIRE_CONTACT, &packet));
}

TEST(a_host_that_does_not_read_loses_whole_packets_and_sees_the_gap) {
  connect_for(300);
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

TEST(health_comes_each_second) {
  connect_for(300);
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

TEST(the_loader_is_reached_by_command_and_by_touch) {
  connect_for(300);
  TEST_ASSERT_EQUAL(WIRE_RESULT_OUT_OF_RANGE, ask(COMMAND(LOADER, loader, 0)));
  TEST_ASSERT_EQUAL(NATIVE_TIME_UP, run_for(200));
  obey(COMMAND(LOADER, loader, WIRE_LOADER_MAGIC));
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));

  setUp();
  connect_for(300);
  native_cdc_request_loader();
  TEST_ASSERT_EQUAL(NATIVE_LOADER, run_for(200));
}

static struct crash_record get_crash(void) {
  struct wire_packet packet;
  obey((struct wire_packet){.type = WIRE_CMD_CRASH});
  TEST_ASSERT_TRUE(next_of_type(WIRE_CRASH, &packet));
  return packet.body.crash;
}

TEST(the_last_crash_is_told_when_asked_for) {
  connect_for(300);
  TEST_ASSERT_EQUAL(CRASH_NONE, get_crash().kind);
  struct crash_record crash = {.kind = CRASH_PANIC, .pc = 0x20000100, .t_us = 7000000};
  native_set_last_crash(&crash);
  TEST_ASSERT_EQUAL(CRASH_PANIC, get_crash().kind);
  TEST_ASSERT_EQUAL_HEX32(0x20000100, get_crash().pc);
  TEST_ASSERT_EQUAL_UINT64(7000000, get_crash().t_us);
  crash.kind = CRASH_NONE;
  native_set_last_crash(&crash);
}

TEST(what_happens_is_noted_for_the_record_of_a_crash) {
  uint8_t detail;
  connect_for(300);
  get_health();
  TEST_ASSERT_EQUAL(CRASH_EVENT_COMMAND, native_last_event(&detail));
  TEST_ASSERT_EQUAL_HEX8(WIRE_CMD_HEALTH, detail);
  native_cdc_close();
  run_for(30);
  TEST_ASSERT_EQUAL(CRASH_EVENT_CLOSED, native_last_event(&detail));
  native_cdc_open();
  ask(COMMAND(KEEP, keep, 1));
  TEST_ASSERT_EQUAL(CRASH_EVENT_STORED, native_last_event(&detail));
  TEST_ASSERT_EQUAL(0, detail);
}

TEST(more_failures_in_a_second_than_a_byte_holds_are_noted_as_255) {
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

TEST(at_the_slowest_rate_the_watchdog_is_fed) {
  connect_for(300);
  ask(COMMAND(RATE, rate, WIRE_RATE_MIN_mHz));
  run_for(25000);
}

/* In the frame that is held for the temperature already, and until a temperature says otherwise. */
TEST(test_a_sensor_whose_temperature_jumps_is_told_to_be_doubtful) {
  press.force_N = 5.0;
  press.from_us = 700000;
  connect_for(600);
  start_streams(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW);
  run_for(200);
  struct wire_packet packet;
  while (array.command >> 4 != 5) {
    native_run_until(port_now_us() + 50, main_round, &app);
  }
  drop_packets();
  array.fault = (struct sim_fault){.kind = SIM_FAULT_FLIP, .transfer = array.transfers + 1 + 7, .mask = 0x80000};
  run_for(80);
  uint32_t first = 0, last = 0, doubtful = 0;
  while (next_packet(&packet)) {
    const uint32_t flags = packet.type == WIRE_CONTACT ? packet.body.contact.flags : packet.body.raw.flags;
    const bool doubts = flags & CONTACT_FLAG_SENSOR_DOUBTFUL, holds = flags & CONTACT_FLAG_HELD;
    TEST_ASSERT_TRUE(packet.type == WIRE_CONTACT || packet.body.raw.doubtful == (doubts && !holds ? 1 << 7 : 0));
    first = first ? first : flags;
    last = flags;
    doubtful += doubts;
  }
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SENSOR_DOUBTFUL | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_HELD, first);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SENSOR_DOUBTFUL, last);
  TEST_ASSERT_UINT32_WITHIN(2, 6, doubtful);
}

TEST(test_stages_end_at_what_fits) {
  static const uint32_t spent_us[] = {0, 65534, 65535, 65536, UINT32_MAX};
  for (unsigned i = 0; i < 5; i++) {
    struct wire_contact contact;
    app.found.spent_us[CRASH_AT_FIT] = spent_us[i];
    contact_stage_fill(&app.found, &contact);
    TEST_ASSERT_EQUAL_UINT16(i < 2 ? spent_us[i] : 65535, contact.stages.fit_us);
  }
}

TEST(test_uptime_keeps_the_rest_of_each_second) {
  connect_for(300);
  ask(COMMAND(RATE, rate, 1300));
  run_for(100000);
  const uint32_t now_s = (uint32_t)(port_now_us() / 1000000u);
  TEST_ASSERT_UINT32_WITHIN(2, now_s, get_health().uptime_s);
}

TEST(test_whether_the_watchdog_struck_is_told) {
  connect_for(300);
  TEST_ASSERT_EQUAL(0, get_health().watchdog_resets);
  rig_power_up_at(0, true);
  connect_for(300);
  TEST_ASSERT_EQUAL(1, get_health().watchdog_resets);
}

/* USB 2.0, 9.6.1: bcdDevice is 0xJJMN. */
TEST(test_the_port_tells_the_version) {
  const uint8_t *version = build_info.version;
  TEST_ASSERT_EQUAL_HEX16(version[0] * 256 + version[1] * 16 + version[2], native_cdc_identity()->device_version_bcd);
}

TEST(test_what_is_being_stored_is_told) {
  connect_for(300);
  struct wire_packet keep = {.type = WIRE_CMD_KEEP, .body.cmd_keep = {1}};
  struct wire_packet info = {.type = WIRE_CMD_INFO};
  send_packet(&keep);
  send_packet(&info);
  run_for(10);
  TEST_ASSERT_TRUE(next_of_type(WIRE_INFO, &info));
  TEST_ASSERT_TRUE(info.body.info.stored & WIRE_STORED_WRITING);
  run_for(500);
  drop_packets();
  TEST_ASSERT_FALSE(get_info().stored & WIRE_STORED_WRITING);
}
