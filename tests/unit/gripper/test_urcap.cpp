#include "grasp/gripper/robotiq_urcap.hpp"
#include "models.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <cmath>
#include <map>
#include <sstream>
#include <sys/socket.h>
#include <thread>

using namespace fingertip;
using test::code_of;

namespace {

// real time: a socket of this machine. The variables of a URCap, and what it answers instead.
class Server {
public:
  Server() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener_.get(), reinterpret_cast<sockaddr *>(&address), size), 0);
    EXPECT_EQ(listen(listener_.get(), 4), 0);
    getsockname(listener_.get(), reinterpret_cast<sockaddr *>(&address), &size);
    port = "ur:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this] { serve(); });
  }
  ~Server() {
    shutdown(listener_.get(), SHUT_RDWR);
    thread_.join();
  }

  std::string port;
  std::map<std::string, int> values{{"STA", 3}, {"GTO", 0}, {"OBJ", 0}, {"POS", 3}, {"PRE", 3}, {"FLT", 0}, {"ACT", 1}};
  std::string last;                           // SET
  std::map<std::string, std::string> instead; // of the answer to this line; "-": none, and the connection ends; |: two pieces
  std::atomic<int> connections = 0;

private:
  void serve() {
    for (int fd; (fd = accept(listener_.get(), nullptr, nullptr)) >= 0;) {
      const Descriptor line(fd);
      connections++;
      char bytes[256];
      std::string late;
      for (ssize_t count; (count = recv(fd, bytes, sizeof bytes, 0)) > 0;) {
        const std::string answer = answer_to(std::string(bytes, static_cast<std::size_t>(count) - 1)), first = late + answer;
        late = answer.empty() ? "POS 9\n" : "";
        if (answer == "-") {
          break;
        }
        const std::size_t piece = first.find('|');
        send(fd, first.data(), std::min(piece, first.size()), MSG_NOSIGNAL);
        if (piece != std::string::npos) {
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
          send(fd, first.data() + piece + 1, first.size() - piece - 1, MSG_NOSIGNAL);
        }
      }
    }
  }
  std::string answer_to(const std::string &line) {
    if (const auto found = instead.find(line); found != instead.end()) {
      return found->second;
    }
    std::istringstream words(line);
    std::string verb, name;
    words >> verb >> name;
    if (verb == "GET") { // the gripper follows the controller later
      values["STA"] = name != "STA" || values["ACT"] == 1 || late_-- > 0 ? values["STA"] : 0;
      values["PRE"] = values["POS"] = name != "PRE" || late_-- > 0 ? values["PRE"] : request_;
      return name + " " + std::to_string(values.at(name)) + "\n";
    }
    late_ = line == last ? late_ : 2;
    last = line;
    for (int value; words >> value; words >> name) {
      (name == "POS" ? request_ : values[name]) = value;
    }
    values["STA"] = line != "SET ACT 1" ? values["STA"] : values["STA"] == 0 ? 3 : 1; // 1: it has seen no reset
    return "ack";
  }

  int request_ = 3, late_ = 0;
  Descriptor listener_{socket(AF_INET, SOCK_STREAM, 0)};
  std::thread thread_;
};

} // namespace

TEST(Urcap, MovesAndReports) {
  Server server;
  server.values["GTO"] = 1;
  const auto gripper = open_gripper({.model = "2f85", .port = server.port, .timeout_s = 5.0});
  gripper->activate();
  EXPECT_EQ(server.last, "SET ACT 1");
  EXPECT_EQ(server.values["GTO"], 0);
  server.values["OBJ"] = 2;
  server.values["FLT"] = 8;
  server.instead = {{"GET GTO", "GT|O 1\n"}};
  GripperStatus status = gripper->move({.width_mm = 42.5, .speed_mm_s = 150, .force_N = 20});
  EXPECT_EQ(server.last, "SET POS 117 SPE 255 FOR 0 GTO 1");
  EXPECT_TRUE(status.active && status.moving && std::isnan(status.current_A)); // whatever OBJ says of the move before
  gripper->poll();
  status = gripper->poll();
  EXPECT_NEAR(status.width_mm, 42.5, 0.2);
  EXPECT_FALSE(status.moving);
  EXPECT_EQ(status.object, true);
  EXPECT_EQ(gripper->fault_text(status.fault), "too hot, it must cool down");
  server.instead = {{"GET STA", "STA 0\n"}};
  EXPECT_FALSE(gripper->poll().active);
  EXPECT_FALSE(gripper->move({.width_mm = 0, .speed_mm_s = 150, .force_N = 20}).active);
  EXPECT_EQ(server.last, "SET POS 117 SPE 255 FOR 0 GTO 1"); // and sends nothing
}

TEST(Urcap, WhatIsNoAnswerIsAnErrorAndItConnectsAgain) {
  Server server;
  const auto gripper = open_gripper({.model = "hande", .port = server.port, .timeout_s = 1.0});
  for (const auto &[answer, code] : {std::pair("POS x\n", ErrorCode::gripper_garbled),
                                     {"OBJ 3", ErrorCode::gripper_garbled},
                                     {"POS 999", ErrorCode::gripper_garbled},
                                     {"", ErrorCode::gripper_silent},
                                     {"-", ErrorCode::gripper_silent}}) {
    const int before = server.connections;
    server.instead = {{"GET POS", answer}};
    EXPECT_EQ(code_of([&] { gripper->poll(); }), code) << answer;
    server.instead.clear();
    EXPECT_EQ(gripper->poll().width_mm, 50.0);
    EXPECT_EQ(server.connections, before + 1) << answer;
  }
  const int before = server.connections;
  server.instead = {{"SET ACT 0 GTO 0 ATR 0", "nak\n"}};
  EXPECT_EQ(code_of([&] { gripper->activate(); }), ErrorCode::gripper_refused);
  gripper->poll();
  EXPECT_EQ(server.connections, before + 1);
}

TEST(Urcap, WhatCannotBeOpened) {
  std::string port;
  {
    Server server;
    port = server.port;
    server.instead = {{"GET STA", ""}};
    EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = port, .timeout_s = 0.005}); }), ErrorCode::gripper_silent);
    EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = port, .slave = 9}); }), ErrorCode::bad_value);
  }
  EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = port}); }), ErrorCode::gripper_silent);
  EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = "ur:127.0.0.1:none"}); }), ErrorCode::no_port);
}
