#include "grasp/words.hpp"

#include <gtest/gtest.h>
#include <set>

using namespace fingertip;

TEST(Words, EveryStateHasAnotherNameAndIsFoundByIt) {
  std::set<std::string> names;
  for (std::uint8_t state = 0; state < GRIP_STATES; state++) {
    const std::string name = state_name(state);
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(name.find_first_of(" ,"), std::string::npos) << "is one cell: " << name;
    EXPECT_EQ(state_of_name(name), state);
    EXPECT_FALSE(state_text(state).empty());
  }
  EXPECT_EQ(state_of_name("gone"), std::nullopt);
  EXPECT_EQ(state_name(200), "200");
  EXPECT_EQ(state_name(GRIP_HOLDING), "holding");
  EXPECT_EQ(state_name(GRIP_FAULT), "fault");
  EXPECT_EQ(state_name(GRIP_STILL), "still");
}

TEST(Words, EveryTroubleHasAName) {
  constexpr std::uint32_t all = (GRIP_NO_GRIP << 1) - 1;
  EXPECT_EQ(trouble_of_names(trouble_names(all)), all);
  for (std::uint32_t bit = 1; bit <= all; bit <<= 1) {
    EXPECT_FALSE(trouble_names(bit).empty()) << bit;
    EXPECT_EQ(trouble_of_names(trouble_names(bit)), bit);
    GripReport report{};
    report.trouble = bit;
    EXPECT_EQ(trouble_texts(report).size(), 1u) << bit;
  }
  EXPECT_EQ(trouble_names(0), "");
  EXPECT_EQ(trouble_of_names(""), 0u);
  EXPECT_EQ(trouble_names(GRIP_FINGER_0_STALE | GRIP_AT_CAP), "finger_0_stale at_cap");
  EXPECT_EQ(trouble_of_names("at_cap nonsense"), std::nullopt);
}

TEST(Words, TroublesHaveTheirNumbers) {
  GripReport report{};
  report.trouble = GRIP_FINGERS_DIFFER | GRIP_FINGER_1_LATE;
  report.finger_N[0] = 3.1, report.finger_N[1] = 4.6;
  report.delay_s = 0.061;
  const auto texts = trouble_texts(report);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_NE(texts[0].find("3.1 and 4.6 N"), std::string::npos) << texts[0];
  EXPECT_EQ(texts[1], "right: late by 61 ms");
}
