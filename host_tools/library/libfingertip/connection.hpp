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

enum class TransportKind {
  automatic, /* by the socket of the server that shares it, else by its serial port if it has one,
              * else by libusb */
  socket,
  serial,
  usb,
};

struct Choice {
  std::string port;   /* a serial port or pseudo-terminal; empty: look for a fingertip */
  std::string device; /* its serial number; empty: the only one there is */
  TransportKind transport = TransportKind::automatic;
};

/* Where one fingertip is reached. */
struct Endpoint {
  std::string serial;      /* by USB, or as it answered; empty: unknown */
  std::string port;        /* empty: by libusb */
  bool found_by_usb;       /* and found so again when it was gone */
  std::string socket = ""; /* of the program that shares it; then the rest only describes it */
};

/* All there are. */
struct FoundDevices {
  std::vector<Found> here;           /* by USB, or shared by a server that reaches them otherwise */
  std::vector<Found> in_environment; /* the paths there */
};
FoundDevices find_fingertips(const std::string &root = "/");

/* Throws Error if there is none, several to choose from, or another one than was wanted. If a serial number is wanted and USB does not
 * report that of a port, the fingertip there is asked for it. Without options the environment goes before USB. */
Endpoint choose_endpoint(const Choice &choice, const std::string &root = "/");

/* All there are, for programs that take several; the environment's too, each asked who it is. */
std::vector<Endpoint> all_endpoints(TransportKind transport, const std::string &root = "/");

/* Throws Error: absent, in use, not allowed. */
std::unique_ptr<Transport> open_endpoint(const Endpoint &endpoint, const std::string &root = "/");

/* Where a fingertip that was found would be reached; nothing: not by this transport. */
std::optional<Endpoint> endpoint_of(const Found &found, TransportKind transport);

/* Who is there, within a second or so. Throws Error as open_endpoint and Session do. */
wire_info ask(const Endpoint &endpoint, const std::function<bool()> &stop, const std::string &root = "/");

} // namespace fingertip
#pragma GCC visibility pop
