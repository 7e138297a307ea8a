// fingertip_cell_emulated: the world of one grasp, closed loop, whose fingertips are emulated boards with their release image. It speaks
// the protocol of host_tools/simulation/emulator/lockstep.mjs on its standard input and output: the cell, the gripper and the controller go
// on by slices of emulated time, after each of which the boards' bytes are handed over. The controller takes what came in a slice at its
// end, so up to a slice late; all else is at its own time.
#include "grasp/gripper/gripper.hpp"
#include "libfingertip/clock_fit.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/names.hpp"
#include "library/pad/profile.hpp"
#include "simulation/cell/fingertip_cell_world.hpp"
#include "simulation/cell/gripper_motion.hpp"
#include "simulation/cell/kind_trial.hpp"
#include "tool/plain_help.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace fingertip::cell {
namespace {

using nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

enum Stream : std::uint64_t { LINE = 841, PAD = 842 };

constexpr const char *FACE = "sphere15";
constexpr double FRICTION = 0.65;  // static, before it falls
constexpr double SLICE_s = 500e-6; // of lockstep.mjs
constexpr std::uint64_t SEED = 1;  // of pads and of the gripper's line
constexpr int CLOCK_EXCHANGES = 8;
constexpr std::uint64_t CHUNK_LIMIT = 1 << 20;
constexpr double NEVER_s = std::numeric_limits<double>::infinity();
constexpr double MOVES_s = 2.5e-4; // between two samples of the gripper
constexpr double PAD_SD = 0.08;    // of cast pads: the report's part truth

// A fingertip that is an emulated board, from the host's end of its USB line: it gets its pad's profile and its calibration first, then it
// streams its readings. Its clock is fitted from commands and their acknowledgements, as the tool does it, on the emulated time.
class EmulatedFingertip {
public:
  // random: of its sensors' gains and its calibration.
  EmulatedFingertip(const pad_profile &profile, Random random) {
    for (std::size_t k = 0; k < SENSORS; k++) {
      gain_[k] = 1.0 + PAD_SD * std::clamp(random.normal(), -3.0, 3.0);
    }
    const calibration stored = calibrated(gain_, GAIN_SD, 1.0, profile, random);
    commands_ = {command_pad(profile), command_calibrate(stored, geometry.sensor_count)};
    commands_.insert(commands_.end(), CLOCK_EXCHANGES, command_stream(0));
    commands_.push_back(command_stream(WIRE_STREAM_CONTACT));
  }

  // It has obeyed and has a zero.
  bool is_ready() const { return commands_.empty() && tared_; }

  // A command whose time has come; often nothing.
  Bytes to_send(std::int64_t now_us) {
    if (commands_.empty() || awaits_ || now_us <= 0) {
      return {};
    }
    awaits_ = true;
    wire_packet command = commands_.front();
    command.sequence = ++sequence_;
    command.t_us = static_cast<std::uint64_t>(now_us);
    return frame_bytes(command);
  }

  // Decodes what has come by now; calls the handler for each frame. Throws std::runtime_error where a command is refused.
  template <typename Handler> void take(const Bytes &bytes, std::int64_t now_us, const Handler &handler) {
    decoder_.feed(bytes.data(), bytes.size(), [&](const wire_packet &packet) {
      if (packet.type == WIRE_ACK) {
        obeyed(packet, now_us);
      } else if (const auto now = clock_.estimate(); packet.type == WIRE_CONTACT && now) {
        tared_ = (packet.body.contact.flags & CONTACT_FLAG_TARED) != 0;
        const double measured_us = std::clamp(now->host_at(packet.t_us), 0.0, static_cast<double>(now_us));
        handler(touch_from_packet(packet, measured_us), 1e-6 * measured_us);
      }
    });
  }

  Pressures sensed_Pa(Pressures base_Pa) const {
    for (std::size_t k = 0; k < SENSORS; k++) {
      base_Pa[k] *= gain_[k];
    }
    return base_Pa;
  }
  ordered_json line_summary() const {
    const LineStatistics &line = decoder_.statistics();
    return {{"lost_packets", line.dropped_packets},
            {"damaged_packets", line.crc_errors + line.format_errors},
            {"clock_uncertainty_us", clock_.estimate() ? clock_.estimate()->uncertainty_us : 0.0}};
  }

private:
  void obeyed(const wire_packet &packet, std::int64_t now_us) {
    const wire_ack &ack = packet.body.ack;
    if (!awaits_ || ack.sequence != sequence_) {
      return;
    }
    if (ack.result != WIRE_RESULT_DONE) {
      throw std::runtime_error("a fingertip refuses the command " + command_name(ack.command) + " with result " +
                               std::to_string(ack.result));
    }
    clock_.add({static_cast<std::int64_t>(ack.host_time_us), now_us, packet.t_us});
    awaits_ = false;
    commands_.pop_front();
  }

  Pressures gain_ = Pressures(SENSORS);
  std::deque<wire_packet> commands_; // the first may be under way
  bool awaits_ = false, tared_ = false;
  std::uint16_t sequence_ = 0;
  Decoder decoder_;
  ClockFit clock_;
};

// Lifted, and then friction falls so far, within 30 ms, that the grip does not hold it.
GraspScenario grasp_of(double friction_falls) {
  GraspScenario grasp;
  grasp.pads[0].friction = 1.03 * FRICTION;
  grasp.pads[1].friction = 0.97 * FRICTION;
  grasp.com_mm = {3.0, 1.0};
  grasp.place_mm = {0.8, -1.5};
  grasp.down_rad = 0.4;
  grasp.opens_mm = 1.0;
  grasp.waits_s = 0.05;
  grasp.lift_mm = 4.0;
  grasp.lift_s = 0.5;
  grasp.events = {{Event::Kind::slick, grasp.lift_s + 0.1, 0.03, friction_falls}};
  grasp.ends_s = grasp.lift_s + 0.4;
  return grasp;
}

ordered_json to_us(double s, double per_unit = 1e6) {
  return std::isfinite(s) ? ordered_json(std::round(1e6 * s) / per_unit) : ordered_json(nullptr);
}

class EmulatedGrasp {
public:
  // All must outlive it.
  EmulatedGrasp(const GraspScenario &grasp, const GripperMechanics &gripper, const Face &face, const pad_profile &profile)
      : grasp_(grasp), gripper_(gripper, grasp.width_mm + grasp.opens_mm, Random(SEED, LINE, 0)),
        world_({grasp, false, {}}, face, gripper_.motion()), fingers_{EmulatedFingertip(profile, Random(SEED, PAD, 0)),
                                                                      EmulatedFingertip(profile, Random(SEED, PAD, 1))} {}

  // What a board sent at this time, since the last run().
  void take(std::size_t finger, const Bytes &bytes, double arrived_s) {
    fingers_.at(finger).take(bytes, std::llround(1e6 * t_s_), [&](const GripTouch &touch, double measured_s) {
      if (!controller_) {
        return;
      }
      controller_->take_touch(finger, touch);
      reports_.push_back({arrived_s, measured_s, (touch.flags & CONTACT_FLAG_SLIDING) != 0});
      frames_[finger]++;
      loads_[finger] += (touch.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
      step_controller();
    });
  }

  // To the end of the next slice.
  void run(double until_s) {
    if (!controller_ && fingers_[0].is_ready() && fingers_[1].is_ready()) {
      const GripperTraits &traits = gripper_.motion().mechanics().traits;
      controller_ = std::make_unique<CoreController>(default_settings(traits), traits);
      asked_s_ = t_s_;
    }
    while (t_s_ < until_s && !over_) {
      const double known_s = line_.empty() ? NEVER_s : line_.front().known_s;
      advance(std::min({until_s, gripper_.next_s(), t_s_ + MOVES_s, known_s}));
      if (known_s <= t_s_) {
        if (controller_) {
          controller_->take_status(line_.front().status);
          step_controller();
        }
        line_.pop_front();
      }
      if (gripper_.next_s() <= t_s_) {
        line_.push_back(gripper_.exchange(command_));
      }
    }
  }

  Bytes to_send(std::size_t finger) { return fingers_[finger].to_send(std::llround(1e6 * t_s_)); }
  // The present pressures of the sensors.
  Pressures sensed_Pa(std::size_t finger) const { return fingers_[finger].sensed_Pa(world_.pressures_Pa(finger)); }
  bool over() const { return over_; }

  // What happened, and when, of the first slip after the lift, as report/grasp/emulated_grasp.py names it; null: never.
  ordered_json summary() const {
    ordered_json out = {
        {"dropped", world_.is_dropped()}, {"slid_mm", world_.slid_mm()}, {"asked_s", to_us(asked_s_)}, {"holding_s", to_us(holds_s_)},
        {"lift_s", to_us(lift_s_)},       {"end_s", to_us(t_s_)},        {"trouble", trouble_},        {"slips", world_.slips().size()}};
    out["slip"] = world_.slips().empty() ? ordered_json(nullptr) : answer_to(world_.slips().front());
    for (std::size_t f = 0; f < fingers_.size(); f++) {
      out["fingers"].push_back({{"frames", frames_[f]}, {"loads", loads_[f]}}); // loads: frames that report one
      out["fingers"].back().update(fingers_[f].line_summary());
    }
    return out;
  }

private:
  struct Report {
    double arrived_s, measured_s;
    bool slides;
  };

  void step_controller() {
    const GripReport report = controller_->step(t_s_, command_);
    if (report.state == GRIP_HOLDING || report.state == GRIP_SLIPPING) {
      trouble_ |= report.trouble;
      holds_s_ = std::min(holds_s_, t_s_);
    }
  }

  void advance(double to_s) {
    if (to_s <= t_s_) {
      return;
    }
    if (t_s_ >= holds_s_ + grasp_.waits_s && world_.lift()) {
      lift_s_ = t_s_;
    }
    world_.advance(to_s - t_s_);
    t_s_ = to_s;
    over_ = world_.is_dropped() || t_s_ - lift_s_ >= grasp_.ends_s;
  }

  ordered_json answer_to(const Slip &slip) const {
    const auto first = std::find_if(reports_.begin(), reports_.end(),
                                    [&](const Report &report) { return report.slides && report.arrived_s >= slip.begin_s; });
    const bool is_reported = first != reports_.end();
    const auto in_ms = [](double s) { return to_us(s, 1e3); };
    return {{"begin_s", to_us(slip.begin_s)},
            {"way_mm", slip.way_mm},
            {"measured_ms", in_ms(is_reported ? first->measured_s - slip.begin_s : NEVER_s)},
            {"sent_ms", in_ms(is_reported ? first->arrived_s - slip.begin_s : NEVER_s)},
            {"reaction_ms", in_ms(slip.reaction_s.value_or(NEVER_s))}};
  }

  const GraspScenario &grasp_;
  GripperLine gripper_;
  World world_;
  std::array<EmulatedFingertip, 2> fingers_;
  std::unique_ptr<CoreController> controller_; // none before both are ready
  std::deque<GripperLine::Answer> line_;
  GripCommand command_{};
  double t_s_ = 0.0, holds_s_ = NEVER_s, lift_s_ = NEVER_s, asked_s_ = 0.0;
  std::uint32_t trouble_ = 0;
  bool over_ = false;
  std::array<std::size_t, 2> frames_{}, loads_{}; // since both are ready
  std::vector<Report> reports_;
};

void read_whole(void *to, std::size_t length) {
  if (std::fread(to, 1, length, stdin) != length) {
    throw std::runtime_error("the boards have ended");
  }
}

template <typename Value> Value next() {
  Value value;
  read_whole(&value, sizeof value);
  return value;
}

// Whether all of it came through is known at the end.
void put(const void *bytes, std::size_t length) { std::fwrite(bytes, 1, length, stdout); }
void put_u32(std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  put(&word, sizeof word);
}

int serve(const std::string &cache, double friction_falls) {
  const Face face(FACE, cache);
  const pad_profile profile = pad::profile_over_own_sensors({LAYER_mm, 0.0, false});
  const GraspScenario held = grasp_of(friction_falls);
  const GripperMechanics gripper = gripper_mechanics(gripper_models().front().model);
  EmulatedGrasp grasp(held, gripper, face, profile);
  Bytes bytes;
  while (!grasp.over()) {
    const double t_s = 1e-9 * static_cast<double>(next<std::uint64_t>());
    for (std::uint32_t chunks = next<std::uint32_t>(); chunks > 0; chunks--) {
      const auto board = next<std::uint32_t>();
      const double at_s = 1e-9 * static_cast<double>(next<std::uint64_t>());
      const auto length = next<std::uint32_t>();
      if (board > 1 || length > CHUNK_LIMIT) {
        throw std::runtime_error("two boards are needed");
      }
      bytes.resize(length);
      read_whole(bytes.data(), length);
      grasp.take(board, bytes, at_s);
    }
    const std::array<Bytes, 2> sent{grasp.to_send(0), grasp.to_send(1)};
    grasp.run(t_s + SLICE_s);
    put_u32(grasp.over());
    for (std::size_t f = 0; !grasp.over() && f < sent.size(); f++) {
      const Pressures sensed_Pa = grasp.sensed_Pa(f);
      put(sensed_Pa.data(), SENSORS * sizeof sensed_Pa[0]);
      put_u32(sent[f].size());
      put(sent[f].data(), sent[f].size());
    }
    std::fflush(stdout);
  }
  ordered_json out = {{"gripper", gripper.traits.model},
                      {"face", FACE},
                      {"mass_kg", held.mass_kg},
                      {"friction", FRICTION},
                      {"friction_falls", friction_falls}};
  out.update(grasp.summary());
  const std::string text = out.dump();
  put(text.data(), text.size());
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0 ? 0 : 1;
}

} // namespace
} // namespace fingertip::cell

int main(int argc, char **argv) {
  CLI::App app("The world of a grasp for simulation/emulator/lockstep.mjs: an object, two fingertips' rubber, "
               "a gripper and the controller. It is lifted, and its friction falls.",
               "fingertip_cell_emulated");
  std::string cache;
  double friction_falls = 0.5;
  app.add_option("--friction-falls", friction_falls, "By this share")->check(fingertip::within(0.0, 0.9))->capture_default_str();
  app.add_option("--cache", cache, "Folder of the contact tables")->required();
  return fingertip::run_program(app, argc, argv, [&] { return fingertip::cell::serve(cache, friction_falls); });
}
