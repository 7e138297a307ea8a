#include "shear/motion/watch.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "contact/motion.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::shear {

struct Watch::Histories {
  contact_settings contact{};
  tangential_settings tangential{};
  slip_history slip{};
  tangential_history load{};
  motion_history motion{};
};

Watch::Watch() : histories_(std::make_unique<Histories>()) {
  histories_->contact = {DEFAULT_SLIP_THRESHOLD_mm, DEFAULT_SLIP_WINDOW_ms * 1000u, DEFAULT_FORCE_SCALE,
                         DEFAULT_FORCE_SCALE_SD};
  histories_->tangential.force_scale = 1.0F;
  histories_->tangential.tangential_scale = 1.0F;
  histories_->tangential.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
}

Watch::~Watch() = default;

Said Watch::look(const Felt &felt) {
  contact_input input{};
  input.t_us = felt.t_us;
  input.contact = felt.contact;
  input.fit = felt.contact ? &felt.fit : nullptr;
  input.tangential = &felt.tangential;
  contact_result result;
  tangential_load load;
  motion moved;
  Histories &h = *histories_;
  contact_update(&h.slip, &h.contact, &input, &result);
  tangential_update(&h.load, &h.tangential, &input, &result, &load);
  motion_update(&h.motion, &h.tangential, &input, &result, &moved);
  const auto has = [&](std::uint32_t flag) { return (result.flags & flag) != 0; };
  return {{has(CONTACT_FLAG_SLIP), has(CONTACT_FLAG_MOVING), has(CONTACT_FLAG_SLIDING)},
          has(CONTACT_FLAG_VELOCITY_VALID),
          moved.vx_mm_s,
          moved.vy_mm_s};
}

std::vector<Slip> slips_of(const twin::Act &act) {
  constexpr double STEP_s = 1e-3;
  std::vector<Slip> slips;
  for (const twin::Phase &phase : act.phases) {
    if (!phase.slip) {
      continue;
    }
    const double begin_s = phase.begin_s - act.begin_s, end_s = phase.end_s - act.begin_s;
    if (!slips.empty() && begin_s - slips.back().end_s < Slip::JOINED_s) {
      slips.back().end_s = end_s;
    } else {
      slips.push_back({begin_s, end_s, 0.0, 0.0, end_s});
    }
  }
  for (Slip &slip : slips) {
    const twin::Touch from = act.tracks[0].at(slip.begin_s);
    twin::Touch last = from;
    for (double t_s = slip.begin_s + STEP_s; t_s < slip.end_s + 0.5 * STEP_s; t_s += STEP_s) {
      const twin::Touch now = act.tracks[0].at(t_s);
      const double way_mm = std::hypot(now.x_mm - from.x_mm, now.y_mm - from.y_mm);
      slip.way_mm = std::max(slip.way_mm, way_mm);
      slip.speed_mm_s = std::max(slip.speed_mm_s, std::hypot(now.x_mm - last.x_mm, now.y_mm - last.y_mm) / STEP_s);
      if (way_mm >= Slip::SHOWS_mm) {
        slip.shows_s = std::min(slip.shows_s, t_s);
      }
      last = now;
    }
  }
  return slips;
}

Judged judge(Player &player, const twin::Act &act, std::uint64_t number) {
  Judged judged{};
  for (const Slip &slip : slips_of(act)) {
    judged.slips.push_back({slip, {}, {}, {}});
  }
  for (const twin::Phase &phase : act.phases) {
    if (act.press == "lift" && phase.name == "lift") {
      judged.lift_s = phase.end_s - phase.begin_s;
    }
  }
  Watch watch;
  std::array<bool, DETECTORS> before{};
  player.play(act, number, [&](const Felt &felt) {
    const Said said = watch.look(felt);
    const double t_s = 1e-6 * static_cast<double>(felt.t_us);
    for (std::size_t d = 0; d < DETECTORS; d++) {
      bool excused = false;
      for (Judged::Found &found : judged.slips) {
        const bool within = t_s >= found.slip.begin_s && t_s <= found.slip.end_s;
        excused = excused || (t_s > found.slip.begin_s - EARLY_s && t_s < found.slip.end_s + LATE_s);
        if (said.flags[d] && t_s >= found.slip.begin_s && t_s < found.slip.end_s + Slip::JOINED_s) {
          if (!found.latency_s[d]) {
            found.latency_s[d] = felt.known_s - found.slip.begin_s;
          } else if (!before[d] && within) {
            found.gaps[d]++;
          }
        }
        if (said.flags[d] && !within && t_s > found.slip.end_s && t_s < found.slip.end_s + LATE_s) {
          found.lasts_s[d] = t_s - found.slip.end_s;
        }
      }
      judged.spoke[d] = judged.spoke[d] || said.flags[d];
      judged.falsely[d] = judged.falsely[d] || (said.flags[d] && !excused);
      before[d] = said.flags[d];
    }
  });
  return judged;
}

} // namespace fingertip::shear
