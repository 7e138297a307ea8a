#include "tool/calibration/pulls.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/calibration/solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::calibrating {

namespace {

constexpr double CHANCE_SDS = 4.0;

/* Mean of frames, and the variances of what is judged, from frame to frame: a change that goes on is none of them. */
struct Mean {
  PullFrame mean;
  double count = 0.0, q_variance = 0.0, force_variance = 0.0;
};

template <typename Iterator> Mean mean_of(Iterator begin, Iterator end) {
  Mean of;
  PullFrame &mean = of.mean;
  of.count = static_cast<double>(std::distance(begin, end));
  for (Iterator at = begin; at != end; ++at) {
    mean.qx_N += at->qx_N / of.count;
    mean.qy_N += at->qy_N / of.count;
    mean.q_sd_N += at->q_sd_N / of.count;
    mean.force_N += at->force_N / of.count;
    mean.x_mm += at->x_mm / of.count;
    mean.y_mm += at->y_mm / of.count;
  }
  for (Iterator before = begin, at = std::next(begin); at != end; before = at++) {
    const double dx_N = at->qx_N - before->qx_N, dy_N = at->qy_N - before->qy_N;
    of.q_variance += 0.25 * (dx_N * dx_N + dy_N * dy_N) / of.count;
    of.force_variance += 0.5 * std::pow(at->force_N - before->force_N, 2) / of.count;
  }
  return of;
}

double place_mm(const PullFrame &a, const PullFrame &b) { return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm); }

double size_of(const Pull &pull) { return std::hypot(pull.qx_N, pull.qy_N); }

/* 0 to 3: +x, +y, -x, -y. */
std::size_t way_of(const Pull &pull) {
  const double quarters = std::atan2(pull.qy_N, pull.qx_N) / M_PI_2;
  return static_cast<std::size_t>(std::lround(quarters + 4.0)) % 4;
}

constexpr const char *WAYS[] = {"+x", "+y", "-x", "-y"};

struct Readings {
  std::size_t count = 0;
  double sum = 0.0, squares = 0.0;
  void add(double value) {
    count++;
    sum += value;
    squares += value * value;
  }
  double mean() const { return sum / static_cast<double>(count); }
  double variance() const { /* of one */
    const auto n = static_cast<double>(count);
    return count > 1 ? std::max(0.0, (squares - sum * sum / n) / (n - 1.0)) : 0.0;
  }
};

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

/* The mean of the last mean_s, if the last span_s of frames are there and nothing goes on in them. */
std::optional<PullFrame> PullFinder::still(double span_s, double mean_s) const {
  const double begin_s = frames_.back().t_s - span_s;
  if (frames_.front().t_s > begin_s) {
    return std::nullopt;
  }
  const auto begin = std::find_if(frames_.begin(), frames_.end(), [&](const PullFrame &each) { return each.t_s >= begin_s; });
  if (static_cast<double>(std::distance(begin, frames_.end())) < PULL_RATE_MIN_Hz * span_s) {
    return std::nullopt; /* too few of them came */
  }
  const auto middle = begin + std::distance(begin, frames_.end()) / 2;
  const Mean a = mean_of(begin, middle), b = mean_of(middle, frames_.end());
  const auto chance = [&](double of_a, double of_b) { return CHANCE_SDS * std::sqrt(of_a / a.count + of_b / b.count); };
  const double q_N = std::hypot(b.mean.qx_N - a.mean.qx_N, b.mean.qy_N - a.mean.qy_N);
  const double force_N = std::abs(b.mean.force_N - a.mean.force_N);
  if (q_N > DRIFT_PULL_MAX * known_N_ + chance(a.q_variance, b.q_variance) ||
      force_N > DRIFT_FORCE_MAX * b.mean.force_N + chance(a.force_variance, b.force_variance) ||
      place_mm(a.mean, b.mean) > DRIFT_PLACE_MAX_mm) {
    return std::nullopt;
  }
  const double mean_begin_s = frames_.back().t_s - mean_s;
  return mean_of(std::find_if(begin, frames_.end(), [&](const PullFrame &each) { return each.t_s >= mean_begin_s; }), frames_.end()).mean;
}

std::optional<Pull> PullFinder::refuse(Refusal why) {
  state_ = State::refused;
  refusal_ = why;
  return std::nullopt;
}

std::optional<Pull> PullFinder::take(const PullFrame &frame) {
  const bool restarted = !frames_.empty() && frame.t_s <= frames_.back().t_s;
  if (restarted || !frame.contact || !frame.good) {
    frames_.clear();
  }
  if (restarted || !frame.contact) {
    state_ = State::free;
  }
  if (!frame.contact) {
    return std::nullopt;
  }
  if (state_ == State::free) {
    state_ = State::settling;
    refusal_ = Refusal::none;
    touch_s_ = frame.t_s;
  }
  if (!frame.good || frame.t_s - touch_s_ < TOUCHED_s || state_ == State::taken || state_ == State::refused) {
    return std::nullopt;
  }
  frames_.push_back(frame);
  while (frames_.size() > 1 && frames_[1].t_s <= frame.t_s - SETTLED_s - PULL_s) {
    frames_.pop_front();
  }
  if (state_ == State::settling) {
    if (const auto rest = still(REST_s, REST_s)) {
      rest_ = *rest;
      state_ = State::resting;
      frames_.clear();
      frames_.push_back(frame);
      if (known_N_ < PULL_SDS_MIN * rest_.q_sd_N) {
        return refuse(Refusal::weak);
      }
    }
    return std::nullopt;
  }
  if (place_mm(frame, rest_) > MOVED_MAX_mm) {
    return refuse(Refusal::slid);
  }
  const bool pulls = std::hypot(frame.qx_N - rest_.qx_N, frame.qy_N - rest_.qy_N) > PULLED_MIN * known_N_;
  state_ = pulls ? State::pulled : State::resting;
  if (!pulls) {
    frames_.clear();
    return std::nullopt;
  }
  const auto pulled = still(SETTLED_s + PULL_s, PULL_s);
  if (!pulled) {
    return std::nullopt;
  }
  state_ = State::taken;
  return Pull{frame.t_s, pulled->qx_N - rest_.qx_N, pulled->qy_N - rest_.qy_N, pulled->force_N, pulled->x_mm, pulled->y_mm};
}

PullJudgement judge_pulls(const std::vector<Pull> &pulls, double known_N, bool last) {
  using State = PullJudgement::State;
  PullJudgement judgement;
  const auto ends = [&](State state, const std::string &text) {
    judgement.state = state;
    judgement.text = text;
    return judgement;
  };
  const State lacking = last ? State::refused : State::more;
  const auto lacks = [&](std::size_t there, std::size_t wanted, const std::string &of) {
    return ends(lacking, std::to_string(there) + " of " + std::to_string(wanted) + " pulls" + of + (last ? "; pull more" : ""));
  };
  if (pulls.empty()) {
    return lacks(0, PULLS_WANTED, "");
  }
  std::vector<double> readings;
  for (const Pull &pull : pulls) {
    readings.push_back(size_of(pull) / known_N);
  }
  const double middle = median(readings);
  Readings all;
  std::array<Readings, 4> ways;
  for (std::size_t i = 0; i < pulls.size(); i++) {
    if (std::abs(readings[i] / middle - 1.0) <= PULL_STRAY_MAX) {
      all.add(readings[i]);
      ways[way_of(pulls[i])].add(readings[i]);
    }
  }
  judgement.kept = all.count;
  judgement.reading = all.mean();
  judgement.reading_sd = std::hypot(std::sqrt(all.variance() / static_cast<double>(all.count)) / all.mean(), KNOWN_SD);
  if (pulls.size() < PULLS_WANTED) {
    return lacks(pulls.size(), PULLS_WANTED, "");
  }
  if (static_cast<double>(all.count) < PULLS_KEPT_MIN * static_cast<double>(pulls.size())) {
    return ends(State::refused, "only " + std::to_string(all.count) + " of " + std::to_string(pulls.size()) + " pulls agree within " +
                                    fixed(100.0 * PULL_STRAY_MAX, 0) +
                                    " %; use one and the same weight, and keep the string level and free");
  }
  for (const std::size_t axis : {0U, 1U}) {
    const std::size_t there = ways[axis].count + ways[axis + 2].count;
    if (there < PULLS_OF_AN_AXIS) {
      return lacks(there, PULLS_OF_AN_AXIS, axis == 0 ? " along x" : " along y");
    }
  }
  for (std::size_t a = 0; a < ways.size(); a++) {
    for (std::size_t b = 0; b < a; b++) {
      if (ways[a].count < 2 || ways[b].count < 2) {
        continue;
      }
      const double difference = std::abs(ways[a].mean() - ways[b].mean()) / all.mean();
      const double variance =
          ways[a].variance() / static_cast<double>(ways[a].count) + ways[b].variance() / static_cast<double>(ways[b].count);
      if (difference > WAYS_MAX + 2.0 * std::sqrt(variance) / all.mean()) {
        return ends(State::refused, std::string("directions disagree: pulls towards ") + WAYS[b] + " read " +
                                        fixed(ways[b].mean() * known_N, 2) + " N, towards " + WAYS[a] + " " +
                                        fixed(ways[a].mean() * known_N, 2) + " N; keep the string level, and calibrate the gains first");
      }
    }
  }
  return ends(State::good, "the tangential force's scale is known to " + fixed(100.0 * judgement.reading_sd, 1) + " %");
}

void check_pad(const wire_info &info, const std::string &what) {
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    throw Error(what + ": its firmware (scene " + text_field(info.scene) + ") reports no tangential force; flash one of scene grasp");
  }
  if (!(info.stored & WIRE_STORED_PAD)) {
    throw Error(what + ": no pad profile; fingertip pad --thickness MM first");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < 1000.0 * PULL_RATE_MIN_Hz) {
    throw Error(what + ": " + fixed(info.rate_mHz / 1000.0, 1) +
                " frames a second are too few to see a pull hold still; fingertip set rate=max");
  }
}

PullSession::PullSession(const wire_info &info, double known_N) : pad_(info.pad), known_N_(known_N), finder_(known_N) { judge(false); }

bool PullSession::take(const wire_packet &packet) {
  const wire_contact &contact = packet.body.contact;
  if (packet.type != WIRE_CONTACT || (contact.flags & CONTACT_FLAG_HELD)) {
    return false;
  }
  const bool good = (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) &&
                    !(contact.flags & (CONTACT_FLAG_MOVING | CONTACT_FLAG_SLIDING | (warning_flags() & ~HARMLESS)));
  const auto found = finder_.take({1e-6 * double(packet.t_us), (contact.flags & CONTACT_FLAG_CONTACT) != 0, good, double(contact.qx_N),
                                   double(contact.qy_N), good ? sd_without_scale_N(contact, pad_) : 0.0, double(contact.force_N),
                                   double(contact.x_mm), double(contact.y_mm)});
  if (found) {
    pulls_.push_back(*found);
  }
  return found.has_value();
}

std::string PullSession::advice() const {
  switch (finder_.state()) {
  case PullFinder::State::settling: return "release it, and leave it alone";
  case PullFinder::State::resting: return "pull: hang the weight on its string";
  case PullFinder::State::pulled: return "hold on";
  case PullFinder::State::taken: return "taken: take it off the pad";
  case PullFinder::State::refused:
    return finder_.refusal() == PullFinder::Refusal::slid ? "it slid: take it off, and press it down harder"
                                                          : weak_text() + "; take it off";
  case PullFinder::State::free: break;
  }
  return "set the object down, its string slack";
}

std::string PullSession::last_pull_text() const {
  const Pull &pull = pulls_.back();
  const double degrees = std::atan2(pull.qy_N, pull.qx_N) * 180.0 / M_PI;
  return "pull " + std::to_string(pulls_.size()) + " at x " + fixed(pull.x_mm, 1) + " y " + fixed(pull.y_mm, 1) + " mm: reads " +
         fixed(std::hypot(pull.qx_N, pull.qy_N), 2) + " N towards " + fixed(degrees, 0) + " degrees, under " + fixed(pull.force_N, 2) +
         " N";
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
    throw Error("the readings are not those of " + fixed(known_N_, 2) + " N: they make " + fixed(known_N_ * judgement_.reading, 2) +
                " N; give the force that pulled");
  }
  return pad;
}

} // namespace fingertip::calibrating
