/* The messages that the command line tools add to the library's errors. */
#pragma once

#include "libfingertip/error.hpp"

#include <string>

namespace fingertip {

/* The end of a sentence about an error of this kind: what to do; "" if its text is enough. */
std::string advice(ErrorCode code);

/* The same for a gripper's line. */
std::string gripper_advice(ErrorCode code);

/* One line, harmless to a terminal: what is wrong; what to do. */
std::string error_text(const Error &error);

/* "NAME: what is wrong; what to do" on standard error. */
void print_error(const char *program, const Error &error);

/* While something streams: it is waited for. */
inline constexpr const char *GONE_ADVICE = "gone, plug it in again";

} // namespace fingertip
