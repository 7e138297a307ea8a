#include "tool/cli/keys.hpp"

#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;

/* What a terminal sends, in pieces with so much time between them. */
static std::string keys_of(const std::vector<std::string> &pieces, milliseconds gap = milliseconds(1)) {
  KeyParser parser;
  HostTime now{};
  std::string keys;
  for (const std::string &piece : pieces) {
    parser.feed(piece.data(), piece.size(), now += gap);
    while (auto key = parser.next()) {
      keys += *key < KEY_LEFT ? static_cast<char>(*key) : "<>^vhe"[*key - KEY_LEFT];
    }
  }
  return keys;
}

static std::vector<std::string> bytewise(const std::string &text) {
  std::vector<std::string> pieces;
  for (char c : text) {
    pieces.emplace_back(1, c);
  }
  return pieces;
}

TEST(Keys, PlainOnesComeInOrder) { EXPECT_EQ(keys_of({"qt", "y"}), "qty"); }

TEST(Keys, WhatATerminalAnswersIsNone) {
  for (const char *answer :
       {"\x1b[8;24;80t", "\x1b[?2026;2$y", "\x1b[>41;354;0c", "\x1b[Z", "\x1bOt", "\x1b[1;5t", "\x1b]11;rgb:0000/ttyy/ffff\x1b\\",
        "\x1b]11;rgb:tt/yy/qq\a", "\x1bP1$r0 t\x1b\\", "\x1b[I", "\x1bt", "\x1b[12;40R", "\x1b[6n", "\x1b[3~"}) {
    EXPECT_EQ(keys_of({answer}), "") << answer + 1;
    EXPECT_EQ(keys_of(bytewise(answer)), "") << answer + 1;
    EXPECT_EQ(keys_of({std::string(answer) + "q"}), "q") << answer + 1;
  }
}

TEST(Keys, ArrowsHomeAndEndAsTerminalsSendThem) {
  EXPECT_EQ(keys_of({"\x1b[D\x1b[C\x1b[A\x1b[B", "\x1b[H\x1b[F"}), "<>^vhe");
  EXPECT_EQ(keys_of({"\x1bOD\x1bOC\x1bOA\x1bOB\x1bOH\x1bOF"}), "<>^vhe");
  EXPECT_EQ(keys_of(bytewise("\x1b[1~\x1b[4~\x1b[7~\x1b[8~")), "hehe");
}

TEST(Keys, WhatIsPastedIsNone) {
  EXPECT_EQ(keys_of({"\x1b[200~tyq\nt\x1b[A y\x1b[201~q"}), "q");
  EXPECT_EQ(keys_of(bytewise("\x1b[200~tyq\x1b[201~q")), "q");
}

TEST(Keys, AnEscapeByItselfDoesNotTakeTheNextOne) { EXPECT_EQ(keys_of({"\x1b", "q"}, milliseconds(500)), "q"); }

TEST(Confirmation, TakesTimeToRead) {
  Confirmation confirmation;
  HostTime now{};
  EXPECT_FALSE(confirmation.answer('y', now)) << "nothing was asked";
  confirmation.ask(now);
  EXPECT_TRUE(confirmation.answer('y', now + milliseconds(400)));
  EXPECT_FALSE(confirmation.answer('y', now + milliseconds(500))) << "answered already";
  confirmation.ask(now);
  EXPECT_FALSE(confirmation.answer('y', now + milliseconds(100))) << "typed before it was read";
  EXPECT_FALSE(confirmation.answer('y', now + milliseconds(400))) << "and so withdrawn";
  confirmation.ask(now);
  EXPECT_FALSE(confirmation.answer('n', now + milliseconds(400)));
  EXPECT_FALSE(confirmation.is_asked());
  confirmation.ask(now);
  confirmation.expire(now + milliseconds(11000));
  EXPECT_FALSE(confirmation.is_asked());
}
