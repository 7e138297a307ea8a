/* Fifteen sensors under a pad, frame by frame, for the tests of condition/. setUp begins at 206 frames a second, untared. */
#pragma once

#include "condition/condition.h"
#include "support/random.h"
#include "support/unit.h"

enum { SENSORS = 15 };
#define ALL 0x7FFFu
#define Pa 1024
#define AMBIENT (100000 * Pa)
#define NOISE (4 * Pa)
#define OPEN (GATE_OPEN_Pa * Pa + GATE_OPEN_SIGMA * NOISE)

extern struct condition condition;
extern struct conditioned conditioned;
extern struct frame frame;
extern uint32_t period_us;
void fill(int32_t pressure_Pa_q10);
void run(int count);
int frames_in(float seconds);
void run_s(float seconds);

/* What the readings of these sensors rise by meanwhile. Leaves how long there was a contact, and how long one that was
 * not doubted; one frame adds to both. */
extern float contact_s, unflagged_s;
void watch_frame(void);
void watch_s(float seconds, float slope_Pa_s, uint32_t sensors);

/* A bump like that of a contact above sensor 7, up to 1. */
float bump(int k);
void press(int32_t peak);
void hold(int32_t peak, float seconds);
void begin(uint32_t frame_period_us);

/* Tared and warm. */
void begin_idle(uint32_t frame_period_us);

/* pico_mux at OSR 1024, pico_parallel at 256, either at 8192, a rate that was set, and the least */
enum { PERIODS = 5, FAST_PERIODS = 3 };
extern const uint32_t periods_us[PERIODS];

/* After a release: `share` of the press stays, and comes back with a time constant. */
void release(float share, float time_constant_s, float seconds);
