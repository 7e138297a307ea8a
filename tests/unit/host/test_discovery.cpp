#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "support/host_packets.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

using namespace fingertip;
namespace fs = std::filesystem;

namespace {

/* A piece of /sys and /dev as Linux shows a USB CDC device. */
class FakeSystem : public ::testing::Test {
protected:
  FakeSystem() {
    unsetenv("FINGERTIP_PORT");
    fs::create_directories(root() + "/sys/class/tty/tty0");
    fs::create_directories(root() + "/dev/serial/by-id");
  }
  std::string root() const { return folder_.path(); }

  void plug_in(const std::string &tty, const std::string &vendor, const std::string &product_id,
               const std::string &serial, bool by_id) {
    fs::path usb = root() + "/sys/devices/usb1/" + tty;
    fs::create_directories(usb / "1.0/tty" / tty);
    std::ofstream(usb / "idVendor") << vendor << "\n";
    std::ofstream(usb / "idProduct") << product_id << "\n";
    std::ofstream(usb / "serial") << serial << "\n";
    std::ofstream(usb / "product") << "Fingertip tactile sensor\n";
    fs::create_directory_symlink(usb / "1.0", usb / "1.0/tty" / tty / "device");
    fs::create_directory_symlink(usb / "1.0/tty" / tty, root() + "/sys/class/tty/" + tty);
    std::ofstream(root() + "/dev/" + tty) << "";
    if (by_id) {
      fs::create_symlink("../../" + tty,
                         root() + "/dev/serial/by-id/usb-Fingertip_" + serial + "-if00");
    }
  }

private:
  test::TemporaryFolder folder_;
};

} // namespace

TEST_F(FakeSystem, FindsOursAndNoOther) {
  plug_in("ttyACM0", "2341", "0043", "arduino", true);
  plug_in("ttyACM1", "1209", "0001", "E660583883265A2C", true);
  plug_in("ttyACM2", "1209", "0002", "other", false);
  auto ports = find_ports(root());
  ASSERT_EQ(ports.size(), 1u);
  EXPECT_EQ(ports[0].path, root() + "/dev/serial/by-id/usb-Fingertip_E660583883265A2C-if00");
  EXPECT_EQ(ports[0].serial, "E660583883265A2C");
  EXPECT_EQ(ports[0].product, "Fingertip tactile sensor");
  EXPECT_EQ(choose_port("", root()), ports[0].path);
}

TEST_F(FakeSystem, WithoutAStableNameTheDeviceItself) {
  plug_in("ttyACM4", "1209", "0001", "A", false);
  EXPECT_EQ(choose_port("", root()), root() + "/dev/ttyACM4");
}

TEST_F(FakeSystem, NoneAndSeveralAreErrors) {
  EXPECT_THROW(choose_port("", root()), Error);
  plug_in("ttyACM0", "1209", "0001", "A", false);
  plug_in("ttyACM1", "1209", "0001", "B", false);
  try {
    choose_port("", root());
    FAIL();
  } catch (const Error &error) {
    EXPECT_NE(std::string(error.what()).find("/dev/ttyACM0 "), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("/dev/ttyACM1"), std::string::npos);
  }
}

TEST_F(FakeSystem, TheEnvironmentGoesBeforeUsbAndTheArgumentBeforeBoth) {
  plug_in("ttyACM0", "1209", "0001", "A", false);
  setenv("FINGERTIP_PORT", "/tmp/pty", 1);
  EXPECT_EQ(choose_port("", root()), "/tmp/pty");
  EXPECT_EQ(choose_port("/tmp/other", root()), "/tmp/other");
  EXPECT_EQ(find_ports(root()).size(), 2u);
  EXPECT_EQ(find_ports(root())[1].product, "from FINGERTIP_PORT, no such port");
  setenv("FINGERTIP_PORT", root().c_str(), 1);
  EXPECT_EQ(find_ports(root())[1].product, "from FINGERTIP_PORT");
  setenv("FINGERTIP_PORT", "/tmp/a:/tmp/b", 1);
  EXPECT_THROW(choose_port("", root()), Error);
  unsetenv("FINGERTIP_PORT");
}
