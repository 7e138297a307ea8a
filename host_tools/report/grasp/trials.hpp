// A set of grasps: what was asked for, and how each went.
#pragma once

#include "simulation/cell/trial.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fingertip::grasp {

// Seeds below this are there to choose constants by; the report judges by others.
constexpr std::uint64_t JUDGING_SEEDS = 1000;

// Of name=value, split by commas, as grasp_settings() has them. Throws std::runtime_error: there is
// no such setting.
std::map<std::string, double> settings_of(const std::string &changes);

struct SetOptions {
  std::string gripper = gripper_models().front().model; // of gripper_mechanics()
  std::string mode = "hold";     // hold, fixed, or still, still-fixed, still-oracle: on the table, no lift
  std::string objects = "round"; // of cell::faces_of(), or faces split by commas
  std::string settings;          // of the controller: name=value, split by commas
  double rate_Hz = 410.0;        // above 600 at OSR 256, else 1024
  double effect = 1.0;           // share of a tangential force's field that reaches the readings
  double still_s = 12.0;         // length of a still grasp
  std::uint64_t seed = 1;
  std::string cache; // folder of the contact tables
};

// All that the grasps of a set share. Throws std::runtime_error or Error for what there is not.
class Set {
public:
  explicit Set(const SetOptions &options);

  bool is_still() const { return options_.mode.rfind("still", 0) == 0; }
  cell::Trial trial(std::uint64_t n) const;
  GripSettings settings(std::uint64_t n) const;
  // For several threads at once.
  cell::Outcome run(std::uint64_t n, const std::function<void(const cell::Moment &)> &trace = {}) const;

private:
  SetOptions options_;
  std::vector<std::string> faces_;
  std::map<std::string, cell::Face> all_;
  GripperMechanics gripper_;
  std::vector<cell::Rubber> pads_;
  cell::Sensing sensing_;
};

struct Done {
  cell::Scene scene;
  double set_N = 0.0; // of a still grasp
  cell::Outcome outcome;
};

// Those from `first` on, on so many threads.
std::vector<Done> run_all(const Set &set, std::uint64_t first, std::uint64_t count, std::uint64_t jobs);

} // namespace fingertip::grasp
