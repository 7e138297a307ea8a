/* The wire protocol's C codec, for C++. */
#pragma once

extern "C" {
#include "common/contact_flags.h"
#include "wire/packet.h"
}
