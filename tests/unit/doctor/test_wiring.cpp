#include "tool/doctor/wiring.hpp"

#include <gtest/gtest.h>

using fingertip::pin_text;
using fingertip::Wiring;

TEST(Wiring, PinsAreThoseOfTheBoardsReadme) {
  /* boards/pico_mux/README.md and boards/pico_parallel/README.md */
  for (auto [gpio, pin] : {std::pair{0u, 1}, {1, 2}, {2, 4}, {5, 7}, {6, 9}, {8, 11}, {10, 14}, {14, 19}, {15, 20}}) {
    EXPECT_EQ(pin_text(gpio), "GP" + std::to_string(gpio) + " (pin " + std::to_string(pin) + ")");
  }
}

TEST(Wiring, SensorsOfPicoMuxAreBehindMultiplexers) {
  auto wiring = Wiring::of_board("pico_mux");
  ASSERT_TRUE(wiring);
  EXPECT_EQ(wiring->sensor_count, 15u);
  auto place = wiring->place(13);
  EXPECT_EQ(place.strip, 2u);
  EXPECT_EQ(place.position, 3u);
  EXPECT_EQ(place.multiplexer, 0x72u);
  EXPECT_FALSE(place.gpio);
  EXPECT_EQ(wiring->place_text(13), "strip 2, channel 3 of multiplexer 0x72");
  EXPECT_EQ(wiring->sensors_of(1), 0x3E0u);
  EXPECT_NE(wiring->check_multiplexer(2).find("GP8 (pin 11)"), std::string::npos);
}

TEST(Wiring, SensorsOfPicoParallelHaveLinesOfTheirOwn) {
  auto wiring = Wiring::of_board("pico_parallel");
  ASSERT_TRUE(wiring);
  EXPECT_EQ(wiring->sensor_count, 15u);
  EXPECT_EQ(wiring->place(13).gpio, 13u);
  EXPECT_FALSE(wiring->place(13).multiplexer);
  EXPECT_EQ(wiring->place_text(13), "strip 2, position 3, SDA on GP13 (pin 17)");
  EXPECT_FALSE(wiring->has_multiplexers());
}

TEST(Wiring, OtherBoardsAreUnknown) {
  EXPECT_FALSE(Wiring::of_board("native"));
  EXPECT_FALSE(Wiring::of_board(""));
}
