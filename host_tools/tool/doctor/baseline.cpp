#include "tool/doctor/baseline.hpp"

#include "libfingertip/packet_fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace fingertip {

constexpr unsigned MEANS = 10;
/* The middle of fewer is moved by one of them. */
constexpr std::size_t COMPANY_MIN = 5;
/* The median of |x| of a Gaussian of standard deviation 1 is 1 / 1.4826; a step holds two noises. */
constexpr double NOISE_OF_MEDIAN_STEP = 1.4826 / 1.41421356;

static bool has(sensor_map bitmap, unsigned sensor) { return (bitmap >> sensor & 1u) != 0; }

static double median(std::vector<double> values) {
  auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

using Means = std::array<std::optional<double>, MEANS>;

/* Least squares; nothing of fewer than three. */
static std::optional<Slope> slope(const Means &means, double seconds) {
  std::vector<std::pair<double, double>> points; /* time and mean */
  double t = 0, y = 0;
  for (unsigned i = 0; i < MEANS; i++) {
    if (means[i]) {
      points.emplace_back((i + 0.5) * seconds / MEANS, *means[i]);
      t += points.back().first;
      y += points.back().second;
    }
  }
  const auto n = static_cast<double>(points.size());
  if (n < 3 || seconds <= 0) {
    return std::nullopt;
  }
  double tt = 0, ty = 0, squares = 0;
  for (const auto &[at, mean] : points) {
    tt += (at - t / n) * (at - t / n);
    ty += (at - t / n) * (mean - y / n);
  }
  for (const auto &[at, mean] : points) {
    const double residual = mean - y / n - ty / tt * (at - t / n);
    squares += residual * residual;
  }
  return Slope{ty / tt, std::sqrt(squares / (n - 2) / tt)};
}

void BaselineMeter::add(const wire_packet &packet) {
  if (packet.type == WIRE_SYNC) {
    edges_.take(packet.body.sync);
  }
  if (!is_frame(packet)) {
    return;
  }
  bool is_raw = packet.type == WIRE_RAW;
  std::uint32_t frame = is_raw ? packet.body.raw.frame : packet.body.contact.frame;
  std::uint32_t flags = flags_of(packet);
  if (!any_) {
    any_ = true;
    first_us_ = packet.t_us;
    first_frame_ = frame;
  }
  if (counted_.frames_received == 0 || frame != last_frame_) {
    counted_.frames_received++;
    counted_.frames_touched += (flags & CONTACT_FLAG_CONTACT) ? 1 : 0;
  }
  counted_.last_flags = flags;
  last_us_ = packet.t_us;
  last_frame_ = frame;
  if (!is_raw || (flags & CONTACT_FLAG_HELD)) {
    return;
  }
  const wire_raw &raw = packet.body.raw;
  sensor_count_ = raw.sensor_count;
  doubtful_.resize(sensor_count_);
  saturated_.resize(sensor_count_);
  Reading reading = {static_cast<double>(packet.t_us - first_us_) * 1e-6, raw.valid, {}};
  for (unsigned k = 0; k < sensor_count_; k++) {
    reading.pressure_Pa[k] = static_cast<float>(raw.pressure_Pa_q10[k] / 1024.0);
    doubtful_[k] += has(raw.doubtful, k);
    saturated_[k] += has(raw.saturated, k);
  }
  readings_.push_back(reading);
}

double BaselineMeter::seconds() const { return any_ ? static_cast<double>(last_us_ - first_us_) * 1e-6 : 0; }

/* From each reading to the next, [reading - 1]. */
std::vector<double> BaselineMeter::steps_together() const {
  std::vector<double> together;
  std::vector<double> steps_Pa;
  for (std::size_t i = 1; i < readings_.size(); i++) {
    steps_Pa.clear();
    for (unsigned k = 0; k < sensor_count_; k++) {
      if (has(readings_[i].valid & readings_[i - 1].valid, k)) {
        steps_Pa.push_back(static_cast<double>(readings_[i].pressure_Pa[k] - readings_[i - 1].pressure_Pa[k]));
      }
    }
    together.push_back(steps_Pa.size() < COMPANY_MIN ? 0 : median(steps_Pa));
  }
  return together;
}

std::optional<double> BaselineMeter::noise(unsigned sensor, const std::vector<double> &together) const {
  std::vector<double> steps_Pa;
  double squares = 0;
  for (std::size_t i = 1; i < readings_.size(); i++) {
    if (has(readings_[i].valid & readings_[i - 1].valid, sensor)) {
      double step_Pa = static_cast<double>(readings_[i].pressure_Pa[sensor] - readings_[i - 1].pressure_Pa[sensor]) - together[i - 1];
      steps_Pa.push_back(std::abs(step_Pa));
      squares += step_Pa * step_Pa;
    }
  }
  if (steps_Pa.empty()) {
    return std::nullopt;
  }
  return counted_.frames_touched == 0 ? std::sqrt(squares / 2 / static_cast<double>(steps_Pa.size()))
                                      : median(steps_Pa) * NOISE_OF_MEDIAN_STEP;
}

Baseline BaselineMeter::result() const {
  Baseline baseline = counted_;
  baseline.seconds = seconds();
  baseline.frames_made = last_frame_ - first_frame_;
  baseline.edges = edges_.edges();
  baseline.edges_missing = edges_.missing();
  auto together = steps_together();
  std::vector<Means> means(sensor_count_);
  for (unsigned k = 0; k < sensor_count_; k++) {
    SensorBaseline sensor;
    std::array<double, MEANS> sums{}, counts{};
    double sum_Pa = 0;
    for (const Reading &reading : readings_) {
      if (has(reading.valid, k)) {
        auto i = static_cast<std::size_t>(reading.t_s / std::max(baseline.seconds, 1e-6) * MEANS);
        i = std::min<std::size_t>(i, MEANS - 1);
        sums[i] += static_cast<double>(reading.pressure_Pa[k]);
        counts[i]++;
        sum_Pa += static_cast<double>(reading.pressure_Pa[k]);
        sensor.readings++;
      }
    }
    if (!readings_.empty()) {
      auto all = static_cast<double>(readings_.size());
      sensor.valid_share = static_cast<double>(sensor.readings) / all;
      sensor.doubtful_share = static_cast<double>(doubtful_[k]) / all;
      sensor.saturated_share = static_cast<double>(saturated_[k]) / all;
    }
    if (sensor.readings > 0) {
      sensor.mean_Pa = sum_Pa / static_cast<double>(sensor.readings);
      for (unsigned i = 0; i < MEANS; i++) {
        if (counts[i] > 0) {
          means[k][i] = sums[i] / counts[i] - sensor.mean_Pa;
        }
      }
    }
    sensor.noise_Pa = noise(k, together);
    baseline.sensors.push_back(sensor);
  }
  Means common;
  for (unsigned i = 0; i < MEANS; i++) {
    std::vector<double> now_Pa;
    for (const Means &of_sensor : means) {
      if (of_sensor[i]) {
        now_Pa.push_back(*of_sensor[i]);
      }
    }
    if (now_Pa.size() >= COMPANY_MIN) {
      common[i] = median(now_Pa);
      for (Means &of_sensor : means) {
        if (of_sensor[i]) {
          *of_sensor[i] -= *common[i];
        }
      }
    }
  }
  baseline.common_drift = slope(common, baseline.seconds);
  for (unsigned k = 0; k < sensor_count_; k++) {
    baseline.sensors[k].drift = slope(means[k], baseline.seconds);
  }
  return baseline;
}

} // namespace fingertip
