#include "tool/validation/protocol.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace fingertip::validating {
namespace {

constexpr const char *BEGINS = "validate: ";
constexpr std::array<const char *, 8> KINDS = {"begin", "empty", "press", "take_back", "hold", "rest", "pull", "end"};
/* Of the marks sorted by columns, the next one in their order: far from the one before. */
constexpr std::size_t STRIDE_MIN = 7;
/* In pitches: how far apart two sensors across a cell of a grid are. */
constexpr double ACROSS_MIN = 1.2, ACROSS_MAX = 1.6;

double half_millimetres(double length_mm) {
  return 0.5 * std::round(2.0 * length_mm);
}

std::string number(double value) {
  return shortest(static_cast<float>(value));
}

} // namespace

std::vector<Mark> marks_of(const calibrating::Array &array) {
  std::vector<Mark> marks;
  const auto add = [&](double x_mm, double y_mm) {
    const Mark mark{half_millimetres(x_mm), half_millimetres(y_mm)};
    if (std::none_of(marks.begin(), marks.end(),
                     [&](const Mark &other) { return other.x_mm == mark.x_mm && other.y_mm == mark.y_mm; })) {
      marks.push_back(mark);
    }
  };
  for (std::size_t k = 0; k < array.sensors(); k++) {
    add(array.x_mm[k], array.y_mm[k]);
    for (std::size_t j = 0; j < k; j++) {
      const double pitches = std::hypot(array.x_mm[k] - array.x_mm[j], array.y_mm[k] - array.y_mm[j]) / array.pitch_mm;
      if (pitches > ACROSS_MIN && pitches < ACROSS_MAX) {
        add(0.5 * (array.x_mm[k] + array.x_mm[j]), 0.5 * (array.y_mm[k] + array.y_mm[j]));
      }
    }
  }
  std::sort(marks.begin(), marks.end(),
            [](const Mark &a, const Mark &b) { return a.x_mm != b.x_mm ? a.x_mm < b.x_mm : a.y_mm > b.y_mm; });
  std::size_t stride = STRIDE_MIN;
  while (std::gcd(stride, marks.size()) > 1) {
    stride++;
  }
  std::vector<Mark> ordered;
  for (std::size_t i = 0; i < marks.size(); i++) {
    ordered.push_back(marks[i * stride % marks.size()]);
  }
  return ordered;
}

std::string event_of(const Step &step) {
  std::string text = std::string(BEGINS) + KINDS[static_cast<std::size_t>(step.kind)];
  if (step.kind == Step::Kind::begin) {
    text += " weight_g=" + number(step.weight_g) + " skin_mm=" + number(step.skin_mm);
  } else if (step.kind == Step::Kind::press) {
    text +=
        " mark=" + std::to_string(step.mark + 1) + " x_mm=" + number(step.at.x_mm) + " y_mm=" + number(step.at.y_mm);
  } else if (step.kind == Step::Kind::pull) {
    text += " toward_deg=" + number(step.toward_deg) + " weight_g=" + number(step.pulling.weight_g) +
            " height_mm=" + number(step.pulling.height_mm);
  }
  return text;
}

std::optional<Step> step_of(const std::string &event) {
  const std::string begins = BEGINS;
  if (event.compare(0, begins.size(), begins) != 0) {
    return std::nullopt;
  }
  const std::string rest = event.substr(begins.size());
  const auto words = split(rest, ' ');
  const auto kind = std::find(KINDS.begin(), KINDS.end(), words[0]);
  if (kind == KINDS.end()) {
    return std::nullopt;
  }
  Step step{static_cast<Step::Kind>(kind - KINDS.begin())};
  std::size_t known = 0;
  for (std::size_t i = 1; i < words.size(); i++) {
    const std::size_t equals = words[i].find('=');
    const auto value = equals == std::string_view::npos ? std::nullopt : to_double(words[i].substr(equals + 1));
    if (!value) {
      continue;
    }
    const std::string_view key = words[i].substr(0, equals);
    known++;
    if (key == "mark" && *value >= 1.0) {
      step.mark = static_cast<std::size_t>(*value) - 1;
    } else if (key == "x_mm") {
      step.at.x_mm = *value;
    } else if (key == "y_mm") {
      step.at.y_mm = *value;
    } else if (key == "weight_g") {
      (step.kind == Step::Kind::pull ? step.pulling.weight_g : step.weight_g) = *value;
    } else if (key == "skin_mm") {
      step.skin_mm = *value;
    } else if (key == "toward_deg") {
      step.toward_deg = *value;
    } else if (key == "height_mm") {
      step.pulling.height_mm = *value;
    } else {
      known--;
    }
  }
  const bool is_whole = step.kind == Step::Kind::press   ? known == 3
                        : step.kind == Step::Kind::pull  ? known == 3 && step.pulling.weight_g > 0.0
                        : step.kind == Step::Kind::begin ? step.weight_g > 0.0 && step.skin_mm > 0.0
                                                         : true;
  return is_whole ? std::optional<Step>(step) : std::nullopt;
}

std::string way_of(double toward_deg) {
  static const char *const WAYS[] = {"+x", "+y", "-x", "-y"};
  return WAYS[static_cast<std::size_t>(std::lround(toward_deg / 90.0)) % std::size(WAYS)];
}

std::vector<Step> steps_of(const std::vector<Mark> &marks, double weight_g, double skin_mm, const Pulling &pulling) {
  Step begin{Step::Kind::begin};
  begin.weight_g = weight_g;
  begin.skin_mm = skin_mm;
  std::vector<Step> steps = {begin, {Step::Kind::empty}};
  for (std::size_t turn = 0; turn < TURNS; turn++) {
    for (std::size_t m = 0; m < marks.size(); m++) {
      steps.push_back({Step::Kind::press, m, marks[m]});
    }
  }
  steps.push_back({Step::Kind::hold});
  steps.push_back({Step::Kind::rest});
  for (double toward_deg : PULLS_TOWARD_deg) {
    if (pulling.weight_g > 0.0) {
      Step pull{Step::Kind::pull};
      pull.toward_deg = toward_deg;
      pull.pulling = pulling;
      steps.push_back(pull);
    }
  }
  steps.push_back({Step::Kind::end});
  return steps;
}

} // namespace fingertip::validating
