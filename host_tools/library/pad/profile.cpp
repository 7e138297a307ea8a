#include "library/pad/profile.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/layer.hpp"

extern "C" {
#include "config/geometry.h"
#include "fit/fit.h"
}

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::pad {

namespace {

constexpr double POISSON = 0.49; // of silicone, as library/pad/layer.hpp has it

// Waves over which the sums are fitted: T falls as H exp(-H), so nothing is left at the end. Half
// the step changes no value by 1e-6.
constexpr double H_STEP = 0.005;
constexpr int H_COUNT = 4000;

// sum strength_j exp(-(H sd_j)^2 / 2), lengths in thicknesses: strengths first, then the sds.
using Sum = Eigen::VectorXd;

double wave_number(int i) { return H_STEP * (i + 0.5); }

double gaussian(const Sum &sum, Eigen::Index term, double H) {
  const double sd = sum[sum.size() / 2 + term];
  return std::exp(-0.5 * H * H * sd * sd);
}

// Levenberg-Marquardt of weight_i (target_i - order_i sum(H_i)), from rising widths.
struct Waves {
  Eigen::VectorXd target, order, weight;
};

Eigen::VectorXd residual(const Waves &waves, const Sum &sum) {
  Eigen::VectorXd r(H_COUNT);
  for (int i = 0; i < H_COUNT; i++) {
    double model = 0;
    for (Eigen::Index j = 0; j < sum.size() / 2; j++) {
      model += sum[j] * gaussian(sum, j, wave_number(i));
    }
    r[i] = waves.weight[i] * (waves.target[i] - waves.order[i] * model);
  }
  return r;
}

Eigen::MatrixXd jacobian(const Waves &waves, const Sum &sum) {
  const Eigen::Index terms = sum.size() / 2;
  Eigen::MatrixXd J(H_COUNT, sum.size());
  for (int i = 0; i < H_COUNT; i++) {
    const double H = wave_number(i), scale = -waves.weight[i] * waves.order[i];
    for (Eigen::Index j = 0; j < terms; j++) {
      J(i, j) = scale * gaussian(sum, j, H);
      J(i, terms + j) = -J(i, j) * sum[j] * H * H * sum[terms + j];
    }
  }
  return J;
}

Sum fitted(const Waves &waves, Sum sum) {
  constexpr int MOST_STEPS = 500; // it takes some forty
  constexpr double SETTLED = 1e-10;
  double damping = 1e-3;
  Eigen::VectorXd r = residual(waves, sum);
  for (int step = 0; step < MOST_STEPS; step++) {
    const Eigen::MatrixXd J = jacobian(waves, sum);
    Eigen::MatrixXd normal = J.transpose() * J;
    normal.diagonal() *= 1 + damping;
    const Sum change = normal.ldlt().solve(-J.transpose() * r);
    const Sum moved = sum + change;
    const Eigen::VectorXd r_moved = residual(waves, moved);
    if (r_moved.squaredNorm() <= r.squaredNorm()) {
      sum = moved;
      r = r_moved;
      damping *= 0.3;
      if (change.norm() < SETTLED) {
        break;
      }
    } else {
      damping *= 5;
    }
  }
  return sum;
}

Waves normal_waves() {
  Waves waves{Eigen::VectorXd(H_COUNT), Eigen::VectorXd::Ones(H_COUNT), Eigen::VectorXd(H_COUNT)};
  for (int i = 0; i < H_COUNT; i++) {
    waves.target[i] = twin::base_transfer(wave_number(i), POISSON);
    waves.weight[i] = std::sqrt(wave_number(i));
  }
  return waves;
}

Waves tangential_waves() {
  Waves waves = normal_waves();
  for (int i = 0; i < H_COUNT; i++) {
    waves.target[i] = twin::tangential_transfer(wave_number(i), POISSON);
    waves.order[i] = wave_number(i);
  }
  return waves;
}

// Starts with a term at each of the widths that the field has: the nearest to the contact, and
// wider by turns of two.
Sum start(int terms) {
  Sum sum(2 * terms);
  for (int j = 0; j < terms; j++) {
    sum[j] = 1.0 / terms;
    sum[terms + j] = 0.3 * std::pow(2.0, j);
  }
  return sum;
}

Sum normal_sum(const pad_profile &profile) {
  Sum sum(2 * PAD_NORMAL_TERMS);
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    sum[j] = static_cast<double>(profile.normal[j].share);
    sum[PAD_NORMAL_TERMS + j] = static_cast<double>(profile.normal[j].sd_mm / profile.thickness_mm);
  }
  return sum;
}

Sum tangential_sum(const pad_profile &profile) {
  Sum sum(2 * PAD_TANGENTIAL_TERMS);
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    sum[j] = static_cast<double>(profile.tangential[j].moment_mm / profile.thickness_mm);
    sum[PAD_TANGENTIAL_TERMS + j] = static_cast<double>(profile.tangential[j].sd_mm / profile.thickness_mm);
  }
  return sum;
}

// Pressure of 1 N, pascals, so far from the contact's centre.
double pressure_Pa(const pad_profile &profile, double r2_mm2) {
  double sum = 0;
  for (const auto &term : profile.normal) {
    const double sd_mm = static_cast<double>(term.sd_mm);
    const double v = sd_mm * sd_mm + static_cast<double>(profile.spread_mm2);
    sum += static_cast<double>(term.share) / (2 * M_PI * v) * std::exp(-r2_mm2 / (2 * v));
  }
  return 1e6 * sum;
}

// 2 pi p0 sigma^2 as the fingertip fits it, over the force: the mean over places within a pitch
// around the middle of the array, where a calibration's weight is placed.
double force_ratio(const pad_profile &profile, const wire_info &info) {
  constexpr int PLACES = 9; // each way
  constexpr double FORCE_N = 5;
  const float pitch_mm = info.pitch_mm > 0 ? info.pitch_mm : profile.thickness_mm;
  fit_array array;
  if (fit_array_init(&array, info.sensor_count, info.x_mm, info.y_mm, pitch_mm) != FT_OK) {
    throw Error(ErrorCode::bad_value, "the fingertip's sensors are no array to fit a contact on");
  }
  double x_mm = 0, y_mm = 0;
  for (int k = 0; k < info.sensor_count; k++) {
    x_mm += static_cast<double>(info.x_mm[k]) / info.sensor_count;
    y_mm += static_cast<double>(info.y_mm[k]) / info.sensor_count;
  }
  fit_settings settings{};
  settings.iterations = FIT_MAX_ITERATIONS;
  settings.noise_Pa_q10 = 1024;
  double ratio = 0;
  for (int place = 0; place < PLACES * PLACES; place++) {
    const double pitch = static_cast<double>(pitch_mm) / PLACES;
    const double at_x_mm = x_mm + pitch * (place % PLACES - (PLACES - 1) / 2);
    const double at_y_mm = y_mm + pitch * (place / PLACES - (PLACES - 1) / 2);
    std::array<std::int32_t, FT_MAX_SENSORS> pressures_Pa_q10{};
    for (std::size_t k = 0; k < info.sensor_count; k++) {
      const double dx = static_cast<double>(info.x_mm[k]) - at_x_mm;
      const double dy = static_cast<double>(info.y_mm[k]) - at_y_mm;
      pressures_Pa_q10[k] =
          static_cast<std::int32_t>(std::lround(1024 * FORCE_N * pressure_Pa(profile, dx * dx + dy * dy)));
    }
    fit_result fit;
    fit_gaussian(&array, pressures_Pa_q10.data(), UINT32_MAX >> (FT_MAX_SENSORS - info.sensor_count), &settings, &fit);
    if (!(fit.flags & CONTACT_FLAG_FIT_VALID)) {
      throw Error(ErrorCode::bad_value, "the fingertip has too few sensors to fit a contact");
    }
    ratio += static_cast<double>(fit.force_N) / FORCE_N / (PLACES * PLACES);
  }
  return ratio;
}

double relative(const Waves &waves, const Sum &sum) {
  return std::sqrt(residual(waves, sum).squaredNorm() / waves.weight.cwiseProduct(waves.target).squaredNorm());
}

void check(const char *what, double value, double least, double greatest) {
  if (!(value >= least && value <= greatest)) {
    throw Error(ErrorCode::bad_value, std::string(what) + " " + shortest(static_cast<float>(value)) +
                                          " is out of range; give " + shortest(static_cast<float>(least)) + " to " +
                                          shortest(static_cast<float>(greatest)) + " mm");
  }
}

} // namespace

pad_profile profile_of(const Shape &shape, const wire_info &info) {
  check("thickness", shape.thickness_mm, PAD_THICKNESS_MIN_mm, PAD_THICKNESS_MAX_mm);
  check("overhang", shape.overhang_mm, 0, PAD_OVERHANG_MAX_mm);
  const double h_mm = shape.thickness_mm;
  pad_profile profile{};
  profile.thickness_mm = static_cast<float>(h_mm);
  profile.overhang_mm = static_cast<float>(shape.overhang_mm);
  const Sum normal = fitted(normal_waves(), start(PAD_NORMAL_TERMS));
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    profile.normal[j] = {static_cast<float>(normal[j]), static_cast<float>(h_mm * normal[PAD_NORMAL_TERMS + j])};
  }
  const Sum tangential = fitted(tangential_waves(), start(PAD_TANGENTIAL_TERMS));
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    profile.tangential[j] = {static_cast<float>(h_mm * tangential[j]),
                             static_cast<float>(h_mm * tangential[PAD_TANGENTIAL_TERMS + j])};
  }
  // A contact of radius a under Hertz's pressure, sqrt(1 - r^2/a^2), has a variance of a^2/5 along
  // an axis: 4 mm^2 at 4.5 mm, and 10 mm^2, an sd more, at the 7 mm that a sphere of 15 mm makes
  // under 10 N on 12 mm of silicone.
  profile.spread_mm2 = 4;
  profile.spread_sd_mm2 = 6;
  profile.force_ratio = static_cast<float>(force_ratio(profile, info));
  // The scale of an exactly known layer; no weight has been dragged yet. Real rubber differs from nu = 0.49
  // and from the set thickness, each by some per cent.
  profile.tangential_scale = 1;
  profile.tangential_scale_sd = 0.1F;
  profile.from_touch = shape.from_touch ? 1 : 0;
  return profile;
}

wire_info own_sensors() {
  wire_info info{};
  info.sensor_count = geometry.sensor_count;
  info.pitch_mm = geometry.pitch_mm;
  std::copy(std::begin(geometry.x_mm), std::end(geometry.x_mm), info.x_mm);
  std::copy(std::begin(geometry.y_mm), std::end(geometry.y_mm), info.y_mm);
  return info;
}

pad_profile profile_over_own_sensors(const Shape &shape) { return profile_of(shape, own_sensors()); }

bool edges_spoil_the_zero(const Shape &shape) {
  return shape.overhang_mm > 0 && shape.overhang_mm < 0.5 * shape.thickness_mm;
}

Misfit misfit(const pad_profile &profile) {
  return {relative(normal_waves(), normal_sum(profile)), relative(tangential_waves(), tangential_sum(profile))};
}

} // namespace fingertip::pad
