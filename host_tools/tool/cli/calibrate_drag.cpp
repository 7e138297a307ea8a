#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"
#include "tool/calibration/pull_session.hpp"
#include "tool/cli/calibrate_device.hpp"
#include "tool/cli/ink.hpp"

#include <cstdio>

namespace fingertip {

namespace {

using calibrating::check_pad;
using calibrating::PullFinder;
using calibrating::PullJudgement;
using calibrating::PullSession;

void pull_live(CalibratedDevice &device, PullSession &work) {
  std::string printed;
  const auto print_advice = [&] {
    if (work.advice() != printed) {
      printed = work.advice();
      std::printf("%s\n", printed.c_str());
      std::fflush(stdout);
    }
  };
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == PullJudgement::State::more && work.take(packet)) {
      work.judge(false);
      std::printf("%s; %s\n", work.last_pull_text().c_str(), work.judgement().text.c_str());
    }
    print_advice();
  };
  print_advice();
  device.follow(WIRE_STREAM_CONTACT, WIRE_CONTACT, take,
                [&] { return work.judgement().state == PullJudgement::State::more; });
}

PullSession pull_session_from(const CalibrateOptions &options, wire_info &info) {
  RecordingReader reader(options.from, false, options.choice.device);
  std::optional<PullSession> work;
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
      weak = work->finder().refusal() == PullFinder::Refusal::weak ? work->weak_text() : weak;
    }
  }
  if (!work) {
    throw Error(printable(options.from) + ": holds no frames");
  }
  if (work->pulls().empty()) {
    throw Error(
        "not calibrated: " +
        (weak.empty() ? "no pull was found; leave the object alone for a second, then pull and hold for two" : weak));
  }
  work->judge(true);
  return std::move(*work);
}

void check_same_pad(const pad_profile &recorded, const pad_profile &stored, const std::string &recording) {
  if (stored.thickness_mm != recorded.thickness_mm || stored.overhang_mm != recorded.overhang_mm ||
      stored.from_touch != recorded.from_touch) {
    throw Error(printable(recording) + ": is of a pad of " + shortest(recorded.thickness_mm) +
                " mm, and this fingertip's profile has changed since; record again");
  }
}

void print_result(const PullSession &work, const pad_profile &before, const pad_profile &after, bool has_force_scale) {
  std::printf("%s, from %zu of %zu pulls\n", work.judgement().text.c_str(), work.judgement().kept, work.pulls().size());
  std::printf("tangential scale    %s sd %s before, %s sd %s now\n", number(before.tangential_scale, 3).c_str(),
              number(before.tangential_scale_sd, 3).c_str(), number(after.tangential_scale, 3).c_str(),
              number(after.tangential_scale_sd, 3).c_str());
  if (!has_force_scale) {
    std::printf("the force's scale is not calibrated, of which this is a multiple: once it is, do this again\n");
  }
  std::fflush(stdout);
}

} // namespace

int calibrate_drag(const CalibrateOptions &options) {
  std::optional<CalibratedDevice> device;
  std::optional<PullSession> work;
  wire_info info{};
  if (options.from.empty()) {
    device.emplace(options);
    info = device->info();
    check_pad(info, device->name());
    device->check_sensors();
    work.emplace(info, *options.force_N);
    pull_live(*device, *work);
  } else {
    work.emplace(pull_session_from(options, info));
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
  const pad_profile made = work->scaled(device ? device->info().pad : info.pad);
  print_result(*work, info.pad, made, info.stored & WIRE_STORED_CALIBRATION);
  if (!device) {
    return 0;
  }
  ask(options, "Write this into " + text_field(device->info().serial) + "?", "not written");
  device->write(made);
  std::printf("calibrated: it applies from now on\n");
  return 0;
}

} // namespace fingertip
