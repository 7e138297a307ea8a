// A hand from outside on simulated fingertips, and what is true of them, over a Unix socket: `truth` in the folder of the simulated ports.
// Where a hand is obeyed, its name `hand` leads there too. `fingertip web` is its client (web/server/simulations.hpp). Lines of text:
//
//   press SIDE X_mm Y_mm FORCE_N        SIDE: left or right; 0 to 50 N. So it stays until another line
//   lift SIDE
//   truth SIDE T_us X_mm Y_mm FORCE_N QX_N QY_N
//                                       to every client each 20 ms; T_us: in the fingertip's own
//                                       time, as in its packets; FORCE_N 0: no contact; QX_N, QY_N:
//                                       the pull along the rubber
//   error TEXT                          the answer to a line that cannot be
//
// A client that goes lifts what it pressed. Lines that a client does not take in time are lost.
#pragma once

#include "library/share/line_server.hpp"
#include "simulation/cell/place.hpp"

#include <array>
#include <optional>
#include <string>

namespace fingertip::cell {

struct HandAt {
  double x_mm = 0.0, y_mm = 0.0, force_N = 0.0;
};

class HandServer {
public:
  static constexpr std::int64_t TRUTH_EVERY_us = 20'000;
  static constexpr double MOST_N = 50.0, FARTHEST_mm = 100.0;

  // Throws Error: it cannot listen there.
  HandServer(const PortFolder &place, std::size_t fingertips, bool obeys);
  ~HandServer();
  HandServer(const HandServer &) = delete;
  HandServer &operator=(const HandServer &) = delete;

  // Takes the clients' lines; does not wait.
  void step() { lines_.step(); }
  // The hand on a fingertip, if any.
  const std::optional<HandAt> &hand(std::size_t finger) const { return hands_[finger].at; }
  // Whether the truth is due again. Host time.
  bool is_due(std::int64_t host_us);
  void send(std::size_t finger, std::int64_t device_us, const twin::Touch &truth);

private:
  struct Held {
    std::optional<HandAt> at;
    int by = -1; // its client
  };

  // The answer; empty: none.
  std::string obey(int client, const std::string &line);
  void leave(int client);

  std::size_t fingertips_;
  bool obeys_;
  std::string name_;
  std::array<Held, SIDES.size()> hands_;
  std::int64_t sent_us_ = 0;
  LineServer lines_;
};

} // namespace fingertip::cell
