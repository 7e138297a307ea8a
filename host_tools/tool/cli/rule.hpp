#pragma once

namespace fingertip {

/* The text of 60-fingertip.rules. */
extern const char *const UDEV_RULE;

} // namespace fingertip
