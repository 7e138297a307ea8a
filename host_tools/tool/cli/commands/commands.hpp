/* The commands of the tool; each is a file of this folder and adds itself. */
#pragma once

#include "tool/cli/command_line.hpp"

namespace fingertip {

void add_list(CommandLine &line);
void add_info(CommandLine &line);
void add_doctor(CommandLine &line);
void add_monitor(CommandLine &line);
void add_record(CommandLine &line);
void add_replay(CommandLine &line);
void add_convert(CommandLine &line);
void add_grasp(CommandLine &line);
void add_simulate(CommandLine &line);
void add_serve(CommandLine &line);
void add_web(CommandLine &line);
void add_tare(CommandLine &line);
void add_calibrate(CommandLine &line);
void add_validate(CommandLine &line);
void add_pad(CommandLine &line);
void add_set(CommandLine &line);
void add_loader(CommandLine &line);
void add_gripper(CommandLine &line);
void add_flash(CommandLine &line);
void add_rule(CommandLine &line);

} // namespace fingertip
