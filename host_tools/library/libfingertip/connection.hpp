/* Opens a line by the user's options: which fingertip, and how it is reached. */
#pragma once

#include "libfingertip/discovery.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/transport.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

enum class Reach {
  automatic, /* by the socket of the server that shares it, else by its serial port if it has one,
              * else by libusb */
  socket,
  serial,
  usb,
};

struct Choice {
  std::string port;   /* a serial port or pseudo-terminal; empty: look for a fingertip */
  std::string device; /* its serial number; empty: the only one there is */
  Reach reach = Reach::automatic;
};

/* A way to one fingertip. */
struct Way {
  std::string serial;      /* by USB, or as it answered; empty: unknown */
  std::string port;        /* empty: by libusb */
  bool found_by_usb;       /* and found so again when it was gone */
  std::string socket = ""; /* of the program that shares it; then the rest only describes it */
};

/* All there are. */
struct Finds {
  std::vector<Found> here;           /* by USB, or shared by a server that reaches them otherwise */
  std::vector<Found> in_environment; /* the paths there */
};
Finds find_fingertips(const std::string &root = "/");

/* Throws Error if there is none, several to choose from, or another one than was wanted. If a serial number is wanted and USB does not
 * report that of a port, the fingertip there is asked for it. Without options the environment goes before USB. */
Way choose_way(const Choice &choice, const std::string &root = "/");

/* All there are, for programs that take several; the environment's too, each asked who it is. */
std::vector<Way> all_ways(Reach reach, const std::string &root = "/");

/* Throws Error: absent, in use, not allowed. */
std::unique_ptr<Transport> open_way(const Way &way, const std::string &root = "/");

/* How a fingertip that was found would be reached; nothing: not that way. */
std::optional<Way> way_to(const Found &found, Reach reach);

/* Who is there, within a second or so. Throws Error as open_way and Session do. */
wire_info ask(const Way &way, const std::function<bool()> &stop, const std::string &root = "/");

} // namespace fingertip
#pragma GCC visibility pop
