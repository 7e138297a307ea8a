#include "simulation/cell/scene.hpp"

#include "libfingertip/random.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { SCENE = 801 };

// Position, speed and acceleration of the minimum-jerk way from 0 to 1 in unit time.
struct Eased {
  double way, speed, acceleration;
};
Eased eased(double t) {
  if (t <= 0.0) {
    return {0.0, 0.0, 0.0};
  }
  if (t >= 1.0) {
    return {1.0, 0.0, 0.0};
  }
  return {t * t * t * (10.0 - 15.0 * t + 6.0 * t * t), 30.0 * t * t * (1.0 - t) * (1.0 - t),
          60.0 * t * (1.0 - t) * (1.0 - 2.0 * t)};
}

Vector rotated(const Vector &v, double rad) {
  return {std::cos(rad) * v.x - std::sin(rad) * v.y, std::sin(rad) * v.x + std::cos(rad) * v.y};
}

Disturbance draw_disturbance(Random &random, double begin_s) {
  using Kind = Disturbance::Kind;
  Disturbance drawn{};
  drawn.kind = static_cast<Kind>(random.next() % 4);
  drawn.begin_s = begin_s;
  switch (drawn.kind) {
  case Kind::pour:
    drawn.amount = random.uniform(0.3, 1.5);
    drawn.seconds = random.uniform(0.5, 2.0);
    break;
  case Kind::jerk:
    drawn.amount = random.uniform(2.0, 9.0);
    drawn.seconds = random.uniform(0.15, 0.5);
    // Up or down first.
    drawn.angle_rad = random.uniform(-0.3, 0.3) + (random.next() % 2 ? M_PI : 0.0);
    break;
  case Kind::knock:
    drawn.amount = random.uniform(0.03, 0.12);
    drawn.seconds = random.uniform(0.01, 0.03);
    drawn.angle_rad = random.uniform(-M_PI, M_PI);
    break;
  case Kind::slick:
    drawn.amount = random.uniform(0.2, 0.45);
    drawn.seconds = random.uniform(0.1, 0.5);
  }
  return drawn;
}

// A turn of the hand's frame that has its first axis point upwards.
double upwards_rad(const Grasp &grasp) { return grasp.down_rad + M_PI; }

} // namespace

const char *name_of(Disturbance::Kind kind) {
  constexpr const char *NAMES[] = {"pour", "jerk", "knock", "slick"};
  return NAMES[static_cast<int>(kind)];
}

Drive Scene::drive(double t_s) const {
  using Kind = Disturbance::Kind;
  const Eased lift = eased(t_s / lift_s);
  const double up_rad = upwards_rad(grasp);
  Drive drive;
  drive.table = t_s < lift_s;
  drive.lifted_mm = lift_mm * lift.way;
  drive.lift_mm_s = lift_mm * lift.speed / lift_s;
  drive.hand_m_s2 = rotated({1e-3 * lift_mm * lift.acceleration / (lift_s * lift_s), 0.0}, up_rad);
  drive.mass_kg = object.mass_kg;
  for (const Disturbance &one : disturbances) {
    const double share = std::clamp((t_s - one.begin_s) / one.seconds, 0.0, 1.0);
    const bool lasts = share > 0.0 && share < 1.0;
    const Vector way = rotated({1.0, 0.0}, up_rad + one.angle_rad);
    switch (one.kind) {
    case Kind::pour:
      drive.mass_kg += one.amount * object.mass_kg * eased(share).way;
      break;
    case Kind::jerk:
      if (lasts) {
        const double m_s2 = one.amount * std::sin(2.0 * M_PI * share);
        drive.hand_m_s2.x += m_s2 * way.x;
        drive.hand_m_s2.y += m_s2 * way.y;
      }
      break;
    case Kind::knock:
      if (lasts) {
        const double knock_N = object.mass_kg * one.amount * 0.5 * M_PI / one.seconds * std::sin(M_PI * share);
        drive.knock_N.x += knock_N * way.x;
        drive.knock_N.y += knock_N * way.y;
      }
      break;
    case Kind::slick:
      drive.friction_share *= 1.0 - one.amount * eased(share).way;
    }
  }
  return drive;
}

double Scene::least_N(double t_s) const {
  const Drive now = drive(t_s);
  const double x = GRAVITY_m_s2 * std::cos(grasp.down_rad) - now.hand_m_s2.x;
  const double y = GRAVITY_m_s2 * std::sin(grasp.down_rad) - now.hand_m_s2.y;
  return now.mass_kg * std::hypot(x, y) / (2.0 * object.friction * now.friction_share);
}

std::vector<std::string> faces_of(const std::string &objects) {
  const std::vector<std::string> balls{"sphere12",  "sphere15", "sphere18",   "sphere24",
                                       "ping_pong", "lime",     "rubber_duck"};
  const std::vector<std::string> cylinders{"cylinder12", "cylinder18", "cylinder24"};
  if (objects == "round") {
    std::vector<std::string> all = balls;
    all.insert(all.end(), cylinders.begin(), cylinders.end());
    return all;
  }
  if (objects == "balls") {
    return balls;
  }
  if (objects == "cylinders") {
    return cylinders;
  }
  if (objects == "faces") {
    return {"cylinder6", "cube12", "cube18", "cube24", "bottle_cap"};
  }
  if (objects == "flats") {
    return {"plate"};
  }
  throw std::runtime_error("there are no objects \"" + objects +
                           "\"; choose one of: round balls cylinders faces flats");
}

Scene draw_scene(const std::vector<std::string> &faces, std::uint64_t seed, std::uint64_t n) {
  Random random(seed, SCENE, n);
  for (;;) {
    Scene scene;
    scene.face = faces[random.next() % faces.size()];
    scene.object.width_mm = random.uniform(20.0, 70.0);
    scene.object.mass_kg = random.log_uniform(0.1, 1.0);
    scene.object.friction = random.uniform(0.25, 1.0);
    scene.object.kinetic_share = random.uniform(0.7, 1.0);
    scene.object.uneven_friction = std::clamp(0.05 * random.normal(), -0.15, 0.15);
    scene.object.gyration_mm = random.uniform(15.0, 40.0);
    scene.object.base_mm = random.uniform(30.0, 70.0);
    scene.grasp.down_rad = random.uniform(-M_PI, M_PI);
    scene.object.com_mm = rotated({random.uniform(-5.0, 15.0), 2.5 * random.normal()}, scene.grasp.down_rad);
    scene.grasp.place_mm = {random.uniform(-4.5, 4.5), random.uniform(-10.0, 10.0)};
    scene.grasp.angle_rad = random.uniform(-M_PI, M_PI);
    scene.grasp.relaxation = random.uniform(0.09, 0.26);
    scene.grasp.shear_N_mm2 = random.log_uniform(0.7, 1.5);
    scene.opens_mm = random.uniform(2.0, 5.0);
    scene.waits_s = random.uniform(0.1, 0.3);
    scene.lift_mm = random.uniform(3.0, 10.0);
    scene.lift_s = random.log_uniform(0.1, 1.0);
    double t_s = scene.lift_s;
    for (std::uint64_t left = 1 + random.next() % 2; left > 0; left--) {
      t_s += random.uniform(0.4, 0.8);
      // One in five is none.
      if (random.next() % 5 != 0) {
        scene.disturbances.push_back(draw_disturbance(random, t_s));
        t_s += scene.disturbances.back().seconds;
      }
    }
    scene.ends_s = t_s + 0.8;
    double worst_N = 0.0;
    for (double at_s = 0.0; at_s < scene.ends_s; at_s += 0.01) {
      worst_N = std::max(worst_N, scene.least_N(at_s));
    }
    if (worst_N <= FORCE_MOST_N) {
      return scene;
    }
  }
}

} // namespace fingertip::cell
