// The cell's world as time passes, its truth, and what can be done to it by name.
//
// README.md has its course. An object that slid DROP_mm, or that nothing presses any more, is gone.
#pragma once

#include "simulation/cell/cell.hpp"
#include "simulation/cell/gripper_motion.hpp"
#include "simulation/cell/slips.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fingertip::cell {

// "slick:0.35" or "slick:0.35@1.5": of what size, and begin_s how long after the lift's end. Throws Error, bad_value.
Event planned(const std::string &text);
bool is_disturbance(const std::string &name);

class World {
public:
  struct Options {
    GraspScenario grasp;         // with the lift and the events
    bool lifts_by_itself = true; // once the force is steady; else by a command
    std::vector<Event> planned;
  };

  // Both outlive it. From now on the object is between the fingers of motion.
  World(const Options &options, const Face &face, GripperMotion &motion);

  // Advances by this time, fingers included.
  void advance(double seconds);

  // False: it has been.
  bool lift();
  // Now; false: before the lift, or the object is gone.
  bool disturb(Event event);
  void take_away() { is_there_ = false; }

  Pressures pressures_Pa(std::size_t finger) const { return face_.base_Pa(patch(finger)); }
  // Without a force where nothing is touched.
  Patch patch(std::size_t finger) const { return is_there_ ? cell_->patch(finger) : Patch{}; }

  double time_s() const { return time_s_; }
  bool touched() const { return peak_N_ > TOUCHED_N; }
  bool is_dropped() const { return is_dropped_; }
  double slid_mm() const { return cell_->slid_mm(); }
  const std::vector<Slip> &slips() const { return slips_.slips; } // once it is dropped all, else those that have ended
  // The columns of the truth, in order.
  static const char *columns() {
    return "world_s,width_mm,force_N,peak_N,load_N,least_N,slid_mm,way_mm,friction,lifted_mm,slips,"
           "is_there,dropped,crushed";
  }
  std::string cells() const;
  // What has happened since it was last asked: "lift", "slick", "slip", "dropped", ...
  std::vector<std::string> take_events() { return std::exchange(events_, {}); }

private:
  static constexpr double TOUCHED_N = 0.05;

  double since_lift_s() const { return lift_s_ ? time_s_ - *lift_s_ : -1.0; }
  void watch_force();
  void watch_object();

  Options options_;
  GraspScenario grasp_; // and what was planned or commanded
  const Face &face_;
  GripperMotion &motion_;
  std::unique_ptr<Cell> cell_;
  std::vector<std::string> events_;
  struct Steady {
    double since_s, force_N;
  };
  std::optional<Steady> steady_; // the force
  std::vector<bool> begun_;      // of the events
  bool is_there_ = true, is_dropped_ = false, is_crushed_ = false;
  Slips slips_;
  double time_s_ = 0.0, peak_N_ = 0.0;
  std::optional<double> lift_s_;
};

} // namespace fingertip::cell
