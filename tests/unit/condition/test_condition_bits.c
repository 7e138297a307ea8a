/* Conditioning to the bit: frames by chance with presses, drifts, steps and sensors that fail. What changes a reading
 * was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "condition/condition.h"
#include "support/draw.h"
#include "support/golden.h"
#include "support/unit.h"

enum { SENSORS = 15, COURSES = 64, FRAMES = 6000 };
#define Pa 1024
#define ONE_IN(n) (draw_between(1, (n)) == 1)

static struct condition condition;
static struct conditioned conditioned;
static struct frame frame;

/* What presses on each sensor, how it grows in a frame, and the frames that it still does. */
static struct {
  int32_t pressure[SENSORS], slope[SENSORS];
  int32_t left;
  int32_t steady; /* changes so much less often */
} load;

static int32_t bell(int32_t k, int32_t centre, int32_t peak) {
  int32_t across = k / 5 - centre / 5, along = k % 5 - centre % 5;
  const int32_t off = 2 * (across * across + along * along);
  return peak >> (off < 31 ? off : 31);
}

/* Rest, a press, a slow drift of all, or of one sensor, for a while. */
static void change_load(void) {
  load.left = draw_between(10, 400) * load.steady;
  int32_t kind = draw_between(0, 4), centre = draw_between(0, SENSORS - 1);
  int32_t peak = draw_between(100, 60000) * Pa;
  for (int32_t k = 0; k < SENSORS; k++) {
    load.slope[k] = kind == 2 ? draw_between(-40, 80) : kind == 3 ? (k == centre ? draw_between(0, 400) : 0) : 0;
    if (kind == 0) {
      load.pressure[k] = ONE_IN(3) ? draw_between(-50, 200) * Pa : 0;
    } else if (kind == 1 || kind == 4) {
      load.pressure[k] = bell(k, centre, kind == 1 ? peak : peak / 64);
    }
  }
}

static void draw_frame(int32_t period_us) {
  if (load.left-- <= 0) {
    change_load();
  }
  frame.t_us += (uint32_t)period_us;
  frame.t_us += ONE_IN(400) ? (uint64_t)draw() % 5000000 : 0;
  frame.valid = ONE_IN(100) ? draw() & 0x7FFF : 0x7FFF;
  frame.saturated = ONE_IN(300) ? draw() & 0x7FFF : 0;
  frame.renewed = ONE_IN(500) ? draw() & 0x7FFF : 0;
  frame.unsettled = ONE_IN(300) ? draw() & 0x7FFF : 0;
  for (int k = 0; k < SENSORS; k++) {
    load.pressure[k] += load.slope[k];
    frame.pressure_Pa_q10[k] = 100000 * Pa + load.pressure[k] + draw_between(-8 * Pa, 8 * Pa);
    if (ONE_IN(20000)) {
      frame.pressure_Pa_q10[k] = (int32_t)draw();
    }
  }
}

static uint32_t with_frame(uint32_t crc) {
  const uint32_t usable = (uint32_t)conditioned.usable;
  uint32_t words[7 + 2 * SENSORS] = {
      crc, usable, conditioned.tared, conditioned.contact, conditioned.zero_doubtful, (uint32_t)conditioned.peak_Pa_q10};
  memcpy(&words[7], conditioned.pressure_Pa_q10, SENSORS * sizeof words[0]);
  memcpy(&words[7 + SENSORS], condition.hysteresis_sd_Pa_q10, SENSORS * sizeof words[0]);
  return crc32_iso_hdlc((const uint8_t *)words, sizeof words);
}

static uint32_t course(void) {
  struct condition_gains gains;
  for (int k = 0; k < 32; k++) {
    gains.inverse_q16[k] = (uint32_t)draw_between(16384, 262144);
  }
  const bool has_gains = ONE_IN(2);
  const int32_t period_us = draw_between(700, 50000);
  memset(&frame, 0, sizeof frame);
  memset(&load, 0, sizeof load);
  load.steady = ONE_IN(2) ? 10 : 1;
  frame.sensor_count = SENSORS;
  frame.t_us = draw();
  frame.noise_Pa_q10 = draw_between(1, 11) * Pa;
  condition_start(&condition);
  uint32_t crc = 0;
  for (int i = 0; i < FRAMES; i++) {
    draw_frame(period_us);
    condition_frame(&condition, &frame, has_gains ? &gains : NULL, &conditioned);
    condition_follow(&condition, &frame, &conditioned);
    crc = with_frame(crc);
    if (ONE_IN(1000)) {
      condition_tare(&condition);
    }
  }
  return crc;
}

TEST(test_frames_are_conditioned_the_same_to_the_bit) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x99438BE2, 0xDF2135B7, 0x5A97A205, 0x4CA95B04,
                                                 0xE7746BE6, 0xAE919378, 0x6662B206, 0xE8A3B92C};
  uint32_t found[GOLDEN_BLOCKS] = {0};
  draw_from(UINT64_C(0x7A65726F));
  for (int i = 0; i < COURSES; i++) {
    uint32_t *block = &found[i / (COURSES / GOLDEN_BLOCKS)];
    *block = golden_join(*block, course());
  }
  golden_assert("courses", COURSES, golden, found);
}
