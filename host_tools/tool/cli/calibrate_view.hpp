/* The screen of a calibration. */
#pragma once

#include "tool/calibration/gain_session.hpp"
#include "tool/cli/terminal.hpp"

#include <memory>
#include <optional>

namespace fingertip {

class CalibrateView {
public:
  virtual ~CalibrateView() = default;
  /* Called often. news: a placement was taken or taken back. */
  virtual void update(const calibrating::GainSession &session, bool news) = 0;
  virtual std::optional<Key> key() { return std::nullopt; }
};

/* The pad on a terminal, elsewhere a line for each placement. */
std::unique_ptr<CalibrateView> make_calibrate_view(ColourMode mode);

} // namespace fingertip
