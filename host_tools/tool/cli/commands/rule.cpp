#include "tool/cli/command_line.hpp"

#include <cstdio>

namespace fingertip {

extern const char *const UDEV_RULE; /* the text of 60-fingertip.rules */

void add_rule(CommandLine &line) {
  line.add("rule", "Print the udev rule that lets users without privileges open fingertips", [] {
    std::fputs(UDEV_RULE, stdout);
    return 0;
  });
}

} // namespace fingertip
