/* Sessions of recordings: what `fingertip calibrate --from` calibrates from. */
#pragma once

#include "libfingertip/error.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"
#include "tool/calibration/gain_session.hpp"

#include <functional>
#include <optional>
#include <string>

namespace fingertip::calibrating {

template <typename Session> struct Recorded {
  wire_info info; /* of the fingertip that was recorded */
  Session session;
};

/* The whole recording, judged; nothing where it holds no info packet. device: which fingertip of several, or empty.
 * make: the session of an info packet. look: called after each packet behind it, and whether it completed a placement
 * or a pull. Throws Error where the file cannot be read. */
template <typename Make, typename Look>
auto session_from(const std::string &path, const std::string &device, const Make &make, const Look &look) {
  RecordingReader reader(path, false, device);
  std::optional<Recorded<decltype(make(wire_info{}))>> recorded;
  while (auto item = reader.next()) {
    const wire_packet &packet = item->packet;
    if (item->kind != RecordingReader::Item::Kind::packet) {
      continue;
    }
    if (recorded) {
      look(recorded->session, packet, recorded->session.take(packet));
    } else if (packet.type == WIRE_INFO) {
      recorded = {packet.body.info, make(packet.body.info)};
    }
  }
  if (recorded) {
    recorded->session.judge(true);
  }
  return recorded;
}

/* Placements of a weight. on_placement gets the session after each, and its time since the first pressures. Throws Error where it holds
 * none. */
inline Recorded<GainSession> gain_session_from(const std::string &path, const std::string &device,
                                               const std::function<void(const GainSession &, double)> &on_placement) {
  std::optional<double> begun_s;
  auto recorded = session_from(
      path, device, [](const wire_info &info) { return GainSession(info); },
      [&](const GainSession &session, const wire_packet &packet, bool taken) {
        if (packet.type == WIRE_RAW && !begun_s) {
          begun_s = frame_of(packet).t_s;
        }
        if (taken) {
          on_placement(session, session.placements().back().t_s - *begun_s);
        }
      });
  if (!begun_s) {
    throw Error(printable(path) + ": has no pressures to calibrate from; record with a firmware that sends them (fingertip info: raw)");
  }
  return std::move(*recorded);
}

/* Throws Error with the judgement's reason. */
template <typename Judgement> void refuse_unless_good(const Judgement &judgement) {
  if (judgement.state != Judgement::State::good) {
    throw Error("not calibrated: " + judgement.text);
  }
}

} // namespace fingertip::calibrating
