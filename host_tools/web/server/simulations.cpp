#include "web/server/simulations.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"

#include <cstring>
#include <filesystem>
#include <httplib.h>
#include <optional>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

constexpr const char *PATH = "/simulated";
constexpr const char *SIDES[] = {"left", "right"}; /* ports, as `fingertip simulate` names them */
constexpr std::chrono::milliseconds LOOK_INTERVAL{100};
constexpr std::chrono::milliseconds GATHERS{8}; /* half a picture's time: fewer, larger pieces */
constexpr std::size_t MOST_COMMAND_BYTES = 4096, LONGEST_TRUTH = 4096;
enum { BAD_REQUEST = 400, NOT_FOUND = 404, CONFLICT = 409, UNAVAILABLE = 503 };

struct Simulated {
  std::string serial, side, socket;
};

std::vector<Simulated> find_simulated() {
  std::vector<Simulated> all;
  for (const Shared &shared : find_shared()) {
    for (const char *side : SIDES) {
      std::error_code none;
      const fs::path port = fs::canonical(simulated_folder() + "/" + side, none);
      if (!port.empty() && port == shared.port) {
        all.push_back({shared.serial, side, shared.socket});
      }
    }
  }
  return all;
}

/* Of what is true there (simulation/cell/hand_server.hpp); -1: there is none. */
int connect_to_truth() {
  const std::string path = simulated_folder() + "/truth";
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd >= 0 && path.size() < sizeof address.sun_path) {
    std::memcpy(address.sun_path, path.data(), path.size());
    if (connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0) {
      return fd;
    }
  }
  close(fd);
  return -1;
}

void refuse(httplib::Response &response, int status, const std::string &why) {
  response.status = status;
  response.set_content(why + "\n", "text/plain; charset=utf-8");
}

bool is_client(const std::string &text) {
  return text.size() >= 8 && text.size() <= 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/* "press 1 2 3" of the page for this side; none: it is neither that nor "lift". */
std::optional<std::string> command_of(const std::string &body, const std::string &side) {
  const std::vector<std::string_view> words = split(body, ' ');
  if (words.size() == 1 && words[0] == "lift") {
    return "lift " + side + "\n";
  }
  if (words.size() != 4 || words[0] != "press") {
    return std::nullopt;
  }
  std::string command = "press " + side;
  for (std::size_t i = 1; i < words.size(); i++) {
    const auto value = to_double(words[i]);
    if (!value) {
      return std::nullopt;
    }
    command += " " + fixed(*value, 3);
  }
  return command + "\n";
}

} // namespace

/* A client's line, and its hand. */
class Simulations::Session {
public:
  Session(const Simulated &one) : side_(one.side), line_(one.socket), truth_(connect_to_truth()) {}
  ~Session() { close(truth_); }

  /* Waits a moment; false: the sink is gone. Ends the sink where the fingertip is. */
  bool pass_on(httplib::DataSink &sink) {
    std::vector<pollfd> descriptors;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      descriptors = line_.poll_descriptors();
    }
    if (wait_for(descriptors.data(), descriptors.size(), host_now() + LOOK_INTERVAL) > 0) {
      wait_until(host_now() + GATHERS);
    }
    std::uint8_t bytes[65536];
    std::size_t length = 0;
    Transport::Result result;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      result = line_.read(bytes, sizeof bytes, &length, std::chrono::milliseconds(0));
    }
    if (result == Transport::Result::timeout) {
      return sink.is_writable();
    }
    if (result == Transport::Result::gone) {
      sink.done();
      return true;
    }
    return sink.write(reinterpret_cast<const char *>(bytes), length);
  }
  bool send(const std::string &bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return line_.write(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size());
  }
  const std::string &side() const { return side_; }
  /* What is true now, as JSON; or why the command cannot be. */
  std::string send_to_hand(const std::string &command, std::string *why_not) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!command.empty()) {
      (void)!::send(truth_, command.data(), command.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    char bytes[65536];
    for (ssize_t count; (count = recv(truth_, bytes, sizeof bytes, 0)) > 0;) {
      came_.append(bytes, static_cast<std::size_t>(count));
      for (std::size_t end; (end = came_.find('\n')) != std::string::npos;) {
        take(came_.substr(0, end), why_not);
        came_.erase(0, end + 1);
      }
      if (came_.size() > LONGEST_TRUTH) {
        came_.clear();
      }
    }
    return newest_;
  }

private:
  void take(const std::string &line, std::string *why_not) {
    const std::vector<std::string_view> words = split(line, ' ');
    if (words[0] == "error") {
      *why_not = line.substr(words[0].size() + 1);
    } else if (words.size() == 8 && words[0] == "truth" && words[1] == side_) {
      for (std::size_t i = 2; i < words.size(); i++) {
        if (!to_double(words[i])) {
          return;
        }
      }
      const auto member = [&](const char *name, std::size_t i) {
        return "\"" + std::string(name) + "\": " + std::string(words[i]);
      };
      newest_ = "{" + member("t_us", 2) + ", " + member("x_mm", 3) + ", " + member("y_mm", 4) + ", " +
                member("force_N", 5) + ", " + member("qx_N", 6) + ", " + member("qy_N", 7) + "}";
    }
  }

  std::mutex mutex_;
  const std::string side_;
  SocketTransport line_;
  int truth_;
  std::string came_, newest_ = "{}";
};

Simulations::Simulations() = default;
Simulations::~Simulations() = default;

bool Simulations::is_for(const std::string &path) {
  return path == PATH || path.rfind(std::string(PATH) + "/", 0) == 0;
}

bool Simulations::is_from_page(const httplib::Request &request) {
  const std::string site = request.get_header_value("Sec-Fetch-Site");
  const std::string origin = request.get_header_value("Origin");
  return (site.empty() || site == "same-origin" || site == "none") &&
         (origin.empty() || origin == "http://" + request.get_header_value("Host"));
}

void Simulations::serve(httplib::Server &server) {
  server.Get(PATH, [](const httplib::Request &, httplib::Response &response) {
    std::error_code none;
    const bool hand = fs::exists(simulated_folder() + "/hand", none);
    std::string list;
    for (const Simulated &one : find_simulated()) {
      list += std::string(list.empty() ? "" : ", ") + "{\"serial\": \"" + one.serial +
              "\", \"hand\": " + (hand ? "true" : "false") + "}";
    }
    response.set_content("[" + list + "]", "application/json");
  });
  const std::string line = std::string(PATH) + "/line";
  server.Get(line,
             [this](const httplib::Request &request, httplib::Response &response) { open_line(request, response); });
  server.Post(line, [this](const httplib::Request &request, httplib::Response &response) {
    if (request.body.size() > MOST_COMMAND_BYTES) {
      return refuse(response, BAD_REQUEST, "more than a fingertip takes at once");
    }
    if (const auto to = session(request, response); to && !to->send(request.body)) {
      refuse(response, UNAVAILABLE, "the fingertip takes no more commands");
    }
  });
  server.Post(std::string(PATH) + "/hand",
              [this](const httplib::Request &request, httplib::Response &response) { hand(request, response); });
}

void Simulations::open_line(const httplib::Request &request, httplib::Response &response) {
  const std::string client = request.get_param_value("client");
  const std::string serial = request.get_param_value("serial");
  if (!is_client(client)) {
    return refuse(response, BAD_REQUEST, "client: give 8 to 32 hexadecimal digits");
  }
  for (const Simulated &one : find_simulated()) {
    if (one.serial != serial) {
      continue;
    }
    std::shared_ptr<Session> session;
    try {
      session = std::make_shared<Session>(one);
    } catch (const Error &error) {
      return refuse(response, UNAVAILABLE, error.what());
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (sessions_.size() >= MOST_LINES) {
        return refuse(response, UNAVAILABLE, "too many lines are open; close other pages");
      }
      if (!sessions_.emplace(client, session).second) {
        return refuse(response, CONFLICT, "this client has a line already");
      }
    }
    response.set_chunked_content_provider(
        "application/octet-stream", [session](std::size_t, httplib::DataSink &sink) { return session->pass_on(sink); },
        [this, client](bool) {
          const std::lock_guard<std::mutex> lock(mutex_);
          sessions_.erase(client);
        });
    return;
  }
  refuse(response, NOT_FOUND, "no simulated fingertip has this serial number; start fingertip simulate");
}

std::shared_ptr<Simulations::Session> Simulations::session(const httplib::Request &request,
                                                           httplib::Response &response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = sessions_.find(request.get_param_value("client"));
  if (found == sessions_.end()) {
    refuse(response, NOT_FOUND, "this client has no line; open one first");
    return nullptr;
  }
  return found->second;
}

void Simulations::hand(const httplib::Request &request, httplib::Response &response) {
  const auto of = session(request, response);
  if (!of) {
    return;
  }
  const auto command = request.body.empty() ? std::string() : command_of(request.body, of->side());
  if (!command) {
    return refuse(response, BAD_REQUEST, "give press X_mm Y_mm FORCE_N, lift, or nothing");
  }
  std::string why_not;
  const std::string truth = of->send_to_hand(*command, &why_not);
  if (!why_not.empty()) {
    return refuse(response, CONFLICT, why_not);
  }
  response.set_content(truth, "application/json");
}

} // namespace fingertip
