#include "simulation/twin/trajectory.hpp"

#include "simulation/twin/traction_table.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::twin {

constexpr double STICKS = 0.8; // of each period of stick-slip

// 0 to 1 from rest to rest.
static double smooth_step(double u) {
  const double v = std::clamp(u, 0.0, 1.0);
  return v * v * (3.0 - 2.0 * v);
}

void Profile::add(double seconds, double to, double rate_from, double rate_to) {
  const double begin_s = end_s();
  end_ms_ += std::max(1LL, std::llround(seconds * 1e3));
  pieces_.push_back({begin_s, end_s(), value_, to, rate_from, rate_to});
  value_ = to;
}

Profile &Profile::hold(double seconds) {
  add(seconds, value_, 0.0, 0.0);
  return *this;
}

Profile &Profile::ease(double seconds, double to) {
  add(seconds, to, 0.0, 0.0);
  return *this;
}

Profile &Profile::line(double seconds, double to) {
  const double rounded_s = 1e-3 * static_cast<double>(std::max(1LL, std::llround(seconds * 1e3)));
  const double rate = (to - value_) / rounded_s;
  add(seconds, to, rate, rate);
  return *this;
}

Profile &Profile::travel(double distance, double speed, double accelerate_s) {
  const double each = 0.5 * speed * accelerate_s;
  const double cruise_s = (distance - 2.0 * each) / speed;
  if (!(cruise_s > 0.0)) {
    throw std::invalid_argument("the way is shorter than its accelerations");
  }
  const double from = value_;
  // The cruise takes whole milliseconds; the speed in it differs from that asked for by as little.
  const double rounded_s = 1e-3 * static_cast<double>(std::max(1LL, std::llround(cruise_s * 1e3)));
  const double rate = distance / (rounded_s + accelerate_s);
  const double ramp = 0.5 * rate * accelerate_s;
  add(accelerate_s, from + ramp, 0.0, rate);
  add(cruise_s, from + distance - ramp, rate, rate);
  add(accelerate_s, from + distance, rate, 0.0);
  return *this;
}

Profile &Profile::trace(const std::vector<double> &values, double tolerance) {
  for (std::size_t begin = 0; begin < values.size();) {
    // Extends the segment while a straight line stays near all of them.
    double lowest = -std::numeric_limits<double>::infinity(), highest = -lowest;
    std::size_t end = begin;
    for (std::size_t i = begin; i < values.size(); i++) {
      const double steps = static_cast<double>(i - begin + 1), change = values[i] - value_;
      if (change / steps >= lowest && change / steps <= highest) {
        end = i;
      }
      lowest = std::max(lowest, (change - tolerance) / steps);
      highest = std::min(highest, (change + tolerance) / steps);
      if (lowest > highest) {
        break;
      }
    }
    line(1e-3 * static_cast<double>(end - begin + 1), values[end]);
    begin = end + 1;
  }
  return *this;
}

double Profile::at(double t_s) const {
  if (pieces_.empty() || t_s >= pieces_.back().end_s) {
    return value_;
  }
  if (t_s <= 0.0) {
    return pieces_.front().from;
  }
  const auto piece =
      std::upper_bound(pieces_.begin(), pieces_.end(), t_s, [](double t, const Piece &candidate) { return t < candidate.end_s; });
  const double length = piece->end_s - piece->begin_s;
  const double u = (t_s - piece->begin_s) / length;
  const double step = piece->to - piece->from;
  return piece->from + step * smooth_step(u) + length * u * (1.0 - u) * (piece->rate_from * (1.0 - u) - piece->rate_to * u);
}

double Grip::way_mm(double pusher_mm) const {
  if (pusher_mm <= 0.0) {
    return 0.0;
  }
  const double creep = creep_share * dead_travel_mm;
  if (pusher_mm < dead_travel_mm) {
    return creep * (1.0 - std::pow(1.0 - pusher_mm / dead_travel_mm, 1.5));
  }
  const double slid = pusher_mm - dead_travel_mm;
  if (stick_slip_mm <= 0.0) {
    return creep + slid;
  }
  const double periods = std::floor(slid / stick_slip_mm);
  const double within = slid / stick_slip_mm - periods;
  return creep + stick_slip_mm * (periods + smooth_step((within - STICKS) / (1.0 - STICKS)));
}

double Grip::pusher_mm(double way_mm) const {
  const double slid = way_mm - creep_share * dead_travel_mm;
  const double jumps = stick_slip_mm > 0.0 ? std::ceil(slid / stick_slip_mm) * stick_slip_mm : slid;
  return dead_travel_mm + std::max(jumps, 0.0);
}

Touch Track::at(double t_s) const {
  const double way = grip.way_mm(pusher_mm.at(t_s));
  Touch contact;
  contact.force_N = force_N.at(t_s);
  contact.x_mm = x_mm + along_x * way;
  contact.y_mm = y_mm + along_y * way;
  contact.angle_rad = angle_rad.at(t_s);
  if (contact.x_mm + radius_mm > edge_x_mm) {
    const DiscPart part = disc_before_edge((edge_x_mm - contact.x_mm) / radius_mm);
    contact.x_mm -= part.back * radius_mm;
    contact.force_N *= part.share;
  }
  const double load_N = tangential.load_N.at(t_s);
  if (load_N != 0.0) {
    contact.stuck_N = stuck_force_N(contact.force_N, std::abs(load_N), tangential.friction.at(t_s));
    const double moved = std::copysign(tangential.travel_mm, load_N) * (1.0 - std::pow(contact.stuck_N / contact.force_N, 2.0 / 3.0));
    contact.x_mm += tangential.along_x * moved;
    contact.y_mm += tangential.along_y * moved;
  }
  const double pull_N = tangential.share * contact.force_N + load_N;
  contact.pull_x_N = pull_N * tangential.along_x;
  contact.pull_y_N = pull_N * tangential.along_y;
  return contact;
}

double wind_up_rad(double torque_share, double friction_N, double shear_modulus_MPa, double radius_mm) {
  const double root = std::sqrt(1.0 - 1.5 * 3.0 * M_PI / 16.0 * std::abs(torque_share));
  const double turn = 0.125 * (1.0 - root) * (3.0 - root) * friction_N / (shear_modulus_MPa * radius_mm * radius_mm);
  return std::copysign(turn, torque_share);
}

DiscPart disc_before_edge(double ahead) {
  const double u = std::clamp(ahead, -1.0, 1.0);
  const double half_chord = std::sqrt(1.0 - u * u);
  const double share = 1.0 - (std::acos(u) - u * half_chord) / M_PI;
  // The first moment of the part beyond is 2/3 half_chord^3.
  const double moment = 2.0 / 3.0 * half_chord * half_chord * half_chord / M_PI;
  return {share, share > 1e-9 ? moment / share : 1.0};
}

} // namespace fingertip::twin
