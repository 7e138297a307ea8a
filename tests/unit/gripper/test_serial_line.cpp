#include "grasp/gripper/serial_line.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

using namespace fingertip;
namespace fs = std::filesystem;

/* A piece of /sys and /dev as Linux shows serial adapters on USB. */
class FakeSystem : public ::testing::Test {
protected:
  FakeSystem() {
    char name[] = "/tmp/gripper_ports_XXXXXX";
    root_ = mkdtemp(name);
    fs::create_directories(root_ / "dev/serial/by-id");
    fs::create_directories(root_ / "sys/class/tty");
    fs::create_directories(root_ / "sys/bus/usb/devices");
  }
  ~FakeSystem() override { fs::remove_all(root_); }

  void write(const fs::path &path, const std::string &text) const {
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text << "\n";
  }

  void plug_in(const std::string &place, const std::string &tty, const std::string &vendor, const std::string &product_id,
               const std::string &product, const std::string &timer_ms) const {
    const fs::path usb = root_ / "sys/devices/usb1" / place, interface = usb / (place + ":1.0");
    write(usb / "idVendor", vendor);
    write(usb / "idProduct", product_id);
    write(usb / "manufacturer", "Maker");
    write(usb / "product", product);
    write(usb / "serial", "S" + place);
    fs::create_directory_symlink(usb, root_ / "sys/bus/usb/devices" / place);
    const bool is_usb_serial = tty.rfind("ttyUSB", 0) == 0;
    const fs::path node = is_usb_serial ? interface / tty : interface;
    fs::create_directories(node / "tty" / tty);
    fs::create_directory_symlink(node, node / "tty" / tty / "device");
    fs::create_directory_symlink(node / "tty" / tty, root_ / "sys/class/tty" / tty);
    write(root_ / "dev" / tty, "");
    if (!timer_ms.empty()) {
      write(root_ / "sys/bus/usb-serial/devices" / tty / "latency_timer", timer_ms);
    }
  }

  fs::path root_;
};

TEST_F(FakeSystem, FindsAdaptersAndTheirTimers) {
  plug_in("1-1", "ttyUSB0", "0403", "6015", "RS485 cable", "16");
  plug_in("1-2", "ttyACM1", "1a86", "55d3", "Servo bus", "");
  plug_in("1-3", "ttyACM0", "1209", "0001", "Fingertip tactile sensor", "");
  fs::create_directories(root_ / "sys/class/tty/ttyS0");
  fs::create_symlink("../../ttyUSB0", root_ / "dev/serial/by-id/usb-Maker_RS485-if00");
  const std::vector<GripperPort> ports = find_gripper_ports(root_.string());
  ASSERT_EQ(ports.size(), 2u);
  EXPECT_EQ(ports[0].path, (root_ / "dev/serial/by-id/usb-Maker_RS485-if00").string());
  EXPECT_EQ(ports[0].adapter, "Maker RS485 cable");
  EXPECT_EQ(ports[0].latency_timer_ms, 16);
  EXPECT_EQ(ports[1].path, (root_ / "dev/ttyACM1").string());
  EXPECT_EQ(ports[1].adapter, "Maker Servo bus");
  EXPECT_FALSE(ports[1].latency_timer_ms);

  EXPECT_EQ(latency_timer_ms(ports[0].path, root_.string()), 16);
  EXPECT_FALSE(latency_timer_ms(ports[1].path, root_.string()));
  EXPECT_FALSE(latency_timer_ms((root_ / "dev/none").string(), root_.string()));
}

TEST_F(FakeSystem, FindsNothingWhereNothingIs) {
  fs::remove_all(root_ / "sys");
  EXPECT_TRUE(find_gripper_ports(root_.string()).empty());
}
