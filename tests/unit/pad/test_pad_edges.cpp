#include "libfingertip/error.hpp"
#include "library/pad/block_table.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"

extern "C" {
#include "contact/tangential.h"
}

#include <array>
#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;

constexpr double OVERHANG_mm = 9.0;

static pad_profile profile() { return pad::profile_over_own_sensors({12.0, OVERHANG_mm, false}); }

static twin::BlockTable block(const wire_info &info) {
  std::vector<twin::Place> sensors;
  for (int k = 0; k < info.sensor_count; k++) {
    sensors.push_back({double(info.x_mm[k]), double(info.y_mm[k])});
  }
  return twin::BlockTable::load_or_build({twin::silicone(12.0), 9.0 + OVERHANG_mm, 18.0 + OVERHANG_mm}, sensors, FINGERTIP_TABLES_DIR);
}

struct Told {
  bool valid;
  double x_mm, y_mm, qx, qy, force;
};

/* What the firmware says of a contact 3 mm wide on the pad that ends. The layer's part is written
 * again here, from the formulas of pad_profile.h. */
static Told told(const pad_profile &pad, const twin::BlockTable &ends, double x_mm, double y_mm, double qx, double qy, float dip_share) {
  const wire_info info = pad::own_sensors();
  constexpr double FORCE_N = 4.0, SPREAD_mm2 = 3.0;
  std::array<std::int32_t, FT_MAX_SENSORS> readings{};
  for (std::size_t k = 0; k < info.sensor_count; k++) {
    const double dx = double(info.x_mm[k]) - x_mm, dy = double(info.y_mm[k]) - y_mm;
    double Pa = 0.0;
    for (const auto &term : pad.normal) {
      const double v = std::pow(double(term.sd_mm), 2) + SPREAD_mm2;
      Pa += double(term.share) / v * std::exp(-(dx * dx + dy * dy) / (2 * v));
    }
    for (const auto &term : pad.tangential) {
      const double v = std::pow(double(term.sd_mm), 2) + 1.3 * SPREAD_mm2;
      Pa += (qx * dx + qy * dy) * double(term.moment_mm) / (v * v) * std::exp(-(dx * dx + dy * dy) / (2 * v));
    }
    Pa *= 1e6 * FORCE_N / (2 * M_PI);
    Pa += ends.added_Pa(k, {FORCE_N, qx * FORCE_N, qy * FORCE_N, 3.0}, x_mm, y_mm);
    readings[k] = static_cast<std::int32_t>(std::lround(1024 * Pa));
  }
  fit_array array;
  struct fit_pad prepared;
  EXPECT_EQ(FT_OK, fit_array_init(&array, info.sensor_count, info.x_mm, info.y_mm, info.pitch_mm));
  EXPECT_EQ(FT_OK, fit_pad_init(&prepared, &array, &pad));
  fit_settings fitting{};
  fitting.iterations = 4;
  fitting.noise_Pa_q10 = 1024;
  fitting.dip_share = dip_share;
  fitting.dip_sd_mm = 15.0F;
  fit_result fit;
  struct fit_tangential found;
  fit_gaussian_grid(&array, readings.data(), first_sensors(info.sensor_count), &fitting, &fit);
  fit_tangential_state state{};
  for (int frame = 0; frame < FIT_TANGENTIAL_FRAMES; frame++) {
    fit_tangential_estimate(&array, &prepared, readings.data(), &fitting, &fit, &state, &found);
  }
  contact_settings weighing{};
  tangential_settings settings{};
  settings.location_sd_limit_mm = 0.6F;
  tangential_configure(&settings, &pad, &weighing, -1);
  tangential_history history{};
  contact_input input{};
  input.contact = true;
  input.tangential = &found;
  contact_result result{};
  tangential_force load;
  tangential_update(&history, &settings, &input, &result, &load);
  return {(result.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0,
          double(load.x_mm),
          double(load.y_mm),
          double(load.qx_N / load.force_N),
          double(load.qy_N / load.force_N),
          double(load.force_N) / FORCE_N};
}

/* The mean error of Q / F with the edges' coefficients; it was as large without. dip_share: what a calibration has made of the ends. */
static void take_back(const wire_info &info, float dip_share, double was) {
  const pad_profile endless = profile();
  pad_profile mended = endless;
  mended.edges = pad::edges_of(endless, info, FINGERTIP_TABLES_DIR);
  EXPECT_TRUE(pad_profile_is_valid(&mended));
  const twin::BlockTable ends = block(pad::own_sensors());
  double without = 0.0, with = 0.0;
  int count = 0, told_none = 0;
  for (double x_mm = -11.5; x_mm < 9.0; x_mm += 4.9) { // the first is 2.5 mm beyond the outer sensors
    for (double y_mm = -15.1; y_mm < 18.0; y_mm += 6.1) {
      for (const double qx : {0.0, 0.25}) {
        const double qy = -0.6 * qx;
        const Told raw = told(endless, ends, x_mm, y_mm, qx, qy, dip_share);
        const Told good = told(mended, ends, x_mm, y_mm, qx, qy, dip_share);
        if (!raw.valid || !good.valid) {
          told_none++;
          continue;
        }
        without += std::hypot(raw.qx - qx, raw.qy - qy);
        with += std::hypot(good.qx - qx, good.qy - qy);
        count++;
        EXPECT_LT(std::hypot(good.qx - qx, good.qy - qy), 0.07) << x_mm << ' ' << y_mm;
        EXPECT_LT(std::hypot(good.x_mm - x_mm, good.y_mm - y_mm), x_mm < -9.0 ? 0.5 : 0.4) << x_mm << ' ' << y_mm;
        EXPECT_NEAR(good.force, 1.0, x_mm < -9.0 ? 0.08 : 0.06) << x_mm << ' ' << y_mm;
      }
    }
  }
  EXPECT_LE(told_none, 4) << count;
  EXPECT_GT(without / count, was);
  EXPECT_LT(with / count, 0.03);
}

TEST(PadEdges, TakeBackWhatTheEndsDo) { take_back(pad::own_sensors(), 0.0F, 0.10); }

/* The ends are a dip of 0.0125 then. Of the twin's calibrations it is 0.009 deeper on such pads than without ends. */
TEST(PadEdges, TakeBackWhatACalibrationLeaves) {
  wire_info info = pad::own_sensors();
  info.stored = WIRE_STORED_CALIBRATION;
  info.calibration.dip_share_q16 = 3900;
  info.calibration.dip_sd_um = 15000;
  take_back(info, 0.0125F, 0.03);
}

/* Forces are in the scale of the calibration then, whether it has found a dip or not. */
TEST(PadEdges, AreInTheScaleOfACalibration) {
  wire_info info = pad::own_sensors();
  const pad_edges without = pad::edges_of(profile(), info, FINGERTIP_TABLES_DIR);
  info.stored = WIRE_STORED_CALIBRATION;
  const pad_edges with = pad::edges_of(profile(), info, FINGERTIP_TABLES_DIR);
  EXPECT_GT(with.force[0], without.force[0] + 0.01F);
  EXPECT_NEAR((1.0F + with.force[0]) * without.force[1], (1.0F + without.force[0]) * with.force[1], 1e-6F);
}

TEST(PadEdges, SayLittleFarFromThem) {
  pad_profile near = profile(), far = profile();
  far.overhang_mm = 20.0F;
  near.edges = pad::edges_of(near, pad::own_sensors(), FINGERTIP_TABLES_DIR);
  far.edges = pad::edges_of(far, pad::own_sensors(), FINGERTIP_TABLES_DIR);
  EXPECT_LT(std::abs(far.edges.ratio_x[0]), 0.4F * std::abs(near.edges.ratio_x[0]));
  EXPECT_LT(std::abs(far.edges.force[0]), 0.5F * std::abs(near.edges.force[0]));
}

TEST(PadEdges, AreRefusedWhereTheyAreNotKnown) {
  pad_profile pad = profile();
  for (const float overhang_mm : {0.0F, 2.9F, 20.1F, NAN}) {
    pad.overhang_mm = overhang_mm;
    EXPECT_THROW(pad::edges_of(pad, pad::own_sensors(), FINGERTIP_TABLES_DIR), Error);
  }
  wire_info line = pad::own_sensors();
  line.sensor_count = 5;
  EXPECT_THROW(pad::edges_of(profile(), line, FINGERTIP_TABLES_DIR), Error);
}
