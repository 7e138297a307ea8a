#include "player/native_fingertip.h"

#include "app/app.h"
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "native/native_port.h"
#include "port/port.h"

/* C1..C6 of a public dump of an MS5840. */
static const uint16_t TYPICAL[6] = {41335, 41466, 26840, 27317, 31225, 28780};

static struct app app;
static struct sim_array array;

static void on_event(void *context) {
  app_on_event(context);
}

static void main_round(void *context) {
  app_run(context);
}

static uint64_t bus_next_us(const void *context) {
  return sim_array_next_event_us(context);
}

/* splitmix64, 0..1 */
static double random_share(uint64_t *state) {
  uint64_t z = *state += UINT64_C(0x9E3779B97F4A7C15);
  z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
  z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
  return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}

void native_fingertip_start(const struct native_fingertip_settings *settings) {
  native_start(false);
  native_cdc_reset();
  sim_array_init(&array, geometry.sensor_count, settings->seed);
  uint64_t random = settings->seed ^ UINT64_C(0x50524F4D);
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    uint16_t c[6];
    for (int i = 0; i < 6; i++) {
      const double share = 1.0 + settings->prom_spread * (2.0 * random_share(&random) - 1.0);
      c[i] = (uint16_t)(TYPICAL[i] * share);
    }
    sim_ms5840_init(&array.sensor[k], c);
  }
  array.noise = settings->noise;
  array.world = settings->world;
  native_set_event_source(bus_next_us, &array);
  port_set_event_handler(on_event, &app);
  app_start(&app, sim_array_bus(&array));
  if (settings->prior_width_mm > 0.0f) {
    app.fit_settings.prior_sigma_mm = settings->prior_sigma_mm;
    app.fit_settings.prior_width_mm = settings->prior_width_mm;
  }
}

bool native_fingertip_run_until(uint64_t t_us) {
  return native_run_until(t_us, main_round, &app) == NATIVE_TIME_UP;
}
