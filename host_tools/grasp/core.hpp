// The controller's core, for C++.
#pragma once

extern "C" {
#include "grip/grip.h"
}
