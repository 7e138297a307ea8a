#include "world.h"

#include <math.h>
#include <string.h>
#include <unity.h>

void world_begin(struct world *world) {
  memset(world, 0, sizeof *world);
  world->traits = (struct grip_traits){.stroke_um = 85000,
                                       .step_um = 10,
                                       .speed_min_um_s = 1000,
                                       .speed_max_um_s = 150000,
                                       .force_min_mN = 20000,
                                       .force_max_mN = 235000,
                                       .latency_us = 3000,
                                       .poll_us = 1000};
  world->t_us = 1000000;
  world->frame_us = 2439;
  world->width_um = world->sent_um = world->least_sent_um = 60000.0;
  world->object_um = 40000.0;
  world->stiffness = 3.0;
  world->gain[0] = world->gain[1] = 1.0;
  world->is_active = true;
  for (int i = 0; i < 64; i++) {
    world->sent_before_um[i] = world->width_um;
  }
  struct grip_settings settings;
  grip_default_settings(&settings, &world->traits);
  world_set(world, &settings);
}

void world_set(struct world *world, const struct grip_settings *settings) {
  TEST_ASSERT_EQUAL(FT_OK, grip_init(&world->grip, settings, &world->traits));
}

/* A load as large as the force moves a location that is not corrected for it by this: pressure that
 * is uneven, and rubber that gives way. */
#define UNEVEN_um 2700
#define GIVES_um 1800

static void give_way(struct world *world) {
  if (world->force_mN > 10.0) {
    world->gave_um += GIVES_um * (world->load_mN - world->gave_mN) / world->force_mN;
  }
  world->gave_mN = world->load_mN;
}

static struct grip_touch feel(const struct world *world, int finger) {
  struct grip_touch touch = {.t_us = world->t_us};
  int32_t force_mN = (int32_t)(world->gain[finger] * world->force_mN);
  if (force_mN < 10) {
    return touch;
  }
  touch.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID |
                CONTACT_FLAG_TANGENTIAL_VALID;
  touch.flags |= world->add_flags[finger];
  touch.flags &= ~world->drop_flags[finger];
  touch.force_mN = force_mN;
  touch.force_sd_mN = force_mN / 50;
  touch.sigma_um = world->sigma_um;
  touch.x_um = world->is_frozen[finger] ? 0 : (int32_t)(world->frames % 7);
  if (world->speed_um_s[finger] != 0) {
    touch.flags |= CONTACT_FLAG_VELOCITY_VALID;
    touch.vx_um_s = world->speed_um_s[finger];
  }
  if (touch.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
    touch.qy_mN = world->load_mN;
  } else {
    touch.y_um = world->place_um + (int32_t)world->gave_um + UNEVEN_um * world->load_mN / force_mN;
  }
  return touch;
}

static void step_gripper(struct world *world, uint32_t ms) {
  const struct grip_traits *traits = &world->traits;
  const int32_t latency_ms = traits->latency_us / 1000;
  world->sent_before_um[ms % 64] = world->sent_um;
  double target = world->sent_before_um[(ms + 64 - (uint32_t)latency_ms) % 64];
  target = floor(target / traits->step_um + 0.5) * traits->step_um;
  double off = target - world->width_um;
  double most = 1e-3 * world->command.speed_um_s;
  world->width_um += off > most ? most : off < -most ? -most : off;
  double indentation_mm = 0.5e-3 * (world->object_um - world->width_um);
  world->force_mN = world->object_um > 0.0 && indentation_mm > 0.0
                        ? 1e3 * world->stiffness * pow(indentation_mm, 1.6)
                        : 0.0;
}

void world_run(struct world *world, uint32_t ms) {
  for (uint32_t i = 0; i < ms; i++) {
    world->t_us += 1000;
    step_gripper(world, (uint32_t)(world->t_us / 1000));
    while ((uint64_t)world->frames * world->frame_us < world->t_us) {
      world->frames++;
      give_way(world);
      for (int finger = 0; finger < GRIP_FINGERS; finger++) {
        struct grip_touch touch = feel(world, finger);
        bool waits = world->take_turns && world->frames % GRIP_FINGERS != (uint32_t)finger;
        if (!world->is_mute[finger] && !waits) {
          grip_take_touch(&world->grip, (unsigned)finger, &touch);
        }
      }
    }
    if (!world->gripper_is_mute) {
      struct grip_status status = {.t_us = world->t_us,
                                   .width_um = (int32_t)world->width_um,
                                   .is_active = world->is_active,
                                   .is_moving = fabs(world->width_um - world->sent_um) > 1.0,
                                   .fault = world->fault};
      grip_take_status(&world->grip, &status);
    }
    grip_step(&world->grip, world->t_us, &world->command, &world->report);
    world->is_activated = world->is_activated || world->command.motion == GRIP_ACTIVATE;
    if (world->command.motion == GRIP_MOVE) {
      world->sent_um = world->command.width_um;
      world->least_sent_um =
          world->sent_um < world->least_sent_um ? world->sent_um : world->least_sent_um;
    }
  }
}

void world_run_to(struct world *world, enum grip_state state, uint32_t most_ms) {
  for (uint32_t i = 0; i < most_ms && world->report.state != state; i++) {
    world_run(world, 1);
  }
  TEST_ASSERT_EQUAL_MESSAGE(state, world->report.state, "state");
}
