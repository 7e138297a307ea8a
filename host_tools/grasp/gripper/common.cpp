#include "grasp/gripper/common.hpp"

#include "grasp/gripper/serial_line.hpp"

#include <cmath>

namespace fingertip {

void check_move(const GripperMove &move) {
  if (!std::isfinite(move.width_mm) || !std::isfinite(move.speed_mm_s) || !std::isfinite(move.force_N) ||
      move.speed_mm_s < 0 || move.force_N < 0) {
    throw Error(ErrorCode::bad_value, "a move needs numbers, and speed and force are not negative");
  }
}

GripperWay complete(GripperWay way, const GripperUsual &usual) {
  way.slave = way.slave == 0 ? usual.slave : way.slave;
  if (way.slave < 1 || way.slave > usual.most_slave) {
    throw Error(ErrorCode::bad_value, "a slave is a number from 1 to " + std::to_string(usual.most_slave));
  }
  way.closed_count = way.closed_count.value_or(usual.closed_count);
  way.open_count = way.open_count.value_or(usual.open_count);
  for (int count : {*way.closed_count, *way.open_count}) {
    if (count < 0 || count > usual.most_count || way.closed_count == way.open_count) {
      throw Error(ErrorCode::bad_value,
                  "counts of the ends are two numbers from 0 to " + std::to_string(usual.most_count));
    }
  }
  if (!(way.jaw_mm >= 10 && way.jaw_mm <= 500)) {
    throw Error(ErrorCode::bad_value, "a jaw is 10 to 500 mm long");
  }
  if (!(way.timeout_s >= 0.005 && way.timeout_s <= 10)) {
    throw Error(ErrorCode::bad_value, "an exchange's timeout is 0.005 to 10 s");
  }
  return way;
}

Error silent(const GripperWay &way) {
  return Error(ErrorCode::gripper_silent, way.port + ": no answer from slave " + std::to_string(way.slave) +
                                              " within " + std::to_string(std::lround(way.timeout_s * 1000)) + " ms");
}

std::string limited_by(const std::string &port, int exchanges) {
  const std::optional<int> timer_ms = latency_timer_ms(port);
  if (!timer_ms || *timer_ms <= 1) {
    return "";
  }
  return "; the USB adapter's latency timer of " + std::to_string(*timer_ms) + " ms allows " +
         std::to_string(1000 / (*timer_ms * exchanges)) + " commands a second";
}

} // namespace fingertip
