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

} // namespace fingertip
