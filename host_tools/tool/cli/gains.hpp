/* Calibrations, printed for people. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <string>

namespace fingertip {

/* "2026-08-05 12:00 UTC" */
std::string date_text(std::uint32_t date_s);

/* "a usual contact: sigma 5.58 mm, sd 0.06 mm; dip around it 1.3 % of its peak" */
std::string shape_text(const calibration &calibration);

/* On standard output a row for each sensor: its gain, how far it lies from its place in the layout
 * along x and y, how much wider than the others its response is, and a bar from the mean to its
 * gain. Of a calibration that has no places, only the gains. */
void print_gains(const calibration &calibration, std::uint8_t sensor_count);

} // namespace fingertip
