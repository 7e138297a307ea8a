#include "libfingertip/error.hpp"
#include "libfingertip/serial_transport.hpp"

#include <cstdlib>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>
#include <vector>

using namespace fingertip;
using std::chrono::milliseconds;

/* For what surely comes, on a busy computer too. */
constexpr milliseconds PATIENCE{10000};

/* The device's side of a pseudo-terminal, in the mode that Linux gives it: cooked, with echo. */
class Terminal : public ::testing::Test {
protected:
  Terminal() { open_master(); }
  ~Terminal() override {
    close(master_);
    unlink(link_.c_str());
  }
  void open_master() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY);
    grantpt(master_);
    unlockpt(master_);
    unlink(link_.c_str());
    ASSERT_EQ(symlink(ptsname(master_), link_.c_str()), 0);
  }
  int master_ = -1;
  std::string link_ = "/tmp/fingertip-test-tty-" + std::to_string(getpid());
};

TEST_F(Terminal, EveryByteArrivesUnchangedBothWaysWithoutEcho) {
  SerialTransport transport(link_);
  std::uint8_t all[256];
  for (int i = 0; i < 256; i++) {
    all[i] = static_cast<std::uint8_t>(i);
  }
  ASSERT_EQ(write(master_, all, sizeof all), 256);
  std::uint8_t got[512];
  std::size_t total = 0, length = 0;
  while (total < 256 && transport.read(got + total, sizeof got - total, &length, PATIENCE) == Transport::Result::data) {
    total += length;
  }
  ASSERT_EQ(total, 256u);
  EXPECT_TRUE(std::equal(all, all + 256, got));

  ASSERT_TRUE(transport.write(all, sizeof all));
  total = 0;
  while (total < 256) {
    ssize_t count = read(master_, got + total, sizeof got - total);
    ASSERT_GT(count, 0);
    total += static_cast<std::size_t>(count);
  }
  EXPECT_EQ(total, 256u); /* an echo of the first 256 would be here too */
  EXPECT_TRUE(std::equal(all, all + 256, got));
}

TEST_F(Terminal, ReadWaitsNoLongerThanAsked) {
  SerialTransport transport(link_);
  std::uint8_t byte;
  std::size_t length;
  auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(transport.read(&byte, 1, &length, milliseconds(50)), Transport::Result::timeout);
  auto waited = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(waited, milliseconds(45));
  EXPECT_LT(waited, PATIENCE);
}

TEST_F(Terminal, GoneAndBack) {
  SerialTransport transport(link_);
  std::uint8_t bytes[8];
  std::size_t length;
  ASSERT_EQ(write(master_, "x", 1), 1);
  close(master_);
  unlink(link_.c_str());
  Transport::Result result;
  while ((result = transport.read(bytes, sizeof bytes, &length, milliseconds(100))) == Transport::Result::data) {
  }
  EXPECT_EQ(result, Transport::Result::gone);
  EXPECT_EQ(transport.read(bytes, sizeof bytes, &length, milliseconds(0)), Transport::Result::gone);
  EXPECT_FALSE(transport.write(bytes, 1));
  EXPECT_FALSE(transport.reopen());
  open_master();
  EXPECT_TRUE(transport.reopen());
  ASSERT_EQ(write(master_, "y", 1), 1);
  EXPECT_EQ(transport.read(bytes, sizeof bytes, &length, PATIENCE), Transport::Result::data);
  EXPECT_EQ(bytes[0], 'y');
}

TEST_F(Terminal, BackButTakenByAnotherIsAnError) {
  SerialTransport transport(link_);
  std::uint8_t byte;
  std::size_t length;
  close(master_);
  while (transport.read(&byte, 1, &length, milliseconds(100)) != Transport::Result::gone) {
  }
  open_master();
  SerialTransport other(link_);
  EXPECT_THROW(transport.reopen(), Error);
}

TEST_F(Terminal, AWriteThatNobodyTakesEnds) {
  SerialTransport transport(link_);
  std::vector<std::uint8_t> much(1 << 20, 0x55);
  EXPECT_FALSE(transport.write(much.data(), much.size()));
}
