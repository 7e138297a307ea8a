/* The user's terminal and signals. */
#pragma once

#include "tool/cli/keys.hpp"
#include "tool/cli/painter.hpp"

#include <optional>
#include <termios.h>

namespace fingertip {

/* SIGINT, SIGTERM and SIGHUP from now on only ask to stop, SIGPIPE is ignored. */
void catch_signals();
bool stop_requested();
/* How often SIGINT came, for programs that do not end by the first, and whether another of these signals did. */
unsigned interrupts();
bool end_requested();

/* Whether a pipe's other end is still there. */
bool is_standard_output_read();
/* Waits until standard output takes at least 4 KiB more; false if it does not and a stop is requested. */
bool wait_for_standard_output();

enum class ColourMode { automatic, truecolour, palette_256, plain };

/* What standard output can show: nothing if it is no terminal, a dumb one, or plain is wanted. In
 * automatic mode NO_COLOR (no-color.org) is heeded. */
std::optional<ColourDepth> screen_depth(ColourMode mode);

/* The locale's encoding for the terminal: UTF-8 or, in any other, ASCII. */
Characters screen_characters();

/* The full screen, given back as it was when this ends; also over a suspend (Ctrl-Z). */
class Screen {
public:
  explicit Screen(ColourDepth depth);
  ~Screen();
  Screen(const Screen &) = delete;
  Screen &operator=(const Screen &) = delete;

  int columns() const;
  int rows() const;
  void draw(const Canvas &canvas);
  /* A key that somebody pressed, or nothing. */
  std::optional<Key> key();

private:
  void enter();
  void leave();

  bool has_input_;
  termios before_;
  KeyParser keys_;
  Painter painter_;
};

} // namespace fingertip
