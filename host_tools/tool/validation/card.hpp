/* The report card as one page of HTML: what was found, the figures beside the twin's, pictures. It
 * loads nothing and runs no script. */
#pragma once

#include "tool/validation/assess.hpp"

#include <string>

namespace fingertip::validating {

/* version: of the tool. The same card gives the same bytes. */
std::string card_html(const Card &card, const std::string &version);

} // namespace fingertip::validating
