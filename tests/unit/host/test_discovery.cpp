#include "libfingertip/connection.hpp"
#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "support/host_packets.hpp"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

using namespace fingertip;
namespace fs = std::filesystem;

/* A piece of /sys and /dev as Linux shows a USB CDC device. */
class FakeSystem : public ::testing::Test {
protected:
  FakeSystem() {
    unsetenv("FINGERTIP_PORT");
    fs::create_directories(root() + "/sys/bus/usb/devices/usb1");
    fs::create_directories(root() + "/dev/serial/by-id");
  }
  std::string root() const { return folder_.path(); }

  /* tty: empty where no driver serves it */
  void plug_in(const std::string &place, const std::string &tty, const std::string &serial, bool by_id = false,
               const std::string &vendor = "1209", const std::string &product_id = "0001") {
    fs::path usb = root() + "/sys/devices/usb1/" + place;
    fs::create_directories(usb / (place + ":1.0"));
    std::ofstream(usb / "idVendor") << vendor << "\n";
    std::ofstream(usb / "idProduct") << product_id << "\n";
    std::ofstream(usb / "serial") << serial << "\n";
    std::ofstream(usb / "product") << "Fingertip tactile sensor\n";
    std::ofstream(usb / "busnum") << "1\n";
    std::ofstream(usb / "devnum") << place.back() << "\n";
    std::error_code again;
    fs::create_directory_symlink(usb, root() + "/sys/bus/usb/devices/" + place, again);
    if (!tty.empty()) {
      fs::create_directories(usb / (place + ":1.0") / "tty" / tty);
      std::ofstream(root() + "/dev/" + tty) << "";
    }
    if (by_id) {
      fs::create_symlink("../../" + tty, root() + "/dev/serial/by-id/usb-Fingertip_" + serial + "-if00");
    }
  }

  std::string port(const Choice &choice) const { return choose_endpoint(choice, root()).port; }
  Error thrown(const Choice &choice) const {
    try {
      choose_endpoint(choice, root());
    } catch (const Error &error) {
      return error;
    }
    return Error("");
  }
  std::string error(const Choice &choice) const { return thrown(choice).what(); }

private:
  test::TemporaryFolder folder_;
};

TEST_F(FakeSystem, FindsOursAndNoOther) {
  plug_in("1-1", "ttyACM0", "arduino", true, "2341", "0043");
  plug_in("1-2", "ttyACM1", "E660583883265A2C", true);
  plug_in("1-3", "ttyACM2", "other", false, "1209", "0002");
  auto found = find_usb(root());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].port, root() + "/dev/serial/by-id/usb-Fingertip_E660583883265A2C-if00");
  EXPECT_EQ(found[0].serial, "E660583883265A2C");
  EXPECT_EQ(found[0].product, "Fingertip tactile sensor");
  ASSERT_TRUE(found[0].usb);
  EXPECT_EQ(found[0].usb->bus, 1u);
  EXPECT_EQ(found[0].usb->address, 2u);
  Endpoint endpoint = choose_endpoint({}, root());
  EXPECT_EQ(endpoint.port, found[0].port);
  EXPECT_EQ(endpoint.serial, "E660583883265A2C");
  EXPECT_TRUE(endpoint.found_by_usb);
}

TEST_F(FakeSystem, ABoardInItsBootRomIsNamed) {
  EXPECT_EQ(error({}), "no fingertip found");
  plug_in("1-1", "", "E0", false, "2e8a", "000f");
  EXPECT_NE(error({}).find("no fingertip found, but a Pico 2 (RP2350): there is firmware for"), std::string::npos);
  plug_in("1-1", "", "E0", false, "2e8a", "0003");
  EXPECT_NE(error({}).find("no fingertip found, but a Pico that waits for firmware"), std::string::npos);
}

TEST_F(FakeSystem, WithoutADriverLibusb) {
  plug_in("1-1", "", "A");
  EXPECT_EQ(port({}), "");
  EXPECT_EQ(choose_endpoint({}, root()).serial, "A");
  EXPECT_NE(error({"", "", TransportKind::serial}).find("A: has no serial port"), std::string::npos);
  EXPECT_NE(error({"", "a", TransportKind::serial}).find("A: has no serial port"), std::string::npos);
}

TEST_F(FakeSystem, TheWishedTransport) {
  plug_in("1-1", "ttyACM0", "A");
  EXPECT_EQ(port({"", "", TransportKind::serial}), root() + "/dev/ttyACM0");
  EXPECT_EQ(port({"", "", TransportKind::usb}), "");
  setenv("FINGERTIP_PORT", "/tmp/pty", 1);
  EXPECT_EQ(port({"", "", TransportKind::usb}), "");
  EXPECT_EQ(thrown({"/dev/ttyACM0", "", TransportKind::usb}).code(), ErrorCode::wrong_choice);
}

TEST_F(FakeSystem, NoneAndSeveralAreErrors) {
  EXPECT_EQ(thrown({}).code(), ErrorCode::no_fingertip);
  plug_in("1-2", "ttyACM0", "BBBB");
  plug_in("1-1", "ttyACM1", "AAAA");
  EXPECT_EQ(error({}), "several fingertips found: AAAA, BBBB");
  EXPECT_EQ(thrown({}).code(), ErrorCode::several_fingertips);
  EXPECT_EQ(port({"", "bbbb", TransportKind::automatic}), root() + "/dev/ttyACM0");
  EXPECT_EQ(error({"", "CCCC", TransportKind::automatic}), "no fingertip CCCC here, there are: AAAA BBBB");
  auto endpoints = all_endpoints(TransportKind::automatic, root());
  ASSERT_EQ(endpoints.size(), 2u);
  EXPECT_EQ(endpoints[0].serial, "AAAA");
  EXPECT_EQ(endpoints[1].serial, "BBBB");
}

TEST_F(FakeSystem, TheEnvironmentGoesBeforeUsbAndTheArgumentBeforeBoth) {
  plug_in("1-1", "ttyACM0", "A");
  setenv("FINGERTIP_PORT", "/tmp/pty", 1);
  EXPECT_EQ(port({}), "/tmp/pty");
  EXPECT_EQ(port({"/tmp/other", "", TransportKind::automatic}), "/tmp/other");
  EXPECT_EQ(port({"", "A", TransportKind::automatic}), root() + "/dev/ttyACM0");
  ASSERT_EQ(find_in_environment().size(), 1u);
  EXPECT_EQ(find_in_environment()[0].product, "from FINGERTIP_PORT, no such port");
  setenv("FINGERTIP_PORT", root().c_str(), 1);
  EXPECT_EQ(find_in_environment()[0].product, "from FINGERTIP_PORT");
  setenv("FINGERTIP_PORT", "/tmp/a:/tmp/b", 1);
  EXPECT_EQ(error({}), "several fingertips found: /tmp/a, /tmp/b");
}
