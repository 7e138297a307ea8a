#include "cli/calibrate_drag.hpp"

#include "calibration/pulls.hpp"
#include "cli/calibrate_device.hpp"
#include "cli/doubt.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/text.hpp"

#include <cmath>
#include <cstdio>

namespace fingertip {

namespace {

using calibrating::Pull;
using calibrating::PullFinder;
using calibrating::PullJudgement;

/* Warnings that say nothing against a load: its standard deviation has what they are about. */
constexpr std::uint32_t HARMLESS =
    CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_SENSOR_MASKED;

void check_pad(const wire_info &info, const std::string &what) {
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    throw Error(what + ": its firmware (scene " + text_field(info.scene) +
                ") tells no tangential load; flash one of scene grasp");
  }
  if (!(info.stored & WIRE_STORED_PAD)) {
    throw Error(what + ": no pad profile; fingertip pad --thickness MM first");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < 1000.0 * calibrating::PULL_RATE_MIN_Hz) {
    throw Error(what + ": " + fixed(info.rate_mHz / 1000.0, 1) +
                " frames a second are too few to see a pull hold still; fingertip set rate=max");
  }
}

/* Without its scale's own uncertainty, which is what is sought. */
double sd_without_scale_N(const wire_contact &contact, const pad_profile &pad) {
  const double size_N =
      std::hypot(static_cast<double>(contact.qx_N), static_cast<double>(contact.qy_N));
  const double of_scale_N =
      size_N * static_cast<double>(pad.tangential_scale_sd / pad.tangential_scale);
  const auto sd_N = static_cast<double>(contact.q_sd_N);
  return std::sqrt(std::max(0.0, sd_N * sd_N - of_scale_N * of_scale_N));
}

class PullWork {
public:
  PullWork(const wire_info &info, double known_N)
      : pad_(info.pad), known_N_(known_N), finder_(known_N) {
    judge(false);
  }

  /* True if it completed a pull. */
  bool take(const wire_packet &packet) {
    const wire_contact &contact = packet.body.contact;
    if (packet.type != WIRE_CONTACT || (contact.flags & CONTACT_FLAG_HELD)) {
      return false;
    }
    calibrating::PullFrame frame;
    frame.t_s = 1e-6 * static_cast<double>(packet.t_us);
    frame.contact = contact.flags & CONTACT_FLAG_CONTACT;
    frame.good = (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) &&
                 !(contact.flags & (CONTACT_FLAG_MOVING | CONTACT_FLAG_SLIDING)) &&
                 !(warnings_of(contact.flags) & ~HARMLESS);
    frame.qx_N = static_cast<double>(contact.qx_N);
    frame.qy_N = static_cast<double>(contact.qy_N);
    frame.q_sd_N = frame.good ? sd_without_scale_N(contact, pad_) : 0.0;
    frame.force_N = static_cast<double>(contact.force_N);
    frame.x_mm = static_cast<double>(contact.x_mm);
    frame.y_mm = static_cast<double>(contact.y_mm);
    const auto found = finder_.take(frame);
    if (found) {
      pulls_.push_back(*found);
    }
    return found.has_value();
  }
  void judge(bool last) { judgement_ = calibrating::judge_pulls(pulls_, known_N_, last); }

  std::string last_pull_text() const {
    const Pull &pull = pulls_.back();
    const double degrees = std::atan2(pull.qy_N, pull.qx_N) * 180.0 / M_PI;
    return "pull " + std::to_string(pulls_.size()) + " at x " + fixed(pull.x_mm, 1) + " y " +
           fixed(pull.y_mm, 1) + " mm: reads " + fixed(std::hypot(pull.qx_N, pull.qy_N), 2) +
           " N towards " + fixed(degrees, 0) + " degrees, under " + fixed(pull.force_N, 2) + " N";
  }
  std::string advice() const {
    switch (finder_.state()) {
    case PullFinder::State::settling:
      return "let go of it, and leave it alone";
    case PullFinder::State::resting:
      return "pull: hang the weight on its string";
    case PullFinder::State::pulled:
      return "hold on";
    case PullFinder::State::taken:
      return "taken: take it off the pad";
    case PullFinder::State::refused:
      return finder_.refusal() == PullFinder::Refusal::slid ? "it slid: take it off, and press it "
                                                              "down harder"
                                                            : weak_text() + "; take it off";
    case PullFinder::State::free:
      break;
    }
    return "set the object down, its string slack";
  }
  std::string weak_text() const {
    return fixed(known_N_, 2) + " N is little beside what the fingertip may be off by there, " +
           fixed(finder_.sd_N(), 2) + " N: pull harder, or calibrate the gains first";
  }

  PullFinder::Refusal refusal() const { return finder_.refusal(); }
  const PullJudgement &judgement() const { return judgement_; }
  const std::vector<Pull> &pulls() const { return pulls_; }

private:
  pad_profile pad_;
  double known_N_;
  PullFinder finder_;
  std::vector<Pull> pulls_;
  PullJudgement judgement_;
};

void pull_live(CalibratedDevice &device, PullWork &work) {
  std::string said;
  const auto say = [&] {
    if (work.advice() != said) {
      said = work.advice();
      std::printf("%s\n", said.c_str());
      std::fflush(stdout);
    }
  };
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == PullJudgement::State::more && work.take(packet)) {
      work.judge(false);
      std::printf("%s; %s\n", work.last_pull_text().c_str(), work.judgement().text.c_str());
    }
    say();
  };
  say();
  device.follow(WIRE_STREAM_CONTACT, WIRE_CONTACT, take,
                [&] { return work.judgement().state == PullJudgement::State::more; });
}

PullWork pull_work_from(const CalibrateOptions &options, wire_info &info) {
  RecordingReader reader(options.from, false, options.choice.device);
  std::optional<PullWork> work;
  std::string weak;
  while (auto item = reader.next()) {
    if (item->kind != RecordingReader::Item::Kind::packet) {
      continue;
    }
    if (item->packet.type == WIRE_INFO && !work) {
      info = item->packet.body.info;
      check_pad(info, printable(options.from));
      work.emplace(info, *options.force_N);
    } else if (work) {
      if (work->take(item->packet)) {
        std::printf("%s\n", work->last_pull_text().c_str());
      }
      weak = work->refusal() == PullFinder::Refusal::weak ? work->weak_text() : weak;
    }
  }
  if (!work) {
    throw Error(printable(options.from) + ": holds no frames");
  }
  if (work->pulls().empty()) {
    throw Error("not calibrated: " + (weak.empty()
                                          ? "no pull was found; leave the object alone for "
                                            "a second, then pull and hold for two"
                                          : weak));
  }
  work->judge(true);
  return std::move(*work);
}

void check_same_pad(const pad_profile &recorded, const pad_profile &stored,
                    const std::string &recording) {
  if (stored.thickness_mm != recorded.thickness_mm || stored.overhang_mm != recorded.overhang_mm ||
      stored.from_touch != recorded.from_touch) {
    throw Error(printable(recording) + ": is of a pad of " + shortest(recorded.thickness_mm) +
                " mm, and this fingertip has been told of another since; record anew");
  }
}

/* pad with the scale with which the known force would have been read as what it was. */
pad_profile scaled(pad_profile pad, float present_scale, const PullJudgement &judgement,
                   double known_N) {
  const double scale = static_cast<double>(present_scale) / judgement.reading;
  pad.tangential_scale = static_cast<float>(scale);
  pad.tangential_scale_sd = static_cast<float>(scale * judgement.reading_sd);
  if (!pad_profile_is_valid(&pad)) {
    throw Error("the readings are not those of " + fixed(known_N, 2) + " N: they make " +
                fixed(known_N * judgement.reading, 2) + " N; give what pulled");
  }
  return pad;
}

void print_result(const PullWork &work, const pad_profile &before, const pad_profile &after,
                  bool has_force_scale) {
  std::printf("%s, from %zu of %zu pulls\n", work.judgement().text.c_str(), work.judgement().kept,
              work.pulls().size());
  std::printf("tangential scale    %s sd %s before, %s sd %s now\n",
              fixed(static_cast<double>(before.tangential_scale), 3).c_str(),
              fixed(static_cast<double>(before.tangential_scale_sd), 3).c_str(),
              fixed(static_cast<double>(after.tangential_scale), 3).c_str(),
              fixed(static_cast<double>(after.tangential_scale_sd), 3).c_str());
  if (!has_force_scale) {
    std::printf("the force's scale is not calibrated, of which this is a multiple: once it is, do "
                "this again\n");
  }
  std::fflush(stdout);
}

} // namespace

int calibrate_drag(const CalibrateOptions &options) {
  std::optional<CalibratedDevice> device;
  std::optional<PullWork> work;
  wire_info info{};
  if (options.from.empty()) {
    device.emplace(options);
    info = device->info();
    check_pad(info, device->name());
    device->check_sensors();
    work.emplace(info, *options.force_N);
    pull_live(*device, *work);
  } else {
    work.emplace(pull_work_from(options, info));
  }
  if (work->judgement().state != PullJudgement::State::good) {
    throw Error("not calibrated: " + work->judgement().text);
  }
  if (!options.from.empty() && !options.dry_run) {
    device.emplace(options);
    device->check_is(info, options.from);
    check_pad(device->info(), device->name());
    check_same_pad(info.pad, device->info().pad, options.from);
  }
  const pad_profile made = scaled(device ? device->info().pad : info.pad, info.pad.tangential_scale,
                                  work->judgement(), *options.force_N);
  print_result(*work, info.pad, made, info.stored & WIRE_STORED_CALIBRATION);
  if (!device) {
    return 0;
  }
  ask(options, "Write this into " + text_field(device->info().serial) + "?", "not written");
  device->write(made);
  std::printf("calibrated: it acts from now on\n");
  return 0;
}

} // namespace fingertip
