/* The slots between the scan, which runs in the event interrupt, and the main loop that takes frames. Every frame is of
 * one conversion: codes, number and times; frames come in their order, and each is taken or counted as skipped; a
 * temperature is never overtaken by a frame after it: else the test fails. */
#include "explore.h"
#include "scan/scan.h"
#include "support/unit.h"

#include <stdlib.h>
#include <string.h>

enum {
  TAKES = 4,
  SENSORS = 2,
  NUMBERS = 32,
  SETTLE = 6,
  FIRST_FRAME = 2 /* the first conversion is of the temperature, and no frame */
};

/* Sensors that are ready at once, all of the same PROM; the codes of a conversion are the same, and other than those of the one before. */
static struct {
  uint8_t command;
  uint32_t conversions;
  uint64_t begun_us[NUMBERS]; /* [conversion] */
} sensors;

static struct array_bus bus;
static struct scan scan;
static struct frame frame;
static uint64_t now_us;
static uint32_t taken, last_number;
static uint64_t last_t_us;
static bool is_taking, ended_in_call;

/* Over all runs: what a frame of this number measured. */
static int32_t *pressure_of;

static enum ft_status start_command(void *context, uint8_t command, uint64_t t_us) {
  (void)context;
  sensors.command = command;
  if (command != MS58XX_CMD_RESET) {
    sensors.begun_us[++sensors.conversions] = t_us;
  }
  return FT_OK;
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t count, uint64_t t_us) {
  (void)context;
  (void)count;
  (void)t_us;
  if (command != MS58XX_CMD_READ_ADC) {
    sensors.command = command;
  }
  return FT_OK;
}

static enum ft_status start_recovery(void *context, uint64_t t_us) {
  (void)context;
  (void)t_us;
  return FT_OK;
}

static uint32_t answer(void) {
  struct ms58xx_prom prom = {{0x0040, 46372, 43981, 29059, 27842, 31553, 28165}};
  prom.word[0] |= (uint16_t)(ms58xx_prom_crc4(&prom) << 12);
  if ((sensors.command & 0xF0) == 0x40) {
    return 6465444u + 256u * sensors.conversions;
  }
  if ((sensors.command & 0xF0) == 0x50) {
    return 8227636u;
  }
  return (uint32_t)prom.word[(sensors.command - MS58XX_CMD_READ_PROM) / 2 % MS58XX_PROM_WORDS] << 8;
}

static enum ft_status poll(void *context, uint64_t t_us, struct array_bus_result *result, uint64_t *wake_us) {
  (void)context;
  (void)t_us;
  (void)wake_us;
  uint32_t code = answer();
  for (int k = 0; k < SENSORS; k++) {
    result->bytes[k][0] = (uint8_t)(code >> 16);
    result->bytes[k][1] = (uint8_t)(code >> 8);
    result->bytes[k][2] = (uint8_t)code;
  }
  result->acknowledged = (1u << SENSORS) - 1;
  result->nacks = 0;
  return FT_OK;
}

/* Interrupt: until one more conversion has been read. They end 0.7 ms apart at the least, and to take a frame takes
 * less than half of that: in one call of scan_take only one ends. */
static void finish_conversion(void) {
  if (ended_in_call) {
    return;
  }
  ended_in_call = is_taking;
  const struct scan_conversion *under_way = scan.conversion;
  for (int i = 0; i < 10 && scan.conversion == under_way; i++) {
    uint64_t wake_us = scan_step(&scan, now_us);
    now_us = wake_us > now_us ? wake_us : now_us + 1;
  }
}

/* The same, and the next is of the temperature. */
static void finish_before_temperature(void) {
  if (!ended_in_call) {
    scan.next_temperature_us = 0;
  }
  finish_conversion();
}

static void judge_frame(void) {
  TEST_ASSERT_TRUE_MESSAGE(taken == 0 || (int32_t)(frame.number - last_number) > 0, "frames out of order, or one twice");
  TEST_ASSERT_TRUE_MESSAGE(taken == 0 || frame.t_us > last_t_us, "a frame from before");
  last_number = frame.number;
  last_t_us = frame.t_us;
  taken++;
  if (frame.held) {
    return;
  }
  TEST_ASSERT_EQUAL_MESSAGE(frame.pressure_Pa_q10[0], frame.pressure_Pa_q10[1], "a torn frame");
  TEST_ASSERT_EQUAL(3, frame.valid);
  TEST_ASSERT_EQUAL_MESSAGE(sensors.begun_us[frame.number + FIRST_FRAME], frame.t_begin_us, "a frame of two conversions: its time");
  int32_t *pressure = &pressure_of[frame.number];
  if (*pressure == 0) {
    *pressure = frame.pressure_Pa_q10[0];
  }
  TEST_ASSERT_EQUAL_MESSAGE(*pressure, frame.pressure_Pa_q10[0], "a frame of two conversions");
}

/* Main context: takes a frame if there is one, and judges it. */
static void take_frame(void) {
  is_taking = true;
  ended_in_call = false;
  const bool is_new = scan_take(&scan, &frame);
  is_taking = false;
  ended_in_call = false;
  if (is_new) {
    judge_frame();
  }
}

static void judge_all(void) {
  for (int i = 0; i < 4; i++) {
    take_frame();
  }
  TEST_ASSERT_FALSE(scan_has_news(&scan));
  uint32_t frames = atomic_load(&scan.counters.frames);
  TEST_ASSERT_EQUAL_MESSAGE(frames, taken + atomic_load(&scan.counters.frames_skipped), "a frame is lost and not counted");
}

/* After some frames; nothing waits. */
static void start(void) {
  const struct scan_settings settings = {.sensor_count = SENSORS, .osr = 256};
  bus = (struct array_bus){
      .answers_are_single = true, .start_command = start_command, .start_read = start_read, .start_recovery = start_recovery, .poll = poll};
  pressure_of = calloc(NUMBERS, sizeof *pressure_of);
  TEST_ASSERT_NOT_NULL(pressure_of);
  TEST_ASSERT_EQUAL(FT_OK, scan_init(&scan, &bus, &settings));
  memset(&sensors, 0, sizeof sensors);
  memset(&frame, 0, sizeof frame);
  now_us = 0;
  taken = 0;
  for (int i = 0; i < 200 && taken < SETTLE; i++) {
    finish_conversion();
    take_frame();
  }
  TEST_ASSERT_EQUAL(SETTLE, taken);
}

static void take_frames(void) {
  explore_begin();
  for (int i = 0; i < TAKES; i++) {
    take_frame();
  }
  explore_end();
  judge_all();
}

static void explore_from_here(const char *what, unsigned most) {
  static const struct explore_interrupt interrupts[] = {{finish_conversion, 1, 4}, {finish_before_temperature, 1, 2}};
  unsigned long points;
  unsigned long runs = explore(take_frames, interrupts, 2, most, &points);
  printf("%s: up to %u interrupts, %lu runs, %lu points\n", what, most, runs, points);
  TEST_ASSERT_GREATER_THAN(1000, runs);
}

TEST(test_frames_are_whole_from_an_empty_slot) {
  start();
  explore_from_here("empty", 3);
}

TEST(test_frames_are_whole_when_one_waits) {
  start();
  finish_conversion();
  explore_from_here("one waits", 3);
}

TEST(test_frames_are_whole_when_a_temperature_waits_too) {
  start();
  finish_before_temperature();
  finish_conversion();
  finish_conversion();
  explore_from_here("both wait", 2);
}
