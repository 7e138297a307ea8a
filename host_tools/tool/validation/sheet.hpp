/* The template of a validation, to be printed at 1:1: the marks in their order, the sensors' places
 * to align it by, and a line of 50 mm to measure the print. */
#pragma once

#include "tool/validation/protocol.hpp"

#include <string>

namespace fingertip::validating {

constexpr double RULER_mm = 50.0;

std::string sheet_svg(const calibrating::Array &array);
/* A4, one page, nothing but lines and Helvetica. */
std::string sheet_pdf(const calibrating::Array &array);

} // namespace fingertip::validating
