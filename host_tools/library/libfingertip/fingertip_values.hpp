/* What the sources of fingertip.h share: packets as numbers, and errors as codes. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/fingertip.h"
#include "libfingertip/wire.hpp"

#include <cstddef>
#include <exception>
#include <string>

namespace fingertip::values {

/* How many numbers a packet of the type has; 0: there is none. */
std::size_t count_of(std::uint8_t type);
/* Throws Error with bad_value, which names the field, and with wrong_choice for another count. */
wire_packet packet_of(std::uint8_t type, const double *values, std::size_t count);
/* Writes count_of numbers. */
void put(const wire_packet &packet, double *values);

void put(const LineStatistics &statistics, double counts[FINGERTIP_COUNTS]);
LineStatistics statistics_of(const double counts[FINGERTIP_COUNTS]);

/* Sets the text of fingertip_error. */
fingertip_status failed(fingertip_status status, const std::string &text);
fingertip_status failed(const Error &error);

/* The body's status, or that of what it throws. */
template <typename Body> fingertip_status guarded(Body body) {
  try {
    return body();
  } catch (const Error &error) {
    return failed(error);
  } catch (const std::exception &error) {
    return failed(FINGERTIP_ERR_OTHER, error.what());
  }
}

/* Works like snprintf. */
std::size_t put_text(const std::string &from, char *text, std::size_t size);

} // namespace fingertip::values
