/* Fields of packets, by the names that recordings and people use. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

using Metadata = std::vector<std::pair<std::string, std::string>>;

/* The text of a field that is padded with zeros, if there is room. */
std::string text_field(const char *field);

/* Serial numbers are hexadecimal digits; people type either case. */
bool is_same_serial(const std::string &a, const std::string &b);

/* The scalar fields of an info packet, the sensor positions, and the calibration and the pad's
 * profile where there are any. */
Metadata info_metadata(const wire_info &info);

/* The counters of a health packet. */
std::vector<std::pair<std::string, std::uint32_t>> health_fields(const wire_health &health);

} // namespace fingertip
#pragma GCC visibility pop
