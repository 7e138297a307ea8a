#include "grasp/convert.hpp"
#include "support/host_packets.hpp"

#include <gtest/gtest.h>

using namespace fingertip;

TEST(Convert, ATouchIsThePacketInThousandths) {
  wire_packet packet = test::make_contact(0, 1, 7);
  packet.body.contact.force_N = 4.0196f;
  const grip_touch touch = touch_from_packet(packet, 1234567.8);
  EXPECT_EQ(touch.t_us, 1234567u);
  EXPECT_EQ(touch.flags, packet.body.contact.flags);
  EXPECT_EQ(touch.force_mN, 4020);
  EXPECT_EQ(touch.x_um, 7100);
  EXPECT_EQ(touch.y_um, -3333);
  EXPECT_EQ(touch.sigma_um, 5700);
  EXPECT_EQ(touch.qx_mN, -312);
  EXPECT_EQ(touch.qy_mN, 0);
  EXPECT_EQ(touch.q_sd_mN, 12);
  EXPECT_EQ(touch.vx_um_s, 123457);
  EXPECT_EQ(touch.vy_um_s, -7);
}

TEST(Convert, WhatNoFlagStandsForIsZero) {
  wire_packet packet = test::make_contact(0, 1, 7);
  packet.body.contact.force_N = 4;
  packet.body.contact.flags = CONTACT_FLAG_CONTACT;
  const grip_touch touch = touch_from_packet(packet, 5);
  EXPECT_EQ(touch.force_mN, 0);
  EXPECT_EQ(touch.force_sd_mN, 0);
  EXPECT_EQ(touch.x_um, 0);
  EXPECT_EQ(touch.sigma_um, 0);
  EXPECT_EQ(touch.qx_mN, 0);
  EXPECT_EQ(touch.vx_um_s, 0);
}

TEST(Convert, NumbersBeyondTheFieldEndAtItsLimit) {
  wire_packet packet = test::make_contact(0, 1, 7);
  packet.body.contact.force_N = 3e30f;
  packet.body.contact.x_mm = -3e30f;
  const grip_touch touch = touch_from_packet(packet, -1);
  EXPECT_EQ(touch.force_mN, 2000000000);
  EXPECT_EQ(touch.x_um, -2000000000);
  EXPECT_EQ(touch.t_us, 0u);
}

TEST(Convert, AGripperKeepsItsNumbers) {
  const grip_traits traits =
      core_traits({"x", 85.0, 0.374, 0.4, 20.0, 150.0, 20.0, 235.0, 0.025, 0.005});
  EXPECT_EQ(traits.stroke_um, 85000);
  EXPECT_EQ(traits.step_um, 374);
  EXPECT_EQ(traits.deadband_um, 400);
  EXPECT_EQ(traits.speed_min_um_s, 20000);
  EXPECT_EQ(traits.speed_max_um_s, 150000);
  EXPECT_EQ(traits.force_min_mN, 20000);
  EXPECT_EQ(traits.force_max_mN, 235000);
  EXPECT_EQ(traits.latency_us, 25000);
  EXPECT_EQ(traits.poll_us, 5000);

  GripperStatus status;
  status.host_us = 99;
  status.active = true;
  status.width_mm = 34.2171;
  status.fault = 9;
  grip_status core = core_status(status);
  EXPECT_EQ(core.t_us, 99u);
  EXPECT_TRUE(core.is_active);
  EXPECT_FALSE(core.is_moving);
  EXPECT_EQ(core.width_um, 34217);
  EXPECT_EQ(core.object, GRIP_OBJECT_UNKNOWN);
  EXPECT_EQ(core.fault, 9);
  status.moving = true;
  status.object = true;
  EXPECT_TRUE(core_status(status).is_moving);
  EXPECT_EQ(core_status(status).object, GRIP_OBJECT_HELD);
  status.object = false;
  EXPECT_EQ(core_status(status).object, GRIP_OBJECT_NONE);

  const GripperMove move = gripper_move({GRIP_MOVE, 34217, 8000, 20000});
  EXPECT_DOUBLE_EQ(move.width_mm, 34.217);
  EXPECT_DOUBLE_EQ(move.speed_mm_s, 8.0);
  EXPECT_DOUBLE_EQ(move.force_N, 20.0);
}
