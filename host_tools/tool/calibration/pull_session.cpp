#include "tool/calibration/pull_session.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::calibrating {
namespace {

/* Warnings that do not concern a tangential force: its standard deviation includes their causes. */
constexpr std::uint32_t HARMLESS = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_SENSOR_MASKED;

/* Without its scale's own uncertainty, which is what is sought. */
double sd_without_scale_N(const wire_contact &contact, const pad_profile &pad) {
  const double size_N = std::hypot(static_cast<double>(contact.qx_N), static_cast<double>(contact.qy_N));
  const double of_scale_N = size_N * static_cast<double>(pad.tangential_scale_sd / pad.tangential_scale);
  const auto sd_N = static_cast<double>(contact.q_sd_N);
  return std::sqrt(std::max(0.0, sd_N * sd_N - of_scale_N * of_scale_N));
}

} // namespace

void check_pad(const wire_info &info, const std::string &what) {
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    throw Error(what + ": its firmware (scene " + text_field(info.scene) +
                ") reports no tangential force; flash one of scene grasp");
  }
  if (!(info.stored & WIRE_STORED_PAD)) {
    throw Error(what + ": no pad profile; fingertip pad --thickness MM first");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < 1000.0 * PULL_RATE_MIN_Hz) {
    throw Error(what + ": " + fixed(info.rate_mHz / 1000.0, 1) +
                " frames a second are too few to see a pull hold still; fingertip set rate=max");
  }
}

PullSession::PullSession(const wire_info &info, double known_N) : pad_(info.pad), known_N_(known_N), finder_(known_N) {
  judge(false);
}

bool PullSession::take(const wire_packet &packet) {
  const wire_contact &contact = packet.body.contact;
  if (packet.type != WIRE_CONTACT || (contact.flags & CONTACT_FLAG_HELD)) {
    return false;
  }
  PullFrame frame;
  frame.t_s = 1e-6 * static_cast<double>(packet.t_us);
  frame.contact = contact.flags & CONTACT_FLAG_CONTACT;
  frame.good = (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) &&
               !(contact.flags & (CONTACT_FLAG_MOVING | CONTACT_FLAG_SLIDING)) &&
               !(contact.flags & warning_flags() & ~HARMLESS);
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

std::string PullSession::advice() const {
  switch (finder_.state()) {
  case PullFinder::State::settling:
    return "release it, and leave it alone";
  case PullFinder::State::resting:
    return "pull: hang the weight on its string";
  case PullFinder::State::pulled:
    return "hold on";
  case PullFinder::State::taken:
    return "taken: take it off the pad";
  case PullFinder::State::refused:
    return finder_.refusal() == PullFinder::Refusal::slid ? "it slid: take it off, and press it down harder"
                                                          : weak_text() + "; take it off";
  case PullFinder::State::free:
    break;
  }
  return "set the object down, its string slack";
}

std::string PullSession::last_pull_text() const {
  const Pull &pull = pulls_.back();
  const double degrees = std::atan2(pull.qy_N, pull.qx_N) * 180.0 / M_PI;
  return "pull " + std::to_string(pulls_.size()) + " at x " + fixed(pull.x_mm, 1) + " y " + fixed(pull.y_mm, 1) +
         " mm: reads " + fixed(std::hypot(pull.qx_N, pull.qy_N), 2) + " N towards " + fixed(degrees, 0) +
         " degrees, under " + fixed(pull.force_N, 2) + " N";
}

std::string PullSession::weak_text() const {
  return fixed(known_N_, 2) + " N is small beside the fingertip's possible error there, " + fixed(finder_.sd_N(), 2) +
         " N: pull harder, or calibrate the gains first";
}

pad_profile PullSession::scaled(pad_profile pad) const {
  const double scale = static_cast<double>(pad_.tangential_scale) / judgement_.reading;
  pad.tangential_scale = static_cast<float>(scale);
  pad.tangential_scale_sd = static_cast<float>(scale * judgement_.reading_sd);
  if (!pad_profile_is_valid(&pad)) {
    throw Error("the readings are not those of " + fixed(known_N_, 2) + " N: they make " +
                fixed(known_N_ * judgement_.reading, 2) + " N; give the force that pulled");
  }
  return pad;
}

} // namespace fingertip::calibrating
