/* The sync pin: its setting, its edges as packets, and its pulses. */
#include "app_rig.h"

void setUp(void) {
  rig_start();
  connect_for(300);
}

void tearDown(void) { rig_end(); }

static uint8_t set(uint8_t mode) { return ask(COMMAND(SYNC, sync, mode)); }

TEST(it_is_off_until_it_is_set) {
  start_streams(WIRE_STREAM_HEALTH);
  TEST_ASSERT_EQUAL(PORT_SYNC_OFF, native_sync_mode());
  TEST_ASSERT_EQUAL_UINT8(0, get_info().sync);
  struct wire_packet packet;
  native_sync_edge();
  run_for(50);
  TEST_ASSERT_FALSE(next_of_type(WIRE_SYNC, &packet));
  TEST_ASSERT_EQUAL_UINT(0, native_sync_pulses());
}

TEST(it_knows_four_modes) {
  for (uint8_t mode = 0; mode < 5; mode++) {
    TEST_ASSERT_EQUAL_UINT8(mode < 4 ? WIRE_RESULT_DONE : WIRE_RESULT_OUT_OF_RANGE, set(mode));
    TEST_ASSERT_EQUAL_UINT8(mode < 4 ? mode : PORT_SYNC_SECOND, native_sync_mode());
    TEST_ASSERT_EQUAL_UINT8(native_sync_mode(), get_info().sync);
  }
}

TEST(edges_are_sent_with_their_times) {
  TEST_ASSERT_EQUAL_UINT8(WIRE_RESULT_DONE, set(PORT_SYNC_IN));
  start_streams(WIRE_STREAM_CONTACT);
  for (uint32_t number = 1; number <= 6; number++) {
    const uint64_t t_us = port_now_us();
    native_sync_edge();
    run_for(7);
    struct wire_packet packet;
    TEST_ASSERT_TRUE(next_of_type(WIRE_SYNC, &packet));
    TEST_ASSERT_EQUAL_UINT64(t_us, packet.t_us);
    TEST_ASSERT_EQUAL_UINT32(number, packet.body.sync.number);
    TEST_ASSERT_EQUAL_UINT8(number % 2, packet.body.sync.level);
  }
}

/* At a slow rate nothing else wakes the main loop. */
TEST(an_edge_waits_for_no_frame) {
  set(PORT_SYNC_SECOND);
  ask(COMMAND(RATE, rate, 1000));
  start_streams(WIRE_STREAM_CONTACT);
  native_sync_edge();
  run_for(3);
  struct wire_packet packet;
  TEST_ASSERT_TRUE(next_of_type(WIRE_SYNC, &packet));
}

TEST(nothing_is_sent_to_a_host_without_streams) {
  set(PORT_SYNC_IN);
  native_sync_edge();
  run_for(20);
  struct wire_packet packet;
  TEST_ASSERT_FALSE(next_of_type(WIRE_SYNC, &packet));
  start_streams(WIRE_STREAM_HEALTH);
  native_sync_edge();
  run_for(20);
  TEST_ASSERT_TRUE(next_of_type(WIRE_SYNC, &packet));
  TEST_ASSERT_EQUAL_UINT32(2, packet.body.sync.number);
}

TEST(a_storm_is_sent_at_a_bounded_rate) {
  set(PORT_SYNC_IN);
  start_streams(WIRE_STREAM_HEALTH);
  for (unsigned ms = 0; ms < 100; ms++) {
    for (unsigned i = 0; i < 200; i++) {
      native_sync_edge();
    }
    run_for(1);
  }
  run_for(PORT_SYNC_CAPACITY);
  struct wire_packet packet;
  uint32_t sent = 0, last = 0;
  while (next_packet(&packet)) {
    if (packet.type == WIRE_SYNC) {
      TEST_ASSERT_GREATER_THAN_UINT32(last, packet.body.sync.number);
      TEST_ASSERT_EQUAL_UINT8(packet.body.sync.number % 2, packet.body.sync.level);
      last = packet.body.sync.number;
      sent++;
    }
  }
  TEST_ASSERT_EQUAL_UINT32(100 * 200, last);
  TEST_ASSERT_UINT32_WITHIN(20, 100 * SYNC_EDGES_PER_ms + PORT_SYNC_CAPACITY, sent);
}

TEST(a_pulse_is_a_frame) {
  set(PORT_SYNC_FRAME);
  for (unsigned rate_Hz = 20; rate_Hz <= 100; rate_Hz += 80) {
    ask(COMMAND(RATE, rate, 1000 * rate_Hz));
    run_for(100);
    const uint32_t frames = get_health().frames;
    const unsigned pulses = native_sync_pulses();
    run_for(3000);
    const uint32_t passed = get_health().frames - frames;
    TEST_ASSERT_UINT32_WITHIN(1, passed, native_sync_pulses() - pulses);
    TEST_ASSERT_UINT32_WITHIN(4, 3 * rate_Hz, passed);
  }
  set(PORT_SYNC_OFF);
  const unsigned pulses = native_sync_pulses();
  run_for(300);
  TEST_ASSERT_EQUAL_UINT(pulses, native_sync_pulses());
}

TEST(it_is_off_while_the_bus_sleeps) {
  set(PORT_SYNC_SECOND);
  native_cdc_suspend(true);
  run_for(200);
  TEST_ASSERT_EQUAL(PORT_SYNC_OFF, native_sync_mode());
  const unsigned events = rig_events;
  run_for(1000);
  TEST_ASSERT_LESS_THAN_UINT(events + 200, rig_events);
  native_cdc_suspend(false);
  run_for(200);
  TEST_ASSERT_EQUAL(PORT_SYNC_SECOND, native_sync_mode());
  TEST_ASSERT_EQUAL_UINT8(PORT_SYNC_SECOND, get_info().sync);
}
