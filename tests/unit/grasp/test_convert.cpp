#include "grasp/control/finger.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <limits>

using namespace fingertip;

TEST(Convert, ATouchIsThePacketsContact) {
  wire_packet packet = test::make_contact(0, 1, 7);
  const GripTouch touch = touch_from_packet(packet, 1234567.8);
  EXPECT_NEAR(touch.t_s, 1.2345678, 1e-9);
  EXPECT_EQ(touch.flags, packet.body.contact.flags);
  const wire_contact &given = packet.body.contact;
  const std::array<double, 8> found = {touch.force_N, touch.x_mm, touch.y_mm,         touch.sigma_mm,
                                       touch.qx_N,    touch.qy_N, touch.speed_x_mm_s, touch.speed_y_mm_s};
  const std::array<float, 8> sent = {given.force_N, given.x_mm, given.y_mm,    given.sigma_mm,
                                     given.qx_N,    given.qy_N, given.vx_mm_s, given.vy_mm_s};
  EXPECT_TRUE(std::equal(found.begin(), found.end(), sent.begin()));
  EXPECT_EQ(touch.q_sd_N, double{given.q_sd_N});
}

TEST(Convert, WhatHasNoFlagOrIsNoNumberIsZero) {
  wire_packet packet = test::make_contact(0, 1, 7);
  packet.body.contact.x_mm = std::numeric_limits<float>::infinity();
  EXPECT_EQ(touch_from_packet(packet, 5).x_mm, 0.0);
  packet.body.contact.force_N = 4;
  packet.body.contact.flags = CONTACT_FLAG_CONTACT;
  const GripTouch touch = touch_from_packet(packet, -1);
  for (const double value : {touch.force_N, touch.force_sd_N, touch.x_mm, touch.sigma_mm, touch.qx_N, touch.speed_x_mm_s, touch.t_s}) {
    EXPECT_EQ(value, 0.0);
  }
}
