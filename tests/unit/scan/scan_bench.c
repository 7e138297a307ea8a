#include "scan_bench.h"

struct fake_bus fake;
struct array_bus bus;
struct scan scan;
uint64_t now_us;
struct frame frame;
bool taking;
int frames;
uint32_t lateness_us;
struct random lateness;

void power_up(uint8_t sensor_count, const struct scan_settings *settings) {
  now_us = 0;
  taking = true;
  frames = 0;
  lateness_us = 0;
  lateness.state = 30;
  fake_bus_init(&fake, &bus, sensor_count);
  TEST_ASSERT_EQUAL_INT(FT_OK, scan_init(&scan, &bus, settings));
}

const struct scan_settings usual = {.sensor_count = SENSORS, .osr = 1024, .rate_mHz = 0};

void setUp(void) { power_up(SENSORS, &usual); }

void tearDown(void) { TEST_ASSERT_EQUAL_INT_MESSAGE(0, fake.misuses, fake.misuse ? fake.misuse : ""); }

void next_case(const struct scan_settings *settings) {
  tearDown();
  power_up(settings->sensor_count, settings);
}

void next_case_of(uint16_t osr, uint32_t rate_mHz) {
  next_case(&(struct scan_settings){.sensor_count = SENSORS, .osr = osr, .rate_mHz = rate_mHz});
}

bool step(void) {
  uint64_t wake_us = now_us;
  for (int calls = 0; wake_us <= now_us; calls++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(4, calls, "asks again and again for the present");
    wake_us = scan_step(&scan, now_us);
  }
  bool taken = taking && scan_take(&scan, &frame);
  frames += taken;
  now_us = wake_us + random_below(&lateness, lateness_us + 1);
  return taken;
}

void run_until(uint64_t end_us) {
  while (now_us < end_us) {
    step();
  }
}

void next_frame(void) {
  for (int steps = 0; !step(); steps++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(2000, steps, "no frame comes");
  }
}

uint64_t next_period_us(void) {
  const uint64_t last_us = frame.t_begin_us;
  next_frame();
  return frame.t_begin_us - last_us;
}

void skip_frames(int count) {
  for (int i = 0; i < count; i++) {
    next_frame();
  }
}

uint32_t value_of(const _Atomic uint32_t *value) { return atomic_load(value); }

void assert_entry(int at, enum fake_operation operation, uint8_t command) {
  TEST_ASSERT_LESS_THAN_INT(fake.logged, at);
  TEST_ASSERT_EQUAL_INT(operation, fake.log[at].operation);
  TEST_ASSERT_EQUAL_HEX8(command, fake.log[at].command);
}

int assert_admission(int at, int passes) {
  assert_entry(at++, FAKE_COMMAND, 0x1E);
  for (int pass = 0; pass < passes; pass++) {
    for (uint8_t word = 0; word < PROM_READS; word++) {
      TEST_ASSERT_EQUAL_UINT8(2, fake.log[at].byte_count);
      assert_entry(at++, FAKE_READ, (uint8_t)(0xA0 + 2 * word));
    }
  }
  return at;
}

int count_entries(uint8_t command, enum fake_operation operation) {
  int found = 0;
  for (int i = 0; i < fake.logged; i++) {
    found += fake.log[i].operation == operation && fake.log[i].command == command;
  }
  return found;
}

int find_entry(int from, uint8_t command, enum fake_operation operation) {
  while (from < fake.logged && !(fake.log[from].operation == operation && fake.log[from].command == command)) {
    from++;
  }
  TEST_ASSERT_LESS_THAN_INT_MESSAGE(fake.logged, from, "the operation never came");
  return from;
}

int32_t expected_Pa_q10(uint8_t k) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(&fake.prom[k], fake.d2[k], MS58XX_BRANCH_UNKNOWN, &thermal);
  return ms58xx_compensate_pressure(&thermal, fake_d1(&fake, k));
}

void assert_good_frame(sensor_map valid) {
  TEST_ASSERT_EQUAL_HEX32(valid, frame.valid);
  for (uint8_t k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(valid >> k & 1u ? expected_Pa_q10(k) : 0, frame.pressure_Pa_q10[k]);
  }
}

void skip_to_temperature(void) {
  for (int steps = 0; scan.state != SCAN_WAIT_CONVERSION || !scan.conversion->is_temperature; steps++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(20000, steps, "no temperature comes");
    step();
  }
}
