#include "grasp/settings.hpp"
#include "libfingertip/error.hpp"

#include <algorithm>
#include <cstddef>
#include <gtest/gtest.h>
#include <set>

using namespace fingertip;

static const GripperTraits &any() { return gripper_traits("2f85"); }

static std::string error_of(const std::map<std::string, double> &wanted) {
  try {
    settings_for(any(), wanted);
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_value);
    return error.what();
  }
  return "";
}

TEST(GraspSettings, WithoutWishesTheyAreTheGrippersDefaults) {
  for (const GripperTraits &traits : gripper_models()) {
    const GripSettings own = default_settings(traits), settings = settings_for(traits, {});
    EXPECT_EQ(settings.mode, GRIP_MODE_HOLD);
    for (const GraspSetting &setting : grasp_settings()) {
      EXPECT_EQ(value_of(setting, settings), value_of(setting, own)) << setting.name;
      EXPECT_GE(value_of(setting, settings), setting.low) << setting.name;
      EXPECT_LE(value_of(setting, settings), setting.high) << setting.name;
    }
  }
}

TEST(GraspSettings, EveryFieldIsThereOnce) {
  std::set<const double *> fields;
  std::set<std::string> names;
  GripSettings settings;
  for (const GraspSetting &setting : grasp_settings()) {
    EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
    EXPECT_TRUE(fields.insert(&(settings.*setting.field)).second) << setting.name;
  }
  /* mode is --fixed; all others are doubles */
  EXPECT_EQ(fields.size(), (sizeof(GripSettings) - offsetof(GripSettings, touch_N)) / sizeof(double));
}

TEST(GraspSettings, RangesHold) {
  for (const GraspSetting &setting : grasp_settings()) {
    const std::string name = setting.name;
    for (const double value : {setting.low, setting.high}) {
      std::map<std::string, double> wanted = {{"cap", 100}, {name, value}};
      if (name == "start") {
        wanted["blind"] = 100;
      } else if (name == "blind") {
        wanted["start"] = 0.2;
      } else if (name == "open-width") {
        wanted[name] = std::min(value, any().stroke_mm);
      } else if (name == "cap") {
        wanted[name] = std::max(value, 5.0);
      }
      const GripSettings settings = settings_for(any(), wanted);
      EXPECT_NEAR(value_of(setting, settings), wanted[name], 1e-9 + 1e-9 * value) << name;
    }
    for (const double value : {setting.low - 0.02 * setting.high - 0.01, setting.high * 1.01, 0.0 / 0.0}) {
      std::map<std::string, double> wanted = {{"cap", 100}};
      wanted[name] = value;
      EXPECT_NE(error_of(wanted).find("--" + name), std::string::npos) << name;
    }
  }
}

TEST(GraspSettings, DefaultsGiveWayButWishesDoNot) {
  EXPECT_EQ(settings_for(any(), {{"cap", 5}}).blind_N, 5.0);
  EXPECT_EQ(settings_for(any(), {{"cap", 3}}).start_N, 3.0);
  EXPECT_NE(error_of({{"cap", 5}, {"blind", 6}}).find("--blind is not possible"), std::string::npos);
  EXPECT_NE(error_of({{"cap", 5}, {"fixed", 6}}).find("above --cap"), std::string::npos);
  EXPECT_NE(error_of({{"start", 3}, {"blind", 2}}).find("between --start and --cap"), std::string::npos);
  EXPECT_NE(error_of({{"open-width", 86}}).find("2f85 opens to 85.0 mm"), std::string::npos);
  EXPECT_EQ(settings_for(any(), {{"fixed", 4}}).mode, GRIP_MODE_FIXED);
  EXPECT_EQ(settings_for(any(), {{"fixed", 4}}).set_N, 4.0);
}

TEST(GraspSettings, PresetsStayWellBelowWhatBreaks) {
  for (const GraspPreset &preset : grasp_presets()) {
    const auto values = preset_values(preset.name);
    EXPECT_LE(values.at("cap"), 0.85 * preset.breaks_N);
    EXPECT_LE(values.at("start"), 0.5 * preset.breaks_N);
    EXPECT_LE(values.at("floor"), values.at("start"));
  }
  EXPECT_THROW(preset_values("anvil"), Error);
}

TEST(GraspSettings, AGripperWhoseStepExceedsTheCapIsRefused) {
  EXPECT_NE(error_of(preset_values("crisp")).find("a step of a 2f85, 0.37 mm"), std::string::npos);
  EXPECT_EQ(error_of(preset_values("cup")), "");
  EXPECT_NO_THROW(settings_for(gripper_traits("sts3215"), preset_values("crisp")));
}
