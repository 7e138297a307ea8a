#include "grasp/gripper/feetech.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/text.hpp"

#include <numeric>

namespace fingertip {

namespace feetech {

constexpr std::ptrdiff_t HEAD = 4; // FF FF id length
constexpr std::uint8_t LEAST_LENGTH = 2;

static std::uint8_t checksum(Bytes::const_iterator from, Bytes::const_iterator to) {
  return static_cast<std::uint8_t>(~std::accumulate(from, to, 0u));
}

Bytes encoded(const Packet &packet) {
  const auto length = static_cast<std::uint8_t>(packet.parameters.size() + LEAST_LENGTH);
  Bytes bytes = {0xFF, 0xFF, packet.id, length, packet.code};
  bytes.insert(bytes.end(), packet.parameters.begin(), packet.parameters.end());
  bytes.push_back(checksum(bytes.begin() + 2, bytes.end()));
  return bytes;
}

std::optional<Packet> take_packet(Bytes *bytes, std::size_t *skipped) {
  std::optional<Packet> packet;
  Bytes::const_iterator begin = bytes->begin(), end = begin; // of the packet
  for (; begin != bytes->end(); end = ++begin) {
    const std::ptrdiff_t left = bytes->end() - begin;
    // A third FF: the head begins a byte later.
    if (begin[0] != 0xFF || (left > 1 && begin[1] != 0xFF) || (left > 2 && begin[2] == 0xFF) || (left > 3 && begin[3] < LEAST_LENGTH)) {
      continue;
    }
    if (left < HEAD || left < HEAD + begin[3]) {
      break;
    }
    end = begin + HEAD + begin[3];
    if (checksum(begin + 2, end - 1) == end[-1]) {
      packet = Packet{begin[2], begin[4], Bytes(begin + 5, end - 1)};
      break;
    }
  }
  *skipped += static_cast<std::size_t>(begin - bytes->begin());
  bytes->erase(bytes->begin(), end);
  return packet;
}

} // namespace feetech

using namespace feetech;

constexpr double STALL_Nm = 1.9, FULL_SPEED_rad_s = 4.7; // 45 revolutions a minute, at 7.4 V
constexpr double LEAST_TORQUE = 0.05;                    // of the stall's, below it does not turn
constexpr double USUAL_OPEN = 652;                       // counts: a radian

// So far from its goal it stopped for something in its way; half of that is its play.
constexpr double OFF_GOAL = 22;
// Until a command shows in its flag.
constexpr std::int64_t STARTING_us = 50'000;

constexpr GripperUsual USUAL = {
    .slave = SLAVE, .most_slave = MOST_SLAVE, .closed_count = 2048, .open_count = 2048 + static_cast<int>(USUAL_OPEN), .most_count = 4095};

constexpr std::uint8_t STATUS_FROM = TORQUE_ENABLE;

static int word(const Bytes &bytes, std::size_t at) { return bytes[at] | bytes[at + 1] << 8; }

static void put_word(Bytes *bytes, int value) {
  bytes->push_back(static_cast<std::uint8_t>(value & 0xFF));
  bytes->push_back(static_cast<std::uint8_t>(value >> 8));
}

GripperTraits feetech_traits(const std::string &model, const GripperWay &complete) {
  const Jaw jaw(complete);
  constexpr double LEAST_mm_s = 1.0, LATENCY_s = 0.008, POLL_s = 0.001;
  const double most_N = STALL_Nm * 1000 / complete.jaw_mm;
  return {{jaw.stroke_mm(), jaw.step_mm(), 0.0, LEAST_mm_s, FULL_SPEED_rad_s * complete.jaw_mm,
           LEAST_TORQUE * STALL_Nm * 1000 / complete.jaw_mm, most_N, LATENCY_s, POLL_s},
          model,
          GripperDriver::feetech};
}

GripperWay feetech_way(const GripperWay &way) {
  GripperWay all = complete(way, USUAL);
  if (std::abs(*all.open_count - *all.closed_count) > COUNTS_PER_TURN / 2) {
    throw Error(ErrorCode::bad_value, "a jaw opens by half a turn at the most, 2048 counts");
  }
  return all;
}

FeetechGripper::FeetechGripper(const GripperWay &given)
    : RequestLine(feetech_way(given), BAUD, feetech_traits(given.model, feetech_way(given))), jaw_(way_) {
  const Bytes table = read(MODEL, OPERATING_MODE + 1 - MODEL);
  servo_model_ = word(table, 0);
  const int mode = table[OPERATING_MODE - MODEL];
  if (mode != 0) {
    throw Error(ErrorCode::gripper_refused,
                way_.port + ": the servo is in mode " + std::to_string(mode) + ", a gripper needs 0 (position)");
  }
  poll();
}

RequestLine::Reply FeetechGripper::take(const Bytes &, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) {
  const std::optional<Packet> answer = take_packet(came, noise);
  if (!answer) {
    return Reply::none;
  }
  *payload = answer->parameters;
  return answer->id != way_.slave ? Reply::other_slave : payload->size() != length ? Reply::other_answer : Reply::matches;
}

// Two or three bytes: no other answer has so few.
std::pair<RequestLine::Bytes, std::size_t> FeetechGripper::probe(int number) const {
  return {question_of(READ, {MODEL, static_cast<std::uint8_t>(number + 1)}), static_cast<std::size_t>(number + 1)};
}

void FeetechGripper::write(std::uint8_t address, const Bytes &values) {
  Bytes parameters = {address};
  parameters.insert(parameters.end(), values.begin(), values.end());
  exchange(question_of(WRITE, parameters), 0);
}

GripperStatus FeetechGripper::poll() {
  const std::int64_t began_us = steady_now_us();
  const Bytes table = read(STATUS_FROM, TABLE_END - STATUS_FROM);
  const auto at = [&](Address address) { return std::size_t{address} - STATUS_FROM; };
  const auto magnitude = [&](Address address) { return word(table, at(address)) & (SIGN - 1); };
  const int position = word(table, at(PRESENT_POSITION));
  const double count = (position & SIGN) ? -magnitude(PRESENT_POSITION) : position;
  if (count < 0.0 || count >= COUNTS_PER_TURN) {
    throw Error(ErrorCode::gripper_refused, way_.port + ": position " + fixed(count, 0) + " is not one of 0 to " +
                                                fixed(COUNTS_PER_TURN - 1, 0) +
                                                ": the servo is a turn off, or in multi-turn mode; its width is unknown");
  }
  GripperStatus status;
  status.host_us = (began_us + steady_now_us()) / 2;
  active_ = table[at(TORQUE_ENABLE)] != 0;
  status.active = active_;
  const double off = std::abs(count - magnitude(GOAL_POSITION));
  status.moving = active_ && (table[at(MOVING)] != 0 || (off > OFF_GOAL && status.host_us - commanded_us_ < STARTING_us));
  if (active_ && !status.moving) {
    status.object = off > OFF_GOAL;
  }
  status.width_mm = std::clamp(jaw_.width_mm(count), 0.0, traits_.stroke_mm);
  status.current_A = magnitude(PRESENT_CURRENT) * AMPERE_PER_COUNT;
  status.fault = table[at(STATUS)];
  return status;
}

void FeetechGripper::command(double count, int speed, int torque) {
  Bytes values = {0}; // no limit of acceleration but its own
  put_word(&values, static_cast<int>(std::lround(count)));
  put_word(&values, 0);
  put_word(&values, speed);
  put_word(&values, torque);
  write(ACCELERATION, values);
  if (count != goal_count_) {
    goal_count_ = count;
    commanded_us_ = steady_now_us();
  }
}

void FeetechGripper::activate() {
  Bytes position;
  put_word(&position, static_cast<int>(std::lround(jaw_.count(poll().width_mm))));
  write(GOAL_POSITION, position);
  write(TORQUE_ENABLE, {1});
}

GripperStatus FeetechGripper::move(const GripCommand &move) {
  check_move(move);
  if (!active_ && !poll().active) {
    return poll();
  }
  const double width_mm = std::clamp(move.width_mm, 0.0, traits_.stroke_mm);
  const double speed_mm_s = std::clamp(move.speed_mm_s, traits_.speed_min_mm_s, traits_.speed_max_mm_s);
  const double force_N = std::clamp(move.force_N, traits_.force_min_N, traits_.force_max_N);
  command(jaw_.count(width_mm), std::max(1, static_cast<int>(std::lround(speed_mm_s / jaw_.slope_mm(width_mm)))),
          static_cast<int>(std::lround(force_N / traits_.force_max_N * 1000)));
  return poll();
}

std::string FeetechGripper::line() const {
  return "Feetech bus at " + std::to_string(BAUD) + " baud, slave " + std::to_string(way_.slave) + ", servo model " +
         std::to_string(servo_model_) + limited_by(2);
}

std::string FeetechGripper::fault_text(std::uint8_t fault) const {
  static const struct {
    Trouble bit;
    const char *text;
  } TEXTS[] = {{VOLTAGE, "voltage out of its range"}, {SENSOR, "position sensor fails"}, {TEMPERATURE, "too hot"},
               {CURRENT, "too much current"},         {ANGLE, "angle out of its range"}, {OVERLOAD, "overloaded"}};
  const std::string text = joined(TEXTS, ", ", [&](const auto &entry) { return fault & entry.bit ? entry.text : ""; });
  return text.empty() && fault != 0 ? "a fault that its memory table does not have" : text;
}

} // namespace fingertip
