#include "tool/cli/view.hpp"

#include "grasp/words.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/panel.hpp"

#include <chrono>
#include <cstdio>
#include <functional>
#include <unistd.h>

namespace fingertip {

namespace {

class Interval {
public:
  explicit Interval(std::chrono::milliseconds length) : length_(length) {}
  /* at_once: something changed that cannot wait. */
  bool is_due(bool at_once = false) {
    auto now = host_now();
    if (now < next_ && !at_once) {
      return false;
    }
    next_ = now + length_;
    return true;
  }

private:
  std::chrono::milliseconds length_;
  HostTime next_{};
};

/* Detects when a text changes. */
class Change {
public:
  bool is_new(const std::string &text) { return std::exchange(last_, text) != text; }

private:
  std::string last_;
};

/* What is wrong; "" where all is well. */
std::string trouble_of(const Model &model) {
  const StateText state = state_of(model, false);
  return state.fine ? "" : state.text;
}

std::string troubles_of(const std::vector<Model> &models) {
  return joined(models, "", [](const Model &model) { return trouble_of(model) + "\n"; });
}

std::string name_of(const Model &model) { return model.info() ? text_field(model.info()->serial) : model.source(); }

std::string with_gap(const std::string &text) { return text.empty() ? "" : "  " + text; }

std::string status_line(const Model &model) {
  const LineStatistics &line = model.statistics();
  std::string text = fixed(model.seconds(), 1) + " s  " + std::to_string(model.frames()) + " frames  " +
                     (model.state() == Model::State::gone ? "" : fixed(model.frames_per_s(), 1) + "/s  ") + "dropped " +
                     std::to_string(line.dropped_packets) + "  CRC errors " + std::to_string(line.crc_errors);
  return text + with_gap(trouble_of(model));
}

class ScreenView : public View {
public:
  using Draw = std::function<Canvas(const std::vector<Model> &models, const Caption &caption, int columns, int rows)>;
  ScreenView(ColourDepth depth, Draw draw) : screen_(depth), draw_(std::move(draw)) {}
  void update(const std::vector<Model> &models, const Caption &caption) override {
    if (interval_.is_due(hurry_)) {
      hurry_ = false;
      screen_.draw(draw_(models, caption, screen_.columns(), screen_.rows()));
    }
  }
  void hurry() override { hurry_ = true; }
  std::optional<Key> key() override { return screen_.key(); }

private:
  Screen screen_;
  Draw draw_;
  bool hurry_ = false;
  Interval interval_{std::chrono::milliseconds(40)};
};

/* The last frame: a doubtful one begins with a note. */
std::string contact_text(const Model &model) {
  if (!model.contact() || !model.is_current()) {
    return "";
  }
  const wire_contact &contact = *model.contact();
  std::string text;
  if (contact.flags & CONTACT_FLAG_FIT_VALID) {
    bool least = contact.flags & CONTACT_FLAG_FORCE_LOWER_BOUND;
    text = std::string(is_doubtful(contact) ? "  doubtful:" : "") + "  x " + number(contact.x_mm, 2) + " mm  y " + number(contact.y_mm, 2) +
           " mm  force " + (least ? "at least " : "") + number(contact.force_N, 2) + " N";
  }
  return text + "  " + flags_text(contact.flags);
}

class LineView : public View {
public:
  void update(const std::vector<Model> &models, const Caption &caption) override {
    if (!interval_.is_due(change_.is_new(troubles_of(models)))) {
      return;
    }
    for (const Model &model : models) {
      std::string name = models.size() < 2 ? "" : printable(name_of(model)) + "  ";
      std::printf("%s%s%s%s\n", name.c_str(), status_line(model).c_str(), contact_text(model).c_str(), with_gap(caption.note).c_str());
    }
    std::fflush(stdout);
  }

private:
  Change change_;
  Interval interval_{std::chrono::milliseconds(1000)};
};

class GraspLineView : public View {
public:
  GraspLineView(const GripModel &grip, bool quiet) : grip_(grip), quiet_(quiet) {}
  void update(const std::vector<Model> &, const Caption &caption) override {
    if (!grip_.row() || grip_.row()->report.state == GRIP_IDLE) {
      return;
    }
    const GripReport &report = grip_.row()->report;
    bool changed = change_.is_new(state_name(report.state) + trouble_names(report.trouble));
    bool noted = !caption.note.empty() && note_.is_new(caption.note);
    if (!changed && !noted && (quiet_ || !interval_.is_due())) {
      return;
    }
    std::FILE *to = quiet_ ? stderr : stdout;
    std::fprintf(to, "%s%s\n", grip_line(grip_).c_str(), with_gap(caption.note).c_str());
    std::fflush(to);
  }

private:
  const GripModel &grip_;
  bool quiet_;
  Change change_, note_;
  Interval interval_{std::chrono::milliseconds(1000)};
};

class ProgressView : public View {
public:
  ~ProgressView() override {
    if (in_place_ && shown_) {
      std::fputs("\r\x1b[K", stderr);
    }
  }
  void update(const std::vector<Model> &models, const Caption &caption) override {
    if (!interval_.is_due(change_.is_new(troubles_of(models)))) {
      return;
    }
    shown_ = true;
    std::string text = models.size() == 1 ? status_line(models[0]) : fixed(models[0].seconds(), 1) + " s";
    for (const Model &model : models) {
      text +=
          models.size() == 1 ? "" : "  " + name_of(model) + " " + std::to_string(model.frames()) + " frames" + with_gap(trouble_of(model));
    }
    std::fprintf(stderr, in_place_ ? "\r\x1b[K%s" : "%s\n", printable(text + with_gap(caption.note)).c_str());
    std::fflush(stderr);
  }

private:
  bool in_place_ = isatty(STDERR_FILENO);
  bool shown_ = false;
  Change change_;
  Interval interval_{std::chrono::milliseconds(in_place_ ? 200 : 10000)};
};

class StateView : public View {
public:
  StateView() { interval_.is_due(); }
  void update(const std::vector<Model> &models, const Caption &) override {
    if (!interval_.is_due()) {
      return;
    }
    std::string state = trouble_of(models.front());
    if (change_.is_new(state)) {
      std::fprintf(stderr, "%s\n", state.empty() ? "streaming" : state.c_str());
    }
  }

private:
  Change change_;
  Interval interval_{std::chrono::milliseconds(1000)};
};

} // namespace

std::unique_ptr<View> make_monitor_view(ColourMode mode) {
  if (auto depth = screen_depth(mode)) {
    return std::make_unique<ScreenView>(*depth, draw_monitor);
  }
  return std::make_unique<LineView>();
}

std::unique_ptr<View> make_grasp_view(ColourMode mode, const GripModel &grip) {
  if (auto depth = screen_depth(mode)) {
    return std::make_unique<ScreenView>(*depth, [&grip](const std::vector<Model> &models, const Caption &caption, int columns, int rows) {
      return draw_grasp(models, grip, caption, columns, rows);
    });
  }
  return std::make_unique<GraspLineView>(grip, false);
}

std::unique_ptr<View> make_quiet_grasp_view(const GripModel &grip) { return std::make_unique<GraspLineView>(grip, true); }

std::unique_ptr<View> make_progress_view() { return std::make_unique<ProgressView>(); }

std::unique_ptr<View> make_state_view() { return std::make_unique<StateView>(); }

std::string summary_text(const Model &model) {
  const LineStatistics &line = model.statistics();
  return std::to_string(model.frames()) + " frames in " + fixed(model.seconds(), 2) + " s (" + fixed(model.mean_frames_per_s(), 1) +
         "/s), " + std::to_string(line.dropped_packets) + " packets dropped, " + std::to_string(line.crc_errors) + " CRC errors, " +
         std::to_string(line.format_errors) + " format errors" + edges_text(model);
}

std::string edges_text(const Model &model) {
  const EdgeCounter &edges = model.edges();
  return edges.edges() == 0
             ? ""
             : ", " + std::to_string(edges.edges()) + " edges at the sync pin, " + std::to_string(edges.missing()) + " missing";
}

} // namespace fingertip
