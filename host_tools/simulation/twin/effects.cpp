#include "simulation/twin/effects.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::twin {
namespace {

// Proportions of the Prony series and the protocol that its amount refers to: least squares over
// the holds of 8 s that begin with a ramp of 1.3 s in the recordings named below.
constexpr std::array<double, Pad::TIMES_s.size()> PRONY{0.206, 0.153};
constexpr double RAMP_s = 1.3, HOLD_s = 8.0;
// 4..14 % is 9 % and this share to either side; 130..210 Pa is 170 Pa and this share.
constexpr double RELAXATION_SPREAD = 5.0 / 9.0;
constexpr double DRIFT_SPREAD = 40.0 / 170.0;
constexpr double DRIFT_SPAN_s = 16.0 * 60.0;
constexpr double GAIN_SIGMAS_MAX = 3.0;
constexpr double SPECIFIED_Pa = 120000.0, RANGE_END_Pa = 200000.0;
// Silicone rubber: 0.2 W/(m K), 1100 kg/m3, 1500 J/(kg K).
constexpr double DIFFUSIVITY_mm2_s = 0.12;

constexpr double MEMORY_LEAST_s = 1.0, MEMORY_MOST_s = 4.0;
constexpr double MEMORY_STRONG = 4.6, STRONG_SHARE = 1.0 / 8.0;

// With 4 %: 2..5 % of the peak, dips of 3..9 %.
constexpr double RESIDUAL_LEAST = 0.5, RESIDUAL_MOST = 1.25;
constexpr double DIPS_LEAST = 0.75, DIPS_MOST = 2.25;
constexpr double DIPS_SHARE = 1.0 / 3.0; // of the sensors; assumed
constexpr double BACK_LEAST_s = 1.0, BACK_MOST_s = 4.0;
// Coefficients C1 to C4 and C6 of the data sheet's example (MS5837-02BA, page 7) and their spread, assumed as the players assume it.
constexpr std::array<double, 5> PROM{46372.0, 43981.0, 29059.0, 27842.0, 28165.0};
constexpr double PROM_SPREAD = 0.03;

const char STRIP[] = "recordings of a real strip of four MPL3115A2 under rubber: "
                     "JiannnH/MTL-BaroTactileSensor, Imperial College London, 2023";

const char GRIDS[] = "recordings of real arrays of eight MS5837 under DragonSkin: "
                     "Shaevitzaiden/Underwater-Tactile-Sensor, RoboSoft 2023";

enum Stream : std::uint64_t { GAIN = 101, DRIFT, RELAXATION, AFTEREFFECT, BRANCH, SEAT, MEMORY };

const Effect &effect(const std::string &name) {
  if (const Effect *found = find_in(effects(), [&](const Effect &one) { return one.name == name; })) {
    return *found;
  }
  throw Error("there is no effect \"" + printable(name) +
              "\"; give some of: " + joined(effects(), ", ", [](const Effect &one) { return one.name; }) + "; or all or none");
}

// What has followed a ramp of RAMP_s to 1 with the time constant tau, after a hold of `hold_s`.
double followed(double tau, double hold_s) {
  const double at_ramp_end = 1.0 - tau / RAMP_s * (1.0 - std::exp(-RAMP_s / tau));
  return 1.0 - (1.0 - at_ramp_end) * std::exp(-hold_s / tau);
}

// Factor of PRONY that makes a hold lose this share of its peak.
double prony_factor(double share) {
  double during_hold = 0.0, in_ramp = 0.0;
  for (std::size_t i = 0; i < PRONY.size(); i++) {
    in_ramp += PRONY[i] * followed(Pad::TIMES_s[i], 0.0);
    during_hold += PRONY[i] * (followed(Pad::TIMES_s[i], HOLD_s) - followed(Pad::TIMES_s[i], 0.0));
  }
  return share / (during_hold + share * in_ramp);
}

// What the step of the compensation at 10.00 degC does to a part with these coefficients.
Pad::Branch branch_of(const std::array<double, PROM.size()> &c, double ambient_Pa) {
  constexpr double BELOW = -1000.0; // 10.00 degC less 20.00 degC
  constexpr double SQUARE = BELOW * BELOW;
  const double dT = BELOW * 0x1p23 / c[4];
  // From 10 degC on 30 / 2^8 of the square is taken off the offset and nothing off the sensitivity; below 35 / 2^3 and 63 / 2^5.
  const double offset = c[1] * 0x1p17 + c[3] * dT * 0x1p-6 - 30.0 * SQUARE * 0x1p-8;
  const double sensitivity = c[0] * 0x1p16 + c[2] * dT * 0x1p-7;
  const double offset_step = (35.0 * 0x1p-3 - 30.0 * 0x1p-8) * SQUARE;
  const double slope = 63.0 * 0x1p-5 * SQUARE / sensitivity;
  // The temperature itself loses 14 / 2^35 of dT^2 below and 12 / 2^35 above: the middle.
  return {0.01 * (1000.0 - 13.0 * dT * dT * 0x1p-35), slope * (ambient_Pa + offset * 0x1p-15) - offset_step * 0x1p-15, slope};
}

} // namespace

std::array<double, Pad::TIMES_s.size()> relaxation_strengths(double share) {
  const double factor = prony_factor(share);
  return {factor * PRONY[0], factor * PRONY[1]};
}

const std::vector<Effect> &effects() {
  static const std::vector<Effect> all{
      {"dip", "%", 5.0, 0.0, 10.0, "around a contact the pressure is lower by this share of its middle, 2.5 times as wide",
       std::string(GRIDS) + ": 5 % as calibrations expect it, -1 to -2 % is left at 3.5 to 4 widths"},
      {"widths", "%", 3.5, 0.0, 20.0, "each sensor's response is wider or narrower by this sd",
       std::string(GRIDS) + ": widths of sensors' responses differ by 3 to 4 % (sd)"},
      {"places", "mm", 0.1, 0.0, 1.0, "each sensor sits off its place by this sd, each way",
       std::string(GRIDS) + ": 0.1 to 0.23 mm from the board's drawing"},
      {"gain", "%", 10.0, 0.0, 30.0, "gain of each sensor off by a normal share of this sd",
       std::string(STRIP) + ": gains differ by +-10 %"},
      {"drift", "Pa in 16 min", 170.0, 0.0, 5000.0, "zero of each sensor wanders by this, 24 % to either side, up or down",
       std::string(STRIP) + ": 130 to 210 Pa in 16 min"},
      {"relaxation", "%", 9.0, 0.0, 40.0,
       "where travel is held the force itself falls by this share in 8 s, on a pad up to 56 % more or less of it",
       "presses by position beside a load cell, Shaevitzaiden/slip_detection: 3.6 % in 5 s; " + std::string(STRIP) +
           ": 4 to 14 % in a hold of 8 s; times 1 and 10 s fitted to its holds"},
      {"memory", "%", 1.0, 0.0, 20.0,
       "each sensor's own part of a hold of 8 s, by this sd, one in eight by 4.6 times of it; it is off by as much "
       "after the hold and comes back in 1 to 4 s",
       "public recordings, read once: 0.35 % between sensors of a press on a cast pad (n = 5); " + std::string(STRIP) +
           ": 2.6 %, one in eight 10 to 15 %, and as much off after the hold"},
      {"hysteresis", "%", 3.0, 0.0, 20.0, "loop of loading and unloading at any speed, as a share of the work of loading",
       "2.7 to 4.2 % at 0.1 Hz in silicone pads: Romano et al., Soft Science 4:31, 2024, table 2"},
      {"aftereffect", "%", 2.0, 0.0, 20.0,
       "after a release each sensor is off by 0.5 to 1.25 times this share of its peak, one in "
       "three undershoots by 0.75 to 2.25 times, back with a time constant of 1 to 4 s",
       std::string(STRIP) + ", twice as much: 2 to 5 % above or 3 to 9 % below, back in 1 to 4 s; how many "
                            "undershoot is assumed"},
      {"creep", "%", 1.25, 0.0, 10.0, "each sensor rises in a hold by this share, and falls as slowly after: 3 s",
       "presses next to a load cell: Shaevitzaiden/slip_detection, two of seven read: per newton a "
       "sensor rises by 0.9 to 1.7 % in a hold, and is 1.2 to 2.1 % of the peak above its zero "
       "0.5 s after it, 0.8 to 1.3 % at 1.5 s"},
      {"temperature", "K", 6.0, -40.0, 40.0, "the sensors warm up slowly by this, as in a hand; pressures are compensated",
       "assumed: room at 25 degC, skin at 31; time from the diffusivity of silicone rubber, "
       "0.12 mm2/s"},
      {"branch", "degC", 5.0, -20.0, 25.0,
       "the sensors begin at this and warm up by 0.1 K/s to 25 degC: at 10 degC their compensation "
       "steps by some 51 Pa, 66 Pa/bar more under pressure, each sensor by its own amount",
       "second-order compensation (TE MS5840-02BA data sheet) with the coefficients of the "
       "MS5837-02BA's example +-3 %; the rate is assumed: a cold finger in a hand"},
      {"bias", "%", 1.0, 0.0, 10.0, "readings above 1.2 bar come out low, at 2 bar by this",
       "1.2 bar ends the specified accuracy (TE MS5840-02BA data sheet); the amount is assumed"},
      {"clip", "bar", 2.02, 1.2, 10.0, "readings end here",
       "2 bar ends the extended range (TE MS5840-02BA data sheet), that a part goes on for 1 % is "
       "assumed; the 24-bit code ends near 5 bar"},
  };
  return all;
}

EffectValues parse_effects(const std::string &text) {
  EffectValues values;
  if (text.empty() || text == "none") {
    return values;
  }
  for (std::string_view part : split(text, ',')) {
    const std::size_t equals = part.find('=');
    const std::string name(trim(part.substr(0, equals)));
    if (name == "all" && equals == std::string_view::npos) {
      for (const Effect &one : effects()) {
        values.emplace(one.name, one.usual);
      }
      continue;
    }
    const Effect &chosen = effect(name);
    double value = chosen.usual;
    if (equals != std::string_view::npos) {
      const auto given = to_double(trim(part.substr(equals + 1)));
      if (!given || *given < chosen.lowest || *given > chosen.highest) {
        throw Error("effect " + name + " is \"" + printable(part.substr(equals + 1)) + "\"; give " +
                    shortest(static_cast<float>(chosen.lowest)) + " to " + shortest(static_cast<float>(chosen.highest)) + " (" +
                    chosen.unit + ")");
      }
      value = *given;
    }
    values[name] = value;
  }
  return values;
}

Pad::Pad(const EffectValues &effects, std::size_t sensors, double layer_mm, double ambient_Pa, std::uint64_t seed)
    : ambient_Pa_(ambient_Pa), clip_Pa_(std::numeric_limits<double>::infinity()), seats_(sensors), rubber_(sensors) {
  for (const auto &[name, value] : effects) {
    if (name == "dip") {
      dip_share_ = 0.01 * value;
    } else if (name == "creep") {
      creep_ = 0.01 * value;
    } else if (name == "widths" || name == "places") {
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, SEAT, k);
        const double dx = random.normal(), dy = random.normal(), wider = random.normal();
        if (name == "places") {
          seats_[k].dx_mm = value * dx;
          seats_[k].dy_mm = value * dy;
        } else {
          seats_[k].width = std::exp(0.01 * value * wider);
        }
      }
    } else if (name == "gain") {
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, GAIN, k);
        double sigmas = random.normal();
        while (std::abs(sigmas) > GAIN_SIGMAS_MAX) {
          sigmas = random.normal();
        }
        gain_errors_.push_back(0.01 * value * sigmas);
      }
    } else if (name == "drift") {
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, DRIFT, k);
        const double sign = random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
        drifts_Pa_s_.push_back(sign * value * (1.0 + random.uniform(-DRIFT_SPREAD, DRIFT_SPREAD)) / DRIFT_SPAN_s);
      }
    } else if (name == "relaxation") {
      Random random(seed, RELAXATION, 0);
      strength_ = relaxation_strengths(0.01 * value * (1.0 + random.uniform(-RELAXATION_SPREAD, RELAXATION_SPREAD)));
    } else if (name == "memory") {
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, MEMORY, k);
        const double sd = 0.01 * value * (random.uniform(0.0, 1.0) < STRONG_SHARE ? MEMORY_STRONG : 1.0);
        memories_.push_back({sd * random.normal(), random.log_uniform(MEMORY_LEAST_s, MEMORY_MOST_s)});
        const auto [share, time_s] = memories_.back();
        const double in_ramp = followed(time_s, 0.0);
        rubber_[k].strength = share / (followed(time_s, HOLD_s) - in_ramp + share * in_ramp);
      }
    } else if (name == "hysteresis") {
      hysteresis_ = 0.01 * value;
    } else if (name == "aftereffect") {
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, AFTEREFFECT, k);
        const bool dips = random.uniform(0.0, 1.0) < DIPS_SHARE;
        const double times = dips ? -random.uniform(DIPS_LEAST, DIPS_MOST) : random.uniform(RESIDUAL_LEAST, RESIDUAL_MOST);
        aftereffects_.push_back({0.01 * value * times, random.log_uniform(BACK_LEAST_s, BACK_MOST_s)});
      }
    } else if (name == "branch") {
      start_degC_ = value;
      for (std::size_t k = 0; k < sensors; k++) {
        Random random(seed, BRANCH, k);
        std::array<double, PROM.size()> drawn = PROM;
        for (double &coefficient : drawn) {
          coefficient *= random.uniform(1.0 - PROM_SPREAD, 1.0 + PROM_SPREAD);
        }
        branches_.push_back(branch_of(drawn, ambient_Pa));
      }
    } else if (name == "temperature") {
      warming_K_ = value;
      warming_s_ = 4.0 * layer_mm * layer_mm / (M_PI * M_PI * DIFFUSIVITY_mm2_s);
    } else if (name == "bias") {
      bias_ = 0.01 * value;
    } else if (name == "clip") {
      clip_Pa_ = 1e5 * value;
    }
  }
}

double Pad::with_hysteresis(Rubber &r, double pressure_Pa) const {
  if (pressure_Pa <= 0.0) {
    r.pressure_Pa = r.lacks_Pa = r.turn_Pa = r.turn_lacks_Pa = r.largest_Pa = 0.0;
    r.falls = false;
    return pressure_Pa;
  }
  const bool falls = pressure_Pa < r.pressure_Pa || (pressure_Pa == r.pressure_Pa && r.falls);
  if (falls != r.falls) {
    r.falls = falls;
    r.turn_Pa = r.pressure_Pa;
    r.turn_lacks_Pa = r.lacks_Pa;
  }
  if (falls) {
    const double left = pressure_Pa / r.turn_Pa;
    r.lacks_Pa = left * r.turn_lacks_Pa + 3.0 * hysteresis_ * pressure_Pa * (1.0 - left);
  } else if (pressure_Pa < r.largest_Pa) {
    r.lacks_Pa = r.turn_lacks_Pa * (r.largest_Pa - pressure_Pa) / (r.largest_Pa - r.turn_Pa);
  } else {
    r.lacks_Pa = 0.0;
    r.largest_Pa = pressure_Pa;
  }
  r.pressure_Pa = pressure_Pa;
  return pressure_Pa - r.lacks_Pa;
}

double Pad::relaxed_share(double t_s, double travel_N) {
  const double step_s = t_s - relaxes_s_, rate = step_s > 0.0 ? (travel_N - travel_N_) / step_s : 0.0;
  double lost_N = 0.0;
  for (std::size_t i = 0; i < TIMES_s.size(); i++) {
    // Exact for a force that is linear over the step.
    const double lag = rate * TIMES_s[i];
    follows_N_[i] = travel_N - lag + (follows_N_[i] - travel_N_ + lag) * std::exp(-step_s / TIMES_s[i]);
    follows_N_[i] = travel_N > 0.0 ? follows_N_[i] : 0.0;
    lost_N += strength_[i] * follows_N_[i];
  }
  relaxes_s_ = t_s;
  travel_N_ = travel_N;
  return travel_N > 0.0 ? std::max(1.0 - lost_N / travel_N, 0.0) : 1.0;
}

double Pad::lost(Rubber &r, double time_s, double pressure_Pa) const {
  const double rate = step_s_ > 0.0 ? (pressure_Pa - r.elastic_Pa) / step_s_ : 0.0;
  const double lag = rate * time_s;
  r.follows_Pa = pressure_Pa - lag + (r.follows_Pa - r.elastic_Pa + lag) * r.decay; // exact, as above
  r.elastic_Pa = pressure_Pa;
  return r.strength * r.follows_Pa;
}

double Pad::left_behind(Rubber &r, const Aftereffect &effect, double base_Pa) const {
  const double sensed_Pa = std::max(base_Pa, 0.0);
  const double rate = step_s_ > 0.0 ? (sensed_Pa - r.sensed_Pa) / step_s_ : 0.0;
  const double lag = rate * effect.time_s;
  // Exact as above, and where the pressure overtakes what is remembered.
  r.remembered_Pa = std::max(sensed_Pa, sensed_Pa - lag + (r.remembered_Pa - r.sensed_Pa + lag) * r.forgetting);
  r.sensed_Pa = sensed_Pa;
  return effect.share * (r.remembered_Pa - sensed_Pa);
}

double Pad::crept(Rubber &r, double base_Pa) const {
  const double rate = step_s_ > 0.0 ? (base_Pa - r.base_Pa) / step_s_ : 0.0;
  const double lag = rate * CREEP_s;
  r.crept_Pa = base_Pa - lag + (r.crept_Pa - r.base_Pa + lag) * creep_decay_; // exact, as above
  r.base_Pa = base_Pa;
  return creep_ * r.crept_Pa;
}

void Pad::report(double t_s, const std::vector<double> &base_Pa, std::vector<double> &reported_Pa) {
  if (!begun_) {
    begun_ = true;
    begin_s_ = t_s_ = t_s;
  }
  const double step_s = t_s - t_s_;
  if (step_s != step_s_ || step_s == 0.0) {
    step_s_ = step_s;
    for (std::size_t k = 0; k < memories_.size(); k++) {
      rubber_[k].decay = std::exp(-step_s / memories_[k].time_s);
    }
    creep_decay_ = std::exp(-step_s / CREEP_s);
    for (std::size_t k = 0; k < aftereffects_.size(); k++) {
      rubber_[k].forgetting = std::exp(-step_s / aftereffects_[k].time_s);
    }
  }
  t_s_ = t_s;
  const double sensors_degC = temperature_degC(t_s);
  for (std::size_t k = 0; k < rubber_.size(); k++) {
    double pressure_Pa = base_Pa[k];
    if (hysteresis_ > 0.0) {
      pressure_Pa = with_hysteresis(rubber_[k], pressure_Pa);
    }
    if (!memories_.empty()) {
      pressure_Pa -= lost(rubber_[k], memories_[k].time_s, pressure_Pa);
    }
    if (!aftereffects_.empty()) {
      pressure_Pa += left_behind(rubber_[k], aftereffects_[k], base_Pa[k]);
    }
    if (creep_ > 0.0) {
      pressure_Pa += crept(rubber_[k], base_Pa[k]);
    }
    if (!gain_errors_.empty()) {
      pressure_Pa *= 1.0 + gain_errors_[k];
    }
    if (!drifts_Pa_s_.empty()) {
      pressure_Pa += drifts_Pa_s_[k] * (t_s - begin_s_);
    }
    if (!branches_.empty()) {
      const Branch &branch = branches_[k];
      // What begins above the edge has no step before it.
      if (start_degC_ < branch.edge_degC && sensors_degC >= branch.edge_degC) {
        pressure_Pa += branch.step_Pa + branch.slope * pressure_Pa;
      }
    }
    const double excess = (ambient_Pa_ + pressure_Pa - SPECIFIED_Pa) / (RANGE_END_Pa - SPECIFIED_Pa);
    if (excess > 0.0) {
      pressure_Pa -= bias_ * RANGE_END_Pa * excess * excess;
    }
    reported_Pa[k] = std::min(pressure_Pa, clip_Pa_ - ambient_Pa_);
  }
}

double Pad::temperature_degC(double t_s) const {
  // What begins at ROOM_degC stays there.
  const double degC = std::min(start_degC_ + WARMING_K_s * t_s, ROOM_degC);
  return warming_K_ == 0.0 ? degC : degC + warming_K_ * (1.0 - std::exp(-t_s / warming_s_));
}

} // namespace fingertip::twin
