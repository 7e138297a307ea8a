/* New firmware into a fingertip, by the USB loader in the chip's boot ROM. */
#pragma once

#include "libfingertip/connection.hpp"

#include <string>

namespace fingertip {

struct FlashOptions {
  std::string file; /* .uf2 */
  Choice choice;
  std::string volume; /* where the loader's drive is or will be mounted; empty: find it */
};

/* Exit status. Throws Error. */
int run_flash(const FlashOptions &options);

} // namespace fingertip
