#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "support/host_packets.hpp"

#include <csignal>
#include <filesystem>
#include <gtest/gtest.h>
#include <optional>
#include <sys/resource.h>
#include <sys/stat.h>

using namespace fingertip;
namespace fs = std::filesystem;

constexpr auto WHEN_FINISHED = OutputFile::Appears::when_finished;

static void write(const std::string &path, const std::string &text) { std::ofstream(path, std::ios::binary) << text; }

/* Nothing: it is not. */
template <typename Action> std::optional<ErrorCode> refused(const Action &action) {
  try {
    action();
  } catch (const Error &error) {
    return error.code();
  }
  return std::nullopt;
}
static std::optional<ErrorCode> refusal(const std::string &path, bool replace) {
  return refused([&] { check_output(path, replace); });
}

static long files_in(const std::string &folder) { return std::distance(fs::directory_iterator(folder), fs::directory_iterator()); }

TEST(OutputFile, AnUnfinishedOneLeavesTheOldFile) {
  test::TemporaryFolder folder;
  write(folder / "a", "old");
  {
    OutputFile file(folder / "a", true, WHEN_FINISHED);
    file.append("new", 3);
    EXPECT_EQ(test::contents(folder / "a"), "old");
  }
  EXPECT_EQ(test::contents(folder / "a"), "old");
  EXPECT_EQ(files_in(folder.path()), 1);
}

TEST(OutputFile, AFinishedOneTakesThePlaceAndThePermissionsOfTheOld) {
  test::TemporaryFolder folder;
  write(folder / "a", "old");
  chmod((folder / "a").c_str(), 0640);
  fs::create_symlink("a", folder / "link");
  {
    OutputFile file(folder / "link", true, WHEN_FINISHED);
    file.append("new", 3);
    file.finish();
  }
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(test::contents(folder / "a"), "new");
  EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms(0640));
  EXPECT_EQ(files_in(folder.path()), 2);
}

TEST(OutputFile, AFileThatCameMeanwhileIsKept) {
  test::TemporaryFolder folder;
  OutputFile file(folder / "a", false, WHEN_FINISHED);
  file.append("new", 3);
  write(folder / "a", "other");
  EXPECT_THROW(file.finish(), Error);
  EXPECT_EQ(test::contents(folder / "a"), "other");
}

TEST(OutputFile, WhatCannotBeWrittenIsRefusedAndTouchesNothing) {
  test::TemporaryFolder folder;
  write(folder / "a", "old");
  EXPECT_EQ(refusal(folder / "a", false), ErrorCode::file_exists);
  EXPECT_EQ(refusal(folder / "a", true), std::nullopt);
  EXPECT_EQ(refusal(folder / "b", false), std::nullopt);
  EXPECT_EQ(refusal(folder / "no/a", false), ErrorCode::cannot_write);
  for (bool replace : {false, true}) {
    EXPECT_EQ(refusal(folder.path(), replace), ErrorCode::is_folder);
  }
  EXPECT_EQ(test::contents(folder / "a"), "old");
  EXPECT_EQ(files_in(folder.path()), 1);
}

TEST(OutputFile, OneThatGrowsIsNotReplaced) {
  test::TemporaryFolder folder;
  OutputFile first(folder / "a", false, OutputFile::Appears::at_once);
  first.append("line", 4);
  for (auto appears : {OutputFile::Appears::at_once, WHEN_FINISHED}) {
    EXPECT_THROW(OutputFile(folder / "a", true, appears), Error);
  }
  EXPECT_EQ(test::contents(folder / "a"), "line");
}

TEST(OutputFile, OneFileByTwoNames) {
  test::TemporaryFolder folder;
  write(folder / "a", "");
  fs::create_hard_link(folder / "a", folder / "hard");
  fs::create_symlink("a", folder / "soft");
  fs::create_directory_symlink(".", folder / "here");
  for (const char *name : {"hard", "soft", "here/a"}) {
    EXPECT_TRUE(is_same_file(folder / "a", folder / name));
  }
  EXPECT_TRUE(is_same_file(folder / "new", folder / "./here/new"));
  EXPECT_TRUE(is_same_file("new", "./new"));
  EXPECT_FALSE(is_same_file(folder / "a", folder / "b"));
  EXPECT_FALSE(is_same_file(folder / "b", folder / "c"));
}

/* A limit on the size of files stands in for a full disk: write stops within an append. */
TEST(OutputFile, AFullDiskIsAnErrorAndLeavesWholeAppends) {
  test::TemporaryFolder folder;
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small = {5000, before.rlim_max};
  OutputFile file(folder / "a", false, OutputFile::Appears::at_once);
  const std::string line(300, 'x');
  std::optional<ErrorCode> code;
  setrlimit(RLIMIT_FSIZE, &small);
  for (int i = 0; i < 100 && !code; i++) {
    code = refused([&] { file.append(line.data(), line.size()); });
  }
  const std::string too_long(6000, 'x');
  EXPECT_THROW(OutputFile(folder / "b", false, OutputFile::Appears::at_once).append(too_long.data(), too_long.size()), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_FALSE(fs::exists(folder / "b"));
  EXPECT_EQ(code, ErrorCode::write_cut);
  EXPECT_EQ(fs::file_size(folder / "a"), 4800u);
}
