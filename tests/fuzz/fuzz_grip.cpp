// The controller of a grasp: frames, answers and requests of any kind. Numbers stay numbers, widths
// within the gripper's stroke, and what is wanted below the cap.
#include "fuzz.h"
#include "grasp/control/grip.hpp"
#include "grasp/settings.hpp"

#include <cmath>

using namespace fingertip;

static double draw(fuzz_input &input, double low, double high) { return low + (high - low) * fuzz_u8(&input) / 255.0; }

static GripTouch draw_touch(fuzz_input &input, double now_s) {
  GripTouch touch;
  touch.t_s = now_s - draw(input, -0.05, 0.5);
  touch.flags = fuzz_u32(&input) & 0x1ffffffu;
  touch.force_N = draw(input, -1.0, 40.0);
  touch.force_sd_N = draw(input, 0.0, 10.0);
  touch.x_mm = draw(input, -20.0, 20.0);
  touch.sigma_mm = draw(input, 0.0, 40.0);
  touch.qx_N = draw(input, -20.0, 20.0);
  touch.qy_N = draw(input, -20.0, 20.0);
  touch.speed_y_mm_s = draw(input, -300.0, 300.0);
  return touch;
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const auto models = gripper_models();
  const GripperTraits traits = models[fuzz_u8(&input) % models.size()];
  GripSettings settings = settings_for(traits, {});
  settings.mode = fuzz_u8(&input) % 2;
  Grip grip(settings, traits);
  double now_s = 1.0;
  while (input.at < input.end) {
    now_s += draw(input, 0.0, 0.02);
    const std::uint8_t what = fuzz_u8(&input);
    if (what % 4 == 0) {
      grip.request(static_cast<GripRequest>(what / 4 % GRIP_REQUESTS));
    } else if (what % 4 == 1) {
      GripperStatus status;
      status.host_us = std::llround(1e6 * (now_s - draw(input, 0.0, 0.1)));
      status.active = what / 4 % 16 != 0;
      status.moving = what % 8 > 3;
      status.width_mm = draw(input, 0.0, traits.stroke_mm);
      status.fault = what == 253 ? 9 : 0;
      grip.take(status);
    } else {
      grip.take(what / 4 % 3, draw_touch(input, now_s));
    }
    GripCommand command;
    const GripReport report = grip.step(now_s, command);
    FUZZ_CHECK(report.state < GRIP_STATES);
    for (const double value :
         {command.width_mm, command.speed_mm_s, command.force_N, report.wanted_N, report.load_N, report.margin, report.friction}) {
      FUZZ_CHECK(std::isfinite(value));
    }
    FUZZ_CHECK(command.width_mm >= 0.0 && command.width_mm <= traits.stroke_mm + 1e-9);
    FUZZ_CHECK(report.wanted_N <= settings.cap_N);
  }
}
