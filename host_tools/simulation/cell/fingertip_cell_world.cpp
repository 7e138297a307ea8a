#include "simulation/cell/fingertip_cell_world.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

constexpr double STEP_s = 2.5e-4;                    // between two samples of the gripper
constexpr double STEADY = 0.1, STEADY_LEAST_N = 0.2; // a force that changes by this share at most is steady
constexpr double STEADY_s = 1.0;                     // then it is lifted
constexpr double LOST_N = 0.01;

struct Known {
  Event::Kind kind;
  double low, high, seconds; // the last 0: as the amount
};
// Ranges keep the physics within its steps.
constexpr Known KNOWN[] = {{Event::Kind::pour, 0.0, 5.0, 1.0},
                           {Event::Kind::knock, 0.0, 0.5, 0.02},
                           {Event::Kind::slick, 0.0, 0.95, 0.5},
                           {Event::Kind::lower, 0.2, 10.0, 0.0}};

GraspScenario grasp_of(const World::Options &options) {
  GraspScenario grasp = options.grasp;
  for (Event event : options.planned) {
    event.begin_s += grasp.lift_s;
    grasp.events.push_back(event);
  }
  return grasp;
}

} // namespace

Event planned(const std::string &text) {
  const std::size_t colon = text.find(':'), at = text.find('@');
  if (colon != std::string::npos) {
    const std::string name = text.substr(0, colon);
    const auto amount = to_double(std::string_view(text).substr(colon + 1, at == std::string::npos ? at : at - colon - 1));
    const auto after_s = at == std::string::npos ? 0.0 : to_double(std::string_view(text).substr(at + 1));
    const Known *known = find_in(KNOWN, [&](const Known &one) { return name == name_of(one.kind); });
    if (known && amount && *amount >= known->low && *amount <= known->high && after_s && *after_s >= 0.0 && *after_s <= 1e6) {
      return {known->kind, *after_s, known->seconds > 0.0 ? known->seconds : *amount, *amount};
    }
  }
  throw Error(ErrorCode::bad_value, "\"" + text +
                                        "\" is no disturbance; give pour:0..5 (masses), knock:0..0.5 (m/s), slick:0..0.95 "
                                        "(share of friction) or lower:0.2..10 (s), and @SECONDS after the lift");
}

bool is_disturbance(const std::string &name) {
  return find_in(KNOWN, [&](const Known &one) { return name == name_of(one.kind); }) != nullptr;
}

World::World(const Options &options, const Face &face, GripperMotion &motion)
    : options_(options), grasp_(grasp_of(options)), face_(face), motion_(motion), cell_(make_cell(grasp_)) {
  motion.blocked_at = [this](double width_mm, double force_N) {
    return is_there_ && force_N > 0.0 && cell_->force_at_N(width_mm) >= force_N;
  };
}

bool World::lift() {
  if (lift_s_) {
    return false;
  }
  lift_s_ = time_s_;
  events_.push_back("lift");
  return true;
}

bool World::disturb(Event event) {
  if (since_lift_s() < grasp_.lift_s || !is_there_) {
    return false;
  }
  event.begin_s = since_lift_s();
  grasp_.events.push_back(event);
  return true;
}

void World::advance(double seconds) {
  for (double left_s = seconds; left_s > 0.0; left_s -= STEP_s) {
    const double step_s = std::min(STEP_s, left_s);
    motion_.step(step_s);
    if (is_there_) {
      cell_->run(step_s, motion_.width_mm(), grasp_.inputs(lift_s_ ? since_lift_s() + 0.5 * step_s : -1.0));
    }
    time_s_ += step_s;
    watch_force();
    watch_object();
  }
}

void World::watch_force() {
  const double force_N = is_there_ ? cell_->mean_N() : 0.0;
  peak_N_ = std::max(peak_N_, force_N);
  if (force_N > grasp_.crushes_N && !is_crushed_) {
    is_crushed_ = true;
    events_.push_back("crushed");
  }
  if (lift_s_ || !options_.lifts_by_itself) {
    return;
  }
  if (!steady_ || force_N < STEADY_LEAST_N || std::abs(force_N - steady_->force_N) > STEADY * steady_->force_N) {
    steady_ = {time_s_, force_N};
  } else if (time_s_ - steady_->since_s >= STEADY_s) {
    lift();
  }
}

void World::watch_object() {
  const double since_s = since_lift_s();
  if (!is_there_) {
    return;
  }
  begun_.resize(grasp_.events.size());
  for (std::size_t i = 0; i < begun_.size(); i++) {
    if (!begun_[i] && since_s >= grasp_.events[i].begin_s) {
      begun_[i] = true;
      events_.push_back(name_of(grasp_.events[i].kind));
    }
  }
  const bool slipped = slips_.go_on();
  slips_.sample(time_s_, cell_->slips(), cell_->mean_N(), cell_->slid_mm());
  if (slips_.go_on() != slipped) {
    events_.push_back(slipped ? "caught after " + fixed(slips_.slips.back().way_mm, 2) + " mm" : "slip");
  }
  const Vector way = cell_->way_mm();
  const bool in_the_air = lift_s_ && !grasp_.inputs(since_s).table;
  if (std::hypot(way.x, way.y) >= DROP_mm || (in_the_air && cell_->mean_N() < LOST_N)) {
    is_dropped_ = true;
    slips_.end();
    is_there_ = false;
    events_.push_back("dropped");
  }
}

std::string World::cells() const {
  double load_N = 0.0;
  for (const std::size_t finger : {0U, 1U}) {
    const Vector load = cell_->load_N(finger);
    load_N += is_there_ ? 0.5 * std::hypot(load.x, load.y) : 0.0;
  }
  const double since_s = since_lift_s();
  const double least_N = is_there_ && since_s >= grasp_.lift_s ? grasp_.least_N(since_s) : 0.0;
  const double friction = 0.5 * (cell_->friction(0) + cell_->friction(1));
  std::string text = fixed(time_s_, 5);
  for (const double value : {motion_.width_mm(), is_there_ ? cell_->mean_N() : 0.0, peak_N_, load_N, least_N, cell_->slid_mm(),
                             -cell_->way_mm().y, friction, grasp_.inputs(since_s).lifted_mm}) {
    text += "," + fixed(value, 4);
  }
  for (const bool value : {is_there_ && cell_->slips(), is_there_, is_dropped_, is_crushed_}) {
    text += value ? ",1" : ",0";
  }
  return text;
}

} // namespace fingertip::cell
