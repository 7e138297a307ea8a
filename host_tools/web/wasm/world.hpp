// What happens to the simulated pad: an object that a hand presses and drags, that falls on it, or that a grip holds while a load pulls.
//
// The pad: silicone of 12 mm without ends; objects are known from the twin's tables (objects.hpp), sensors' errors are its too
// (twin/effects.hpp). An object touches where its middle is within the pad, 30 by 50 mm on 3 x 5 sensors; beyond, it has fallen off.
//
// Friction is that of the simulated cell (bundle.hpp): Coulomb's, static then kinetic, with the rubber's give before all slides, which is 1
// N/mm for each millimetre of contact radius. The middle of the contact goes along with the object. Objects do not turn, roll or tilt.
//
//   press   the hand holds the object rigidly. Its place and force follow what is asked within FOLLOWS_s. A new contact has no pull.
//   drop    from DROP_mm: m z'' = F - m g, F that of the table at its depth, times 1 + LOSS_s_mm z'
//           while it goes deeper (Hunt and Crossley, J. Appl. Mech. 42, 1975). It bounces, and
//           lies.
//   hold    as press, but along the pad the object is free: m x'' = load - Q, where the load follows what is
//           asked within LOAD_FOLLOWS_s. One that slid off stays lost until it is lifted, pressed or dropped.
//
// Time goes on in steps of STEP_s; between them readings are linear. The same calls at the same times give the same bits.
#pragma once

#include "simulation/twin/effects.hpp"
#include "web/wasm/bundle.hpp"
#include "web/wasm/objects.hpp"

#include <cstdint>
#include <vector>

namespace fingertip::web {

struct Truth {
  double t_s = 0.0;
  bool contact = false;
  double x_mm = 0.0, y_mm = 0.0; // where the object is, while there is contact
  double force_N = 0.0;
  double qx_N = 0.0, qy_N = 0.0; // of the object on the rubber
  bool slips = false;            // all of the contact slides
};

class World {
public:
  static double half_width_mm(), half_length_mm();
  static constexpr double FORCE_MAX_N = 50.0, MASS_MIN_kg = 0.02, MASS_MAX_kg = 2.0;
  static constexpr double FRICTION_MIN = 0.1, FRICTION_MAX = 1.5, KINETIC_SHARE = 0.8;
  static constexpr double FOLLOWS_s = 0.015, LOAD_FOLLOWS_s = 0.1;
  static constexpr double DROP_mm = 3.0, LOSS_s_mm = 0.006;
  static constexpr double STEP_s = 1e-3;

  // errors: of the pad, by name.
  World(std::vector<Object> objects, const twin::EffectValues &errors, std::uint64_t seed);

  // What touched is lifted. Out of range: nothing happens.
  void choose(std::size_t object);
  // Out of their ranges, all values count as at the end. Values that are not finite: as nothing happened.
  void press(double x_mm, double y_mm, double force_N);
  void hold(double x_mm, double y_mm, double force_N, double load_N, double angle_rad);
  void drop(double x_mm, double y_mm, double mass_kg);
  void lift();
  void set_friction(double friction);

  // Absolute; times must not fall by more than a step.
  double pressure_Pa(unsigned sensor, std::uint64_t t_us);
  // At the last step.
  const Truth &truth() const { return truth_; }

private:
  enum class Way { none, hand, grip, fallen, lost };

  bool is_pressing() const { return way_ != Way::none && way_ != Way::lost; }
  void begin_touch(Way way, double x_mm, double y_mm);
  void step();
  void move(double seconds);
  void report();
  double force_at_N(double depth_mm) const;

  std::vector<Object> objects_;
  const Object *object_;
  twin::Pad errors_;
  Way way_ = Way::none;
  Bundle bundle_;
  double friction_ = 0.5;
  double wanted_x_mm_ = 0.0, wanted_y_mm_ = 0.0, wanted_force_N_ = 0.0;
  double wanted_load_x_N_ = 0.0, wanted_load_y_N_ = 0.0;
  double load_x_N_ = 0.0, load_y_N_ = 0.0, mass_kg_ = 0.3;
  double x_mm_ = 0.0, y_mm_ = 0.0, vx_mm_s_ = 0.0, vy_mm_s_ = 0.0, force_N_ = 0.0;
  double depth_mm_ = 0.0, deeper_mm_s_ = 0.0;
  std::int64_t steps_ = 0;
  std::vector<double> base_Pa_, before_Pa_, now_Pa_; // [sensor]; the last two above ambient
  Truth truth_;
};

} // namespace fingertip::web
