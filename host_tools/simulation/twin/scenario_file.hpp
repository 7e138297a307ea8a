// Scenarios as files: the scenario that emulator and native pipeline play, and the events in it.
//
// FILE.csv is a scenario ("# fingertip-scenario 1", host_tools/simulation/emulator/scenario.mjs): truth, then what each
// sensor reports above ambient with all effects in it. It is linear between rows. Computed each millisecond of a
// contact, written where the line through the rows would leave 0.2 Pa + 1e-4 of the largest reading in any sensor (or
// 0.1 mN + 1e-4 of the force, 2 um, 2 mK), and wherever contact or slip change.
//   contact    1 while the force is not 0
//   x_mm y_mm  middle of the contact; of two, their centre of force
//   force_N    on the pad, of all contacts
//   p0_Pa sigma_mm  the Gaussian that is closest to the pressure on the base without errors
//              (best_gaussian.hpp), of a layer without end; 0 with two contacts
//   slip       see scenarios.hpp
//   Qx_N Qy_N  tangential force of all objects on the rubber; only if the scenario has any.
//              p0_Pa and sigma_mm are then without it
//   temperature_degC  only with the effects "temperature" and "branch"
//
// FILE.truth.csv has one row for each phase of each contact:
//   # fingertip-truth 1
//   # name: name                   # scenario: FILE.csv without its folder
//   act         number of the contact, from 1
//   press       what the contact is: tap press hold placement poke cycle grip roll two lift drag
//               screw; of slides what happens: pull overload loosen carry
//   phase       touch hold release; poke; load unload; dead_travel slip after; twist; roll;
//               lift carry lower; of drags load carry pull slip unload after; of screws load wind
//               spin unwind lower after; of slides sticks, partial_slip (since half of the normal
//               force's contact slid, until three quarters of it stick again) and slip (all
//               slides), as they come; of the first two none shorter than 5 ms
//   t_begin_s t_end_s              on the scenario's clock
//   x_mm y_mm force_N angle_deg    at its beginning, of the first contact; the force is what its
//                                  travel asks for of rubber that has not relaxed
//   x_end_mm y_end_mm force_end_N angle_end_deg   at its end
//   x2_mm y2_mm force2_N force2_end_N   of the second contact; empty if there is none
//   sensors_near                   grid: 1 above a sensor, 2 between two, 4 between four; else 0
//   speed_mm_s dead_travel_mm stick_slip_mm       of the pusher or of what is pulled, of slides the
//                                  highest in gross slip; 0 where there is none
//   Qx_N Qy_N Qx_end_N Qy_end_N    of the first contact; only if the scenario has any tangential
//                                  force, and so
//   friction mass_kg               static, of what is pulled; of the object, two fingers', or of
//                                  the weight; 0 where there is none
// The indenter is in the metadata of both.
#pragma once

#include "library/pad/block_table.hpp"
#include "simulation/twin/scenarios.hpp"

#include <functional>
#include <string>

namespace fingertip::twin {

std::string truth_path(const std::string &scenario_path);

struct Written {
  std::size_t rows = 0, bytes = 0;
  double peak_Pa = 0.0; // largest reading above ambient
};

// Both files, whole or not at all. `block` is null for a layer without end. Throws Error, also if a contact leaves the
// block, but by rolling off.
Written write_scenario(const Scenario &scenario, const Layer &layer, const ContactTable &table, const BlockTable *block,
                       const std::string &path, bool replace, const std::function<void(double share)> &on_progress = {});

} // namespace fingertip::twin
