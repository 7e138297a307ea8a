// Pads of the twin on which a person calibrates and taps (sessions.hpp), many at once.
#include "libfingertip/in_parallel.hpp"
#include "report/measure/sessions.hpp"
#include "report/measure/tables.hpp"
#include "tool/arrays/calibrations.hpp"
#include "tool/arrays/entry.hpp"

#include <algorithm>
#include <functional>

using namespace fingertip;
using namespace fingertip::measure;
using calibrating::Judgement;
using calibrating::Placement;

// Percents and sds as effects.hpp has them. overhang_mm: how far the rubber extends beyond the outer sensors; 0: without end.
struct pad_kind {
  double gain_percent, memory_percent, misplaced_mm, dip_percent, widths_percent, overhang_mm;
};
MEASURE_RECORD(pad_kind, FIELD(gain_percent), FIELD(memory_percent), FIELD(misplaced_mm), FIELD(dip_percent), FIELD(widths_percent),
               FIELD(overhang_mm))

namespace {

constexpr double TAP_MIN_N = 1.0, TAP_MAX_N = 15.0;
constexpr std::size_t JUDGED_EVERY = 2; // the tool does it after each placement
constexpr std::size_t PLACEMENTS = 30;  // of a session that is repeated until one is accepted
enum Stream : std::uint64_t { SESSION = 302, TAP_LOCATIONS = 401 };

// Pads with their seeds.
struct Pads {
  Batch<const pad_kind, 1> kinds; // of each, or of all
  double layer_mm;
  std::string cache;
  Batch<const std::int64_t, 1> seeds;

  PadOptions options(std::size_t i) const {
    const pad_kind &kind = *kinds.row_or_all(i);
    return {kind.gain_percent, kind.memory_percent, kind.misplaced_mm,
            kind.dip_percent,  kind.widths_percent, kind.overhang_mm > 0.0 ? &block_table(layer_mm, kind.overhang_mm, cache) : nullptr};
  }
  std::uint64_t seed(std::size_t i) const { return static_cast<std::uint64_t>(seeds[i]); }
  SessionPad pad(std::size_t i) const { return {options(i), layer_mm, seed(i)}; }
  const Feet &feet() const {
    return once_for(layer_mm, [&] { return Feet(layer_mm, cache); });
  }
  // work(i) for every pad.
  void each(const std::function<void(std::size_t)> &work) const {
    length_or_one(seeds, kinds);
    twin::in_parallel(seeds.size(), work);
  }
};

SessionKind kind_named(const std::string &name) {
  for (int kind = 0; kind <= static_cast<int>(SessionKind::weights); kind++) {
    if (name == name_of(static_cast<SessionKind>(kind))) {
      return static_cast<SessionKind>(kind);
    }
  }
  throw std::invalid_argument("no session has this name");
}

// Until the calibration is good or refused, or the person has no more placements.
Judgement lead(Session &session, SessionPad &pad, std::vector<Placement> &placements) {
  std::optional<calibrating::Wanted> wanted;
  while (auto placement = session.next(pad, wanted)) {
    placements.push_back(*placement);
    if (placements.size() >= calibrating::PLACEMENTS_WANTED && placements.size() % JUDGED_EVERY == 0) {
      Judgement judgement = calibrating::judge(session_array(), placements, false);
      if (judgement.state != Judgement::State::more) {
        return judgement;
      }
      wanted = calibrating::next_place(session_array(), placements, judgement.solution);
    }
  }
  return calibrating::judge(session_array(), placements, true);
}

} // namespace

// The placements of sessions without a calibration [pad][placement][sensor], with their times and fadings.
static void pad_placements(std::string session_kind, Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache,
                           Batch<const std::int64_t, 1> seeds, Batch<double, 2> t_s, Batch<double, 3> reading_Pa, Batch<double, 2> fading) {
  same_length(seeds, t_s, reading_Pa, fading);
  require(t_s.size(1) == reading_Pa.size(1) && t_s.size(1) == fading.size(1), "other numbers of placements");
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = pads.feet();
  pads.each([&](std::size_t i) {
    SessionPad pad = pads.pad(i);
    Session session(feet, kind_named(session_kind), pads.seed(i), calibrating::PLACEMENTS_MAX);
    for (std::size_t p = 0; p < t_s.size(1); p++) {
      const Placement placement = *session.next(pad);
      t_s.row(i)[p] = placement.t_s;
      fading.row(i)[p] = placement.fading;
      std::copy(placement.reading_Pa.begin(), placement.reading_Pa.end(), reading_Pa.row(i) + p * reading_Pa.size(2));
    }
  });
}
MEASURE_ENTRY(pad_placements)

// Sessions of at most `planned` placements as the tool leads them.
static void pad_lead(std::string session_kind, Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache,
                     Batch<const std::int64_t, 1> seeds, std::int64_t planned, Batch<calibration, 1> found,
                     Batch<calibrated_sensor, 2> sensors, Batch<fit_deviation, 2> deviations, Batch<std::int64_t, 1> placements) {
  same_length(seeds, found, sensors, deviations, placements);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = pads.feet();
  pads.each([&](std::size_t i) {
    SessionPad pad = pads.pad(i);
    Session session(feet, kind_named(session_kind), pads.seed(i), static_cast<std::size_t>(planned));
    std::vector<Placement> made;
    const Judgement judgement = lead(session, pad, made);
    describe(session_array(), made, judgement, WEIGHT_N, found[i], sensors.row(i), deviations.row(i));
    placements[i] = static_cast<std::int64_t>(made.size());
  });
}
MEASURE_ENTRY(pad_lead)

// Taps [pad][tap] by small, round and flat objects in turn, and the readings [pad][tap][sensor] of one frame of each.
static void pad_taps(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache, Batch<const std::int64_t, 1> seeds,
                     Batch<double, 2> x_mm, Batch<double, 2> y_mm, Batch<double, 2> force_N, Batch<double, 3> reading_Pa) {
  same_length(seeds, x_mm, y_mm, force_N, reading_Pa);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const twin::ContactTable *const objects[] = {&contact_table(twin::indenter("sphere6"), layer_mm, cache), &pads.feet().round,
                                               &contact_table(twin::indenter("cylinder6"), layer_mm, cache)};
  const calibrating::Array array = session_array();
  pads.each([&](std::size_t i) {
    SessionPad pad = pads.pad(i);
    Random random(pads.seed(i), TAP_LOCATIONS, 0);
    for (std::size_t t = 0; t < x_mm.size(1); t++) {
      const double x = x_mm.row(i)[t] = random.uniform(array.x_mm.front(), array.x_mm.back());
      const double y = y_mm.row(i)[t] = random.uniform(array.y_mm.front(), array.y_mm.back());
      const double N = force_N.row(i)[t] = random.uniform(TAP_MIN_N, TAP_MAX_N);
      const std::vector<double> readings = pad.tap(*objects[t % std::size(objects)], N, x, y);
      std::copy(readings.begin(), readings.end(), reading_Pa.row(i) + t * reading_Pa.size(2));
    }
  });
}
MEASURE_ENTRY(pad_taps)

// True gains [pad][sensor] of readings that have settled.
static void pad_gains(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache, Batch<const std::int64_t, 1> seeds,
                      Batch<double, 2> gain) {
  same_length(seeds, gain);
  const Pads pads{kinds, layer_mm, cache, seeds};
  pads.each([&](std::size_t i) {
    const std::vector<double> gains = pads.pad(i).settled_gains();
    std::copy(gains.begin(), gains.end(), gain.row(i));
  });
}
MEASURE_ENTRY(pad_gains)

// What accepted calibrations found: sessions of thirty placements on pads of their own, each repeated on another pad
// until a calibration is accepted. true_gain, true_dip_share and seats are how that pad is.
static void pad_calibrated(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache, Batch<const std::int64_t, 1> seeds,
                           Batch<calibration, 1> found, Batch<calibrated_sensor, 2> sensors, Batch<fit_deviation, 2> deviations,
                           Batch<double, 2> true_gain, Batch<double, 1> true_dip_share, Batch<twin::Pad::Seat, 2> seats) {
  same_length(seeds, found, sensors, deviations, true_gain, true_dip_share, seats);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = pads.feet();
  // Whether the calibration is accepted.
  const auto made = [&](std::size_t i, std::uint64_t seed) {
    SessionPad pad(pads.options(i), layer_mm, seed);
    Session session(feet, SessionKind::good, seed, calibrating::PLACEMENTS_MAX);
    std::vector<Placement> placements;
    while (const auto placement = session.next(pad)) {
      placements.push_back(*placement);
      if (placements.size() < PLACEMENTS) {
        continue;
      }
      const Judgement judgement = calibrating::judge(session_array(), placements, false);
      if (judgement.state == Judgement::State::refused) {
        break;
      }
      describe(session_array(), placements, judgement, WEIGHT_N, found[i], sensors.row(i), deviations.row(i));
      if (judgement.state == Judgement::State::good && found[i].force_scale > 0.0) {
        const std::vector<double> gains = pad.settled_gains();
        std::copy(gains.begin(), gains.end(), true_gain.row(i));
        true_dip_share[i] = pad.rubber().dip_share();
        std::copy(pad.rubber().seats().begin(), pad.rubber().seats().end(), seats.row(i));
        return true;
      }
    }
    return false;
  };
  pads.each([&](std::size_t i) {
    for (std::uint64_t attempt = 0; !made(i, Random(pads.seed(i), SESSION, attempt).next()); attempt++) {
    }
  });
}
MEASURE_ENTRY(pad_calibrated)
