#include "native_firmware.h"

#include "app/app.h"
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "port/flash.h"
#include "port/port.h"

static struct app app;
static struct sim_array array;

static void on_event(void *context) { app_on_event(context); }

static void main_round(void *context) { app_run(context); }

static uint64_t bus_next_us(const void *context) { return sim_array_next_event_us(context); }

struct sim_array *storm_firmware_array(void) {
  return &array;
}

void storm_firmware_power_sensors(uint64_t seed) {
  sim_array_init(&array, geometry.sensor_count, seed);
  sim_array_vary_parts(&array, 0.03);
}

void storm_firmware_cut_sensors(void) {
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    sim_ms5840_power_cycle(&array.sensor[k]);
  }
}

void storm_firmware_start(uint64_t elapsed_us, uint64_t clock_us) {
  sim_array_restart_bus(&array, elapsed_us);
  while (port_flash_poll()) { /* a flash goes on while the chip is in reset */
  }
  native_start(false);
  native_set_time(clock_us);
  native_cdc_reset();
  native_set_event_source(bus_next_us, &array);
  port_set_event_handler(on_event, &app);
  app_start(&app, sim_array_bus(&array));
}

enum native_end storm_firmware_run_until(uint64_t t_us) { return native_run_until(t_us, main_round, &app); }
