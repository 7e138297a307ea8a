#include "tool/cli/keys.hpp"

namespace fingertip {

constexpr char ESCAPE = '\x1b';
/* The bytes of a sequence come together, over a slow serial line too: 50 ms at 300 baud are more
 * than one character. What comes later than that after an escape is a key. */
constexpr std::chrono::milliseconds SEQUENCE_GAP{50};
/* People read before they answer; faster input does not come from a person. */
constexpr std::chrono::milliseconds READING{300};
constexpr std::chrono::milliseconds PATIENCE{10000};
/* ECMA-48: parameter and intermediate bytes are below these, finals from it on. */
constexpr char FINAL_FIRST = '@', FINAL_LAST = '~';

void KeyParser::feed(const char *bytes, std::size_t length, HostTime now) {
  if (state_ != State::plain && now - last_ > SEQUENCE_GAP) {
    state_ = State::plain;
  }
  last_ = now;
  for (std::size_t i = 0; i < length; i++) {
    char byte = bytes[i];
    switch (state_) {
    case State::plain:
      if (byte == ESCAPE) {
        state_ = State::escape;
      } else if (!pasting_) {
        keys_.push_back(static_cast<unsigned char>(byte));
      }
      break;
    case State::escape:
      parameters_.clear();
      state_ = byte == '['                                                ? State::control
               : byte == 'O'                                              ? State::single
               : byte == ']' || byte == 'P' || byte == '_' || byte == '^' ? State::text
               : byte == ESCAPE                                           ? State::escape
                                                                          : State::plain;
      break;
    case State::control:
      if (byte < FINAL_FIRST || byte > FINAL_LAST) {
        parameters_ += byte;
        break;
      }
      if (byte == '~' && (parameters_ == "200" || parameters_ == "201")) {
        pasting_ = parameters_ == "200";
      } else {
        take_special(byte);
      }
      state_ = State::plain;
      break;
    case State::single:
      take_special(byte);
      state_ = State::plain;
      break;
    case State::text: /* up to BEL or ESC \ */
      state_ = byte == '\a' ? State::plain : byte == ESCAPE ? State::text_escape : State::text;
      break;
    case State::text_escape: state_ = byte == '\\' ? State::plain : State::text; break;
    }
  }
}

/* The keys in the encodings of xterm, the Linux console and rxvt. */
void KeyParser::take_special(char final_byte) {
  struct Special {
    const char *parameters;
    char final_byte;
    Key key;
  };
  constexpr Special specials[] = {{"", 'A', KEY_UP},  {"", 'B', KEY_DOWN},  {"", 'C', KEY_RIGHT}, {"", 'D', KEY_LEFT}, {"", 'H', KEY_HOME},
                                  {"", 'F', KEY_END}, {"1", '~', KEY_HOME}, {"7", '~', KEY_HOME}, {"4", '~', KEY_END}, {"8", '~', KEY_END}};
  for (const Special &special : specials) {
    if (!pasting_ && final_byte == special.final_byte && parameters_ == special.parameters) {
      keys_.push_back(special.key);
    }
  }
}

std::optional<Key> KeyParser::next() {
  if (keys_.empty()) {
    return std::nullopt;
  }
  Key key = keys_.front();
  keys_.pop_front();
  return key;
}

void Confirmation::ask(HostTime now) {
  asked_ = true;
  since_ = now;
}

bool Confirmation::answer(Key key, HostTime now) {
  bool in_time = now - since_ >= READING && now - since_ <= PATIENCE;
  bool yes = asked_ && in_time && (key == 'y' || key == 'Y');
  asked_ = false;
  return yes;
}

void Confirmation::expire(HostTime now) { asked_ = asked_ && now - since_ <= PATIENCE; }

} // namespace fingertip
