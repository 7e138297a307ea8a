#include "cli/calibrate.hpp"

#include "cli/calibrate_device.hpp"
#include "cli/calibrate_drag.hpp"
#include "cli/calibrate_view.hpp"
#include "cli/gains.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/text.hpp"

extern "C" {
#include "config/defaults.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

namespace fingertip {

namespace {

using calibrating::Array;
using calibrating::Judgement;
using calibrating::Placement;

constexpr double Q10 = 1024.0;

Array array_of(const wire_info &info) {
  Array array;
  for (int k = 0; k < info.sensor_count; k++) {
    array.x_mm.push_back(static_cast<double>(info.x_mm[k]));
    array.y_mm.push_back(static_cast<double>(info.y_mm[k]));
  }
  array.pitch_mm = static_cast<double>(info.pitch_mm);
  if (array.pitch_mm > 0.0) {
    return array;
  }
  /* A free layout: the distance of the nearest two. */
  array.pitch_mm = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < array.sensors(); a++) {
    for (std::size_t b = 0; b < a; b++) {
      array.pitch_mm = std::min(
          array.pitch_mm, std::hypot(array.x_mm[a] - array.x_mm[b], array.y_mm[a] - array.y_mm[b]));
    }
  }
  return array;
}

calibrating::Frame frame_of(const wire_packet &packet) {
  const wire_raw &raw = packet.body.raw;
  calibrating::Frame frame;
  frame.t_s = 1e-6 * static_cast<double>(packet.t_us);
  frame.valid = raw.valid & ~raw.saturated & ~raw.doubtful;
  for (int k = 0; k < raw.sensor_count; k++) {
    frame.pressure_Pa.push_back(raw.pressure_Pa_q10[k] / Q10);
    frame.zero_Pa.push_back(raw.baseline_Pa_q10[k] / Q10);
  }
  return frame;
}

/* What a fingertip must be able to do. Throws Error. */
void check_firmware(const wire_info &info, const std::string &what) {
  if (!(info.capabilities & WIRE_CAPABILITY_FIT)) {
    throw Error(
        what + ": its firmware (scene " + text_field(info.scene) +
        ") computes no locations, so there is nothing to calibrate; flash one of scene slip");
  }
  if (!(info.capabilities & WIRE_CAPABILITY_RAW_STREAM)) {
    throw Error(
        what + ": its firmware (scene " + text_field(info.scene) +
        ") sends no pressures; flash one of scene slip, calibrate, and go back if you like: "
        "the calibration stays");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < 1000.0 * calibrating::FRAME_RATE_MIN_Hz) {
    throw Error(what + ": " + fixed(info.rate_mHz / 1000.0, 1) +
                " frames a second are too few to see a weight settle; fingertip set rate=max");
  }
}

/* A placement after the other, and what they make. */
class Work {
public:
  explicit Work(const wire_info &info)
      : array_(array_of(info)), prior_{static_cast<double>(info.prior_sigma_mm),
                                       static_cast<double>(info.prior_width_mm)},
        finder_(array_.sensors()) {}

  /* True if it completed a placement. */
  bool take(const wire_packet &packet) {
    if (packet.type != WIRE_RAW || packet.body.raw.sensor_count != array_.sensors()) {
      return false;
    }
    frames_++;
    if (packet.body.raw.flags & CONTACT_FLAG_HELD) {
      return false;
    }
    auto found = finder_.take(frame_of(packet));
    if (found) {
      placements_.push_back(std::move(*found));
    }
    return found.has_value();
  }
  void take_back() {
    if (!placements_.empty()) {
      placements_.pop_back();
      judge(false);
    }
  }
  void judge(bool last) {
    judgement_ = calibrating::judge(array_, placements_, last);
    wanted_ = calibrating::next_place(array_, placements_, judgement_.solution);
  }

  CalibrateStatus status() const {
    return {&array_, placements_.size(), &finder_, placements_.empty() ? nullptr : &judgement_,
            wanted_};
  }
  const Array &array() const { return array_; }
  const calibrating::Prior &prior() const { return prior_; }
  const Judgement &judgement() const { return judgement_; }
  const std::vector<Placement> &placements() const { return placements_; }
  std::uint64_t frames() const { return frames_; }

private:
  Array array_;
  calibrating::Prior prior_;
  calibrating::PlacementFinder finder_;
  std::vector<Placement> placements_;
  Judgement judgement_;
  std::optional<calibrating::Wanted> wanted_;
  std::uint64_t frames_ = 0;
};

calibration made_of(const Work &work, std::optional<double> force_N) {
  const calibrating::Solution &solution = work.judgement().solution;
  calibration made{};
  made.date_s = static_cast<std::uint32_t>(std::time(nullptr));
  made.placements = static_cast<std::uint16_t>(solution.kept);
  made.force_scale = DEFAULT_FORCE_SCALE;
  made.force_scale_sd = DEFAULT_FORCE_SCALE_SD;
  if (force_N) {
    const auto scale =
        calibrating::force_scale(work.array(), work.placements(), solution, *force_N, work.prior());
    if (!scale || scale->scale < static_cast<double>(CALIBRATION_FORCE_SCALE_MIN) ||
        scale->scale > static_cast<double>(CALIBRATION_FORCE_SCALE_MAX)) {
      throw Error("the readings are not those of " + fixed(*force_N, 2) + " N: they make " +
                  fixed(scale ? *force_N / scale->scale : 0.0, 2) +
                  " N; give the weight that stood on the pad, or none");
    }
    made.force_scale = static_cast<float>(scale->scale);
    made.force_scale_sd = static_cast<float>(scale->sd);
  }
  for (std::size_t k = 0; k < solution.gain.size(); k++) {
    made.sensors[k] = {static_cast<float>(solution.gain[k]),
                       static_cast<float>(solution.gain_sd[k])};
  }
  if (!calibration_is_valid(&made, static_cast<unsigned>(solution.gain.size()))) {
    throw Error("a gain is out of range, which no sensor under rubber has: see that every sensor "
                "is covered alike");
  }
  return made;
}

void print_result(const Work &work, const calibration &made, std::optional<double> force_N) {
  const Judgement &judgement = work.judgement();
  const auto scatter = [&](bool with_gains) {
    return calibrating::scatter(work.array(), work.placements(), judgement.solution, with_gains,
                                work.prior());
  };
  const calibrating::Scatter before = scatter(false), after = scatter(true);
  std::printf("%s, from %zu of %zu placements\n", judgement.text.c_str(), judgement.solution.kept,
              work.placements().size());
  print_gains(made, static_cast<std::uint8_t>(work.array().sensors()));
  std::printf("\nof the placements      before     after\n");
  std::printf("location off by     %6.2f mm %6.2f mm   median\n", before.location_mm,
              after.location_mm);
  std::printf("force differs by    %6.1f %%  %6.1f %%    median\n", 100.0 * before.force,
              100.0 * after.force);
  if (force_N) {
    std::printf("force scale         %9s %9s    sd %s\n", "1.000",
                fixed(static_cast<double>(made.force_scale), 3).c_str(),
                fixed(static_cast<double>(made.force_scale_sd), 3).c_str());
  } else {
    std::printf("force scale         unknown: give the weight, to calibrate forces too\n");
  }
  std::fflush(stdout);
}

void work_live(CalibratedDevice &device, Work &work, ColourMode colour) {
  std::unique_ptr<CalibrateView> view = make_calibrate_view(colour);
  bool news = false;
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == Judgement::State::more && work.take(packet)) {
      work.judge(false);
      news = true;
    }
    if (news) {
      view->update(work.status(), true);
      news = false;
    }
  };
  device.follow(WIRE_STREAM_RAW, WIRE_RAW, take, [&] {
    view->update(work.status(), false);
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

/* Of the fingertip that the recording is of. */
Work work_from(const CalibrateOptions &options, wire_info &info) {
  RecordingReader reader(options.from, false, options.choice.device);
  std::optional<Work> work;
  bool pressures = false;
  while (auto item = reader.next()) {
    if (item->kind != RecordingReader::Item::Kind::packet) {
      continue;
    }
    if (item->packet.type == WIRE_INFO && !work) {
      info = item->packet.body.info;
      work.emplace(info);
    } else if (work) {
      pressures = pressures || item->packet.type == WIRE_RAW;
      if (work->take(item->packet)) {
        const Placement &found = work->placements().back();
        std::printf("placement %zu, %.1f s: strongest reading %.1f kPa\n",
                    work->placements().size(), found.t_s,
                    1e-3 * *std::max_element(found.reading_Pa.begin(), found.reading_Pa.end()));
      }
    }
  }
  if (!work || !pressures) {
    throw Error(printable(options.from) + ": has no pressures to calibrate from; record with a "
                                          "firmware that sends them (fingertip info: raw)");
  }
  work->judge(true);
  return std::move(*work);
}

void refuse_unless_good(const Judgement &judgement) {
  if (judgement.state != Judgement::State::good) {
    throw Error("not calibrated: " + judgement.text);
  }
}

int show(const CalibrateOptions &options) {
  CalibratedDevice device(options);
  const wire_info &info = device.info();
  if (!(info.stored & WIRE_STORED_CALIBRATION)) {
    std::printf("not calibrated%s\n",
                info.stored & WIRE_STORED_DAMAGED ? "; what was stored cannot be read" : "");
    return 0;
  }
  std::printf("calibrated %s from %u placements, force scale %s sd %s\n",
              date_text(info.calibration.date_s).c_str(), info.calibration.placements,
              fixed(static_cast<double>(info.calibration.force_scale), 3).c_str(),
              fixed(static_cast<double>(info.calibration.force_scale_sd), 3).c_str());
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

int calibrate(const CalibrateOptions &options) {
  std::optional<CalibratedDevice> device;
  std::optional<Work> work;
  if (options.from.empty()) {
    device.emplace(options);
    check_firmware(device->info(), device->name());
    device->check_sensors();
    work.emplace(device->info());
    work_live(*device, *work, options.colour);
  } else {
    wire_info info{};
    work.emplace(work_from(options, info));
    refuse_unless_good(work->judgement());
    if (!options.dry_run) {
      device.emplace(options);
      device->check_is(info, options.from);
    }
  }
  refuse_unless_good(work->judgement());
  const calibration made = made_of(*work, options.force_N);
  print_result(*work, made, options.force_N);
  if (!device) {
    return 0;
  }
  ask(options, "Write this into " + text_field(device->info().serial) + "?", "not written");
  device->write(made);
  std::printf("calibrated: it acts from now on\n");
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
