#include "grasp/gripper/gripper.hpp"

#include "grasp/gripper/serial_line.hpp"
#include "libfingertip/clock.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/gripper_options.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>

namespace fingertip {

namespace {

constexpr double SPEED_mm_s = 50.0;
constexpr auto POLLS = std::chrono::milliseconds(20);
constexpr int MISSED_MOST = 3; // answers in a row
constexpr double ACTIVATION_MOST_s = 20.0, REST_MOST_s = 5.0;

struct GripperOptions {
  std::string action;
  std::optional<double> width_mm;
  GripperWay way;
  std::optional<double> speed_mm_s;
  double force_N = 0.0;
  bool activate = false;
};

std::string mm(double width_mm) { return fixed(width_mm, 1) + " mm"; }

void row(const char *name, const std::string &value) { std::printf("%-24s%s\n", name, printable(value).c_str()); }

std::string timer_text(const GripperPort &port) {
  if (!port.latency_timer_ms) {
    return "no latency timer";
  }
  const int timer_ms = *port.latency_timer_ms;
  return "latency timer " + std::to_string(timer_ms) + " ms" +
         (timer_ms > 1 ? ", " + std::to_string(1000 / timer_ms) + " exchanges a second" : "");
}

void advise_about_timer(const std::string &path) {
  const std::optional<int> timer_ms = latency_timer_ms(path);
  if (timer_ms && *timer_ms > 1) {
    std::error_code none;
    const std::string name = std::filesystem::canonical(path, none).filename().string();
    std::fprintf(stderr,
                 "fingertip: the latency timer of %d ms allows %d exchanges a second; until it is plugged out: echo 1 "
                 "| sudo tee /sys/bus/usb-serial/devices/%s/latency_timer\n",
                 *timer_ms, 1000 / *timer_ms, printable(name).c_str());
  }
}

int list_grippers() {
  std::printf("model\tstroke_mm\tstep_mm\tspeed_mm_s\tforce_N\n");
  for (const GripperTraits &traits : gripper_models()) {
    std::printf("%s\t%s\t%s\t%s-%s\t%s-%s\n", traits.model.c_str(), fixed(traits.stroke_mm, 0).c_str(), fixed(traits.step_mm, 3).c_str(),
                fixed(traits.speed_min_mm_s, 0).c_str(), fixed(traits.speed_max_mm_s, 0).c_str(), fixed(traits.force_min_N, 0).c_str(),
                fixed(traits.force_max_N, 0).c_str());
  }
  const std::vector<GripperPort> ports = find_gripper_ports();
  std::printf(ports.empty() ? "\nno serial port on USB that may be a gripper's\n" : "\nports that may be a gripper's:\n");
  for (const GripperPort &port : ports) {
    std::printf("%s\t%s\t%s\n", printable(port.path).c_str(), port.adapter.empty() ? "-" : printable(port.adapter).c_str(),
                timer_text(port).c_str());
  }
  for (const GripperPort &port : ports) {
    advise_about_timer(port.path);
  }
  return 0;
}

// An answer may get lost; several in a row are reported.
GripperStatus polled(Gripper &gripper) {
  for (int missed = 0;; missed++) {
    try {
      return gripper.poll();
    } catch (const Error &error) {
      const bool may_pass = error.code() == ErrorCode::gripper_silent || error.code() == ErrorCode::gripper_garbled;
      if (!may_pass || missed >= MISSED_MOST) {
        throw;
      }
    }
  }
}

std::string fault_of(const Gripper &gripper, const GripperStatus &status) {
  return std::to_string(status.fault) + " (" + gripper.fault_text(status.fault) + ")";
}

// Until it is done; what lasts too long, or faults, ends in an Error.
GripperStatus wait_for_end(Gripper &gripper, const char *what, double longest_s, const std::function<bool(const GripperStatus &)> &done,
                           const std::function<double(const GripperStatus &)> &share) {
  ProgressBar bar(what);
  const auto end = host_now() + std::chrono::milliseconds(static_cast<long>(longest_s * 1000));
  for (;;) {
    const GripperStatus status = polled(gripper);
    if (done(status)) {
      return status;
    }
    if (stop_requested()) {
      if (status.active) {
        gripper.move({status.width_mm, gripper.traits().speed_min_mm_s, 0.0});
      }
      throw Interrupted();
    }
    if (host_now() > end) {
      throw Error(std::string(what) + " did not end within " + fixed(longest_s, 0) + " s" +
                  (status.fault ? ", fault " + fault_of(gripper, status) : ""));
    }
    bar.show(std::clamp(share(status), 0.0, 1.0));
    wait_until(host_now() + POLLS);
  }
}

void activate(Gripper &gripper) {
  gripper.activate();
  const auto begin = host_now();
  const GripperStatus status = wait_for_end(
      gripper, "activating", ACTIVATION_MOST_s, [](const GripperStatus &now) { return now.active; },
      [&](const GripperStatus &) { return std::chrono::duration<double>(host_now() - begin).count() / ACTIVATION_MOST_s; });
  std::printf("activated at %s\n", mm(status.width_mm).c_str());
}

int info(Gripper &gripper, const std::string &port) {
  const GripperStatus status = polled(gripper);
  const GripperTraits &traits = gripper.traits();
  row("model", traits.model);
  row("port", port);
  row("line", gripper.line());
  row("active", status.active ? "yes" : "no");
  row("moving", status.moving ? "yes" : "no");
  row("object", status.object ? *status.object ? "yes" : "no" : "?");
  row("width_mm", fixed(status.width_mm, 2) + " of " + fixed(traits.stroke_mm, 1));
  row("current_A", std::isnan(status.current_A) ? "?" : fixed(status.current_A, 2));
  row("fault", status.fault ? fault_of(gripper, status) : "none");
  advise_about_timer(port);
  return 0;
}

void check_range(const char *name, double value, double least, double most, const char *unit) {
  if (!(value >= least && value <= most)) {
    throw WrongUsage(std::string(name) + " goes from " + fixed(least, 0) + " to " + fixed(most, 0) + " " + unit + " with this gripper");
  }
}

// Of the width at the end of a move; the ends differ from one gripper to the next.
constexpr double SLACK_mm = 1.0, END_SLACK_mm = 5.0;

int move(Gripper &gripper, const GripperOptions &options) {
  const GripperTraits &traits = gripper.traits();
  const double width_mm = options.action == "open" ? traits.stroke_mm : options.action == "close" ? 0.0 : *options.width_mm;
  const double speed_mm_s = options.speed_mm_s.value_or(std::clamp(SPEED_mm_s, traits.speed_min_mm_s, traits.speed_max_mm_s));
  check_range("WIDTH", width_mm, 0.0, traits.stroke_mm, "mm");
  check_range("--speed", speed_mm_s, traits.speed_min_mm_s, traits.speed_max_mm_s, "mm/s");
  if (options.force_N != 0) {
    check_range("--force", options.force_N, traits.force_min_N, traits.force_max_N, "N");
  }
  if (options.activate) {
    activate(gripper);
  }
  const GripperStatus begin = polled(gripper);
  if (!begin.active) {
    throw Error("the gripper is not active" + (begin.fault ? ", fault " + fault_of(gripper, begin) : std::string()) +
                "; --activate does it, and a Robotiq opens and closes then: whatever it holds falls");
  }
  const double way_mm = std::abs(width_mm - begin.width_mm);
  gripper.move({width_mm, speed_mm_s, options.force_N});
  const GripperStatus end = wait_for_end(
      gripper, width_mm < begin.width_mm ? "closing" : "opening", way_mm / speed_mm_s + REST_MOST_s,
      [](const GripperStatus &now) { return !now.moving; },
      [&](const GripperStatus &now) { return way_mm > 0 ? std::abs(now.width_mm - begin.width_mm) / way_mm : 1.0; });
  if (!end.active || end.fault) {
    throw Error("the gripper stopped at " + mm(end.width_mm) + ", " + (end.active ? "active" : "not active") +
                (end.fault ? ", fault " + fault_of(gripper, end) : ""));
  }
  if (end.object.value_or(false)) {
    std::printf("holds an object at %s, asked for %s\n", mm(end.width_mm).c_str(), mm(width_mm).c_str());
  } else if (const bool at_end = width_mm <= 0.0 || width_mm >= traits.stroke_mm;
             std::abs(end.width_mm - width_mm) > (at_end ? END_SLACK_mm : SLACK_mm) + traits.deadband_mm) {
    throw Error("the gripper stopped at " + mm(end.width_mm) + ", not at " + mm(width_mm) + ", and reports neither an object nor a fault");
  } else {
    std::printf("at %s, without an object\n", mm(end.width_mm).c_str());
  }
  return 0;
}

int gripper_command(GripperOptions options) {
  const std::set<std::string> actions = {"list", "info", "move", "open", "close"};
  if (!actions.count(options.action)) {
    throw WrongUsage("ACTION: there is no \"" + printable(options.action) +
                     "\"; give list, info, move WIDTH, open or close; see fingertip gripper --help");
  }
  if (options.action == "list") {
    return list_grippers();
  }
  if (options.way.model.empty()) {
    throw WrongUsage("--model is missing; fingertip gripper list has them");
  }
  if ((options.action == "move") != options.width_mm.has_value()) {
    throw WrongUsage(options.width_mm ? "only move takes a WIDTH" : "WIDTH is missing: fingertip gripper move MM");
  }
  typed([&] { return gripper_traits(options.way.model); });
  try {
    const std::unique_ptr<Gripper> gripper = reach_gripper(options.way);
    if (options.action != "info") {
      return move(*gripper, options);
    }
    if (options.activate) {
      activate(*gripper);
    }
    return info(*gripper, options.way.port);
  } catch (const WrongUsage &) {
    throw;
  } catch (const Error &error) {
    throw with_gripper_advice(error);
  }
}

} // namespace

void add_gripper(CommandLine &line) {
  auto options = std::make_shared<GripperOptions>();
  CLI::App *command = line.add("gripper",
                               "Try a gripper by hand: list models, show its state, open it, close it, move it to a "
                               "width; waits and prints how it ended",
                               [options] { return gripper_command(*options); });
  with_value(command, "ACTION", "ACTION", options->action, "list, info, move WIDTH, open or close")->required();
  with_value(command, "MM", "WIDTH", options->width_mm, "For move: width between the pads, in mm");
  with_value(command, "MODEL", "--model", options->way.model, "Model of the gripper: " + gripper_model_names());
  with_value(command, "PATH", "--port", options->way.port,
             "Its serial line, or ur:HOST for a Robotiq on a UR arm; default: the only one on USB that is no fingertip");
  with_value(command, "MM/S", "--speed", options->speed_mm_s, "Speed of the width; default: 50 mm/s, or the nearest that it can");
  with_value(command, "N", "--force", options->force_N,
             "Force at which it stops, by its maker's scale, which is not newtons; default: its least");
  command->add_flag("--activate", options->activate,
                    "Activate it first, which clears its faults; a Robotiq opens and closes fully, and whatever it holds falls");
  with_gripper_line(command, options->way);
}

} // namespace fingertip
