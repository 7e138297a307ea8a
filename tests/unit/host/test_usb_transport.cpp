#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/usb_transport.hpp"
#include "library/share/server.hpp"
#include "support/fake_libusb.hpp"
#include "support/host_packets.hpp"

#include <gtest/gtest.h>
#include <numeric>

using namespace fingertip;
using std::chrono::milliseconds;
using Result = Transport::Result;

class Usb : public ::testing::Test {
protected:
  Usb() { fake_libusb::reset(); }
  ~Usb() override {
    EXPECT_EQ(fake_libusb::misuse(), "");
    EXPECT_EQ(fake_libusb::leaks(), 0);
  }
  fake_libusb::Device &plug_in(const std::string &serial, std::uint8_t address = 1) {
    auto device = std::make_shared<fake_libusb::Device>();
    device->serial = serial;
    device->address = address;
    fake_libusb::bus().push_back(device);
    return *device;
  }
  static ErrorCode error_of(const std::string &serial) {
    try {
      UsbTransport transport(serial);
    } catch (const Error &error) {
      return error.code();
    }
    return ErrorCode::other;
  }
  static std::vector<std::uint8_t> read_all(UsbTransport &transport, Result last) {
    std::vector<std::uint8_t> all;
    std::uint8_t bytes[100];
    std::size_t length = 0;
    Result result;
    while ((result = transport.read(bytes, sizeof bytes, &length, milliseconds(1))) == Result::data) {
      all.insert(all.end(), bytes, bytes + length);
    }
    EXPECT_EQ(static_cast<int>(result), static_cast<int>(last));
    return all;
  }
};

static std::vector<std::uint8_t> counting(std::size_t length) {
  std::vector<std::uint8_t> bytes(length);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

TEST_F(Usb, OpensLikeAPortAndGivesTheDriverBack) {
  auto &device = plug_in("A");
  {
    UsbTransport transport("A");
    EXPECT_EQ(device.lines, 3);
    EXPECT_EQ(device.baud, 115200u);
    EXPECT_FALSE(device.driver[0] || device.driver[1]);
    EXPECT_TRUE(device.claimed[0] && device.claimed[1]);
    EXPECT_EQ(transport.description(), "usb 001/001 A");
  }
  EXPECT_EQ(device.lines, 0);
  EXPECT_TRUE(device.driver[0] && device.driver[1]);
}

TEST_F(Usb, WhatAKilledProgramLeftIsMended) {
  auto &device = plug_in("A");
  device.driver[0] = device.driver[1] = false;
  UsbTransport("A");
  EXPECT_TRUE(device.driver[0]);
}

TEST_F(Usb, EveryByteComesInOrderWhateverThePackets) {
  auto &device = plug_in("A");
  auto sent = counting(64 * 500);
  for (std::size_t at = 0, length = 0; at < sent.size(); at += length) {
    length = std::min<std::size_t>(at % 65, sent.size() - at); /* from empty to full */
    length = length == 0 && device.in.size() % 2 ? 64 : length;
    auto from = sent.begin() + static_cast<std::ptrdiff_t>(at);
    length = std::min(length, sent.size() - at);
    device.in.emplace_back(from, from + static_cast<std::ptrdiff_t>(length));
  }
  UsbTransport transport("A");
  EXPECT_EQ(read_all(transport, Result::timeout), sent);
  EXPECT_EQ(device.most_waiting, 64);
}

TEST_F(Usb, WritesAllOrSaysNo) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  auto bytes = counting(200);
  EXPECT_TRUE(transport.write(bytes.data(), bytes.size()));
  EXPECT_EQ(device.out, bytes);
  device.takes_bytes = false;
  EXPECT_FALSE(transport.write(bytes.data(), 1));
  device.is_plugged_in = false;
  EXPECT_FALSE(transport.write(bytes.data(), 1));
}

TEST_F(Usb, TheSerialNumberChoosesInEitherCase) {
  plug_in("AB", 1);
  plug_in("CD", 2);
  auto &other = plug_in("EF", 3);
  other.product = 0x4321;
  EXPECT_EQ(UsbTransport("cd").description(), "usb 001/002 CD");
  EXPECT_EQ(error_of("EF"), ErrorCode::no_port);
}

TEST_F(Usb, GoneAndBackAtAnotherAddress) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  for (int cycle = 0; cycle < 20; cycle++) {
    device.in.push_back(counting(64));
    EXPECT_EQ(read_all(transport, Result::timeout).size(), 64u);
    device.in.push_back(counting(64)); /* never fetched: the cable was faster */
    device.is_plugged_in = false;
    EXPECT_EQ(read_all(transport, Result::gone).size(), 0u);
    EXPECT_EQ(read_all(transport, Result::gone).size(), 0u);
    EXPECT_FALSE(transport.reopen());
    device.claimed[0] = device.claimed[1] = false;
    device.driver[0] = device.driver[1] = true;
    device.in.clear();
    device.address++;
    device.is_plugged_in = true;
    ASSERT_TRUE(transport.reopen());
    EXPECT_EQ(device.lines, 3);
  }
  EXPECT_EQ(transport.description(), "usb 001/021 A");
}

TEST_F(Usb, AHaltedEndpointIsFreed) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  device.halted = true;
  EXPECT_TRUE(read_all(transport, Result::timeout).empty());
  while (device.halted) {
    read_all(transport, Result::timeout);
  }
  device.in.push_back(counting(10));
  EXPECT_EQ(read_all(transport, Result::timeout), counting(10));
}

TEST_F(Usb, ErrorsAreTold) {
  EXPECT_EQ(error_of("A"), ErrorCode::no_port);
  auto &device = plug_in("A");
  device.is_denied = true;
  EXPECT_EQ(error_of("A"), ErrorCode::permission_denied);
  device.is_denied = false;
  device.driver[0] = device.driver[1] = false;
  device.is_claimed = true;
  EXPECT_EQ(error_of("A"), ErrorCode::port_in_use);
  device.is_claimed = false;
  device.has_cdc_interfaces = false;
  EXPECT_EQ(error_of("A"), ErrorCode::not_a_fingertip);
}

TEST_F(Usb, TakenByAnotherWhileItWasGoneIsAnError) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  device.is_plugged_in = false;
  read_all(transport, Result::gone);
  device.is_plugged_in = true;
  device.claimed[0] = device.claimed[1] = false;
  device.is_claimed = true;
  EXPECT_THROW(transport.reopen(), Error);
}

TEST_F(Usb, TheLoaderIsAskedForByTheBaudRate) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  EXPECT_TRUE(transport.ask_loader());
  EXPECT_EQ(device.baud, 1200u);
  EXPECT_EQ(device.lines, 0);
}

TEST_F(Usb, SaysWhatToWaitFor) {
  auto &device = plug_in("A");
  UsbTransport transport("A");
  auto all = transport.poll_descriptors();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].fd, fake_libusb::events_descriptor());
  EXPECT_EQ(all[0].events, POLLIN);
  device.is_plugged_in = false;
  read_all(transport, Result::gone);
  EXPECT_TRUE(transport.poll_descriptors().empty());
}

TEST_F(Usb, IsSharedAndSeenToGoAndComeBack) {
  auto &device = plug_in("A1B2");
  test::TemporaryFolder folder;
  std::string socket = folder / "fingertip/A1B2.sock";
  {
    Server server({folder / "fingertip", {}}, [](const std::string &) {});
    server.add({"A1B2", "", true});
    SocketTransport client(socket);
    server.step(milliseconds(0));
    server.step(milliseconds(0));
    EXPECT_FALSE(device.out.empty()) << "who is there?";
    std::uint8_t bytes[200];
    std::size_t length = 0;
    device.is_plugged_in = false;
    server.step(milliseconds(0));
    EXPECT_EQ(static_cast<int>(client.read(bytes, sizeof bytes, &length, milliseconds(1000))), static_cast<int>(Result::gone));
    server.step(milliseconds(0));
    EXPECT_FALSE(client.reopen());
    device.is_plugged_in = true;
    for (int i = 0; i < 100 && !client.reopen(); i++) {
      wait_until(host_now() + milliseconds(20));
      server.step(milliseconds(0));
    }
    EXPECT_TRUE(SocketTransport::is_served(socket));
  }
  EXPECT_FALSE(SocketTransport::is_served(socket));
}
