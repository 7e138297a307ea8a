/* What a person types, separated from the other input of a terminal. */
#pragma once

#include "libfingertip/clock.hpp"

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

namespace fingertip {

/* A character, or one of these. */
using Key = int;
enum : Key { KEY_LEFT = 256, KEY_RIGHT, KEY_UP, KEY_DOWN, KEY_HOME, KEY_END };

/* Keys out of the bytes of a terminal: its answers, other special keys, and pasted text where the
 * terminal marks it (bracketed paste) are none. */
class KeyParser {
public:
  void feed(const char *bytes, std::size_t length, HostTime now);
  std::optional<Key> next();

private:
  void take_special(char final_byte);

  enum class State { plain, escape, control, single, text, text_escape };

  State state_ = State::plain;
  HostTime last_{};
  std::string parameters_; /* of a control sequence */
  bool pasting_ = false;
  std::deque<Key> keys_;
};

/* A question before something that cannot be taken back. Text that is pasted does not answer it,
 * whatever is in it: there must be silence between the question and the answer. */
class Confirmation {
public:
  void ask(HostTime now);
  bool is_asked() const { return asked_; }
  /* Every key while it is asked: true for y. Any other, or y too early, withdraws the question. */
  bool answer(Key key, HostTime now);
  /* Withdraws it where no answer comes. */
  void expire(HostTime now);

private:
  bool asked_ = false;
  HostTime since_{};
};

} // namespace fingertip
