#include "grasp/fingertip.hpp"
#include "support/host_packets.hpp"

#include <gtest/gtest.h>
#include <limits>

using namespace fingertip;

TEST(Convert, ATouchIsThePacketsContact) {
  wire_packet packet = test::make_contact(0, 1, 7);
  packet.body.contact.force_N = 4.0196f;
  const GripTouch touch = touch_from_packet(packet, 1234567.8);
  EXPECT_NEAR(touch.t_s, 1.2345678, 1e-9);
  EXPECT_EQ(touch.flags, packet.body.contact.flags);
  EXPECT_FLOAT_EQ(static_cast<float>(touch.force_N), 4.0196f);
  EXPECT_EQ(static_cast<float>(touch.x_mm), packet.body.contact.x_mm);
  EXPECT_EQ(static_cast<float>(touch.y_mm), packet.body.contact.y_mm);
  EXPECT_EQ(static_cast<float>(touch.sigma_mm), packet.body.contact.sigma_mm);
  EXPECT_EQ(static_cast<float>(touch.qx_N), packet.body.contact.qx_N);
  EXPECT_EQ(static_cast<float>(touch.qy_N), packet.body.contact.qy_N);
  EXPECT_EQ(static_cast<float>(touch.q_sd_N), packet.body.contact.q_sd_N);
  EXPECT_EQ(static_cast<float>(touch.speed_x_mm_s), packet.body.contact.vx_mm_s);
  EXPECT_EQ(static_cast<float>(touch.speed_y_mm_s), packet.body.contact.vy_mm_s);
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
