// The simulated fingertip's firmware for the page: simulation/player/native_fingertip.h, one a module. Times are in microseconds since
// power-up. The pressures are those of a scenario or of the page's pad. The page passes arrays by malloc and free.
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
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <vector>

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace fingertip::web {
namespace {

constexpr double NOISE = 1.0, PROM_SPREAD = 0.03; // of native_fingertip_settings

class Rows : public Samples {
public:
  Rows() = default;
  Rows(unsigned rows, double ambient_Pa, const double *times_s, const float *pressures_Pa, const float *temperatures_degC) {
    sensors_ = geometry.sensor_count;
    ambient_Pa_ = ambient_Pa;
    times_s_.assign(times_s, times_s + rows);
    pressures_Pa_.assign(pressures_Pa, pressures_Pa + std::size_t(rows) * sensors_);
    temperatures_degC_.assign(temperatures_degC, temperatures_degC + rows);
  }
};

std::optional<Rows> rows;
std::unique_ptr<World> world;
std::vector<std::uint8_t> pad_command;
std::optional<pad_profile> profile;
// The fields of World's Truth; contact and slips are 0 or 1.
double truth[8];
std::uint8_t line[NATIVE_CDC_TRANSMIT_BYTES];
std::uint8_t kept[NATIVE_FLASH_BYTES];

double pressure_of_rows_Pa(void *, unsigned sensor, std::uint64_t t_us) { return rows->pressure_Pa(sensor, t_us); }
double temperature_of_rows_degC(void *, unsigned, std::uint64_t t_us) { return rows->temperature_degC(t_us); }
double pressure_of_world_Pa(void *, unsigned sensor, std::uint64_t t_us) { return world->pressure_Pa(sensor, t_us); }

} // namespace
} // namespace fingertip::web

using namespace fingertip;
using namespace fingertip::web;

EXPORT(sensor_count) unsigned sensor_count() { return geometry.sensor_count; }

// A scenario: times [rows], pressures above ambient [rows][sensors], temperatures [rows].
EXPORT(rows_begin)
void rows_begin(unsigned count, double ambient_Pa, const double *times_s, const float *pressures_Pa, const float *temperatures_degC) {
  rows.emplace(count, ambient_Pa, times_s, pressures_Pa, temperatures_degC);
}

// The pad: the file of objects, and its errors as text (twin::parse_effects).
EXPORT(world_begin)
void world_begin(const std::uint8_t *file, unsigned bytes, const char *errors, double seed) {
  ObjectsFile read = read_objects(file, bytes);
  pad_command = std::move(read.pad_command);
  world = std::make_unique<World>(std::move(read.objects), twin::parse_effects(errors), static_cast<std::uint64_t>(seed));
}
// The command that sets the firmware's pad profile.
EXPORT(pad_command_at) const std::uint8_t *pad_command_at() { return pad_command.data(); }
EXPORT(pad_command_bytes) unsigned pad_command_bytes() { return static_cast<unsigned>(pad_command.size()); }
// Sets that profile from power-up on, without storing it.
EXPORT(pad_use) void pad_use() {
  std::vector<std::uint8_t> frame(pad_command.begin(), pad_command.end() - 1); // decoding overwrites it
  wire_packet packet;
  (void)wire_decode(wire_commands, frame.data(), frame.size(), &packet);
  profile = packet.body.cmd_pad.profile;
}
EXPORT(world_choose) void world_choose(unsigned object) { world->choose(object); }
EXPORT(world_press) void world_press(double x_mm, double y_mm, double force_N) { world->press(x_mm, y_mm, force_N); }
EXPORT(world_hold)
void world_hold(double x_mm, double y_mm, double force_N, double load_N, double angle_deg) {
  world->hold(x_mm, y_mm, force_N, load_N, angle_deg * std::acos(-1.0) / 180.0);
}
EXPORT(world_drop)
void world_drop(double x_mm, double y_mm, double mass_g) { world->drop(x_mm, y_mm, 1e-3 * mass_g); }
EXPORT(world_lift) void world_lift() { world->lift(); }
EXPORT(world_friction) void world_friction(double friction) { world->set_friction(friction); }
EXPORT(world_truth) const double *world_truth() {
  const Truth &now = world->truth();
  const double values[] = {now.t_s, now.contact ? 1.0 : 0.0, now.x_mm, now.y_mm, now.force_N, now.qx_N, now.qy_N, now.slips ? 1.0 : 0.0};
  std::copy(std::begin(values), std::end(values), truth);
  return truth;
}

// What it keeps without power.
EXPORT(flash_now) std::uint8_t *flash_now() { return native_flash.bytes; }
EXPORT(flash_bytes) unsigned flash_bytes() { return NATIVE_FLASH_BYTES; }

// Power-up at time 0, once a module: with a scenario by it, else by the pad. serial: 16 hexadecimal digits.
// flash: what it kept, of flash_now, or null.
EXPORT(power_up) void power_up(const char *serial, double seed, int parallel_bus, const std::uint8_t *flash) {
  native_set_serial_number(serial);
  native_fingertip_settings settings{};
  settings.seed = static_cast<std::uint64_t>(seed);
  settings.noise = NOISE;
  settings.prom_spread = PROM_SPREAD;
  settings.parallel_bus = parallel_bus != 0;
  if (flash) {
    std::copy_n(flash, sizeof kept, kept);
    settings.flash = kept;
  }
  settings.pad = profile ? &*profile : nullptr;
  settings.world =
      rows ? sim_world{nullptr, pressure_of_rows_Pa, temperature_of_rows_degC} : sim_world{nullptr, pressure_of_world_Pa, nullptr};
  (void)native_fingertip_start(&settings); // this scene refuses nothing
}
// Imports fingertip.leave where the firmware ends itself.
EXPORT(run_until) void run_until(double t_us) { (void)native_fingertip_run_until(static_cast<std::uint64_t>(t_us)); }

EXPORT(line_open) void line_open() { native_cdc_open(); }
EXPORT(line_close) void line_close() { native_cdc_close(); }
// Where bytes for the next two are; the firmware takes line_takes at once.
EXPORT(line_bytes) std::uint8_t *line_bytes() { return line; }
EXPORT(line_takes) unsigned line_takes() { return NATIVE_CDC_RECEIVE_BYTES; }
// 1: the firmware holds the host off, none was taken.
EXPORT(line_take) int line_take(unsigned length) { return native_cdc_send(line, length) != FT_OK; }
EXPORT(line_receive) unsigned line_receive() { return static_cast<unsigned>(native_cdc_receive(line, sizeof line)); }
