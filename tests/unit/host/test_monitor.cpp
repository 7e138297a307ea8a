/* What the monitor draws, and how much of it goes to the terminal. */
#include "libfingertip/names.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"
#include "tool/cli/monitor.hpp"
#include "tool/cli/painter.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

using namespace fingertip;

constexpr std::uint32_t FITTED =
    CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_TARED;

static Model model_with_info() {
  Model model;
  model.set_state(Model::State::replay);
  model.take(test::make_info(0, 0));
  model.take(test::make_health(0, 0));
  return model;
}

constexpr std::uint32_t PULLED = FITTED | CONTACT_FLAG_TANGENTIAL_VALID;

/* Of a fingertip that can tell tangential load. */
static Model model_of_grasp(bool with_pad) {
  Model model = model_with_info();
  wire_packet info = test::make_info(0, 0);
  info.body.info.capabilities |= WIRE_CAPABILITY_TANGENTIAL;
  if (with_pad) {
    info.body.info.stored = WIRE_STORED_PAD;
    info.body.info.pad = pad_of_12_mm();
  }
  model.take(info);
  return model;
}

struct Pull {
  float qx_N = 0, qy_N = 0, sd_N = 0.05f;
};

/* A contact of 5.7 mm and 5 N, and what the sensors under it measure. */
static void take_frame(Model &model, std::uint64_t t_us, std::uint32_t frame, float x_mm, float y_mm, float force_N, std::uint32_t flags,
                       const Pull &pull = {}) {
  constexpr float sigma_mm = 5.7f, pi = 3.14159265f;
  float p0_Pa = force_N / (2 * pi * sigma_mm * sigma_mm * 1e-6f);
  wire_packet contact = test::make_contact(0, t_us, frame);
  contact.body.contact.flags = flags;
  contact.body.contact.x_mm = x_mm;
  contact.body.contact.y_mm = y_mm;
  contact.body.contact.p0_Pa = p0_Pa;
  contact.body.contact.sigma_mm = sigma_mm;
  contact.body.contact.force_N = force_N;
  contact.body.contact.qx_N = pull.qx_N;
  contact.body.contact.qy_N = pull.qy_N;
  contact.body.contact.q_sd_N = pull.sd_N;
  contact.body.contact.tangential_ratio = std::hypot(pull.qx_N, pull.qy_N) / force_N;
  model.take(contact);
  wire_packet raw = test::make_raw(0, t_us, frame);
  raw.body.raw.flags = flags & (CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED);
  raw.body.raw.valid = 0x7FFF;
  raw.body.raw.saturated = raw.body.raw.doubtful = 0;
  const wire_info &info = *model.info();
  for (int k = 0; k < info.sensor_count; k++) {
    float dx = info.x_mm[k] - x_mm, dy = info.y_mm[k] - y_mm;
    float Pa = p0_Pa * std::exp(-(dx * dx + dy * dy) / (2 * sigma_mm * sigma_mm));
    raw.body.raw.baseline_Pa_q10[k] = flags & CONTACT_FLAG_TARED ? 101325 * 1024 : 0;
    raw.body.raw.pressure_Pa_q10[k] = 101325 * 1024 + static_cast<std::int32_t>(Pa * 1024);
  }
  model.take(raw);
}

/* After two seconds of one contact, 50 frames a second. */
static Model touched(Model model, float x_mm, float y_mm, std::uint32_t flags = FITTED, const Pull &pull = {}) {
  for (std::uint32_t frame = 0; frame < 100; frame++) {
    take_frame(model, 1000000 + 20000 * frame, frame, x_mm, y_mm, 5, flags, pull);
  }
  return model;
}

static std::string text_of(const Canvas &canvas) {
  std::string text;
  for (int row = 0; row < canvas.rows(); row++) {
    for (int column = 0; column < canvas.columns(); column++) {
      const Canvas::Cell &cell = canvas.cell(column, row);
      text += cell.halves ? " " : cell.character;
    }
    text += "\n";
  }
  return text;
}

static bool shows(const Canvas &canvas, const std::string &text) { return text_of(canvas).find(text) != std::string::npos; }

static Canvas one(const Model &model, int columns = 80, int rows = 24) {
  return draw_monitor({model}, {"keys", "note", ""}, columns, rows);
}

/* Bytes in ten seconds at 25 pictures a second, of a contact that never rests: a circle of 8 by
 * 16 mm in two seconds, as tests/support/fake_device.cpp plays it, its force from 1 to 9 N. */
struct Sent {
  std::size_t changes = 0, all = 0;
};

static Sent sent_in_ten_seconds(int columns, int rows, std::uint32_t flags) {
  Model model = flags & CONTACT_FLAG_TANGENTIAL_VALID ? model_of_grasp(true) : model_with_info();
  Painter painter(ColourDepth::truecolour, Characters::utf_8);
  Sent sent;
  constexpr int rate_per_s = 400, per_picture = 16;
  for (std::uint32_t frame = 0; frame < 10 * rate_per_s; frame++) {
    float t_s = static_cast<float>(frame) / rate_per_s;
    take_frame(model, 1000000 + frame * (1000000 / rate_per_s), frame, 8 * std::cos(3.14f * t_s), 16 * std::sin(3.14f * t_s),
               5 + 4 * std::sin(t_s), flags, {2 * std::cos(5 * t_s), 2 * std::sin(5 * t_s), 0.2f});
    if (frame % per_picture == 0) {
      Canvas canvas = one(model, columns, rows);
      sent.changes += painter.paint(canvas).size();
      Painter again(ColourDepth::truecolour, Characters::utf_8);
      sent.all += again.paint(canvas).size();
    }
  }
  return sent;
}

static void report(const std::string &json) {
  if (const char *path = std::getenv("FINGERTIP_REPORT")) {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream(path) << json;
  }
}

TEST(Monitor, SendsATenthOfWhatFullPicturesTook) {
  /* Measured at 200 x 60 before: every cell at 25 Hz, 2.3 MB/s. */
  constexpr std::size_t before = 23000000;
  Sent sent = sent_in_ten_seconds(200, 60, FITTED);
  EXPECT_LE(sent.changes, before / 10);
  EXPECT_LT(sent.changes, sent.all / 2);
  EXPECT_LE(sent_in_ten_seconds(200, 60, FITTED | CONTACT_FLAG_UNCERTAIN).changes, before / 10);
  Sent pulled = sent_in_ten_seconds(200, 60, PULLED);
  EXPECT_LE(pulled.changes, before / 10) << "an arrow that turns with it";
  report("{\n  \"monitor_200x60_10_s_bytes\": " + std::to_string(sent.changes) + ",\n  \"monitor_200x60_10_s_bytes_of_grasp\": " +
         std::to_string(pulled.changes) + ",\n  \"monitor_200x60_10_s_bytes_of_full_pictures\": " + std::to_string(sent.all) + "\n}\n");
}

TEST(Monitor, SendsNothingWhereNothingChanged) {
  Model model = model_with_info();
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, FITTED);
  Painter painter(ColourDepth::truecolour, Characters::utf_8);
  EXPECT_GT(painter.paint(one(model)).size(), 1000u);
  EXPECT_EQ(painter.paint(one(model)), "");
  painter.forget();
  EXPECT_GT(painter.paint(one(model)).size(), 1000u);
  EXPECT_NE(painter.paint(one(model, 81)).find("\x1b[2J"), std::string::npos) << "another size";
}

TEST(Monitor, ADoubtfulLocationLooksDoubtful) {
  Model model = model_with_info();
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, FITTED);
  Canvas good = one(model);
  EXPECT_TRUE(shows(good, "5.00 N")) << text_of(good);
  EXPECT_TRUE(shows(good, "┼"));
  Model all = model_with_info();
  take_frame(all, 1000000, 1, 1, 2, 5, 0x7FFFF);
  for (std::uint32_t flag : {CONTACT_FLAG_LOW_SIGNAL, CONTACT_FLAG_FLAT, CONTACT_FLAG_UNCERTAIN, CONTACT_FLAG_MODEL, CONTACT_FLAG_SATURATED,
                             CONTACT_FLAG_FORCE_LOWER_BOUND, CONTACT_FLAG_SENSOR_MASKED, CONTACT_FLAG_AT_BOUND, CONTACT_FLAG_ELONGATED,
                             CONTACT_FLAG_ZERO_DOUBTFUL, CONTACT_FLAG_SENSOR_DOUBTFUL}) {
    EXPECT_TRUE(shows(one(all), flags_text(flag))) << text_of(one(all));
    take_frame(model, 2000000, 2, 4.5f, 4.5f, 5, FITTED | flag);
    Canvas doubtful = one(model);
    EXPECT_TRUE(shows(doubtful, "5.00?N")) << text_of(doubtful);
    EXPECT_TRUE(shows(doubtful, "x   +4.50?") && shows(doubtful, "y   +4.50?")) << text_of(doubtful);
    EXPECT_FALSE(shows(doubtful, "┼")) << text_of(doubtful);
    EXPECT_TRUE(shows(doubtful, "╌")) << text_of(doubtful);
  }
  EXPECT_TRUE(shows(one(model), "SENSOR_DOUBTFUL, a sensor is in doubt"));
  take_frame(model, 3000000, 3, 4.5f, 4.5f, 5, FITTED | CONTACT_FLAG_UNCERTAIN);
  EXPECT_TRUE(shows(one(model), "UNCERTAIN, may be off by more than 0.60 mm"));
  take_frame(model, 4000000, 4, 4.5f, 4.5f, 5, FITTED | CONTACT_FLAG_FORCE_LOWER_BOUND);
  EXPECT_TRUE(shows(one(model), "≥5.00?N"));
  take_frame(model, 5000000, 5, 1, 2, 5, CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED);
  Canvas unfitted = one(model);
  EXPECT_TRUE(shows(unfitted, "contact, no location")) << text_of(unfitted);
  EXPECT_FALSE(shows(unfitted, "+4.50"));
}

TEST(Monitor, AForceAtLiftOffDoesNotScaleTheTrace) {
  Model model = touched(model_with_info(), 1, 2);
  Canvas before = one(model);
  take_frame(model, 3050000, 100, -40, 2, 76254, FITTED | CONTACT_FLAG_AT_BOUND);
  Canvas after = one(model);
  EXPECT_TRUE(shows(before, "force  5 N┤")) << text_of(before);
  EXPECT_TRUE(shows(after, "force  5 N┤")) << text_of(after);
  EXPECT_TRUE(shows(after, "76254.00?N")) << text_of(after);
}

TEST(Monitor, TracesHaveAxesAndSensorsNumbersAndBothPressures) {
  Model model = touched(model_with_info(), 0, 0);
  Canvas canvas = one(model, 120, 40);
  for (const char *text : {"-15┤", "-24┤", "-5", "no., measured, fitted"}) {
    EXPECT_TRUE(shows(canvas, text)) << text << "\n" << text_of(canvas);
  }
  for (int k = 0; k < 15; k++) {
    EXPECT_TRUE(shows(canvas, " " + std::to_string(k) + " ")) << k << "\n" << text_of(canvas);
  }
  /* Of 5 N over 2 pi (5.7 mm)^2, 24.5 kPa, exp(-81 / 2 / 5.7^2) at 9 mm: 7.0 kPa; over a gain of a half 14 kPa. */
  wire_packet info = test::make_info(0, 0);
  info.body.info.stored = WIRE_STORED_CALIBRATION;
  EXPECT_TRUE(shows(canvas, "7.0")) << text_of(canvas);
  info.body.info.calibration = test::make_calibration();
  for (int k = 0; k < 15; k++) {
    info.body.info.calibration.sensors[k].gain = 0.5f;
  }
  model.take(info);
  EXPECT_TRUE(shows(one(model, 120, 40), "14")) << text_of(one(model, 120, 40));
}

TEST(Monitor, WhileTaringThereAreNoPressures) {
  Model model = model_with_info();
  take_frame(model, 1000000, 1, 1, 2, 5, 0);
  EXPECT_FALSE(shows(one(model), "101"));
  EXPECT_TRUE(shows(one(model), "no zero yet"));
}

TEST(Monitor, WhatIsGoneHasNoRateAndNoNumbers) {
  Model model = touched(model_with_info(), 4.5f, 4.5f);
  EXPECT_TRUE(shows(one(model), "frames/s   50.0"));
  model.set_state(Model::State::gone);
  Canvas gone = one(model);
  EXPECT_TRUE(shows(gone, "frames/s      -")) << text_of(gone);
  EXPECT_TRUE(shows(gone, "gone, plug it in again"));
  EXPECT_FALSE(shows(gone, "5.00 N"));
}

TEST(Monitor, EachCounterIsColouredByItself) {
  Model model = model_with_info();
  wire_packet health = test::make_health(0, 0);
  health.body.health.bus_timeouts = health.body.health.bus_recoveries = health.body.health.fit_failures =
      health.body.health.packets_dropped = 0;
  health.body.health.bus_nacks = 1;
  model.take(health);
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, FITTED);
  Canvas canvas = one(model);
  /* The colour of the number after a label. */
  auto colour_after = [&](const std::string &label) {
    for (int row = 0; row < canvas.rows(); row++) {
      std::string line;
      for (int column = 0; column < canvas.columns(); column++) {
        const std::string &character = canvas.cell(column, row).character;
        line += character.size() == 1 ? character : "?";
      }
      auto at = line.find(label);
      if (at != std::string::npos) {
        auto digit = line.find_first_of("0123456789", at);
        return canvas.cell(static_cast<int>(digit), row).style.front;
      }
    }
    return std::optional<Colour>();
  };
  auto plain = colour_after("stack free");
  ASSERT_TRUE(plain);
  EXPECT_FALSE(colour_after("NACKs") == plain);
  for (const char *zero : {"timeouts", "recoveries", "no fit", "device drops", "dropped"}) {
    EXPECT_TRUE(colour_after(zero) == plain) << zero;
  }
}

TEST(Monitor, EverySizeIsLaidOut) {
  const Model plain = touched(model_with_info(), 4.5f, 4.5f);
  const Model pulled = touched(model_of_grasp(true), 4.5f, 4.5f, PULLED, {-1.5f, 0.2f});
  const std::pair<const Model &, std::vector<const char *>> cases[] = {
      {plain,
       {"E660583883265A2C", "5.00 N", "x   +4.50", "y   +4.50", "frames/s", "no fit", "NACKs", "convert", "force  ", "x    15 mm┤",
        "y    24 mm┤", "slip  1 mm┤", "0 s", "keys", "note", "╯"}},
      {pulled,
       {"x   +4.50", "qx  -1.50", "qy  +0.20", "Q/F 0.303", "SLIDING", "CONTACT", "force  5 N┤", "2 N┤", "slip  1 mm┤", "0 s", "NACKs"}}};
  for (const auto &[model, texts] : cases) {
    for (int columns = 80; columns <= 200; columns += 3) {
      for (int rows = 24; rows <= 60; rows++) {
        Canvas canvas = one(model, columns, rows);
        for (const char *text : texts) {
          ASSERT_TRUE(shows(canvas, text)) << text << " at " << columns << "x" << rows << "\n" << text_of(canvas);
        }
      }
    }
  }
  for (auto [columns, rows] : {std::pair{79, 24}, {80, 23}, {40, 10}, {10, 3}, {1, 1}}) {
    Canvas canvas = one(plain, columns, rows);
    EXPECT_TRUE(columns < 40 || shows(canvas, "window too small")) << text_of(canvas);
    EXPECT_TRUE(columns < 40 || shows(canvas, "5.00 N")) << text_of(canvas);
  }
  for (auto [columns, rows] : {std::pair{80, 24}, {80, 46}, {200, 60}}) {
    Canvas canvas = draw_monitor({pulled, pulled}, {"keys", "note", ""}, columns, rows);
    for (const char *text : {"-1.50", "+0.20", "Q/F ", "○ SLIDING", "force  5 N┤", "2 N┤", "slip  1 mm┤", "0 s"}) {
      EXPECT_TRUE(shows(canvas, text)) << text << "\n" << text_of(canvas);
    }
  }
}

TEST(Monitor, APullIsAnArrowAndNumbersAndTraces) {
  Model model = touched(model_of_grasp(true), -4.5f, -4.5f, PULLED, {1.5f, 0, 0.05f});
  Canvas canvas = one(model, 120, 40);
  for (const char *text : {"sd  0.050 N", "sd  0.010", "○ MOVING", "qx     2 N┤", "qy     2 N┤"}) {
    EXPECT_TRUE(shows(canvas, text)) << text << "\n" << text_of(canvas);
  }
  EXPECT_FALSE(shows(canvas, "since touch"));
  EXPECT_FALSE(shows(canvas, "no pad profile"));
  struct {
    float qx_N, qy_N;
    const char *head;
  } cases[] = {{1.5f, 0, "→"},      {1.1f, 1.1f, "↗"}, {0, 1.5f, "↑"},     {-1.1f, 1.1f, "↖"}, {-1.5f, 0, "←"},
               {-1.1f, -1.1f, "↙"}, {0, -1.5f, "↓"},   {1.1f, -1.1f, "↘"}, {1.5f, 0.5f, "→"},  {-1.5f, -0.5f, "←"}};
  for (const auto &[qx_N, qy_N, head] : cases) {
    take_frame(model, 4000000, 101, 4.5f, 4.5f, 5, PULLED, {qx_N, qy_N, 0.05f});
    EXPECT_TRUE(shows(one(model, 120, 40), head)) << head << "\n" << text_of(one(model, 120, 40));
  }
}

/* Where the head of an arrow to the right is, columns right of the location. */
int arrow_columns(const Model &model) {
  Canvas canvas = one(model, 200, 60);
  for (int row = 0; row < canvas.rows(); row++) {
    int cross = -1;
    for (int column = 0; column < canvas.columns(); column++) {
      const std::string &character = canvas.cell(column, row).character;
      if (!canvas.cell(column, row).halves && character == "┼") {
        cross = column;
      } else if (!canvas.cell(column, row).halves && character == "→" && cross >= 0) {
        return column - cross;
      }
    }
  }
  return 0;
}

TEST(Monitor, TheArrowIsAsLongAsTheLoadIsOfTheForce) {
  Model model = model_of_grasp(true);
  int lengths[3];
  for (int i = 0; i < 3; i++) {
    float ratio = 0.15f * static_cast<float>(i + 1);
    take_frame(model, 1000000, 1, -4.5f, 4.5f, 5, PULLED, {5 * ratio, 0, 0.05f});
    int of_5_N = lengths[i] = arrow_columns(model);
    take_frame(model, 1000000, 1, -4.5f, 4.5f, 2, PULLED, {2 * ratio, 0, 0.02f});
    EXPECT_EQ(arrow_columns(model), of_5_N);
  }
  EXPECT_NEAR(lengths[1], 2 * lengths[0], 1);
  EXPECT_NEAR(lengths[2], 3 * lengths[0], 1);
  EXPECT_GE(lengths[0], 5);
}

/* Pixels of the pad that differ between two pictures. */
int differing(const Canvas &a, const Canvas &b) {
  int count = 0;
  for (int row = 0; row < a.rows(); row++) {
    for (int column = 0; column < a.columns(); column++) {
      const Style &one_style = a.cell(column, row).style, &other = b.cell(column, row).style;
      if (a.cell(column, row).halves && b.cell(column, row).halves) {
        count += !(one_style.front == other.front);
        count += !(one_style.back == other.back);
      }
    }
  }
  return count;
}

TEST(Monitor, AnUnsureArrowIsWideAndOneThatMayBeNothingHasNoDirection) {
  Model model = model_of_grasp(true);
  auto picture = [&](float qx_N, float sd_N, std::uint32_t flags) {
    take_frame(model, 1000000, 1, -4.5f, 4.5f, 5, flags, {qx_N, 0, sd_N});
    return one(model, 200, 60);
  };
  Canvas without = picture(1.5f, 0.05f, FITTED);
  Canvas sure = picture(1.5f, 0.05f, PULLED), unsure = picture(1.5f, 0.7f, PULLED);
  Canvas nothing = picture(0.5f, 0.5f, PULLED);
  EXPECT_GT(differing(sure, without), 5);
  EXPECT_GT(differing(unsure, without), 2 * differing(sure, without));
  EXPECT_TRUE(shows(unsure, "→"));
  EXPECT_FALSE(shows(nothing, "→"));
  EXPECT_GT(differing(nothing, without), 5);
  EXPECT_FALSE(shows(without, "→") || shows(without, "+1.50")) << text_of(without);
  Canvas doubtful = picture(1.5f, 0.05f, PULLED | CONTACT_FLAG_ELONGATED);
  EXPECT_TRUE(shows(doubtful, "qx  +1.50?")) << text_of(doubtful);
  EXPECT_TRUE(shows(doubtful, "Q/F 0.300?"));
}

TEST(Monitor, SlidingIsToldOnThePadAndByALamp) {
  Model model = model_of_grasp(true);
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, PULLED, {1.5f, 0});
  Canvas rests = one(model);
  EXPECT_FALSE(shows(rests, "● SLIDING") || shows(rests, "● MOVING") || shows(rests, "─ SLIDING"));
  take_frame(model, 1020000, 2, 4.5f, 4.5f, 5, PULLED | CONTACT_FLAG_MOVING, {1.5f, 0});
  Canvas moves = one(model);
  EXPECT_TRUE(shows(moves, "● MOVING") && shows(moves, "─ MOVING ─")) << text_of(moves);
  EXPECT_FALSE(shows(moves, "● SLIDING"));
  take_frame(model, 1040000, 3, 4.5f, 4.5f, 5, PULLED | CONTACT_FLAG_MOVING | CONTACT_FLAG_SLIDING, {1.5f, 0});
  take_frame(model, 1140000, 4, 4.5f, 4.5f, 5, PULLED, {1.5f, 0});
  Canvas slides = one(model);
  EXPECT_TRUE(shows(slides, "● SLIDING") && shows(slides, "─ SLIDING ─")) << text_of(slides);
  take_frame(model, 1300000, 5, 4.5f, 4.5f, 5, PULLED, {1.5f, 0});
  EXPECT_FALSE(shows(one(model), "● SLIDING"));
}

TEST(Monitor, WithoutAPadItSaysWhatIsMissing) {
  for (auto [columns, rows] : {std::pair{80, 24}, {120, 40}}) {
    Model model = model_of_grasp(false);
    take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, FITTED);
    std::string text = text_of(one(model, columns, rows));
    auto at = text.find("no pad profile: fingertip pad");
    EXPECT_NE(at, std::string::npos) << text;
    EXPECT_EQ(text.find("no pad profile", at + 1), std::string::npos);
    EXPECT_EQ(text.find("Q/F"), std::string::npos);
    EXPECT_EQ(text.find("qx"), std::string::npos);
    EXPECT_FALSE(shows(one(model_with_info(), columns, rows), "no pad profile"));
  }
  Model model = model_of_grasp(false);
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, FITTED);
  Canvas two = draw_monitor({model, model}, {"keys", "note", ""}, 80, 24);
  EXPECT_TRUE(shows(two, "no pad profile:") && shows(two, "fingertip pad ")) << text_of(two);
}

TEST(Monitor, ALoadSinceTheTouchIsMarked) {
  Model model = model_of_grasp(true);
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 5, PULLED | CONTACT_FLAG_TANGENTIAL_FROM_TOUCH, {1.5f, 0});
  EXPECT_TRUE(shows(one(model), "since touch")) << text_of(one(model));
  EXPECT_TRUE(shows(draw_monitor({model, model}, {"keys", "note", ""}, 80, 24), "ΔQ/F"));
}

TEST(Monitor, SeveralStandSideBySide) {
  std::vector<Model> models;
  for (int i = 0; i < 12; i++) {
    Model model = model_with_info();
    wire_packet info = test::make_info(0, 0);
    info.body.info.serial[0] = static_cast<char>('A' + i);
    model.take(info);
    models.push_back(touched(model, static_cast<float>(i), 2));
  }
  auto serial = [](int i) { return std::string(1, static_cast<char>('A' + i)) + "660583883265A2C"; };
  for (auto [columns, rows, shown] : {std::tuple{80, 24, 2}, {120, 24, 3}, {80, 46, 4}, {200, 60, 10}}) {
    for (int count = 2; count <= 12; count++) {
      Canvas canvas = draw_monitor({models.begin(), models.begin() + count}, {"keys", "note", ""}, columns, rows);
      for (int i = 0; i < std::min(count, shown); i++) {
        ASSERT_TRUE(shows(canvas, serial(i))) << text_of(canvas);
        ASSERT_TRUE(shows(canvas, "+" + std::to_string(i) + ".00")) << text_of(canvas);
      }
      EXPECT_TRUE(shows(canvas, "x   ") && shows(canvas, "slip ") && shows(canvas, "0 s")) << text_of(canvas);
      EXPECT_EQ(shows(canvas, "a larger window shows more"), count > shown) << text_of(canvas);
    }
  }
}

TEST(Painter, WithoutColourTheLocationIsStillSeen) {
  Model model = model_with_info();
  take_frame(model, 1000000, 1, 4.5f, 4.5f, 15, FITTED);
  for (auto characters : {Characters::utf_8, Characters::ascii}) {
    std::string bytes = Painter(ColourDepth::none, characters).paint(one(model));
    EXPECT_EQ(bytes.find("38;"), std::string::npos);
    EXPECT_EQ(bytes.find("48;"), std::string::npos);
    EXPECT_NE(bytes.find(characters == Characters::utf_8 ? "┼" : "-+-"), std::string::npos);
    EXPECT_NE(bytes.find(characters == Characters::utf_8 ? "▒" : ":"), std::string::npos);
  }
}

TEST(Monitor, TwoContactsAndEdgesAreShown) {
  constexpr std::uint32_t flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_TARED | CONTACT_FLAG_SHAPE_VALID;
  for (int columns : {80, 120}) {
    Model model = model_of_grasp(true);
    wire_packet packet = test::make_contact(0, 1000, 1);
    wire_contact &contact = packet.body.contact;
    contact.flags = flags | CONTACT_FLAG_TWO_CONTACTS;
    contact.x1_mm = -5.25f;
    contact.y1_mm = 7.0f;
    contact.location1_sd_mm = 0.09f;
    contact.force1_N = 4.5f;
    contact.x2_mm = 3.0f;
    contact.y2_mm = -2.0f;
    contact.force2_N = 2.25f;
    model.take(packet);
    const std::string two = text_of(one(model, columns, 40));
    EXPECT_NE(two.find("4.50 N"), std::string::npos) << two;
    EXPECT_NE(two.find("2.25 N"), std::string::npos) << two;
    packet = test::make_contact(0, 2000, 2);
    packet.body.contact.flags = flags | CONTACT_FLAG_EDGE;
    packet.body.contact.edge_angle_deg = -37.5f;
    packet.body.contact.edge_length_mm = 18.0f;
    model.take(packet);
    const std::string edge = text_of(one(model, columns, 40));
    EXPECT_EQ(edge.find("2.25 N"), std::string::npos) << edge;
    EXPECT_NE(edge.find("18.0 mm"), std::string::npos) << edge;
  }
}

TEST(Painter, InAsciiAnArrowHasAHeadToo) {
  Model model = model_of_grasp(true);
  for (auto [qx_N, qy_N] : {std::pair{1.1f, 1.1f}, {-1.1f, 1.1f}, {-1.1f, -1.1f}, {1.1f, -1.1f}}) {
    take_frame(model, 1000000, 1, -4.5f, 4.5f, 5, PULLED, {qx_N, qy_N, 0.05f});
    std::string bytes = Painter(ColourDepth::none, Characters::ascii).paint(one(model, 200, 60));
    EXPECT_EQ(bytes.find('?'), std::string::npos) << "a shape without a character";
  }
}
