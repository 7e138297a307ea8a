/* Pictures of the card: SVG that stands in a page, drawn from numbers. */
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace fingertip::validating {

struct Range {
  double low, high;
};

/* With five percent of room; of nothing, or of one value, one wide. */
Range range_of(const std::vector<double> &values, bool from_zero = false);

/* A frame with ticks and names; what is drawn comes in its units. */
class Plot {
public:
  /* px of the picture; equal: a unit is as long in y as in x. */
  Plot(int width, int height, Range x, Range y, const std::string &x_name, const std::string &y_name,
       bool equal = false);

  void line(const std::vector<std::pair<double, double>> &points, const std::string &style);
  void dot(double x, double y, double radius_px, const std::string &style);
  void bar(double x, double half_width, double y, const std::string &style); /* from 0, or 1 */
  void bars_from(double y) { foot_ = y; }
  void text(double x, double y, const std::string &words, const std::string &style = "");
  /* title: for those who cannot see it. */
  std::string svg(const std::string &title) const;

private:
  double px(double x) const;
  double py(double y) const;
  void ticks(const Range &range, bool is_x);

  int width_, height_;
  Range x_, y_;
  double left_ = 46, top_ = 8, right_, bottom_, foot_ = 0.0;
  std::string frame_, body_; /* body_: what ends at the frame */
};

/* For text between tags. */
std::string escaped(const std::string &text);

} // namespace fingertip::validating
