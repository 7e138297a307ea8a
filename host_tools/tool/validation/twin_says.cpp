#include "tool/validation/twin_says.hpp"

namespace fingertip::validating {
namespace {

constexpr TwinSays ROWS[] = {
#include "tool/validation/twin_says.inc"
};

} // namespace

std::optional<TwinSays> twin_says(const std::string &key, bool is_calibrated) {
  for (const TwinSays &row : ROWS) {
    if (row.is_calibrated == is_calibrated && key == row.key) {
      return row;
    }
  }
  return std::nullopt;
}

} // namespace fingertip::validating
