// Pads of the twin on which a person calibrates and taps (sessions.hpp), many at once.
#include "libfingertip/in_parallel.hpp"
#include "report/measure/calibrations.hpp"
#include "report/measure/entry.hpp"
#include "report/measure/sessions.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <mutex>

using namespace fingertip;
using namespace fingertip::measure;
using calibrating::Judgement;
using calibrating::Placement;

// Percents and sds as effects.hpp has them. overhang_mm: how far the rubber extends beyond the outer sensors; 0:
// without end.
struct pad_kind {
  double gain_percent, relaxation_percent, misplaced_mm, dip_percent, widths_percent, overhang_mm;
};
MEASURE_RECORD(pad_kind, FIELD(gain_percent), FIELD(relaxation_percent), FIELD(misplaced_mm), FIELD(dip_percent),
               FIELD(widths_percent), FIELD(overhang_mm))

namespace {

constexpr double TAP_MIN_N = 1.0, TAP_MAX_N = 15.0;
constexpr std::size_t JUDGED_EVERY = 2; // the tool does it after each placement
enum Stream : std::uint64_t { TAP_LOCATIONS = 401 };

// What pads of one thickness are touched with, read or solved once.
struct Tables {
  Feet feet;
  twin::ContactTable small, flat;
  std::map<double, twin::BlockTable> blocks; // by overhang
  Tables(double layer_mm, const std::string &cache)
      : feet(layer_mm, cache),
        small(twin::ContactTable::load_or_build(twin::indenter("sphere6"), twin::silicone(layer_mm), cache)),
        flat(twin::ContactTable::load_or_build(twin::indenter("cylinder6"), twin::silicone(layer_mm), cache)) {}
};

Tables &tables_on(double layer_mm, const std::string &cache) {
  static std::mutex mutex;
  static std::map<double, Tables> all;
  const std::lock_guard<std::mutex> lock(mutex);
  return all.try_emplace(layer_mm, layer_mm, cache).first->second;
}

const twin::BlockTable *block_of(double overhang_mm, double layer_mm, const std::string &cache) {
  static std::mutex mutex;
  Tables &tables = tables_on(layer_mm, cache);
  const std::lock_guard<std::mutex> lock(mutex);
  auto found = tables.blocks.find(overhang_mm);
  if (found == tables.blocks.end()) {
    found = tables.blocks
                .emplace(overhang_mm,
                         twin::BlockTable::load_or_build(twin::block_around(twin::silicone(layer_mm), overhang_mm),
                                                         twin::sensor_places(), cache))
                .first;
  }
  return &found->second;
}

// Pads with their seeds.
struct Pads {
  Batch<const pad_kind, 1> kinds; // of each, or of all
  double layer_mm;
  std::string cache;
  Batch<const std::int64_t, 1> seeds;

  PadOptions options(std::size_t i) const {
    const pad_kind &kind = *kinds.row_or_all(i);
    return {kind.gain_percent,   kind.relaxation_percent,
            kind.misplaced_mm,   kind.dip_percent,
            kind.widths_percent, kind.overhang_mm > 0.0 ? block_of(kind.overhang_mm, layer_mm, cache) : nullptr};
  }
  std::uint64_t seed(std::size_t i) const { return static_cast<std::uint64_t>(seeds[i]); }
  SessionPad pad(std::size_t i) const { return {options(i), layer_mm, seed(i)}; }
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
                           Batch<const std::int64_t, 1> seeds, Batch<double, 2> t_s, Batch<double, 3> reading_Pa,
                           Batch<double, 2> fading) {
  same_length(seeds, t_s, reading_Pa, fading);
  require(t_s.size(1) == reading_Pa.size(1) && t_s.size(1) == fading.size(1), "other numbers of placements");
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = tables_on(layer_mm, cache).feet;
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
                     Batch<calibrated_sensor, 2> sensors, Batch<fit_own, 2> own, Batch<std::int64_t, 1> placements) {
  same_length(seeds, found, sensors, own, placements);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = tables_on(layer_mm, cache).feet;
  pads.each([&](std::size_t i) {
    SessionPad pad = pads.pad(i);
    Session session(feet, kind_named(session_kind), pads.seed(i), static_cast<std::size_t>(planned));
    std::vector<Placement> made;
    const Judgement judgement = lead(session, pad, made);
    describe(session_array(), made, judgement, WEIGHT_N, found[i], sensors.row(i), own.row(i));
    placements[i] = static_cast<std::int64_t>(made.size());
  });
}
MEASURE_ENTRY(pad_lead)

// Taps [pad][tap] by small, round and flat objects in turn, and the readings [pad][tap][sensor] of one frame of each.
static void pad_taps(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache,
                     Batch<const std::int64_t, 1> seeds, Batch<double, 2> x_mm, Batch<double, 2> y_mm,
                     Batch<double, 2> force_N, Batch<double, 3> reading_Pa) {
  same_length(seeds, x_mm, y_mm, force_N, reading_Pa);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Tables &tables = tables_on(layer_mm, cache);
  const twin::ContactTable *const objects[] = {&tables.small, &tables.feet.round, &tables.flat};
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
static void pad_gains(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache,
                      Batch<const std::int64_t, 1> seeds, Batch<double, 2> gain) {
  same_length(seeds, gain);
  const Pads pads{kinds, layer_mm, cache, seeds};
  pads.each([&](std::size_t i) {
    const std::vector<double> gains = pads.pad(i).settled_gains();
    std::copy(gains.begin(), gains.end(), gain.row(i));
  });
}
MEASURE_ENTRY(pad_gains)

// What an accepted calibration left of a pad. gain: true over estimated. The prior, its sd and the dip are those that
// the fit gets; true_dip_share is that of the rubber.
struct calibrated_pad {
  double gain[15], gain_sd[15];
  double force_scale, force_scale_sd, prior_sigma_mm, prior_width_mm, dip_share, dip_sd_mm, true_dip_share;
};
MEASURE_RECORD(calibrated_pad, FIELD(gain), FIELD(gain_sd), FIELD(force_scale), FIELD(force_scale_sd),
               FIELD(prior_sigma_mm), FIELD(prior_width_mm), FIELD(dip_share), FIELD(dip_sd_mm), FIELD(true_dip_share))

// Sessions of thirty placements on pads of their own, each repeated on another pad until a calibration is accepted.
// own: zeros where the session found none; seats: where the sensors are.
static void pad_calibrated(Batch<const pad_kind, 1> kinds, double layer_mm, std::string cache,
                           Batch<const std::int64_t, 1> seeds, Batch<calibrated_pad, 1> found, Batch<fit_own, 2> own,
                           Batch<twin::Pad::Seat, 2> seats) {
  same_length(seeds, found, own, seats);
  const Pads pads{kinds, layer_mm, cache, seeds};
  const Feet &feet = tables_on(layer_mm, cache).feet;
  pads.each([&](std::size_t i) {
    const Calibrated session = calibrated_session(feet, pads.options(i), pads.seed(i));
    const calibrating::Shape &shape = session.shape;
    calibrated_pad &pad = found[i];
    std::copy(session.remaining_gain.begin(), session.remaining_gain.end(), pad.gain);
    std::copy(session.gain_sd.begin(), session.gain_sd.end(), pad.gain_sd);
    pad.force_scale = session.force_scale;
    pad.force_scale_sd = session.force_scale_sd;
    pad.prior_sigma_mm = shape.sigma_mm;
    pad.prior_width_mm = shape.sigma_sd_mm;
    pad.dip_share = shape.dip_share;
    pad.dip_sd_mm = shape.dip_sd_mm;
    pad.true_dip_share = session.dip_share;
    const std::vector<fit_own> kept = calibrating::own_of(session_array(), shape);
    std::copy(kept.begin(), kept.end(), own.row(i));
    std::copy(session.seats.begin(), session.seats.end(), seats.row(i));
  });
}
MEASURE_ENTRY(pad_calibrated)
