#include "tool/validation/protocol.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::validating {
namespace {

constexpr const char *BEGINS = "validate: ";
constexpr std::array<const char *, 7> KINDS = {"begin", "empty", "press", "take_back",
                                               "hold",  "rest",  "end"};
constexpr double OUTLINE_SHARE = 0.8; /* outside it too few sensors feel a press */
constexpr int SHORT_MARKS = 3, LONG_MARKS = 5;
constexpr std::size_t STRIDE = 7; /* has no divisor in common with their number */

double half_millimetres(double length_mm) {
  return 0.5 * std::round(2.0 * length_mm);
}

std::string number(double value) {
  return shortest(static_cast<float>(value));
}

} // namespace

std::vector<Mark> marks_of(const calibrating::Array &array) {
  const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [low, high] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  const double half_x = 0.5 * (*right - *left), half_y = 0.5 * (*high - *low);
  const bool is_long_in_y = half_y >= half_x;
  const int columns = is_long_in_y ? SHORT_MARKS : LONG_MARKS;
  const int rows = is_long_in_y ? LONG_MARKS : SHORT_MARKS;
  const auto along = [](double from, double to, double half, int i, int count) {
    return half_millimetres(0.5 * (from + to) +
                            OUTLINE_SHARE * half * (2.0 * i / (count - 1) - 1.0));
  };
  std::vector<Mark> marks;
  for (int column = 0; column < columns; column++) {
    for (int row = rows - 1; row >= 0; row--) {
      marks.push_back(
          {along(*left, *right, half_x, column, columns), along(*low, *high, half_y, row, rows)});
    }
  }
  /* In an order in which each is far from the one before, so that the rubber there is at rest. */
  std::vector<Mark> ordered;
  for (std::size_t i = 0; i < marks.size(); i++) {
    ordered.push_back(marks[i * STRIDE % marks.size()]);
  }
  return ordered;
}

std::string event_of(const Step &step) {
  std::string text = std::string(BEGINS) + KINDS[static_cast<std::size_t>(step.kind)];
  if (step.kind == Step::Kind::begin) {
    text += " weight_g=" + number(step.weight_g) + " skin_mm=" + number(step.skin_mm);
  } else if (step.kind == Step::Kind::press) {
    text += " mark=" + std::to_string(step.mark + 1) + " x_mm=" + number(step.at.x_mm) +
            " y_mm=" + number(step.at.y_mm);
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
    const auto value =
        equals == std::string_view::npos ? std::nullopt : to_double(words[i].substr(equals + 1));
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
      step.weight_g = *value;
    } else if (key == "skin_mm") {
      step.skin_mm = *value;
    } else {
      known--;
    }
  }
  const bool is_whole = step.kind == Step::Kind::press   ? known == 3
                        : step.kind == Step::Kind::begin ? step.weight_g > 0.0 && step.skin_mm > 0.0
                                                         : true;
  return is_whole ? std::optional<Step>(step) : std::nullopt;
}

std::vector<Step> steps_of(const std::vector<Mark> &marks, double weight_g, double skin_mm) {
  Step begin{Step::Kind::begin};
  begin.weight_g = weight_g;
  begin.skin_mm = skin_mm;
  std::vector<Step> steps = {begin, {Step::Kind::empty}};
  for (std::size_t turn = 0; turn < TURNS; turn++) {
    for (std::size_t m = 0; m < marks.size(); m++) {
      steps.push_back({Step::Kind::press, m, marks[m]});
    }
  }
  for (Step::Kind kind : {Step::Kind::hold, Step::Kind::rest, Step::Kind::end}) {
    steps.push_back({kind});
  }
  return steps;
}

} // namespace fingertip::validating
