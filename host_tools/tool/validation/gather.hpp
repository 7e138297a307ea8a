/* What was measured in a validation: a recording's packets and events in, means out. */
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/calibration/placements.hpp"
#include "tool/validation/protocol.hpp"
#include "tool/validation/pull_watch.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::validating {

struct Press {
  std::size_t mark = 0;
  Mark at{0.0, 0.0}; /* of the mark */
  calibrating::Placement placement;
  Estimate estimate; /* what the fingertip estimated meanwhile, in half a second */
};

struct Pulled {
  double toward_deg = 0.0;
  Pulling pulling;
  Estimate rest, pull; /* before, and under it */
};

struct Empty {
  double seconds = 0.0;
  std::vector<double> noise_Pa;                /* [sensor] sd about the line through its readings */
  std::vector<double> drift_Pa_min;            /* [sensor] slope of that line */
  std::vector<std::vector<double>> seconds_Pa; /* [second][sensor] means above the first second */
};

struct Hold {
  double held_s = 0.0;
  std::vector<double> early_Pa, late_Pa; /* [sensor] above before: 0.5 to 1.5 s after the touch, and
                                            the last second */
  struct After {
    double after_s;
    std::vector<double> left_Pa; /* [sensor] above before, mean of a second; empty: not measured */
  };
  std::array<After, 3> after{{{1.0, {}}, {10.0, {}}, {25.0, {}}}};
  std::vector<std::array<double, 2>> sum_Pa; /* [tenth of a second] time from the touch, all sensors */
};

struct Measured {
  wire_info info{};
  calibrating::Array array;
  double weight_g = 0.0, skin_mm = 0.0;
  std::vector<Press> presses;
  std::optional<Empty> empty;
  std::optional<Hold> hold;
  std::size_t pulls_asked = 0;
  std::vector<Pulled> pulls;
  std::vector<double> answered; /* [sensor] share of all frames in which it gave a reading */
  std::size_t frames = 0;
  bool ended = false; /* the last step was done */
};

class Gatherer {
public:
  explicit Gatherer(const wire_info &info);
  void packet(const wire_packet &packet);
  void step(const Step &step);
  /* Whether the last packet completed the press or the pull that the step asks for. */
  bool has_done() const { return has_done_; }
  const PullWatch &pull_watch() const { return pull_watch_; }
  const calibrating::PlacementFinder &finder() const { return finder_; }
  double step_s() const { return last_s_ - step_s_; } /* since the step began, device time */
  /* Since the present hold began, or since it ended; 0: neither. */
  double touched_s() const { return touched_ ? last_s_ - *touched_ : 0.0; }
  double released_s() const { return released_ ? last_s_ - *released_ : 0.0; }

  const Measured &measured() const { return measured_; }
  /* Last of all. */
  Measured finish();

private:
  struct Row {
    double t_s;
    std::uint32_t valid;
    std::vector<double> pressure_Pa;
  };
  void raw(const wire_packet &packet);
  void follow_hold(bool was_resting);
  std::vector<double> mean(double from_s, double to_s) const; /* of rows_; empty: none */
  void finish_empty();
  void finish_hold();

  Measured measured_;
  calibrating::PlacementFinder finder_;
  Step step_{Step::Kind::end};
  bool has_done_ = false;
  double last_s_ = 0.0, step_s_ = 0.0;
  std::vector<std::size_t> valid_frames_;
  std::vector<Row> rows_; /* of the empty minute, or from the hold on */
  Contacts contacts_;
  std::optional<double> touched_, released_;
  PullWatch pull_watch_;
};

} // namespace fingertip::validating
