// Episodes with a tangential force. README.md states what is assumed and left out.
#include "simulation/twin/episodes.hpp"
#include "simulation/twin/held_object.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

namespace fingertip::twin {
namespace {

constexpr std::array<double, 3> LIFTS_s{0.1, 0.3, 1.0};
constexpr std::array<double, 1> DRAG_SPEEDS_mm_s{10};
constexpr double GRAVITY_m_s2 = 9.81;

// What pulls in the nth episode, as far as the options leave it open.
struct ChosenLoad {
  double angle_rad, share, friction;
};

ChosenLoad choose_load(const ScenarioBuilder &builder, std::size_t n) {
  Random random(builder.options.seed, DIRECTION, n);
  const double angle_deg = random.uniform(-180.0, 180.0);
  const double share = builder.tangential.share.at(random.uniform(0.0, 1.0));
  const double friction = builder.friction.at(random.uniform(0.0, 1.0));
  return {builder.tangential.angle_deg.value_or(angle_deg) * DEGREE, share, friction};
}

void aim(Track &track, double angle_rad) {
  track.along_x = track.tangential.along_x = std::cos(angle_rad);
  track.along_y = track.tangential.along_y = std::sin(angle_rad);
}

// Where a way along the track begins, so that all of it is where random places are; in the middle if it is longer.
void place_way(Track &track, double way_mm, const ScenarioBuilder &builder, Random &random) {
  const auto begin = [&](double half_mm, double along_mm) {
    const double middle_mm = std::max(0.0, half_mm - 0.5 * std::abs(along_mm));
    return random.uniform(-middle_mm, middle_mm) - 0.5 * along_mm;
  };
  track.x_mm = begin(builder.half_x_mm(), way_mm * track.along_x);
  track.y_mm = begin(builder.half_y_mm(), way_mm * track.along_y);
}

} // namespace

void add_tangential_load(Episode &episode, const ScenarioBuilder &builder, std::size_t n) {
  const ChosenLoad chosen = choose_load(builder, n);
  for (Track &track : episode.tracks) {
    track.tangential.along_x = std::cos(chosen.angle_rad);
    track.tangential.along_y = std::sin(chosen.angle_rad);
    track.tangential.share = chosen.share;
  }
  episode.friction = chosen.friction;
}

// A gripped object whose weight the pad takes over, carries and gives back.
Episode lift(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double CARRIES_s = 1.0;
  Random random(builder.options.seed, LIFT, n);
  const Place place = builder.random_place(random);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const double lift_s = LIFTS_s[n % LIFTS_s.size()];
  const ChosenLoad chosen = choose_load(builder, n);
  Episode episode;
  episode.press = "lift";
  episode.friction = chosen.friction;
  Track track = track_at(place);
  aim(track, chosen.angle_rad);
  track.tangential.friction = Profile(chosen.friction);
  track.tangential.travel_mm = builder.options.dead_travel_mm;
  const double begin_s = touch_and_hold(episode, track, force_N, random.uniform(0.5, 0.7));
  Profile &load_N = track.tangential.load_N;
  load_N.hold(begin_s);
  load_N.ease(lift_s, chosen.share * force_N);
  phase(episode, "lift", load_N.end_s());
  load_N.hold(CARRIES_s);
  phase(episode, "carry", load_N.end_s());
  load_N.ease(lift_s, 0.0);
  phase(episode, "lower", load_N.end_s());
  rest_and_release(episode, track, load_N.end_s() - begin_s + 0.3);
  return episode;
}

// A weight rests on the pad; a string pulls it with a known force, then until it slides.
Episode drag(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double WAY_mm = 8.0, KNOWN_s = 3.0, LOADS_s = 0.5;
  Random random(builder.options.seed, DRAG, n);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const ChosenLoad chosen = choose_load(builder, n);
  Episode episode;
  episode.press = "drag";
  episode.friction = chosen.friction;
  episode.mass_kg = force_N / GRAVITY_m_s2;
  episode.speed_mm_s = builder.speed_mm_s(n, DRAG_SPEEDS_mm_s);
  Track track;
  // x, y and back, by default.
  aim(track, builder.tangential.angle_deg.value_or(90.0 * static_cast<double>(n % 4)) * DEGREE);
  track.tangential.friction = Profile(chosen.friction);
  track.tangential.travel_mm = builder.options.dead_travel_mm;
  place_way(track, WAY_mm + track.tangential.travel_mm, builder, random);
  const double begin_s = touch_and_hold(episode, track, force_N, random.uniform(0.9, 1.1));
  Profile &load_N = track.tangential.load_N;
  load_N.hold(begin_s);
  load_N.ease(LOADS_s, chosen.share * force_N);
  phase(episode, "load", load_N.end_s());
  load_N.hold(KNOWN_s);
  phase(episode, "carry", load_N.end_s());
  load_N.line(LOADS_s, chosen.friction * force_N);
  phase(episode, "pull", load_N.end_s());
  track.pusher_mm.hold(load_N.end_s());
  track.pusher_mm.travel(WAY_mm, episode.speed_mm_s, std::min(SPEED_UP_s, 0.5 * WAY_mm / episode.speed_mm_s));
  load_N.hold(track.pusher_mm.end_s() - load_N.end_s());
  phase(episode, "slip", load_N.end_s(), true);
  load_N.ease(LOADS_s, 0.0);
  phase(episode, "unload", load_N.end_s());
  rest_and_release(episode, track, load_N.end_s() - begin_s + 0.5);
  return episode;
}

namespace {

// One slide, as far as it does not come out of the motion. Its time 0 is when the load begins; all
// forces are one finger's, which has half of the object.
struct Script {
  std::string name;
  double mass_kg, friction;
  Profile grip_N;   // until the slip is noticed
  Profile weight_N; // carried
  Profile hand_mm;  // pulls on a string that is just straight when the hand sets out
  double hand_begin_s = std::numeric_limits<double>::infinity();
  double over_s = std::numeric_limits<double>::infinity(); // then the load is taken away
  // Gross slip for this time or this distance is noticed; then the grip gets this strong.
  double notice_s = std::numeric_limits<double>::infinity();
  double notice_mm = std::numeric_limits<double>::infinity();
  double caught_N = 0.0;
};

// Each millisecond, from the first after the beginning.
struct Course {
  std::vector<double> force_N, way_mm, pull_N, friction;
  std::vector<std::string> phases;
  double fastest_mm_s = 0.0, farthest_mm = 0.0; // in gross slip; at all
};

const std::string STICKS = "sticks", PARTLY_SLIPS = "partial_slip", SLIPS = "slip";
constexpr double LOWERS_s = 0.3, RESTS_s = 0.3;
constexpr double BRAKES = 2.0;                         // times the weight: braked by the weight again
constexpr double CARRIED_MIN = 0.4, CARRIED_MAX = 0.9; // of what static friction holds

// Rubber of the stiffness at which the usual grip's object slips after the usual dead travel.
class Rubber {
public:
  explicit Rubber(const ScenarioBuilder &builder) : builder_(builder) {}
  double stiffness_N_mm(double force_N) const {
    constexpr double USUAL_N = 6.0, USUAL_FRICTION = 0.5;
    return 1.5 * USUAL_FRICTION * USUAL_N / builder_.options.dead_travel_mm * builder_.table.contact_radius_mm(force_N) /
           builder_.table.contact_radius_mm(USUAL_N);
  }
  double dead_travel_mm(double force_N, double friction) const { return 1.5 * friction * force_N / stiffness_N_mm(force_N); }

private:
  const ScenarioBuilder &builder_;
};

Course run(const Script &script, const ScenarioBuilder &builder) {
  constexpr double MS_s = 1e-3, LONGEST_s = 120.0;
  // A thread with the hand at its end; the damping keeps it from ringing.
  constexpr double STRING_N_mm = 10.0, STRING_DAMPING = 0.5;
  constexpr double GRIPS_s = 0.05, HELD_s = 0.5;
  const int steps = static_cast<int>(std::lround(MS_s / HeldObject::STEP_s));
  const double mass_kg = 0.5 * script.mass_kg;
  const double damping_N_s_mm = 2e-3 * STRING_DAMPING * std::sqrt(1e3 * STRING_N_mm * mass_kg);
  const Rubber rubber(builder);
  HeldObject object(mass_kg, script.friction, builder.options.kinetic_share);
  Profile lowered(1.0), grip_N = script.grip_N;
  double over_s = script.over_s, slip_s = std::numeric_limits<double>::infinity();
  double slip_mm = 0.0, straight_mm = 0.0;
  lowered.ease(LOWERS_s, 0.0);
  bool noticed = false;
  Course course;
  for (int ms = 0; MS_s * ms < over_s + LOWERS_s + RESTS_s - 0.5 * MS_s; ms++) {
    if (MS_s * ms > LONGEST_s) {
      throw std::logic_error("a slide does not end");
    }
    if (MS_s * ms <= script.hand_begin_s) {
      straight_mm = object.way_mm();
    }
    const double stiffness_N_mm = rubber.stiffness_N_mm(grip_N.at(MS_s * ms));
    for (int i = 0; i < steps; i++) {
      const double t_s = MS_s * ms + HeldObject::STEP_s * i;
      const double hand_mm_s = (script.hand_mm.at(t_s + HeldObject::STEP_s) - script.hand_mm.at(t_s)) / HeldObject::STEP_s;
      const double string_N = t_s < script.hand_begin_s
                                  ? 0.0
                                  : std::max(0.0, STRING_N_mm * (script.hand_mm.at(t_s) + straight_mm - object.way_mm()) +
                                                      damping_N_s_mm * (hand_mm_s - object.speed_mm_s()));
      object.step(HeldObject::STEP_s, grip_N.at(t_s), stiffness_N_mm, lowered.at(t_s - over_s) * (script.weight_N.at(t_s) + string_N));
    }
    const double t_s = MS_s * (ms + 1), force_N = grip_N.at(t_s);
    const double holds_N = object.friction() * force_N;
    // Friction and force have gone on since the last step began.
    const double pull_N =
        object.slips() ? std::copysign(holds_N, object.tangential_N()) : std::clamp(object.tangential_N(), -holds_N, holds_N);
    course.force_N.push_back(force_N);
    course.way_mm.push_back(object.way_mm());
    course.pull_N.push_back(pull_N);
    course.friction.push_back(object.friction());
    // Once half of the normal force's contact slides, and until three quarters of it stick.
    const bool partly = !course.phases.empty() && course.phases.back() != STICKS;
    course.phases.push_back(object.slips() ? SLIPS : std::abs(pull_N) >= (partly ? 0.25 : 0.5) * holds_N ? PARTLY_SLIPS : STICKS);
    course.farthest_mm = std::max(course.farthest_mm, std::abs(object.way_mm()));
    if (object.slips()) {
      course.fastest_mm_s = std::max(course.fastest_mm_s, std::abs(object.speed_mm_s()));
      if (slip_s > t_s) {
        slip_s = t_s;
        slip_mm = object.way_mm();
      }
    }
    if (!noticed && (t_s - slip_s >= script.notice_s || std::abs(object.way_mm() - slip_mm) >= script.notice_mm) && t_s >= slip_s) {
      noticed = true;
      grip_N = Profile(force_N);
      grip_N.hold(t_s).ease(GRIPS_s, script.caught_N);
      over_s = t_s + GRIPS_s + HELD_s;
    }
  }
  return course;
}

// Sticking or partial slip that is too short for any recording counts as the phase before it.
void slide_phases(Episode &episode, const std::vector<std::string> &phases, double begin_s) {
  constexpr std::size_t MOMENT_ms = 5;
  for (std::size_t begin = 0, end; begin < phases.size(); begin = end) {
    end = begin + 1;
    while (end < phases.size() && phases[end] == phases[begin]) {
      end++;
    }
    const bool slips = phases[begin] == SLIPS;
    const double end_s = begin_s + 1e-3 * static_cast<double>(end);
    if (begin > 0 && ((end - begin < MOMENT_ms && !slips) || episode.phases.back().name == phases[begin])) {
      episode.phases.back().end_s = milliseconds(end_s);
    } else {
      phase(episode, phases[begin], end_s, slips);
    }
  }
}

} // namespace

double slide_force_N(double mass_kg, double friction, double kinetic_share) {
  const double weight_N = 0.5 * GRAVITY_m_s2 * mass_kg;
  return std::max(1.0 / CARRIED_MIN, BRAKES / kinetic_share) * weight_N / friction;
}

// A gripped object that friction holds, or does not: pulled by hand, heavier than the grip can
// hold, held by a grip that loosens, or carried.
Episode slide(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double RESERVE = 0.6; // of kinetic friction: what the weight takes in a firm grip
  constexpr double FORCE_MIN_N = 1.0;
  constexpr double WAY_MAX_mm = 13.0; // fits between the usual borders, whatever its direction
  constexpr double TAKES_s = 0.3, CARRIES_s = 0.5;
  Random random(builder.options.seed, SLIDE, n);
  const Rubber rubber(builder);
  Script script;
  script.friction = builder.friction.at(random.uniform(0.0, 1.0));
  script.mass_kg = builder.mass_kg.at(random.uniform(0.0, 1.0));
  const double gripped_N = builder.forces.pick(n / 4, random.uniform(0.0, 1.0));
  double weight_N = 0.5 * GRAVITY_m_s2 * script.mass_kg, force_N = gripped_N, speed_mm_s = 0.0;
  const double kinetic = builder.options.kinetic_share * script.friction;
  const double firm_N = weight_N / (RESERVE * kinetic);
  double slides_mm = 0.0;
  const auto pull_by_hand = [&] {
    const double way_mm = rubber.dead_travel_mm(force_N, script.friction) + slides_mm;
    script.hand_mm = Profile();
    script.hand_mm.hold(script.hand_begin_s);
    script.hand_mm.travel(way_mm, speed_mm_s, std::min(SPEED_UP_s, 0.25 * way_mm / speed_mm_s));
    script.over_s = script.hand_mm.end_s() + CARRIES_s;
  };
  switch (n % 4) {
  case 0: {
    script.name = "pull";
    force_N = std::max(gripped_N, firm_N);
    const std::vector<double> &given_mm_s = builder.options.speeds_mm_s;
    const double drawn_mm_s = random.log_uniform(2.0, SLIDE_SPEED_MAX_mm_s);
    speed_mm_s = given_mm_s.empty() ? drawn_mm_s : given_mm_s[n / 4 % given_mm_s.size()];
    script.weight_N.ease(TAKES_s, weight_N);
    script.hand_begin_s = TAKES_s + CARRIES_s;
    slides_mm = random.uniform(3.0, 9.0);
    pull_by_hand();
    script.grip_N = Profile(force_N);
    break;
  }
  case 1: {
    script.name = "overload";
    const double over = random.uniform(1.05, 1.5);
    weight_N = std::max(weight_N, over * script.friction * FORCE_MIN_N);
    force_N = weight_N / (over * script.friction);
    script.weight_N.ease(random.log_uniform(0.1, 1.0), weight_N);
    script.grip_N = Profile(force_N);
    break;
  }
  case 2: {
    script.name = "loosen";
    force_N = std::max(gripped_N, firm_N);
    script.weight_N.ease(TAKES_s, weight_N);
    const double slackest_N = 0.5 * weight_N / script.friction;
    script.grip_N = Profile(force_N);
    script.grip_N.hold(TAKES_s + CARRIES_s);
    script.grip_N.line((force_N - slackest_N) / random.log_uniform(1.0, 20.0), slackest_N);
    break;
  }
  default:
    script.name = "carry";
    force_N = std::max(FORCE_MIN_N, weight_N / (random.uniform(CARRIED_MIN, CARRIED_MAX) * script.friction));
    script.weight_N.ease(random.log_uniform(0.1, 1.0), weight_N);
    script.over_s = script.weight_N.end_s() + 1.0;
    script.grip_N = Profile(force_N);
  }
  script.mass_kg = 2.0 * weight_N / GRAVITY_m_s2;
  if (script.over_s == std::numeric_limits<double>::infinity()) {
    script.notice_s = random.log_uniform(0.03, 0.15);
    script.notice_mm = random.uniform(1.0, 4.0);
    script.caught_N = std::max(force_N, BRAKES * weight_N / kinetic);
  }
  Course course = run(script, builder);
  for (int i = 0; i < 8 && course.farthest_mm > WAY_MAX_mm; i++) {
    script.notice_s *= 0.7;
    script.notice_mm *= 0.7;
    if (slides_mm > 0.0) {
      slides_mm *= 0.7;
      pull_by_hand();
    }
    course = run(script, builder);
  }

  Episode episode;
  episode.press = script.name;
  episode.friction = script.friction;
  episode.mass_kg = script.mass_kg;
  episode.speed_mm_s = course.fastest_mm_s;
  Track track;
  double angle_rad = random.uniform(-M_PI, M_PI);
  for (int i = 0; i < 50 && course.farthest_mm * std::abs(std::cos(angle_rad)) > 2.0 * builder.half_x_mm(); i++) {
    angle_rad = random.uniform(-M_PI, M_PI);
  }
  aim(track, angle_rad);
  place_way(track, course.farthest_mm, builder, random);
  const double begin_s = touch_and_hold(episode, track, force_N, random.uniform(0.5, 0.7));
  track.force_N.trace(course.force_N, 1e-5);
  track.pusher_mm.hold(begin_s).trace(course.way_mm, 1e-4);
  track.tangential.load_N.hold(begin_s).trace(course.pull_N, 1e-5);
  track.tangential.friction = Profile(script.friction);
  track.tangential.friction.hold(begin_s).trace(course.friction, 1e-5);
  slide_phases(episode, course.phases, begin_s);
  track.tangential.load_N.ease(TOUCHES_s, 0.0);
  release(episode, track);
  return episode;
}

// A gripped object is turned about the grasp's axis, to either side: rubber winds up until friction gives way, then the object spins.
Episode screw(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double TORQUE_RISES_s = 0.4; // from none to what friction holds
  constexpr double LOADS_s = 0.3;
  Random random(builder.options.seed, SCREW, n);
  const Place place = builder.random_place(random);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const ChosenLoad chosen = choose_load(builder, n);
  const double load_N = chosen.share * force_N;
  const Layer layer = silicone(builder.options.layer_mm);
  const double shear_MPa = 1e-6 * layer.youngs_modulus_Pa / (2.0 * (1.0 + layer.poisson));
  const double radius_mm = builder.table.contact_radius_mm(force_N);
  const double side = random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  const double rate = TWIST_RATES_deg_s[n % TWIST_RATES_deg_s.size()] * DEGREE;
  // Where all of a Hertz contact turns, friction that points against a slow way as well holds it
  // back by (3 pi / 8) mu F v / (turning a): so far it gives way to the load.
  const double way_per_turn_mm = 8.0 / (3.0 * M_PI) * radius_mm * chosen.share / chosen.friction;
  Episode episode;
  episode.press = "screw";
  episode.friction = chosen.friction;
  Track track = track_at(place);
  aim(track, chosen.angle_rad);
  track.tangential.friction = Profile(chosen.friction);
  track.tangential.travel_mm = builder.options.dead_travel_mm;
  track.angle_rad = Profile(random.uniform(-45.0, 45.0) * DEGREE);
  const double begin_s = touch_and_hold(episode, track, force_N, random.uniform(0.5, 0.7));
  Profile &loaded_N = track.tangential.load_N;
  loaded_N.hold(begin_s);
  if (load_N > 0.0) {
    loaded_N.ease(LOADS_s, load_N);
    phase(episode, "load", loaded_N.end_s());
  }
  track.angle_rad.hold(loaded_N.end_s());
  // The torque goes on at one rate; by Masing's rule the rubber follows from each turn of it on
  // along the first curve with both axes doubled.
  const auto wind = [&](const char *name, double from, double to) {
    const double turns = from == 0.0 ? 1.0 : 2.0;
    const int steps = static_cast<int>(std::lround(1e3 * TORQUE_RISES_s * std::abs(to - from)));
    const double angle_rad = track.angle_rad.end_value();
    std::vector<double> angles_rad;
    for (int i = 1; i <= steps; i++) {
      const double change = (to - from) * i / steps;
      angles_rad.push_back(angle_rad + side * turns * wind_up_rad(change / turns, chosen.friction * force_N, shear_MPa, radius_mm));
    }
    track.angle_rad.trace(angles_rad, 1e-5);
    phase(episode, name, track.angle_rad.end_s());
  };
  const auto spin = [&](double way_round, double turn_rad) {
    track.pusher_mm.hold(track.angle_rad.end_s() - track.pusher_mm.end_s());
    if (way_per_turn_mm > 0.0) {
      track.pusher_mm.travel(way_per_turn_mm * turn_rad, way_per_turn_mm * rate, SPEED_UP_s);
    }
    track.angle_rad.travel(way_round * turn_rad, way_round * rate, SPEED_UP_s);
    phase(episode, "spin", track.angle_rad.end_s());
  };
  wind("wind", 0.0, 1.0);
  spin(side, random.uniform(30.0, 90.0) * DEGREE);
  wind("wind", 1.0, -1.0);
  spin(-side, random.uniform(30.0, 90.0) * DEGREE);
  wind("unwind", -1.0, 0.0);
  const double end_s = track.angle_rad.end_s();
  loaded_N.hold(end_s - loaded_N.end_s());
  if (load_N > 0.0) {
    loaded_N.ease(LOADS_s, 0.0);
    phase(episode, "lower", loaded_N.end_s());
  }
  rest_and_release(episode, track, loaded_N.end_s() - begin_s + 0.3);
  return episode;
}

} // namespace fingertip::twin
