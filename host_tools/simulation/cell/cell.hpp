// The simulated cell: two pads of rubber on the fingers of a gripper, an object between them, a table under it until the hand lifts.
//
// MuJoCo has the object's free body, its contacts with both faces and the table, and the friction of the table. Each face is a rigid box
// of FACE_kg that the rubber behind it holds:
//   normal      a spring, force over indentation a power, in a row with the finger and the object, less
//               what relaxes: the Prony series of simulation/twin/effects.hpp, as grippers hold a position
//   tangential  a spring along each axis, and one about the normal at the patch's mean arm, their stiffness as the cube root of the
//               force. Friction limits them together, and they go along with what slides
// both with the rubber's damping. What the fingertip's base bears is those springs' force, under the
// patch of contact that MuJoCo finds: a point, a line or an area. MuJoCo's own friction lifts a sliding face off the object.
//
// Friction is Coulomb's and falls with the speed of the slide (Stribeck), on each side by itself. A side
// slides beyond SLIDES_mm_s.
//
// The hand's frame: x level, along the pads, y upwards; fingertip 0's normal is x cross y, fingertip 1 faces it.
#pragma once

#include "simulation/cell/face.hpp"
#include "simulation/cell/kinds.hpp"

#include <memory>

namespace fingertip::cell {

constexpr double PAD_OVERHANG_mm = 9.0; // of the pad, beyond the outer sensors

class Cell {
public:
  static constexpr double STEP_s = 4e-4;
  static constexpr double SLIDES_mm_s = 1.0, FACE_kg = 0.02;
  static constexpr double FINGERS_N_mm = 50.0; // both fingers' own stiffness in a row; assumed

  virtual ~Cell() = default;

  // Advances by this time, in as many whole steps as are due; the gripper's width is as now.
  virtual void run(double seconds, double width_mm, const GraspScenario::Inputs &inputs) = 0;

  virtual double force_N(std::size_t finger) const = 0;
  double mean_N() const { return 0.5 * (force_N(0) + force_N(1)); }
  // What the gripper at this width would press against now.
  virtual double force_at_N(double width_mm) const = 0;
  virtual Vector load_N(std::size_t finger) const = 0; // of the object on the rubber, in the hand's frame
  virtual Patch patch(std::size_t finger) const = 0;   // in the fingertip's own
  virtual Vector way_mm() const = 0;                   // of the object's middle, from where it was
  virtual double turned_rad() const = 0;               // about the grip's axis
  virtual bool slips() const = 0;                      // both sides slide
  virtual double slid_mm() const = 0;                  // while both did, in all
  virtual double friction(std::size_t finger) const = 0;
};

// grasp must outlive it. Throws Error: this program was built without MuJoCo.
std::unique_ptr<Cell> make_cell(const GraspScenario &grasp);

} // namespace fingertip::cell
