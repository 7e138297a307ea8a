#include "libfingertip/command.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/device.hpp"
#include "tool/cli/names_of_values.hpp"
#include "tool/cli/usage.hpp"

#include <cstdio>
#include <memory>
#include <optional>

namespace fingertip {

namespace {

struct SetOptions {
  Choice choice;
  std::vector<std::string> settings;
  bool keep = false, forget = false;
};

/* Commands for "rate=20" and the like; slip settings share one command. */
struct Settings {
  std::optional<std::uint32_t> rate_mHz, osr, slip_window_ms;
  std::optional<float> slip_threshold_mm, limit_mm;
  std::optional<Prior> prior;
};

Settings parse_settings(const std::vector<std::string> &texts) {
  Settings settings;
  for (const std::string &text : texts) {
    std::size_t equals = text.find('=');
    std::string key = text.substr(0, equals);
    std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    if (key == "rate") {
      settings.rate_mHz = rate_mHz_from_text(value);
    } else if (key == "osr") {
      settings.osr = osr_from_text(value);
    } else if (key == "slip_threshold") {
      settings.slip_threshold_mm = slip_threshold_mm_from_text(value);
    } else if (key == "slip_window") {
      settings.slip_window_ms = slip_window_ms_from_text(value);
    } else if (key == "prior") {
      settings.prior = prior_from_text(value);
    } else if (key == "limit") {
      settings.limit_mm = location_limit_mm_from_text(value);
    } else {
      throw Error("setting \"" + text +
                  "\" is unknown; give rate=HZ|max, osr=N, slip_threshold=MM, slip_window=MS, "
                  "prior=SIGMA[:WIDTH]|none or limit=MM");
    }
  }
  return settings;
}

int set(const SetOptions &options) {
  Settings settings = typed([&] { return parse_settings(options.settings); });
  if (options.settings.empty() && !options.keep && !options.forget) {
    throw WrongUsage("nothing to set; give settings, --keep or --forget; see fingertip set --help");
  }
  Device device(options.choice);
  Session &session = device.session;
  if (settings.rate_mHz) {
    session.command(command_rate_mHz(*settings.rate_mHz));
  }
  if (settings.osr) {
    session.command(command_osr(*settings.osr));
  }
  if (settings.slip_threshold_mm || settings.slip_window_ms) {
    wire_info now = session.info().body.info;
    session.command(command_slip(settings.slip_threshold_mm.value_or(now.slip_threshold_mm),
                                 settings.slip_window_ms.value_or(now.slip_window_ms)));
  }
  if (settings.prior) {
    session.command(command_prior(settings.prior->sigma_mm, settings.prior->width_mm));
  }
  if (settings.limit_mm) {
    session.command(command_location_limit(*settings.limit_mm));
  }
  if (options.keep || options.forget) {
    session.command(command_keep(options.keep));
  }
  wire_info info = session.info().body.info;
  std::printf("rate=%s osr=%u", rate_text(info.rate_mHz).c_str(), info.osr);
  if (info.capabilities & WIRE_CAPABILITY_SLIP) {
    std::printf(" slip_threshold=%s slip_window=%u", shortest(info.slip_threshold_mm).c_str(),
                info.slip_window_ms);
  }
  if (info.capabilities & WIRE_CAPABILITY_FIT) {
    std::printf(" prior=%s limit=%s",
                prior_text({info.prior_sigma_mm, info.prior_width_mm}).c_str(),
                shortest(info.location_limit_mm).c_str());
  }
  std::printf("%s\n", info.stored & WIRE_STORED_SETTINGS ? " kept" : "");
  return 0;
}

} // namespace

void add_set(CommandLine &line) {
  auto options = std::make_shared<SetOptions>();
  CLI::App *command =
      line.add("set", "Change settings until the next power-on, or for good with --keep",
               [options] { return set(*options); });
  with_port(command, options->choice);
  command
      ->add_option("settings", options->settings,
                   "rate=HZ|max (0.1 to 2000), osr=256|512|1024|2048|4096|8192, slip_threshold=MM "
                   "(0.01 to 50), slip_window=MS (5 to 1000, and 160 frames at most), "
                   "prior=SIGMA[:WIDTH]|none (mm, 0.5 to 100, 0.01 to 100; width 0.5), limit=MM "
                   "(of location_sd_mm, 0.01 to 100)")
      ->type_name("KEY=VALUE");
  CLI::Option *keep =
      command->add_flag("--keep", options->keep,
                        "Keep all present settings: the fingertip starts with them from now on");
  command
      ->add_flag("--forget", options->forget,
                 "Keep none: from its next start on it has the firmware's own")
      ->excludes(keep);
}

} // namespace fingertip
