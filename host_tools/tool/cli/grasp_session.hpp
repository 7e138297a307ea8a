/* A grasp from a terminal: two fingertips and a gripper, shown, recorded and controlled. */
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "libfingertip/connection.hpp"
#include "tool/cli/terminal.hpp"

#include <map>
#include <optional>
#include <string>

namespace fingertip {

struct GraspOptions {
  GripperWay gripper;
  std::string left, right; /* serial number, or port; empty: what there is */
  Reach reach = Reach::automatic;
  std::map<std::string, double> limits;   /* by name, grasp/settings.hpp */
  std::map<std::string, double> breaking; /* the same, of a preset; limits override them */
  bool activate = false;
  std::optional<double> seconds; /* since both fingertips stream */
  std::string recording;         /* empty: none */
  bool overwrite = false;
  bool quiet = false;
  ColourMode colour = ColourMode::automatic;
};

/* How a grasp ended, as exit status: 0 as asked, 1 by an error. */
enum GraspEnd { GRASP_DONE = 0, GRASP_MISSED = 3, GRASP_DROPPED = 4, GRASP_FAULT = 5 };

/* Exit status. Throws Error. */
int run_grasp(const GraspOptions &options);

} // namespace fingertip
