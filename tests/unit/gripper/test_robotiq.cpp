#include "grasp/gripper/robotiq.hpp"
#include "models.hpp"

#include <cmath>

using namespace fingertip;
using namespace fingertip::test;
using namespace std::chrono_literals;

/* Requests and answers are printed in Robotiq's "2F-85 & 2F-140 Instruction Manual" and "Hand-E Gripper Instruction Manual", section Modbus
 * RTU example; those with function 3 in the "2-Finger Adaptive Gripper" manuals of 2013 and 2016; of one of them the 2013 edition prints
 * the checksum F7 8B beside another, this one is the packet's own. The two lines marked are no examples of theirs. */
TEST(RobotiqFrames, AreThoseOfTheManual) {
  Tape tape({
      {"09 04 07 D0 00 03 B1 CE", ""}, // before function 4 no answer comes
      {"09 03 07 D0 00 01 85 CF", "09 03 02 31 00 4C 15"},
      {"09 03 07 D0 00 03 04 0E", "09 03 06 F9 00 00 00 0D 00 56 4C"},
      // activate
      {"09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30", "09 10 03 E8 00 03 01 30"},
      {"09 03 07 D0 00 01 85 CF", "09 03 02 11 00 55 D5"},
      {"09 03 07 D0 00 01 85 CF", with_crc("09 03 02 00 00")}, // marked
      {"09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1", "09 10 03 E8 00 03 01 30"},
      // move: closes, for it says active without gGTO
      {"09 03 07 D0 00 03 04 0E", with_crc("09 03 06 31 00 00 00 0D 00")}, // marked
      {"09 10 03 E8 00 03 06 09 00 00 FF FF FF 42 29", "09 10 03 E8 00 03 01 30"},
      {"09 03 07 D0 00 03 04 0E", "09 03 06 39 00 00 FF 0E 0A F7 8B"},
      {"09 03 07 D0 00 03 04 0E", "09 03 06 B9 00 00 FF BD 00 1D 7C"},
      // opens
      {"09 03 07 D0 00 03 04 0E", with_crc("09 03 06 31 00 00 00 BD 00")}, // marked
      {"09 03 07 D0 00 03 04 0E", with_crc("09 03 06 31 00 00 00 BD 00")}, // marked
      {"09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19", "09 10 03 E8 00 03 01 30"},
      {"09 03 07 D0 00 03 04 0E", "09 03 06 F9 00 00 00 0D 00 56 4C"},
  });
  {
    std::unique_ptr<Gripper> gripper = opened("2f85", tape.port());
    gripper->activate();
    GripperStatus status = gripper->move({.width_mm = 0, .speed_mm_s = 150, .force_N = 235});
    EXPECT_TRUE(status.active);
    EXPECT_TRUE(status.moving);
    EXPECT_FALSE(status.object);
    EXPECT_NEAR(status.width_mm, (230 - 0x0E) * 85.0 / 227, 1e-9);
    EXPECT_DOUBLE_EQ(status.current_A, 0.1);
    status = gripper->poll();
    EXPECT_FALSE(status.moving);
    EXPECT_EQ(status.object, true);
    EXPECT_NEAR(status.width_mm, (230 - 0xBD) * 85.0 / 227, 1e-9);
    EXPECT_EQ(status.fault, 0);
    EXPECT_FALSE(gripper->poll().moving);
    status = gripper->move({.width_mm = 85, .speed_mm_s = 150, .force_N = 235});
    EXPECT_FALSE(status.moving);
    EXPECT_EQ(status.object, false);
  }
  EXPECT_EQ(tape.complaint(), "");
}

/* The newer manuals' status request and answer; also by an adapter that hears itself, where the question comes before the answer. */
TEST(RobotiqFrames, ReadWithFunctionFourAndIgnoreTheirOwnEcho) {
  const std::string asks = "09 04 07 D0 00 03 B1 CE", answer = "09 04 06 F9 00 00 00 0D 00 17 AA";
  for (const std::string &heard : {answer, asks + " " + answer}) {
    Tape tape({{asks, heard}, {asks, heard}});
    {
      const GripperStatus status = opened("hande", tape.port())->poll();
      EXPECT_TRUE(status.active);
      EXPECT_NEAR(status.width_mm, (230 - 0x0D) * 50.0 / 227, 1e-9);
    }
    EXPECT_EQ(tape.complaint(), "");
  }
}

/* The manuals' example of function 23: position E6, speed 3C, force C8. */
TEST(RobotiqFrames, TheSimulatedOneUnderstandsTheManualsFunction23) {
  Served simulated(served("2f85"));
  activated("2f85", simulated)->move({.width_mm = 85, .speed_mm_s = 150});
  EXPECT_EQ(asked(simulated.port(), "09 17 07 D0 00 02 03 E9 00 02 04 00 E6 3C C8 2D 0C", 9), with_crc("09 17 04 39 00 00 E6"));
  std::unique_ptr<Gripper> gripper = opened("2f85", simulated.port());
  EXPECT_EQ(wait_for(simulated, *gripper, rests).width_mm, 0.0);
}

TEST(Robotiq, GripsAnObjectAndLosesIt) {
  Served simulated(served("2f85"));
  std::unique_ptr<Gripper> gripper = opened("2f85", simulated.port());
  EXPECT_FALSE(gripper->poll().active);
  /* Not active, it moves not and is not activated by it. */
  EXPECT_FALSE(gripper->move({.width_mm = 0, .speed_mm_s = 50}).active);
  EXPECT_EQ(gripper->poll().width_mm, 85.0);

  gripper->activate();
  EXPECT_TRUE(gripper->poll().moving);
  wait_for(simulated, *gripper, is_active);
  EXPECT_EQ(gripper->poll().fault, 0);
  simulated.with([](GripperServer &, GripperMotion &motion) {
    motion.blocked_at = [](double width_mm, double force_N) { return force_N > 0 && (40 - width_mm) * 10 >= force_N && width_mm < 40; };
  });
  GripperStatus status = moved(simulated, *gripper, {.width_mm = 0, .speed_mm_s = 150, .force_N = 20});
  EXPECT_EQ(status.object, true);
  EXPECT_NEAR(status.width_mm, 38, 0.2);
  EXPECT_GT(status.current_A, 0.05);
  status = moved(simulated, *gripper, {.width_mm = 60, .speed_mm_s = 150, .force_N = 20});
  EXPECT_EQ(status.object, false);
  EXPECT_NEAR(status.width_mm, 60, 0.19);
  EXPECT_NE(gripper->line().find("function 23"), std::string::npos);
}

TEST(Robotiq, WidthsOfAllModels) {
  for (const char *model : {"2f85", "2f140", "hande"}) {
    Served simulated(served(model));
    std::unique_ptr<Gripper> gripper = activated(model, simulated);
    const GripperTraits &traits = gripper->traits();
    EXPECT_EQ(gripper->poll().width_mm, traits.stroke_mm);
    for (double part : {0.5, 0.25, 0.0, 1.0}) {
      const GripperStatus status = moved(simulated, *gripper, {.width_mm = part * traits.stroke_mm, .speed_mm_s = 1e6});
      EXPECT_NEAR(status.width_mm, part * traits.stroke_mm, traits.step_mm / 2 + 1e-9) << model;
      EXPECT_NEAR(simulated.with([](GripperServer &, GripperMotion &motion) { return motion.width_mm(); }), status.width_mm, 1e-9);
    }
  }
}

TEST(Robotiq, FindsTheFunctionsThatItAnswers) {
  const struct {
    std::vector<int> functions;
    const char *line;
  } CASES[] = {{{3, 4, 16, 23}, "function 23"}, {{3, 16}, "function 16 and 3"}, {{4, 16}, "function 16 and 4"}};
  for (const auto &one : CASES) {
    Served simulated(served("2f85", one.functions));
    std::unique_ptr<Gripper> gripper = activated("2f85", simulated);
    for (double width_mm : {70.0, 60.0, 50.0, 40.0}) {
      moved(simulated, *gripper, {.width_mm = width_mm, .speed_mm_s = 150});
    }
    EXPECT_NEAR(gripper->poll().width_mm, 40, 0.19);
    EXPECT_NE(gripper->line().find(one.line), std::string::npos) << gripper->line();
  }
}

/* An answer that comes when the next question has been asked says what was, not what is. */
TEST(RobotiqFrames, NoLateAnswerIsTakenForThatToTheNextQuestion) {
  const std::string stale = with_crc("09 04 06 F9 00 00 00 40 00"), fresh = with_crc("09 04 06 F9 00 00 00 80 00"),
                    one = with_crc("09 04 07 D0 00 01");
  Tape tape({{"09 04 07 D0 00 03 B1 CE", stale},
             {"09 04 07 D0 00 03 B1 CE", ""},
             {one, stale + " " + with_crc("09 04 02 F9 00")},
             {"09 04 07 D0 00 03 B1 CE", fresh}});
  {
    std::unique_ptr<Gripper> gripper = opened("2f85", tape.port());
    EXPECT_EQ(code_of([&] { gripper->poll(); }), ErrorCode::gripper_silent);
    EXPECT_NEAR(gripper->poll().width_mm, (230 - 0x80) * 85.0 / 227, 1e-9);
  }
  EXPECT_EQ(tape.complaint(), "");
}

/* It is no fault: who answers hears again. */
TEST(Robotiq, TellsASecondOfSilenceOnce) {
  Served simulated(served("2f85"));
  std::unique_ptr<Gripper> gripper = activated("2f85", simulated);
  simulated.pass(1.1);
  GripperStatus status = gripper->poll();
  EXPECT_TRUE(status.was_left_alone);
  EXPECT_EQ(status.fault, 0);
  EXPECT_TRUE(status.active);
  status = gripper->poll();
  EXPECT_FALSE(status.was_left_alone);
  EXPECT_EQ(status.fault, 0);
}

TEST(Robotiq, OnlyActivateClearsAFault) {
  Served simulated(served("2f85"));
  std::unique_ptr<Gripper> gripper = activated("2f85", simulated);
  moved(simulated, *gripper, {.width_mm = 40, .speed_mm_s = 150});
  simulated.with([](GripperServer &server, GripperMotion &) { server.fail(robotiq::OVERCURRENT); });
  for (int i = 0; i < 3; i++) {
    const GripperStatus status = gripper->move({.width_mm = 85, .speed_mm_s = 150});
    EXPECT_EQ(status.fault, robotiq::OVERCURRENT);
    EXPECT_FALSE(status.active);
  }
  EXPECT_NEAR(gripper->poll().width_mm, 40, 0.19);
  gripper->activate();
  EXPECT_EQ(wait_for(simulated, *gripper, is_active).fault, 0);
}

/* What the manuals say of moves that come at the wrong time. */
TEST(Robotiq, TheSimulatedOneFaultsAsDocumented) {
  Served simulated(served("2f85"));
  const auto fault = [&] { return asked(simulated.port(), "09 04 07 D0 00 03 B1 CE", 11).substr(6 * 3 - 3, 2); };
  asked(simulated.port(), with_crc("09 10 03 E8 00 03 06 08 00 00 FF FF FF"), 8);
  EXPECT_EQ(fault(), "07");
  asked(simulated.port(), with_crc("09 10 03 E8 00 03 06 09 00 00 FF FF FF"), 8);
  EXPECT_EQ(fault(), "05");
  std::unique_ptr<Gripper> gripper = opened("2f85", simulated.port());
  /* Then it goes where it was told to. */
  EXPECT_EQ(wait_for(simulated, *gripper, [](const GripperStatus &status) { return status.active && !status.moving; }).width_mm, 0.0);
}

TEST(Robotiq, RefusesWhatCannotBe) {
  Served simulated(served("2f85"));
  std::unique_ptr<Gripper> gripper = opened("2f85", simulated.port());
  EXPECT_EQ(code_of([&] { gripper->move({.width_mm = NAN}); }), ErrorCode::bad_value);
  EXPECT_EQ(code_of([&] { gripper->move({.speed_mm_s = -1}); }), ErrorCode::bad_value);
  EXPECT_EQ(code_of([&] { opened("3f", simulated.port()); }), ErrorCode::bad_value);
  EXPECT_EQ(code_of([&] { opened("2f85", "/dev/none"); }), ErrorCode::no_port);
  EXPECT_EQ(code_of([&] { opened("2f85", "/dev/null"); }), ErrorCode::not_a_port);
  EXPECT_EQ(code_of([&] { opened("2f85", simulated.port()); }), ErrorCode::port_in_use);
  gripper.reset();
  EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = simulated.port(), .slave = 10}); }), ErrorCode::gripper_silent);
  EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = simulated.port(), .slave = 300}); }), ErrorCode::bad_value);
  for (int closed : {3, 2, 256, -1}) {
    EXPECT_EQ(code_of([&] { open_gripper({.model = "2f85", .port = simulated.port(), .closed_count = closed}); }), ErrorCode::bad_value);
  }
}

/* A latency timer of 16 ms, and answers that take 30: no exchange can be faster. */
TEST(Robotiq, WorksThroughASlowLine) {
  Served simulated(served("2f85"));
  std::unique_ptr<Gripper> gripper = activated("2f85", simulated);
  const auto ten_moves = [&](const LineTrouble &trouble) {
    simulated.with([&](GripperServer &server, GripperMotion &) { server.trouble(trouble); });
    const auto begin = host_now();
    for (int i = 0; i < 10; i++) {
      EXPECT_TRUE(gripper->move({.width_mm = 85.0 - i, .speed_mm_s = 150}).active);
    }
    return host_now() - begin;
  };
  LineTrouble timer, late;
  timer.latency_timer_s = 0.016;
  EXPECT_GT(ten_moves(timer), 9 * 16ms);
  late.late_s = 0.03;
  EXPECT_GT(ten_moves(late), 10 * 30ms);
}
