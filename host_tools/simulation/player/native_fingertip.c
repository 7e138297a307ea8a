#include "simulation/player/native_fingertip.h"

#include "app/app.h"
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "native/native_flash.h"
#include "native/native_port.h"
#include "native/native_sync.h"
#include "port/port.h"

#include <string.h>

static struct app app;
static struct sim_array array;

static void on_event(void *context) { app_on_event(context); }

static void main_round(void *context) { app_run(context); }

static uint64_t bus_next_us(const void *context) { return sim_array_next_event_us(context); }

bool native_fingertip_start(const struct native_fingertip_settings *settings) {
  native_start(false);
  native_cdc_reset();
  native_sync_reset();
  native_flash_reset(settings->seed);
  if (settings->flash) {
    memcpy(native_flash.bytes, settings->flash, sizeof native_flash.bytes);
  }
  sim_array_init(&array, geometry.sensor_count, settings->seed);
  sim_array_vary_parts(&array, settings->prom_spread);
  array.noise = settings->noise;
  array.world = settings->world;
  array.parallel = settings->parallel_bus;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    array.absent[k] = settings->absent >> k & 1u;
  }
  native_set_event_source(bus_next_us, &array);
  port_set_event_handler(on_event, &app);
  app_start(&app, sim_array_bus(&array));
#if FT_WITH_TANGENTIAL
  if (settings->pad) {
    stages_use_profile(&app.stages, settings->pad);
  }
  return true;
#else
  return !settings->pad;
#endif
}

bool native_fingertip_run_until(uint64_t t_us) { return native_run_until(t_us, main_round, &app) == NATIVE_TIME_UP; }
