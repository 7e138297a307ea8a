/* What the command line tools say to their users beyond the library's facts, in one place. */
#pragma once

#include "libfingertip/error.hpp"

#include <string>

namespace fingertip {

/* For the end of a sentence, of an error of this kind; "" where its text says all. */
std::string advice(ErrorCode code);

/* The same for a gripper's line. */
std::string gripper_advice(ErrorCode code);

/* One line, harmless to a terminal: what is wrong; what to do. */
std::string told(const Error &error);

/* "NAME: what is wrong; what to do" on standard error. */
void tell(const char *program, const Error &error);

/* While something streams: it is waited for. */
inline constexpr const char *GONE_ADVICE = "gone, plug it in again";

} // namespace fingertip
