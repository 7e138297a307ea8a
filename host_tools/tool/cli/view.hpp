/* Ways to show fingertips while they change. */
#pragma once

#include "tool/cli/monitor.hpp"
#include "tool/cli/terminal.hpp"

#include <memory>
#include <vector>

namespace fingertip {

/* The answer to a key, as long as it is shown. */
class Message {
public:
  void show(const std::string &text) {
    text_ = text;
    until_ = host_now() + std::chrono::seconds(5);
  }
  std::string text() const { return host_now() > until_ ? "" : text_; }

private:
  std::string text_;
  HostTime until_{};
};

class View {
public:
  virtual ~View() = default;
  /* Called often; draws as often as it sees fit. */
  virtual void update(const std::vector<Model> &models, const Caption &caption) = 0;
  /* What update has to draw cannot wait: somebody pressed a key. */
  virtual void hurry() {}
  virtual std::optional<Key> key() { return std::nullopt; }
};

/* The monitor on a terminal, or one line a second for each fingertip elsewhere. */
std::unique_ptr<View> make_monitor_view(ColourMode mode);
/* For a grasp, whose lines come when its state or trouble changes too; quiet: only then, and
 * only on standard error. The model must outlive the view. */
std::unique_ptr<View> make_grasp_view(ColourMode mode, const GripModel &grip);
std::unique_ptr<View> make_quiet_grasp_view(const GripModel &grip);
/* One line on standard error for all of them, renewed in place if that is a terminal. */
std::unique_ptr<View> make_progress_view();
/* On standard error only what is wrong for a second or more, and that it has ended. */
std::unique_ptr<View> make_state_view();

/* "5068 frames in 12.3 s (412.1/s), 0 packets dropped, 0 CRC errors, 0 format errors" */
std::string summary_text(const Model &model);
/* A part of it: ", 7 edges at the sync pin, 0 missing"; nothing if there were none. */
std::string edges_text(const Model &model);

} // namespace fingertip
