// What was said of touches beside their truth, as the rows of tables.
#pragma once

#include "shear/static/pulled.hpp"
#include "truth/fit/statistics.hpp"

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace fingertip::shear {

struct Judged {
  twin::Touch truth;
  std::size_t object; // of the case's
  Said said;

  double true_ratio() const;
  // Of Q / F as a vector, and of its size, which is the ratio that is published.
  double vector_error() const;
  double ratio_error() const;
  double direction_error_deg() const;
  double location_error_mm() const;          // of what is published
  double gaussian_location_error_mm() const; // without the correction
};

class Results {
public:
  using Value = std::function<double(const Judged &)>;
  using Predicate = std::function<bool(const Judged &)>;

  Results() = default;
  explicit Results(std::vector<Judged> judged) : judged_(std::move(judged)) {}

  const std::vector<Judged> &all() const { return judged_; }
  Results where(const Predicate &predicate) const;
  double share(const Predicate &predicate) const; // of all, percent
  // Over all of them, and over those with a valid estimate.
  double at(const Value &value, double quantile) const;
  double valid_at(const Value &value, double quantile) const;
  double valid_percent() const;
  // Of those with a valid estimate, the share within so many standard deviations, percent; 63 and
  // 98 % for 1 and 2 would be a normal distribution in the plane.
  double q_covered(double sds) const;
  double location_covered(double sds) const;
  // Of those too, the share whose Q is off by more than so many standard deviations of either
  // component: 13.5 % for 2 would be a normal distribution.
  double beyond_percent(double sds) const;
  // Claims a load: valid, |Q| / F above 0.05 and above two of its standard deviations.
  double claimed_percent() const;
  double claimed_unflagged_percent() const; // and is not flagged as elongated
  // The same, but outside the circle that holds 98 % of a normal distribution in the plane.
  double claimed_surely_percent() const;

  nlohmann::ordered_json row(const std::string &name) const;

private:
  std::vector<Judged> judged_;
};

} // namespace fingertip::shear
