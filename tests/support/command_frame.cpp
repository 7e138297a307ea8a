#include "libfingertip/command.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/usage.hpp"

#include <cstdio>
#include <functional>
#include <map>
#include <memory>

namespace fingertip {

namespace {

struct EncodeOptions {
  std::vector<std::string> words;
  unsigned sequence = 0;
  std::uint64_t time_us = 0;
};

wire_packet pad_of(const std::string &thickness, const std::string &overhang, bool from_touch) {
  auto thickness_mm = to_double(thickness), overhang_mm = to_double(overhang);
  if (!thickness_mm || !overhang_mm) {
    throw Error("\"" + thickness + "\" and \"" + overhang +
                "\" must be numbers; give thickness and overhang of the rubber, mm");
  }
  return command_pad(pad::profile_over_own_sensors({*thickness_mm, *overhang_mm, from_touch}));
}

/* Of settings that travel in one command. */
wire_packet command_of(std::initializer_list<std::string> texts) {
  std::vector<WantedSetting> wanted;
  for (const std::string &text : texts) {
    wanted.push_back(setting_from_text(text));
  }
  return setting_commands(wanted, {})[0];
}

wire_packet packet_from_words(const std::vector<std::string> &words) {
  struct Form {
    std::size_t arguments;
    std::string usage;
    std::function<wire_packet()> make;
  };
  auto word = [&](std::size_t i) { return words[i]; };
  const std::map<std::string, Form> forms = {
      {"stream",
       {1, "stream none|contact,raw,health",
        [&] { return command_stream(streams_from_text(word(1))); }}},
      {"tare", {0, "tare", [] { return command_tare(); }}},
      {"tare-force", {0, "tare-force", [] { return command_tare(true); }}},
      {"rate", {1, "rate HZ|max", [&] { return command_of({"rate=" + word(1)}); }}},
      {"osr", {1, "osr N", [&] { return command_of({"osr=" + word(1)}); }}},
      {"slip",
       {2, "slip THRESHOLD_MM WINDOW_MS",
        [&] {
          return command_of({"slip_threshold=" + word(1), "slip_window=" + word(2)});
        }}},
      {"info", {0, "info", command_info}},
      {"health", {0, "health", command_health}},
      {"crash", {0, "crash", command_crash}},
      {"loader", {0, "loader", command_loader}},
      {"prior", {1, "prior SIGMA[:WIDTH]|none", [&] { return command_of({"prior=" + word(1)}); }}},
      {"limit", {1, "limit MM", [&] { return command_of({"limit=" + word(1)}); }}},
      {"keep", {0, "keep", [] { return command_keep(true); }}},
      {"forget", {0, "forget", [] { return command_keep(false); }}},
      {"erase", {0, "erase", command_erase_calibration}},
      {"pad", {2, "pad THICKNESS_MM OVERHANG_MM", [&] { return pad_of(word(1), word(2), false); }}},
      {"pad-from-touch",
       {2, "pad-from-touch THICKNESS_MM OVERHANG_MM",
        [&] { return pad_of(word(1), word(2), true); }}},
      {"erase-pad", {0, "erase-pad", command_erase_pad}},
  };
  auto form = forms.find(words[0]);
  if (form == forms.end()) {
    throw Error(
        "command \"" + words[0] +
        "\" is unknown; give stream, tare, tare-force, rate, osr, slip, prior, limit, "
        "keep, forget, erase, pad, pad-from-touch, erase-pad, info, health, crash or loader");
  }
  if (words.size() != 1 + form->second.arguments) {
    throw Error("wrong arguments; give: fingertip encode " + form->second.usage);
  }
  return form->second.make();
}

int encode(const EncodeOptions &options) {
  wire_packet packet = typed([&] { return packet_from_words(options.words); });
  packet.sequence = static_cast<std::uint16_t>(options.sequence);
  packet.t_us = options.time_us;
  std::printf("%s\n", hex(frame_bytes(packet)).c_str());
  return 0;
}

} // namespace

void add_encode(CommandLine &line) {
  auto options = std::make_shared<EncodeOptions>();
  CLI::App *command = line.add("encode", "Print the frame of a command as hexadecimal digits",
                               [options] { return encode(*options); });
  command
      ->add_option("command", options->words,
                   "stream none|contact,raw,health; tare; rate HZ|max; osr N; slip THRESHOLD_MM "
                   "WINDOW_MS; prior SIGMA[:WIDTH]|none; limit MM; keep; forget; erase (the "
                   "calibration); pad THICKNESS_MM OVERHANG_MM, pad-from-touch likewise; "
                   "erase-pad; info; health; crash; loader")
      ->required()
      ->type_name("COMMAND [ARGS]");
  command->add_option("--sequence", options->sequence, "Sequence number; default 0")
      ->check(CLI::Range(0, 65535))
      ->type_name("N");
  command->add_option("--time", options->time_us, "Time of the header; default 0")->type_name("US");
}

} // namespace fingertip
