#include "tool/validation/plot.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

constexpr double ROOM = 0.05, TICKS = 5.0;

std::string px_text(double value) {
  return fixed(value, 1);
}

} // namespace

Range range_of(const std::vector<double> &values, bool from_zero) {
  Range range{0.0, 0.0};
  if (!values.empty()) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    range = {from_zero ? std::min(*low, 0.0) : *low, from_zero ? std::max(*high, 0.0) : *high};
  }
  const double room = range.high > range.low ? ROOM * (range.high - range.low) : 0.5;
  return {from_zero && range.low == 0.0 ? 0.0 : range.low - room, range.high + room};
}

std::string escaped(const std::string &text) {
  std::string out;
  for (char c : text) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return out;
}

Plot::Plot(int width, int height, Range x, Range y, const std::string &x_name, const std::string &y_name, bool equal)
    : width_(width), height_(height), x_(x), y_(y), right_(width - 8), bottom_(height - 34) {
  if (equal) {
    const double unit = std::min((right_ - left_) / (x.high - x.low), (bottom_ - top_) / (y.high - y.low));
    right_ = left_ + unit * (x.high - x.low);
    bottom_ = top_ + unit * (y.high - y.low);
    width_ = static_cast<int>(right_) + 8;
    height_ = static_cast<int>(bottom_) + 34;
  }
  frame_ += "<rect class=\"frame\" x=\"" + px_text(left_) + "\" y=\"" + px_text(top_) + "\" width=\"" +
            px_text(right_ - left_) + "\" height=\"" + px_text(bottom_ - top_) + "\"/>";
  ticks(x_, true);
  ticks(y_, false);
  frame_ += "<text class=\"name\" x=\"" + px_text(0.5 * (left_ + right_)) + "\" y=\"" + px_text(bottom_ + 30) +
            "\" text-anchor=\"middle\">" + escaped(x_name) + "</text>";
  frame_ += "<text class=\"name\" transform=\"translate(11 " + px_text(0.5 * (top_ + bottom_)) +
            ") rotate(-90)\" text-anchor=\"middle\">" + escaped(y_name) + "</text>";
}

double Plot::px(double x) const {
  return left_ + (right_ - left_) * (x - x_.low) / (x_.high - x_.low);
}

double Plot::py(double y) const {
  return bottom_ - (bottom_ - top_) * (y - y_.low) / (y_.high - y_.low);
}

void Plot::ticks(const Range &range, bool is_x) {
  const double rough = (range.high - range.low) / TICKS;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  const double share = rough / decade;
  const double step = decade * (share > 5.0 ? 10.0 : share > 2.0 ? 5.0 : share > 1.0 ? 2.0 : 1.0);
  const int digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  for (double at = std::ceil(range.low / step) * step; at <= range.high + 1e-9 * step; at += step) {
    const std::string words = fixed(std::abs(at) < 1e-9 * step ? 0.0 : at, digits);
    if (is_x) {
      frame_ += "<path class=\"tick\" d=\"M" + px_text(px(at)) + " " + px_text(bottom_) + "v4\"/><text x=\"" +
                px_text(px(at)) + "\" y=\"" + px_text(bottom_ + 15) + "\" text-anchor=\"middle\">" + words + "</text>";
    } else {
      frame_ += "<path class=\"tick\" d=\"M" + px_text(left_) + " " + px_text(py(at)) + "h-4\"/><text x=\"" +
                px_text(left_ - 6) + "\" y=\"" + px_text(py(at) + 4) + "\" text-anchor=\"end\">" + words + "</text>";
    }
  }
}

void Plot::line(const std::vector<std::pair<double, double>> &points, const std::string &style) {
  std::string path;
  for (const auto &[x, y] : points) {
    path += (path.empty() ? "M" : "L") + px_text(px(x)) + " " + px_text(py(y));
  }
  body_ += "<path class=\"" + style + "\" d=\"" + path + "\"/>";
}

void Plot::dot(double x, double y, double radius_px, const std::string &style) {
  body_ += "<circle class=\"" + style + "\" cx=\"" + px_text(px(x)) + "\" cy=\"" + px_text(py(y)) + "\" r=\"" +
           px_text(radius_px) + "\"/>";
}

void Plot::bar(double x, double half_width, double y, const std::string &style) {
  const double low = py(std::min(y, foot_)), high = py(std::max(y, foot_));
  body_ += "<rect class=\"" + style + "\" x=\"" + px_text(px(x - half_width)) + "\" y=\"" + px_text(high) +
           "\" width=\"" + px_text(px(x + half_width) - px(x - half_width)) + "\" height=\"" + px_text(low - high) +
           "\"/>";
}

void Plot::text(double x, double y, const std::string &words, const std::string &style) {
  body_ += "<text class=\"" + style + "\" x=\"" + px_text(px(x)) + "\" y=\"" + px_text(py(y)) +
           "\" text-anchor=\"middle\">" + escaped(words) + "</text>";
}

std::string Plot::svg(const std::string &title) const {
  const std::string inner_width = px_text(right_ - left_), inner_height = px_text(bottom_ - top_);
  const std::string size = std::to_string(width_) + " " + std::to_string(height_);
  return "<svg role=\"img\" width=\"" + std::to_string(width_) + "\" viewBox=\"0 0 " + size + "\"><title>" +
         escaped(title) + "</title>" + frame_ + "<svg x=\"" + px_text(left_) + "\" y=\"" + px_text(top_) +
         "\" width=\"" + inner_width + "\" height=\"" + inner_height + "\" viewBox=\"" + px_text(left_) + " " +
         px_text(top_) + " " + inner_width + " " + inner_height + "\">" + body_ + "</svg></svg>";
}

} // namespace fingertip::validating
