#include "web/server/http_server.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>

namespace fingertip {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds TO_ASK{10}, IDLE{30}, TO_TAKE{60}, TO_TAKE_SOME{10}, TO_LEAVE{2};
constexpr milliseconds LOOK_INTERVAL{50};
constexpr milliseconds GATHERS{8}; /* half a picture's time: a stream has fewer, larger pieces */
constexpr const char *FAULT = "no request, or one that is too large\n";
constexpr int BACKLOG = 4096, AT_ONCE = 64;
constexpr int SENT_AHEAD_BYTES = 65536; /* the kernel's memory for one that does not read; it doubles this */
constexpr unsigned ESTABLISHED = 1;     /* in the kernel's tables of connections */

static std::string small_letters(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(), [](unsigned char c) { return std::tolower(c); });
  return small;
}

/* 0, or the status of what is wrong. text: up to the empty line, without it. */
static int read_head(std::string_view text, HttpRequest *request, bool *stays) {
  std::vector<std::string_view> lines = split(text, '\n');
  for (std::string_view &line : lines) {
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
  }
  const std::vector<std::string_view> words = split(lines[0], ' ');
  if (words.size() != 3 || words[1].substr(0, 1) != "/") {
    return 400;
  }
  if (words[2] != "HTTP/1.1" && words[2] != "HTTP/1.0") {
    return 505;
  }
  const std::size_t question = words[1].find('?');
  request->method = words[0];
  request->path = words[1].substr(0, question);
  request->query = question == std::string_view::npos ? "" : words[1].substr(question + 1);
  for (std::size_t i = 1; i < lines.size(); i++) {
    const std::size_t colon = lines[i].find(':');
    const std::string name = small_letters(lines[i].substr(0, colon));
    /* Two lengths or hosts are two answers to who reads where the next request begins. */
    if (colon == std::string_view::npos || name.empty() || name.find_first_of(" \t") != std::string::npos ||
        !request->headers.emplace(name, trim(lines[i].substr(colon + 1))).second) {
      return 400;
    }
  }
  *stays = words[2] == "HTTP/1.1" && small_letters(request->header("connection")) != "close";
  return 0;
}

std::string HttpRequest::header(const std::string &name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? "" : found->second;
}

std::string HttpRequest::parameter(const std::string &name) const {
  for (const std::string_view pair : split(query, '&')) {
    if (pair.substr(0, pair.find('=')) == name && pair.size() > name.size()) {
      return std::string(pair.substr(name.size() + 1));
    }
  }
  return "";
}

bool HttpRequest::is_of_this_user() const {
  const auto port_of = [&](auto name) {
    sockaddr_storage address = {};
    socklen_t length = sizeof address;
    name(fd, reinterpret_cast<sockaddr *>(&address), &length);
    return ntohs(reinterpret_cast<const sockaddr_in &>(address).sin_port); /* an IPv6 address has it there, too */
  };
  const unsigned theirs = port_of(getpeername), ours = port_of(getsockname);
  bool found = false;
  for (const char *table : {"/proc/self/net/tcp", "/proc/self/net/tcp6"}) {
    std::ifstream lines(table);
    for (std::string line; std::getline(lines, line);) {
      unsigned local = 0, remote = 0, state = 0, user = 0;
      if (std::sscanf(line.c_str(), "%*s %*[^:]:%x %*[^:]:%x %x %*s %*s %*s %u", &local, &remote, &state, &user) == 4 && local == theirs &&
          remote == ours) {
        found = true;
        if (state != ESTABLISHED || (user != geteuid() && user != 0)) {
          return false;
        }
      }
    }
  }
  return found;
}

class HttpServer::Connection {
public:
  Connection(int fd, std::string peer) : fd_(fd), peer_(std::move(peer)) {
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &SENT_AHEAD_BYTES, sizeof SENT_AHEAD_BYTES);
  }
  ~Connection() { close(fd_); }
  Connection(const Connection &) = delete;
  Connection &operator=(const Connection &) = delete;

  const std::string &peer() const { return peer_; }
  /* How soon another may take its place; 0: never. */
  int is_replaced() const { return stream_ ? 0 : rest() > 0 ? 1 : 2; }

  void add_descriptors(std::vector<pollfd> &all) const {
    const bool sends = rest() > 0;
    all.push_back({fd_, static_cast<short>(sends ? POLLOUT : POLLIN), 0});
    if (stream_ && !sends) {
      const std::vector<pollfd> more = stream_->poll_descriptors();
      all.insert(all.end(), more.begin(), more.end());
    }
  }

  /* False: it is over. */
  bool step(const std::string &headers, const Handler &handler) {
    if (stream_ && rest() == 0) {
      out_.clear();
      sent_ = 0;
      until_ = host_now() + TO_TAKE_SOME;
      if (!stream_->read(&out_)) {
        stream_.reset();
        ends_ = true;
      }
    }
    if (rest() > 0 || ends_) {
      return send_rest();
    }
    return (in_.size() > HEAD_BYTES + BODY_BYTES /* that came ahead */ || receive()) && answer(headers, handler);
  }

private:
  std::size_t rest() const { return out_.size() + (file_ ? file_->size() : 0) - sent_; }

  /* What a stream's client sends has no meaning, and what comes after a fault goes nowhere: it is read away. */
  bool receive() {
    char bytes[16384];
    const ssize_t count = recv(fd_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count <= 0) {
      return count < 0 && (errno == EAGAIN || errno == EINTR) && host_now() < until_;
    }
    if (leaves_ || stream_) {
      return host_now() < until_;
    }
    if (in_.empty()) {
      until_ = host_now() + TO_ASK;
    }
    in_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }

  bool answer(const std::string &headers, const Handler &handler) {
    if (leaves_ || stream_) {
      return true;
    }
    const std::size_t end = std::min(in_.find("\r\n\r\n"), HEAD_BYTES + 1);
    if (end > HEAD_BYTES) {
      return in_.size() <= HEAD_BYTES ? host_now() < until_ : reply(HttpAnswer(431, FAULT), headers, false, true);
    }
    HttpRequest request;
    bool stays = false;
    int fault = read_head(std::string_view(in_).substr(0, end), &request, &stays);
    const auto length = to_u64(request.headers.count("content-length") ? request.header("content-length") : "0");
    if (fault == 0) {
      fault = request.headers.count("transfer-encoding") ? 411 : !length ? 400 : *length > BODY_BYTES ? 413 : 0;
    }
    if (fault != 0) {
      return reply(HttpAnswer(fault, FAULT), headers, false, true);
    }
    const std::size_t whole = end + 4 + *length;
    if (in_.size() < whole) {
      return host_now() < until_;
    }
    request.body = in_.substr(end + 4, *length);
    request.fd = fd_;
    in_.erase(0, whole);
    HttpAnswer found(500, "the server could not answer; it has printed why\n");
    try {
      found = handler(request);
    } catch (const std::exception &error) {
      std::fprintf(stderr, "fingertip: %s: %s\n", printable(request.path).c_str(), printable(error.what()).c_str());
    }
    return reply(std::move(found), headers, request.method == "HEAD", !stays);
  }

  bool reply(HttpAnswer answer, const std::string &headers, bool only_head, bool ends) {
    ends = ends || answer.stream;
    const std::size_t length = answer.file ? answer.file->size() : answer.text.size();
    out_ = "HTTP/1.1 " + std::to_string(answer.status) + " \r\n" + headers + answer.header + "Content-Type: " + answer.type + "\r\n" +
           (answer.stream ? "" : "Content-Length: " + std::to_string(length) + "\r\n") + (ends ? "Connection: close\r\n\r\n" : "\r\n") +
           (only_head || answer.file ? "" : answer.text);
    file_ = only_head ? nullptr : answer.file;
    stream_ = only_head ? nullptr : std::move(answer.stream);
    ends_ = ends && !stream_;
    until_ = host_now() + TO_TAKE;
    return send_rest();
  }

  bool send_rest() {
    while (rest() > 0) {
      const std::string &from = sent_ < out_.size() ? out_ : *file_;
      const std::size_t at = sent_ < out_.size() ? sent_ : sent_ - out_.size();
      const ssize_t count = send(fd_, from.data() + at, from.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0) {
        return (errno == EAGAIN || errno == EINTR) && host_now() < until_;
      }
      sent_ += static_cast<std::size_t>(count);
      until_ = host_now() + (stream_ ? TO_TAKE_SOME : TO_TAKE);
    }
    out_.clear();
    file_ = nullptr;
    sent_ = 0;
    if (ends_) {
      /* Closed at once, an answer would be lost with what the peer still sends. */
      shutdown(fd_, SHUT_WR);
      ends_ = false;
      leaves_ = true;
      in_.clear();
    }
    until_ = host_now() + (leaves_ ? TO_LEAVE : IDLE);
    return true;
  }

  int fd_;
  std::string peer_, in_, out_;
  const std::string *file_ = nullptr;
  std::size_t sent_ = 0; /* of out_, then of the file */
  std::unique_ptr<HttpAnswer::Stream> stream_;
  bool ends_ = false;   /* once all is sent */
  bool leaves_ = false; /* all is sent; until the peer closes too */
  HostTime until_ = host_now() + TO_ASK;
};

HttpServer::HttpServer(const std::string &address, unsigned port, std::string headers) : headers_(std::move(headers)) {
  addrinfo hints = {}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  if (getaddrinfo(address.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) {
    throw std::system_error(std::make_error_code(std::errc::address_not_available));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
  const int yes = 1;
  sockaddr_storage bound = {};
  socklen_t length = sizeof bound;
  listening_ = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listening_ < 0 || setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(listening_, found->ai_addr, found->ai_addrlen) != 0 || listen(listening_, BACKLOG) != 0 ||
      getsockname(listening_, reinterpret_cast<sockaddr *>(&bound), &length) != 0) {
    const int error = errno;
    close(listening_);
    throw std::system_error(error, std::generic_category());
  }
  port_ = ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6 &>(bound).sin6_port
                                            : reinterpret_cast<const sockaddr_in &>(bound).sin_port);
}

HttpServer::~HttpServer() { close(listening_); }

void HttpServer::accept_all() {
  for (int n = 0; n < AT_ONCE; n++) {
    sockaddr_storage address = {};
    socklen_t length = sizeof address;
    const int fd = accept4(listening_, reinterpret_cast<sockaddr *>(&address), &length, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
      return;
    }
    char peer[NI_MAXHOST] = "";
    getnameinfo(reinterpret_cast<const sockaddr *>(&address), length, peer, sizeof peer, nullptr, 0, NI_NUMERICHOST);
    const auto of_peer = [&](const Connection &each) { return each.peer() == peer; };
    const bool too_many = std::count_if(connections_.begin(), connections_.end(), of_peer) >= static_cast<std::ptrdiff_t>(MOST_OF_A_PEER);
    if (too_many || connections_.size() >= MOST_CONNECTIONS) {
      const auto oldest = std::max_element(connections_.begin(), connections_.end(), [&](const auto &a, const auto &b) {
        const auto rank = [&](const Connection &one) { return too_many && !of_peer(one) ? 0 : one.is_replaced(); };
        return rank(a) < rank(b);
      });
      if (oldest->is_replaced() == 0 || (too_many && !of_peer(*oldest))) {
        close(fd);
        continue;
      }
      connections_.erase(oldest);
    }
    connections_.emplace_back(fd, peer);
  }
}

void HttpServer::serve(const Handler &handler, const std::function<bool()> &is_over) {
  while (!is_over()) {
    std::vector<pollfd> all{{listening_, POLLIN, 0}};
    for (const Connection &each : connections_) {
      each.add_descriptors(all);
    }
    wait_for(all.data(), all.size(), host_now() + LOOK_INTERVAL);
    if (all.size() > connections_.size() + 1) {
      wait_until(host_now() + GATHERS);
    }
    connections_.remove_if([&](Connection &each) { return !each.step(headers_, handler); });
    accept_all();
  }
}

} // namespace fingertip
