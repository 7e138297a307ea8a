/* Ends of counters: the same second of the world is felt whatever the clock shows, and whatever the counters have come to. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "support/pad.h"

#define PRESS_AFTER_us 1600000u
#define MOVE_AFTER_us 2000000u
#define CROSSING_AFTER_us 2200000u
#define RUN_ms 3200u
#define DAY_us UINT64_C(86400000000)
/* What the firmware may shift times by before it looks at them. */
#define ALIGNED_us (UINT64_C(1) << 24)

enum { MOST_PACKETS = 8000 };

struct told {
  struct wire_packet packets[MOST_PACKETS];
  unsigned count;
};
static struct told usual, after_all;

static uint64_t begun_us;

/* Pressed at first in one place, then drawn along. */
static double field_Pa(double dx_mm, double dy_mm, uint64_t t_us) {
  const uint64_t moves_us = begun_us + MOVE_AFTER_us;
  dx_mm -= t_us > moves_us ? (double)(t_us - moves_us) * 12e-6 : 0.0;
  dx_mm += 6.0;
  const double v = 5.7 * 5.7;
  return 5.0 / (2.0 * PI * v * 1e-6) * exp(-(dx_mm * dx_mm + dy_mm * dy_mm) / (2.0 * v));
}

struct start {
  uint64_t t_us;
  uint32_t count; /* of everything that counts up */
};

static void count_on(uint32_t count) {
  app.scan.frame_number = count;
  app.line.sequence = (uint16_t)count;
  app.line.sent = count;
  app.commands.done = count;
  app.statistics.uptime_s = count;
  atomic_store(&app.scan.counters.frames, count);
  atomic_store(&app.scan.counters.bus_nacks, count);
  app.statistics.frames = count;
}

/* As if all had begun at 0. */
static void tell(struct told *told, const struct start *start, struct wire_packet *packet) {
  TEST_ASSERT_LESS_THAN(MOST_PACKETS, told->count);
  packet->sequence = (uint16_t)(packet->sequence - start->count);
  packet->t_us -= start->t_us;
  switch (packet->type) {
  case WIRE_CONTACT: packet->body.contact.frame -= start->count; break;
  case WIRE_RAW: packet->body.raw.frame -= start->count; break;
  case WIRE_HEALTH:
    packet->body.health.uptime_s -= start->count;
    packet->body.health.frames -= start->count;
    packet->body.health.packets_sent -= start->count;
    packet->body.health.commands_done -= start->count;
    packet->body.health.bus_nacks -= start->count;
    break;
  default: break;
  }
  told->packets[told->count++] = *packet;
}

static void run(struct told *told, const struct start *start) {
  told->count = 0;
  begun_us = start->t_us;
  memset(&press, 0, sizeof press);
  press.force_N = 5.0;
  press.from_us = begun_us + PRESS_AFTER_us;
  world_field_Pa = field_Pa;
  native_flash_reset(1);
  rig_power_up_at(start->t_us, false);
  count_on(start->count);
  connect_for(300);
  obey(COMMAND(PAD, pad, pad_of_12_mm()));
  start_streams(WIRE_STREAM_ALL);
  for (unsigned ms = 0; ms < RUN_ms; ms += 20) {
    struct wire_packet packet;
    run_for(20);
    while (next_packet(&packet)) {
      tell(told, start, &packet);
    }
  }
  rig_end();
}

static void check(uint64_t crossing_us, uint32_t count) {
  const uint64_t t_us = crossing_us - CROSSING_AFTER_us;
  const struct start as_usual = {.t_us = ALIGNED_us + t_us % ALIGNED_us};
  const struct start start = {.t_us = t_us, .count = count};
  run(&usual, &as_usual);
  run(&after_all, &start);
  TEST_ASSERT_GREATER_THAN(500, usual.count);
  TEST_ASSERT_EQUAL(usual.count, after_all.count);
  uint32_t flags = 0;
  for (unsigned i = 0; i < usual.count; i++) {
    TEST_ASSERT_EQUAL_MEMORY(&usual.packets[i], &after_all.packets[i], sizeof usual.packets[i]);
    if (usual.packets[i].type == WIRE_CONTACT) {
      flags |= usual.packets[i].body.contact.flags;
    }
  }
  /* All that has a memory of times took part. */
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_TARED | CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_HELD | CONTACT_FLAG_TANGENTIAL_VALID |
                            CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_SLIDING,
                        flags);
}

TEST(the_clock_crosses_2_to_the_32_us) { check(UINT64_C(1) << 32, 0); }

TEST(the_clock_crosses_2_to_the_32_ms) { check((UINT64_C(1) << 32) * 1000, 0); }

/* Milliseconds as the zero counts them: 1024 us each. */
TEST(the_clock_crosses_2_to_the_42_us) { check(UINT64_C(1) << 42, 0); }

TEST(sixty_days_have_passed) { check(60 * DAY_us, 60u * 86400u); }

TEST(frames_and_sequences_cross_their_ends) { check(60 * DAY_us, UINT32_MAX - 300); }
