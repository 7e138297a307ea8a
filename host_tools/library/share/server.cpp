#include "library/share/server.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/share_socket.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

namespace fingertip {

namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr mode_t FOLDER_MODE = 0750, SOCKET_MODE = 0660;
constexpr int BACKLOG = 64;
constexpr milliseconds REOPEN_INTERVAL{200};
/* While somebody waits for an answer the hub may have to ask again. */
constexpr milliseconds TICK{500};
/* A client that reads gets its last packets well within this time. */
constexpr milliseconds LAST_PACKETS{2000};
/* Reads from one line in a row, so that each gets its turn: 50 ms at the highest rate. */
constexpr int READS_IN_A_ROW = 4;
/* Clients of one fingertip at most: sixteen of these stay within 1024 descriptors, the default limit of systems. */
constexpr std::size_t MOST_CLIENTS = 60;
/* Bytes taken of a client at once: some dozen commands. */
constexpr std::size_t CLIENT_BYTES = 256;

Error cannot_share(const std::string &path) {
  return Error(ErrorCode::cannot_share, path + ": cannot share there (" + std::strerror(errno) + ")");
}

/* "pid 4242, fingertip" */
std::string peer_of(int fd) {
  ucred credentials = {};
  socklen_t length = sizeof credentials;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0) {
    return "a client";
  }
  std::string pid = std::to_string(credentials.pid);
  std::string name;
  std::getline(std::ifstream("/proc/" + pid + "/comm"), name);
  return "pid " + pid + (name.empty() ? "" : ", " + name);
}

/* Sends as many as it takes now; nothing: it is gone. */
std::optional<std::size_t> send_now(int fd, const std::uint8_t *bytes, std::size_t length) {
  std::size_t sent = 0;
  while (sent < length) {
    ssize_t count = send(fd, bytes + sent, length - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      return errno == EAGAIN ? std::optional(sent) : std::nullopt;
    }
    sent += static_cast<std::size_t>(count);
  }
  return sent;
}

/* A socket for clients, and the link to its port beside it; both go at the end. */
class Listener {
public:
  /* A socket that a killed program left is replaced. Throws Error: another program serves there. */
  Listener(const std::string &folder, const std::string &serial, const std::string &port, std::optional<gid_t> group)
      : path_(folder + "/" + share_socket_name(serial)), port_path_(folder + "/" + share_port_name(serial)) {
    if (SocketTransport::is_served(path_)) {
      throw Error(ErrorCode::shared_already, path_ + ": another program shares this fingertip");
    }
    sockaddr_un address;
    std::string early = path_ + ".new"; /* until no other user can open it */
    if (!unix_address(early, &address)) {
      throw cannot_share(path_);
    }
    fd_ = Descriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    unlink(early.c_str());
    mode_t before = umask(0777);
    bool bound = bind(fd_.get(), reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0;
    umask(before);
    if (!bound || (group && chown(early.c_str(), static_cast<uid_t>(-1), *group) != 0) || chmod(early.c_str(), SOCKET_MODE) != 0 ||
        listen(fd_.get(), BACKLOG) != 0 || rename(early.c_str(), path_.c_str()) != 0) {
      Error error = cannot_share(path_);
      unlink(early.c_str());
      throw error;
    }
    unlink(port_path_.c_str());
    std::error_code none;
    std::string real_port = port.empty() ? "" : fs::canonical(port, none).string();
    if (!real_port.empty() && symlink(real_port.c_str(), port_path_.c_str()) != 0) {
      Error error = cannot_share(port_path_);
      unlink(path_.c_str());
      throw error;
    }
  }
  ~Listener() {
    unlink(path_.c_str());
    unlink(port_path_.c_str());
  }
  Listener(const Listener &) = delete;
  Listener &operator=(const Listener &) = delete;

  int fd() const { return fd_.get(); }
  const std::string &path() const { return path_; }

private:
  std::string path_, port_path_;
  Descriptor fd_;
};

} // namespace

/* One fingertip, there or waited for. */
class Server::Station {
public:
  Station(Server &server, const Endpoint &endpoint) : server_(server), endpoint_(endpoint), transport_(open_endpoint(endpoint)) { begin(); }
  ~Station() {
    auto end = frame_bytes(command_stream(0));
    transport_->write(end.data(), end.size());
  }

  const Endpoint &endpoint() const { return endpoint_; }
  std::string name() const { return serial_.empty() ? transport_->description() : serial_; }

  /* What to wait for. Returns whether there is more to do at once. */
  bool add_descriptors(std::vector<pollfd> &all) {
    Hub::Time now = host_now();
    if (hub_) {
      auto line = transport_->poll_descriptors();
      all.insert(all.end(), line.begin(), line.end());
      bool takes = hub_->takes_commands(now);
      connections_at_ = all.size();
      for (const Connection &each : connections_) {
        std::size_t length = 0;
        hub_->waiting(each.client, &length);
        auto events = static_cast<short>((takes ? POLLIN : 0) | (length > 0 ? POLLOUT : 0));
        all.push_back({events ? each.fd.get() : -1, events, 0}); /* else its end would show */
      }
    }
    if (listener_) {
      all.push_back({listener_->fd(), POLLIN, 0});
    }
    for (const Leaving &each : leaving_) {
      all.push_back({each.fd.get(), POLLOUT, 0});
    }
    return more_;
  }

  /* all: as add_descriptors made it, after the wait. */
  void step(const std::vector<pollfd> &all) {
    Hub::Time now = host_now();
    more_ = false;
    send_farewell(now);
    if (!hub_) {
      reopen(now);
      return;
    }
    for (std::size_t i = 0; i < connections_.size(); i++) {
      connections_[i].is_heard = all[connections_at_ + i].revents & ~POLLOUT;
    }
    take_from_clients(now);
    accept_clients();
    flush_line();
    take_from_line();
    if (hub_) {
      hub_->tick(now);
      more_ = flush_line() || more_;
      open_for_clients();
      give_to_clients();
    }
  }

private:
  struct Connection {
    Descriptor fd;
    Hub::Client client;
    std::string peer;
    bool is_heard = false; /* it has sent something, or is gone */
    bool reported_losses = false;
    bool over = false;
  };
  /* Its line has gone; it gets what came until then. */
  struct Leaving {
    Descriptor fd;
    Bytes rest;
    Hub::Time until;
  };

  void begin() {
    hub_.emplace();
    serial_ = endpoint_.found_by_usb ? endpoint_.serial : "";
    hub_->tick(host_now());
    flush_line();
    open_for_clients();
  }

  /* Not the same twice in a row. */
  void log(const std::string &what) {
    if (logged_ != what) {
      logged_ = what;
      server_.log_(what);
    }
  }

  void open_for_clients() {
    if (hub_->info() && serial_.empty()) {
      serial_ = text_field(hub_->info()->serial);
    }
    if (listener_ || serial_.empty()) {
      return;
    }
    listener_.emplace(server_.folder_, serial_, endpoint_.port.empty() ? "" : transport_->description(), server_.group_);
    log(serial_ + ": shared as " + listener_->path());
  }

  void accept_clients() {
    while (listener_) {
      Descriptor fd(accept4(listener_->fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (fd.get() < 0) {
        return;
      }
      std::string peer = peer_of(fd.get());
      if (connections_.size() == MOST_CLIENTS) {
        log(name() + ": " + peer + " is one too many, after " + std::to_string(MOST_CLIENTS));
        (void)send(fd.get(), SHARE_IS_FULL.data(), SHARE_IS_FULL.size(), MSG_NOSIGNAL);
        continue;
      }
      connections_.push_back({std::move(fd), hub_->join(), std::move(peer)});
    }
  }

  void take_from_clients(Hub::Time now) {
    for (Connection &each : connections_) {
      if (!each.is_heard || !hub_->takes_commands(now)) {
        continue;
      }
      std::uint8_t bytes[CLIENT_BYTES];
      ssize_t count = recv(each.fd.get(), bytes, sizeof bytes, MSG_DONTWAIT);
      if (count > 0) {
        hub_->from_client(each.client, bytes, static_cast<std::size_t>(count), now);
      } else {
        each.over = count == 0 || (errno != EAGAIN && errno != EINTR);
      }
    }
    drop_those_over();
  }

  void drop_those_over() {
    for (Connection &each : connections_) {
      if (each.over) {
        report_losses(each, true);
        hub_->leave(each.client);
      }
    }
    connections_.erase(std::remove_if(connections_.begin(), connections_.end(), [](const Connection &each) { return each.over; }),
                       connections_.end());
  }

  void report_losses(Connection &connection, bool finally) {
    std::uint64_t lost = hub_->lost(connection.client);
    if (lost > 0 && finally) {
      log(name() + ": " + connection.peer + " lost " + std::to_string(lost) + " packets that it did not read in time");
    } else if (lost > 0 && !connection.reported_losses) {
      connection.reported_losses = true;
      log(name() + ": " + connection.peer + " does not read in time and loses packets");
    }
  }

  /* Whether anything was written: reading may have something then. */
  bool flush_line() {
    if (hub_->take_loader_wish() && transport_->ask_loader()) {
      log(name() + ": asked into its loader");
    }
    Bytes bytes = hub_->take_for_line();
    if (!bytes.empty()) {
      transport_->write(bytes.data(), bytes.size());
    }
    return !bytes.empty();
  }

  void take_from_line() {
    for (int i = 0; i < READS_IN_A_ROW; i++) {
      std::uint8_t bytes[4096];
      std::size_t length = 0;
      auto result = transport_->read(bytes, sizeof bytes, &length, milliseconds(0));
      if (result == Transport::Result::gone) {
        lose_line();
        return;
      }
      if (result == Transport::Result::timeout) {
        return;
      }
      hub_->from_line(bytes, length);
    }
    more_ = true;
  }

  void lose_line() {
    log(name() + ": gone, its clients wait for it");
    for (Connection &each : connections_) {
      report_losses(each, true);
      std::size_t length = 0;
      const std::uint8_t *bytes = hub_->waiting(each.client, &length);
      leaving_.push_back({std::move(each.fd), Bytes(bytes, bytes + length), host_now() + LAST_PACKETS});
    }
    connections_.clear();
    listener_.reset();
    hub_.reset();
    send_farewell(host_now());
  }

  void send_farewell(Hub::Time now) {
    for (Leaving &each : leaving_) {
      auto sent = send_now(each.fd.get(), each.rest.data(), each.rest.size());
      auto taken = static_cast<std::ptrdiff_t>(sent.value_or(each.rest.size()));
      each.rest.erase(each.rest.begin(), each.rest.begin() + taken);
    }
    leaving_.erase(
        std::remove_if(leaving_.begin(), leaving_.end(), [&](const Leaving &each) { return each.rest.empty() || now > each.until; }),
        leaving_.end());
  }

  /* Whatever keeps it from being opened may pass. */
  void reopen(Hub::Time now) {
    if (now < reopen_at_) {
      return;
    }
    reopen_at_ = now + REOPEN_INTERVAL;
    try {
      if (transport_->reopen()) {
        begin();
      }
    } catch (const Error &error) {
      hub_.reset();
      log(error.what());
    }
  }

  void give_to_clients() {
    for (Connection &each : connections_) {
      std::size_t length = 0;
      const std::uint8_t *bytes = hub_->waiting(each.client, &length);
      auto sent = send_now(each.fd.get(), bytes, length);
      each.over = !sent || hub_->is_lost_for_good(each.client);
      hub_->took(each.client, sent.value_or(0));
      report_losses(each, false);
    }
    drop_those_over();
  }

  Server &server_;
  Endpoint endpoint_;
  std::unique_ptr<Transport> transport_;
  std::optional<Hub> hub_; /* while the fingertip is there */
  std::string serial_;     /* "": not known yet */
  std::optional<Listener> listener_;
  std::vector<Connection> connections_;
  std::size_t connections_at_ = 0; /* among what is waited for */
  std::vector<Leaving> leaving_;
  Hub::Time reopen_at_{};
  std::string logged_; /* last */
  bool more_ = false;
};

Server::Server(const Options &options, Log log) : folder_(options.folder), group_(options.group), log_(std::move(log)) {
  make_own_folder(folder_);
  if ((group_ && chown(folder_.c_str(), static_cast<uid_t>(-1), *group_) != 0) || chmod(folder_.c_str(), FOLDER_MODE) != 0) {
    throw cannot_share(folder_);
  }
}

Server::~Server() = default;

bool Server::has(const Endpoint &endpoint) const {
  return std::any_of(stations_.begin(), stations_.end(), [&](const auto &station) {
    const Endpoint &other = station->endpoint();
    return endpoint.found_by_usb && other.found_by_usb ? is_same_serial(endpoint.serial, other.serial) : endpoint.port == other.port;
  });
}

void Server::add(const Endpoint &endpoint) {
  if (!endpoint.socket.empty()) {
    throw Error(ErrorCode::shared_already, endpoint.socket + ": another program shares this fingertip");
  }
  stations_.push_back(std::make_unique<Station>(*this, endpoint));
}

void Server::step(milliseconds longest_wait) {
  std::vector<pollfd> waiting;
  bool more = false;
  bool any_gone = false;
  for (const auto &station : stations_) {
    std::size_t before = waiting.size();
    more = station->add_descriptors(waiting) || more;
    any_gone = any_gone || waiting.size() == before;
  }
  milliseconds wait = more ? milliseconds(0) : std::min(longest_wait, any_gone ? REOPEN_INTERVAL : TICK);
  wait_for(waiting.data(), waiting.size(), host_now() + wait);
  for (auto &station : stations_) {
    try {
      station->step(waiting);
    } catch (const Error &error) { /* such as another fingertip of the same serial number */
      if (stations_.size() == 1) {
        throw;
      }
      log_(error.what());
      station.reset();
    }
  }
  stations_.erase(std::remove(stations_.begin(), stations_.end(), nullptr), stations_.end());
}

} // namespace fingertip
