// fingertip_cell_emulated: the world of a grasp for host_tools/simulation/emulator/lockstep.mjs, whose
// protocol it speaks on its standard input and output.
#include "grasp/convert.hpp"
#include "grasp/gripper/gripper.hpp"
#include "library/pad/profile.hpp"
#include "simulation/cell/emulated_grasp.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace fingertip;
using namespace fingertip::cell;
using nlohmann::ordered_json;

constexpr const char *FACE = "sphere15";
constexpr double LAYER_mm = 12.0;
constexpr double FRICTION = 0.65; // static, before it falls
constexpr std::uint64_t SEED = 1; // of pads and of the gripper's line
constexpr std::uint64_t CHUNK_LIMIT = 1 << 20;
enum Stream : std::uint64_t { PAD = 842 };

struct Options {
  std::string cache;
  double slice_us = 500.0, friction_falls = 0.67;
};

// Lifted, and then friction falls so far, within 30 ms, that the grip does not hold it.
EmulatedTrial trial_of(const Options &options, const pad_profile &profile) {
  EmulatedTrial trial;
  trial.object.width_mm = 40.0;
  trial.object.mass_kg = trial.course.mass_kg = 0.3;
  trial.object.friction = FRICTION;
  trial.object.uneven_friction = 0.03;
  trial.object.com_mm = {3.0, 1.0};
  trial.grasp.place_mm = {0.8, -1.5};
  trial.grasp.angle_rad = 0.3;
  trial.grasp.down_rad = 0.4;
  KindOfGrasp &course = trial.course;
  course.opens_mm = 1.0;
  course.waits_s = 0.05;
  course.lift_mm = 4.0;
  course.lift_s = 0.5;
  course.events = {{Event::Kind::slick, course.lift_s + 0.1, 0.03, options.friction_falls}};
  course.ends_s = course.lift_s + 0.4;
  trial.gripper = gripper_mechanics(gripper_models().front().model);
  trial.seed = SEED;
  for (std::size_t f = 0; f < trial.rubber.size(); f++) {
    Random random(SEED, PAD, f);
    trial.rubber[f] = draw_rubber(profile, random);
  }
  return trial;
}

// Reads from the standard input; false: it has ended.
bool read_whole(void *to, std::size_t length) { return std::fread(to, 1, length, stdin) == length; }

template <typename Value> Value next() {
  Value value;
  if (!read_whole(&value, sizeof value)) {
    throw std::runtime_error("the boards have ended");
  }
  return value;
}

void put(const void *bytes, std::size_t length) {
  if (std::fwrite(bytes, 1, length, stdout) != length) {
    throw std::runtime_error("the boards do not listen");
  }
}

void put_u32(std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  put(&word, sizeof word);
}

int serve(const Options &options) {
  const Face face(FACE, LAYER_mm, options.cache);
  const pad_profile profile = pad::profile_over_own_sensors({LAYER_mm, 0.0, false});
  const EmulatedTrial trial = trial_of(options, profile);
  EmulatedGrasp grasp(trial, face, profile);
  std::vector<std::uint8_t> bytes;
  while (!grasp.over()) {
    const double t_s = 1e-9 * static_cast<double>(next<std::uint64_t>());
    for (std::uint32_t chunks = next<std::uint32_t>(); chunks > 0; chunks--) {
      const auto board = next<std::uint32_t>();
      const double at_s = 1e-9 * static_cast<double>(next<std::uint64_t>());
      const auto length = next<std::uint32_t>();
      if (board >= trial.rubber.size() || length > CHUNK_LIMIT) {
        throw std::runtime_error("two boards are needed");
      }
      bytes.resize(length);
      if (!read_whole(bytes.data(), length)) {
        throw std::runtime_error("the boards have ended");
      }
      grasp.take(board, bytes.data(), length, at_s);
    }
    std::array<std::vector<std::uint8_t>, 2> sent{grasp.to_send(0), grasp.to_send(1)};
    grasp.run(t_s + 1e-6 * options.slice_us);
    put_u32(grasp.over());
    for (std::size_t f = 0; !grasp.over() && f < sent.size(); f++) {
      const Pressures sensed_Pa = grasp.sensed_Pa(f);
      put(sensed_Pa.data(), sizeof sensed_Pa);
      put_u32(sent[f].size());
      put(sent[f].data(), sent[f].size());
    }
    std::fflush(stdout);
  }
  ordered_json out;
  out["gripper"] = trial.gripper.traits.model;
  out["face"] = FACE;
  out["mass_kg"] = trial.object.mass_kg;
  out["friction"] = trial.object.friction;
  out["friction_falls"] = options.friction_falls;
  out.update(grasp.summary());
  const std::string text = out.dump();
  put(text.data(), text.size());
  return std::fflush(stdout) == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
  CLI::App app("The world of a grasp for simulation/emulator/lockstep.mjs: an object, two fingertips' rubber, "
               "a gripper and the controller. It is lifted, and its friction falls.",
               "fingertip_cell_emulated");
  Options options;
  app.add_option("--friction-falls", options.friction_falls, "By this share")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  app.add_option("--slice-us", options.slice_us, "As the boards have it")
      ->check(CLI::Range(100.0, 10000.0))
      ->capture_default_str();
  app.add_option("--cache", options.cache, "Folder of the contact tables")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return serve(options);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fingertip_cell_emulated: %s\n", error.what());
    return 1;
  }
}
