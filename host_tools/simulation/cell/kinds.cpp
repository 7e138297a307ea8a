#include "simulation/cell/kinds.hpp"

#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <stdexcept>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { KIND = 861 };

struct Range {
  double low, high;
};

// A row for each quantity, in it the kinds in their order. side: the two sides' friction differs by this share.
// com_share: how far the centre of mass is off, as a share of half of the size; half of the objects have none.
struct Rows {
  Range mass_kg[5], friction[5], kinetic_share[5], side[5], off_mm[5], com_share[5], lift_m_s2[5], delay_s[5];
  double jitter_s[5], lost_share[5], gone_share[5];
  std::uint64_t events_least[5], events_most[5];
  double strength[5];
};
constexpr Rows ALL = {
    {{0.05, 0.6}, {0.05, 1.0}, {0.05, 1.0}, {0.05, 1.0}, {0.0, 0.0}},
    {{0.4, 1.0}, {0.3, 1.0}, {0.25, 0.9}, {0.35, 1.0}, {0.35, 0.9}},
    {{0.9, 1.0}, {0.75, 1.0}, {0.714, 1.0}, {0.75, 1.0}, {0.75, 1.0}},
    {{0.0, 0.05}, {0.0, 0.15}, {0.0, 0.3}, {0.0, 0.15}, {0.0, 0.15}},
    {{0, 1}, {0, 2}, {0, 3}, {0, 2}, {0, 3}},
    {{0, 0}, {0, 0.2}, {0, 0.3}, {0, 0.2}, {0, 0.1}},
    {{0.2, 0.6}, {0.2, 1.2}, {0.5, 2.0}, {0.2, 1.2}, {0.2, 0.8}},
    {{0, 0}, {0, 0.015}, {0.01, 0.04}, {0, 0.015}, {0, 0.015}},
    {2e-4, 1e-3, 3e-3, 1e-3, 1e-3},
    {0, 0.02, 0.05, 0.02, 0.02},
    {0, 0.03, 0.08, 0, 0},
    {0, 1, 2, 1, 0},
    {0, 2, 3, 1, 1},
    {0, 0.7, 1.0, 1.0, 0.4},
};

struct Fragile {
  const char *name;
  Shape shape;
  Range mass_kg;
  double crushes_N;
};
constexpr Fragile FRAGILE[] = {
    {"egg", Shape::egg, {0.05, 0.07}, 25.0}, {"strawberry", Shape::ball, {0.015, 0.035}, 5.0}, {"cup", Shape::cup, {0.01, 0.05}, 3.0}};
constexpr std::array<Shape, 5> DRAWN = {Shape::ball, Shape::box, Shape::plate, Shape::upright, Shape::lying};

// What a shape does to a pad that was drawn under a ball, and how often it is drawn. A line of 30 mm on 12 mm of
// rubber has some three times a ball's force at 1 mm. A flat would have ten times that (Gent and Lindley), but no two
// flats meet all at once: assumed is a ball's force eight times.
struct Stiffer {
  const char *name;
  double times, of_exponent, shear;
};
constexpr Stiffer STIFFER[] = {{"ball", 1.0, 1.0, 1.0},    {"egg", 1.0, 1.0, 1.0},   {"box", 8.0, 0.3, 3.0}, {"plate", 8.0, 0.3, 3.0},
                               {"upright", 3.0, 0.6, 2.0}, {"lying", 3.0, 0.6, 2.0}, {"cup", 3.0, 0.6, 2.0}};

// No grasp needs more than this at its worst, by kinetic friction.
constexpr double NEEDS_MOST_N = 16.0;
// Acceleration of the minimum-jerk way of unit length and time is at most this.
constexpr double EASED_ACCELERATION = 5.7735;

double way_of(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
}
double acceleration_of(double t) { return t <= 0.0 || t >= 1.0 ? 0.0 : 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t); }

double draw(Random &random, const Range &range) { return random.uniform(range.low, range.high); }

struct Drawn {
  Range amount, seconds;
};
constexpr Drawn DRAWN_EVENTS[] = {{{0.03, 0.12}, {0.01, 0.03}}, {{0.3, 1.5}, {0.3, 1.0}}, {{1.0, 5.0}, {0.5, 1.5}},
                                  {{0.3, 1.5}, {0.5, 2.0}},     {{1.0, 4.0}, {0.4, 1.2}}, {{0.2, 0.5}, {0.05, 0.4}}};

Event draw_event(Random &random, std::size_t of, double begin_s, bool calm) {
  Event event{};
  event.begin_s = begin_s;
  event.angle_rad = random.uniform(-M_PI, M_PI);
  event.kind = calm ? (random.next() % 2 ? Event::Kind::carry : Event::Kind::push) : static_cast<Event::Kind>(random.next() % 6);
  const Drawn &drawn = DRAWN_EVENTS[static_cast<std::size_t>(event.kind)];
  event.amount = ALL.strength[of] * draw(random, drawn.amount);
  event.seconds = draw(random, drawn.seconds);
  event.rate_Hz = event.kind == Event::Kind::vibrate ? random.uniform(4.0, 20.0) : 0.0;
  return event;
}

// Shape and size, and what they do to the pads.
void draw_shape(Random &random, std::size_t of, GraspScenario &grasp) {
  if (grasp.kind != Kind::fragile) {
    grasp.shape = DRAWN[random.next() % DRAWN.size()];
  }
  grasp.width_mm = grasp.shape == Shape::plate ? random.uniform(4.0, 12.0) : random.uniform(20.0, 60.0);
  grasp.height_mm = random.uniform(30.0, 80.0);
  grasp.depth_mm = random.uniform(20.0, 60.0);
  const double angle_rad = random.uniform(-M_PI, M_PI);
  const double off_mm = (random.next() % 2 ? 0.5 : 0.0) * grasp.depth_mm * draw(random, ALL.com_share[of]);
  grasp.com_mm = {off_mm * std::cos(angle_rad), off_mm * std::sin(angle_rad)};
  stiffen(grasp);
}

GraspScenario draw_once(Random &random, Kind kind) {
  const auto of = static_cast<std::size_t>(kind);
  GraspScenario grasp{};
  grasp.kind = kind;
  grasp.mass_kg = ALL.mass_kg[of].low > 0.0 ? random.log_uniform(ALL.mass_kg[of].low, ALL.mass_kg[of].high) : 0.0;
  if (kind == Kind::fragile) {
    const Fragile &fragile = FRAGILE[random.next() % std::size(FRAGILE)];
    grasp.object = fragile.name;
    grasp.shape = fragile.shape;
    grasp.mass_kg = draw(random, fragile.mass_kg);
    grasp.crushes_N = fragile.crushes_N;
  }
  const double at_1_mm_N = random.log_uniform(2.0, 5.0), apart = random.uniform(-0.1, 0.1);
  const double friction = draw(random, ALL.friction[of]);
  const double side = (random.next() % 2 ? 0.5 : -0.5) * draw(random, ALL.side[of]);
  const double gain_sd = random.uniform(0.01, 0.05);
  const double delay_s = draw(random, ALL.delay_s[of]);
  for (int i = 0; i < 2; i++) {
    const double sign = i == 0 ? 1.0 : -1.0;
    grasp.pads[static_cast<std::size_t>(i)] = {at_1_mm_N * (1.0 + sign * apart), random.uniform(0.06, 0.3), friction * (1.0 + sign * side),
                                               1.0 + gain_sd * std::clamp(random.normal(), -2.5, 2.5),
                                               delay_s + random.uniform(0.0, 0.002)};
  }
  grasp.exponent = random.uniform(1.3, 1.9);
  grasp.shear_N_mm = random.log_uniform(2.0, 6.0);
  grasp.rubber_N_s_mm = random.uniform(0.004, 0.012);
  grasp.kinetic_share = draw(random, ALL.kinetic_share[of]);
  grasp.stribeck_mm_s = random.log_uniform(1.0, 10.0);
  draw_shape(random, of, grasp);
  grasp.off_mm = (random.next() % 2 ? 1.0 : -1.0) * draw(random, ALL.off_mm[of]);
  grasp.table_friction = random.uniform(0.2, 0.6);
  grasp.opens_mm = 2.0 * std::abs(grasp.off_mm) + random.uniform(2.0, 5.0);
  grasp.waits_s = random.uniform(0.1, 0.4);
  grasp.lift_mm = random.uniform(20.0, 100.0);
  const double lift_m_s2 = draw(random, ALL.lift_m_s2[of]);
  grasp.lift_s = std::sqrt(EASED_ACCELERATION * 1e-3 * grasp.lift_mm / lift_m_s2);
  double t_s = grasp.lift_s;
  const std::uint64_t more = ALL.events_most[of] - ALL.events_least[of] + 1;
  for (std::uint64_t left = ALL.events_least[of] + random.next() % more; left > 0; left--) {
    t_s += random.uniform(0.4, 0.8);
    grasp.events.push_back(draw_event(random, of, t_s, kind == Kind::fragile));
    Event &event = grasp.events.back();
    if (kind == Kind::slick) {
      event = {Event::Kind::slick, t_s, random.uniform(0.005, 0.06), random.uniform(0.25, 0.55), 0.0, 0.0};
    }
    t_s += event.seconds;
  }
  grasp.steady_s = t_s + 0.5;
  grasp.ends_s = grasp.steady_s + 4.0;
  grasp.jitter_s = ALL.jitter_s[of];
  grasp.lost_share = ALL.lost_share[of];
  const double gone = random.uniform(0.0, 1.0);
  grasp.gone = gone < ALL.gone_share[of] ? static_cast<int>(random.next() % 2) : -1;
  grasp.gone_s = random.uniform(-0.1, grasp.steady_s);
  grasp.poll_factor = random.uniform(1.6, 3.2);
  return grasp;
}

} // namespace

const char *name_of(Kind kind) {
  constexpr const char *NAMES[] = {"gentle", "usual", "rough", "slick", "fragile"};
  return NAMES[static_cast<int>(kind)];
}

const char *name_of(Shape shape) { return STIFFER[static_cast<int>(shape)].name; }

Kind kind_of(const std::string &name) {
  if (const Kind *found = find_in(KINDS, [&](Kind kind) { return name == name_of(kind); })) {
    return *found;
  }
  throw std::runtime_error("there is no kind \"" + name +
                           "\"; choose one of: " + joined(KINDS, " ", [](Kind kind) { return name_of(kind); }));
}

const char *name_of(Event::Kind kind) {
  constexpr const char *NAMES[] = {"knock", "push", "vibrate", "pour", "carry", "slick", "lower"};
  return NAMES[static_cast<int>(kind)];
}

GraspScenario::Inputs GraspScenario::inputs(double t_s) const {
  Inputs inputs;
  inputs.mass_kg = mass_kg;
  inputs.lifted_mm = lift_mm * way_of(t_s / lift_s);
  inputs.hand_m_s2.y = 1e-3 * lift_mm * acceleration_of(t_s / lift_s) / (lift_s * lift_s);
  inputs.table = t_s < lift_s;
  for (const Event &event : events) {
    const double share = (t_s - event.begin_s) / event.seconds;
    const bool lasts = share > 0.0 && share < 1.0;
    const Vector way{std::sin(event.angle_rad), std::cos(event.angle_rad)};
    double hand_m_s2 = 0.0, push_N = 0.0;
    switch (event.kind) {
    case Event::Kind::knock: push_N = lasts ? mass_kg * event.amount * 0.5 * M_PI / event.seconds * std::sin(M_PI * share) : 0.0; break;
    case Event::Kind::push:
      push_N = lasts ? event.amount * mass_kg * GRAVITY_m_s2 * std::min(1.0, 8.0 * std::min(share, 1.0 - share)) : 0.0;
      break;
    case Event::Kind::vibrate: hand_m_s2 = lasts ? event.amount * std::sin(2.0 * M_PI * event.rate_Hz * share * event.seconds) : 0.0; break;
    case Event::Kind::pour: inputs.mass_kg += event.amount * mass_kg * way_of(share); break;
    case Event::Kind::carry: hand_m_s2 = event.amount / EASED_ACCELERATION * acceleration_of(share); break;
    case Event::Kind::slick: inputs.friction_share *= 1.0 - event.amount * way_of(share); break;
    case Event::Kind::lower:
      inputs.lifted_mm -= (inputs.lifted_mm + event.beyond_mm) * way_of(share);
      inputs.hand_m_s2.y -= 1e-3 * (lift_mm + event.beyond_mm) * acceleration_of(share) / (event.seconds * event.seconds);
      inputs.table = inputs.table || share > 0.0;
    }
    inputs.hand_m_s2.x += hand_m_s2 * way.x;
    inputs.hand_m_s2.y += hand_m_s2 * way.y;
    inputs.push_N.x += push_N * way.x;
    inputs.push_N.y += push_N * way.y;
  }
  return inputs;
}

double GraspScenario::least_N(double t_s) const {
  const Inputs now = inputs(t_s);
  const double x_N = now.push_N.x - now.mass_kg * now.hand_m_s2.x;
  const double y_N = now.push_N.y - now.mass_kg * (GRAVITY_m_s2 + now.hand_m_s2.y);
  return std::hypot(x_N, y_N) / (now.friction_share * (pads[0].friction + pads[1].friction));
}

void stiffen(GraspScenario &grasp) {
  const Stiffer &stiffer = STIFFER[static_cast<int>(grasp.shape)];
  for (PadProperties &pad : grasp.pads) {
    pad.at_1_mm_N *= stiffer.times;
  }
  grasp.exponent = 1.0 + stiffer.of_exponent * (grasp.exponent - 1.0);
  grasp.shear_N_mm *= stiffer.shear;
}

GraspScenario draw_grasp(Kind kind, std::uint64_t seed, std::uint64_t n) {
  Random random(seed, KIND + static_cast<std::uint64_t>(kind), n);
  for (;;) {
    GraspScenario grasp = draw_once(random, kind);
    double worst_N = 0.0;
    for (double t_s = 0.0; t_s < grasp.steady_s; t_s += 0.01) {
      worst_N = std::max(worst_N, grasp.least_N(t_s) / grasp.kinetic_share);
    }
    // What breaks before it holds cannot be grasped at all.
    if (worst_N <= std::min(NEEDS_MOST_N, 0.5 * grasp.crushes_N)) {
      return grasp;
    }
  }
}

} // namespace fingertip::cell
