/* Values of packets as the commands print them. */
#pragma once

#include "libfingertip/packet_fields.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace fingertip {

/* "3 7": the sensors of these bits; "" for none. */
std::string sensors_text(sensor_map sensors);

/* The sensors of a count that are not among the present ones. */
sensor_map missing_sensors(sensor_map present, std::uint8_t sensor_count);

/* "13 of 15, missing: 3 7" */
std::string present_text(sensor_map present, std::uint8_t sensor_count);

/* "20.000", in Hz, or "max" */
std::string rate_text(std::uint32_t rate_mHz);

/* The value of this key; "": there is none. */
std::string value_of(const Metadata &pairs, const std::string &key);

/* "2026-08-05 12:00 UTC" */
std::string date_text(std::uint32_t date_s);

/* "a usual contact: sigma 5.58 mm, sd 0.06 mm; dip around it 1.3 % of its peak" */
std::string shape_text(const calibration &calibration);

/* On standard output a row for each sensor: its gain, how far it lies from its place in the layout along x and y, how
 * much wider than the others its response is, and a bar from the mean to its gain. Of a calibration that has no places,
 * only the gains. misfit_share: of each sensor, or none (calibration/solver.hpp). */
void print_gains(const calibration &calibration, std::uint8_t sensor_count, const std::vector<double> &misfit_share = {});

} // namespace fingertip
