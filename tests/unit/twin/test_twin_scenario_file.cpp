// Scenarios as files: the pressure on the base that they hold, its effects and its ends.
#include "libfingertip/error.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"
#include "scenes.hpp"
#include "simulation/twin/scenario_file.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

namespace {

using namespace fingertip;
using namespace fingertip::twin;

struct File {
  std::map<std::string, std::string> metadata;
  std::map<std::string, std::size_t> column;
  std::vector<std::vector<double>> rows;
  std::string bytes;

  double at(const std::string &name, double t_s) const {
    const auto after = std::lower_bound(rows.begin(), rows.end(), t_s,
                                        [](const std::vector<double> &row, double t) { return row[0] < t; });
    const std::size_t c = column.at(name);
    if (after == rows.begin() || after == rows.end()) {
      return (after == rows.begin() ? rows.front() : rows.back())[c];
    }
    const std::vector<double> &a = *(after - 1), &b = *after;
    return a[c] + (b[c] - a[c]) * (t_s - a[0]) / (b[0] - a[0]);
  }
};

File written(const Scenario &scenario, const BlockTable *block = nullptr) {
  const std::string path = testing::TempDir() + "twin_scenario.csv";
  const std::string &first = scenario.options.indenter, &second = scenario.options.second_indenter;
  write_scenario(scenario, silicone(LAYER_mm), table_of(first), table_of(second.empty() ? first : second), block, path,
                 true);
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
  const double off_Pa =
      table.base_pressure_Pa(5.0, 2.5 * width_mm, 0.0) - table.base_pressure_Pa(5.0, 2.5 * width_mm, 0.0, 0.05);
  EXPECT_NEAR(off_Pa, 0.05 * std::exp(-0.5) * middle_Pa, 1e-6 * middle_Pa);
  EXPECT_LT(table.base_pressure_Pa(5.0, 0.0, 4.0 * width_mm, 0.05), -0.005 * middle_Pa);
  EXPECT_EQ(table.base_pressure_Pa(0.0, 1.0, 1.0, 0.05), 0.0);
}

TEST(ScenarioFile, IsThePressureOnTheBaseWithinItsTolerance) {
  for (const char *kind : {"taps", "slip", "rolloff"}) {
    const double dip_share = kind == std::string("taps") ? 0.05 : 0.0;
    const Scenario scenario = scenario_of(kind, [&](ScenarioOptions &o) {
      o.seconds = 30;
      o.effects = parse_effects(dip_share > 0.0 ? "dip=5" : "none");
    });
    const File file = written(scenario);
    Random random(7, 7, 7);
    for (int i = 0; i < 3000; i++) {
      const double t_s = 1e-3 * std::round(random.uniform(0.0, 30000.0)); // where it was computed
      const auto episode = std::find_if(scenario.episodes.begin(), scenario.episodes.end(),
                                        [&](const Episode &one) { return t_s >= one.begin_s && t_s < one.end_s; });
      const bool touched = episode != scenario.episodes.end();
      const Touch touch = touched ? episode->tracks[0].at(t_s - episode->begin_s) : Touch{};
      double peak_Pa = 0.0, expected[15];
      for (int k = 0; k < 15; k++) {
        expected[k] = table_of("sphere6").base_pressure_Pa(touch.force_N, double(geometry.x_mm[k]) - touch.x_mm,
                                                           double(geometry.y_mm[k]) - touch.y_mm, dip_share);
        peak_Pa = std::max(peak_Pa, std::abs(expected[k]));
      }
      for (int k = 0; k < 15; k++) {
        EXPECT_NEAR(file.at("s" + std::to_string(k) + "_Pa", t_s), expected[k], 0.25 + 1.1e-4 * peak_Pa)
            << kind << " " << t_s;
      }
      EXPECT_NEAR(file.at("force_N", t_s), touch.force_N, 2e-4 + 1.1e-4 * touch.force_N);
      EXPECT_NEAR(file.at("contact", t_s), touch.force_N > 0.0, 1e-9);
      EXPECT_NEAR(file.at("slip", t_s), touched && episode->slips(t_s), 1e-9) << t_s;
      if (touch.force_N > 0.0) {
        EXPECT_NEAR(file.at("x_mm", t_s), touch.x_mm, 3e-3);
        EXPECT_NEAR(file.at("y_mm", t_s), touch.y_mm, 3e-3);
      }
    }
  }
}

TEST(ScenarioFile, IsSparseWhereNothingHappens) {
  const File file = written(scenario_of("grid"));
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
        const double rest =
            table_of("sphere6").base_pressure_Pa(10.0, x, y) - p0 * std::exp(-(x * x + y * y) / (2 * sigma * sigma));
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

TEST(ScenarioFile, AddsTwoContactsAndTurnsObjects) {
  const Scenario two = scenario_of("two", [](ScenarioOptions &o) {
    o.seconds = 5;
    o.second_indenter = "cube6";
  });
  const File file = written(two);
  const Episode &episode = two.episodes[0];
  const double t_s = episode.begin_s + 0.4;
  const Touch a = episode.tracks[0].at(0.4), b = episode.tracks[1].at(0.4);
  for (int k = 0; k < 15; k++) {
    const double x = double(geometry.x_mm[k]), y = double(geometry.y_mm[k]);
    EXPECT_NEAR(file.at("s" + std::to_string(k) + "_Pa", t_s),
                table_of("sphere6").base_pressure_Pa(a.force_N, x - a.x_mm, y - a.y_mm) +
                    table_of("cube6").base_pressure_Pa(b.force_N, x - b.x_mm, y - b.y_mm),
                3.0);
  }
  EXPECT_NEAR(file.at("force_N", t_s), a.force_N + b.force_N, 1e-3);
  EXPECT_NEAR(file.at("x_mm", t_s), (a.force_N * a.x_mm + b.force_N * b.x_mm) / (a.force_N + b.force_N), 3e-3);
  EXPECT_EQ(file.at("p0_Pa", t_s), 0.0);
  EXPECT_EQ(file.metadata.at("second_indenter").substr(0, 5), "cube6");
}

TEST(ScenarioFile, TurnsObjects) {
  ScenarioOptions options;
  options.kind = "twist";
  options.indenter = "cube6";
  options.seconds = 10;
  const Scenario scenario = make_scenario(options, table_of("cube6"));
  const File file = written(scenario);
  // The pressure is the same after a quarter turn, another after an eighth.
  const Episode &episode = scenario.episodes[0];
  const Phase &twist = episode.phases[2];
  EXPECT_EQ(twist.name, "twist");
  const auto angle = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s).angle_rad; };
  EXPECT_NEAR(angle(twist.end_s) - angle(twist.begin_s), M_PI / 2, 1e-9);
  const double middle_s = 0.5 * (twist.begin_s + twist.end_s);
  double difference_Pa = 0.0, peak_Pa = 0.0;
  for (int k = 0; k < 15; k++) {
    const std::string name = "s" + std::to_string(k) + "_Pa";
    EXPECT_NEAR(file.at(name, twist.begin_s), file.at(name, twist.end_s), 6.0) << k;
    difference_Pa = std::max(difference_Pa, std::abs(file.at(name, twist.begin_s) - file.at(name, middle_s)));
    peak_Pa = std::max(peak_Pa, file.at(name, middle_s));
  }
  EXPECT_GT(difference_Pa, 1e-3 * peak_Pa);
}

TEST(ScenarioFile, HasTheTangentialPressureInIt) {
  static const TractionTable round(table_of("sphere6"), silicone(LAYER_mm));
  static const TractionTable flat(table_of("cube6"), silicone(LAYER_mm));
  for (const char *kind : {"taps", "lift", "two", "twist"}) {
    const bool cube = std::string(kind) == "twist";
    ScenarioOptions options;
    options.kind = kind;
    options.seconds = 30;
    options.indenter = cube ? "cube6" : "sphere6";
    options.tangential = "0.35";
    const ContactTable &pressure = table_of(options.indenter);
    const TractionTable &traction = cube ? flat : round;
    const Scenario scenario = make_scenario(options, pressure);
    const File file = written(scenario);
    EXPECT_EQ(file.metadata.at("tangential"), "0.35");
    double most_Pa = 0.0;
    for (double t_s = 0.05; t_s < 30.0; t_s += 0.05) {
      std::array<double, 15> expected_Pa{};
      double pull_x_N = 0.0, pull_y_N = 0.0, force_N = 0.0, peak_Pa = 0.0;
      for (const Episode &episode : scenario.episodes) {
        for (const Track &track : episode.tracks) {
          const Touch touch = track.at(t_s - episode.begin_s);
          if (t_s < episode.begin_s || t_s >= episode.end_s) {
            continue;
          }
          force_N += touch.force_N;
          pull_x_N += touch.pull_x_N;
          pull_y_N += touch.pull_y_N;
          // Turns by the object's angle: places and forces in its own axes.
          const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
          for (std::size_t k = 0; k < 15; k++) {
            const double x = double(geometry.x_mm[k]) - touch.x_mm;
            const double y = double(geometry.y_mm[k]) - touch.y_mm;
            const TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                           c * touch.pull_y_N - s * touch.pull_x_N};
            const double sheared_Pa = traction.base_pressure_Pa(load, c * x + s * y, c * y - s * x);
            most_Pa = std::max(most_Pa, std::abs(sheared_Pa));
            expected_Pa[k] += pressure.base_pressure_Pa(touch.force_N, c * x + s * y, c * y - s * x) + sheared_Pa;
            peak_Pa = std::max(peak_Pa, std::abs(expected_Pa[k]));
          }
        }
      }
      for (std::size_t k = 0; k < 15; k++) {
        EXPECT_NEAR(file.at("s" + std::to_string(k) + "_Pa", t_s), expected_Pa[k], 0.25 + 1.1e-4 * peak_Pa)
            << kind << " " << t_s;
      }
      EXPECT_NEAR(file.at("Qx_N", t_s), pull_x_N, 2e-4 + 1.1e-4 * force_N);
      EXPECT_NEAR(file.at("Qy_N", t_s), pull_y_N, 2e-4 + 1.1e-4 * force_N);
    }
    EXPECT_GT(most_Pa, 1000.0) << kind;
  }
}

TEST(ScenarioFile, HasThePadsEdgesInIt) {
  const Block pad = block_around(silicone(LAYER_mm), 6.0);
  EXPECT_EQ(pad.half_x_mm, 15.0);
  EXPECT_EQ(pad.half_y_mm, 24.0);
  const BlockTable block = BlockTable::load_or_build(pad, sensor_places(), FINGERTIP_TEST_TABLES);
  for (const char *kind : {"taps", "lift", "two"}) {
    ScenarioOptions options;
    options.kind = kind;
    options.seconds = 20;
    options.tangential = "0.35";
    options.overhang_mm = 6.0;
    const Scenario scenario = make_scenario(options, table_of("sphere6"));
    EXPECT_NE(scenario.name.find("-overhang6-"), std::string::npos);
    const File ends = written(scenario, &block), endless = written(scenario);
    EXPECT_EQ(ends.metadata.at("overhang_mm"), "6");
    double most_Pa = 0.0;
    for (double t_s = 0.05; t_s < 20.0; t_s += 0.05) {
      std::array<double, 15> added_Pa{};
      for (const Episode &episode : scenario.episodes) {
        for (const Track &track : episode.tracks) {
          const Touch touch = track.at(t_s - episode.begin_s);
          if (t_s < episode.begin_s || t_s >= episode.end_s) {
            continue;
          }
          for (std::size_t k = 0; k < 15; k++) {
            added_Pa[k] += block.added_Pa(
                k,
                {touch.force_N, touch.pull_x_N, touch.pull_y_N, table_of("sphere6").contact_radius_mm(touch.force_N)},
                touch.x_mm, touch.y_mm);
            most_Pa = std::max(most_Pa, std::abs(added_Pa[k]));
          }
        }
      }
      double peak_Pa = 0.0;
      for (int k = 0; k < 15; k++) {
        peak_Pa = std::max(peak_Pa, endless.at("s" + std::to_string(k) + "_Pa", t_s));
      }
      for (std::size_t k = 0; k < 15; k++) {
        const std::string name = "s" + std::to_string(k) + "_Pa";
        EXPECT_NEAR(ends.at(name, t_s) - endless.at(name, t_s), added_Pa[k], 0.5 + 2.4e-4 * peak_Pa)
            << kind << " " << t_s;
      }
    }
    EXPECT_GT(most_Pa, 400.0) << kind;
  }
}

TEST(ScenarioFile, ContactsLeaveThePadOnlyByRolling) {
  const BlockTable block =
      BlockTable::load_or_build(block_around(silicone(LAYER_mm), 3.0), sensor_places(), FINGERTIP_TEST_TABLES);
  ScenarioOptions options;
  options.overhang_mm = 3.0;
  options.seconds = 60;
  options.margin_mm = 5.5; // to 10 of 12 mm
  try {
    written(make_scenario(options, table_of("sphere6")), &block);
    ADD_FAILURE() << "a contact left the pad";
  } catch (const Error &error) {
    EXPECT_NE(std::string(error.what()).find("leaves the pad, which ends at 12.0, 21.0 mm"), std::string::npos)
        << error.what();
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
  const File file = written(scenario_of("taps", [](ScenarioOptions &o) {
    o.seconds = 40;
    o.effects = parse_effects("gain=5,drift=200,temperature=8");
  }));
  const File plain = written(scenario_of("taps", [](ScenarioOptions &o) { o.seconds = 40; }));
  EXPECT_EQ(file.metadata.at("effect_gain").substr(0, 4), "5 %;");
  const auto gains = split(file.metadata.at("gain_errors_percent"), ' ');
  const auto drifts = split(file.metadata.at("drifts_Pa_s"), ' ');
  ASSERT_EQ(gains.size(), 15u);
  ASSERT_EQ(drifts.size(), 15u);
  for (double t_s : {0.0, 1.7, 15.2, 22.22, 39.9}) {
    for (std::size_t k = 0; k < 15; k++) {
      const std::string name = "s" + std::to_string(k) + "_Pa";
      const double expected =
          plain.at(name, t_s) * (1 + 0.01 * to_double(gains[k]).value()) + to_double(drifts[k]).value() * t_s;
      EXPECT_NEAR(file.at(name, t_s), expected, 0.5 + 2e-4 * std::abs(expected)) << t_s;
    }
  }
  EXPECT_NEAR(file.at("temperature_degC", 39.9), 25 + 8 * (1 - std::exp(-39.9 / 486.3)), 0.01);
  EXPECT_EQ(plain.column.count("temperature_degC"), 0u);
}

TEST(ScenarioFile, HasAftereffectsAndAColdBeginningInIt) {
  const Scenario scenario = scenario_of("taps", [](ScenarioOptions &o) {
    o.seconds = 40;
    o.effects = parse_effects("aftereffect,branch=8");
  });
  const File file = written(scenario);
  const File plain = written(scenario_of("taps", [](ScenarioOptions &o) { o.seconds = 40; }));
  const File cold = written(scenario_of("taps", [](ScenarioOptions &o) {
    o.seconds = 40;
    o.effects = parse_effects("branch=8");
  }));
  const auto shares = split(file.metadata.at("aftereffects_percent"), ' ');
  const auto times_s = split(file.metadata.at("aftereffect_times_s"), ' ');
  const auto steps_Pa = split(file.metadata.at("branch_steps_Pa"), ' ');
  ASSERT_EQ(shares.size(), 15u);
  ASSERT_EQ(times_s.size(), 15u);
  ASSERT_EQ(steps_Pa.size(), 15u);
  EXPECT_EQ(file.metadata.at("temperature_degC"), "8");
  EXPECT_NEAR(file.at("temperature_degC", 17.0), 9.7, 0.003);
  // From the first release on, a share of its peak; after the branch, near 17 s, the step.
  const double end_s = scenario.episodes[0].end_s, wait_s = scenario.episodes[1].begin_s - end_s;
  ASSERT_GT(wait_s, 1.0);
  ASSERT_LT(end_s, 16.0);
  ASSERT_EQ(plain.at("contact", 39.9), 0.0);
  for (std::size_t k = 0; k < 15; k++) {
    const std::string name = "s" + std::to_string(k) + "_Pa";
    double peak_Pa = 0.0;
    for (double t_s = 0.0; t_s < end_s; t_s += 0.01) {
      peak_Pa = std::max(peak_Pa, plain.at(name, t_s));
    }
    const double share = 0.01 * to_double(shares[k]).value();
    const double tau_s = to_double(times_s[k]).value();
    const double later = file.at(name, end_s + 0.9), sooner = file.at(name, end_s + 0.1);
    EXPECT_NEAR(later, sooner * std::exp(-0.8 / tau_s), 1.0) << k;
    // The release takes a moment, in which some is forgotten.
    EXPECT_LE(std::abs(sooner), std::abs(share) * peak_Pa + 0.5) << k;
    EXPECT_GE(std::abs(sooner), std::abs(share) * peak_Pa * std::exp(-0.5 / tau_s) - 0.5) << k;
    EXPECT_GE(sooner * share, -0.01) << k;
    EXPECT_EQ(cold.at(name, 16.0), plain.at(name, 16.0)) << k;
    EXPECT_NEAR(cold.at(name, 39.9), to_double(steps_Pa[k]).value(), 0.01) << k;
  }
  EXPECT_EQ(plain.metadata.count("aftereffects_percent"), 0u);
  EXPECT_EQ(plain.metadata.at("temperature_degC"), "25");
}

} // namespace
