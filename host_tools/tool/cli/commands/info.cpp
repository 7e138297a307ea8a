#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/device.hpp"
#include "tool/cli/names_of_values.hpp"

#include <cstdio>
#include <memory>
#include <set>

namespace fingertip {

namespace {

/* Whether the firmware has what it belongs to, and no other table shows it. */
bool is_shown(const std::string &key, std::uint32_t capabilities) {
  static const std::set<std::string> of_sensors = {"gains", "gain_sds", "off_x_um", "off_y_um", "wider_q15"};
  auto begins = [&](const char *with) { return key.rfind(with, 0) == 0; };
  const bool of_fit = begins("fit_") || begins("prior_") || begins("location_");
  return !of_sensors.count(key) && (!begins("slip_") || (capabilities & WIRE_CAPABILITY_SLIP)) &&
         (!of_fit || (capabilities & WIRE_CAPABILITY_FIT));
}

void print(const std::string &key, const std::string &value) { std::printf("%-24s%s\n", key.c_str(), value.c_str()); }

int info(const Choice &choice) {
  Device device(choice);
  wire_info info = device.session.info().body.info;
  wire_health health = device.session.health().body.health;
  const Metadata pairs = info_metadata(info);
  print("port", printable(device.transport->description()));
  for (const auto &[key, value] : pairs) {
    if (is_shown(key, info.capabilities)) {
      print(key, key == "capabilities"                     ? capabilities_text(info.capabilities)
                 : key == "streams"                        ? streams_text(info.streams)
                 : key == "stored"                         ? stored_text(info.stored)
                 : key == "calibration_date_s"             ? value + " (" + date_text(info.calibration.date_s) + ")"
                 : key == "rate_mHz" && info.rate_mHz == 0 ? rate_text(info.rate_mHz)
                                                           : value);
    }
  }
  std::printf("\n");
  for (const auto &[key, value] : health_fields(health)) {
    const std::string bad = sensors_text(health.sensors_prom_bad);
    if (key != "capabilities" && is_shown(key, info.capabilities)) { /* the former is above */
      print(key, key == "sensors_present"    ? present_text(value, info.sensor_count)
                 : key == "sensors_prom_bad" ? (bad.empty() ? "none" : bad)
                                             : std::to_string(value));
    }
  }
  const std::string firmware = value_of(pairs, "firmware");
  if (firmware != FINGERTIP_VERSION) {
    std::printf("\nits firmware is of version %s, this tool of version " FINGERTIP_VERSION
                "; install this tool's with `fingertip flash`, or use the other's tool\n",
                printable(firmware).c_str());
  }
  if (info.stored & WIRE_STORED_CALIBRATION) {
    print_gains(info.calibration, info.sensor_count);
  }
  if (info.stored & WIRE_STORED_DAMAGED) {
    std::printf("\nwhat it had stored cannot be read and is not used; calibrate again, or set --keep\n");
  }
  return 0;
}

} // namespace

void add_info(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_port(line.add("info", "Show identity, settings and health", [choice] { return info(*choice); }), *choice);
}

} // namespace fingertip
