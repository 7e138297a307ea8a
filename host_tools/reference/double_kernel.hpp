// The firmware's general kernel in double precision: the same guess, step limits and box.
#pragma once

#include "reference/kernels.hpp"

namespace fingertip::reference {

KernelResult double_kernel(const fit_array &array, const std::int32_t *pressure_Pa_q10,
                           std::uint32_t usable, const KernelSettings &settings);

} // namespace fingertip::reference
