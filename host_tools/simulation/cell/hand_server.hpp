// A hand from outside on simulated fingertips, and what is true of them, over a Unix socket: `truth` in the folder of the simulated ports.
// Where a hand is obeyed, its name `hand` leads there too. `fingertip web` is its client (web/server/simulations.hpp). Lines of text:
//
//   press SIDE X_mm Y_mm FORCE_N        SIDE: left or right; 0 to 50 N. So it stays until another line
//   lift SIDE
//   truth SIDE T_us X_mm Y_mm FORCE_N QX_N QY_N      to every client each 20 ms; T_us: in the fingertip's own time, as in its packets;
//                                       FORCE_N 0: no contact; QX_N, QY_N: the pull along the rubber
//   error TEXT                          the answer to a line that cannot be
//
// A client that goes lifts what it pressed. Lines that a client does not take in time are lost.
#pragma once

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "library/share/line_server.hpp"
#include "simulation/cell/place.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <sstream>
#include <string>
#include <unistd.h>

namespace fingertip::cell {

struct HandAt {
  double x_mm = 0.0, y_mm = 0.0, force_N = 0.0;
};
struct TrueTouch : HandAt {
  double qx_N = 0.0, qy_N = 0.0;
};

class HandServer {
public:
  static constexpr std::int64_t TRUTH_EVERY_us = 20'000;
  static constexpr double MOST_N = 50.0, FARTHEST_mm = 100.0;

  // Throws Error: it cannot listen there.
  HandServer(const Place &place, std::size_t fingertips, bool obeys)
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
  ~HandServer() { unlink(name_.c_str()); }
  HandServer(const HandServer &) = delete;
  HandServer &operator=(const HandServer &) = delete;

  // Takes the clients' lines; does not wait.
  void step() { lines_.step(); }
  // The hand on a fingertip, if any.
  const std::optional<HandAt> &hand(std::size_t finger) const { return hands_[finger].at; }
  // Whether the truth is due again. Host time.
  bool is_due(std::int64_t host_us) {
    const bool is_due = host_us - sent_us_ >= TRUTH_EVERY_us;
    sent_us_ = is_due ? host_us : sent_us_;
    return is_due;
  }
  void send(std::size_t finger, std::int64_t device_us, const TrueTouch &truth) {
    const std::array values = {truth.x_mm, truth.y_mm, truth.force_N, truth.qx_N, truth.qy_N};
    lines_.send("truth " + std::string(SIDES[finger]) + " " + std::to_string(device_us) + " " +
                joined(values, " ", [](double value) { return fixed(value, 4); }));
  }

private:
  struct Held {
    std::optional<HandAt> at;
    int by = -1; // its client
  };

  // The answer; empty: none.
  std::string obey(int client, const std::string &line) {
    std::istringstream words(line);
    std::string verb, side, rest;
    HandAt hand;
    words >> verb >> side;
    const auto known = std::find(SIDES.begin(), SIDES.begin() + std::ptrdiff_t(fingertips_), side);
    const auto finger = static_cast<std::size_t>(known - SIDES.begin());
    const bool is_press = verb == "press" && words >> hand.x_mm >> hand.y_mm >> hand.force_N && hand.force_N >= 0.0;
    if (finger == fingertips_ || (!is_press && verb != "lift") || words >> rest) {
      return "give press SIDE X_mm Y_mm FORCE_N or lift SIDE; SIDE is left" + std::string(fingertips_ > 1 ? " or right" : "");
    }
    if (!obeys_) {
      return "no hand presses here; start fingertip simulate --mouse";
    }
    hands_[finger] = {};
    if (is_press) {
      hand = {std::clamp(hand.x_mm, -FARTHEST_mm, FARTHEST_mm), std::clamp(hand.y_mm, -FARTHEST_mm, FARTHEST_mm),
              std::min(hand.force_N, MOST_N)};
      hands_[finger] = {hand, client};
    }
    return "";
  }
  void leave(int client) {
    for (Held &hand : hands_) {
      if (hand.by == client) {
        hand = {};
      }
    }
  }

  std::size_t fingertips_;
  bool obeys_;
  std::string name_;
  std::array<Held, SIDES.size()> hands_;
  std::int64_t sent_us_ = 0;
  LineServer lines_;
};

} // namespace fingertip::cell
