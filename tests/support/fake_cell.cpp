// Two fingertips and a gripper on pseudo-terminals with an object between, for tests of the grasp:
//
//   fake_cell FOLDER [key=value]...       makes FOLDER/left, FOLDER/right, FOLDER/gripper
//     model=2f85 object=40 stiffness=2 rate=200 active=1
//
// object: its width in mm, which does not yield; stiffness: of either pad, N/mm; active: the
// gripper has been activated. Then each line of standard input is done and answered by the truth,
// "WIDTH FORCE": the width in mm and the force on either pad in N.
//
//   object MM | load N | slide 0|1 | over 0|1 | stall SIDE 0|1 | freeze SIDE 0|1
//   unplug SIDE|gripper | plug SIDE|gripper | line none|silent|garbage | fault CODE | truth
#include "cell/gripper_server.hpp"
#include "support/soft_fingertip.hpp"

#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <sstream>

using namespace fingertip;

namespace {

struct Object {
  std::atomic<double> width_mm{40}, load_N{0}, stiffness_N_mm{2};
  std::atomic<bool> slides{false}, over{false};
  std::atomic<double> opening_mm{85};

  double force_N() const { return std::max(0.0, stiffness_N_mm * (width_mm - opening_mm) / 2); }
  test::Feel feel() const {
    test::Feel feel;
    feel.force_N = static_cast<float>(force_N());
    feel.qy_N = static_cast<float>(load_N / 2);
    feel.flags = (slides ? std::uint32_t{CONTACT_FLAG_SLIDING} : 0u) |
                 (over ? std::uint32_t{CONTACT_FLAG_FORCE_LOWER_BOUND} : 0u);
    return feel;
  }
};

class CellGripper {
public:
  CellGripper(std::string link, const std::string &model, bool active, Object &object)
      : link_(std::move(link)), model_(model), object_(object),
        motion_(GripperServer::mechanics(model)) {
    motion_.blocked_at = [&object](double width_mm, double force_N) {
      return force_N > 0 && object.stiffness_N_mm * (object.width_mm - width_mm) / 2 >= force_N;
    };
    plug_in();
    if (active) {
      hurry_ = 50; // nobody waits seconds for it
      GripperWay way;
      way.model = model;
      way.port = link_;
      for (bool done = false; !done;) {
        try {
          const auto gripper = open_gripper(way);
          gripper->activate();
          while (!gripper->poll().active) {
          }
          done = true;
        } catch (const Error &) { // this machine is slow
        }
      }
      hurry_ = 1;
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
    server_ = std::make_unique<GripperServer>(motion_, options);
    std::filesystem::remove(link_);
    std::filesystem::create_symlink(server_->port(), link_);
    ended_ = false;
    thread_ = std::thread([this] {
      std::int64_t stepped_us = steady_now_us();
      while (!ended_) {
        {
          std::lock_guard lock(mutex_);
          server_->step(std::chrono::milliseconds(1));
          const std::int64_t now_us = steady_now_us();
          // On a machine that gives this thread no time, time stands still for the fingers too.
          for (stepped_us = std::max(stepped_us, now_us - 10000); stepped_us < now_us;
               stepped_us += 500) {
            motion_.step(500e-6 * hurry_);
          }
          object_.opening_mm = motion_.width_mm();
        }
        std::this_thread::sleep_for(std::chrono::microseconds(100)); // for whoever wants the lock
      }
    });
  }
  void unplug() {
    if (thread_.joinable()) {
      ended_ = true;
      thread_.join();
      std::filesystem::remove(link_);
      server_.reset();
    }
  }
  void line(const std::string &fault) {
    std::lock_guard lock(mutex_);
    LineTrouble trouble;
    trouble.fault = fault == "silent"    ? LineFault::silent
                    : fault == "garbage" ? LineFault::garbage
                                         : LineFault::none;
    server_->trouble(trouble);
  }
  void fail(int fault) {
    std::lock_guard lock(mutex_);
    server_->fail(static_cast<std::uint8_t>(fault));
  }

private:
  std::string link_, model_;
  Object &object_;
  GripperMotion motion_;
  std::unique_ptr<GripperServer> server_;
  std::mutex mutex_; // of the server, and the motion
  std::atomic<bool> ended_{false};
  std::atomic<int> hurry_{1}; // times the time that passes
  std::thread thread_;
};

} // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: fake_cell FOLDER [key=value]...\n");
    return 2;
  }
  std::map<std::string, std::string> options = {
      {"model", "2f85"}, {"object", "40"}, {"stiffness", "2"}, {"rate", "200"}, {"active", "1"}};
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
  for (std::string text; std::getline(std::cin, text);) {
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
