/* Fingertips that `fingertip serve` shares. Each is a Unix socket SERIAL.sock, with the link SERIAL.port beside it to its serial port, if
 * it has one. A connection to the socket is a line to the fingertip (PROTOCOL.md), which others share at the same time. The socket exists
 * as long as the fingertip is there. The socket's owner and group may connect.
 *
 * They are in the folder of the server: $XDG_RUNTIME_DIR/fingertip; without that variable
 * /run/fingertip for root and /tmp/fingertip-UID for others. All look into /run/fingertip too. */
#pragma once

#include "libfingertip/descriptor_transport.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

struct Shared {
  std::string serial; /* as far as it can be the name of a file */
  std::string socket;
  std::string port; /* as realpath has it; empty: by libusb */
};

/* Fingertips that are served now, also if this user may not connect to them. */
std::vector<Shared> find_shared();

/* Where this user's fingertips are shared, and where everybody's are. */
std::string own_share_folder();
inline constexpr const char *COMMON_SHARE_FOLDER = "/run/fingertip";

/* Makes the folder if it is not there. Throws Error: it cannot be, or is not a folder of this user's, who alone decides
 * what is in it. Judge it before anything in it is opened. */
void make_own_folder(const std::string &path);

/* Where `fingertip simulate` has its ports left, right and gripper: a folder in the own one. */
std::string simulated_folder();
/* "sim:left" is the port left in it, "sim:" the same; any other path stays as it is. Throws Error: nothing is simulated there. */
std::string port_of(const std::string &path);

std::string share_socket_name(const std::string &serial);
std::string share_port_name(const std::string &serial);
/* Beside them: where `fingertip grasp` takes requests, by its left fingertip's serial number. */
std::string grasp_socket_name(const std::string &serial);

/* What a server sends to one program too many, before it closes the connection; a frame that is none. */
inline constexpr std::string_view SHARE_IS_FULL{"\0is full\0", 9};

class SocketTransport : public DescriptorTransport {
public:
  /* Throws Error: not shared, not allowed. */
  explicit SocketTransport(const std::string &path);
  bool reopen() override;
  /* Throws Error also where the server is full. */
  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds timeout) override;
  /* The server serves a fingertip that does not speak this version of the protocol. */
  bool ask_loader() override;

  /* Whether somebody serves there now. */
  static bool is_served(const std::string &path);

private:
  ssize_t put(const std::uint8_t *bytes, std::size_t length) override;
};

} // namespace fingertip
