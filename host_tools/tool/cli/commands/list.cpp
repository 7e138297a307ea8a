#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/names_of_values.hpp"

#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

/* "socket /run/fingertip/E66..2C.sock, serial /dev/ttyACM0, usb 001/005" */
std::string reached_text(const Found &found) {
  std::string text = found.socket.empty() ? "" : "socket " + found.socket;
  if (!found.port.empty()) {
    text += (text.empty() ? "" : ", ") + std::string(found.usb ? "serial " : "port ") + found.port;
  }
  if (found.usb) {
    char place[32];
    std::snprintf(place, sizeof place, "usb %03u/%03u", found.usb->bus, found.usb->address);
    text += (text.empty() ? "" : ", ") + std::string(place);
  }
  return text;
}

int list(Reach reach) {
  Finds finds = find_fingertips();
  std::vector<Found> all = finds.here;
  all.insert(all.end(), finds.in_environment.begin(), finds.in_environment.end());
  if (all.empty()) {
    throw Error("no fingertip found; plug one in, or name its port in FINGERTIP_PORT");
  }
  for (const Found &found : all) {
    Metadata info = {{"serial", found.serial}};
    std::string reached = reached_text(found);
    try {
      auto way = way_to(found, reach);
      if (way) {
        info = info_metadata(ask(*way, stop_requested));
      }
    } catch (const Error &error) {
      reached += " (" + error_text(error) + ")";
    }
    for (const char *key : {"serial", "board", "firmware"}) {
      const std::string value = value_of(info, key);
      std::printf("%s\t", value.empty() ? "-" : printable(value).c_str());
    }
    std::printf("%s\n", printable(reached).c_str());
  }
  return 0;
}

} // namespace

void add_list(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_transport(line.add("list",
                          "List the fingertips plugged in, and the paths in $FINGERTIP_PORT: serial number, board, "
                          "firmware, how it is reached",
                          [choice] { return list(choice->reach); }),
                 choice->reach);
}

} // namespace fingertip
