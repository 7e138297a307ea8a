// Scenarios as files: the pressure on the base that they hold, its effects and its ends.
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "scenes.hpp"
#include "simulation/twin/scenario_file.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <sstream>

using namespace fingertip;
using namespace fingertip::twin;

struct File {
  std::map<std::string, std::string> metadata;
  std::map<std::string, std::size_t> column;
  std::vector<std::vector<double>> rows;
  std::string bytes;

  double at(const std::string &name, double t_s) const {
    const auto after = std::lower_bound(rows.begin(), rows.end(), t_s, [](const std::vector<double> &row, double t) { return row[0] < t; });
    const std::size_t c = column.at(name);
    if (after == rows.begin() || after == rows.end()) {
      return (after == rows.begin() ? rows.front() : rows.back())[c];
    }
    const std::vector<double> &a = *(after - 1), &b = *after;
    return a[c] + (b[c] - a[c]) * (t_s - a[0]) / (b[0] - a[0]);
  }
};

static File written(const Scenario &scenario, const BlockTable *block = nullptr) {
  const std::string path = testing::TempDir() + "twin_scenario.csv";
  write_scenario(scenario, silicone(LAYER_mm), table_of(scenario.options.indenter), block, path, true);
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  File file;
  file.bytes = text.str();
  for (std::string line; std::getline(text, line);) {
    if (line[0] == '#') {
      const std::size_t colon = line.find(": ");
      if (colon != std::string::npos) {
        file.metadata[line.substr(2, colon - 2)] = line.substr(colon + 2);
      }
    } else if (file.column.empty()) {
      for (std::string_view name : split(line, ',')) {
        file.column.emplace(name, file.column.size());
      }
    } else {
      std::vector<double> row;
      for (std::string_view cell : split(line, ',')) {
        row.push_back(to_double(cell).value());
      }
      file.rows.push_back(row);
    }
  }
  std::filesystem::remove(path);
  std::filesystem::remove(truth_path(path));
  return file;
}

TEST(ScenarioFile, ADipIsLowerAroundTheContactAndBelowNothingFarFromIt) {
  const ContactTable &table = table_of("sphere6");
  const double middle_Pa = table.base_pressure_Pa(5.0, 0.0, 0.0);
  const double width_mm = std::sqrt(5e6 / (2.0 * M_PI * middle_Pa));
  EXPECT_NEAR(table.base_pressure_Pa(5.0, 0.0, 0.0, 0.05), 0.95 * middle_Pa, 1e-6 * middle_Pa);
  const double off_Pa = table.base_pressure_Pa(5.0, 2.5 * width_mm, 0.0) - table.base_pressure_Pa(5.0, 2.5 * width_mm, 0.0, 0.05);
  EXPECT_NEAR(off_Pa, 0.05 * std::exp(-0.5) * middle_Pa, 1e-6 * middle_Pa);
  EXPECT_LT(table.base_pressure_Pa(5.0, 0.0, 4.0 * width_mm, 0.05), -0.005 * middle_Pa);
  EXPECT_EQ(table.base_pressure_Pa(0.0, 1.0, 1.0, 0.05), 0.0);
}

TEST(ScenarioFile, IsThePressureOnTheBaseWithinItsTolerance) {
  const BlockTable block = BlockTable::load_or_build(block_around(silicone(LAYER_mm), 6.0), sensor_places(), FINGERTIP_TEST_TABLES);
  struct Case {
    const char *kind, *indenter = "sphere6", *tangential = "";
    double dip_share = 0.0, overhang_mm = 0.0;
  };
  for (const Case &one : {Case{"taps", "sphere6", "", 0.05},
                          {"slip"},
                          {"rolloff"},
                          {"two"},
                          {"taps", "sphere6", "0.35"},
                          {"lift", "sphere6", "0.35"},
                          {"two", "sphere6", "0.35"},
                          {"twist", "cube6", "0.35"},
                          {"taps", "sphere6", "0.35", 0.0, 6.0},
                          {"lift", "sphere6", "0.35", 0.0, 6.0},
                          {"two", "sphere6", "0.35", 0.0, 6.0}}) {
    const Scenario scenario = scenario_of(one.kind, [&](ScenarioOptions &o) {
      o.indenter = one.indenter;
      o.tangential = one.tangential;
      o.seconds = 30;
      o.effects = parse_effects(one.dip_share > 0.0 ? "dip=5" : "none");
      if (one.overhang_mm > 0.0) {
        o.overhang_mm = one.overhang_mm;
      }
    });
    const File file = written(scenario, one.overhang_mm > 0.0 ? &block : nullptr);
    const auto here = [&](double t_s) { return ::testing::Message() << one.kind << one.tangential << " " << t_s; };
    double most_added_Pa = 0.0;
    for (int ms = 5; ms < 30000; ms += 11) { // where it was computed
      const double t_s = 1e-3 * ms;
      std::array<double, 15> plain_Pa{}, expected_Pa{};
      Touch sum;
      bool slips = false;
      std::size_t tracks = 1;
      for (const Episode &episode : scenario.episodes) {
        if (t_s < episode.begin_s || t_s >= episode.end_s) {
          continue;
        }
        slips = episode.slips(t_s);
        tracks = episode.tracks.size();
        for (std::size_t n = 0; n < tracks; n++) {
          const Touch touch = episode.tracks[n].at(t_s - episode.begin_s);
          const std::string name = one.indenter;
          const auto bare_Pa = base_Pa(touch, table_of(name), nullptr, one.dip_share);
          const auto felt_Pa = base_Pa(touch, table_of(name), &traction_of(name), one.dip_share);
          const double radius_mm = table_of(name).contact_radius_mm(touch.force_N);
          for (std::size_t k = 0; k < 15; k++) {
            plain_Pa[k] += bare_Pa[k];
            expected_Pa[k] += felt_Pa[k];
            if (one.overhang_mm > 0.0) {
              expected_Pa[k] += block.added_Pa(k, {touch.force_N, touch.pull_x_N, touch.pull_y_N, radius_mm}, touch.x_mm, touch.y_mm);
            }
          }
          sum.force_N += touch.force_N;
          sum.pull_x_N += touch.pull_x_N;
          sum.pull_y_N += touch.pull_y_N;
          sum.x_mm += touch.force_N * touch.x_mm;
          sum.y_mm += touch.force_N * touch.y_mm;
        }
      }
      double peak_Pa = 0.0;
      for (std::size_t k = 0; k < 15; k++) {
        peak_Pa = std::max(peak_Pa, std::abs(expected_Pa[k]));
        most_added_Pa = std::max(most_added_Pa, std::abs(expected_Pa[k] - plain_Pa[k]));
      }
      for (std::size_t k = 0; k < 15; k++) {
        EXPECT_NEAR(file.at("s" + std::to_string(k) + "_Pa", t_s), expected_Pa[k], 0.25 + 1.1e-4 * peak_Pa) << here(t_s);
      }
      const double force_off_N = 2e-4 + 1.1e-4 * sum.force_N;
      EXPECT_NEAR(file.at("force_N", t_s), sum.force_N, force_off_N) << here(t_s);
      EXPECT_NEAR(file.at("contact", t_s), sum.force_N > 0.0, 1e-9) << here(t_s);
      EXPECT_NEAR(file.at("slip", t_s), slips, 1e-9) << here(t_s);
      if (sum.force_N > 0.0) {
        EXPECT_NEAR(file.at("x_mm", t_s), sum.x_mm / sum.force_N, 3e-3) << here(t_s);
        EXPECT_NEAR(file.at("y_mm", t_s), sum.y_mm / sum.force_N, 3e-3) << here(t_s);
      }
      if (tracks == 2) {
        EXPECT_EQ(file.at("p0_Pa", t_s), 0.0);
      }
      if (scenario.pulls) {
        EXPECT_NEAR(file.at("Qx_N", t_s), sum.pull_x_N, force_off_N) << here(t_s);
        EXPECT_NEAR(file.at("Qy_N", t_s), sum.pull_y_N, force_off_N) << here(t_s);
      }
    }
    EXPECT_EQ(most_added_Pa > 1000.0, *one.tangential != 0) << one.kind;
    EXPECT_EQ(file.metadata.count("tangential"), *one.tangential != 0 ? 1u : 0u);
    EXPECT_EQ(file.metadata.count("overhang_mm"), one.overhang_mm > 0.0 ? 1u : 0u);
  }
}

TEST(ScenarioFile, IsSparseWhereNothingHappens) {
  const File file = written(scenario_of("slip", [](ScenarioOptions &o) {
    o.seconds = 200;
    o.effects = parse_effects("all");
    o.stick_slip_mm = 1.0;
  }));
  EXPECT_EQ(file.rows.front()[0], 0.0);
  EXPECT_EQ(file.rows.back()[0], 200.0);
  EXPECT_LT(file.bytes.size(), 60e6 * 200 / 2000);
  for (std::size_t i = 1; i < file.rows.size(); i++) {
    EXPECT_GT(file.rows[i][0], file.rows[i - 1][0]);
  }
}

TEST(ScenarioFile, HasTheClosestGaussian) {
  const File file = written(scenario_of("taps", [](ScenarioOptions &o) {
    o.seconds = 5;
    o.forces = "10";
  }));
  const double p0_Pa = file.at("p0_Pa", 1.8), sigma_mm = file.at("sigma_mm", 1.8);
  // Any other width or height leaves more of the squares.
  const auto squares = [&](double p0, double sigma) {
    double sum = 0.0;
    for (double x = -36.0; x <= 36.0; x += 1.5) {
      for (double y = -36.0; y <= 36.0; y += 1.5) {
        const double rest = table_of("sphere6").base_pressure_Pa(10.0, x, y) - p0 * std::exp(-(x * x + y * y) / (2 * sigma * sigma));
        sum += rest * rest;
      }
    }
    return sum;
  };
  const double best = squares(p0_Pa, sigma_mm);
  for (double by : {0.997, 1.003}) {
    EXPECT_GT(squares(by * p0_Pa, sigma_mm), best);
    EXPECT_GT(squares(p0_Pa, by * sigma_mm), best);
  }
  // It holds less than the force: a layer's pressure has wider tails than a Gaussian.
  const double held = 2 * M_PI * p0_Pa * sigma_mm * sigma_mm * 1e-6 / 10.0;
  EXPECT_GT(held, 0.85);
  EXPECT_LT(held, 0.95);
}

TEST(ScenarioFile, ContactsLeaveThePadOnlyByRolling) {
  const BlockTable block = BlockTable::load_or_build(block_around(silicone(LAYER_mm), 3.0), sensor_places(), FINGERTIP_TEST_TABLES);
  ScenarioOptions options;
  options.overhang_mm = 3.0;
  options.seconds = 60;
  options.margin_mm = 5.5; // to 10 of 12 mm
  try {
    written(make_scenario(options, table_of("sphere6")), &block);
    ADD_FAILURE() << "a contact left the pad";
  } catch (const Error &error) {
    EXPECT_NE(std::string(error.what()).find("leaves the pad, which ends at 12.0, 21.0 mm"), std::string::npos) << error.what();
  }
  options.margin_mm = 2.25;
  written(make_scenario(options, table_of("sphere6")), &block);
  options.kind = "rolloff";
  const Scenario rolls = make_scenario(options, table_of("sphere6"));
  EXPECT_EQ(rolls.episodes[0].tracks[0].edge_x_mm, 12.0);
  written(rolls, &block);
}

TEST(ScenarioFile, WithoutTangentialForceIsAsBefore) {
  for (const char *kind : {"taps", "twist"}) {
    const auto bytes = [&](const char *tangential) {
      return written(scenario_of(kind, [&](ScenarioOptions &o) {
        o.seconds = 20;
        o.tangential = tangential;
      }));
    };
    const File plain = bytes(""), none = bytes("0"), some = bytes("0.3");
    EXPECT_EQ(plain.bytes, none.bytes);
    EXPECT_EQ(plain.column.count("Qx_N"), 0u);
    EXPECT_EQ(plain.metadata.count("tangential"), 0u);
    EXPECT_EQ(some.column.count("Qx_N"), 1u);
    EXPECT_NE(plain.metadata.at("name"), some.metadata.at("name"));
  }
}

TEST(ScenarioFile, HasItsEffectsInIt) {
  const auto taps = [](const char *effects) {
    return scenario_of("taps", [&](ScenarioOptions &o) {
      o.seconds = 40;
      o.effects = parse_effects(effects);
    });
  };
  const Scenario scenario = taps("gain=5,drift=200,memory,aftereffect,branch=8");
  const File file = written(scenario), plain = written(taps("none"));
  Pad pad(scenario.options.effects, 15, LAYER_mm, 101325.0, *scenario.options.pad_seed);
  std::vector<double> base_Pa(15), reported_Pa(15);
  for (int ms = 0; ms <= 40000; ms += 5) {
    const double t_s = 1e-3 * ms;
    double peak_Pa = 0.0;
    for (std::size_t k = 0; k < 15; k++) {
      base_Pa[k] = plain.at("s" + std::to_string(k) + "_Pa", t_s);
      peak_Pa = std::max(peak_Pa, base_Pa[k]);
    }
    pad.report(t_s, base_Pa, reported_Pa);
    for (std::size_t k = 0; k < 15; k++) {
      const double steps_s = (pad.branches()[k].edge_degC - 8.0) / Pad::WARMING_K_s; // within a row's time
      if (std::abs(t_s - steps_s) > 0.1) {
        const double off_Pa = 1.0 + 2e-4 * peak_Pa + 4e-3 * std::abs(reported_Pa[k]);
        EXPECT_NEAR(file.at("s" + std::to_string(k) + "_Pa", t_s), reported_Pa[k], off_Pa) << t_s;
      }
    }
    EXPECT_NEAR(file.at("temperature_degC", t_s), pad.temperature_degC(t_s), 0.003);
  }
  const auto has = [&](const char *name, double unit, const auto &drawn) {
    const auto words = split(file.metadata.at(name), ' ');
    ASSERT_EQ(words.size(), 15u);
    for (std::size_t k = 0; k < 15; k++) {
      EXPECT_NEAR(to_double(words[k]).value(), drawn(k) / unit, 0.006) << name;
    }
  };
  has("gain_errors_percent", 0.01, [&](std::size_t k) { return pad.gain_errors()[k]; });
  has("drifts_Pa_s", 1.0, [&](std::size_t k) { return pad.drifts_Pa_s()[k]; });
  has("memories_percent", 0.01, [&](std::size_t k) { return pad.memories()[k].share; });
  has("memory_times_s", 1.0, [&](std::size_t k) { return pad.memories()[k].time_s; });
  has("aftereffects_percent", 0.01, [&](std::size_t k) { return pad.aftereffects()[k].share; });
  has("aftereffect_times_s", 1.0, [&](std::size_t k) { return pad.aftereffects()[k].time_s; });
  has("branch_steps_Pa", 1.0, [&](std::size_t k) { return pad.branches()[k].step_Pa; });
  EXPECT_EQ(file.metadata.at("effect_gain").substr(0, 4), "5 %;");
  EXPECT_EQ(file.metadata.at("temperature_degC"), "8");
  EXPECT_EQ(plain.metadata.at("temperature_degC"), "25");
  EXPECT_EQ(plain.metadata.count("aftereffects_percent"), 0u);
  EXPECT_EQ(plain.column.count("temperature_degC"), 0u);
}
