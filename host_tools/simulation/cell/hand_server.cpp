#include "simulation/cell/hand_server.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <unistd.h>

namespace fingertip::cell {

HandServer::HandServer(const PortFolder &place, std::size_t fingertips, bool obeys)
    : fingertips_(fingertips), obeys_(obeys), name_(place.port("hand")),
      lines_(place.port("truth"), {[this](int client, const std::string &line) {
                                     const std::string answer = obey(client, line);
                                     return answer.empty() ? answer : "error " + answer;
                                   },
                                   [this](int client) { leave(client); }}) {
  unlink(name_.c_str()); // of a simulation that was killed
  if (obeys_ && symlink("truth", name_.c_str()) != 0) {
    throw Error(ErrorCode::cannot_write, name_ + ": " + std::strerror(errno));
  }
}

HandServer::~HandServer() { unlink(name_.c_str()); }

std::string HandServer::obey(int client, const std::string &line) {
  std::istringstream words(line);
  std::string verb, side, rest;
  words >> verb >> side;
  const auto known = std::find(SIDES.begin(), SIDES.begin() + std::ptrdiff_t(fingertips_), side);
  const auto finger = static_cast<std::size_t>(known - SIDES.begin());
  HandAt hand;
  const bool is_press = verb == "press" && words >> hand.x_mm >> hand.y_mm >> hand.force_N && hand.force_N >= 0.0;
  if (finger == fingertips_ || (!is_press && verb != "lift") || words >> rest) {
    return "give press SIDE X_mm Y_mm FORCE_N or lift SIDE; SIDE is left" + std::string(fingertips_ > 1 ? " or right" : "");
  }
  if (!obeys_) {
    return "no hand presses here; start fingertip simulate --mouse";
  }
  hands_[finger] = {};
  if (is_press) {
    hands_[finger] = {HandAt{std::clamp(hand.x_mm, -FARTHEST_mm, FARTHEST_mm), std::clamp(hand.y_mm, -FARTHEST_mm, FARTHEST_mm),
                             std::min(hand.force_N, MOST_N)},
                      client};
  }
  return "";
}

void HandServer::leave(int client) {
  for (Held &hand : hands_) {
    if (hand.by == client) {
      hand = {};
    }
  }
}

bool HandServer::is_due(std::int64_t host_us) {
  if (host_us - sent_us_ < TRUTH_EVERY_us) {
    return false;
  }
  sent_us_ = host_us;
  return true;
}

void HandServer::send(std::size_t finger, std::int64_t device_us, const twin::Touch &truth) {
  std::string line = "truth " + std::string(SIDES[finger]) + " " + std::to_string(device_us);
  for (const double value : {truth.x_mm, truth.y_mm, truth.force_N, truth.pull_x_N, truth.pull_y_N}) {
    line += " " + fixed(value, 4);
  }
  lines_.send(line);
}

} // namespace fingertip::cell
