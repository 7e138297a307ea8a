/* fingertip validate: a pad's report card, from presses of one weight at the marks of a printed
 * template, live or in a recording. */
#pragma once

#include "libfingertip/connection.hpp"
#include "tool/cli/terminal.hpp"
#include "tool/validation/protocol.hpp"

#include <string>

namespace fingertip {

struct ValidateOptions {
  Choice choice;
  double weight_g = 0.0, skin_mm = 12.0;
  validating::Pulling pulling;
  std::string card;      /* HTML */
  std::string figures;   /* JSON; empty: none */
  std::string recording; /* that is kept, of what is measured live */
  std::string from;      /* a recording; empty: live */
  std::string sheet;     /* the template, SVG or PDF; nothing else is done then */
  bool serial = false;   /* keep the serial number in the recording */
  bool overwrite = false;
  ColourMode colour = ColourMode::automatic;
};

/* Exit status. Throws Error. */
int run_validate(const ValidateOptions &options);

} // namespace fingertip
