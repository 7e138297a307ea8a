#include "tool/calibration/from_recording.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"

namespace fingertip::calibrating {

Recorded session_from(const std::string &path, const std::string &device,
                      const std::function<void(const GainSession &)> &on_placement) {
  RecordingReader reader(path, false, device);
  std::optional<Recorded> recorded;
  bool pressures = false;
  while (auto item = reader.next()) {
    if (item->kind != RecordingReader::Item::Kind::packet) {
      continue;
    }
    if (item->packet.type == WIRE_INFO && !recorded) {
      recorded.emplace(Recorded{item->packet.body.info, GainSession(item->packet.body.info)});
    } else if (recorded) {
      pressures = pressures || item->packet.type == WIRE_RAW;
      if (recorded->session.take(item->packet) && on_placement) {
        on_placement(recorded->session);
      }
    }
  }
  if (!recorded || !pressures) {
    throw Error(printable(path) +
                ": has no pressures to calibrate from; record with a firmware that sends them (fingertip info: raw)");
  }
  recorded->session.judge(true);
  return std::move(*recorded);
}

void refuse_unless_good(const Judgement &judgement) {
  if (judgement.state != Judgement::State::good) {
    throw Error("not calibrated: " + judgement.text);
  }
}

} // namespace fingertip::calibrating
