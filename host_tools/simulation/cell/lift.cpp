#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "simulation/cell/gripper_server.hpp"
#include "simulation/cell/hand_server.hpp"
#include "simulation/cell/simulations.hpp"
#include "tool/advice.hpp"

#include <cstdio>
#include <poll.h>
#include <sstream>
#include <unistd.h>
#include <utility>

namespace fingertip::cell {
namespace {

constexpr std::chrono::microseconds ROUND{1000};
constexpr std::int64_t LONGEST_ROUND_us = 10'000; // of the world's time
constexpr std::int64_t LATE_us = 30'000;          // the world waits for what is later than that
constexpr std::size_t FINGERS = 2;
constexpr double GAIN_ERROR = 0.01; // that calibration left of the gains

// Lines of standard input, as long as it may be read.
class Lines {
public:
  std::vector<std::string> take() {
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    const bool is_ours = !isatty(STDIN_FILENO) || tcgetpgrp(STDIN_FILENO) == getpgrp();
    if (!is_ours || wait_for(&input, 1, HostTime()) <= 0) {
      return {};
    }
    char bytes[1024];
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
    came_.append(bytes, static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    std::vector<std::string> lines;
    for (std::size_t end; (end = came_.find('\n')) != std::string::npos;) {
      lines.push_back(came_.substr(0, end));
      came_.erase(0, end + 1);
    }
    return lines;
  }

private:
  std::string came_;
};

class Lift {
public:
  Lift(const SimulationOptions &options, const PortFolder &place)
      : options_(options), place_(place), face_(LIFT_FACE, options.cache),
        fingers_(place, place.fingers(FINGERS, options.seed, options.gain_spread.value_or(0.05), false, GAIN_ERROR)),
        motion_(GripperServer::mechanics(options.model), options.world.grasp.width_mm + options.world.grasp.opens_mm),
        server_(motion_, {.model = options.model, .link = place.port("gripper"), .real_time = false}) {
    fingers_.wait_until_ready();
    world_.emplace(options.world, face_, motion_);
    if (place.is_shared()) {
      server_of_truth_.emplace(place, FINGERS, false);
    }
    truth_.emplace(options.truth, options.overwrite, head() + "time_us," + World::columns() + "\n");
  }

  void run() {
    place_.print_ready(FINGERS, ", " + place_.port("gripper"));
    const std::int64_t began_us = steady_now_us();
    last_us_ = began_us;
    while (!interrupted && !over_) {
      server_.step(ROUND);
      fingers_.share(std::chrono::milliseconds(0));
      round(steady_now_us());
      over_ = over_ || (options_.seconds && world_->time_s() >= *options_.seconds);
    }
    const double all_s = 1e-6 * static_cast<double>(last_us_ - began_us);
    const double paused_s = 1e-6 * static_cast<double>(paused_us_);
    if (paused_s > 0.01 * all_s) {
      std::fprintf(stderr, "the world was paused for %.2f of %.2f s: this machine is busy\n", paused_s, all_s);
    }
  }

private:
  std::string head() const {
    const GraspScenario &grasp = options_.world.grasp;
    std::ostringstream text;
    text << "# simulated: the truth of a cell; time_us is CLOCK_MONOTONIC\n# gripper: " << options_.model << "\n# face: " << LIFT_FACE
         << "\n# kind: " << (grasp.kind ? name_of(*grasp.kind) : "none") << "\n# shape: " << name_of(grasp.shape)
         << "\n# width_mm: " << grasp.width_mm << "\n# mass_kg: " << grasp.mass_kg << "\n# friction: " << grasp.pads[0].friction << ", "
         << grasp.pads[1].friction << "\n# crushes_N: " << grasp.crushes_N << "\n# seed: " << options_.seed << "\n";
    return text.str();
  }

  // Somebody is late, and has not been for too long.
  bool is_waited_for(std::int64_t now_us) const {
    const auto patience_us = static_cast<std::int64_t>(1e6 * options_.patience_s);
    const auto is_late = [&](std::int64_t seen_us) { return now_us - seen_us > LATE_us && now_us - seen_us < patience_us; };
    const std::int64_t heard_us = std::chrono::duration_cast<std::chrono::microseconds>(server_.heard_at().time_since_epoch()).count();
    bool is_late_one = is_late(heard_us);
    for (std::size_t i = 0; i < FINGERS; i++) {
      is_late_one = is_late_one || (fingers_.is_there(i) && !fingers_.shared(i).frozen && is_late(fingers_.shared(i).reached_us));
    }
    return is_late_one;
  }

  void round(std::int64_t now_us) {
    const std::int64_t passed_us = is_waited_for(now_us) ? 0 : std::min(now_us - last_us_, LONGEST_ROUND_us);
    paused_us_ += now_us - last_us_ - passed_us;
    last_us_ = now_us;
    world_->advance(1e-6 * static_cast<double>(passed_us));
    fingers_.put(now_us, {world_->pressures_Pa(0), world_->pressures_Pa(1)});
    if (!at_touch_.empty() && world_->touched()) {
      const std::string commands = std::exchange(at_touch_, {});
      for (const std::string_view command : split(commands, ';')) {
        obey(std::string(trim(command)));
      }
    }
    for (const std::string &event : world_->take_events()) {
      write_event(event);
    }
    truth_->row(now_us, world_->cells());
    send_truth(now_us);
    for (const std::string &line : lines_.take()) {
      std::string answer;
      try {
        answer = obey(line);
      } catch (const Error &error) {
        answer = "error: " + error_text(error);
      }
      std::printf("%s\n", answer.c_str());
      std::fflush(stdout);
    }
    fingers_.check();
  }

  void send_truth(std::int64_t now_us) {
    if (!server_of_truth_) {
      return;
    }
    server_of_truth_->step();
    if (server_of_truth_->is_due(now_us)) {
      for (std::size_t i = 0; i < FINGERS; i++) {
        server_of_truth_->send(i, fingers_.device_us(i, now_us), world_->patch(i));
      }
    }
  }

  void write_event(const std::string &text) {
    truth_->event(steady_now_us(), text);
    std::fprintf(stderr, "%.2f s: %s\n", world_->time_s(), printable(text).c_str());
  }

  // Answers. Throws Error: it knows no such command.
  std::string obey(const std::string &command) {
    std::istringstream words(command);
    std::string verb, what;
    words >> verb >> what;
    if (verb == "truth") {
      return world_->cells();
    }
    if (verb == "at_touch" && !what.empty()) {
      at_touch_ = command.substr(command.find(what));
      return "ok";
    }
    if (!act(verb, what)) {
      throw Error(ErrorCode::bad_value, "\"" + printable(command) + "\" cannot be; " + COMMANDS);
    }
    if (verb != "lift" && !is_disturbance(verb)) { // the world reports those itself
      write_event(command);
    }
    return "ok";
  }

  bool act(const std::string &verb, const std::string &what) {
    const auto number = to_double(what);
    const bool is_positive = number && *number >= 0.0;
    const auto finger = static_cast<std::size_t>(std::find(SIDES.begin(), SIDES.end(), what) - SIDES.begin());
    const bool is_finger = finger < FINGERS && fingers_.is_there(finger);
    const auto *fault = find_in(line_faults(), [&](const auto &one) { return what == one.first; });
    if (verb == "lift") {
      return world_->lift();
    }
    if (is_disturbance(verb)) {
      return world_->disturb(planned(verb + ":" + what));
    }
    if (verb == "take") {
      world_->take_away();
    } else if (verb == "quit") {
      over_ = true;
    } else if (verb == "kill" && is_finger) {
      fingers_.end(finger);
    } else if ((verb == "freeze" || verb == "thaw") && is_finger) {
      fingers_.shared(finger).frozen = verb == "freeze";
    } else if (verb == "power" && (what == "on" || what == "off")) {
      server_.power(what == "on");
    } else if (verb == "fault" && is_positive && *number <= 255.0) {
      server_.fail(static_cast<std::uint8_t>(*number));
    } else if (verb == "line" && fault) {
      line_.fault = fault->second;
    } else if (verb == "late" && is_positive) {
      line_.late_s = 1e-3 * *number;
    } else if (verb == "latency_timer" && is_positive) {
      line_.latency_timer_s = 1e-3 * *number;
    } else {
      return false;
    }
    server_.trouble(line_);
    return true;
  }

  static constexpr const char *COMMANDS = "give lift, take, pour|knock|slick|lower AMOUNT once it is lifted, kill|freeze|thaw "
                                          "left|right, line none|silent|garbage|damaged|other_slave|refused, late MS, latency_timer "
                                          "MS, power on|off, fault CODE, at_touch COMMAND; COMMAND..., truth, or quit";

  const SimulationOptions &options_;
  const PortFolder &place_;
  Face face_;
  FingertipProcesses fingers_; // processes, before there are threads
  GripperMotion motion_;
  GripperServer server_;
  std::optional<World> world_;
  std::optional<Truth> truth_;
  std::optional<HandServer> server_of_truth_; // it obeys no hand
  Lines lines_;
  LineTrouble line_;
  std::string at_touch_; // a command
  bool over_ = false;
  std::int64_t last_us_ = 0, paused_us_ = 0;
};

} // namespace

void lift(const SimulationOptions &options, const PortFolder &place) {
  const GripperTraits &traits = gripper_traits(options.model);
  const double widest_mm = options.world.grasp.width_mm + options.world.grasp.opens_mm;
  if (widest_mm > traits.stroke_mm) {
    throw Error(ErrorCode::bad_value,
                options.model + " opens to " + fixed(traits.stroke_mm, 1) + " mm; the object and --opens take " + fixed(widest_mm, 1));
  }
  Lift(options, place).run();
}

} // namespace fingertip::cell
