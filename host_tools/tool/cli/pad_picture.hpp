/* The pad as the monitor draws it: the fitted pressure as colour, over it each sensor with its
 * number, its measured and its fitted pressure, and the tangential force as an arrow. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/model.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

/* Where a location of the pad is in a picture: in square pixels, two to a character cell. */
class PadScale {
public:
  /* Of N sensors, in at most the given number of cells. */
  template <typename Number> PadScale(const Number *x_mm, const Number *y_mm, std::size_t sensors, int columns, int rows) {
    constexpr float rim_mm = 5;        /* beyond the outer sensors: half a pitch of 9 mm and some */
    constexpr float finest_mm = 0.75f; /* sensors 9 mm apart measure nothing that is finer */
    const auto [left, right] = std::minmax_element(x_mm, x_mm + sensors);
    const auto [bottom, top] = std::minmax_element(y_mm, y_mm + sensors);
    left_mm_ = static_cast<float>(*left) - rim_mm;
    top_mm_ = static_cast<float>(*top) + rim_mm;
    const float width_mm = static_cast<float>(*right) + rim_mm - left_mm_;
    const float height_mm = top_mm_ - static_cast<float>(*bottom) + rim_mm;
    pixel_mm_ =
        std::max({width_mm / static_cast<float>(std::max(columns, 4)), height_mm / static_cast<float>(2 * std::max(rows, 2)), finest_mm});
    columns_ = static_cast<int>(std::lround(width_mm / pixel_mm_));
    rows_ = static_cast<int>(std::lround(height_mm / pixel_mm_ / 2));
  }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  float pixel_mm() const { return pixel_mm_; }
  float x_mm(int column) const { return left_mm_ + (static_cast<float>(column) + 0.5f) * pixel_mm_; }
  float y_mm(int pixel_row) const { return top_mm_ - (static_cast<float>(pixel_row) + 0.5f) * pixel_mm_; }
  int column_of(float x_mm) const { return static_cast<int>(std::floor((x_mm - left_mm_) / pixel_mm_)); }
  int pixel_row_of(float y_mm) const { return static_cast<int>(std::floor((top_mm_ - y_mm) / pixel_mm_)); }

private:
  float left_mm_, top_mm_, pixel_mm_;
  int columns_, rows_;
};

/* In its frame, at the upper left corner of what is available; the area that it took. The model must know its sensors. */
Area draw_pad(Canvas &canvas, const Area &available, const Model &model);

} // namespace fingertip
