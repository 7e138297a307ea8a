#include "shear/static/results.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;
using truth::percent;

double Judged::true_ratio() const {
  return std::hypot(truth.pull_x_N, truth.pull_y_N) / truth.force_N;
}

double Judged::vector_error() const {
  return std::hypot(said.qx - truth.pull_x_N / truth.force_N, said.qy - truth.pull_y_N / truth.force_N);
}

double Judged::ratio_error() const {
  return std::abs(std::hypot(said.qx, said.qy) - true_ratio());
}

double Judged::direction_error_deg() const {
  const double cross = truth.pull_x_N * said.qy - truth.pull_y_N * said.qx;
  const double along = truth.pull_x_N * said.qx + truth.pull_y_N * said.qy;
  return std::abs(std::atan2(cross, along)) * 180.0 / M_PI;
}

double Judged::location_error_mm() const {
  return std::hypot(said.x_mm - truth.x_mm, said.y_mm - truth.y_mm);
}

double Judged::gaussian_location_error_mm() const {
  return std::hypot(said.gaussian_x_mm - truth.x_mm, said.gaussian_y_mm - truth.y_mm);
}

Results Results::where(const Predicate &predicate) const {
  std::vector<Judged> some;
  std::copy_if(judged_.begin(), judged_.end(), std::back_inserter(some), predicate);
  return Results(std::move(some));
}

double Results::share(const Predicate &predicate) const {
  return percent(static_cast<double>(std::count_if(judged_.begin(), judged_.end(), predicate)),
                 static_cast<double>(judged_.size()));
}

double Results::at(const Value &value, double quantile) const {
  std::vector<double> values;
  std::transform(judged_.begin(), judged_.end(), std::back_inserter(values), value);
  return truth::quantile(std::move(values), quantile);
}

double Results::valid_at(const Value &value, double quantile) const {
  return where([](const Judged &j) { return j.said.valid; }).at(value, quantile);
}

double Results::valid_percent() const {
  return share([](const Judged &j) { return j.said.valid; });
}

double Results::q_covered(double sds) const {
  // q_sd is that of either component.
  const double within = sds * std::sqrt(2.0);
  return where([](const Judged &j) { return j.said.valid; }).share([=](const Judged &j) {
    return j.vector_error() <= within * j.said.q_sd;
  });
}

double Results::beyond_percent(double sds) const {
  return 100.0 - q_covered(sds / std::sqrt(2.0));
}

double Results::location_covered(double sds) const {
  return where([](const Judged &j) { return j.said.valid; }).share([=](const Judged &j) {
    return j.location_error_mm() <= sds * j.said.location_sd_mm;
  });
}

namespace {

bool claims(const Judged &j, double sds) {
  constexpr double LEAST = 0.05;
  const double size = std::hypot(j.said.qx, j.said.qy);
  return j.said.valid && size > LEAST && size > sds * j.said.q_sd;
}

} // namespace

double Results::claimed_percent() const {
  return share([](const Judged &j) { return claims(j, 2.0); });
}

double Results::claimed_unflagged_percent() const {
  return share([](const Judged &j) { return claims(j, 2.0) && !j.said.elongated; });
}

double Results::claimed_surely_percent() const {
  return share([](const Judged &j) { return claims(j, 2.0 * std::sqrt(2.0)); });
}

ordered_json Results::row(const std::string &name) const {
  ordered_json row{{"case", name}, {"touches", judged_.size()}};
  if (judged_.empty()) {
    return row;
  }
  row["valid_percent"] = valid_percent();
  row["elongated_percent"] = share([](const Judged &j) { return j.said.elongated; });
  // Of none there is no figure.
  const Results valid = where([](const Judged &j) { return j.said.valid; });
  const auto of_valid = [&](double value) { return valid.all().empty() ? ordered_json() : ordered_json(value); };
  const auto vector = [](const Judged &j) { return j.vector_error(); };
  const auto ratio = [](const Judged &j) { return j.ratio_error(); };
  row["ratio_error_p50"] = of_valid(valid.at(ratio, 0.5));
  row["ratio_error_p95"] = of_valid(valid.at(ratio, 0.95));
  row["vector_error_p50"] = of_valid(valid.at(vector, 0.5));
  row["vector_error_p95"] = of_valid(valid.at(vector, 0.95));
  if (judged_.front().true_ratio() > 0.0) {
    row["direction_p90_deg"] = of_valid(valid.at([](const Judged &j) { return j.direction_error_deg(); }, 0.9));
  } else {
    row["claimed_percent"] = claimed_percent();
    row["claimed_surely_percent"] = claimed_surely_percent();
    row["claimed_unflagged_percent"] = claimed_unflagged_percent();
  }
  const auto located = [](const Judged &j) { return j.location_error_mm(); };
  const auto gaussian = [](const Judged &j) { return j.gaussian_location_error_mm(); };
  row["location_p50_mm"] = at(located, 0.5);
  row["location_p95_mm"] = at(located, 0.95);
  row["location_without_p50_mm"] = at(gaussian, 0.5);
  row["location_without_p95_mm"] = at(gaussian, 0.95);
  const auto force = [](const Judged &j) { return std::abs(j.said.force_N / j.truth.force_N - 1.0); };
  const auto without = [](const Judged &j) { return std::abs(j.said.gaussian_force_N / j.truth.force_N - 1.0); };
  row["force_p50_percent"] = 100.0 * at(force, 0.5);
  row["force_p95_percent"] = 100.0 * at(force, 0.95);
  row["force_without_p50_percent"] = 100.0 * at(without, 0.5);
  row["force_without_p95_percent"] = 100.0 * at(without, 0.95);
  row["q_cover_1sd"] = of_valid(q_covered(1.0));
  row["q_cover_2sd"] = of_valid(q_covered(2.0));
  row["location_cover_1sd"] = of_valid(location_covered(1.0));
  row["location_cover_2sd"] = of_valid(location_covered(2.0));
  return row;
}

} // namespace fingertip::shear
