/* A scan of fifteen fake sensors under usual settings, in simulated time, for the tests of scan/.
 * setUp powers it up; tearDown fails if the scan misused a sensor. */
#pragma once

#include "fake_bus.h"
#include "scan/scan.h"
#include "support/random.h"
#include "support/unit.h"

enum { SENSORS = 15, PROM_READS = MS58XX_PROM_WORDS };
#define ALL 0x7FFFu
#define LONGEST_INTERVAL_us (SCAN_TEMPERATURE_INTERVAL_MAX_ms * 1000u)
#define DISTURBED 3
#define DISTURBED_BIT (1u << DISTURBED)

extern struct fake_bus fake;
extern struct array_bus bus;
extern struct scan scan;
extern uint64_t now_us;
extern struct frame frame;
extern bool taking; /* the main context keeps up */
extern int frames;
extern uint32_t lateness_us; /* at most, of every wake-up */
extern struct random lateness;
void power_up(uint8_t sensor_count, const struct scan_settings *settings);
extern const struct scan_settings usual;
void next_case(const struct scan_settings *settings);
void next_case_of(uint16_t osr, uint32_t rate_mHz);

/* One wake-up of the event context, then the main context. True: a frame was taken. A wake time in the past would be an interrupt storm. */
bool step(void);
void run_until(uint64_t end_us);
void next_frame(void);
uint64_t next_period_us(void); /* to the begin of the next frame */
void skip_frames(int count);
uint32_t value_of(const _Atomic uint32_t *value);
void assert_entry(int at, enum fake_operation operation, uint8_t command);

/* Asserts a reset and this many PROM passes from an entry on; returns the entry after them. */
int assert_admission(int at, int passes);
int count_entries(uint8_t command, enum fake_operation operation);
int find_entry(int from, uint8_t command, enum fake_operation operation);
int32_t expected_Pa_q10(uint8_t k);
void assert_good_frame(sensor_map valid);

/* To the middle of the next conversion of the temperature. */
void skip_to_temperature(void);
