/* What was typed and cannot be meant: exit status 2. */
#pragma once

#include "libfingertip/error.hpp"

namespace fingertip {

class WrongUsage : public Error {
public:
  using Error::Error;
};

/* Whatever the parser throws is wrong usage. */
template <typename Parse> auto typed(Parse parse) {
  try {
    return parse();
  } catch (const Error &error) {
    throw WrongUsage(error.code(), error.what());
  }
}

} // namespace fingertip
