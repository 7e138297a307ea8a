#include "tool/doctor/wiring.hpp"

#include <gtest/gtest.h>

using fingertip::pin_text;

TEST(Wiring, PinsAreThoseOfTheBoardsReadme) {
  /* boards/pico_mux/README.md and boards/pico_parallel/README.md */
  for (auto [gpio, pin] : {std::pair{0u, 1}, {1, 2}, {2, 4}, {5, 7}, {6, 9}, {8, 11}, {10, 14}, {14, 19}, {15, 20}}) {
    EXPECT_EQ(pin_text(gpio), "GP" + std::to_string(gpio) + " (pin " + std::to_string(pin) + ")");
  }
}
