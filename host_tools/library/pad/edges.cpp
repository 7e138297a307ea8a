#include "library/pad/edges.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/block_table.hpp"

extern "C" {
#include "fit/fit_tangential.h"
}

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

namespace fingertip::pad {

namespace {

constexpr double FORCE_N = 5.0, RATIO = 0.3;     // the estimate is linear in the former, nearly in both
constexpr double STEP_mm = 1.5, BEYOND_mm = 1.5; // beyond the outer sensors: of 0, 1.5, 3, 4.5, on the twin's seeds 21, 22, 24
constexpr double GAIN_SD = 0.015;                // of a calibrated pad: what the readings are weighed by

struct Contact {
  double x_mm, y_mm;                                                                  // its place
  double qx, qy;                                                                      // its load, Q / F
  double estimated_x_mm, estimated_y_mm, estimated_qx, estimated_qy, estimated_force; // the estimate; the last over F
};

double of(float value) { return static_cast<double>(value); }

// Pressure of a layer without end, per newton, with the contact dx, dy away.
double layer_Pa(const pad_profile &profile, double qx, double qy, double dx_mm, double dy_mm) {
  const double r2 = dx_mm * dx_mm + dy_mm * dy_mm;
  double sum = 0.0;
  for (const auto &term : profile.normal) {
    const double v = of(term.sd_mm) * of(term.sd_mm) + of(profile.spread_mm2);
    sum += of(term.share) / (2 * M_PI * v) * std::exp(-r2 / (2 * v));
  }
  for (const auto &term : profile.tangential) {
    const double v = of(term.sd_mm) * of(term.sd_mm) + 1.3 * of(profile.spread_mm2);
    sum += (qx * dx_mm + qy * dy_mm) * of(term.moment_mm) / (2 * M_PI * v * v) * std::exp(-r2 / (2 * v));
  }
  return 1e6 * sum;
}

// The same without a load, of the layer itself, wave by wave (layer.hpp), with a foot so far away: within 1e-6 of its peak.
double foot_Pa(const twin::Layer &layer, double away_mm) {
  constexpr double STEP = 0.05, MOST = 4.5; // of the root of wave number times thickness
  double sum = 0.0;
  for (double root = 0.5 * STEP; root < MOST; root += STEP) {
    const double H = root * root, k = H / layer.thickness_mm;
    sum += root * k * twin::base_transfer(H, layer.poisson) * std::exp(-0.5 * FOOT_SPREAD_mm2 * k * k) * j0(k * away_mm);
  }
  return 1e6 * sum * STEP / (M_PI * layer.thickness_mm);
}

using Rubber = std::function<double(std::size_t sensor, const Contact &contact)>; // pressure, Pa

class Estimate {
public:
  Estimate(const pad_profile &profile, const wire_info &info) : profile_(profile), info_(info) {
    if (fit_array_init(&array_, info.sensor_count, info.x_mm, info.y_mm, info.pitch_mm) != FT_OK ||
        fit_pad_init(&pad_, &array_, &profile) != FT_OK) {
      throw Error(ErrorCode::bad_value, "the fingertip's sensors are no rectangle that tangential force is estimated on");
    }
    settings_.iterations = 4;
    settings_.noise_Pa_q10 = 1024;
    std::fill_n(settings_.gain_sd_q16, FT_MAX_SENSORS, static_cast<std::uint16_t>(65536.0 * GAIN_SD));
  }

  // A calibration on this block takes what its ends lack for a dip. How deep, if that is as wide as all of its dip.
  void take_dip(const twin::BlockTable &block, const std::vector<twin::Place> &places) {
    settings_.dip_sd_mm = 1e-3f * static_cast<float>(info_.calibration.dip_sd_um);
    double products = 0.0, squares = 0.0;
    for (const auto &[x_mm, y_mm] : places) {
      for (std::size_t k = 0; k < info_.sensor_count; k++) {
        const double away = std::hypot(of(info_.x_mm[k]) - x_mm, of(info_.y_mm[k]) - y_mm) / of(settings_.dip_sd_mm);
        const double bell = layer_Pa(profile_, 0.0, 0.0, 0.0, 0.0) * std::exp(-0.5 * away * away);
        products -= bell * block.added_Pa(k, {1.0, 0.0, 0.0, radius_mm()}, x_mm, y_mm);
        squares += bell * bell;
      }
    }
    settings_.dip_share = static_cast<float>(std::clamp(products / squares, 0.0, info_.calibration.dip_share_q16 / 65536.0));
  }

  // Those of contacts at the places, with this load, of which there is an estimate; none where half of them have none.
  std::vector<Contact> contacts(const std::vector<twin::Place> &places, double qx, double qy, const Rubber &rubber) {
    std::vector<Contact> found;
    for (const auto &[x_mm, y_mm] : places) {
      Contact contact{x_mm, y_mm, qx, qy, 0.0, 0.0, 0.0, 0.0, 0.0};
      if (of_contact(contact, rubber)) {
        found.push_back(contact);
      }
    }
    return 2 * found.size() < places.size() ? std::vector<Contact>{} : found;
  }

  double radius_mm() const { return std::sqrt(5.0 * of(profile_.spread_mm2)); } // under Hertz's pressure

private:
  // False: there is no estimate.
  bool of_contact(Contact &contact, const Rubber &rubber) {
    std::array<std::int32_t, FT_MAX_SENSORS> readings{};
    for (std::size_t k = 0; k < info_.sensor_count; k++) {
      readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * rubber(k, contact)));
    }
    fit_result fit;
    struct fit_tangential found;
    fit_tangential_state state{};
    fit_gaussian_grid(&array_, readings.data(), first_sensors(info_.sensor_count), &settings_, &fit);
    for (int frame = 0; frame < FIT_TANGENTIAL_FRAMES; frame++) {
      fit_tangential_estimate(&array_, &pad_, readings.data(), &settings_, &fit, &state, &found);
    }
    if (!found.valid) {
      return false;
    }
    contact.estimated_x_mm = of(found.x_mm);
    contact.estimated_y_mm = of(found.y_mm);
    contact.estimated_qx = of(found.qx_N / found.force_N);
    contact.estimated_qy = of(found.qy_N / found.force_N);
    contact.estimated_force = of(found.force_N) / FORCE_N;
    return true;
  }

  const pad_profile &profile_;
  const wire_info &info_;
  fit_array array_{};
  struct fit_pad pad_ {};
  fit_settings settings_{};
};

using Terms = Eigen::Vector3d;

Terms row_at(const Contact &contact) {
  const double u = contact.estimated_x_mm / of(PAD_EDGE_UNIT_mm);
  const double v = contact.estimated_y_mm / of(PAD_EDGE_UNIT_mm);
  return {1.0, u * u, v * v};
}

// Least squares of value_i = factor_i even(c) over contacts, by the estimated location.
template <typename Factor, typename Value> Terms fitted(const std::vector<Contact> &contacts, const Factor &factor, const Value &value) {
  Eigen::MatrixXd rows(contacts.size(), PAD_EDGE_TERMS);
  Eigen::VectorXd right(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); i++) {
    const auto row = static_cast<Eigen::Index>(i);
    rows.row(row) = factor(contacts[i]) * row_at(contacts[i]).transpose();
    right[row] = value(contacts[i]);
  }
  return contacts.empty() ? Terms(Terms::Zero()) : Terms(rows.colPivHouseholderQr().solve(right));
}

double even(const Terms &c, const Contact &contact) { return c.dot(row_at(contact)); }

// The members of a contact along one axis.
struct Axis {
  double Contact::*place, Contact::*estimated_place, Contact::*load, Contact::*estimated_load;
};
constexpr Axis ALONG_X{&Contact::x_mm, &Contact::estimated_x_mm, &Contact::qx, &Contact::estimated_qx};
constexpr Axis ALONG_Y{&Contact::y_mm, &Contact::estimated_y_mm, &Contact::qy, &Contact::estimated_qy};

struct AxisTerms {
  Terms ratio, gain, place, pull;
};

AxisTerms terms_along(const Axis &axis, const std::vector<Contact> &free, const std::vector<Contact> &pulled) {
  const auto lever = [&](const Contact &c) { return c.*axis.estimated_place / of(PAD_EDGE_UNIT_mm); };
  const auto off = [&](const Contact &c) { return c.*axis.estimated_place - c.*axis.place; };
  AxisTerms terms;
  terms.ratio = fitted(free, lever, [&](const Contact &c) { return c.*axis.estimated_load; });
  terms.place = fitted(free, lever, off);
  const auto load = [&](const Contact &c) { return c.*axis.estimated_load - lever(c) * even(terms.ratio, c); };
  terms.gain = fitted(
      pulled, [](const Contact &) { return RATIO; }, [&](const Contact &c) { return load(c) - RATIO; });
  terms.pull = fitted(
      pulled, [&](const Contact &c) { return load(c) / (1.0 + even(terms.gain, c)); },
      [&](const Contact &c) { return off(c) - lever(c) * even(terms.place, c); });
  return terms;
}

double outermost(const float *places, int count) { return of(*std::max_element(places, places + count)); }

// All over the array, and so far beyond.
std::vector<twin::Place> places_of(const wire_info &info, double beyond_mm) {
  const double most_x_mm = outermost(info.x_mm, info.sensor_count) + beyond_mm,
               most_y_mm = outermost(info.y_mm, info.sensor_count) + beyond_mm;
  std::vector<twin::Place> places;
  for (double x_mm = -most_x_mm; x_mm <= most_x_mm + 1e-9; x_mm += STEP_mm) {
    for (double y_mm = -most_y_mm; y_mm <= most_y_mm + 1e-9; y_mm += STEP_mm) {
      places.push_back({x_mm, y_mm});
    }
  }
  return places;
}

pad_edges edges_from(const AxisTerms &x, const AxisTerms &y, const Terms &force) {
  Eigen::Matrix<double, PAD_EDGE_TERMS, PAD_EDGE_KINDS> terms; // in the order of pad_edges, which is floats alone
  terms << x.ratio, y.ratio, x.gain, y.gain, x.place, y.place, x.pull, y.pull, force;
  const Eigen::Matrix<float, PAD_EDGE_TERMS, PAD_EDGE_KINDS> stored = terms.cast<float>();
  pad_edges edges;
  std::memcpy(&edges, stored.data(), sizeof edges);
  return edges;
}

} // namespace

pad_edges zero_of(const pad_profile &profile, const wire_info &info) try {
  Estimate estimate(profile, info);
  const twin::Layer layer = twin::silicone(of(profile.thickness_mm));
  const auto foot = [&](std::size_t k, const Contact &contact) {
    return FORCE_N * foot_Pa(layer, std::hypot(of(info.x_mm[k]) - contact.x_mm, of(info.y_mm[k]) - contact.y_mm));
  };
  const std::vector<Contact> free = estimate.contacts(places_of(info, 0.0), 0.0, 0.0, foot);
  return free.empty() ? pad_edges{} : edges_from(terms_along(ALONG_X, free, {}), terms_along(ALONG_Y, free, {}), Terms::Zero());
} catch (const Error &) { // nothing is estimated on these sensors
  return {};
}

pad_edges edges_of(const pad_profile &profile, const wire_info &info, const std::filesystem::path &cache_directory,
                   const std::function<void(double)> &on_progress) {
  const double overhang_mm = of(profile.overhang_mm);
  if (!(overhang_mm >= EDGE_OVERHANG_MIN_mm && overhang_mm <= EDGE_OVERHANG_MAX_mm)) {
    throw Error(ErrorCode::bad_value, "the ends of a pad are computed for 3 to 20 mm of rubber "
                                      "beyond the outer sensors, not for " +
                                          shortest(profile.overhang_mm));
  }
  Estimate estimate(profile, info);
  const int count = info.sensor_count;
  const double half_x = outermost(info.x_mm, count), half_y = outermost(info.y_mm, count);
  std::vector<twin::Place> sensors;
  for (int k = 0; k < count; k++) {
    sensors.push_back({of(info.x_mm[k]), of(info.y_mm[k])});
  }
  const twin::Block own{twin::silicone(of(profile.thickness_mm)), half_x + overhang_mm, half_y + overhang_mm};
  const twin::BlockTable block = twin::BlockTable::load_or_build(own, sensors, cache_directory, on_progress);
  // Beyond the sensors it costs too much inside where ends are nearer.
  const std::vector<twin::Place> places = places_of(info, overhang_mm < 6.0 * BEYOND_mm ? 0.0 : BEYOND_mm);
  const bool calibrated = (info.stored & WIRE_STORED_CALIBRATION) != 0;
  if (calibrated && info.calibration.dip_share_q16 > 0) {
    estimate.take_dip(block, places);
  }
  const auto rubber = [&](std::size_t k, const Contact &c) {
    const twin::BlockTable::Load load{FORCE_N, c.qx * FORCE_N, c.qy * FORCE_N, estimate.radius_mm()};
    return FORCE_N * layer_Pa(profile, c.qx, c.qy, of(info.x_mm[k]) - c.x_mm, of(info.y_mm[k]) - c.y_mm) +
           block.added_Pa(k, load, c.x_mm, c.y_mm);
  };
  const std::vector<Contact> free = estimate.contacts(places, 0.0, 0.0, rubber);
  const std::vector<Contact> along_x = estimate.contacts(places, RATIO, 0.0, rubber),
                             along_y = estimate.contacts(places, 0.0, RATIO, rubber);
  if (free.empty() || along_x.empty() || along_y.empty()) {
    throw Error(ErrorCode::bad_value, "the rubber ends " + shortest(profile.overhang_mm) +
                                          " mm beyond the outer sensors, too near to estimate a tangential force");
  }
  const AxisTerms x = terms_along(ALONG_X, free, along_x);
  const AxisTerms y = terms_along(ALONG_Y, free, along_y);
  Terms force = fitted(
      free, [](const Contact &) { return 1.0; }, [](const Contact &c) { return c.estimated_force - 1.0; });
  if (calibrated) { // in its scale, that of placements all over the array
    const double u = half_x / of(PAD_EDGE_UNIT_mm), v = half_y / of(PAD_EDGE_UNIT_mm);
    force = (force + Terms::UnitX()) / (1.0 + force.dot(Terms(1.0, u * u / 3.0, v * v / 3.0))) - Terms::UnitX();
  }
  return edges_from(x, y, force);
}

} // namespace fingertip::pad
