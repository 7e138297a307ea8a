// fingertip_cell: an object between two fingertips on a gripper, in real time, each on a port of
// its own.
//
// Physics and gripper run in this process, a fingertip's firmware in each of two others. Time that
// this process is held up is none for the world, nor is time in which the others are waited for:
// fingertips and lines go on, with what is as it was.
#include "libfingertip/clock.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/table_file.hpp"
#include "simulation/cell/fingertip_cell_finger.hpp"
#include "simulation/cell/fingertip_cell_world.hpp"
#include "simulation/cell/gripper_server.hpp"
#include "tool/advice.hpp"

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <poll.h>
#include <sstream>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace fingertip;
using namespace fingertip::cell;
namespace fs = std::filesystem;

namespace {

volatile std::sig_atomic_t interrupted = 0;

enum Stream : std::uint64_t { GAINS = 851 };

constexpr double LAYER_mm = 12.0;
constexpr std::size_t FINGERS = 2;
constexpr const char *SIDES[FINGERS] = {"left", "right"};
constexpr const char *SERIALS[FINGERS] = {"00000000000CE110", "00000000000CE111"};
constexpr std::chrono::microseconds ROUND{1000};
constexpr std::int64_t LONGEST_ROUND_us = 10'000; // of the world's time
constexpr std::int64_t LATE_us = 30'000;          // the world waits for what is later than that
constexpr std::int64_t ROW_us = 2'000;
constexpr std::size_t ROWS_BYTES = 4096;

struct Options {
  std::string folder, model = gripper_models().front().model, face = "sphere18", truth, cache;
  World::Options world;
  std::vector<std::string> planned;
  double opens_mm = 4.0, gain_spread = 0.05, gain_sd = 0.01, patience_s = 0.0;
  std::optional<double> seconds;
  std::uint64_t seed = 1;
  bool overwrite = false, by_command = false;
};

// Both processes.
class Fingers {
public:
  Fingers(const Options &options) : links_{options.folder + "/left", options.folder + "/right"} {
    void *memory = mmap(nullptr, FINGERS * sizeof(SharedPressures), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) {
      throw std::bad_alloc();
    }
    shared_ = static_cast<SharedPressures *>(memory);
    for (std::size_t i = 0; i < FINGERS; i++) {
      new (&shared_[i]) SharedPressures();
    }
    for (std::size_t i = 0; i < FINGERS; i++) {
      FingerProcess finger{SERIALS[i], links_[i], 2 * options.seed + i, LAYER_mm, {}, 0.0};
      Random random(options.seed, GAINS, i);
      for (double &gain : finger.gain) {
        gain = 1.0 + std::clamp(options.gain_spread * random.normal(), -0.5, 0.5);
      }
      finger.gain_sd = options.gain_sd;
      process_[i] = start_finger(finger, shared_[i]);
    }
  }
  ~Fingers() {
    for (std::size_t i = 0; i < FINGERS; i++) {
      end(i);
    }
    munmap(shared_, FINGERS * sizeof(SharedPressures));
  }
  Fingers(const Fingers &) = delete;
  Fingers &operator=(const Fingers &) = delete;

  void put(std::int64_t host_us, const std::array<Pressures, FINGERS> &pressures) {
    for (std::size_t i = 0; i < FINGERS; i++) {
      shared_[i].put(host_us, pressures[i]);
    }
  }
  std::int64_t reached_us(std::size_t finger) const { return shared_[finger].reached_us; }
  bool is_there(std::size_t finger) const { return process_[finger] > 0; }
  bool is_frozen(std::size_t finger) const { return shared_[finger].frozen; }
  void freeze(std::size_t finger, bool frozen) { shared_[finger].frozen = frozen; }
  void end(std::size_t finger) {
    if (is_there(finger)) {
      kill(process_[finger], SIGKILL);
      waitpid(process_[finger], nullptr, 0);
      forget(finger);
    }
  }
  // False: one has ended by itself.
  bool look() {
    for (std::size_t i = 0; i < FINGERS; i++) {
      if (is_there(i) && waitpid(process_[i], nullptr, WNOHANG) != 0) {
        forget(i);
        return false;
      }
    }
    return true;
  }

private:
  void forget(std::size_t finger) {
    process_[finger] = 0;
    std::error_code none;
    fs::remove(links_[finger], none);
  }

  std::array<std::string, FINGERS> links_;
  std::array<pid_t, FINGERS> process_{};
  SharedPressures *shared_ = nullptr;
};

// The truth as a CSV file with comments.
class Truth {
public:
  Truth(const Options &options, const std::string &head) {
    if (!options.truth.empty()) {
      file_.emplace(options.truth, options.overwrite, OutputFile::Appears::at_once);
      rows_ = head + "time_us," + World::columns() + "\n";
      flush();
    }
  }
  ~Truth() {
    try {
      flush();
    } catch (const Error &error) {
      tell("fingertip_cell", error);
    }
  }
  Truth(const Truth &) = delete;
  Truth &operator=(const Truth &) = delete;

  void row(std::int64_t host_us, const World &world) {
    if (file_ && host_us - told_us_ >= ROW_us) {
      told_us_ = host_us;
      rows_ += std::to_string(host_us) + "," + world.cells() + "\n";
      if (rows_.size() > ROWS_BYTES) {
        flush();
      }
    }
  }
  void event(std::int64_t host_us, const std::string &text) {
    if (file_) {
      rows_ += "# event: " + std::to_string(host_us) + "," + printable(text) + "\n";
      flush();
    }
  }

private:
  void flush() {
    if (file_ && !rows_.empty()) {
      const std::string rows = std::exchange(rows_, {});
      file_->append(rows.data(), rows.size());
    }
  }

  std::optional<OutputFile> file_;
  std::string rows_;
  std::int64_t told_us_ = 0;
};

// Lines of standard input, as long as it may be read.
class Lines {
public:
  std::vector<std::string> take() {
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    const bool is_ours = !isatty(STDIN_FILENO) || tcgetpgrp(STDIN_FILENO) == getpgrp();
    if (ended_ || !is_ours || wait_for(&input, 1, HostTime()) <= 0) {
      return {};
    }
    char bytes[1024];
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
    if (count <= 0) {
      ended_ = true;
      return {};
    }
    came_.append(bytes, static_cast<std::size_t>(count));
    std::vector<std::string> lines;
    for (std::size_t end; (end = came_.find('\n')) != std::string::npos;) {
      lines.push_back(came_.substr(0, end));
      came_.erase(0, end + 1);
    }
    return lines;
  }

private:
  std::string came_;
  bool ended_ = false;
};

// A gripper on its own line, activated and as far open as it is to begin with.
void stand_open(GripperServer &server, GripperMotion &motion, const std::string &model,
                double width_mm) {
  constexpr double HURRY_s = 0.02; // in a round: too short to notice
  std::atomic<bool> is_done{false};
  std::string why;
  Thread client([&] {
    try {
      GripperWay way;
      way.model = model;
      way.port = server.port();
      way.timeout_s = 10.0; // however busy this machine is
      const auto gripper = open_gripper(way);
      gripper->activate();
      while (!gripper->poll().active) {
      }
      GripperMove move;
      move.width_mm = width_mm;
      move.speed_mm_s = gripper->traits().speed_max_mm_s;
      gripper->move(move);
      while (gripper->poll().moving) {
      }
    } catch (const Error &error) {
      why = error.what();
    }
    is_done = true;
  });
  while (!is_done) {
    server.step(ROUND);
    motion.step(HURRY_s);
  }
  client.join();
  if (!why.empty()) {
    throw Error("the gripper does not open (" + why + ")");
  }
}

class CellProgram {
public:
  explicit CellProgram(const Options &options)
      : options_(options), face_(options.face, LAYER_mm, options.cache), fingers_(options),
        motion_(GripperServer::mechanics(options.model)), server_(motion_, server_options()) {
    wait_for_fingers();
    stand_open(server_, motion_, options.model, options.world.object.width_mm + options.opens_mm);
    server_.rename(options.folder + "/gripper");
    world_.emplace(options.world, face_, motion_);
    truth_.emplace(options, head());
  }

  void run() {
    std::printf("ready: %s/left, %s/right, %s/gripper\n", options_.folder.c_str(),
                options_.folder.c_str(), options_.folder.c_str());
    std::fflush(stdout);
    const std::int64_t began_us = steady_now_us();
    last_us_ = began_us;
    while (!interrupted && !over_) {
      server_.step(ROUND);
      round(steady_now_us());
      over_ = over_ || (options_.seconds && world_->time_s() >= *options_.seconds);
    }
    const double all_s = 1e-6 * static_cast<double>(last_us_ - began_us);
    const double stood_s = 1e-6 * static_cast<double>(stood_us_);
    if (stood_s > 0.01 * all_s) {
      std::fprintf(stderr, "the world stood still for %.2f of %.2f s: this machine is busy\n",
                   stood_s, all_s);
    }
  }

private:
  GripperServer::Options server_options() const {
    GripperServer::Options server;
    server.model = options_.model;
    server.real_time = false;
    server.link = options_.folder + "/.gripper"; // until all is ready
    return server;
  }

  std::string head() const {
    const Object &object = options_.world.object;
    std::ostringstream text;
    text << "# simulated: the truth of a cell; time_us is CLOCK_MONOTONIC\n# gripper: "
         << options_.model << "\n# face: " << options_.face << "\n# width_mm: " << object.width_mm
         << "\n# mass_kg: " << object.mass_kg << "\n# friction: " << object.friction
         << "\n# crushes_N: " << object.crushes_N << "\n# seed: " << options_.seed << "\n";
    return text.str();
  }

  // They have measured their zeros and know their pads.
  void wait_for_fingers() {
    fingers_.put(steady_now_us(), {});
    while (fingers_.reached_us(0) == 0 || fingers_.reached_us(1) == 0) {
      if (!fingers_.look()) {
        throw Error("a fingertip cannot be started");
      }
      if (interrupted) {
        throw Error("interrupted");
      }
      wait_until(host_now() + std::chrono::milliseconds(10));
    }
  }

  // Somebody is late, and has not been for too long.
  bool is_waited_for(std::int64_t now_us) const {
    const auto patience_us = static_cast<std::int64_t>(1e6 * options_.patience_s);
    const auto is_late = [&](std::int64_t seen_us) {
      return now_us - seen_us > LATE_us && now_us - seen_us < patience_us;
    };
    const std::int64_t heard_us =
        std::chrono::duration_cast<std::chrono::microseconds>(server_.heard_at().time_since_epoch())
            .count();
    bool is_late_one = is_late(heard_us);
    for (std::size_t i = 0; i < FINGERS; i++) {
      is_late_one = is_late_one || (fingers_.is_there(i) && !fingers_.is_frozen(i) &&
                                    is_late(fingers_.reached_us(i)));
    }
    return is_late_one;
  }

  void round(std::int64_t now_us) {
    const std::int64_t passed_us =
        is_waited_for(now_us) ? 0 : std::min(now_us - last_us_, LONGEST_ROUND_us);
    stood_us_ += now_us - last_us_ - passed_us;
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
      tell_event(event);
    }
    truth_->row(now_us, *world_);
    for (const std::string &line : lines_.take()) {
      std::string answer;
      try {
        answer = obey(line);
      } catch (const Error &error) {
        answer = "error: " + told(error);
      }
      std::printf("%s\n", answer.c_str());
      std::fflush(stdout);
    }
    if (!fingers_.look()) {
      throw Error("a fingertip has ended by itself");
    }
  }

  void tell_event(const std::string &text) {
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
    if (!(verb.empty() ? false : act(verb, what))) {
      throw Error(ErrorCode::bad_value, "\"" + printable(command) + "\" cannot be; " + COMMANDS);
    }
    if (verb != "lift" && !is_disturbance(verb)) { // which the world tells
      tell_event(command);
    }
    return "ok";
  }

  bool act(const std::string &verb, const std::string &what) {
    const auto number = to_double(what);
    if (verb == "lift") {
      return world_->lift();
    }
    if (verb == "take") {
      world_->take_away();
      return true;
    }
    if (verb == "quit") {
      over_ = true;
      return true;
    }
    if (verb == "kill" || verb == "freeze" || verb == "thaw") {
      const auto side = std::find(std::begin(SIDES), std::end(SIDES), what);
      const auto finger = static_cast<std::size_t>(side - std::begin(SIDES));
      if (finger == FINGERS || !fingers_.is_there(finger)) {
        return false;
      }
      verb == "kill" ? fingers_.end(finger) : fingers_.freeze(finger, verb == "freeze");
      return true;
    }
    if (verb == "line") {
      const auto known = std::find_if(std::begin(FAULTS), std::end(FAULTS),
                                      [&](const auto &one) { return what == one.first; });
      if (known == std::end(FAULTS)) {
        return false;
      }
      line_.fault = known->second;
    } else if (verb == "late" && number && *number >= 0.0) {
      line_.late_s = 1e-3 * *number;
    } else if (verb == "latency_timer" && number && *number >= 0.0) {
      line_.latency_timer_s = 1e-3 * *number;
    } else if (verb == "power" && (what == "on" || what == "off")) {
      server_.power(what == "on");
      return true;
    } else if (verb == "fault" && number && *number >= 0.0 && *number <= 255.0) {
      server_.fail(static_cast<std::uint8_t>(*number));
      return true;
    } else if (is_disturbance(verb)) {
      const Planned now = planned(verb + ":" + what);
      return world_->disturb(now.kind, now.amount);
    } else {
      return false;
    }
    server_.trouble(line_);
    return true;
  }

  static constexpr const char *COMMANDS =
      "give lift, take, pour|jerk|knock|slick AMOUNT once it is lifted, kill|freeze|thaw "
      "left|right, line none|silent|garbage|damaged|other_slave|refused, late MS, latency_timer "
      "MS, power on|off, fault CODE, at_touch COMMAND; COMMAND..., truth, or quit";
  static constexpr std::pair<const char *, LineFault> FAULTS[] = {
      {"none", LineFault::none},
      {"silent", LineFault::silent},
      {"garbage", LineFault::garbage},
      {"damaged", LineFault::damaged},
      {"other_slave", LineFault::other_slave},
      {"refused", LineFault::refused}};

  const Options &options_;
  Face face_;
  Fingers fingers_; // processes, before there are threads
  GripperMotion motion_;
  GripperServer server_;
  std::optional<World> world_;
  std::optional<Truth> truth_;
  Lines lines_;
  LineTrouble line_;
  std::string at_touch_; // a command
  bool over_ = false;
  std::int64_t last_us_ = 0, stood_us_ = 0;
};

void check(const Options &options) {
  const GripperTraits &traits = gripper_traits(options.model);
  const double widest_mm = options.world.object.width_mm + options.opens_mm;
  if (widest_mm > traits.stroke_mm) {
    throw Error(ErrorCode::bad_value, options.model + " opens to " + fixed(traits.stroke_mm, 1) +
                                          " mm; the object and --opens take " +
                                          fixed(widest_mm, 1));
  }
  if (!options.truth.empty()) {
    check_output(options.truth, options.overwrite);
  }
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error) {
    throw Error(ErrorCode::cannot_write, options.folder + ": " + error.message());
  }
  for (const char *name : {"left", "right", "gripper"}) {
    const fs::path link = fs::path(options.folder) / name;
    if (fs::exists(link, error)) {
      throw Error(ErrorCode::file_exists,
                  link.string() +
                      ": is there already; end the other cell, or choose another folder");
    }
  }
}

} // namespace

int main(int argc, char **argv) {
  CLI::App app("Simulates an object between two fingertips on a gripper, in real time, each on a "
               "port of its own in FOLDER: left, right, gripper. Lines of standard input are "
               "obeyed. Ctrl-C ends it.",
               "fingertip_cell");
  Options options;
  Object &object = options.world.object;
  std::vector<std::string> models, planned_texts;
  for (const GripperTraits &traits : gripper_models()) {
    models.push_back(traits.model);
  }
  options.cache = twin::default_cache_directory().string();
  double lift_after_s = *options.world.lift_after_s, seconds = 0.0;
  app.add_option("folder", options.folder, "For the ports")->required()->type_name("FOLDER");
  app.add_option("--gripper", options.model, "Which one")
      ->check(CLI::IsMember(models))
      ->capture_default_str();
  const auto number = [&](const char *name, double &value, const char *unit, double low,
                          double high, const char *help) {
    return app.add_option(name, value, help)
        ->type_name(unit)
        ->check(CLI::Range(low, high))
        ->capture_default_str();
  };
  app.add_option("--face", options.face, "What of the object is touched: an indenter, or plate")
      ->capture_default_str();
  number("--width", object.width_mm, "MM", 1.0, 500.0, "Of the object");
  number("--mass", object.mass_kg, "KG", 0.001, 10.0, "Its mass");
  number("--friction", object.friction, "NUMBER", 0.05, 3.0, "Its friction coefficient");
  number("--kinetic", object.kinetic_share, "SHARE", 0.3, 1.0, "Of the friction, while it slides");
  app.add_option("--stiffness", object.stiffness_N_mm, "Its stiffness; default: it does not yield")
      ->type_name("N/MM")
      ->check(CLI::Range(0.1, 1e6));
  app.add_option("--crushes", object.crushes_N, "More force breaks it; default: none does")
      ->type_name("N")
      ->check(CLI::Range(0.1, 1e6));
  number("--opens", options.opens_mm, "MM", 0.5, 100.0,
         "The gripper stands so much wider at first");
  number("--lift", options.world.lift_mm, "MM", 1.0, 500.0, "How far");
  number("--lift-time", options.world.lift_s, "S", 0.05, 60.0, "And how long");
  CLI::Option *after =
      number("--lift-after", lift_after_s, "S", 0.1, 1e6, "Once the force has stood for so long");
  app.add_flag("--by-command", options.by_command, "Lift only on the command")->excludes(after);
  app.add_option("--then", planned_texts,
                 "A disturbance: pour:MASSES, jerk:M/S2, knock:M/S or slick:SHARE, @SECONDS after "
                 "the lift")
      ->type_name("KIND:AMOUNT@S");
  number("--gain-spread", options.gain_spread, "SHARE", 0.0, 0.2, "Between sensors");
  number("--gain-error", options.gain_sd, "SHARE", 0.0, 0.2, "That calibration left of it");
  app.add_option("--seed", options.seed, "Of gains and noise")->capture_default_str();
  CLI::Option *length = number("--seconds", seconds, "S", 0.1, 1e6, "Ends after so long");
  app.add_option("--truth", options.truth, "Keeps what is true")->type_name("FILE.csv");
  app.add_flag("--overwrite", options.overwrite, "Replace FILE.csv if it exists");
  number("--patience", options.patience_s, "S", 0.0, 3600.0,
         "The world stands still at most so long while fingertips or the gripper's client are "
         "held up");
  app.add_option("--cache", options.cache, "Of contact tables")->type_name("FOLDER");
  CLI11_PARSE(app, argc, argv);
  for (int number_of_signal : {SIGINT, SIGTERM, SIGHUP}) {
    std::signal(number_of_signal, [](int) { interrupted = 1; });
  }
  std::signal(SIGPIPE, SIG_IGN);
  try {
    for (const std::string &text : planned_texts) {
      options.world.planned.push_back(planned(text));
    }
    options.world.lift_after_s = options.by_command ? std::nullopt : std::optional(lift_after_s);
    if (*length) {
      options.seconds = seconds;
    }
    options.world.object.base_mm = 40.0;
    options.world.grasp.down_rad = 0.5 * M_PI;
    check(options);
    CellProgram(options).run();
    return 0;
  } catch (const Error &error) {
    tell("fingertip_cell", error);
  } catch (const std::runtime_error &error) { // of the twin: a face that there is not
    tell("fingertip_cell", Error(error.what()));
  }
  return 1;
}
