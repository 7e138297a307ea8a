#pragma once
#include <cstdint>
namespace fingertip::web { struct PadX { double pressure_Pa(unsigned, std::uint64_t) { return 101325; } }; inline PadX &pad() { static PadX p; return p; } }
