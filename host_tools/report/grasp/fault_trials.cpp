#include "report/grasp/fault_trials.hpp"

#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/in_parallel.hpp"
#include "simulation/cell/kind_trial.hpp"

#include <algorithm>
#include <map>

namespace fingertip::grasp {

using namespace cell;

namespace {

using FaultKind = Fault::Kind;

constexpr double UNLIMITED = std::numeric_limits<double>::infinity();
constexpr std::uint64_t SEED = 1001;
// More than the same grasp opens without the fault: a first grip comes down to what the load needs, of the cup by 1.5 mm.
constexpr double OPENS_mm = 1.0;

struct TestObject {
  const char *name;
  double mass_kg, friction, at_1_mm_N, exponent, crushes_N, cap_N;
};
constexpr TestObject TEST_OBJECTS[] = {{"paper cup", 0.05, 0.6, 2.5, 1.3, 5.0, 4.0}, {"ball", 0.25, 0.5, 3.0, 1.6, UNLIMITED, 10.0}};

enum Fingers { NONE = 0, LEFT = 1, BOTH = 3 };
constexpr std::uint32_t LEFT_STALE = GRIP_FINGER_0_STALE, STALE = GRIP_FINGER_0_STALE | GRIP_FINGER_1_STALE;
constexpr std::uint32_t FROZEN = GRIP_FINGER_0_FROZEN | GRIP_FINGER_1_FROZEN;
constexpr std::uint32_t FORCE_ONLY = GRIP_FINGER_0_FORCE_ONLY | GRIP_FINGER_1_FORCE_ONLY;
constexpr std::uint32_t OVER = GRIP_FINGER_0_OVER | GRIP_FINGER_1_OVER;

struct FaultCase {
  const char *name;
  FaultKind kind;
  Fingers fingers = NONE;
  std::uint32_t all_of = 0;
  double lasts_s = UNLIMITED;
};
constexpr FaultCase FAULT_CASES[] = {
    {"nothing", FaultKind::none},
    {"one fingertip gone", FaultKind::gone, LEFT, LEFT_STALE},
    {"both fingertips gone", FaultKind::gone, BOTH, STALE},
    {"both gone for 0.5 s", FaultKind::gone, BOTH, STALE, 0.5},
    {"one frozen", FaultKind::frozen, LEFT, GRIP_FINGER_0_FROZEN},
    {"both frozen", FaultKind::frozen, BOTH, FROZEN},
    {"one reports nothing", FaultKind::nothing, LEFT, GRIP_FINGER_0_EMPTY},
    {"one lies, UNCERTAIN", FaultKind::uncertain, LEFT, GRIP_FINGER_0_FORCE_ONLY},
    {"both lie, UNCERTAIN", FaultKind::uncertain, BOTH, FORCE_ONLY},
    {"one SATURATED", FaultKind::saturated, LEFT, GRIP_FINGER_0_OVER},
    {"both SATURATED", FaultKind::saturated, BOTH, OVER},
    {"gripper silent", FaultKind::silent, NONE, GRIP_GRIPPER_SILENT},
    {"silent for 1 s", FaultKind::silent, NONE, GRIP_GRIPPER_SILENT, 1.0},
    {"fault 9", FaultKind::fault, NONE, GRIP_GRIPPER_FAULT},
    {"power lost", FaultKind::power, NONE, GRIP_GRIPPER_INACTIVE},
    {"no answers", FaultKind::unanswered, NONE, GRIP_GRIPPER_SILENT},
    {"no answers for 0.3 s", FaultKind::unanswered, NONE, 0, 0.3},
    {"half is lost", FaultKind::noisy},
    {"answers 30 ms late", FaultKind::late},
    {"object gone", FaultKind::taken},
};

struct StateCase {
  const char *name;
  std::uint8_t state;
  double after_s, watched_s;
  std::optional<GripRequest> asked = {};
};
constexpr StateCase STATES[] = {{"activate", GRIP_ACTIVATING, 0.3, 7.0},
                                {"approach", GRIP_APPROACH, 0.05, 3.0},
                                {"squeeze", GRIP_SQUEEZE, 0.02, 2.5},
                                {"ready", GRIP_READY, 0.02, 2.5},
                                {"holding", GRIP_HOLDING, 0.8, 2.0},
                                {"slipping", GRIP_SLIPPING, 0.0, 2.0},
                                {"still", GRIP_STILL, 0.05, 2.0, GRIP_REQUEST_HOLD},
                                {"placing", GRIP_PLACING, 0.05, 2.0, GRIP_REQUEST_PLACE},
                                {"handing", GRIP_HANDING, 0.05, 2.0, GRIP_REQUEST_HAND_OVER},
                                {"release", GRIP_RELEASE, 0.02, 2.0, GRIP_REQUEST_RELEASE}};

struct FaultTrial {
  const TestObject &object;
  const StateCase &state_case;
  const FaultCase &fault_case;
  GraspTrial trial;
  // What must be reported, of GripTrouble: each of these, one of those; and where it must end.
  std::uint32_t all_of = 0, any_of = 0;
  std::vector<std::uint8_t> ends_in = {}; // empty: anywhere
  bool is_untold = false;
};

GraspTrial trial_of(const TestObject &object, const std::string &gripper, const StateCase &state_case, const FaultCase &fault_case,
                    std::uint64_t n) {
  GraspTrial trial;
  trial.gripper = gripper_mechanics(gripper);
  trial.seed = SEED + n;
  GraspScenario &grasp = trial.grasp;
  grasp.mass_kg = object.mass_kg;
  grasp.exponent = object.exponent;
  grasp.crushes_N = object.crushes_N;
  for (PadProperties &pad : grasp.pads) {
    pad.friction = object.friction;
    pad.at_1_mm_N = object.at_1_mm_N;
  }
  grasp.pads[0].gain = 0.95;
  grasp.opens_mm = 2.0;
  grasp.lift_mm = 5.0;
  grasp.lift_s = 0.3;
  grasp.ends_s = 60.0;
  trial.activates = state_case.state == GRIP_ACTIVATING;
  grasp.width_mm = trial.activates ? trial.gripper.traits.stroke_mm - grasp.opens_mm : grasp.width_mm;
  trial.slick_after_s = state_case.state == GRIP_SLIPPING ? std::optional(0.6) : std::nullopt;
  trial.asked = state_case.asked;
  trial.asked_after_s = 0.8;
  Fault fault;
  fault.kind = fault_case.kind;
  fault.fingers = {(fault_case.fingers & 1) != 0, (fault_case.fingers & 2) != 0};
  fault.state = state_case.state;
  // A servo is active at once.
  fault.after_s = trial.activates && trial.gripper.activation_s == 0.0 ? 0.0 : state_case.after_s;
  fault.lasts_s = fault_case.lasts_s;
  fault.watched_s = state_case.watched_s;
  fault.is_followed_by_pouring = state_case.state != GRIP_HANDING; // which pulls
  trial.fault = fault;
  return trial;
}

// What must be reported, where that depends on the state.
void expect(FaultTrial &one) {
  const std::uint8_t state = one.state_case.state;
  const FaultKind kind = one.fault_case.kind;
  const bool untouched = state == GRIP_ACTIVATING || state == GRIP_APPROACH, squeezes = state == GRIP_SQUEEZE;
  one.all_of = one.fault_case.all_of;
  if (kind == FaultKind::frozen && untouched) {
    one.is_untold = one.fault_case.fingers == BOTH;
    one.all_of = 0;
    one.any_of = one.is_untold ? 0 : GRIP_FINGER_0_FROZEN | GRIP_FINGERS_DIFFER;
  } else if (kind == FaultKind::nothing && (untouched || state == GRIP_RELEASE)) {
    one.all_of = untouched ? std::uint32_t{GRIP_FINGERS_DIFFER} : 0u;
  } else if (kind == FaultKind::nothing && squeezes) {
    one.all_of = 0; // it may have touched with too little force to be missed
    one.any_of = GRIP_FINGER_0_EMPTY | GRIP_FINGERS_DIFFER;
  } else if (kind == FaultKind::fault || (kind == FaultKind::power && state != GRIP_ACTIVATING)) {
    one.ends_in = {GRIP_FAULT}; // without power while it is activated it reports that it is not active, and waits for it
  } else if (kind == FaultKind::taken && (state == GRIP_RELEASE || state == GRIP_HANDING)) {
    one.ends_in = {GRIP_RELEASE, GRIP_OPEN}; // as it was asked to
  } else if (kind == FaultKind::taken && squeezes) {
    one.ends_in = {GRIP_DROPPED, GRIP_MISSED}; // so soon after the touch that the approach may go on
  } else if (kind == FaultKind::taken) {
    one.ends_in = {untouched ? std::uint8_t{GRIP_MISSED} : std::uint8_t{GRIP_DROPPED}};
  }
  // As long as it takes to close, or to give up.
  if ((untouched && kind == FaultKind::power) || ((untouched || squeezes) && kind == FaultKind::taken)) {
    one.trial.fault->watched_s = 17.0;
  }
}

TrialOutcome outcome_of(const Face &face, const FaultTrial &one, const GraspTrial &trial) {
  const GripperTraits &traits = trial.gripper.traits;
  CoreController controller(settings_for(traits, {{"cap", one.object.cap_N}}), traits);
  return run_trial(trial, face, controller);
}

// The same without the fault, which decides how far it may open.
double may_open_mm(const Face &face, const FaultTrial &one) {
  GraspTrial sound = one.trial;
  sound.fault->lasts_s = 0.0;
  return outcome_of(face, one, sound).failed.opened_mm + OPENS_mm;
}

nlohmann::ordered_json row_of(const Face &face, const FaultTrial &one, double may_open_mm) {
  const double cap_N = one.object.cap_N;
  const TrialOutcome outcome = outcome_of(face, one, one.trial);
  const FaultOutcome &failed = outcome.failed;
  const bool ends = one.ends_in.empty() || std::find(one.ends_in.begin(), one.ends_in.end(), failed.state) != one.ends_in.end();
  const bool reports = (failed.trouble & one.all_of) == one.all_of && (one.any_of == 0 || (failed.trouble & one.any_of) != 0) &&
                       failed.gripper_fault == (one.fault_case.kind == FaultKind::fault ? 9 : 0);
  return {{"fault", one.fault_case.name},
          {"state", one.state_case.name},
          {"gripper", one.trial.gripper.traits.model},
          {"object", one.object.name},
          {"begun", failed.begun},
          {"untold", one.is_untold},
          {"reported", trouble_names(failed.trouble)},
          {"ends", state_name(failed.state)},
          {"opened_mm", failed.opened_mm},
          {"peak_N", outcome.peak_N},
          {"cap_N", cap_N},
          {"crushed", outcome.crushed},
          {"opened", one.state_case.state != GRIP_RELEASE && failed.opened_mm > may_open_mm},
          {"beyond_cap", outcome.peak_N > cap_N},
          {"unsaid", !ends || !reports}};
}

} // namespace

nlohmann::ordered_json fault_rows(const Face &face, std::uint64_t jobs) {
  std::vector<FaultTrial> all;
  std::uint64_t grasps = 0;
  std::map<GripperDriver, std::string> models; // one of each: what fails is a line's and a drive's, not a stroke's
  for (const GripperTraits &traits : gripper_models()) {
    models.emplace(traits.driver, traits.model);
  }
  for (const auto &[driver, gripper] : models) {
    for (const TestObject &object : TEST_OBJECTS) {
      for (const StateCase &state_case : STATES) {
        grasps++;
        for (const FaultCase &fault_case : FAULT_CASES) {
          all.push_back({object, state_case, fault_case, trial_of(object, gripper, state_case, fault_case, grasps)});
          expect(all.back());
        }
      }
    }
  }
  std::vector<double> may_open(grasps);
  twin::in_parallel(
      grasps, [&](std::size_t i) { may_open[i] = may_open_mm(face, all[i * std::size(FAULT_CASES)]); }, jobs);
  std::vector<nlohmann::ordered_json> rows(all.size());
  twin::in_parallel(
      all.size(), [&](std::size_t i) { rows[i] = row_of(face, all[i], may_open[i / std::size(FAULT_CASES)]); }, jobs);
  return rows;
}

} // namespace fingertip::grasp
