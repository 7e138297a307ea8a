#include "tool/cli/terminal.hpp"

#include "libfingertip/clock.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <langinfo.h>
#include <locale.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace fingertip {

constexpr std::chrono::milliseconds OUTPUT_WAIT{100}; /* between two checks for a stop */

static volatile std::sig_atomic_t stop_signal = 0;
static std::atomic<unsigned> interrupt_count{0}; /* the handler may run in several threads */
static volatile std::sig_atomic_t end_signal = 0;
static volatile std::sig_atomic_t suspend_signal = 0;

static void on_stop(int signal) {
  stop_signal = signal;
  if (signal == SIGINT) {
    interrupt_count++;
  } else {
    end_signal = signal;
  }
}
static void on_suspend(int signal) { suspend_signal = signal; }

static void handle(int signal, void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  sigaction(signal, &action, nullptr);
}

static void write_all(const std::string &text) {
  std::size_t at = 0;
  while (at < text.size()) {
    ssize_t count = write(STDOUT_FILENO, text.data() + at, text.size() - at);
    if (count < 0 && errno == EAGAIN) {
      pollfd waiting = {STDOUT_FILENO, POLLOUT, 0};
      wait_for(&waiting, 1, host_now() + OUTPUT_WAIT);
    } else if (count < 0 && errno != EINTR) {
      return;
    } else if (count > 0) {
      at += static_cast<std::size_t>(count);
    }
  }
}

static winsize window() {
  winsize size = {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    size.ws_col = 80;
    size.ws_row = 24;
  }
  return size;
}

void catch_signals() {
  handle(SIGINT, on_stop);
  handle(SIGTERM, on_stop);
  handle(SIGHUP, on_stop);
  handle(SIGPIPE, SIG_IGN);
}

bool is_standard_output_read() {
  pollfd asked = {STDOUT_FILENO, 0, 0};
  return poll(&asked, 1, 0) <= 0;
}

bool wait_for_standard_output() {
  pollfd waiting = {STDOUT_FILENO, POLLOUT, 0};
  while (wait_for(&waiting, 1, host_now() + OUTPUT_WAIT) <= 0) {
    if (stop_requested()) {
      return false;
    }
  }
  return true;
}

bool stop_requested() { return stop_signal != 0; }

unsigned interrupts() { return interrupt_count; }

bool end_requested() { return end_signal != 0; }

std::optional<ColourDepth> screen_depth(ColourMode mode) {
  const char *term = std::getenv("TERM");
  if (mode == ColourMode::plain || !isatty(STDOUT_FILENO) || !term || !std::strcmp(term, "dumb")) {
    return std::nullopt;
  }
  if (mode == ColourMode::truecolour) {
    return ColourDepth::truecolour;
  }
  const char *no_colour = std::getenv("NO_COLOR");
  if (mode == ColourMode::automatic && no_colour && *no_colour) {
    return ColourDepth::none;
  }
  const char *colours = std::getenv("COLORTERM");
  bool truecolour = colours && (!std::strcmp(colours, "truecolor") || !std::strcmp(colours, "24bit"));
  return mode == ColourMode::automatic && truecolour ? ColourDepth::truecolour : ColourDepth::palette_256;
}

Characters screen_characters() {
  std::string charset;
  if (locale_t locale = newlocale(LC_CTYPE_MASK, "", locale_t{})) {
    charset = nl_langinfo_l(CODESET, locale);
    freelocale(locale);
  } else {
    /* Named but not installed here, as when logged in from elsewhere: the name has to do. */
    for (const char *variable : {"LC_ALL", "LC_CTYPE", "LANG"}) {
      const char *name = std::getenv(variable);
      if (name && *name) {
        charset = name;
        break;
      }
    }
  }
  std::transform(charset.begin(), charset.end(), charset.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  bool utf_8 = charset.find("utf-8") != std::string::npos || charset.find("utf8") != std::string::npos;
  return utf_8 ? Characters::utf_8 : Characters::ascii;
}

Screen::Screen(ColourDepth depth) : has_input_(tcgetattr(STDIN_FILENO, &before_) == 0), painter_(depth, screen_characters()) {
  handle(SIGTSTP, on_suspend);
  enter();
}

Screen::~Screen() {
  leave();
  handle(SIGTSTP, SIG_DFL);
}

void Screen::enter() {
  if (has_input_) {
    termios settings = before_;
    settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    settings.c_cc[VMIN] = 0;
    settings.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &settings);
  }
  /* alternate screen, cursor and line wrap off, pasted text marked */
  write_all("\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[?2004h\x1b[2J");
}

void Screen::leave() {
  write_all("\x1b[0m\x1b[?2004l\x1b[?7h\x1b[?25h\x1b[?1049l");
  if (has_input_) {
    tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
}

int Screen::columns() const { return window().ws_col; }
int Screen::rows() const { return window().ws_row; }

void Screen::draw(const Canvas &canvas) {
  if (suspend_signal) {
    suspend_signal = 0;
    leave();
    raise(SIGSTOP);
    enter();
    painter_.forget();
  }
  std::string bytes = painter_.paint(canvas);
  if (!bytes.empty()) {
    /* begin and end of a synchronised update: no tearing where the terminal knows it */
    write_all("\x1b[?2026h" + bytes + "\x1b[?2026l");
  }
}

std::optional<Key> Screen::key() {
  char bytes[256];
  ssize_t count = has_input_ ? read(STDIN_FILENO, bytes, sizeof bytes) : 0;
  if (count > 0) {
    keys_.feed(bytes, static_cast<std::size_t>(count), host_now());
  }
  return keys_.next();
}

} // namespace fingertip
