#include "report/measure/sessions.hpp"

extern "C" {
#include "config/geometry.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::measure {
namespace {

constexpr double AMBIENT_Pa = 101325.0;
constexpr std::uint16_t OSR = 1024;
constexpr double FRAMES_PER_s = 200.0;           // of the slower board at this OSR
constexpr double DOWN_s = 0.3, TAP_DOWN_s = 0.1; // from first touch to the full force
constexpr double SETTLED_BEGIN_s = 0.5, SETTLED_END_s = 1.0, WEIGHT_DOWN_s = 2.0, PAUSE_s = 1.5;
constexpr int SETTLED_STEPS = 5;
constexpr double TAP_READ_s = 0.15;

constexpr double OFFSET_Pa = 500.0, DRIFT_Pa_s = 100.0;
constexpr double CLUSTER_RADIUS_mm = 7.0;
constexpr std::size_t TOO_FEW = 6;
constexpr double AIM_SD_mm = 3.0;

enum Stream : std::uint64_t { SESSION = 302, NOISE, ERRORS };

twin::EffectValues effects_of(const PadOptions &options) {
  twin::EffectValues values;
  if (options.gain_percent > 0.0) {
    values["gain"] = options.gain_percent;
  }
  if (options.memory_percent > 0.0) {
    values["memory"] = options.memory_percent;
  }
  values["places"] = options.misplaced_mm;
  values["dip"] = options.dip_percent;
  values["widths"] = options.widths_percent;
  return values;
}

double noise_of_one_Pa() { return ms58xx_find_osr(OSR)->noise_Pa_q10 / 1024.0; }

const twin::Indenter &lying_cylinder() {
  static const twin::Indenter cylinder{"cylinder6x12", "", twin::Indenter::Shape::roller, 6, 12, 0, 0.4, 0};
  return cylinder;
}

} // namespace

calibrating::Array session_array() {
  calibrating::Array array;
  array.pitch_mm = static_cast<double>(geometry.pitch_mm);
  for (std::size_t k = 0; k < geometry.sensor_count; k++) {
    array.x_mm.push_back(static_cast<double>(geometry.x_mm[k]));
    array.y_mm.push_back(static_cast<double>(geometry.y_mm[k]));
  }
  return array;
}

SessionPad::SessionPad(const PadOptions &options, double layer_mm, std::uint64_t seed)
    : base_Pa_(geometry.sensor_count), reported_Pa_(geometry.sensor_count), options_(options), layer_mm_(layer_mm), seed_(seed),
      pad_(effects_of(options), geometry.sensor_count, layer_mm, AMBIENT_Pa, seed), noise_(seed, NOISE, 0) {
  for (std::size_t k = 0; k < geometry.sensor_count; k++) {
    x_mm_.push_back(static_cast<double>(geometry.x_mm[k]) + pad_.seats()[k].dx_mm);
    y_mm_.push_back(static_cast<double>(geometry.y_mm[k]) + pad_.seats()[k].dy_mm);
  }
  report(0.0, 0.0);
}

void SessionPad::report(double after_s, double share) {
  t_s_ += after_s;
  std::vector<double> base_Pa = base_Pa_;
  for (double &pressure : base_Pa) {
    pressure *= share;
  }
  pad_.report(t_s_, base_Pa, reported_Pa_);
}

void SessionPad::aim(const twin::ContactTable &object, double force_N, double x_mm, double y_mm, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  for (std::size_t k = 0; k < x_mm_.size(); k++) {
    const double width = pad_.seats()[k].width;
    const double dx = (x_mm_[k] - x_mm) / width, dy = (y_mm_[k] - y_mm) / width;
    base_Pa_[k] = object.base_pressure_Pa(force_N, c * dx + s * dy, c * dy - s * dx, pad_.dip_share());
  }
  if (options_.block) {
    const twin::BlockTable::Load load{force_N, 0.0, 0.0, object.contact_radius_mm(force_N)};
    for (std::size_t k = 0; k < base_Pa_.size(); k++) {
      base_Pa_[k] += options_.block->added_Pa(k, load, x_mm, y_mm);
    }
  }
}

calibrating::Placement SessionPad::place(const twin::ContactTable &foot, double force_N, double x_mm, double y_mm, double angle_rad) {
  aim(foot, force_N, x_mm, y_mm, angle_rad);
  report(PAUSE_s, 0.0);
  report(DOWN_s, 1.0);
  calibrating::Placement placement;
  placement.t_s = t_s_ + 0.5 * (SETTLED_BEGIN_s + SETTLED_END_s);
  placement.usable = first_sensors(static_cast<unsigned>(x_mm_.size()));
  placement.noise_Pa = noise_of_one_Pa() / std::sqrt(FRAMES_PER_s * (SETTLED_END_s - SETTLED_BEGIN_s));
  placement.reading_Pa.assign(x_mm_.size(), 0.0);
  double first_Pa = 0.0, last_Pa = 0.0;
  for (int i = 0; i < SETTLED_STEPS; i++) {
    report(i == 0 ? SETTLED_BEGIN_s : (SETTLED_END_s - SETTLED_BEGIN_s) / (SETTLED_STEPS - 1), 1.0);
    for (std::size_t k = 0; k < x_mm_.size(); k++) {
      placement.reading_Pa[k] += reported_Pa_[k] / SETTLED_STEPS;
      first_Pa += i == 0 ? reported_Pa_[k] : 0.0;
      last_Pa += i + 1 == SETTLED_STEPS ? reported_Pa_[k] : 0.0;
    }
  }
  placement.fading = 2.0 * (first_Pa - last_Pa) / (first_Pa + last_Pa);
  for (double &reading : placement.reading_Pa) {
    reading += placement.noise_Pa * noise_.normal();
  }
  report(WEIGHT_DOWN_s - SETTLED_END_s, 1.0);
  report(DOWN_s, 0.0);
  return placement;
}

std::vector<double> SessionPad::tap(const twin::ContactTable &object, double force_N, double x_mm, double y_mm) {
  aim(object, force_N, x_mm, y_mm, 0.0);
  report(PAUSE_s, 0.0);
  report(TAP_DOWN_s, 1.0);
  report(TAP_READ_s, 1.0);
  std::vector<double> reading_Pa = reported_Pa_;
  for (double &reading : reading_Pa) {
    reading += noise_of_one_Pa() * noise_.normal();
  }
  report(TAP_DOWN_s, 0.0);
  return reading_Pa;
}

std::vector<double> SessionPad::settled_gains() const {
  SessionPad like(options_, layer_mm_, seed_);
  constexpr double SOME_Pa = 10000.0;
  std::fill(like.base_Pa_.begin(), like.base_Pa_.end(), SOME_Pa);
  like.report(PAUSE_s, 0.0);
  like.report(DOWN_s, 1.0);
  like.report(0.5 * (SETTLED_BEGIN_s + SETTLED_END_s), 1.0);
  double mean = 0.0;
  for (double reading : like.reported_Pa_) {
    mean += reading / double(like.reported_Pa_.size());
  }
  std::vector<double> gains;
  for (double reading : like.reported_Pa_) {
    gains.push_back(reading / mean);
  }
  return gains;
}

const char *name_of(SessionKind kind) {
  static const char *const names[] = {"good", "elongated", "offsets", "one_end", "cluster", "drift", "too_few", "weights"};
  return names[static_cast<int>(kind)];
}

Feet::Feet(double layer_thickness_mm, const std::filesystem::path &cache)
    : layer_mm(layer_thickness_mm),
      round(twin::ContactTable::load_or_build(twin::indenter("sphere15"), twin::silicone(layer_thickness_mm), cache)),
      lying(twin::ContactTable::load_or_build(lying_cylinder(), twin::silicone(layer_thickness_mm), cache)) {}

Session::Session(const Feet &feet, SessionKind kind, std::uint64_t seed, std::size_t planned)
    : feet_(feet), kind_(kind), random_(seed, SESSION, static_cast<std::uint64_t>(kind)),
      planned_(kind == SessionKind::too_few ? TOO_FEW : planned), variant_(seed % 2 != 0) {
  const calibrating::Array array = session_array();
  middle_x_mm_ = random_.uniform(array.x_mm.front(), array.x_mm.back());
  middle_y_mm_ = random_.uniform(array.y_mm.front(), array.y_mm.back());
  angle_rad_ = random_.uniform(0.0, M_PI);
  Random errors(seed, ERRORS, static_cast<std::uint64_t>(kind));
  for (std::size_t k = 0; k < array.sensors(); k++) {
    const double sign = errors.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    zero_Pa_.push_back(kind != SessionKind::offsets ? 0.0 : variant_ ? OFFSET_Pa : sign * OFFSET_Pa);
    drift_Pa_s_.push_back(kind == SessionKind::drift ? sign * DRIFT_Pa_s : 0.0);
  }
}

std::optional<calibrating::Placement> Session::next(SessionPad &pad, std::optional<calibrating::Wanted> wanted) {
  if (made_ >= planned_) {
    return std::nullopt;
  }
  const calibrating::Array array = session_array();
  const double end_x = array.x_mm.back(), end_y = array.y_mm.back();
  double x_mm = random_.uniform(-end_x, end_x);
  double y_mm = random_.uniform(-end_y, end_y);
  if (kind_ == SessionKind::good && wanted) {
    x_mm = wanted->x_mm + AIM_SD_mm * random_.normal();
    y_mm = wanted->y_mm + AIM_SD_mm * random_.normal();
  } else if (kind_ == SessionKind::one_end) {
    y_mm = random_.uniform(end_y / 3.0, end_y);
  } else if (kind_ == SessionKind::cluster) {
    const double radius = CLUSTER_RADIUS_mm * std::sqrt(random_.uniform(0.0, 1.0));
    const double direction = random_.uniform(0.0, 2.0 * M_PI);
    x_mm = middle_x_mm_ + radius * std::cos(direction);
    y_mm = middle_y_mm_ + radius * std::sin(direction);
  }
  double force_N = WEIGHT_N;
  if (kind_ == SessionKind::weights) {
    force_N = variant_ ? random_.uniform(1.5, 4.5) : made_ % 2 == 0 ? 3.0 : 4.0;
  }
  const bool lying = kind_ == SessionKind::elongated;
  const double angle = variant_ ? angle_rad_ : random_.uniform(0.0, M_PI);
  calibrating::Placement placement = pad.place(lying ? feet_.lying : feet_.round, force_N, x_mm, y_mm, lying ? angle : 0.0);
  for (std::size_t k = 0; k < placement.reading_Pa.size(); k++) {
    placement.reading_Pa[k] += zero_Pa_[k] + drift_Pa_s_[k] * calibrating::RESTED_BEFORE_s;
    placement.rest_Pa.push_back(drift_Pa_s_[k] * placement.t_s);
  }
  made_++;
  return placement;
}

} // namespace fingertip::measure
