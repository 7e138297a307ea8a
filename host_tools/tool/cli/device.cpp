#include "tool/cli/device.hpp"

#include "libfingertip/text.hpp"

#include <cstdio>

namespace fingertip {

namespace {

/* A fingertip answers within milliseconds, one that starts within a second. */
constexpr std::int64_t SILENCE_us = 1500000;

/* Whether to stop; reports once that the fingertip has not answered. */
std::function<bool()> patience(const Transport &transport, const Session &session) {
  return [&transport, &session, begun_us = steady_now_us(), reported = false]() mutable {
    if (!reported && session.statistics().bytes == 0 && steady_now_us() - begun_us > SILENCE_us) {
      reported = true;
      std::fprintf(stderr, "%s: waiting for an answer\n", printable(transport.description()).c_str());
    }
    return stop_requested();
  };
}

} // namespace

Device::Device(const Choice &choice)
    : transport(open_way(choose_way(choice))), session(*transport, patience(*transport, session)) {}

} // namespace fingertip
