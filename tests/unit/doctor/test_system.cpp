#include "support/host_packets.hpp"
#include "tool/doctor/system.hpp"

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <utility>

namespace fs = std::filesystem;

const char *const TTY_RULE = "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"1209\", ATTRS{idProduct}==\"0001\", MODE=\"0660\"\n";

class System : public ::testing::Test {
protected:
  void write(const std::string &path, const std::string &text) {
    fs::create_directories(fs::path(folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text;
  }
  std::string rule() const { return fingertip::find_rule(folder_.path()); }

  test::TemporaryFolder folder_;
};

/* A pseudo-terminal that another process has open. */
struct HeldPort {
  char path[64];
  int master = -1;
  pid_t process = forkpty(&master, path, nullptr, nullptr);

  HeldPort() {
    while (process == 0) {
      pause();
    }
  }
  ~HeldPort() {
    release();
    close(master);
  }
  void release() {
    if (const pid_t held = std::exchange(process, 0)) {
      kill(held, SIGKILL);
      waitpid(held, nullptr, 0);
    }
  }
};

TEST_F(System, RuleIsFoundWhereUdevLooks) {
  EXPECT_EQ(rule(), "");
  for (const char *path :
       {"etc/udev/rules.d/60-fingertip.rules", "usr/lib/udev/rules.d/60-fingertip.rules", "usr/local/lib/udev/rules.d/99-mine.rules"}) {
    write(path, TTY_RULE);
    EXPECT_EQ(rule(), folder_ / path);
    fs::remove(folder_ / path);
  }
}

TEST_F(System, WhatDoesNotActIsNoRule) {
  write("etc/udev/rules.d/60-fingertip.rules", std::string("# ") + TTY_RULE);
  EXPECT_EQ(rule(), "") << "a comment";
  write("etc/udev/rules.d/60-fingertip.rules.old", TTY_RULE);
  EXPECT_EQ(rule(), "") << "udev reads *.rules only";
  write("etc/udev/rules.d/60-fingertip.rules", "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"1209\", ATTRS{idProduct}==\"0002\"\n");
  EXPECT_EQ(rule(), "") << "another device";
}

TEST_F(System, HolderIsNamed) {
  HeldPort port;
  auto holders = fingertip::holders_of(port.path, "/");
  ASSERT_EQ(holders.seen.size(), 1u);
  EXPECT_EQ(holders.seen[0].process, port.process);
  EXPECT_FALSE(holders.seen[0].name.empty());
  /* by another name of the same device */
  fs::create_symlink(port.path, folder_ / "link");
  EXPECT_EQ(fingertip::holders_of(folder_ / "link", "/").seen.size(), 1u);
}

TEST_F(System, NobodyHoldsWhatWasReleasedOrIsMine) {
  HeldPort port;
  port.release();
  int mine = open(port.path, O_RDWR | O_NOCTTY);
  EXPECT_TRUE(fingertip::holders_of(port.path, "/").seen.empty());
  close(mine);
  EXPECT_TRUE(fingertip::holders_of(folder_ / "none", "/").seen.empty());
}
