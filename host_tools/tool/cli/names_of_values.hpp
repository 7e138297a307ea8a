/* Values of packets as the commands print them. */
#pragma once

#include <cstdint>
#include <string>

namespace fingertip {

/* "3 7": the sensors of these bits; "" for none. */
std::string sensors_text(std::uint32_t sensors);

/* The sensors of a count that are not among the present ones. */
std::uint32_t missing_sensors(std::uint32_t present, std::uint8_t sensor_count);

/* "13 of 15, missing: 3 7" */
std::string present_text(std::uint32_t present, std::uint8_t sensor_count);

/* "20.000", in Hz, or "max" */
std::string rate_text(std::uint32_t rate_mHz);

} // namespace fingertip
