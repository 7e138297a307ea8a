#include "grasp/check.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

// At this frame rate an object at 0.1 m/s slides by a millimetre between two frames.
constexpr std::uint32_t RATE_mHz = 100000;

} // namespace

void check_for_grasp(const std::string &name, const wire_info &info, const wire_health &health) {
  if ((info.capabilities & WIRE_CAPABILITY_FIT) == 0) {
    throw Error(name + ": firmware of scene " + text_field(info.scene) + " reports no force; flash scene grasp");
  }
  const std::uint32_t all = info.sensor_count < 32 ? (1u << info.sensor_count) - 1 : ~0u;
  if ((health.sensors_present & all) == 0) {
    throw Error(name + ": none of its sensors answers; see their wiring and supply (fingertip info)");
  }
}

std::vector<std::string> lacks_for_grasp(const wire_info &info, bool needs_load) {
  std::vector<std::string> lacks;
  if (needs_load && (info.capabilities & WIRE_CAPABILITY_TANGENTIAL) == 0) {
    lacks.push_back("reports no load, --blind holds: flash scene grasp");
  } else if (needs_load && (info.stored & WIRE_STORED_PAD) == 0) {
    lacks.push_back("reports no load, --blind holds: fingertip pad");
  }
  if ((info.stored & WIRE_STORED_CALIBRATION) == 0) {
    lacks.push_back("forces may be off by some 10 %: fingertip calibrate");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < RATE_mHz) {
    lacks.push_back("sees slides late at " + fixed(info.rate_mHz / 1e3, 1) +
                    " frames a second: fingertip set rate=max");
  }
  return lacks;
}

} // namespace fingertip
