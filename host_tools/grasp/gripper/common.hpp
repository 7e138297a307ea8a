// What all grippers check and report alike.
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "grasp/gripper/serial_line.hpp"
#include "libfingertip/clock.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

// Throws Error: bad_value.
void check_move(const GripCommand &move);

// way, completed by the model's defaults. Throws Error: bad_value; counts go from 0 to most_count.
struct GripperUsual {
  int slave, most_slave, closed_count, open_count, most_count;
};
GripperWay complete(GripperWay way, const GripperUsual &usual);

// Questions to a gripper and its answers, in the maker's protocol. An adapter that hears itself is
// recognised: the question comes back before the answer.
//
// Answers have no number: a late one would pass for that to the next question. But they come in the order of the questions. So after a
// question without an answer another is asked, once, whose answer no other has, and what comes before that is not expected. It waits
// PROBE_TIMEOUTS times as long as any other; where its answer is lost the question with the other number is asked, lest the first come
// after all. An answer that is late by less than that is never taken for another's.
class RequestLine : public Gripper {
public:
  using Bytes = std::vector<std::uint8_t>;
  static constexpr int PROBE_TIMEOUTS = 5;

  // complete: complete() has made it so.
  RequestLine(const GripperWay &complete, unsigned baud, const GripperTraits &traits)
      : way_(complete), line_(complete.port, baud), traits_(traits) {}
  const GripperTraits &traits() const override { return traits_; }

protected:
  enum class Reply { none, other_slave, other_answer, matches };
  // Takes the first whole frame out of what came. The payload of one that fits a question; noise counts bytes of no
  // frame. Throws Error: gripper_refused.
  virtual Reply take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) = 0;
  // That question, 1 or 2, and the length of its answer's payload.
  virtual std::pair<Bytes, std::size_t> probe(int number) const = 0;

  // question: the whole frame. Returns the answer's payload, which has this length. Throws Error: gone,
  // gripper_silent, gripper_garbled, gripper_refused.
  Bytes exchange(const Bytes &question, std::size_t length);
  void resynchronise(); // before every exchange
  void doubt() { doubtful_ = true; }

  // "; the USB adapter's latency timer ..." where that limits the rate of a command of this number of exchanges; "" where it does not.
  std::string limited_by(int exchanges) const;

  const GripperWay way_;
  SerialLine line_;
  GripperTraits traits_;
  bool active_ = false;       // by the last status
  std::int64_t asked_us_ = 0; // the last question

private:
  void send(const Bytes &question);
  Bytes receive(const Bytes &question, std::size_t length);
  std::chrono::microseconds timeout() const { return std::chrono::microseconds(static_cast<std::int64_t>(way_.timeout_s * 1e6)); }

  bool doubtful_ = false;  // an answer may still come that is not expected
  int probe_ = 0;          // which probe has been asked, 0: none,
  HostTime probe_until_{}; // and is still waited for
};

} // namespace fingertip
