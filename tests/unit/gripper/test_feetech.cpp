#include "grasp/gripper/feetech.hpp"
#include "models.hpp"

#include <cmath>
#include <numbers>

using namespace fingertip;
using namespace fingertip::test;

constexpr const char *MODEL = "sts3215";

/* Examples of Feetech's protocol manual for SCS and STS servos: pings servo 1, reads two bytes from
 * 56 of it, writes position 2048, time 0 and speed 1000; the answer is a read's. */
TEST(FeetechPacket, IsThatOfTheManual) {
  using feetech::Bytes;
  EXPECT_EQ(feetech::encoded({.id = 1, .code = feetech::PING}), (Bytes{0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB}));
  EXPECT_EQ(feetech::encoded({.id = 1, .code = feetech::READ, .parameters = {0x38, 0x02}}),
            (Bytes{0xFF, 0xFF, 0x01, 0x04, 0x02, 0x38, 0x02, 0xBE}));
  EXPECT_EQ(feetech::encoded({.id = 1, .code = feetech::WRITE, .parameters = {0x2A, 0x00, 0x08, 0x00, 0x00, 0xE8, 0x03}}),
            (Bytes{0xFF, 0xFF, 0x01, 0x09, 0x03, 0x2A, 0x00, 0x08, 0x00, 0x00, 0xE8, 0x03, 0xD5}));
  Bytes answer = {0xFF, 0xFF, 0x01, 0x04, 0x00, 0x18, 0x05, 0xDD};
  std::size_t skipped = 0;
  const auto packet = feetech::take_packet(&answer, &skipped);
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->parameters, (Bytes{0x18, 0x05}));
  EXPECT_EQ(skipped, 0u);
  EXPECT_TRUE(answer.empty());
}

TEST(FeetechPacket, IsFoundInNoiseHoweverItComes) {
  const feetech::Bytes packet = feetech::encoded({.id = 6, .code = 0, .parameters = {0xFF, 0xFF, 1}});
  feetech::Bytes line = {0xFF, 0x00, 0xFF, 0xFF, 0x06, 0x02, 0x00, 0x12, 0xFF};
  const std::size_t noise = line.size();
  line.insert(line.end(), packet.begin(), packet.end());
  feetech::Bytes came;
  std::size_t skipped = 0;
  for (std::size_t i = 0; i < line.size(); i++) {
    came.push_back(line[i]);
    const auto found = feetech::take_packet(&came, &skipped);
    ASSERT_EQ(found.has_value(), i + 1 == line.size()) << i;
  }
  EXPECT_EQ(skipped, noise);
}

TEST(Jaw, IsAChord) {
  for (const bool turns_down : {false, true}) {
    const int open = turns_down ? 1024 : 3072;
    const Jaw jaw({.closed_count = 2048, .open_count = open, .jaw_mm = 80});
    EXPECT_NEAR(jaw.width_mm(2048), 0, 1e-12);
    EXPECT_NEAR(jaw.stroke_mm(), 2 * 80 * std::sin(std::numbers::pi / 4), 1e-9);
    EXPECT_LT(jaw.width_mm(turns_down ? 2060 : 2036), 0);
    for (double width_mm : {0.0, 1.0, 30.0, 100.0}) {
      const double count = jaw.count(width_mm);
      EXPECT_NEAR(jaw.width_mm(count), width_mm, 1e-9);
      EXPECT_NEAR(std::abs(jaw.width_mm(count + 0.5) - jaw.width_mm(count - 0.5)), jaw.slope_mm(width_mm), 1e-4);
    }
  }
}

TEST(Feetech, MovesItsJawOnceActivated) {
  Served simulated(served(MODEL));
  std::unique_ptr<Gripper> gripper = opened(MODEL, simulated.port());
  const GripperTraits &traits = gripper->traits();
  EXPECT_NEAR(traits.step_mm, 0.153, 0.001);
  EXPECT_NE(gripper->line().find("servo model 777"), std::string::npos);
  EXPECT_FALSE(gripper->move({.width_mm = 10, .speed_mm_s = 100}).active);
  EXPECT_NEAR(gripper->poll().width_mm, traits.stroke_mm, 0.1);

  gripper->activate();
  EXPECT_TRUE(gripper->poll().active);
  EXPECT_NEAR(gripper->poll().width_mm, traits.stroke_mm, 0.1);
  for (double width_mm : {50.0, 10.0, 0.0, 90.0}) {
    const GripperStatus status = moved(simulated, *gripper, {.width_mm = width_mm, .speed_mm_s = 400});
    EXPECT_NEAR(status.width_mm, width_mm, traits.step_mm / 2 + 1e-6);
    EXPECT_EQ(status.object, false);
    EXPECT_EQ(status.fault, 0);
  }
}

TEST(Feetech, KnowsAnObjectByWhereItStops) {
  Served simulated(served(MODEL));
  std::unique_ptr<Gripper> gripper = activated(MODEL, simulated);
  simulated.with([](GripperServer &, GripperMotion &motion) {
    motion.blocked_at = [](double width_mm, double force_N) { return force_N > 0 && width_mm < 40 && (40 - width_mm) * 2 >= force_N; };
  });
  const GripperStatus status = moved(simulated, *gripper, {.width_mm = 0, .speed_mm_s = 300, .force_N = 8});
  EXPECT_EQ(status.object, true);
  EXPECT_GT(status.current_A, 0.5);
  EXPECT_NEAR(simulated.with([](GripperServer &, GripperMotion &motion) { return motion.width_mm(); }), 36, 0.05);
}

TEST(Feetech, FaultsAreBits) {
  Served simulated(served(MODEL));
  std::unique_ptr<Gripper> gripper = activated(MODEL, simulated);
  simulated.with([](GripperServer &server, GripperMotion &) { server.fail(feetech::OVERLOAD | feetech::TEMPERATURE); });
  const GripperStatus status = gripper->poll();
  EXPECT_EQ(status.fault, feetech::OVERLOAD | feetech::TEMPERATURE);
  EXPECT_EQ(gripper->fault_text(status.fault), "too hot, overloaded");
  EXPECT_EQ(gripper->fault_text(0), "");
  EXPECT_EQ(gripper->fault_text(0x80), "a fault that its memory table does not have");
}

/* Exchanges of a tape. */
using feetech::Bytes;
using feetech::Packet;

static std::string text(const Packet &packet) { return digits(feetech::encoded(packet)); }

const Packet ASK_TABLE = {6, feetech::READ, {feetech::MODEL, 31}};
const Packet ASK_STATUS = {6, feetech::READ, {feetech::TORQUE_ENABLE, 31}};

static Packet table() {
  Bytes bytes(31);
  bytes[0] = feetech::STS3215 & 0xFF;
  bytes[1] = feetech::STS3215 >> 8;
  return {6, 0, bytes};
}

static Packet status(int position) {
  Bytes bytes(31);
  bytes[feetech::PRESENT_POSITION - feetech::TORQUE_ENABLE] = static_cast<std::uint8_t>(position & 0xFF);
  bytes[feetech::PRESENT_POSITION - feetech::TORQUE_ENABLE + 1] = static_cast<std::uint8_t>(position >> 8);
  return {6, 0, bytes};
}

TEST(FeetechFrames, APositionOutsideOfATurnIsRefused) {
  for (const int position : {6396, 0x8005}) {
    Tape tape({{text(ASK_TABLE), text(table())}, {text(ASK_STATUS), text(status(position))}});
    EXPECT_EQ(code_of([&] { opened(MODEL, tape.port()); }), ErrorCode::gripper_refused);
  }
}

TEST(Feetech, RefusesWhatCannotBe) {
  Served simulated(served(MODEL));
  const auto code = [&](GripperWay way) {
    way.model = MODEL;
    way.port = simulated.port();
    return code_of([&] { open_gripper(way); });
  };
  EXPECT_EQ(code({.slave = 254}), ErrorCode::bad_value);
  EXPECT_EQ(code({.closed_count = 0, .open_count = 3000}), ErrorCode::bad_value);
  EXPECT_EQ(code({.closed_count = 5000}), ErrorCode::bad_value);
  EXPECT_EQ(code({.jaw_mm = 0}), ErrorCode::bad_value);
  EXPECT_EQ(code({.jaw_mm = NAN}), ErrorCode::bad_value);
  EXPECT_EQ(code({.slave = 7}), ErrorCode::gripper_silent);
  EXPECT_EQ(code({.timeout_s = 0}), ErrorCode::bad_value);
}
