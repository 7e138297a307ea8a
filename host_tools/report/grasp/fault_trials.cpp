#include "grasp/fault_trials.hpp"

#include "grasp/settings.hpp"

#include <algorithm>
#include <limits>
#include <set>

namespace fingertip::grasp {

using namespace cell;

namespace {

using Kind = Fault::Kind;

constexpr double LAYER_mm = 12.0, UNLIMITED = std::numeric_limits<double>::infinity();
constexpr std::uint64_t SEED = 1001;

struct Thing {
  const char *name, *face;
  double mass_kg, friction, stiffness_N_mm, crushes_N, cap_N;
};
constexpr Thing THINGS[] = {{"paper cup", "sphere18", 0.05, 0.6, 5.0, 5.0, 4.0},
                            {"lime", "lime", 0.1, 0.5, UNLIMITED, UNLIMITED, 8.0},
                            {"ball", "sphere24", 0.25, 0.5, UNLIMITED, UNLIMITED, 10.0}};

enum Fingers { NONE = 0, LEFT = 1, BOTH = 3 };
constexpr std::uint32_t LEFT_STALE = GRIP_FINGER_0_STALE, STALE = GRIP_FINGER_0_STALE | GRIP_FINGER_1_STALE;
constexpr std::uint32_t FROZEN = GRIP_FINGER_0_FROZEN | GRIP_FINGER_1_FROZEN;
constexpr std::uint32_t FORCE_ONLY = GRIP_FINGER_0_FORCE_ONLY | GRIP_FINGER_1_FORCE_ONLY;
constexpr std::uint32_t OVER = GRIP_FINGER_0_OVER | GRIP_FINGER_1_OVER;

struct Happening {
  const char *name;
  Kind kind;
  Fingers fingers = NONE;
  std::uint32_t all_of = 0, any_of = 0;
  double lasts_s = UNLIMITED;
};
constexpr Happening HAPPENINGS[] = {
    {"nothing", Kind::none},
    {"one fingertip gone", Kind::gone, LEFT, LEFT_STALE},
    {"both fingertips gone", Kind::gone, BOTH, STALE},
    {"both gone for 0.5 s", Kind::gone, BOTH, STALE, 0, 0.5},
    {"one frozen", Kind::frozen, LEFT, GRIP_FINGER_0_FROZEN},
    {"both frozen", Kind::frozen, BOTH, FROZEN},
    {"one lies, UNCERTAIN", Kind::uncertain, LEFT, GRIP_FINGER_0_FORCE_ONLY},
    {"both lie, UNCERTAIN", Kind::uncertain, BOTH, FORCE_ONLY},
    {"one SATURATED", Kind::saturated, LEFT, GRIP_FINGER_0_OVER},
    {"both SATURATED", Kind::saturated, BOTH, OVER},
    {"gripper silent", Kind::silent, NONE, GRIP_GRIPPER_SILENT},
    {"silent for 1 s", Kind::silent, NONE, GRIP_GRIPPER_SILENT, 0, 1.0},
    {"fault 9", Kind::fault, NONE, GRIP_GRIPPER_FAULT},
    {"power lost", Kind::power, NONE, GRIP_GRIPPER_INACTIVE},
    {"garbage", Kind::garbage, NONE, GRIP_GRIPPER_SILENT},
    {"no answers", Kind::unanswered, NONE, GRIP_GRIPPER_SILENT},
    {"no answers for 0.3 s", Kind::unanswered, NONE, 0, 0, 0.3},
    {"half is garbage", Kind::noisy},
    {"answers 30 ms late", Kind::late},
    {"latency timer, 16 ms", Kind::latency_timer},
    {"object gone", Kind::taken},
};

struct When {
  const char *name;
  std::uint8_t state;
  double after_s, watched_s;
};
constexpr When STATES[] = {{"activate", GRIP_ACTIVATING, 0.3, 7.0}, {"approach", GRIP_APPROACH, 0.05, 3.0},
                           {"squeeze", GRIP_SQUEEZE, 0.02, 2.5},    {"ready", GRIP_READY, 0.02, 2.5},
                           {"holding", GRIP_HOLDING, 0.8, 2.0},     {"slipping", GRIP_SLIPPING, 0.0, 2.0},
                           {"still", GRIP_STILL, 0.05, 2.0},        {"release", GRIP_RELEASE, 0.02, 2.0}};

Trial trial_of(const Thing &thing, const std::string &gripper, const When &when, const Happening &happening,
               std::uint64_t n) {
  Trial trial;
  trial.gripper = gripper_mechanics(gripper);
  Scene &scene = trial.scene;
  scene.face = thing.face;
  scene.object.mass_kg = thing.mass_kg;
  scene.object.friction = thing.friction;
  scene.object.stiffness_N_mm = thing.stiffness_N_mm;
  scene.object.crushes_N = thing.crushes_N;
  scene.opens_mm = 2.0;
  scene.lift_mm = 5.0;
  scene.lift_s = 0.3;
  scene.ends_s = 60.0;
  trial.seed = SEED + n;
  for (std::size_t f = 0; f < 2; f++) {
    trial.rubber[f].gain.fill(f == 0 ? 0.95 : 1.0);
  }
  trial.activates = when.state == GRIP_ACTIVATING;
  if (trial.activates) {
    scene.object.width_mm = trial.gripper.traits.stroke_mm - scene.opens_mm;
  }
  if (when.state == GRIP_SLIPPING) {
    trial.slick_after_s = 0.6;
  }
  if (when.state == GRIP_STILL || when.state == GRIP_RELEASE) {
    trial.asked = when.state == GRIP_STILL ? GRIP_REQUEST_HOLD : GRIP_REQUEST_RELEASE;
    trial.asked_after_s = 0.8;
  }
  Fault fault;
  fault.kind = happening.kind;
  fault.fingers = {(happening.fingers & 1) != 0, (happening.fingers & 2) != 0};
  fault.state = when.state;
  // A servo is active at once.
  fault.after_s = trial.activates && trial.gripper.activation_s == 0.0 ? 0.0 : when.after_s;
  fault.lasts_s = happening.lasts_s;
  fault.watched_s = when.watched_s;
  trial.fault = fault;
  return trial;
}

// What must be reported, where that depends on the state.
void expect(FaultTrial &one, const When &when, const Happening &happening) {
  one.all_of = happening.all_of;
  one.any_of = happening.any_of;
  const bool untouched = when.state == GRIP_ACTIVATING || when.state == GRIP_APPROACH;
  if (happening.kind == Kind::frozen && untouched) {
    one.is_untold = happening.fingers == BOTH;
    one.all_of = 0;
    one.any_of = one.is_untold ? 0 : GRIP_FINGER_0_FROZEN | GRIP_FINGERS_DIFFER;
  }
  one.gripper_fault = happening.kind == Kind::fault ? 9 : 0;
  if (happening.kind == Kind::fault || happening.kind == Kind::power) {
    one.ends_in = {GRIP_FAULT};
  } else if (happening.kind == Kind::taken && when.state == GRIP_RELEASE) {
    one.ends_in = {GRIP_RELEASE, GRIP_OPEN}; // as it was asked to
  } else if (happening.kind == Kind::taken) {
    one.ends_in = {untouched ? std::uint8_t{GRIP_MISSED} : std::uint8_t{GRIP_DROPPED}};
  }
  if (when.state == GRIP_ACTIVATING && happening.kind == Kind::power) {
    one.ends_in.clear(); // it reports that it is not active when it should be, and waits for it
  }
  // As long as it takes to close, or to give up.
  if (untouched && (happening.kind == Kind::taken || happening.kind == Kind::power)) {
    one.trial.fault->watched_s = 17.0;
  }
}

// What fails is a line's and a drive's, not a stroke's.
std::vector<std::string> one_of_each_driver() {
  std::vector<std::string> models;
  std::set<GripperDriver> seen;
  for (const GripperTraits &traits : gripper_models()) {
    if (seen.insert(traits.driver).second) {
      models.push_back(traits.model);
    }
  }
  return models;
}

} // namespace

std::vector<FaultTrial> fault_trials() {
  std::vector<FaultTrial> all;
  for (const std::string &gripper : one_of_each_driver()) {
    for (const Thing &thing : THINGS) {
      for (const When &when : STATES) {
        for (const Happening &happening : HAPPENINGS) {
          FaultTrial one;
          one.fault = happening.name;
          one.state = when.name;
          one.gripper = gripper;
          one.object = thing.name;
          one.trial = trial_of(thing, gripper, when, happening, all.size());
          one.cap_N = thing.cap_N;
          expect(one, when, happening);
          one.opens_mm = when.state == GRIP_RELEASE ? UNLIMITED : OPENS_mm;
          all.push_back(one);
        }
      }
    }
  }
  return all;
}

FaultRunner::FaultRunner(const std::string &cache) {
  for (const Thing &thing : THINGS) {
    faces_.emplace(thing.face, Face(thing.face, LAYER_mm, cache));
  }
}

FaultOutcome FaultRunner::run(const FaultTrial &one) const {
  const GripperTraits &traits = one.trial.gripper.traits;
  CoreController controller(settings_for(traits, {{"cap", one.cap_N}}), traits);
  FaultOutcome done{};
  done.outcome = run_trial(one.trial, faces_.at(one.trial.scene.face), controller);
  const Failed &failed = done.outcome.failed;
  done.opened = failed.opened_mm > one.opens_mm;
  done.beyond_cap = done.outcome.peak_N > one.cap_N;
  const auto ends = std::find(one.ends_in.begin(), one.ends_in.end(), failed.state);
  done.unsaid = (!one.ends_in.empty() && ends == one.ends_in.end()) || failed.gripper_fault != one.gripper_fault ||
                (failed.trouble & one.all_of) != one.all_of || (one.any_of != 0 && (failed.trouble & one.any_of) == 0);
  return done;
}

} // namespace fingertip::grasp
