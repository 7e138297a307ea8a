#include "grasp/convert.hpp"
#include "grasp/settings.hpp"
#include "libfingertip/error.hpp"

#include <gtest/gtest.h>
#include <set>

using namespace fingertip;

namespace {

const GripperTraits &any() {
  return gripper_traits("2f85");
}

std::string error_of(const std::map<std::string, double> &wanted) {
  try {
    settings_for(any(), wanted);
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_value);
    return error.what();
  }
  return "";
}

} // namespace

TEST(GraspSettings, WithoutWishesTheyAreTheCoresForEveryGripper) {
  for (const GripperTraits &traits : gripper_models()) {
    const grip_traits core = core_traits(traits);
    grip_settings own{};
    grip_default_settings(&own, &core);
    const grip_settings settings = settings_for(traits, {});
    EXPECT_EQ(settings.mode, GRIP_MODE_HOLD);
    for (const GraspSetting &setting : grasp_settings()) {
      EXPECT_EQ(value_of(setting, settings), value_of(setting, own)) << setting.name;
      EXPECT_GE(value_of(setting, settings), setting.low) << setting.name;
      EXPECT_LE(value_of(setting, settings), setting.high) << setting.name;
    }
  }
}

TEST(GraspSettings, EveryFieldOfTheCoreIsThereOnce) {
  std::set<const void *> fields;
  std::set<std::string> names;
  grip_settings settings{};
  for (const GraspSetting &setting : grasp_settings()) {
    EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
    EXPECT_TRUE(fields
                    .insert(setting.number ? static_cast<const void *>(&setting.number(settings))
                                           : static_cast<const void *>(&setting.time(settings)))
                    .second)
        << setting.name;
  }
  /* mode is --fixed; all others are four bytes each */
  EXPECT_EQ(fields.size(), (sizeof(grip_settings) - offsetof(grip_settings, touch_mN)) / 4);
}

TEST(GraspSettings, TheRangesAreTheCores) {
  for (const GraspSetting &setting : grasp_settings()) {
    const std::string name = setting.name;
    for (const double value : {setting.low, setting.high}) {
      std::map<std::string, double> wanted = {{"cap", 100}, {name, value}};
      if (name == "first") {
        wanted["blind"] = 100;
      } else if (name == "blind") {
        wanted["first"] = 0.2;
      } else if (name == "open-width") {
        wanted[name] = std::min(value, any().stroke_mm);
      }
      const grip_settings settings = settings_for(any(), wanted);
      EXPECT_NEAR(value_of(setting, settings), wanted[name], 1e-3) << name;
    }
    for (const double value :
         {setting.low - 0.02 * setting.high - 0.01, setting.high * 1.01, 0.0 / 0.0}) {
      EXPECT_NE(error_of({{name, value}, {"cap", 100}}).find("--"), std::string::npos) << name;
      if (value < 0) {
        continue;
      }
      /* and the core would refuse it as well */
      grip_settings settings = settings_for(any(), {{"cap", 100}});
      const double scaled = value * setting.scale;
      if (setting.number) {
        setting.number(settings) = static_cast<std::int32_t>(scaled);
      } else {
        setting.time(settings) = static_cast<std::uint32_t>(scaled);
      }
      const grip_traits traits = core_traits(any());
      grip core;
      if (value == value) {
        EXPECT_EQ(grip_init(&core, &settings, &traits), FT_ERR_ARGUMENT) << name << " " << value;
      }
    }
  }
}

TEST(GraspSettings, DefaultsGiveWayButWishesDoNot) {
  const grip_settings settings = settings_for(any(), {{"cap", 5}});
  EXPECT_EQ(settings.blind_mN, 5000);
  EXPECT_EQ(settings_for(any(), {{"cap", 1}}).first_mN, 1000);
  EXPECT_NE(error_of({{"cap", 5}, {"blind", 6}}).find("--blind is not possible"),
            std::string::npos);
  EXPECT_NE(error_of({{"cap", 5}, {"fixed", 6}}).find("above --cap"), std::string::npos);
  EXPECT_NE(error_of({{"first", 3}, {"blind", 2}}).find("between --first and --cap"),
            std::string::npos);
  EXPECT_NE(error_of({{"open-width", 86}}).find("2f85 opens to 85.0 mm"), std::string::npos);
  EXPECT_EQ(settings_for(any(), {{"fixed", 4}}).mode, GRIP_MODE_FIXED);
  EXPECT_EQ(settings_for(any(), {{"fixed", 4}}).set_mN, 4000);
}

TEST(GraspSettings, ARecordingTellsThemAll) {
  const Metadata head =
      settings_metadata(settings_for(any(), {{"fixed", 4}, {"travel-cap", 7.5}, {"margin", 1.4}, {"slid", 1.5}}));
  const auto has = [&](const std::string &key, const std::string &value) {
    return std::find(head.begin(), head.end(), std::pair(key, value)) != head.end();
  };
  EXPECT_TRUE(has("grasp_mode", "fixed"));
  EXPECT_TRUE(has("grasp_fixed", "4 N"));
  EXPECT_TRUE(has("grasp_travel_cap", "7.5 mm"));
  EXPECT_TRUE(has("grasp_margin", "1.4"));
  EXPECT_TRUE(has("grasp_slid", "1.5"));
  EXPECT_EQ(head.size(), grasp_settings().size() + 1);
}
