#include "simulation/cell/validated.hpp"

#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"
#include "simulation/cell/place.hpp"
#include "simulation/cell/simulations.hpp"
#include "simulation/twin/scenarios.hpp"
#include "tool/calibration/solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { FAULT = 871, HAND = 872, SHEET = 873 };

constexpr double THIN_mm = 8.0, TILT_SHARE = 0.09, LOOSE_SD = 0.2;
constexpr double DRIFT_MIN_Pa_min = 60.0, DRIFT_MAX_Pa_min = 180.0;
constexpr std::size_t DRIFTING = 3;
constexpr double BEGIN_s = 2.0, RESTS_s = 3.0, MOVES_s = 0.15, PRESSES_s = 2.0;
constexpr double PULLS_AFTER_s = 3.0, PULLS_s = 0.5, PULLED_s = 3.0;
constexpr double FRICTION = 0.8;   // of the ball on rubber
constexpr double AIM_SD_deg = 2.0; // of the thread
constexpr double SPARE_s = 1.0;    // beyond what a step asks for
// The print lies on the pad so far off, sd each way.
constexpr double SHEET_SD_mm = 0.7, SHEET_SD_rad = 0.02;
constexpr double SETTLED_Pa = 10000.0, SETTLED_s = 0.75;

// As the template has them, in their order: protocol.py.
constexpr double EMPTY_s = 60.0, HOLD_s = 30.0, REST_s = 30.0;
constexpr std::size_t TURNS = 2, STRIDE_MIN = 7;

struct Mark {
  double x_mm, y_mm;
};

// Each sensor, and the middle of each cell of four: columns half a pitch apart, that of sensors and that of cells in turn.
std::vector<Mark> template_marks() {
  const double pitch_mm = static_cast<double>(geometry.pitch_mm);
  const int across = static_cast<int>(std::lround(2.0 * twin::outermost_mm(geometry.x_mm) / pitch_mm));
  const int along = static_cast<int>(std::lround(2.0 * twin::outermost_mm(geometry.y_mm) / pitch_mm));
  std::vector<Mark> sorted, marks;
  for (int column = -across; column <= across; column++) {
    for (int row = along - std::abs(across - column) % 2; row >= -along; row -= 2) {
      sorted.push_back({0.5 * pitch_mm * column, 0.5 * pitch_mm * row});
    }
  }
  std::size_t stride = STRIDE_MIN;
  while (std::gcd(stride, sorted.size()) > 1) {
    stride++;
  }
  for (std::size_t i = 0; i < sorted.size(); i++) {
    marks.push_back(sorted[i * stride % sorted.size()]);
  }
  return marks;
}

std::string text_of(double value) { return shortest(static_cast<float>(value)); }

} // namespace

double smooth(double share) { return 0.5 - 0.5 * std::cos(M_PI * std::clamp(share, 0.0, 1.0)); }

twin::EffectValues usual_effects() { return twin::parse_effects("gain,memory,aftereffect,drift,places,dip,widths"); }

const std::vector<std::string> &pad_fault_names() {
  static const std::vector<std::string> names = {"none",      "dead_sensor", "loose_sensor", "tilted_skin",
                                                 "thin_skin", "drift",       "wrong_weight", "swapped_wires"};
  return names;
}

ValidatedPad::ValidatedPad(const ValidatedOptions &options)
    : options_(options), layer_(twin::silicone(options.fault == PadFault::thin_skin ? THIN_mm : LAYER_mm)),
      table_(twin::ContactTable::load_or_build(twin::indenter(PRESS_FACE), layer_, options.cache)),
      weight_N_(calibrating::GRAVITY_N_PER_g * options.weight_g), rubber_(options.effects, SENSORS, LAYER_mm, AIR_Pa, options.seed),
      deaf_(SENSORS, 1.0), drift_Pa_s_(SENSORS, 0.0), absent_(SENSORS, false), before_Pa_(SENSORS, 0.0), after_Pa_(SENSORS, 0.0) {
  for (std::size_t k = 0; k < SENSORS; k++) {
    x_mm_.push_back(static_cast<double>(geometry.x_mm[k]) + rubber_.seats()[k].dx_mm);
    y_mm_.push_back(static_cast<double>(geometry.y_mm[k]) + rubber_.seats()[k].dy_mm);
    wire_.push_back(k);
  }
  twin::Pad same(options.effects, SENSORS, LAYER_mm, AIR_Pa, options.seed);
  std::vector<double> settled(SENSORS, 0.0);
  const std::vector<double> nothing(SENSORS, 0.0), all(SENSORS, SETTLED_Pa);
  same.report(0.0, nothing, settled);
  same.report(RESTS_s, nothing, settled);
  same.report(RESTS_s + MOVES_s, all, settled);
  same.report(RESTS_s + MOVES_s + SETTLED_s, all, settled);
  const double sum = std::accumulate(settled.begin(), settled.end(), 0.0);
  for (double reading : settled) {
    gains_.push_back(reading * double(SENSORS) / sum);
  }
  choose_fault();
  if (options_.pulling.weight_g > 0.0) {
    traction_.emplace(table_, layer_);
  }
  draw_plan();
  rubber_.report(0.0, nothing, after_Pa_);
  before_Pa_ = after_Pa_;
}

void ValidatedPad::choose_fault() {
  Random random(options_.seed, FAULT, 0);
  const auto any = [&] { return std::min(static_cast<std::size_t>(random.uniform(0.0, 1.0) * static_cast<double>(SENSORS)), SENSORS - 1); };
  const double sign = random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  switch (options_.fault) {
  case PadFault::dead_sensor:
    faulty_ = {any()};
    deaf_[faulty_[0]] = 0.0;
    absent_[faulty_[0]] = options_.seed % 2 == 1;
    break;
  case PadFault::loose_sensor: faulty_ = {any()}; break;
  case PadFault::tilted_skin: (random.uniform(0.0, 1.0) < 0.5 ? tilt_x_ : tilt_y_) = sign * TILT_SHARE; break;
  case PadFault::drift:
    while (faulty_.size() < DRIFTING) {
      const std::size_t k = any();
      if (std::find(faulty_.begin(), faulty_.end(), k) == faulty_.end()) {
        faulty_.push_back(k);
        drift_Pa_s_[k] = (random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0) * random.uniform(DRIFT_MIN_Pa_min, DRIFT_MAX_Pa_min) / 60.0;
      }
    }
    break;
  case PadFault::wrong_weight: weight_N_ *= sign < 0.0 ? 2.0 / 3.0 : 1.5; break;
  case PadFault::swapped_wires:
    faulty_ = {any(), any()};
    while (faulty_[1] == faulty_[0]) {
      faulty_[1] = any();
    }
    std::swap(wire_[faulty_[0]], wire_[faulty_[1]]);
    std::swap(gains_[faulty_[0]], gains_[faulty_[1]]);
    break;
  case PadFault::none:
  case PadFault::thin_skin: break;
  }
  std::sort(faulty_.begin(), faulty_.end());
}

// Of rubber that is thicker by this factor the response is wider by it, and lower by its square.
double ValidatedPad::width_at(double x_mm, double y_mm) const {
  return 1.0 + tilt_x_ * x_mm / twin::outermost_mm(geometry.x_mm) - tilt_y_ * y_mm / twin::outermost_mm(geometry.y_mm);
}

std::vector<double> ValidatedPad::base_Pa(double x_mm, double y_mm) const {
  const double width = width_at(x_mm, y_mm);
  std::vector<double> base(SENSORS);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double own = width * rubber_.seats()[k].width;
    base[k] = table_.base_pressure_Pa(weight_N_, (x_mm_[k] - x_mm) / own, (y_mm_[k] - y_mm) / own, rubber_.dip_share()) / (width * width);
  }
  return base;
}

// Of a sphere on a half-space under a load that rises to this: Mindlin, "Compliance of elastic bodies in contact", J. Appl. Mech. 16, 1949.
double ValidatedPad::way_mm(double pull_N) const {
  const double shear_modulus_MPa = 1e-6 * layer_.youngs_modulus_Pa / (2.0 * (1.0 + layer_.poisson));
  const double slide_mm =
      3.0 * (2.0 - layer_.poisson) * FRICTION * weight_N_ / (16.0 * shear_modulus_MPa * table_.contact_radius_mm(weight_N_));
  return slide_mm * (1.0 - std::pow(1.0 - pull_N / (FRICTION * weight_N_), 2.0 / 3.0));
}

std::vector<double> ValidatedPad::pulled_Pa(double x_mm, double y_mm, const TruePull &pull) const {
  const double angle_rad = pull.toward_deg * M_PI / 180.0;
  const double along_x = std::cos(angle_rad), along_y = std::sin(angle_rad);
  const double at_x_mm = x_mm + pull.way_mm * along_x, at_y_mm = y_mm + pull.way_mm * along_y;
  const double tilts_mm = options_.pulling.height_mm * pull.pull_N / weight_N_;
  std::vector<double> base = base_Pa(at_x_mm + tilts_mm * along_x, at_y_mm + tilts_mm * along_y);
  const double width = width_at(at_x_mm, at_y_mm);
  const twin::TractionLoad load{weight_N_, twin::stuck_force_N(weight_N_, pull.pull_N, FRICTION), pull.pull_N * along_x,
                                pull.pull_N * along_y};
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double own = width * rubber_.seats()[k].width;
    base[k] += traction_->base_pressure_Pa(load, (x_mm_[k] - at_x_mm) / own, (y_mm_[k] - at_y_mm) / own) / (width * width);
  }
  return base;
}

void ValidatedPad::draw_plan() {
  Random sheet(options_.seed, SHEET, 0), hand(options_.seed, HAND, 0);
  const double shift_x = SHEET_SD_mm * sheet.normal(), shift_y = SHEET_SD_mm * sheet.normal();
  const double turn = SHEET_SD_rad * sheet.normal();
  double t_s = BEGIN_s;
  const auto begin = [&](const std::string &step) { plan_.emplace_back(t_s, "validate: " + step); };
  const auto touch = [&](double x_mm, double y_mm, double rests_s) {
    t_s += RESTS_s;
    Touch made{t_s, rests_s, base_Pa(x_mm, y_mm), std::vector<double>(SENSORS, 1.0)};
    if (options_.fault == PadFault::loose_sensor) {
      made.share[faulty_[0]] = std::max(1.0 + LOOSE_SD * hand.normal(), 0.1);
    }
    touches_.push_back(std::move(made));
    t_s += MOVES_s + rests_s;
  };
  begin("begin weight_g=" + text_of(options_.weight_g) + " skin_mm=" + text_of(LAYER_mm));
  begin("empty");
  t_s += EMPTY_s + SPARE_s;
  const std::vector<Mark> marks = template_marks();
  for (std::size_t i = 0; i < TURNS * marks.size(); i++) {
    const Mark &mark = marks[i % marks.size()];
    begin("press mark=" + std::to_string(i % marks.size() + 1) + " x_mm=" + text_of(mark.x_mm) + " y_mm=" + text_of(mark.y_mm));
    const double x = mark.x_mm + options_.hand_sd_mm * hand.normal();
    const double y = mark.y_mm + options_.hand_sd_mm * hand.normal();
    truth_.push_back({std::cos(turn) * x - std::sin(turn) * y + shift_x, std::sin(turn) * x + std::cos(turn) * y + shift_y, weight_N_});
    touch(truth_.back().x_mm, truth_.back().y_mm, PRESSES_s);
    t_s += MOVES_s;
  }
  begin("hold");
  touch(options_.hand_sd_mm * hand.normal(), options_.hand_sd_mm * hand.normal(), HOLD_s + SPARE_s);
  begin("rest"); // with the lift
  t_s += MOVES_s + REST_s + SPARE_s;
  const double pull_N = calibrating::GRAVITY_N_PER_g * options_.pulling.weight_g;
  for (double toward_deg : {0.0, 90.0, 180.0, 270.0}) {
    if (!(pull_N > 0.0)) {
      break;
    }
    begin("pull toward_deg=" + text_of(toward_deg) + " weight_g=" + text_of(options_.pulling.weight_g) +
          " height_mm=" + text_of(options_.pulling.height_mm));
    true_pulls_.push_back({toward_deg + AIM_SD_deg * hand.normal(), pull_N, weight_N_, way_mm(pull_N)});
    const double x_mm = options_.hand_sd_mm * hand.normal();
    const double y_mm = options_.hand_sd_mm * hand.normal();
    touch(x_mm, y_mm, PULLS_AFTER_s + PULLS_s + PULLED_s);
    touches_.back().pulled_Pa = pulled_Pa(x_mm, y_mm, true_pulls_.back());
    t_s += MOVES_s;
  }
  begin("end");
}

void ValidatedPad::step() {
  before_Pa_ = after_Pa_;
  const double t_s = STEP_s * double(++steps_);
  const auto end_s = [&](const Touch &touch) { return touch.begin_s + 2.0 * MOVES_s + touch.rests_s; };
  while (touch_ < touches_.size() && t_s > end_s(touches_[touch_])) {
    touch_++;
  }
  std::vector<double> base(SENSORS, 0.0);
  if (touch_ < touches_.size() && t_s > touches_[touch_].begin_s) {
    const Touch &touch = touches_[touch_];
    const double since_s = t_s - touch.begin_s;
    const double share = smooth(since_s / MOVES_s) - smooth((since_s - MOVES_s - touch.rests_s) / MOVES_s);
    const double pulled = touch.pulled_Pa.empty() ? 0.0 : smooth((since_s - MOVES_s - PULLS_AFTER_s) / PULLS_s);
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double base_Pa = touch.base_Pa[k] + (pulled > 0.0 ? pulled * (touch.pulled_Pa[k] - touch.base_Pa[k]) : 0.0);
      base[k] = share * touch.share[k] * deaf_[k] * base_Pa;
    }
  }
  rubber_.report(t_s, base, after_Pa_);
  for (std::size_t k = 0; k < SENSORS; k++) {
    after_Pa_[k] += drift_Pa_s_[k] * t_s;
  }
}

double ValidatedPad::pressure_Pa(std::size_t sensor, double t_s) {
  while (STEP_s * double(steps_) < t_s) {
    step();
  }
  const double part = std::clamp(double(steps_) - t_s / STEP_s, 0.0, 1.0);
  const std::size_t k = wire_[sensor];
  return part * before_Pa_[k] + (1.0 - part) * after_Pa_[k];
}

} // namespace fingertip::cell
