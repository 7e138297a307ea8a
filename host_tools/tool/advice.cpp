#include "tool/advice.hpp"

#include "libfingertip/text.hpp"

#include <cstdio>

namespace fingertip {

std::string advice(ErrorCode code) {
  switch (code) {
  case ErrorCode::no_port:
    return "plug the fingertip in, then see `fingertip list`";
  case ErrorCode::not_a_port:
    return "a recording is shown with `fingertip replay`";
  case ErrorCode::port_in_use:
    return "end that one first (`fingertip doctor` names it)";
  case ErrorCode::permission_denied:
    return "install the udev rule: fingertip rule | sudo tee "
           "/etc/udev/rules.d/60-fingertip.rules, then sudo udevadm control --reload, and plug it "
           "in again";
  case ErrorCode::cannot_open:
  case ErrorCode::cannot_read:
    return "check the path";
  case ErrorCode::no_fingertip:
    return "plug one in, name its port with --port PATH or in FINGERTIP_PORT, or simulate one with "
           "`fingertip simulate`";
  case ErrorCode::not_simulated:
    return "start `fingertip simulate`, with --lift where two or a gripper are needed";
  case ErrorCode::several_fingertips:
  case ErrorCode::several_in_file:
  case ErrorCode::no_such_in_file:
    return "choose one with --device SERIAL";
  case ErrorCode::no_such_fingertip:
    return "plug it in, then see `fingertip list`";
  case ErrorCode::other_fingertip:
    return "see `fingertip list`, and choose by --device alone";
  case ErrorCode::no_driver:
    return "load the driver cdc_acm, or end the program that uses it by libusb; or try --transport "
           "usb";
  case ErrorCode::not_a_fingertip:
    return "install firmware with `fingertip flash`";
  case ErrorCode::usb_failed:
    return "unplug it and plug it in again";
  case ErrorCode::wrong_choice:
    return "choose the fingertip with --device";
  case ErrorCode::not_shared:
    return "share it with `fingertip serve`, or leave out --transport socket";
  case ErrorCode::share_denied:
    return "join the group, or share it with serve --group";
  case ErrorCode::shared_already:
    return "use it as if it were your own, or end that one first";
  case ErrorCode::cannot_share:
    return "set XDG_RUNTIME_DIR to a folder of your own";
  case ErrorCode::gone:
    return "plug it in and try again";
  case ErrorCode::no_answer:
    return "is it a fingertip? unplug it and plug it in again";
  case ErrorCode::other_version:
    return "install this tool's firmware with `fingertip flash`, or use the other's tool";
  case ErrorCode::unknown_command:
    return "see what it can do (fingertip info), or update it";
  case ErrorCode::not_now:
    return "see that its sensors answer and nothing is being stored (fingertip info)";
  case ErrorCode::refused:
    return "update these tools";
  case ErrorCode::gripper_silent:
    return "is it powered, its cable right, --model, --port and --slave its own? "
           "(fingertip gripper list)";
  case ErrorCode::gripper_garbled:
    return "look for a second program or device on its line, loose cables, a missing terminator, "
           "another --model";
  case ErrorCode::gripper_refused:
    return "see that --model is its own, turn its power off and on";
  case ErrorCode::cannot_write:
    return "choose another place";
  case ErrorCode::file_exists:
    return "choose another name, or --overwrite";
  case ErrorCode::is_folder:
    return "give the name of a file in it";
  case ErrorCode::write_undone:
    return "make room and try again";
  case ErrorCode::write_cut:
    return "make room and start a new file";
  case ErrorCode::write_torn:
    return "read it with --salvage";
  case ErrorCode::not_a_recording:
    return "give a file that `fingertip record` wrote";
  case ErrorCode::other_format:
    return "use the version of fingertip that wrote it, or a newer one";
  case ErrorCode::damaged_line:
    return "use --salvage to skip damaged lines";
  case ErrorCode::damaged_head:
    return "nothing can be read without it, record again";
  case ErrorCode::other_sensor_count:
    return "record each into a file of its own";
  case ErrorCode::not_firmware:
    return "give build/BOARD/fingertip-BOARD.uf2";
  case ErrorCode::other_chip:
    return "give an image for the RP2040";
  case ErrorCode::damaged_firmware:
    return "build or download it again";
  case ErrorCode::other:
  case ErrorCode::refused_value:
  case ErrorCode::bad_value:
    break;
  }
  return "";
}

std::string gripper_advice(ErrorCode code) {
  switch (code) {
  case ErrorCode::no_port:
    return "plug its adapter in, then see `fingertip gripper list`";
  case ErrorCode::not_a_port:
    return "see `fingertip gripper list`";
  case ErrorCode::permission_denied:
    return "let your user use serial ports: sudo adduser $USER dialout, then log in again";
  case ErrorCode::port_in_use:
    return "end that one first (lsof names it)";
  default:
    return advice(code);
  }
}

std::string error_text(const Error &error) {
  std::string what_to_do = advice(error.code());
  return printable(error.what() + (what_to_do.empty() ? "" : "; " + what_to_do));
}

void print_error(const char *program, const Error &error) {
  std::fprintf(stderr, "%s: %s\n", program, error_text(error).c_str());
}

} // namespace fingertip
