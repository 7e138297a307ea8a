/* An image that stores one thing after another with the firmware's own store and flash driver:
 * store_power.mjs is the debugger that its breakpoint calls. It commands what to store, cuts the
 * power, and judges what is left.
 *
 * All of a calibration, and all of a set of settings, follows from one number; so a mixture shows.
 */
#include "port/port.h"
#include "store/store.h"

#include <stddef.h>
#include <string.h>

/* Few, so that ten thousand updates take a minute: a record of 110 bytes. */
enum { SENSORS = 4 };

enum job_kind { JOB_FINISH, JOB_CALIBRATE, JOB_ERASE, JOB_KEEP, JOB_FORGET };

/* Words of 32 bits, in this order, as store_power.mjs writes and reads them. */
static struct {
  uint32_t kind, number;
  /* What is there; 0: nothing, a number otherwise */
  uint32_t calibration, settings;
  uint32_t mixed, damaged, writing, failures;
} job;

#define LOOK_us 100u

static struct store store;

static struct calibration calibration_of(uint32_t number) {
  struct calibration calibration;
  memset(&calibration, 0, sizeof calibration);
  calibration.date_s = number;
  calibration.placements = (uint16_t)(number * 7);
  calibration.force_scale = 0.5f + (float)(number % 97) * 0.01f;
  calibration.force_scale_sd = (float)(number % 13) * 0.01f;
  for (uint32_t k = 0; k < SENSORS; k++) {
    calibration.sensors[k].gain = 0.7f + (float)((number + 11 * k) % 61) * 0.01f;
    calibration.sensors[k].gain_sd = (float)((number + 5 * k) % 17) * 0.01f;
  }
  return calibration;
}

_Static_assert(offsetof(struct store_settings, rate_mHz) == 0, "the number comes first");

static struct store_settings settings_of(uint32_t number) {
  struct store_settings settings;
  uint8_t bytes[sizeof settings];
  for (size_t i = 0; i < sizeof bytes; i++) {
    bytes[i] = (uint8_t)(number % (83 + i) + 7 * i);
  }
  memcpy(bytes, &number, sizeof number);
  memcpy(&settings, bytes, sizeof settings);
  settings.sync &= UINT8_MAX; /* the store keeps 8 bits */
  return settings;
}

static void answer(void) {
  const struct store_content *content = &store.content;
  const struct calibration calibration = calibration_of(content->calibration.date_s);
  const struct store_settings settings = settings_of(content->settings.rate_mHz);
  job.calibration = content->has_calibration ? content->calibration.date_s : 0;
  job.settings = content->has_settings ? content->settings.rate_mHz : 0;
  job.mixed = (content->has_calibration && memcmp(&calibration, &content->calibration, sizeof calibration) != 0) ||
              (content->has_settings && memcmp(&settings, &content->settings, sizeof settings) != 0);
  job.damaged = store.damaged;
  job.writing = store_is_writing(&store);
}

static void begin(void) {
  const struct calibration calibration = calibration_of(job.number);
  const struct store_settings settings = settings_of(job.number);
  switch (job.kind) {
  case JOB_CALIBRATE:
    store_put_calibration(&store, &calibration);
    break;
  case JOB_ERASE:
    store_put_calibration(&store, NULL);
    break;
  case JOB_KEEP:
    store_put_settings(&store, &settings);
    break;
  case JOB_FORGET:
    store_put_settings(&store, NULL);
    break;
  default:
    break;
  }
}

int main(void) {
  store_init(&store, SENSORS);
  for (;;) {
    answer();
    register void *argument __asm("r0") = &job;
    __asm volatile("bkpt 1" : : "r"(argument) : "memory");
    begin();
    while (store_is_writing(&store)) {
      port_watchdog_feed();
      job.failures += store_poll(&store, port_now_us()) < FT_OK;
      port_alarm_at_us(port_now_us() + LOOK_us);
      port_sleep();
    }
  }
}
