#include "libfingertip/edge_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace fingertip {

/* A stamp is right to half a microsecond, by rounding, and a few cycles. */
constexpr std::int64_t STAMPS_us = 2;
/* More frequent ties add no information, and cost a fit each. */
constexpr std::uint64_t TIE_INTERVAL_us = 20'000;
/* With fewer ties or over less time, the drift is not known well enough to reach the next tie. */
constexpr unsigned TIES = 6;
constexpr double SPAN_us = 5e6;
constexpr double EDGE_LIFE_us = 2e6;
constexpr std::size_t EDGES = 256;
constexpr double KNOT_us = 1e6;
constexpr std::size_t KNOTS = 64;

static double place_of(const ClockEstimate &clock, double t_us) {
  return clock.host_us + (t_us - static_cast<double>(clock.device_us)) / (1 + clock.drift_ppm * 1e-6);
}

void EdgeAlignment::clock(std::size_t device, const ClockEstimate &estimate) {
  members_[device].clock = estimate;
  if (reference_ == device && !knots_.empty()) {
    extend(estimate.device_us);
  }
}

void EdgeAlignment::edge(std::size_t device, std::uint64_t t_us, bool rises) {
  Member &member = members_[device];
  if (!member.clock) {
    return;
  }
  const Edge edge{t_us, place_of(*member.clock, static_cast<double>(t_us)), member.clock->uncertainty_us, rises};
  member.edges.push_back(edge);
  while (member.edges.size() > EDGES || edge.host_us - member.edges.front().host_us > EDGE_LIFE_us) {
    member.edges.pop_front();
  }
  for (std::size_t other = 0; other < members_.size(); other++) {
    if (other == device || (reference_ && other != *reference_ && device != *reference_)) {
      continue;
    }
    const Edge *same = nullptr;
    bool is_alone = true;
    for (const Edge &each : members_[other].edges) {
      const double apart_us = std::abs(each.host_us - edge.host_us);
      if (each.rises == rises && apart_us <= each.uncertainty_us + edge.uncertainty_us + STAMPS_us) {
        is_alone = !same;
        same = &each;
      }
    }
    if (same && is_alone) {
      reference_ = reference_.value_or(std::min(device, other));
      if (device == *reference_) {
        tie(other, *same, edge);
      } else if (other == *reference_) {
        tie(device, edge, *same);
      }
    }
  }
}

void EdgeAlignment::tie(std::size_t device, const Edge &own, const Edge &reference) {
  Member &member = members_[device];
  if (member.ties > 0 && own.t_us < member.last_tie_us + TIE_INTERVAL_us) {
    return;
  }
  const unsigned jumps = member.fit.jumps();
  const auto reference_us = static_cast<std::int64_t>(reference.t_us);
  member.fit.add({reference_us - STAMPS_us, reference_us + STAMPS_us, own.t_us});
  if (member.fit.jumps() != jumps) {
    member.ties = 0;
  }
  member.first_tie_us = member.ties == 0 ? own.t_us : member.first_tie_us;
  member.last_tie_us = own.t_us;
  member.ties++;
  if (knots_.empty()) {
    knots_.push_back({static_cast<double>(reference.t_us), reference.host_us});
    extend(reference.t_us);
  }
}

/* The knots reach a second beyond what the rows may have. */
void EdgeAlignment::extend(std::uint64_t until_us) {
  const ClockEstimate &clock = *members_[*reference_].clock;
  while (knots_.back().reference_us < static_cast<double>(until_us) + KNOT_us) {
    const double next_us = knots_.back().reference_us + KNOT_us;
    knots_.push_back({next_us, place_of(clock, next_us)});
  }
  while (knots_.size() > KNOTS) {
    knots_.pop_front();
  }
}

double EdgeAlignment::to_host(double reference_us) const {
  auto after = std::upper_bound(knots_.begin(), knots_.end(), reference_us,
                                [](double value, const Knot &knot) { return value < knot.reference_us; });
  after = std::clamp(after, std::next(knots_.begin()), std::prev(knots_.end()));
  const Knot &a = *std::prev(after), &b = *after;
  return a.host_us + (reference_us - a.reference_us) * (b.host_us - a.host_us) / (b.reference_us - a.reference_us);
}

void EdgeAlignment::restart(std::size_t device) {
  const bool was_reference = reference_ == device;
  for (std::size_t i = 0; i < members_.size(); i++) {
    if (i == device || was_reference) {
      std::optional<ClockEstimate> clock = members_[i].clock;
      members_[i] = Member();
      members_[i].clock = i == device ? std::nullopt : clock;
    }
  }
  if (was_reference) {
    reference_.reset();
    knots_.clear();
  }
}

std::optional<EdgeAlignment::Place> EdgeAlignment::place(std::size_t device, std::uint64_t t_us) const {
  auto is_tied = [&](const Member &member) {
    return member.ties >= TIES && static_cast<double>(member.last_tie_us - member.first_tie_us) >= SPAN_us;
  };
  const auto at_us = static_cast<double>(t_us);
  if (reference_ == device) {
    return std::any_of(members_.begin(), members_.end(), is_tied) ? std::optional(Place{to_host(at_us), 0}) : std::nullopt;
  }
  const Member &member = members_[device];
  if (!is_tied(member) || !member.clock) {
    return std::nullopt;
  }
  /* Beyond the last tie the drift between both is known only as well as the ties' span allows. */
  const ClockEstimate &estimate = *member.fit.estimate();
  const double span_us = static_cast<double>(member.last_tie_us - member.first_tie_us);
  const double beyond_us = std::abs(at_us - static_cast<double>(member.last_tie_us));
  const double uncertainty_us = estimate.uncertainty_us + 2 * STAMPS_us * beyond_us / span_us;
  if (uncertainty_us > member.clock->uncertainty_us) {
    return std::nullopt;
  }
  return Place{to_host(place_of(estimate, at_us)), uncertainty_us};
}

} // namespace fingertip
