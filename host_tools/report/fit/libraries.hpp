// Solvers that a host program might use instead, behind the same call as our kernels.
//
// All of them get the readings that the firmware gets, scale them the same way and start from the
// general kernel's first guess, with the analytic Jacobian. They stop by their own rules, whatever
// the iterations of the settings:
//   ceres_new      Ceres, new problem per fit, dense QR, default tolerances
//   ceres_reused   the same problem object for every fit
//   ceres_tight    reused, function 1e-14, gradient 1e-14, parameter 1e-10
//   tiny_solver    ceres::TinySolver, sizes fixed, default tolerances
//   tiny_tight     function 1e-20 (an absolute change of cost), gradient 1e-14, parameter 1e-10
//   cminpack       lmder with the tolerances of lmder1 at the square root of epsilon
//   gsl            gsl_multifit_nlinear, trust region LM, xtol = gtol = 1e-8, ftol = 0
// The fits use every sensor of a fully usable array and report no flags but FIT_VALID.
#pragma once

#include "report/fit/compared.hpp"

#include <string>

namespace fingertip::fitting {

// By its name, or nullptr. Not for several threads at once: some keep their workspace.
Solve library_named(const std::string &name);

} // namespace fingertip::fitting
