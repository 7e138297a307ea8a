/* fingertip: the command line tool. Exit status: 0 done; 1 an error, reported in one line;
 * 2 wrong usage; of grasp also those of GraspEnd. */
#include "libfingertip/session.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

int main(int argc, char **argv) {
  using namespace fingertip;
  try {
    CommandLine line("Talks to Fingertip tactile sensors: shows, records and replays what they feel.", FINGERTIP_VERSION);
    for (auto add : {add_list,     add_info,      add_doctor,   add_monitor, add_record, add_replay, add_convert,
                     add_tare,     add_calibrate, add_validate, add_fit,     add_pad,    add_set,    add_serve,
                     add_simulate, add_web,       add_gripper,  add_grasp,   add_loader, add_flash,  add_rule}) {
      add(line);
    }
    const int status = line.run(argc, argv);
    /* A reader that has left, as head does, has what it wanted. std::cout is what help goes to. */
    if ((std::fflush(stdout) != 0 || !std::cout) && errno != EPIPE) {
      throw Error(ErrorCode::cannot_write, std::string("cannot write to standard output: ") + std::strerror(errno));
    }
    return status;
  } catch (const WrongUsage &error) {
    print_error("fingertip", error);
    return 2;
  } catch (const Error &error) {
    print_error("fingertip", error);
  } catch (const Interrupted &) {
    std::fprintf(stderr, "fingertip: interrupted\n");
  } catch (const std::exception &error) {
    /* caught so that a screen is given back */
    std::fprintf(stderr, "fingertip: a bug of this tool (%s); please report it\n", error.what());
  }
  return 1;
}
