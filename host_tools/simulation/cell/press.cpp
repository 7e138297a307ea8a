#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "simulation/cell/hand_server.hpp"
#include "simulation/cell/simulations.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { PLACES = 862 };

constexpr double GRAVITY_m_s2 = 9.80665;
constexpr std::chrono::milliseconds ROUND{1}, VALIDATED_ROUND{5}; // a validation takes 50 frames a second
// Placements to the outer sensors, as the twin's. Each lasts long enough for a calibration to take it.
constexpr double RESTS_s = 1.2, SETS_DOWN_s = 0.15, HOLDS_s = 1.5;
constexpr double FOLLOWS_s = 0.012; // time constant of the ball after the hand
constexpr double LIFTED_N = 0.005;
constexpr double PERIOD_s = RESTS_s + SETS_DOWN_s + HOLDS_s + SETS_DOWN_s;

// The van der Corput sequence, 0 to 1: evenly spread for any count.
double spread(std::uint64_t number, unsigned base) {
  double sum = 0.0, part = 1.0;
  for (; number > 0; number /= base) {
    part /= base;
    sum += part * static_cast<double>(number % base);
  }
  return sum;
}

// One fingertip's weight and rubber.
class Pressed {
public:
  Pressed(const Face &face, const SimulationOptions &options, std::uint64_t seed)
      : face_(face), weight_N_(1e-3 * options.weight_g * GRAVITY_m_s2),
        rubber_(twin::parse_effects("memory,aftereffect"), SENSORS, LAYER_mm, AIR_Pa, seed), sensed_Pa_(SENSORS) {
    Random random(seed, PLACES, 0);
    begin_x_ = random.uniform(0.0, 1.0);
    begin_y_ = random.uniform(0.0, 1.0);
  }

  // Set down by the clock.
  void advance(double time_s) {
    const double number = std::floor(time_s / PERIOD_s);
    const double since_s = time_s - number * PERIOD_s - RESTS_s;
    const auto place = static_cast<std::uint64_t>(number);
    touch_ = {};
    touch_.x_mm = twin::outermost_mm(geometry.x_mm) * (2.0 * std::fmod(begin_x_ + spread(place, 2), 1.0) - 1.0);
    touch_.y_mm = twin::outermost_mm(geometry.y_mm) * (2.0 * std::fmod(begin_y_ + spread(place, 3), 1.0) - 1.0);
    touch_.force_N = weight_N_ * (smooth(since_s / SETS_DOWN_s) - smooth((since_s - SETS_DOWN_s - HOLDS_s) / SETS_DOWN_s));
    sense(time_s);
  }
  // Follows the hand instead.
  void follow(double time_s, const std::optional<HandAt> &hand) {
    const double share = 1.0 - std::exp(-(time_s - followed_s_) / FOLLOWS_s);
    followed_s_ = time_s;
    if (hand) {
      const bool comes = touch_.force_N == 0.0; // it comes down where the hand is
      touch_.x_mm += (comes ? 1.0 : share) * (hand->x_mm - touch_.x_mm);
      touch_.y_mm += (comes ? 1.0 : share) * (hand->y_mm - touch_.y_mm);
    }
    touch_.force_N += share * ((hand ? hand->force_N : 0.0) - touch_.force_N);
    if (!hand && touch_.force_N < LIFTED_N) {
      touch_.force_N = 0.0;
    }
    sense(time_s);
  }
  const Patch &touch() const { return touch_; }
  const Pressures &pressures_Pa() const { return sensed_Pa_; }
  // x_mm, y_mm, force_N; places only while it touches.
  std::string cells() const {
    const std::array values = {touch_.x_mm, touch_.y_mm, touch_.force_N};
    return touch_.force_N > 0.0 ? joined(values, ",", [](double value) { return fixed(value, 5); }) : ",,0";
  }

private:
  void sense(double time_s) { rubber_.report(time_s, face_.base_Pa(touch_), sensed_Pa_); }

  const Face &face_;
  double weight_N_, followed_s_ = 0.0;
  twin::Pad rubber_;
  double begin_x_, begin_y_; // of both sequences
  Patch touch_;
  Pressures sensed_Pa_;
};

std::string head_of(const SimulationOptions &options, const std::vector<FingerProcess> &fingers) {
  std::ostringstream text;
  text << "# simulated: the truth of presses; time_us is CLOCK_MONOTONIC\n# weight_g: " << options.weight_g << "\n# seed: " << options.seed;
  std::string columns = "\ntime_us";
  for (std::size_t i = 0; i < fingers.size(); i++) {
    text << "\n# gain_" << SIDES[i] << ":";
    for (std::size_t k = 0; k < SENSORS; k++) {
      text << " " << fingers[i].gain[k];
    }
    for (const char *column : {"x_mm", "y_mm", "force_N"}) {
      columns += std::string(",") + SIDES[i] + "_" + column;
    }
  }
  text << columns << "\n";
  return text.str();
}

// What each round gives, of a host's time and of the time since it began, goes to the fingertips.
template <typename Round>
void run(FingertipProcesses &fingers, std::optional<double> seconds, std::chrono::milliseconds every, Round round) {
  const std::int64_t began_us = steady_now_us();
  std::int64_t last_us = 0;
  double time_s = 0.0;
  while (!interrupted && !(seconds && time_s >= *seconds)) {
    fingers.share(every);
    const std::int64_t now_us = steady_now_us();
    time_s = 1e-6 * static_cast<double>(now_us - began_us);
    if (now_us - last_us >= 1000 * every.count()) {
      last_us = now_us;
      fingers.put(now_us, round(now_us, time_s));
      fingers.check();
    }
  }
}

} // namespace

void press(const SimulationOptions &options, const PortFolder &place) {
  const Face face(PRESS_FACE, options.cache);
  const auto processes = place.fingers(options.fingertips, options.seed, options.gain_spread.value_or(0.1), true);
  FingertipProcesses fingers(place, processes);
  Truth truth(options.truth, options.overwrite, head_of(options, processes));
  std::vector<Pressed> pressed;
  for (std::size_t i = 0; i < fingers.count(); i++) {
    pressed.emplace_back(face, options, 2 * options.seed + i);
  }
  std::optional<HandServer> hands;
  if (place.is_shared() || options.by_hand) {
    hands.emplace(place, fingers.count(), options.by_hand);
  }
  fingers.wait_until_ready();
  place.print_ready(fingers.count());
  if (options.by_hand) {
    std::fprintf(stderr, "press it with the pointer in the page: fingertip web\n");
  }
  run(fingers, options.seconds, ROUND, [&](std::int64_t now_us, double time_s) {
    if (hands) {
      hands->step();
    }
    const bool sends = hands && hands->is_due(now_us);
    std::vector<Pressures> pressures;
    std::string cells;
    for (std::size_t i = 0; i < pressed.size(); i++) {
      Pressed &one = pressed[i];
      options.by_hand ? one.follow(time_s, hands->hand(i)) : one.advance(time_s);
      pressures.push_back(one.pressures_Pa());
      cells += (cells.empty() ? "" : ",") + one.cells();
      if (sends) {
        hands->send(i, fingers.device_us(i, now_us), one.touch());
      }
    }
    truth.row(now_us, cells);
    return pressures;
  });
}

void validate(const ValidatedOptions &options, std::optional<double> seconds, const PortFolder &place) {
  std::optional<ValidatedPad> pad(std::in_place, options);
  std::vector<FingerProcess> processes = place.fingers(1, options.seed, 0.0, true); // the pad has its own gains
  processes[0].round = VALIDATED_ROUND;
  FingertipProcesses fingers(place, processes);
  fingers.wait_until_ready();
  place.print_ready(1);
  std::uint32_t rates_set = fingers.shared(0).rates_set;
  bool goes = false;
  double began_s = 0.0;
  run(fingers, seconds, VALIDATED_ROUND, [&](std::int64_t, double now_s) {
    if (!goes && fingers.shared(0).rates_set != rates_set) {
      goes = true;
      began_s = now_s;
      pad.emplace(options);
    }
    Pressures pressures(SENSORS);
    if (goes) {
      for (std::size_t k = 0; k < SENSORS; k++) {
        pressures[k] = pad->pressure_Pa(k, now_s - began_s);
      }
      if (now_s - began_s >= pad->end_s()) {
        goes = false;
        rates_set = fingers.shared(0).rates_set;
      }
    }
    return std::vector<Pressures>{pressures};
  });
}

} // namespace fingertip::cell
