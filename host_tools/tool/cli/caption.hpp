/* The last lines of a screen. */
#pragma once

#include <string>

namespace fingertip {

struct Caption {
  std::string keys;     /* what they do */
  std::string note;     /* what else is going on, such as the recording */
  std::string question; /* instead of both */
};

} // namespace fingertip
