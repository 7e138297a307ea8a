#include "libfingertip/command.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/table_file.hpp"
#include "library/pad/thickness.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/device.hpp"
#include "tool/cli/ink.hpp"

#include <cstdio>
#include <memory>
#include <optional>

namespace fingertip {

namespace {

struct PadOptions {
  Choice choice;
  std::optional<double> thickness_mm;
  double overhang_mm = 0;
  bool from_touch = false, erase = false;
};

int erase_pad(Session &session) {
  session.command(command_erase_pad());
  std::printf("pad erased; no tangential force from now on\n");
  return 0;
}

// The thickness that the user sets, or that the fingertip's calibration found.
double thickness_mm(const PadOptions &options, const wire_info &info) {
  const bool calibrated = (info.stored & WIRE_STORED_CALIBRATION) != 0;
  const auto found = calibrated ? pad::thickness_of(info.calibration) : std::nullopt;
  if (options.thickness_mm) {
    const std::string other = found ? pad::disagreement(*found, *options.thickness_mm) : "";
    if (!other.empty()) {
      std::fprintf(stderr, "fingertip: %s\n", other.c_str());
    }
    return *options.thickness_mm;
  }
  if (!found) {
    throw WrongUsage("give --thickness MM of the pad's rubber, or calibrate first: that finds it");
  }
  if (!pad::profile_suits(*found)) {
    throw Error("the calibration's width is that of " + text_of(*found) +
                " of rubber; the tangential force is accurate enough on 9 to 20 mm");
  }
  std::printf("thickness found in the calibration: %s\n", text_of(*found).c_str());
  return found->shown_mm();
}

int pad_command(const PadOptions &options) {
  Device device(options.choice);
  Session &session = device.session;
  wire_info info = session.info().body.info;
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    throw Error("its firmware, of scene " + text_field(info.scene) +
                ", reports no tangential force; install one of scene grasp");
  }
  if (options.erase) {
    return erase_pad(session);
  }
  if (options.thickness_mm && *options.thickness_mm < pad::THINNEST_mm) {
    throw WrongUsage(
        "on less than 9 mm of rubber the tangential force is not accurate enough; --thickness goes from 9 to 20 mm");
  }
  const pad::Shape shape{thickness_mm(options, info), options.overhang_mm, options.from_touch};
  pad_profile profile = typed([&] { return pad::profile_of(shape, info); });
  const bool ends = shape.overhang_mm >= pad::EDGE_OVERHANG_MIN_mm && shape.overhang_mm <= pad::EDGE_OVERHANG_MAX_mm;
  if (ends) {
    ProgressBar bar("the pad's ends", ProgressBar::Lines::none);
    profile.edges = typed([&] {
      return pad::edges_of(profile, info, twin::default_cache_directory(), [&](double share) { bar.show(share); });
    });
  }
  session.command(command_pad(profile));
  std::printf("thickness=%s overhang=%s%s%s force_ratio=%s kept\n", shortest(profile.thickness_mm).c_str(),
              profile.overhang_mm > 0 ? shortest(profile.overhang_mm).c_str() : "?", ends ? " ends" : "",
              profile.from_touch ? " from_touch" : "", number(profile.force_ratio, 3).c_str());
  if (shape.overhang_mm == 0) {
    std::fprintf(stderr, "fingertip: a pad without end, as there is no --overhang: where the rubber ends, location and "
                         "tangential force are off\n");
  }
  if (pad::edges_spoil_the_zero(shape) && !options.from_touch) {
    std::fprintf(stderr,
                 "fingertip: the rubber ends %s mm beyond the outer sensors, less than half its thickness, which "
                 "spoils the zero of the tangential force; --from-touch reports the change instead\n",
                 shortest(profile.overhang_mm).c_str());
  }
  return 0;
}

} // namespace

void add_pad(CommandLine &line) {
  auto options = std::make_shared<PadOptions>();
  CLI::App *command =
      line.add("pad", "Set the pad's profile, for the tangential force (the fingertip keeps it without power)",
               [options] { return pad_command(*options); });
  with_port(command, options->choice);
  CLI::Option *thickness =
      command
          ->add_option("--thickness", options->thickness_mm,
                       "Thickness of the rubber above the sensors, 9 to 20 mm. Default: as the calibration found it")
          ->type_name("MM");
  CLI::Option *overhang =
      command
          ->add_option("--overhang", options->overhang_mm,
                       "How far the rubber extends beyond the outer sensors, up to 100 mm; from 3 to 20 mm the effect "
                       "of the ends is computed and subtracted. Default: a pad without end")
          ->type_name("MM");
  CLI::Option *from_touch = command->add_flag("--from-touch", options->from_touch,
                                              "Report the change since the first 100 ms of each contact: for pads "
                                              "whose rubber ends within half its thickness of the outer sensors");
  command->add_flag("--erase", options->erase, "Erase the pad's profile: no tangential force")
      ->excludes(thickness)
      ->excludes(overhang)
      ->excludes(from_touch);
}

} // namespace fingertip
