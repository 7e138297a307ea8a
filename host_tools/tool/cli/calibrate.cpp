#include "tool/cli/calibrate.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/thickness.hpp"
#include "tool/calibration/from_recording.hpp"
#include "tool/cli/calibrate_device.hpp"
#include "tool/cli/calibrate_view.hpp"
#include "tool/cli/ink.hpp"
#include "tool/cli/names_of_values.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>

namespace fingertip {

namespace {

using calibrating::GainSession;
using calibrating::Judgement;
using calibrating::Placement;

void print_result(const GainSession &work, const calibration &made, std::optional<double> force_N) {
  const Judgement &judgement = work.judgement();
  const calibrating::Scatter before = work.scatter(false), after = work.scatter(true);
  std::printf("%s, from %zu of %zu placements\n", judgement.text.c_str(), judgement.solution.kept,
              work.placements().size());
  print_gains(made, static_cast<std::uint8_t>(work.array().sensors()));
  std::printf("\nof the placements      before     after\n");
  std::printf("location off by     %6.2f mm %6.2f mm   median\n", before.location_mm, after.location_mm);
  std::printf("force differs by    %6.1f %%  %6.1f %%    median\n", 100.0 * before.force, 100.0 * after.force);
  if (force_N) {
    std::printf("force scale         %9s %9s    sd %s\n", "1.000", number(made.force_scale, 3).c_str(),
                number(made.force_scale_sd, 3).c_str());
  } else {
    std::printf("force scale         unknown: give the weight, to calibrate forces too\n");
  }
  std::printf("%s\n", shape_text(made).c_str());
  if (const auto found = pad::thickness_of(made)) {
    std::printf("rubber %s\n", text_of(*found).c_str());
  }
  std::fflush(stdout);
}

void work_live(CalibratedDevice &device, GainSession &work, ColourMode colour) {
  std::unique_ptr<CalibrateView> view = make_calibrate_view(colour);
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == Judgement::State::more && work.take(packet)) {
      work.judge(false);
      view->update(work, true);
    }
  };
  device.follow(WIRE_STREAM_RAW, WIRE_RAW, take, [&] {
    view->update(work, false);
    while (auto key = view->key()) {
      if (*key == 'q') {
        throw Interrupted();
      } else if (*key == 'u') {
        work.take_back();
      }
    }
    return work.judgement().state == Judgement::State::more;
  });
}

void show_placement(const GainSession &session) {
  const Placement &found = session.placements().back();
  std::printf("placement %zu, %.1f s: strongest reading %.1f kPa\n", session.placements().size(), found.t_s,
              1e-3 * *std::max_element(found.reading_Pa.begin(), found.reading_Pa.end()));
}

int show(const CalibrateOptions &options) {
  CalibratedDevice device(options);
  const wire_info &info = device.info();
  if (!(info.stored & WIRE_STORED_CALIBRATION)) {
    std::printf("not calibrated%s\n", info.stored & WIRE_STORED_DAMAGED ? "; what was stored cannot be read" : "");
    return 0;
  }
  std::printf("calibrated %s from %u placements, force scale %s sd %s\n", date_text(info.calibration.date_s).c_str(),
              info.calibration.placements, number(info.calibration.force_scale, 3).c_str(),
              number(info.calibration.force_scale_sd, 3).c_str());
  std::printf("%s\n", shape_text(info.calibration).c_str());
  print_gains(info.calibration, info.sensor_count);
  return 0;
}

int erase(const CalibrateOptions &options) {
  CalibratedDevice device(options);
  if (!(device.info().stored & (WIRE_STORED_CALIBRATION | WIRE_STORED_DAMAGED))) {
    std::printf("not calibrated\n");
    return 0;
  }
  ask(options, "Forget the calibration of " + text_field(device.info().serial) + "?", "not erased");
  device.erase();
  std::printf("erased: it is as if never calibrated\n");
  return 0;
}

/* A fingertip that estimates tangential force needs the thickness. If the user has set one, this
 * reports whether it is the one found. Otherwise the pad's profile follows from the one found. */
void use_thickness(CalibratedDevice &device, const calibration &made,
                   const std::optional<pad::Thickness> &for_profile) {
  const wire_info &info = device.info();
  const auto found = pad::thickness_of(made);
  if (for_profile) {
    device.write(pad::profile_of({for_profile->shown_mm()}, info));
    std::printf("profile of a pad without end of %s mm: fingertip pad --overhang MM where the rubber ends\n",
                fixed(for_profile->mm, 1).c_str());
  } else if ((info.capabilities & WIRE_CAPABILITY_TANGENTIAL) && (info.stored & WIRE_STORED_PAD) && found) {
    const std::string other = pad::disagreement(*found, static_cast<double>(info.pad.thickness_mm));
    if (!other.empty()) {
      std::fprintf(stderr, "fingertip: %s; fingertip pad takes the one that was found\n", other.c_str());
    }
  }
}

int calibrate(const CalibrateOptions &options) {
  std::optional<CalibratedDevice> device;
  std::optional<GainSession> work;
  wire_info info{};
  if (options.from.empty()) {
    device.emplace(options);
    calibrating::check_firmware(device->info(), device->name());
    device->check_sensors();
    work.emplace(device->info());
    work_live(*device, *work, options.colour);
    info = device->info();
  } else {
    calibrating::Recorded recorded = calibrating::session_from(options.from, options.choice.device, show_placement);
    work.emplace(std::move(recorded.session));
    info = recorded.info;
    calibrating::refuse_unless_good(work->judgement());
    if (!options.dry_run) {
      device.emplace(options);
      device->check_is(info, options.from);
      info = device->info();
    }
  }
  calibrating::refuse_unless_good(work->judgement());
  const std::time_t now_s = std::chrono::system_clock::to_time_t(wall_now());
  const auto date_s = static_cast<std::uint32_t>(now_s);
  calibration made = work->made(options.force_N, date_s);
  const auto for_profile = pad::thickness_for_profile(info, made);
  if (for_profile || (info.stored & WIRE_STORED_PAD)) {
    work->expect_profile();
    made = work->made(options.force_N, date_s);
  }
  print_result(*work, made, options.force_N);
  if (!device) {
    return 0;
  }
  ask(options, "Write this into " + text_field(device->info().serial) + "?", "not written");
  device->write(made);
  use_thickness(*device, made, for_profile);
  std::printf("calibrated: it applies from now on\n");
  return 0;
}

} // namespace

int run_calibrate(const CalibrateOptions &options) {
  try {
    return options.show    ? show(options)
           : options.erase ? erase(options)
           : options.drag  ? calibrate_drag(options)
                           : calibrate(options);
  } catch (const Interrupted &) {
    throw Error("interrupted; the fingertip is as it was");
  }
}

} // namespace fingertip
