// command_frame: prints the frame of a command as hexadecimal digits, for tests that write to a fingertip's line themselves.
//
// usage: command_frame [--sequence N] COMMAND [ARGS]
//
// COMMAND: stream none|contact,raw,health; tare; rate HZ|max; osr N; slip THRESHOLD_MM WINDOW_MS; keep; forget; calibrate SIGMA_MM
// DIP_PERCENT; pad THICKNESS_MM OVERHANG_MM; sync MODE|off; info; health; crash; loader
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <string>
#include <vector>

using namespace fingertip;

static double number(const std::string &text) {
  const auto value = to_double(text);
  if (!value) {
    throw Error("\"" + text + "\" must be a number");
  }
  return *value;
}

static wire_packet pad_of(const std::string &thickness, const std::string &overhang) {
  return command_pad(pad::profile_over_own_sensors({number(thickness), number(overhang)}));
}

/* Of fifteen sensors that are alike. */
static wire_packet calibration_of(const std::string &sigma, const std::string &dip) {
  constexpr std::uint8_t SENSORS = 15;
  const double sigma_mm = number(sigma);
  calibration made{};
  made.date_s = 1785931200;
  made.placements = 20;
  made.force_scale = 1.0F;
  made.force_scale_sd = 0.01F;
  made.sigma_um = static_cast<std::uint16_t>(std::lround(1e3 * sigma_mm));
  made.sigma_sd_um = static_cast<std::uint16_t>(std::lround(10.0 * sigma_mm));
  made.dip_share_q16 = static_cast<std::uint16_t>(std::lround(655.36 * number(dip)));
  made.dip_sd_um = static_cast<std::uint16_t>(made.dip_share_q16 ? std::lround(2500.0 * sigma_mm) : 0);
  made.ambient_kPa = 101;
  std::fill(made.sensors, made.sensors + SENSORS, sensor_calibration{1.0F, 0.01F, 0, 0, 0});
  return command_calibrate(made, SENSORS);
}

static std::uint8_t streams_of(const std::string &text) {
  for (std::uint8_t streams = 0; streams <= WIRE_STREAM_ALL; streams++) {
    if (streams_text(streams) == text) {
      return streams;
    }
  }
  throw Error("streams \"" + text + "\" are unknown; give none, or some of contact,raw,health in this order");
}

/* Of settings that travel in one command. */
static wire_packet command_of(std::initializer_list<std::string> texts) {
  std::vector<WantedSetting> wanted;
  for (const std::string &text : texts) {
    wanted.push_back(setting_from_text(text));
  }
  return setting_commands(wanted, {})[0];
}

static wire_packet packet_from_words(const std::vector<std::string> &words) {
  struct Form {
    std::size_t arguments;
    std::function<wire_packet()> make;
  };
  auto word = [&](std::size_t i) { return words[i]; };
  std::map<std::string, Form> forms = {
      {"stream", {1, [&] { return command_stream(streams_of(word(1))); }}},
      {"tare", {0, [] { return command_tare(); }}},
      {"rate", {1, [&] { return command_of({"rate=" + word(1)}); }}},
      {"osr", {1, [&] { return command_of({"osr=" + word(1)}); }}},
      {"sync", {1, [&] { return command_of({"sync=" + word(1)}); }}},
      {"slip",
       {2,
        [&] {
          return command_of({"slip_threshold=" + word(1), "slip_window=" + word(2)});
        }}},
      {"info", {0, command_info}},
      {"health", {0, command_health}},
      {"crash", {0, command_crash}},
      {"loader", {0, command_loader}},
      {"keep", {0, [] { return command_keep(true); }}},
      {"forget", {0, [] { return command_keep(false); }}},
      {"calibrate", {2, [&] { return calibration_of(word(1), word(2)); }}},
      {"pad", {2, [&] { return pad_of(word(1), word(2)); }}},
  };
  const auto form = forms.find(words.empty() ? "" : words[0]);
  if (form == forms.end() || words.size() != 1 + form->second.arguments) {
    throw Error("such a command is unknown; the source lists them with their arguments");
  }
  return form->second.make();
}

int main(int argc, char **argv) {
  try {
    std::vector<std::string> words(argv + 1, argv + argc);
    std::uint64_t sequence = 0;
    if (words.size() > 1 && words[0] == "--sequence") {
      const auto number = to_u64(words[1]);
      if (!number || *number > 65535) {
        throw Error("--sequence needs a number from 0 to 65535");
      }
      sequence = *number;
      words.erase(words.begin(), words.begin() + 2);
    }
    wire_packet packet = packet_from_words(words);
    packet.sequence = static_cast<std::uint16_t>(sequence);
    std::printf("%s\n", hex(frame_bytes(packet)).c_str());
    return 0;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "command_frame: %s\n", error.what());
    return 1;
  }
}
