// The simulated fingertip's firmware for the page: simulation/player/native_fingertip.h, one a module. Times
// are in microseconds since power-up; the pressures are those of the scenario or of the page's pad.
#include "simulation/player/native_fingertip.h"
#include "simulation/player/samples.hpp"
#include "web/wasm/world.hpp"

extern "C" {
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "native/native_flash.h"
#include "native/native_port.h"
#include "wire/packet.h"
}

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

double pressure_of_rows_Pa(void *, unsigned sensor, std::uint64_t t_us) { return rows.pressure_Pa(sensor, t_us); }
double temperature_of_rows_degC(void *, unsigned, std::uint64_t t_us) { return rows.temperature_degC(t_us); }

std::vector<std::uint8_t> file;
std::string errors;
std::unique_ptr<World> world;
std::vector<std::uint8_t> pad_command;
// The fields of World's Truth; contact and slips are 0 or 1.
double truth[8];

double pressure_of_world_Pa(void *, unsigned sensor, std::uint64_t t_us) { return world->pressure_Pa(sensor, t_us); }

std::uint8_t line[NATIVE_CDC_TRANSMIT_BYTES];
std::uint8_t kept[NATIVE_FLASH_BYTES];
std::optional<pad_profile> profile;
char serial[17] = "0000000000000001";

} // namespace
} // namespace fingertip::web

using namespace fingertip;
using namespace fingertip::web;

EXPORT(sensor_count) unsigned sensor_count() { return geometry.sensor_count; }
EXPORT(sensor_x_mm) float sensor_x_mm(unsigned sensor) { return geometry.x_mm[sensor]; }
EXPORT(sensor_y_mm) float sensor_y_mm(unsigned sensor) { return geometry.y_mm[sensor]; }

// Makes room for a scenario of count rows; fill them in by the next three.
EXPORT(rows_begin) void rows_begin(unsigned count, double ambient_Pa) { rows.resize(count, ambient_Pa); }
EXPORT(rows_times) double *rows_times() { return rows.times_s(); }
EXPORT(rows_pressures) float *rows_pressures() { return rows.pressures_Pa(); }
EXPORT(rows_temperatures) float *rows_temperatures() { return rows.temperatures_degC(); }

// [16] hexadecimal digits, to be set before power-up.
EXPORT(serial_number) char *serial_number() { return serial; }
// Room for the file of objects and for the errors of the pad as text (twin::parse_effects), to be
// filled in; then the world is made of both.
EXPORT(objects_begin) std::uint8_t *objects_begin(unsigned bytes) {
  file.assign(bytes, 0);
  return file.data();
}
EXPORT(errors_begin) char *errors_begin(unsigned bytes) {
  errors.assign(bytes, ' ');
  return errors.data();
}
EXPORT(world_begin) void world_begin(double seed) {
  ObjectsFile read = read_objects(file.data(), file.size());
  pad_command = std::move(read.pad_command);
  world =
      std::make_unique<World>(std::move(read.objects), twin::parse_effects(errors), static_cast<std::uint64_t>(seed));
  file = {};
}
// The command that sets the firmware's pad profile.
EXPORT(pad_command_at) const std::uint8_t *pad_command_at() { return pad_command.data(); }
EXPORT(pad_command_bytes) unsigned pad_command_bytes() { return static_cast<unsigned>(pad_command.size()); }
EXPORT(world_choose) void world_choose(unsigned object) { world->choose(object); }
EXPORT(world_press) void world_press(double x_mm, double y_mm, double force_N) { world->press(x_mm, y_mm, force_N); }
EXPORT(world_hold)
void world_hold(double x_mm, double y_mm, double force_N, double load_N, double angle_rad) {
  world->hold(x_mm, y_mm, force_N, load_N, angle_rad);
}
EXPORT(world_drop) void world_drop(double x_mm, double y_mm, double mass_kg) { world->drop(x_mm, y_mm, mass_kg); }
EXPORT(world_lift) void world_lift() { world->lift(); }
EXPORT(world_friction) void world_friction(double friction) { world->set_friction(friction); }
EXPORT(world_truth) const double *world_truth() {
  const Truth &now = world->truth();
  const double values[] = {now.t_s,  now.contact ? 1.0 : 0.0, now.x_mm, now.y_mm, now.force_N, now.qx_N,
                           now.qy_N, now.slips ? 1.0 : 0.0};
  std::copy(std::begin(values), std::end(values), truth);
  return truth;
}

// What it keeps without power: to be filled in before power-up where keeps is 1, read at any time.
EXPORT(flash_to_start_with) std::uint8_t *flash_to_start_with() { return kept; }
EXPORT(flash_now) std::uint8_t *flash_now() { return native_flash.bytes; }
EXPORT(flash_bytes) unsigned flash_bytes() { return NATIVE_FLASH_BYTES; }

// Sets the pad profile from the start on, without storing it, from the command of length bytes in
// line_bytes. 1: it is no such command.
EXPORT(pad_of_command) int pad_of_command(unsigned length) {
  wire_packet packet;
  if (length < 1 || wire_decode(wire_commands, line, length - 1, &packet) != FT_OK || packet.type != WIRE_CMD_PAD) {
    return 1;
  }
  profile = packet.body.cmd_pad.profile;
  return 0;
}

// Power-up at time 0. of_rows: by the scenario, else by the pad. A module powers up once.
EXPORT(power_up)
void power_up(double seed, double noise, double prom_spread, int parallel_bus, int of_rows, int keeps) {
  native_set_serial_number(serial);
  native_fingertip_settings settings{};
  settings.seed = static_cast<std::uint64_t>(seed);
  settings.noise = noise;
  settings.prom_spread = prom_spread;
  settings.parallel_bus = parallel_bus != 0;
  settings.flash = keeps ? kept : nullptr;
  settings.pad = profile ? &*profile : nullptr;
  settings.world = of_rows ? sim_world{nullptr, pressure_of_rows_Pa, temperature_of_rows_degC}
                           : sim_world{nullptr, pressure_of_world_Pa, nullptr};
  (void)native_fingertip_start(&settings); // this scene refuses nothing
}
// Imports fingertip.leave where the firmware ends itself.
EXPORT(run_until) void run_until(double t_us) { (void)native_fingertip_run_until(static_cast<std::uint64_t>(t_us)); }

EXPORT(line_open) void line_open() { native_cdc_open(); }
EXPORT(line_close) void line_close() { native_cdc_close(); }
// Where bytes for the next two are: as many as they may be.
EXPORT(line_bytes) std::uint8_t *line_bytes() { return line; }
EXPORT(line_capacity) unsigned line_capacity() { return sizeof line; }
EXPORT(line_takes) unsigned line_takes() { return NATIVE_CDC_RECEIVE_BYTES; }
// 1: the firmware holds the host off, none was taken.
EXPORT(line_take) int line_take(unsigned length) { return native_cdc_send(line, length) != FT_OK; }
EXPORT(line_receive) unsigned line_receive() { return static_cast<unsigned>(native_cdc_receive(line, sizeof line)); }
