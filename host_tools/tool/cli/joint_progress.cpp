#include "tool/cli/joint_progress.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/advice.hpp"

#include <cstdio>
#include <unistd.h>

namespace fingertip {

namespace {

constexpr std::chrono::milliseconds SHOW_INTERVAL{1000};

std::string state_of(const Model &model) {
  if (model.state() == Model::State::gone) {
    return std::string(" ") + GONE_ADVICE;
  }
  auto silence_s = model.seconds_since_frame();
  return silence_s && *silence_s > STALLED_s ? " STALLED" : "";
}

} // namespace

JointProgress::~JointProgress() {
  if (shown_ && isatty(STDERR_FILENO)) {
    std::fputs("\r\x1b[K", stderr);
  }
}

void JointProgress::update(const std::vector<Model> &models, double seconds, double alignment_us) {
  auto now = host_now();
  if (now < next_) {
    return;
  }
  next_ = now + SHOW_INTERVAL;
  shown_ = true;
  std::string text = fixed(seconds, 1) + " s";
  for (const Model &model : models) {
    text += "  " + (model.info() ? text_field(model.info()->serial) : model.source()) + " " +
            std::to_string(model.frames()) + " frames" + state_of(model);
  }
  text += "  aligned to " + fixed(alignment_us, 0) + " us";
  std::fprintf(stderr, isatty(STDERR_FILENO) ? "\r\x1b[K%s" : "%s\n", printable(text).c_str());
  std::fflush(stderr);
}

} // namespace fingertip
