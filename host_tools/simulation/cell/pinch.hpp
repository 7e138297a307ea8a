// An object pinched by two pads: other physics than cell.hpp's, written for what a controller may
// take for granted.
//
// Each pad's force is its own power of its own indentation, less what has relaxed. The object is a
// mass that is free along the grip's axis, on a table with friction until it is lifted, and in the
// plane of the pads. Each side carries it by a bristle: a spring that yields at the side's
// friction, which falls with the speed of the slide (Stribeck).
//
// x and y lie in the plane of fingertip 0's pad, y is upwards. No rotation, no rolling.
#pragma once

#include "simulation/cell/kinds.hpp"

namespace fingertip::cell {

class Pinch {
public:
  // grasp must outlive it.
  explicit Pinch(const KindOfGrasp &grasp);

  static constexpr double STEP_s = 2.5e-4; // the longest
  void step(double seconds, double width_mm, const KindOfGrasp::Inputs &inputs);

  double force_N(std::size_t pad) const { return pads_[pad].force_N; }
  double mean_N() const { return 0.5 * (pads_[0].force_N + pads_[1].force_N); }
  // What the gripper at this width would press against now.
  double force_at_N(double width_mm) const;
  Vector load_N(std::size_t pad) const { return pads_[pad].load_N; } // of the object on the rubber
  Vector way_mm() const { return at_mm_; }
  bool slips() const { return pads_[0].slips && pads_[1].slips; }
  double slid_mm() const { return slid_mm_; } // while both sides slip

private:
  struct Pad {
    double force_N = 0.0, elastic_N = 0.0;
    std::array<double, 2> follows_N{}, strength{};
    Vector bristle_mm, load_N;
    double slid_mm_s = 0.0;
    bool slips = false;
  };

  void press(std::size_t pad, double seconds, double indentation_mm);
  void drag(std::size_t pad, double seconds, double friction_share);
  double table_N(const KindOfGrasp::Inputs &inputs) const;
  void push_along(double seconds, double squeezed_mm, double mass_kg, double table_N);

  const KindOfGrasp &grasp_;
  std::array<Pad, 2> pads_;
  double along_mm_, along_mm_s_ = 0.0; // of the object's middle, towards pad 1
  Vector at_mm_, speed_mm_s_;
  double slid_mm_ = 0.0;
};

} // namespace fingertip::cell
