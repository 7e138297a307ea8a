#include "tool/calibration/gain_session.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"

extern "C" {
#include "config/defaults.h"
}

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::calibrating {

constexpr double Q10 = 1024.0;

static std::string percent(double share) { return fixed(100.0 * share, 1) + " %"; }

static double mean_zero_Pa(const Frame &frame) {
  double sum_Pa = 0.0, count = 0.0;
  for (std::size_t k = 0; k < frame.zero_Pa.size(); k++) {
    sum_Pa += frame.valid >> k & 1u ? frame.zero_Pa[k] : 0.0;
    count += frame.valid >> k & 1u ? 1.0 : 0.0;
  }
  return count > 0.0 ? sum_Pa / count : 0.0;
}

static std::uint16_t micrometres(double length_mm) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(1000.0 * length_mm, 0.0, 65535.0)));
}

static std::int16_t to_both_sides(double value, int greatest) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value, double(-greatest), double(greatest))));
}

Array array_of(const wire_info &info) {
  Array array;
  for (int k = 0; k < info.sensor_count; k++) {
    array.x_mm.push_back(static_cast<double>(info.x_mm[k]));
    array.y_mm.push_back(static_cast<double>(info.y_mm[k]));
  }
  array.pitch_mm = static_cast<double>(info.pitch_mm);
  if (!(array.pitch_mm > 0.0)) { /* a free layout: the distance of the nearest two */
    array.pitch_mm = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < array.sensors(); a++) {
      for (std::size_t b = 0; b < a; b++) {
        array.pitch_mm = std::min(array.pitch_mm, std::hypot(array.x_mm[a] - array.x_mm[b], array.y_mm[a] - array.y_mm[b]));
      }
    }
  }
  check_places(array);
  return array;
}

Frame frame_of(const wire_packet &packet) {
  const wire_raw &raw = packet.body.raw;
  Frame frame;
  frame.t_s = 1e-6 * static_cast<double>(packet.t_us);
  frame.valid = raw.valid & ~raw.saturated & ~raw.doubtful;
  for (int k = 0; k < raw.sensor_count; k++) {
    frame.pressure_Pa.push_back(raw.pressure_Pa_q10[k] / Q10);
    frame.zero_Pa.push_back(raw.baseline_Pa_q10[k] / Q10);
  }
  return frame;
}

void check_firmware(const wire_info &info, const std::string &what) {
  if (!(info.capabilities & WIRE_CAPABILITY_FIT)) {
    throw Error(what + ": its firmware (scene " + text_field(info.scene) +
                ") computes no locations, so there is nothing to calibrate; flash one of scene grasp");
  }
  if (!(info.capabilities & WIRE_CAPABILITY_RAW_STREAM)) {
    throw Error(what + ": its firmware (scene " + text_field(info.scene) +
                ") sends no pressures; flash one of scene grasp, calibrate, and go back if you like: the calibration stays");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < 1000.0 * FRAME_RATE_MIN_Hz) {
    throw Error(what + ": " + fixed(info.rate_mHz / 1000.0, 1) +
                " frames a second are too few to see a weight settle; fingertip set rate=max");
  }
}

GainSession::GainSession(const wire_info &info)
    : array_(array_of(info)), prior_{static_cast<double>(info.prior_sigma_mm), static_cast<double>(info.prior_width_mm)},
      has_profile_((info.stored & WIRE_STORED_PAD) != 0), finder_(array_.sensors()) {}

bool GainSession::take(const wire_packet &packet) {
  if (packet.type != WIRE_RAW || packet.body.raw.sensor_count != array_.sensors() || (packet.body.raw.flags & CONTACT_FLAG_HELD)) {
    return false;
  }
  const Frame frame = frame_of(packet);
  auto found = finder_.take(frame);
  if (found) {
    ambient_Pa_ = mean_zero_Pa(frame);
    placements_.push_back(std::move(*found));
  }
  return found.has_value();
}

void GainSession::take_back() {
  if (!placements_.empty()) {
    placements_.pop_back();
    judge(false);
  }
}

void GainSession::judge(bool last) {
  judgement_ = calibrating::judge(array_, placements_, last);
  wanted_ = next_place(array_, placements_, judgement_.solution);
}

std::string GainSession::advice() const {
  switch (finder_.state()) {
  case PlacementFinder::State::settling: return "hold on";
  case PlacementFinder::State::taken: return "taken: lift it";
  case PlacementFinder::State::refused: return "it did not rest: lift it, and let it rest by itself";
  case PlacementFinder::State::resting: break;
  }
  if (finder_.refusal() == PlacementFinder::Refusal::light) {
    return "too light: use a weight that makes at least " + fixed(LIGHT_Pa / 1000.0, 1) + " kPa, about 1 N";
  }
  std::string text = "set the weight down on its round foot";
  if (wanted_) {
    text += ", best near x " + fixed(wanted_->x_mm, 0) + " y " + fixed(wanted_->y_mm, 0) + " mm";
  }
  return text;
}

std::string GainSession::progress() const {
  std::string text = std::to_string(placements_.size()) + (placements_.size() == 1 ? " placement" : " placements");
  const Solution &solution = judgement_.solution;
  if (solution.solved) {
    const Fitted &last = solution.placements.back();
    text += ", the last at x " + fixed(last.x_mm, 1) + " y " + fixed(last.y_mm, 1) + " mm" + (last.kept ? "" : " (fits no other)") +
            "; gains known to " + percent(solution.worst_shape_sd()) + ", wanted " + percent(judgement_.wanted_sd);
  }
  return text;
}

calibration calibration_of(const Solution &solution, const std::optional<ForceScale> &scale, std::uint32_t date_s) {
  calibration made{};
  made.date_s = date_s;
  made.placements = static_cast<std::uint16_t>(solution.kept);
  made.force_scale = scale ? static_cast<float>(scale->scale) : DEFAULT_FORCE_SCALE;
  made.force_scale_sd = scale ? static_cast<float>(scale->sd) : DEFAULT_FORCE_SCALE_SD;
  const Shape found = shape_of(solution);
  made.sigma_um = micrometres(found.sigma_mm);
  made.sigma_sd_um = micrometres(found.sigma_sd_mm);
  made.dip_share_q16 = static_cast<std::uint16_t>(std::lround(std::min(65536.0 * found.dip_share, double(CALIBRATION_DIP_SHARE_MAX_Q16))));
  made.dip_sd_um = made.dip_share_q16 > 0 ? micrometres(found.dip_sd_mm) : std::uint16_t(0);
  for (std::size_t k = 0; k < solution.gain.size(); k++) {
    made.sensors[k] = {static_cast<float>(solution.gain[k]), static_cast<float>(solution.reading_sd[k]),
                       to_both_sides(1e3 * solution.dx_mm[k], CALIBRATION_OFF_MAX_um),
                       to_both_sides(1e3 * solution.dy_mm[k], CALIBRATION_OFF_MAX_um),
                       to_both_sides(32768.0 * solution.own_width[k], CALIBRATION_WIDER_MAX_Q15)};
  }
  return made;
}

calibration GainSession::made(std::optional<double> force_N, std::uint32_t date_s) const {
  const Solution &solution = judgement_.kept;
  std::optional<ForceScale> scale;
  if (force_N) {
    scale = force_scale(array_, placements_, solution, *force_N, shape());
    if (!scale || scale->scale < static_cast<double>(CALIBRATION_FORCE_SCALE_MIN) ||
        scale->scale > static_cast<double>(CALIBRATION_FORCE_SCALE_MAX)) {
      throw Error("the readings are not those of " + fixed(*force_N, 2) + " N: they make " +
                  fixed(scale ? *force_N / scale->scale : 0.0, 2) + " N; give the weight that was on the pad, or none");
    }
  }
  calibration made = calibration_of(solution, scale, date_s);
  made.ambient_kPa = static_cast<std::uint8_t>(std::lround(std::min(1e-3 * ambient_Pa_, 255.0)));
  if (!calibration_is_valid(&made, static_cast<unsigned>(solution.gain.size()))) {
    throw Error("a gain is out of range, which no sensor under rubber has: see that every sensor is covered alike");
  }
  return made;
}

Shape GainSession::shape() const {
  Shape shape = shape_of(judgement_.kept);
  if (has_profile_) {
    shape = without_width(std::move(shape));
  }
  if (prior_.sigma_sd_mm > 0.0) {
    shape.sigma_mm = prior_.sigma_mm;
    shape.sigma_sd_mm = prior_.sigma_sd_mm;
  }
  return shape;
}

Scatter GainSession::scatter(bool calibrated) const {
  const Solution &solution = judgement_.solution;
  return calibrated ? calibrating::scatter(array_, placements_, solution, judgement_.kept.gain, shape())
                    : calibrating::scatter(array_, placements_, solution, std::vector<double>(array_.sensors(), 1.0), prior_);
}

} // namespace fingertip::calibrating
