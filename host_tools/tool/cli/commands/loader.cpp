#include "libfingertip/command.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/device.hpp"

#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

int loader(const Choice &choice) {
  Device device(choice);
  device.session.command(command_loader());
  std::printf("restarting into the USB loader: the drive RPI-RP2 takes a .uf2 file\n");
  return 0;
}

} // namespace

void add_loader(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_port(
      line.add("loader", "Restart into the USB loader, to install firmware", [choice] { return loader(*choice); }),
      *choice);
}

} // namespace fingertip
