#include "library/share/line_server.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/share_socket.hpp"

#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/stat.h>

namespace fingertip {

constexpr std::size_t LONGEST_LINE = 200, MOST_CLIENTS = 16;

static void put(int client, const std::string &line) {
  const std::string whole = line + "\n"; // the socket's room is many lines
  (void)!send(client, whole.data(), whole.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

LineServer::LineServer(const std::string &path, Clients clients) : path_(path), about_(std::move(clients)) {
  sockaddr_un address;
  bool listens = unix_address(path_, &address);
  if (listens) {
    if (SocketTransport::is_served(path_)) {
      throw Error(ErrorCode::port_in_use, path_ + ": another program listens there");
    }
    unlink(path_.c_str());
    listening_ = Descriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const mode_t mask = umask(0177);
    listens = bind(listening_.get(), reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0 &&
              listen(listening_.get(), MOST_CLIENTS) == 0;
    umask(mask);
  }
  if (!listens) {
    throw Error(ErrorCode::cannot_write, path_ + ": " + std::strerror(errno));
  }
}

LineServer::~LineServer() {
  for (const auto &client : clients_) {
    close(client.first);
  }
  unlink(path_.c_str());
}

void LineServer::step() {
  for (int client;
       clients_.size() < MOST_CLIENTS && (client = accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) {
    clients_[client];
  }
  for (auto client = clients_.begin(); client != clients_.end();) {
    if (hear(client->first, client->second)) {
      ++client;
      continue;
    }
    about_.leaves(client->first);
    close(client->first);
    client = clients_.erase(client);
  }
}

bool LineServer::hear(int client, std::string &came) {
  char bytes[1024];
  for (ssize_t count; (count = recv(client, bytes, sizeof bytes, 0)) != 0;) {
    if (count < 0) {
      return errno == EAGAIN || errno == EINTR;
    }
    came.append(bytes, static_cast<std::size_t>(count));
    for (std::size_t end; (end = came.find('\n')) != std::string::npos;) {
      const std::string answer = about_.answer(client, came.substr(0, end));
      if (!answer.empty()) {
        put(client, answer);
      }
      came.erase(0, end + 1);
    }
    if (came.size() > LONGEST_LINE) {
      return false;
    }
  }
  return false;
}

void LineServer::send(const std::string &line) {
  for (const auto &client : clients_) {
    put(client.first, line);
  }
}

} // namespace fingertip
