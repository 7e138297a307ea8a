#include "condition_bench.h"

#include <string.h>

struct condition condition;
struct conditioned conditioned;
struct frame frame;
uint32_t period_us;

void fill(int32_t pressure_Pa_q10) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = pressure_Pa_q10;
  }
}

void run(int count) {
  for (int i = 0; i < count; i++) {
    frame.t_us += period_us;
    condition_frame(&condition, &frame, NULL, &conditioned);
    condition_follow(&condition, &frame, &conditioned);
  }
}

int frames_in(float seconds) { return (int)(seconds * 1e6f / (float)period_us + 0.5f); }

void run_s(float seconds) { run(frames_in(seconds)); }

float contact_s, unflagged_s;

void watch_frame(void) {
  run(1);
  contact_s += conditioned.contact ? 1e-6f * (float)period_us : 0;
  unflagged_s += conditioned.contact && !conditioned.zero_doubtful ? 1e-6f * (float)period_us : 0;
}

void watch_s(float seconds, float slope_Pa_s, uint32_t sensors) {
  contact_s = unflagged_s = 0;
  double moved = 0;
  for (int i = frames_in(seconds); i > 0; i--) {
    double before = moved;
    moved += 1024.0 * (double)slope_Pa_s * (double)period_us * 1e-6;
    int32_t step = (int32_t)moved - (int32_t)before;
    for (int k = 0; k < SENSORS; k++) {
      frame.pressure_Pa_q10[k] += sensors >> k & 1u ? step : 0;
    }
    watch_frame();
  }
}

float bump(int k) {
  static const float by_distance[3][3] = {{1, 0.29f, 0.007f}, {0.29f, 0.08f, 0.002f}};
  int across = k / 5 - 1, along = k % 5 - 2;
  return by_distance[across < 0 ? -across : across][along < 0 ? -along : along];
}

void press(int32_t peak) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = AMBIENT + (int32_t)(bump(k) * (float)peak);
  }
}

void hold(int32_t peak, float seconds) {
  press(peak);
  run_s(seconds);
}

void begin(uint32_t frame_period_us) {
  condition_start(&condition);
  memset(&frame, 0, sizeof frame);
  period_us = frame_period_us;
  frame.t_us = 3000000;
  frame.sensor_count = SENSORS;
  frame.noise_Pa_q10 = NOISE;
  frame.valid = ALL;
  fill(AMBIENT);
}

void begin_idle(uint32_t frame_period_us) {
  begin(frame_period_us);
  run_s(60);
}

const uint32_t periods_us[PERIODS] = {4854, 765, 17544, 1000000, 10000000};

void setUp(void) { begin(4854); }

void tearDown(void) {}

void release(float share, float time_constant_s, float seconds) {
  contact_s = unflagged_s = 0;
  float left = share, decay = 1.0f - 1e-6f * (float)period_us / time_constant_s;
  for (int i = frames_in(seconds); i > 0; i--) {
    press((int32_t)(left * 20000.0f) * Pa);
    left *= decay > 0 ? decay : 0;
    watch_frame();
  }
}
