#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/device.hpp"
#include "tool/cli/gains.hpp"
#include "tool/cli/names_of_values.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string_view>

namespace fingertip {

namespace {

void print_pairs(const Metadata &pairs) {
  for (const auto &[key, value] : pairs) {
    std::printf("%-24s%s\n", key.c_str(), value.c_str());
  }
}

/* What belongs to a capability that the firmware lacks. */
void leave_out_missing(Metadata &pairs, std::uint32_t capabilities) {
  auto is_missing = [&](const std::pair<std::string, std::string> &pair) {
    bool of_slip = pair.first.rfind("slip_", 0) == 0;
    bool of_fit =
        pair.first.rfind("fit_", 0) == 0 || pair.first.rfind("prior_", 0) == 0 || pair.first.rfind("location_", 0) == 0;
    return (of_slip && !(capabilities & WIRE_CAPABILITY_SLIP)) || (of_fit && !(capabilities & WIRE_CAPABILITY_FIT));
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_missing), pairs.end());
}

int info(const Choice &choice) {
  Device device(choice);
  wire_info info = device.session.info().body.info;
  wire_health health = device.session.health().body.health;
  Metadata pairs = info_metadata(info);
  /* print_gains has them. */
  auto is_of_sensors = [](const std::pair<std::string, std::string> &pair) {
    static constexpr std::string_view names[] = {"gains", "gain_sds", "off_x_um", "off_y_um", "wider_q15"};
    return std::find(std::begin(names), std::end(names), pair.first) != std::end(names);
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_of_sensors), pairs.end());
  pairs.insert(pairs.begin(), {"port", printable(device.transport->description())});
  for (auto &[key, value] : pairs) {
    if (key == "capabilities") {
      value = capabilities_text(info.capabilities);
    } else if (key == "streams") {
      value = streams_text(info.streams);
    } else if (key == "stored") {
      value = stored_text(info.stored);
    } else if (key == "calibration_date_s") {
      value += " (" + date_text(info.calibration.date_s) + ")";
    } else if (key == "rate_mHz" && info.rate_mHz == 0) {
      value = rate_text(info.rate_mHz);
    }
  }
  leave_out_missing(pairs, info.capabilities);
  print_pairs(pairs);
  std::printf("\n");
  Metadata counters;
  for (const auto &[key, value] : health_fields(health)) {
    if (key == "capabilities") {
      continue; // printed above
    }
    std::string bad = sensors_text(health.sensors_prom_bad);
    counters.emplace_back(key, key == "sensors_present"    ? present_text(value, info.sensor_count)
                               : key == "sensors_prom_bad" ? (bad.empty() ? "none" : bad)
                                                           : std::to_string(value));
  }
  leave_out_missing(counters, info.capabilities);
  print_pairs(counters);
  const auto [key, firmware] =
      *std::find_if(pairs.begin(), pairs.end(), [](const auto &pair) { return pair.first == "firmware"; });
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
