// Readings of one Gaussian with gains: places, gains, the print and the hand are then known.
#include "libfingertip/random.hpp"
#include "support/validation_array.hpp"
#include "tool/validation/marks_fit.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace fingertip::validating {
namespace {

constexpr double PEAK_Pa = 20000.0, WIDTH_mm = 5.5, HAND_mm = 0.3;
constexpr double LAST_mm = 18.0;
constexpr double SHIFT_X_mm = 0.8, SHIFT_Y_mm = -0.6, TURN_rad = 0.03;

struct Session {
  Measured measured;
  std::vector<Mark> true_places;
  std::vector<double> gain;
};

struct Pad {
  double tilt_y = 0.0;             // of the width, from the middle to the last mark, at LAST_mm
  std::size_t swapped[2] = {0, 0}; // sensors; the same: none
  std::optional<std::size_t> loose, dead;
};

Session session(const Pad &pad) {
  Session made;
  made.measured.array = validation_array();
  const calibrating::Array &array = made.measured.array;
  Random random(7, 1, 0);
  for (std::size_t k = 0; k < array.sensors(); k++) {
    made.gain.push_back(1.0 + 0.1 * random.normal());
  }
  const std::vector<Mark> marks = marks_of(array);
  for (std::size_t turn = 0; turn < TURNS; turn++) {
    for (std::size_t m = 0; m < marks.size(); m++) {
      const double x = marks[m].x_mm + HAND_mm * random.normal();
      const double y = marks[m].y_mm + HAND_mm * random.normal();
      const double c = std::cos(TURN_rad), s = std::sin(TURN_rad);
      const Mark at = {c * x - s * y + SHIFT_X_mm, s * x + c * y + SHIFT_Y_mm};
      made.true_places.push_back(at);
      Press press;
      press.mark = m;
      press.at = marks[m];
      press.placement.t_s = 10.0 * double(made.measured.presses.size());
      press.placement.usable = (1u << array.sensors()) - 1u;
      press.placement.noise_Pa = 1.0;
      const double width = WIDTH_mm * std::exp(pad.tilt_y * marks[m].y_mm / LAST_mm);
      for (std::size_t k = 0; k < array.sensors(); k++) {
        const double r = std::hypot(array.x_mm[k] - at.x_mm, array.y_mm[k] - at.y_mm);
        double reading = made.gain[k] * PEAK_Pa * std::exp(-0.5 * r * r / (width * width));
        if (pad.loose == k) {
          reading *= 1.0 + 0.2 * random.normal();
        }
        press.placement.reading_Pa.push_back(pad.dead == k ? 0.0 : reading);
      }
      std::swap(press.placement.reading_Pa[pad.swapped[0]], press.placement.reading_Pa[pad.swapped[1]]);
      made.measured.presses.push_back(press);
    }
  }
  return made;
}

double median_off_mm(const MarksFit &fit, const Session &session) {
  std::vector<double> off;
  for (std::size_t i = 0; i < fit.presses.size(); i++) {
    off.push_back(std::hypot(fit.presses[i].x_mm - session.true_places[i].x_mm,
                             fit.presses[i].y_mm - session.true_places[i].y_mm));
  }
  std::sort(off.begin(), off.end());
  return off[off.size() / 2];
}

TEST(MarksFit, FindsPlacesGainsPrintAndHand) {
  const Session made = session({});
  const MarksFit fit = fit_marks(made.measured);
  ASSERT_TRUE(fit.solved);
  EXPECT_LT(median_off_mm(fit, made), 0.05); // a sixth of what the hand misses
  EXPECT_NEAR(fit.shift_x_mm, SHIFT_X_mm, 0.1);
  EXPECT_NEAR(fit.shift_y_mm, SHIFT_Y_mm, 0.1);
  EXPECT_NEAR(fit.turn_rad, TURN_rad, 0.01);
  EXPECT_NEAR(fit.hand_sd_mm, HAND_mm, 0.1);
  EXPECT_LT(std::hypot(fit.slope_x, fit.slope_y), 0.01);
  double mean = 0.0;
  for (double gain : made.gain) {
    mean += gain / double(made.gain.size());
  }
  for (std::size_t k = 0; k < fit.sensors.size(); k++) {
    EXPECT_NEAR(fit.sensors[k].gain, made.gain[k] / mean, 0.03) << k;
    EXPECT_LT(fit.sensors[k].off_mm, 1.0) << k;
    EXPECT_EQ(fit.sensors[k].place, k);
    EXPECT_LT(fit.sensors[k].residual_share, 0.01) << k;
  }
}

TEST(MarksFit, SwappedSensorsAreFoundAtEachOthersPlaces) {
  Pad pad;
  pad.swapped[0] = 4;
  pad.swapped[1] = 11;
  const Session made = session(pad);
  const MarksFit fit = fit_marks(made.measured);
  for (std::size_t k = 0; k < fit.sensors.size(); k++) {
    EXPECT_EQ(fit.sensors[k].place, k == 4 ? 11u : k == 11 ? 4u : k);
  }
  EXPECT_LT(median_off_mm(fit, made), 0.05); // a sixth of what the hand misses
}

TEST(MarksFit, ALooseSensorIsHeldAgainstTheOthers) {
  for (std::size_t loose : {7u, 0u}) { // in the middle, at a corner
    Pad pad;
    pad.loose = loose;
    const MarksFit fit = fit_marks(session(pad).measured, 1u << loose);
    for (std::size_t k = 0; k < fit.sensors.size(); k++) {
      if (k == loose) {
        EXPECT_NEAR(fit.sensors[k].residual_share, 0.2, 0.1);
        EXPECT_NEAR(fit.sensors[k].scatter_share, 0.2, 0.1);
      } else {
        EXPECT_LT(fit.sensors[k].residual_share, 0.01) << k;
        EXPECT_LT(fit.sensors[k].scatter_share, 0.02) << k;
      }
    }
  }
}

TEST(MarksFit, ADeadSensorHasNoGain) {
  Pad pad;
  pad.dead = 12;
  const MarksFit fit = fit_marks(session(pad).measured);
  EXPECT_LT(std::abs(fit.sensors[12].gain), 0.05);
  EXPECT_EQ(fit.sensors[12].place, 12u);
}

TEST(MarksFit, TheWidthsSlopeIsThatOfTheSkin) {
  Pad pad;
  pad.tilt_y = 0.07;
  const MarksFit fit = fit_marks(session(pad).measured);
  EXPECT_NEAR(fit.slope_y, 0.07, 0.01);
  EXPECT_NEAR(fit.slope_x, 0.0, 0.01);
  EXPECT_LT(fit.slope_y_sd, 0.01);
}

TEST(MarksFit, TooFewMarksAreNotSolved) {
  Session made = session({});
  made.measured.presses.resize(MARKS_MIN - 1);
  EXPECT_FALSE(fit_marks(made.measured).solved);
}

} // namespace
} // namespace fingertip::validating
