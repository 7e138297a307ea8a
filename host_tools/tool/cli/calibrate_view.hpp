/* The screen of a calibration. */
#pragma once

#include "tool/calibration/gain_session.hpp"
#include "tool/cli/terminal.hpp"

#include <memory>
#include <optional>
#include <string>

namespace fingertip {

/* The pad on a terminal, elsewhere a line for each placement. */
class CalibrateView {
public:
  explicit CalibrateView(ColourMode mode);
  /* Called often. news: a placement was taken or taken back. */
  void update(const calibrating::GainSession &session, bool news);
  std::optional<Key> key() { return screen_ ? screen_->key() : std::nullopt; }

private:
  std::unique_ptr<Screen> screen_;
  HostTime next_{};
  std::string advice_;
};

} // namespace fingertip
