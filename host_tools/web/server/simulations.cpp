#include "web/server/simulations.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"

#include <cstring>
#include <filesystem>
#include <optional>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

constexpr const char *SIDES[] = {"left", "right"}; /* ports, as `fingertip simulate` names them */
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

HttpAnswer refusal(int status, const std::string &why) { return HttpAnswer(status, why + "\n"); }

HttpAnswer json(const std::string &text) { return HttpAnswer(200, text, "application/json"); }

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
  Session(const Simulated &one) : side_(one.side), line_(one.socket), truth_(connect_unix(simulated_folder() + "/truth")) {}
  ~Session() { close(truth_); }

  std::vector<pollfd> poll_descriptors() const { return line_.poll_descriptors(); }
  /* False: the fingertip is gone. */
  bool read(std::string *bytes) {
    std::uint8_t some[65536];
    std::size_t length = 0;
    const auto result = line_.read(some, sizeof some, &length, std::chrono::milliseconds(0));
    bytes->append(reinterpret_cast<const char *>(some), length);
    return result != Transport::Result::gone;
  }
  bool send(const std::string &bytes) { return line_.write(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size()); }
  const std::string &side() const { return side_; }
  /* What is true now (simulation/cell/hand_server.hpp), as JSON; or why the command cannot be. */
  std::string send_to_hand(const std::string &command, std::string *why_not) {
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
      const auto member = [&](const char *name, std::size_t i) { return "\"" + std::string(name) + "\": " + std::string(words[i]); };
      newest_ = "{" + member("t_us", 2) + ", " + member("x_mm", 3) + ", " + member("y_mm", 4) + ", " + member("force_N", 5) + ", " +
                member("qx_N", 6) + ", " + member("qy_N", 7) + "}";
    }
  }

  const std::string side_;
  SocketTransport line_;
  int truth_;
  std::string came_, newest_ = "{}";
};

/* Takes the session away when its client has gone. */
class Simulations::Line : public HttpAnswer::Stream {
public:
  Line(Simulations &of, std::string client) : of_(of), client_(std::move(client)) {}
  ~Line() override { of_.sessions_.erase(client_); }
  std::vector<pollfd> poll_descriptors() const override { return of_.sessions_.at(client_)->poll_descriptors(); }
  bool read(std::string *bytes) override { return of_.sessions_.at(client_)->read(bytes); }

private:
  Simulations &of_;
  std::string client_;
};

bool Simulations::is_for(const std::string &path) { return path == PATH || path.rfind(std::string(PATH) + "/", 0) == 0; }

bool Simulations::is_from_page(const HttpRequest &request) {
  const std::string site = request.header("sec-fetch-site");
  const std::string origin = request.header("origin");
  return (site.empty() || site == "same-origin" || site == "none") && (origin.empty() || origin == "http://" + request.header("host"));
}

HttpAnswer Simulations::answer(const HttpRequest &request) {
  const std::string what = request.path.substr(std::strlen(PATH));
  if (request.method == "GET" && what.empty()) {
    std::error_code none;
    const std::string hand = fs::exists(simulated_folder() + "/hand", none) ? "true" : "false";
    return json("[" +
                joined(find_simulated(), ", ",
                       [&](const Simulated &one) { return R"({"serial": ")" + one.serial + R"(", "hand": )" + hand + "}"; }) +
                "]");
  }
  if (request.method == "GET" && what == "/line") {
    return open_line(request);
  }
  if (request.method != "POST" || (what != "/line" && what != "/hand")) {
    return refusal(NOT_FOUND, "there is nothing of this name");
  }
  const auto found = sessions_.find(request.parameter("client"));
  if (request.body.size() > MOST_COMMAND_BYTES) {
    return refusal(BAD_REQUEST, "more than a fingertip takes at once");
  }
  if (found == sessions_.end()) {
    return refusal(NOT_FOUND, "this client has no line; open one first");
  }
  Session &session = *found->second;
  if (what == "/line") {
    return session.send(request.body) ? HttpAnswer{} : refusal(UNAVAILABLE, "the fingertip takes no more commands");
  }
  const auto command = request.body.empty() ? std::string() : command_of(request.body, session.side());
  if (!command) {
    return refusal(BAD_REQUEST, "give press X_mm Y_mm FORCE_N, lift, or nothing");
  }
  std::string why_not;
  const std::string truth = session.send_to_hand(*command, &why_not);
  return why_not.empty() ? json(truth) : refusal(CONFLICT, why_not);
}

HttpAnswer Simulations::open_line(const HttpRequest &request) {
  const std::string client = request.parameter("client");
  if (!is_client(client)) {
    return refusal(BAD_REQUEST, "client: give 8 to 32 hexadecimal digits");
  }
  const std::vector<Simulated> all = find_simulated();
  const Simulated *one = find_in(all, [&](const Simulated &each) { return each.serial == request.parameter("serial"); });
  if (!one) {
    return refusal(NOT_FOUND, "no simulated fingertip has this serial number; start fingertip simulate");
  }
  if (sessions_.size() >= MOST_LINES) {
    return refusal(UNAVAILABLE, "too many lines are open; close other pages");
  }
  if (sessions_.count(client)) {
    return refusal(CONFLICT, "this client has a line already");
  }
  try {
    sessions_.emplace(client, std::make_shared<Session>(*one));
  } catch (const Error &error) {
    return refusal(UNAVAILABLE, error.what());
  }
  HttpAnswer answer;
  answer.type = "application/octet-stream";
  answer.stream = std::make_unique<Line>(*this, client);
  return answer;
}

} // namespace fingertip
