/* What a user can mend: one line that says what is wrong and what to do. Anything else that is
 * thrown is a bug of ours. */
#pragma once

#include <stdexcept>
#include <string>

namespace fingertip {

class Error : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/* For the end of a sentence about a device that may not be opened. */
inline constexpr const char *PERMISSION_ADVICE =
    "permission denied; install the udev rule: fingertip rule | sudo tee "
    "/etc/udev/rules.d/60-fingertip.rules, then sudo udevadm control --reload, and plug it in "
    "again";

/* While something streams: it is waited for. */
inline constexpr const char *GONE_ADVICE = "gone, plug it in again";

} // namespace fingertip
