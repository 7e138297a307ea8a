// The simulated fingertip's firmware for the page: player/native_fingertip.h, one a module. Times
// are in microseconds since power-up; what feels them is the scenario or the pad of the page.
#include "player/native_fingertip.h"
#include "player/samples.hpp"
#include "web/wasm/pad.hpp"

extern "C" {
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "native/native_flash.h"
#include "native/native_port.h"
}

#include <cstring>

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace fingertip::web {
namespace {

// What the page fills in beforehand.
class Rows : public Samples {
public:
  void resize(unsigned rows, double ambient_Pa) {
    sensors_ = geometry.sensor_count;
    ambient_Pa_ = ambient_Pa;
    times_s_.assign(rows, 0.0);
    pressures_Pa_.assign(std::size_t(rows) * sensors_, 0.0F);
    temperatures_degC_.assign(rows, 25.0F);
  }
  double *times_s() { return times_s_.data(); }
  float *pressures_Pa() { return pressures_Pa_.data(); }
  float *temperatures_degC() { return temperatures_degC_.data(); }
};

Rows rows;

double pressure_of_rows_Pa(void *, unsigned sensor, std::uint64_t t_us) {
  return rows.pressure_Pa(sensor, t_us);
}
double temperature_of_rows_degC(void *, unsigned, std::uint64_t t_us) {
  return rows.temperature_degC(t_us);
}
double pressure_of_pad_Pa(void *, unsigned sensor, std::uint64_t t_us) {
  return pad().pressure_Pa(sensor, t_us);
}

std::uint8_t line[NATIVE_CDC_TRANSMIT_BYTES];
std::uint8_t kept[NATIVE_FLASH_BYTES];
char serial[17] = "0000000000000001";

} // namespace
} // namespace fingertip::web

using namespace fingertip;
using namespace fingertip::web;

EXPORT(sensor_count) unsigned sensor_count() {
  return geometry.sensor_count;
}
EXPORT(sensor_x_mm) float sensor_x_mm(unsigned sensor) {
  return geometry.x_mm[sensor];
}
EXPORT(sensor_y_mm) float sensor_y_mm(unsigned sensor) {
  return geometry.y_mm[sensor];
}

// Room for a scenario of so many rows: then fill in what the next three say.
EXPORT(rows_begin) void rows_begin(unsigned count, double ambient_Pa) {
  rows.resize(count, ambient_Pa);
}
EXPORT(rows_times) double *rows_times() {
  return rows.times_s();
}
EXPORT(rows_pressures) float *rows_pressures() {
  return rows.pressures_Pa();
}
EXPORT(rows_temperatures) float *rows_temperatures() {
  return rows.temperatures_degC();
}

// [16] hexadecimal digits, to be set before power-up.
EXPORT(serial_number) char *serial_number() {
  return serial;
}
// What it keeps without power: to be filled in before power-up where keeps is 1, read at any time.
EXPORT(flash_to_start_with) std::uint8_t *flash_to_start_with() {
  return kept;
}
EXPORT(flash_now) std::uint8_t *flash_now() {
  return native_flash.bytes;
}
EXPORT(flash_bytes) unsigned flash_bytes() {
  return NATIVE_FLASH_BYTES;
}

// Power-up at time 0. of_rows: the scenario acts, else the pad. A module powers up once.
EXPORT(power_up)
void power_up(double seed, double noise, double prom_spread, int parallel_bus, int of_rows,
              int keeps) {
  native_set_serial_number(serial);
  native_fingertip_settings settings{};
  settings.seed = static_cast<std::uint64_t>(seed);
  settings.noise = noise;
  settings.prom_spread = prom_spread;
  settings.parallel_bus = parallel_bus != 0;
  settings.flash = keeps ? kept : nullptr;
  settings.world = of_rows ? sim_world{nullptr, pressure_of_rows_Pa, temperature_of_rows_degC}
                           : sim_world{nullptr, pressure_of_pad_Pa, nullptr};
  (void)native_fingertip_start(&settings); // refuses pads only, and there is none
}
// Imports fingertip.leave where the firmware ends itself.
EXPORT(run_until) void run_until(double t_us) {
  (void)native_fingertip_run_until(static_cast<std::uint64_t>(t_us));
}

EXPORT(line_open) void line_open() {
  native_cdc_open();
}
EXPORT(line_close) void line_close() {
  native_cdc_close();
}
// Where bytes for the next two are: as many as they may be.
EXPORT(line_bytes) std::uint8_t *line_bytes() {
  return line;
}
EXPORT(line_capacity) unsigned line_capacity() {
  return sizeof line;
}
EXPORT(line_takes) unsigned line_takes() {
  return NATIVE_CDC_RECEIVE_BYTES;
}
// 1: the firmware holds the host off, none was taken.
EXPORT(line_send) int line_send(unsigned length) {
  return native_cdc_send(line, length) != FT_OK;
}
EXPORT(line_receive) unsigned line_receive() {
  return static_cast<unsigned>(native_cdc_receive(line, sizeof line));
}
