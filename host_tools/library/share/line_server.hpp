/* Lines of text over a Unix socket, which belongs to this user alone. No thread, no waits. A client that sends too long
 * a line is dismissed. Lines that a client does not take in time are lost, each as a whole. */
#pragma once

#include "libfingertip/descriptor_transport.hpp"

#include <functional>
#include <map>
#include <string>

namespace fingertip {

class LineServer {
public:
  struct Clients {
    /* The answer to a line of a client, both without the line's end; "": none. */
    std::function<std::string(int client, const std::string &line)> answer;
    std::function<void(int client)> leaves = [](int) {};
  };

  /* Replaces a socket that a killed program left. Throws Error: it cannot listen there, or another program does. */
  LineServer(const std::string &path, Clients clients);
  ~LineServer();
  LineServer(const LineServer &) = delete;
  LineServer &operator=(const LineServer &) = delete;

  const std::string &path() const { return path_; }
  /* Takes what the clients have sent, and answers. */
  void step();
  /* Sends to all clients. */
  void send(const std::string &line);

private:
  bool hear(int client, std::string &came); /* false: it is gone */

  std::string path_;
  Clients about_;
  Descriptor listening_;
  std::map<int, std::string> clients_; /* by descriptor: what came of their next line */
};

} // namespace fingertip
