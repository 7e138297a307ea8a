#include "simulation/twin/episodes.hpp"

#include <utility>

namespace fingertip::twin {

ScenarioBuilder::ScenarioBuilder(const ScenarioOptions &scenario_options, const ContactTable &contact_table)
    : options(scenario_options), table(contact_table), forces(options.forces), tangential(options.tangential),
      friction("--friction", options.friction), mass_kg("--mass", options.mass_kg.empty() ? "0" : options.mass_kg) {}

bool ScenarioBuilder::add(Episode episode) {
  const double length_s = episode.phases.back().end_s;
  if (t_s_ + length_s + options.quiet_s > *options.seconds + 1e-9) {
    return false;
  }
  episode.begin_s = t_s_;
  episode.end_s = t_s_ + length_s;
  for (Phase &phase : episode.phases) {
    phase.begin_s += t_s_;
    phase.end_s += t_s_;
  }
  t_s_ = milliseconds(episode.end_s + options.quiet_s);
  episodes.push_back(std::move(episode));
  return true;
}

Place ScenarioBuilder::random_place(Random &random) const {
  const double at_x = random.uniform(-half_x_mm(), half_x_mm());
  return {at_x, random.uniform(-half_y_mm(), half_y_mm())};
}

void phase(Episode &episode, const std::string &name, double end_s, bool slip) {
  const double begin_s = episode.phases.empty() ? 0.0 : episode.phases.back().end_s;
  episode.phases.push_back({name, begin_s, milliseconds(end_s), slip});
}

Track track_at(Place place) {
  Track track;
  track.x_mm = place.x_mm;
  track.y_mm = place.y_mm;
  return track;
}

double touch_and_hold(Episode &episode, Track &track, double force_N, double hold_s, double ramp_s) {
  track.force_N.ease(ramp_s, force_N);
  phase(episode, "touch", track.force_N.end_s());
  track.force_N.hold(hold_s);
  phase(episode, "hold", track.force_N.end_s());
  return track.force_N.end_s();
}

void release(Episode &episode, Track &track, double ramp_s) {
  track.force_N.ease(ramp_s, 0.0);
  phase(episode, "release", track.force_N.end_s());
  episode.tracks.push_back(track);
}

void rest_and_release(Episode &episode, Track &track, double rest_s) {
  track.force_N.hold(rest_s);
  phase(episode, "after", track.force_N.end_s());
  release(episode, track);
}

} // namespace fingertip::twin
