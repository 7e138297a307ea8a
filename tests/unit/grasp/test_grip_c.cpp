// The C interface gives what the C++ class gives, to the last bit, and allocates nothing on the way.
#include "grasp/control/grip.hpp"
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/fingertip_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <memory>

using namespace fingertip;

namespace {
std::size_t allocations = 0;
}
[[gnu::noinline]] void *operator new(std::size_t size) {
  allocations++;
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void *what) noexcept { std::free(what); }
[[gnu::noinline]] void operator delete(void *what, std::size_t) noexcept { std::free(what); }

namespace {

const fingertip_grip_traits TRAITS = {85, 0.1, 0, 1, 150, 1, 100, 0.008, 0.002};
const GripperTraits SAME = {TRAITS, "gripper"};

wire_packet contact_at(double t_s, double force_N, double load_N) {
  wire_packet packet = {};
  packet.type = WIRE_CONTACT;
  packet.t_us = static_cast<std::uint64_t>(1e6 * t_s);
  if (force_N > 0.02) {
    packet.body.contact.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_TANGENTIAL_VALID;
    packet.body.contact.force_N = static_cast<float>(force_N + 1e-3 * std::fmod(1e3 * t_s, 7.0));
    packet.body.contact.sigma_mm = 6.0f;
    packet.body.contact.qy_N = static_cast<float>(load_N);
  }
  return packet;
}

} // namespace

TEST(GripC, GivesTheCommandsOfTheClass) {
  Grip same(settings_for(SAME, {{"cap", 9}}), SAME);
  const char *name = "cap_N";
  const double cap_N = 9;
  const std::unique_ptr<fingertip_grip, void (*)(fingertip_grip *)> grip(fingertip_grip_new(&TRAITS, &name, &cap_N, 1),
                                                                         fingertip_grip_free);
  same.request(GRIP_REQUEST_GRASP);
  ASSERT_EQ(fingertip_grip_ask(grip.get(), GRIP_REQUEST_GRASP), FINGERTIP_OK);
  EXPECT_EQ(fingertip_grip_ask(grip.get(), GRIP_REQUEST_PLACE), FINGERTIP_END);
  double width_mm = 44.0, most_N = 0.0;
  GripCommand expected;
  std::array<double, FINGERTIP_VALUES_MOST> values{};
  const std::size_t count = fingertip_value_count(WIRE_CONTACT), before = allocations;
  std::uint32_t seen = 0;
  for (int i = 1; i < 8000; i++) {
    const double t_s = 1.0 + 1e-3 * i;
    if (expected.motion == GRIP_MOVE) {
      const double way_mm = 1e-3 * expected.speed_mm_s;
      width_mm += std::clamp(expected.width_mm - width_mm, -way_mm, way_mm);
    }
    const double force_N = 3.0 * std::pow(std::max(0.5 * (40.0 - width_mm), 0.0), 1.6);
    most_N = std::max(most_N, force_N);
    for (std::size_t finger = 0; finger < 2 && i % 2 == 0; finger++) {
      const wire_packet packet = contact_at(t_s - 0.004, force_N, i < 4000 ? 0.0 : i < 7000 ? 1.0 : 0.05);
      same.take(finger, touch_from_packet(packet, 1e6 * (t_s - 0.004)));
      values::put(packet, values.data());
      values[count - 1] = NAN; // of a field without its flag
      ASSERT_EQ(fingertip_grip_take_contact(grip.get(), finger, t_s - 0.004, values.data(), count), FINGERTIP_OK);
    }
    GripperStatus status;
    status.host_us = std::llround(1e6 * t_s);
    status.active = true;
    status.width_mm = width_mm;
    same.take(status);
    const fingertip_grip_answer answer = {width_mm, 0, 1, 0, t_s};
    ASSERT_EQ(fingertip_grip_take_answer(grip.get(), &answer), FINGERTIP_OK);
    if (i == 6500) {
      EXPECT_EQ(same.request(GRIP_REQUEST_PLACE), fingertip_grip_ask(grip.get(), GRIP_REQUEST_PLACE) == FINGERTIP_OK);
    }
    const GripReport wanted = same.step(t_s, expected);
    fingertip_grip_command command = {};
    fingertip_grip_report report = {};
    ASSERT_EQ(fingertip_grip_step(grip.get(), t_s, &command, &report), FINGERTIP_OK);
    ASSERT_EQ(std::make_tuple(command.motion, command.width_mm, command.speed_mm_s, command.force_N),
              std::make_tuple(expected.motion, expected.width_mm, expected.speed_mm_s, expected.force_N));
    ASSERT_EQ(std::memcmp(&report, &wanted, sizeof report), 0) << t_s;
    seen |= 1u << report.state;
  }
  EXPECT_EQ(allocations, before);
  for (const std::uint8_t state : {GRIP_APPROACH, GRIP_SQUEEZE, GRIP_READY, GRIP_HOLDING, GRIP_PLACING, GRIP_RELEASE}) {
    EXPECT_TRUE(seen >> state & 1) << state_name(state);
  }
  EXPECT_GT(most_N, 2.0);
}

TEST(GripC, RefusesWhatIsNone) {
  const char *names[] = {"cap_N", nullptr};
  const double cap_N[] = {9, 9};
  fingertip_grip_traits swapped[] = {TRAITS, TRAITS};
  swapped[0].speed_min_mm_s = 151;
  swapped[1].force_min_N = 101;
  for (const fingertip_grip_traits &traits : swapped) {
    EXPECT_EQ(fingertip_grip_new(&traits, nullptr, nullptr, 0), nullptr);
  }
  EXPECT_EQ(fingertip_grip_new(&TRAITS, names, cap_N, 2), nullptr);
  EXPECT_EQ(fingertip_grip_new(&TRAITS, nullptr, cap_N, 1), nullptr);
  const std::unique_ptr<fingertip_grip, void (*)(fingertip_grip *)> grip(fingertip_grip_new(&TRAITS, names, cap_N, 1), fingertip_grip_free);
  EXPECT_EQ(fingertip_grip_set(grip.get(), names, cap_N, 2), FINGERTIP_ERR_ARGUMENT);
  const double values[FINGERTIP_VALUES_MOST] = {};
  const fingertip_grip_answer answer = {40, 0, 1, 0, INFINITY};
  fingertip_grip_command command = {};
  fingertip_grip_report report = {};
  EXPECT_EQ(fingertip_grip_take_contact(grip.get(), 0, INFINITY, values, fingertip_value_count(WIRE_CONTACT)), FINGERTIP_ERR_ARGUMENT);
  EXPECT_EQ(fingertip_grip_take_answer(grip.get(), &answer), FINGERTIP_ERR_ARGUMENT);
  EXPECT_EQ(fingertip_grip_step(grip.get(), INFINITY, &command, &report), FINGERTIP_ERR_ARGUMENT);
}
