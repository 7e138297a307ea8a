// On simulated time: two fingertips and a gripper on ports with an object between, for tests of the grasp:
//
//   fake_cell FOLDER       makes FOLDER/left, FOLDER/right, FOLDER/gripper, a 2F-85 that has been activated
//
// The object has 40 mm and does not yield; a pad has 2 N/mm. Each line of standard input is done and answered by the truth, "WIDTH FORCE":
// the width in mm and the force on either pad in N.
//
//   object MM | load N | slide 0|1 | unplug SIDE|gripper | plug SIDE | line none|silent | fault CODE | power 0|1 | truth
#include "simulation/cell/gripper_server.hpp"
#include "support/soft_fingertip.hpp"

using namespace fingertip;

constexpr double STIFFNESS_N_mm = 2;
constexpr int RATE_Hz = 200;
constexpr const char *MODEL = "2f85";

struct Object {
  std::atomic<double> width_mm{40}, load_N{0}, opening_mm{85};
  std::atomic<bool> slides{false};

  double force_N() const { return std::max(0.0, STIFFNESS_N_mm * (width_mm - opening_mm) / 2); }
  test::Feel feel() const {
    return {static_cast<float>(force_N()), static_cast<float>(load_N / 2), slides ? std::uint32_t{CONTACT_FLAG_SLIDING} : 0u};
  }
};

class CellGripper {
public:
  CellGripper(const std::string &link, Object &object)
      : motion_(GripperServer::mechanics(MODEL), 85), server_(std::in_place, motion_, GripperServer::Options{.model = MODEL, .link = link}),
        thread_([this, &object] {
          while (!ended_) {
            server_->step(std::chrono::milliseconds(1));
            object.opening_mm = motion_.width_mm();
          }
        }) {
    motion_.blocked_at = [&object](double width_mm, double force_N) {
      return force_N > 0 && STIFFNESS_N_mm * (object.width_mm - width_mm) / 2 >= force_N;
    };
  }
  ~CellGripper() { unplug(); }

  void unplug() {
    if (thread_.joinable()) {
      ended_ = true;
      thread_.join();
      server_.reset();
    }
  }
  GripperServer &server() { return *server_; }

private:
  GripperMotion motion_;
  std::optional<GripperServer> server_;
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
  if (argc != 2) {
    std::fprintf(stderr, "usage: fake_cell FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  Object object;
  CellGripper gripper(folder + "/gripper", object);
  const auto feel = [&object] { return object.feel(); };
  test::SoftFingertip left(folder + "/left", "AAAA", RATE_Hz, feel);
  test::SoftFingertip right(folder + "/right", "BBBB", RATE_Hz, feel);
  std::puts("ready");
  std::fflush(stdout);
  for (std::string text; next_line(&text);) {
    std::istringstream words(text);
    std::string verb, name;
    words >> verb >> name;
    const double number = std::atof(name.c_str());
    if (verb == "object") {
      object.width_mm = number;
    } else if (verb == "load") {
      object.load_N = number;
    } else if (verb == "slide") {
      object.slides = number != 0;
    } else if (verb == "fault") {
      gripper.server().fail(static_cast<std::uint8_t>(number));
    } else if (verb == "power") {
      gripper.server().power(number != 0);
    } else if (verb == "line") {
      gripper.server().trouble({.fault = name == "silent" ? LineFault::silent : LineFault::none});
    } else if (name == "gripper") {
      gripper.unplug();
    } else if (verb != "truth") {
      test::SoftFingertip &side = name == "left" ? left : right;
      verb == "unplug" ? side.unplug() : side.plug_in();
    }
    std::printf("%.3f %.3f\n", object.opening_mm.load(), object.force_N());
    std::fflush(stdout);
  }
  return 0;
}
