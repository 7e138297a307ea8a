// On simulated time: two fingertips and a gripper on ports with an object between, for tests of the grasp:
//
//   fake_cell FOLDER [key=value]...       makes FOLDER/left, FOLDER/right, FOLDER/gripper
//     model=2f85 object=40 stiffness=2 rate=200 active=1
//
// object: its width in mm, which does not yield; stiffness: of either pad, N/mm; active: the gripper has been activated. Then each line of
// standard input is done and answered by the truth, "WIDTH FORCE": the width in mm and the force on either pad in N.
//
//   object MM | load N | slide 0|1 | over 0|1 | stall SIDE 0|1 | freeze SIDE 0|1
//   unplug SIDE|gripper | plug SIDE|gripper | line none|silent|garbage | fault CODE | power 0|1 |
//   truth
#include "simulation/cell/gripper_server.hpp"
#include "support/soft_fingertip.hpp"

#include <map>

using namespace fingertip;

struct Object {
  std::atomic<double> width_mm{40}, load_N{0}, stiffness_N_mm{2};
  std::atomic<bool> slides{false}, over{false};
  std::atomic<double> opening_mm{85};

  double force_N() const { return std::max(0.0, stiffness_N_mm * (width_mm - opening_mm) / 2); }
  test::Feel feel() const {
    test::Feel feel;
    feel.force_N = static_cast<float>(force_N());
    feel.qy_N = static_cast<float>(load_N / 2);
    feel.flags = (slides ? std::uint32_t{CONTACT_FLAG_SLIDING} : 0u) | (over ? std::uint32_t{CONTACT_FLAG_FORCE_LOWER_BOUND} : 0u);
    return feel;
  }
};

class CellGripper {
public:
  CellGripper(std::string link, const std::string &model, bool active, Object &object)
      : link_(std::move(link)), model_(model), object_(object), motion_(GripperServer::mechanics(model)) {
    motion_.blocked_at = [&object](double width_mm, double force_N) {
      return force_N > 0 && object.stiffness_N_mm * (object.width_mm - width_mm) / 2 >= force_N;
    };
    plug_in();
    if (active) {
      GripperWay way;
      way.model = model;
      way.port = link_;
      const auto gripper = open_gripper(way);
      gripper->activate();
      while (!gripper->poll().active) {
      }
    }
  }
  ~CellGripper() { unplug(); }

  void plug_in() {
    if (thread_.joinable()) {
      return;
    }
    GripperServer::Options options;
    options.model = model_;
    options.real_time = false;
    options.link = link_;
    server_ = std::make_unique<GripperServer>(motion_, options);
    ended_ = false;
    thread_ = Thread([this] {
      std::int64_t stepped_us = steady_now_us();
      while (!ended_) {
        server_->step(std::chrono::milliseconds(1));
        for (const std::int64_t now_us = steady_now_us(); stepped_us < now_us; stepped_us += STEP_us) {
          motion_.step(1e-6 * STEP_us);
        }
        object_.opening_mm = motion_.width_mm();
      }
    });
  }
  void unplug() {
    if (thread_.joinable()) {
      ended_ = true;
      thread_.join();
      server_.reset();
    }
  }
  void line(const std::string &fault) {
    LineTrouble trouble;
    trouble.fault = fault == "silent" ? LineFault::silent : fault == "garbage" ? LineFault::garbage : LineFault::none;
    server_->trouble(trouble);
  }
  void power(bool on) { server_->power(on); }
  void fail(int fault) { server_->fail(static_cast<std::uint8_t>(fault)); }

private:
  static constexpr std::int64_t STEP_us = 500;

  std::string link_, model_;
  Object &object_;
  GripperMotion motion_;
  std::unique_ptr<GripperServer> server_;
  std::atomic<bool> ended_{false};
  Thread thread_;
};

// Of standard input, which is waited for as for everything else in this world.
static bool next_line(std::string *line) {
  static std::string came;
  for (;;) {
    const std::size_t end = came.find('\n');
    if (end != std::string::npos) {
      *line = came.substr(0, end);
      came.erase(0, end + 1);
      return true;
    }
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    char bytes[1024];
    ssize_t count = 1;
    if (wait_for(&input, 1, HostTime::max()) > 0) {
      count = read(STDIN_FILENO, bytes, sizeof bytes);
      came.append(bytes, static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    }
    if (count <= 0) {
      return false;
    }
  }
}

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: fake_cell FOLDER [key=value]...\n");
    return 2;
  }
  std::map<std::string, std::string> options = {{"model", "2f85"}, {"object", "40"}, {"stiffness", "2"}, {"rate", "200"}, {"active", "1"}};
  for (int i = 2; i < argc; i++) {
    const std::string text = argv[i];
    options[text.substr(0, text.find('='))] = text.substr(text.find('=') + 1);
  }
  const std::string folder = argv[1];
  Object object;
  object.width_mm = std::stod(options["object"]);
  object.stiffness_N_mm = std::stod(options["stiffness"]);
  CellGripper gripper(folder + "/gripper", options["model"], options["active"] == "1", object);
  const auto feel = [&object] { return object.feel(); };
  const int rate_Hz = std::stoi(options["rate"]);
  test::SoftFingertip left(folder + "/left", "AAAA", rate_Hz, feel);
  test::SoftFingertip right(folder + "/right", "BBBB", rate_Hz, feel);
  std::puts("ready");
  std::fflush(stdout);
  for (std::string text; next_line(&text);) {
    std::istringstream words(text);
    std::string verb, name;
    words >> verb;
    const auto side = [&]() -> test::SoftFingertip & { return name == "left" ? left : right; };
    const auto number = [&] {
      double value = 0;
      words >> value;
      return value;
    };
    if (verb == "object") {
      object.width_mm = number();
    } else if (verb == "load") {
      object.load_N = number();
    } else if (verb == "slide") {
      object.slides = number() != 0;
    } else if (verb == "over") {
      object.over = number() != 0;
    } else if (verb == "fault") {
      gripper.fail(static_cast<int>(number()));
    } else if (verb == "power") {
      gripper.power(number() != 0);
    } else if (verb != "truth") {
      words >> name;
      if (verb == "stall") {
        side().stalled = number() != 0;
      } else if (verb == "freeze") {
        side().frozen = number() != 0;
      } else if (verb == "line") {
        gripper.line(name);
      } else if (name == "gripper") {
        verb == "unplug" ? gripper.unplug() : gripper.plug_in();
      } else {
        verb == "unplug" ? side().unplug() : side().plug_in();
      }
    }
    std::printf("%.3f %.3f\n", object.opening_mm.load(), object.force_N());
    std::fflush(stdout);
  }
  return 0;
}
