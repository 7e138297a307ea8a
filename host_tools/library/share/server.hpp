/* Owns fingertips and shares each over a Unix socket (share_socket.hpp) with its clients.
 *
 *   Server server(Server::Options(), [](const std::string &line) { ... });
 *   server.add(endpoint);
 *   while (!stop) {
 *     server.step(500ms);
 *   }
 *
 * It has one thread, which sleeps in poll(2) until a line or a client sends something. A signal wakes it. A socket
 * exists while its fingertip is there. When the fingertip goes, its clients get all packets until then and the end of
 * their connections, as if their own port had vanished. */
#pragma once

#include "libfingertip/connection.hpp"
#include "library/share/hub.hpp"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace fingertip {

class Server {
public:
  struct Options {
    std::string folder;         /* of the sockets, made if it is not there */
    std::optional<gid_t> group; /* who may connect beside this user; else this process's */
  };
  /* What happens, as lines for people. */
  using Log = std::function<void(const std::string &)>;

  /* Throws Error if the folder cannot be. */
  Server(const Options &options, Log log);
  /* The fingertips' streams end, the sockets go. */
  ~Server();
  Server(const Server &) = delete;
  Server &operator=(const Server &) = delete;

  bool is_empty() const { return stations_.empty(); }
  /* Whether this fingertip is served here, there or waited for. */
  bool has(const Endpoint &endpoint) const;
  /* Serves it from now on, through unplugging. Its socket is there once its serial number is known.
   * Throws Error: absent, in use, not allowed, shared by another program. */
  void add(const Endpoint &endpoint);

  /* Waits at most this long for something to do, and does it. */
  void step(std::chrono::milliseconds longest_wait);

private:
  class Station;

  std::string folder_;
  std::optional<gid_t> group_;
  Log log_;
  std::vector<std::unique_ptr<Station>> stations_;
};

} // namespace fingertip
