#include "tool/validation/pull_figures.hpp"

#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/validation/median.hpp"

#include <cmath>

namespace fingertip::validating {
namespace {

constexpr double DEGREE = M_PI / 180.0;

double mean_of(const std::vector<double> &values) {
  double sum = 0.0;
  for (double value : values) {
    sum += value;
  }
  return values.empty() ? 0.0 : sum / double(values.size());
}

double sd_of(const std::vector<double> &values) {
  const double mean = mean_of(values);
  double squares = 0.0;
  for (double value : values) {
    squares += (value - mean) * (value - mean);
  }
  return values.size() < 2 ? 0.0 : std::sqrt(squares / double(values.size() - 1));
}

struct Found {                                                       /* [pull] */
  std::vector<double> over_thread, stated_sd, off_deg_squared, zero; /* of those that are estimated */
  std::vector<double> moves_mm, force;                               /* of all that have a location */
  std::size_t warned = 0;
};

void add(Found &found, const Pulled &pulled, double share) {
  const Estimate &rest = pulled.rest, &pull = pulled.pull;
  const double along_x = std::cos(DEGREE * pulled.toward_deg);
  const double along_y = std::sin(DEGREE * pulled.toward_deg);
  found.moves_mm.push_back((pull.x_mm - rest.x_mm) * along_x + (pull.y_mm - rest.y_mm) * along_y -
                           share * pulled.pulling.height_mm);
  found.force.push_back(pull.force_N / rest.force_N - 1.0);
  found.warned += pull.warned;
  if (pull.pull_frames == 0 || rest.pull_frames == 0) {
    return;
  }
  const double x_N = pull.qx_N - rest.qx_N, y_N = pull.qy_N - rest.qy_N;
  const double along_N = x_N * along_x + y_N * along_y, across_N = y_N * along_x - x_N * along_y;
  found.over_thread.push_back(along_N / pull.force_N / share);
  found.stated_sd.push_back(pull.q_sd_N / pull.force_N);
  found.off_deg_squared.push_back(std::pow(std::atan2(across_N, along_N) / DEGREE, 2));
  found.zero.push_back(std::hypot(rest.qx_N, rest.qy_N) / rest.force_N);
}

} // namespace

std::string why_no_pull(const wire_info &info) {
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    return "Scene " + text_field(info.scene) +
           " estimates no pull, so only what a pull does to location and force can be said; flash "
           "firmware of scene grasp for more.";
  }
  if (!(info.stored & WIRE_STORED_PAD)) {
    return "This fingertip does not know its pad, so it estimates no pull, and only what a pull "
           "does to location and force can be said; calibrate it (fingertip calibrate), or set the "
           "pad (fingertip pad), for more.";
  }
  return "";
}

PullFigures pull_figures(const Measured &measured) {
  PullFigures made;
  if (measured.pulls_asked == 0) {
    return made;
  }
  Found found;
  double share = 0.0;
  for (const Pulled &pulled : measured.pulls) {
    if (pulled.rest.frames > 0 && pulled.pull.frames > 0) {
      share = pulled.pulling.weight_g / measured.weight_g;
      add(found, pulled, share);
    }
  }
  if (found.moves_mm.empty()) {
    made.note = "No pull was seen: let the weight stand for two seconds, then hang the other one "
                "on its level thread and leave both alone for two more.";
    return made;
  }
  const bool is_blind = found.over_thread.empty();
  const auto figure = [&](const char *key, const char *says, const char *unit, double value, int digits) {
    made.figures.push_back({std::string(is_blind ? "pull_blind_" : "pull_") + key, says, unit, value, digits});
  };
  figure("true", "pull of the thread, over the weight", "", share, 3);
  if (!is_blind) {
    figure("over_thread", "pull found over that of the thread, mean of the pulls", "", mean_of(found.over_thread), 3);
    figure("scatter", "that scatters by, sd", "", sd_of(found.over_thread), 3);
    figure("direction_deg", "direction of the pull off by, rms", "deg", std::sqrt(mean_of(found.off_deg_squared)), 1);
    figure("stated_sd", "standard deviation that the fingertip states, of the force, median", "",
           upper_median(found.stated_sd), 3);
    figure("zero", "pull found before each pull, of the force, median", "", upper_median(found.zero), 3);
  }
  figure("moves_mm", "a pull moves the location along by, mean", "mm", mean_of(found.moves_mm), 2);
  figure("moves_scatter_mm", "that scatters by, sd", "mm", sd_of(found.moves_mm), 2);
  figure("force_percent", "a pull changes the force by, mean", "%", 100.0 * mean_of(found.force), 1);
  figure("warned_percent", "pulls with a warning", "%", 100.0 * double(found.warned) / double(found.moves_mm.size()),
         0);
  made.note = is_blind ? why_no_pull(measured.info) : "";
  if (made.note.empty() && found.over_thread.size() < measured.pulls_asked) {
    made.note = "The fingertip estimated " + std::to_string(found.over_thread.size()) + " of " +
                std::to_string(measured.pulls_asked) +
                " pulls; give it its pad's thickness and overhang (fingertip pad).";
  }
  return made;
}

} // namespace fingertip::validating
