#include "tool/advice.hpp"

#include "libfingertip/text.hpp"

#include <cstddef>
#include <cstdio>

namespace fingertip {

namespace {

using Code = ErrorCode;

struct Advice {
  ErrorCode code;
  const char *text;
};

/* Errors without a row need no advice, or have it in their text. */
constexpr Advice ADVICE[] = {
    {Code::no_port, "plug the fingertip in, then see `fingertip list`"},
    {Code::not_a_port, "a recording is shown with `fingertip replay`"},
    {Code::port_in_use, "end that one first (`fingertip doctor` names it)"},
    {Code::permission_denied, "install the udev rule: fingertip rule | sudo tee /etc/udev/rules.d/60-fingertip.rules, then sudo "
                              "udevadm control --reload, and plug it in again"},
    {Code::cannot_open, "check the path"},
    {Code::cannot_read, "check the path"},
    {Code::no_fingertip, "plug one in, name its port with --port PATH or in FINGERTIP_PORT, or simulate one with `fingertip "
                         "simulate`"},
    {Code::not_simulated, "start `fingertip simulate`, with --lift where two or a gripper are needed"},
    {Code::several_fingertips, "choose one with --device SERIAL"},
    {Code::several_in_file, "choose one with --device SERIAL"},
    {Code::no_such_in_file, "choose one with --device SERIAL"},
    {Code::no_such_fingertip, "plug it in, then see `fingertip list`"},
    {Code::other_fingertip, "see `fingertip list`, and choose by --device alone"},
    {Code::no_driver, "load the driver cdc_acm, or end the program that uses it by libusb; or try --transport usb"},
    {Code::not_a_fingertip, "install firmware with `fingertip flash`"},
    {Code::usb_failed, "unplug it and plug it in again"},
    {Code::wrong_choice, "choose the fingertip with --device"},
    {Code::not_shared, "share it with `fingertip serve`, or leave out --transport socket"},
    {Code::share_denied, "join the group, or share it with serve --group"},
    {Code::shared_already, "use it as if it were your own, or end that one first"},
    {Code::cannot_share, "set XDG_RUNTIME_DIR to a folder of your own"},
    {Code::gone, "plug it in and try again"},
    {Code::no_answer, "is it a fingertip? unplug it and plug it in again"},
    {Code::other_version, "install this tool's firmware with `fingertip flash`, or use the other's tool"},
    {Code::unknown_command, "see what it can do (fingertip info), or update it"},
    {Code::not_now, "see that its sensors answer and nothing is being stored (fingertip info)"},
    {Code::refused, "update these tools"},
    {Code::gripper_silent, "is it powered, its cable right, --model, --port and --slave its own? (fingertip gripper list)"},
    {Code::gripper_garbled, "look for a second program or device on its line, loose cables, a missing terminator, another --model"},
    {Code::gripper_refused, "see that --model is its own, turn its power off and on"},
    {Code::cannot_write, "choose another place"},
    {Code::file_exists, "choose another name, or --overwrite"},
    {Code::is_folder, "give the name of a file in it"},
    {Code::write_undone, "make room and try again"},
    {Code::write_cut, "make room and start a new file"},
    {Code::write_torn, "read it with --salvage"},
    {Code::not_a_recording,
     "give a file that `fingertip record` wrote; pressures of others: `fingertip fit`, or `calibrate --from` with --pad"},
    {Code::other_format, "use the version of fingertip that wrote it, or a newer one"},
    {Code::damaged_line, "use --salvage to skip damaged lines"},
    {Code::damaged_head, "nothing can be read without it, record again"},
    {Code::other_sensor_count, "record each into a file of its own"},
    {Code::not_firmware, "give build/BOARD/fingertip-BOARD.uf2"},
    {Code::other_chip, "give an image for the RP2040"},
    {Code::damaged_firmware, "build or download it again"},
};

/* Where a gripper's differs. */
constexpr Advice GRIPPER_ADVICE[] = {
    {Code::no_port, "plug its adapter in, then see `fingertip gripper list`"},
    {Code::not_a_port, "see `fingertip gripper list`"},
    {Code::permission_denied, "let your user use serial ports: sudo adduser $USER dialout, then log in again"},
    {Code::port_in_use, "end that one first (lsof names it)"},
};

template <std::size_t count> std::string advice_in(const Advice (&all)[count], ErrorCode code, const std::string &otherwise) {
  const Advice *found = find_in(all, [&](const Advice &each) { return each.code == code; });
  return found ? found->text : otherwise;
}

} // namespace

std::string advice(ErrorCode code) { return advice_in(ADVICE, code, ""); }

std::string gripper_advice(ErrorCode code) { return advice_in(GRIPPER_ADVICE, code, advice(code)); }

std::string error_text(const Error &error) {
  std::string what_to_do = advice(error.code());
  return printable(error.what() + (what_to_do.empty() ? "" : "; " + what_to_do));
}

void print_error(const char *program, const Error &error) { std::fprintf(stderr, "%s: %s\n", program, error_text(error).c_str()); }

} // namespace fingertip
