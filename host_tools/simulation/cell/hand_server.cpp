#include "simulation/cell/hand_server.hpp"

#include "libfingertip/descriptor_transport.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sstream>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace fingertip::cell {
namespace {

constexpr std::size_t LONGEST_LINE = 200, MOST_CLIENTS = 16;

void put(int client, const std::string &line) {
  // It is lost whole where the client does not read: the socket's room is many lines.
  (void)!send(client, line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

} // namespace

HandServer::HandServer(const Place &place, std::size_t fingertips, bool obeys)
    : fingertips_(fingertips), obeys_(obeys), path_(place.port("truth")), name_(place.port("hand")) {
  sockaddr_un address;
  if (!unix_address(path_, &address)) {
    throw Error(ErrorCode::cannot_write, path_ + ": the name is too long for a socket; choose "
                                                 "a shorter --ports");
  }
  unlink(path_.c_str()); // of a simulation that was killed: its place is ours
  unlink(name_.c_str());
  listening_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const mode_t mask = umask(0177);
  const bool bound = listening_ >= 0 &&
                     bind(listening_, reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0 &&
                     listen(listening_, MOST_CLIENTS) == 0;
  umask(mask);
  if (!bound || (obeys_ && symlink("truth", name_.c_str()) != 0)) {
    throw Error(ErrorCode::cannot_write, path_ + ": " + std::strerror(errno));
  }
}

HandServer::~HandServer() {
  for (const auto &client : clients_) {
    close(client.first);
  }
  close(listening_);
  unlink(name_.c_str());
  unlink(path_.c_str());
}

void HandServer::step() {
  come();
  for (auto client = clients_.begin(); client != clients_.end();) {
    if (listen_to(client->first, client->second)) {
      ++client;
    } else {
      leave(client->first);
      client = clients_.erase(client);
    }
  }
}

void HandServer::come() {
  for (int client; clients_.size() < MOST_CLIENTS &&
                   (client = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) {
    clients_[client];
  }
}

bool HandServer::listen_to(int client, std::string &came) {
  char bytes[1024];
  for (ssize_t count; (count = recv(client, bytes, sizeof bytes, 0)) != 0;) {
    if (count < 0) {
      return errno == EAGAIN || errno == EINTR;
    }
    came.append(bytes, static_cast<std::size_t>(count));
    for (std::size_t end; (end = came.find('\n')) != std::string::npos;) {
      const std::string answer = obey(client, came.substr(0, end));
      if (!answer.empty()) {
        put(client, "error " + answer + "\n");
      }
      came.erase(0, end + 1);
    }
    if (came.size() > LONGEST_LINE) {
      return false;
    }
  }
  return false;
}

std::string HandServer::obey(int client, const std::string &line) {
  std::istringstream words(line);
  std::string verb, side, rest;
  words >> verb >> side;
  const auto known = std::find(SIDES.begin(), SIDES.begin() + std::ptrdiff_t(fingertips_), side);
  const auto finger = static_cast<std::size_t>(known - SIDES.begin());
  std::array<double, 3> values{};
  std::string word;
  bool are_numbers = true;
  for (double &value : values) {
    const auto number = verb == "press" && words >> word ? to_double(word) : std::nullopt;
    are_numbers = are_numbers && number;
    value = number.value_or(0.0);
  }
  const bool is_press = verb == "press" && are_numbers && values[2] >= 0.0;
  if (finger == fingertips_ || (!is_press && verb != "lift") || words >> rest) {
    return "give press SIDE X_mm Y_mm FORCE_N or lift SIDE; SIDE is left" +
           std::string(fingertips_ > 1 ? " or right" : "");
  }
  if (!obeys_) {
    return "no hand presses here; start fingertip simulate --mouse";
  }
  if (is_press) {
    hands_[finger] = {HandAt{std::clamp(values[0], -FARTHEST_mm, FARTHEST_mm),
                             std::clamp(values[1], -FARTHEST_mm, FARTHEST_mm), std::min(values[2], MOST_N)},
                      client};
  } else {
    hands_[finger] = {};
  }
  return "";
}

void HandServer::leave(int client) {
  for (Held &hand : hands_) {
    if (hand.by == client) {
      hand = {};
    }
  }
  close(client);
}

bool HandServer::is_due(std::int64_t host_us) {
  if (host_us - sent_us_ < TRUTH_EVERY_us) {
    return false;
  }
  sent_us_ = host_us;
  return true;
}

void HandServer::send(std::size_t finger, std::int64_t device_us, const TrueTouch &truth) {
  std::string line = "truth " + std::string(SIDES[finger]) + " " + std::to_string(device_us);
  for (const double value : {truth.x_mm, truth.y_mm, truth.force_N, truth.qx_N, truth.qy_N}) {
    line += " " + fixed(value, 4);
  }
  line += "\n";
  for (const auto &client : clients_) {
    put(client.first, line);
  }
}

} // namespace fingertip::cell
