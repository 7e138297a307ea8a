/* A validation of a fingertip that is there: leads the user, and keeps the recording. */
#pragma once

#include "tool/cli/validate.hpp"
#include "tool/validation/gather.hpp"

namespace fingertip {

/* Throws Error; Interrupted: what was recorded until then stays. The fingertip sends as many frames
 * a second afterwards as before. */
validating::Measured validate_live(const ValidateOptions &options);

} // namespace fingertip
