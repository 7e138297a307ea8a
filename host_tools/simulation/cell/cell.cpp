#include "simulation/cell/cell.hpp"

#include "simulation/twin/effects.hpp"
#include "simulation/twin/scenarios.hpp"
#include "simulation/twin/traction.hpp"

#include <algorithm>
#include <cmath>
#include <mujoco/mujoco.h>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace fingertip::cell {
namespace {

constexpr double M = 1e-3;                    // m per mm
constexpr double CONTACT_s = 1e-3;            // time constant of a contact's normal force
constexpr double INERTIA = 0.25;              // per mass and half sizes squared: box 1/3, cylinder 1/4, ball 1/5
constexpr double LOSS_s = 5e-4;               // of the rubber's normal spring
constexpr double FREE_N_mm = 1.0;             // brings a free face back to its finger
constexpr double JUMPS_mm = 5.0;              // a finger that is so far off was put there
constexpr double RADIUS_mm = 4.0, AT_N = 4.0; // of contact, under that force
constexpr double SPIN = 3.0 * M_PI / 16.0;    // torque that spins a Hertz contact, per radius, friction and force
constexpr double FILTER_s = 1e-3;             // of a slide's speed
// Mean distance from the middle of a line or an area that is pressed evenly, over that of the ends or corners that MuJoCo has.
constexpr double EVENLY = 0.5;
// Stiffness about the normal, over that along the patch times the arm's square: of a patch pressed evenly and of a Hertz contact of rubber
// (Mindlin). The edge of a Hertz contact slips with every turn, so that nothing rings; its time constant is assumed.
constexpr double TWIST_EVEN = 1.4, TWIST_HERTZ = 2.9, TWIST_LOSS_s = 0.05;
constexpr double STABLE = 0.25;      // of what a step would take from the object's speed
constexpr double LEAST_SHARE = 0.02; // of the force: a point with less is not part of the patch
constexpr int MOTIONS = 8;           // six of the object, and each face along its normal
constexpr double PAD_mm = 6.0, TABLE_ROLLS = 10.0, AWAY_m = 10.0, APART_mm = 200.0;

double twist_arm_m(double force_N) { return SPIN * M * RADIUS_mm * std::cbrt(std::max(force_N, 0.05) / AT_N); }
double pad_half_x_mm() { return PAD_OVERHANG_mm + twin::outermost_mm(geometry.x_mm); }
double pad_half_y_mm() { return PAD_OVERHANG_mm + twin::outermost_mm(geometry.y_mm); }

struct Size {
  const char *geom;
  double x_mm, y_mm, z_mm; // half of it: along the grip's axis, level, upwards
};
Size size_of(const GraspScenario &grasp) {
  const double w = 0.5 * grasp.width_mm, h = 0.5 * grasp.height_mm, d = 0.5 * grasp.depth_mm;
  switch (grasp.shape) {
  case Shape::ball: return {"sphere", w, w, w};
  case Shape::egg: return {"ellipsoid", w, w, 1.3 * w};
  case Shape::box:
  case Shape::plate: return {"box", w, d, h};
  case Shape::lying: return {"cylinder", w, h, w};
  case Shape::upright:
  case Shape::cup: return {"cylinder", w, w, h};
  }
  return {"sphere", w, w, w};
}

std::string xml_of(const GraspScenario &grasp) {
  const Size size = size_of(grasp);
  const double x2 = size.x_mm * size.x_mm, y2 = size.y_mm * size.y_mm, z2 = size.z_mm * size.z_mm;
  const double turn = std::atan2(-std::cos(grasp.down_rad), -std::sin(grasp.down_rad));
  const double c = std::cos(turn), s = std::sin(turn);
  const double level_mm = c * grasp.place_mm.x - s * grasp.place_mm.y;
  const double up_mm = s * grasp.place_mm.x + c * grasp.place_mm.y;
  std::ostringstream xml;
  xml.precision(12);
  xml << "<mujoco><option timestep='" << Cell::STEP_s
      << "' cone='elliptic'><flag multiccd='enable' island='disable' autoreset='disable'/></option><default>"
         "<geom contype='0' conaffinity='0'/><pair solref='"
      << CONTACT_s << " 1' solimp='.95 .99 .0002'/></default><worldbody><geom name='table' type='plane' size='1 1 .1' pos='0 0 "
      << -M * size.z_mm << "'/>"
      << "<body name='object' pos='" << M * grasp.off_mm << " 0 0'><freejoint/><inertial pos='0 " << M * grasp.com_mm.x << " "
      << M * grasp.com_mm.y << "' mass='" << grasp.mass_kg << "' diaginertia='";
  for (const double mm2 : {y2 + z2, x2 + z2, x2 + y2}) {
    xml << grasp.mass_kg * INERTIA * M * M * mm2 << " ";
  }
  xml << "'/><geom name='thing' type='" << size.geom << "' size='" << M * size.x_mm << " ";
  if (std::string(size.geom) == "cylinder") {
    const bool lies = grasp.shape == Shape::lying;
    xml << M * (lies ? size.y_mm : size.z_mm) << "'" << (lies ? " euler='90 0 0'" : "");
  } else {
    xml << M * size.y_mm << " " << M * size.z_mm << "'";
  }
  xml << "/></body>";
  for (const int side : {-1, 1}) {
    xml << "<body gravcomp='1' pos='" << side * M * (0.5 * grasp.width_mm + PAD_mm) << " " << -M * level_mm << " " << -M * up_mm
        << "'><inertial pos='0 0 0' mass='" << Cell::FACE_kg << "' diaginertia='1e-6 1e-6 1e-6'/>"
        << "<joint type='slide' axis='" << -side << " 0 0'/><geom name='face" << (side > 0) << "' type='box' size='" << M * PAD_mm << " "
        << M * pad_half_x_mm() << " " << M * pad_half_y_mm() << "' euler='" << turn * 180.0 / M_PI << " 0 0'/></body>";
  }
  xml << "</worldbody><contact><pair geom1='thing' geom2='table' condim='6' friction='" << grasp.table_friction << " "
      << grasp.table_friction << " .001 " << M * TABLE_ROLLS << " " << M * TABLE_ROLLS << "'/>";
  for (const int side : {0, 1}) {
    xml << "<pair geom1='thing' geom2='face" << side << "' condim='1'/>";
  }
  xml << "</contact></mujoco>";
  return xml.str();
}

struct FreeModel {
  void operator()(mjModel *model) const { mj_deleteModel(model); }
  void operator()(mjData *data) const { mj_deleteData(data); }
};

std::unique_ptr<mjModel, FreeModel> compiled(const GraspScenario &grasp) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  mju_user_warning = [](const char *) {}; // World::step throws, and no file MUJOCO_LOG.TXT appears
  char why[500] = "";
  mjSpec *spec = mj_parseXMLString(xml_of(grasp).c_str(), nullptr, why, sizeof why);
  std::unique_ptr<mjModel, FreeModel> model(spec ? mj_compile(spec, nullptr) : nullptr);
  const std::string error = spec ? mjs_getError(spec) : why;
  mj_deleteSpec(spec);
  if (!model) {
    throw std::runtime_error("MuJoCo takes no such object: " + error);
  }
  return model;
}

class MujocoCell final : public Cell {
public:
  explicit MujocoCell(const GraspScenario &of) : grasp(of), model(compiled(of)), data(mj_makeData(model.get())) {
    table = mj_name2id(model.get(), mjOBJ_GEOM, "table");
    object = mj_name2id(model.get(), mjOBJ_BODY, "object");
    turn = std::atan2(-std::cos(of.down_rad), -std::sin(of.down_rad));
    table_m = model->geom_pos[3 * table + 2];
    for (std::size_t i = 0; i < pads.size(); i++) {
      pads[i].kind = of.pads[i];
      pads[i].gives_mm_N = 0.5 / FINGERS_N_mm + 0.5 / of.stiffness_N_mm;
      pads[i].face = mj_name2id(model.get(), mjOBJ_GEOM, i == 0 ? "face0" : "face1");
      pads[i].dof = model->body_dofadr[model->geom_bodyid[pads[i].face]];
      pads[i].strength = twin::relaxation_strengths(of.pads[i].relaxation);
    }
  }

  void run(double seconds, double width_mm, const GraspScenario::Inputs &inputs) override {
    for (due_s += seconds; due_s > 0.5 * STEP_s; due_s -= STEP_s) {
      step(width_mm, inputs);
    }
  }
  double force_N(std::size_t finger) const override { return pads[finger].force_N; }
  double force_at_N(double width_mm) const override {
    double force_N = 0.0;
    const double along_mm = data->xpos[3 * object] / M;
    for (std::size_t i = 0; i < pads.size(); i++) {
      const double pressed_mm = 0.5 * (grasp.width_mm - width_mm) + (i == 0 ? -along_mm : along_mm);
      force_N = std::max(force_N, elastic_N(pads[i], pressed_mm) - std::max(pads[i].elastic_N - pads[i].force_N, 0.0));
    }
    return force_N;
  }
  Vector load_N(std::size_t finger) const override { return pads[finger].load_N; }
  Vector way_mm() const override { return {data->xpos[3 * object + 1] / M, data->xpos[3 * object + 2] / M}; }
  double turned_rad() const override {
    const mjtNum *turned = &data->xquat[4 * object];
    return 2.0 * std::atan2(turned[1], turned[0]);
  }
  bool slips() const override { return pads[0].slides && pads[1].slides; }
  double slid_mm() const override { return all_slid_mm; }
  double friction(std::size_t finger) const override { return pads[finger].friction; }
  Patch patch(std::size_t finger) const override {
    const Pad &pad = pads[finger];
    Patch patch;
    if (pad.points.empty() || pad.force_N <= 0.0) {
      return patch;
    }
    // Along the object's own level axis, and across: extents, and the centre of pressure.
    const double turned = turned_rad(), c = std::cos(turned), s = std::sin(turned);
    double all_N = 0.0, u_mm = 0.0, v_mm = 0.0;
    double u_low = 1e9, u_high = -1e9, v_low = 1e9, v_high = -1e9;
    for (const Point &point : pad.points) {
      all_N += point.force_N;
    }
    for (const Point &point : pad.points) {
      if (point.force_N < LEAST_SHARE * all_N) {
        continue;
      }
      const double u = (c * point.level_m + s * point.up_m) / M, v = (c * point.up_m - s * point.level_m) / M;
      u_mm += point.force_N / all_N * u;
      v_mm += point.force_N / all_N * v;
      u_low = std::min(u_low, u), u_high = std::max(u_high, u);
      v_low = std::min(v_low, v), v_high = std::max(v_high, v);
    }
    const double mirror = finger == 0 ? 1.0 : -1.0;
    const double tc = std::cos(turn), ts = std::sin(turn);
    const auto in_own = [&](double level, double up) { return Vector{mirror * (tc * level + ts * up), tc * up - ts * level}; };
    const Vector at = in_own(c * u_mm - s * v_mm, s * u_mm + c * v_mm), pull = in_own(pad.load_N.x, pad.load_N.y);
    patch.force_N = pad.force_N;
    patch.x_mm = at.x;
    patch.y_mm = at.y;
    patch.angle_rad = mirror * (turned - turn);
    patch.pull_x_N = pull.x;
    patch.pull_y_N = pull.y;
    const double pull_N = std::hypot(pull.x, pull.y);
    patch.stuck_N = pad.slides ? 0.0 : twin::stuck_force_N(pad.force_N, pull_N, pad.friction);
    patch.length_mm = u_high - u_low;
    patch.width_mm = v_high - v_low;
    patch.off_length_mm = mirror * (u_mm - 0.5 * (u_low + u_high));
    patch.off_width_mm = v_mm - 0.5 * (v_low + v_high);
    return patch;
  }

private:
  struct Point {
    double level_m, up_m, force_N; // from the middle of the face
  };
  struct Pad {
    PadProperties kind;
    double gives_mm_N; // of finger and object
    int face, dof;
    std::array<double, 2> strength{}, follows_N{};
    double elastic_N = 0.0, force_N = 0.0, friction = 0.0;
    std::array<double, 3> pulled_m{}; // the rubber's face: level, upwards, turned at the arm of the patch
    Vector load_N, slide_mm_s;
    std::vector<Point> points;
    std::array<mjtNum, 3> middle_m{}; // of their force
    double arm_m = 0.0;
    bool slides = true;
  };

  double elastic_N(const Pad &pad, double pressed_mm) const {
    // pressed = (F / A)^(1/n) + gives F, by Newton's steps from above.
    double x = std::max(pressed_mm, 0.0);
    for (int i = 0; i < 20 && x > 0.0; i++) {
      const double force_N = pad.kind.at_1_mm_N * std::pow(x, grasp.exponent);
      const double step = (x + pad.gives_mm_N * force_N - pressed_mm) / (1.0 + pad.gives_mm_N * grasp.exponent * force_N / x);
      x -= step;
      if (std::abs(step) < 1e-9) {
        break;
      }
    }
    return pad.kind.at_1_mm_N * std::pow(std::max(x, 0.0), grasp.exponent);
  }

  void press(Pad &pad, double finger_mm, double finger_mm_s, bool jumps) {
    double &at_m = data->qpos[model->jnt_qposadr[model->dof_jntid[pad.dof]]];
    double &speed_m_s = data->qvel[pad.dof];
    if (std::abs(finger_mm - at_m / M) > JUMPS_mm || (jumps && finger_mm < at_m / M)) { // the object may be beside the middle
      at_m = M * finger_mm;
      speed_m_s = 0.0;
    }
    const double pressed_mm = finger_mm - at_m / M;
    pad.elastic_N = elastic_N(pad, pressed_mm);
    double loss_N = 0.0;
    for (std::size_t k = 0; k < pad.strength.size(); k++) {
      pad.follows_N[k] += STEP_s / twin::Pad::TIMES_s[k] * (pad.elastic_N - pad.follows_N[k]);
      loss_N += pad.strength[k] * pad.follows_N[k];
    }
    const double stiffness_N_m = pressed_mm > 0.0 ? grasp.exponent * pad.elastic_N / (M * pressed_mm) : 0.0;
    const double damping = grasp.rubber_N_s_mm / M + LOSS_s * stiffness_N_m;
    const double spring_N = pressed_mm > 0.0 ? std::clamp(pad.elastic_N - loss_N, 0.0, pad.elastic_N) : FREE_N_mm * pressed_mm;
    pad.force_N = pad.points.empty() ? 0.0 : std::max(spring_N, 0.0);
    data->qfrc_applied[pad.dof] = spring_N + damping * M * finger_mm_s;
    model->dof_damping[pad.dof] = damping;
  }

  // The rubber gives along the patch as springs do, until friction gives way: its limit for force and torque together is an ellipsoid.
  void rub(Pad &pad, double friction_share) {
    const double before = std::hypot(pad.slide_mm_s.x, pad.slide_mm_s.y);
    const double falls = std::exp(-std::pow(before / grasp.stribeck_mm_s, 2));
    pad.friction = friction_share * pad.kind.friction * (grasp.kinetic_share + (1.0 - grasp.kinetic_share) * falls);
    std::array<double, 3> pull_N{}, slide_m_s{};
    if (pad.points.empty()) {
      pad.pulled_m = {};
    } else {
      mjtNum moves[3 * MOTIONS], turns[3 * MOTIONS], speed[3], spin[3];
      mj_jac(model.get(), data.get(), moves, turns, pad.middle_m.data(), object);
      mju_mulMatVec(speed, moves, data->qvel, 3, MOTIONS);
      mju_mulMatVec(spin, turns, data->qvel, 3, MOTIONS);
      slide_m_s = {speed[1], speed[2], pad.arm_m * spin[0]};
      const double along_N_m = grasp.shear_N_mm / M * std::cbrt(std::max(pad.force_N, 0.05) / AT_N), along = grasp.rubber_N_s_mm / M;
      const double edge = std::pow(twist_arm_m(pad.force_N) / pad.arm_m, 2);
      std::array<double, 3> shear_N_m = {along_N_m, along_N_m, (TWIST_EVEN + edge * (TWIST_HERTZ - TWIST_EVEN)) * along_N_m};
      std::array<double, 3> damping = {along, along, along + edge * TWIST_LOSS_s * along_N_m};
      // Not stiffer than the steps of a light object can follow.
      const mjtNum *centre_m = &data->xipos[3 * object];
      const double inertia_kg_m2 = model->body_inertia[3 * object];
      const double apart2_m2 = std::pow(pad.middle_m[1] - centre_m[1], 2) + std::pow(pad.middle_m[2] - centre_m[2], 2);
      const double moved_kg = 1.0 / (1.0 / model->body_mass[object] + apart2_m2 / inertia_kg_m2);
      for (std::size_t k = 0; k < 3; k++) {
        const double most = STABLE * (k < 2 ? moved_kg : inertia_kg_m2 / (pad.arm_m * pad.arm_m)) / STEP_s;
        shear_N_m[k] = std::min(shear_N_m[k], most / STEP_s);
        damping[k] = std::min(damping[k], most);
      }
      const double most_N = pad.friction * pad.force_N;
      const auto limit = [&] { mju_scl3(pull_N.data(), pull_N.data(), std::min(1.0, most_N / std::max(mju_norm3(pull_N.data()), 1e-9))); };
      for (std::size_t k = 0; k < 3; k++) {
        pull_N[k] = shear_N_m[k] * (pad.pulled_m[k] + STEP_s * slide_m_s[k]);
      }
      limit(); // the springs decide where it slides to
      for (std::size_t k = 0; k < 3; k++) {
        const double gives_m_s = (pull_N[k] / shear_N_m[k] - pad.pulled_m[k]) / STEP_s;
        pad.pulled_m[k] += STEP_s * gives_m_s;
        slide_m_s[k] -= gives_m_s;
        pull_N[k] += damping[k] * gives_m_s;
      }
      limit();
      const mjtNum force_N[3] = {0.0, -pull_N[0], -pull_N[1]}, torque_N_m[3] = {-pad.arm_m * pull_N[2], 0.0, 0.0};
      mj_applyFT(model.get(), data.get(), force_N, torque_N_m, pad.middle_m.data(), object, data->qfrc_applied);
    }
    pad.load_N = {pull_N[0], pull_N[1]};
    const double share = STEP_s / FILTER_s;
    pad.slide_mm_s.x += share * (slide_m_s[0] / M - pad.slide_mm_s.x);
    pad.slide_mm_s.y += share * (slide_m_s[1] / M - pad.slide_mm_s.y);
    pad.slides = pad.points.empty() || std::hypot(pad.slide_mm_s.x, pad.slide_mm_s.y) > SLIDES_mm_s;
  }

  // Where it touches.
  void find_contacts(Pad &pad) {
    pad.points.clear();
    const mjtNum *face_m = &data->geom_xpos[3 * pad.face];
    double sum_N = 0.0, apart_m = 0.0;
    std::array<mjtNum, 3> moment{};
    for (int i = 0; i < data->ncon; i++) {
      const mjContact &contact = data->contact[i];
      if (contact.geom[0] != pad.face && contact.geom[1] != pad.face) {
        continue;
      }
      mjtNum wrench[6];
      mj_contactForce(model.get(), data.get(), i, wrench);
      const double force_N = std::max(wrench[0], 1e-9);
      sum_N += force_N;
      mju_addToScl3(moment.data(), contact.pos, force_N);
      // On the rubber, which has gone along.
      pad.points.push_back({contact.pos[1] - face_m[1] - pad.pulled_m[0], contact.pos[2] - face_m[2] - pad.pulled_m[1], force_N});
    }
    if (pad.points.empty()) {
      return;
    }
    mju_scl3(pad.middle_m.data(), moment.data(), 1.0 / sum_N);
    const double level_m = pad.middle_m[1] - face_m[1] - pad.pulled_m[0], up_m = pad.middle_m[2] - face_m[2] - pad.pulled_m[1];
    for (const Point &point : pad.points) {
      apart_m += point.force_N / sum_N * std::hypot(point.level_m - level_m, point.up_m - up_m);
    }
    pad.arm_m = std::hypot(twist_arm_m(pad.force_N), EVENLY * apart_m);
  }

  void step(double width_mm, const GraspScenario::Inputs &inputs) {
    const double finger_mm = 0.5 * (grasp.width_mm - width_mm);
    const bool jumps = std::abs(finger_mm - finger_before_mm) > JUMPS_mm;
    const double finger_mm_s = jumps ? 0.0 : (finger_mm - finger_before_mm) / STEP_s;
    finger_before_mm = finger_mm;
    if (finger_mm < -APART_mm) { // nothing is between the fingers
      for (Pad &pad : pads) {
        pad.points.clear();
        pad.force_N = 0.0;
        pad.load_N = {};
      }
      return;
    }
    mju_zero(data->qfrc_applied, MOTIONS);
    for (Pad &pad : pads) {
      press(pad, finger_mm, finger_mm_s, jumps);
      rub(pad, inputs.friction_share);
    }
    const double heavier = inputs.mass_kg / model->body_mass[object];
    model->body_mass[object] *= heavier;
    for (int k = 0; k < 3; k++) {
      model->body_inertia[3 * object + k] *= heavier;
    }
    model->opt.gravity[1] = -inputs.hand_m_s2.x;
    model->opt.gravity[2] = -GRAVITY_m_s2 - inputs.hand_m_s2.y;
    data->xfrc_applied[6 * object + 1] = inputs.push_N.x;
    data->xfrc_applied[6 * object + 2] = inputs.push_N.y;
    model->geom_pos[3 * table + 2] = table_m - (inputs.table ? M * inputs.lifted_mm : AWAY_m);
    mj_step(model.get(), data.get());
    const mjWarningStat *of = data->warning;
    if (of[mjWARN_BADQPOS].number + of[mjWARN_BADQVEL].number + of[mjWARN_BADQACC].number > 0) {
      throw std::runtime_error("MuJoCo's object diverged");
    }
    for (Pad &pad : pads) {
      find_contacts(pad);
    }
    if (slips()) {
      const Vector &one = pads[0].slide_mm_s, &other = pads[1].slide_mm_s;
      all_slid_mm += 0.5 * STEP_s * (std::hypot(one.x, one.y) + std::hypot(other.x, other.y));
    }
  }

  const GraspScenario &grasp;
  std::unique_ptr<mjModel, FreeModel> model;
  std::unique_ptr<mjData, FreeModel> data;
  std::array<Pad, 2> pads;
  int table, object;
  double turn, table_m; // turn: from the hand's x to fingertip 0's
  double due_s = 0.0, finger_before_mm = 1e9, all_slid_mm = 0.0;
};

} // namespace

std::unique_ptr<Cell> make_cell(const GraspScenario &grasp) { return std::make_unique<MujocoCell>(grasp); }

} // namespace fingertip::cell
