/* What a calibration under way looks like. */
#pragma once

#include "calibration/judge.hpp"
#include "calibration/placements.hpp"
#include "cli/terminal.hpp"

#include <memory>
#include <optional>
#include <string>

namespace fingertip {

struct CalibrateStatus {
  const calibrating::Array *array = nullptr;
  std::size_t placements = 0;
  const calibrating::PlacementFinder *finder = nullptr;
  const calibrating::Judgement *judgement = nullptr; /* of the placements so far; null: of none */
  std::optional<calibrating::Wanted> wanted;
};

/* "hold on": what to do now. */
std::string advice_text(const CalibrateStatus &status);

/* "12 placements, gains known to 3.1 % of 1.5 %" */
std::string progress_text(const CalibrateStatus &status);

class CalibrateView {
public:
  virtual ~CalibrateView() = default;
  /* Called often. news: a placement was taken or taken back. */
  virtual void update(const CalibrateStatus &status, bool news) = 0;
  virtual std::optional<Key> key() { return std::nullopt; }
};

/* The pad on a terminal, elsewhere a line for each placement. */
std::unique_ptr<CalibrateView> make_calibrate_view(ColourMode mode);

} // namespace fingertip
