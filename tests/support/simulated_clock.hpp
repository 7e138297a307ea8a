// What a program on simulated time may ask of it beyond libfingertip/clock.hpp.
#pragma once

#include "libfingertip/clock.hpp"

namespace fingertip::test {

// As of this thread's last wait: before this moment no other thread goes on, unless something that
// it waits for comes. HostTime::max(): never.
HostTime others_wait_until();

} // namespace fingertip::test
