/* Two pads of rubber, an object between them and a gripper, just so far that a controller has
 * something to do: force grows as the indentation to the 1.6, the gripper goes at its speed after
 * its latency, in whole steps.
 */
#ifndef UNIT_GRIP_WORLD_H
#define UNIT_GRIP_WORLD_H

#include "grip/grip.h"

struct world {
  struct grip grip;
  struct grip_traits traits;
  struct grip_command command;
  struct grip_report report;
  uint64_t t_us;
  uint32_t frame_us, frames;
  double width_um, sent_um, object_um; /* object_um: none where it is 0 */
  double stiffness;                    /* N at 1 mm of each pad's indentation */
  double force_mN;
  int32_t load_mN;  /* of each fingertip */
  int32_t sigma_um; /* of the contact, as fitted */
  int32_t place_um; /* and its location, unless it is corrected for the load */
  double gave_um;   /* by which the rubber has given way, which stays as the force grows */
  int32_t gave_mN;  /* under this load */
  int32_t speed_um_s[GRIP_FINGERS]; /* of the contact, with VELOCITY_VALID */
  uint32_t add_flags[GRIP_FINGERS], drop_flags[GRIP_FINGERS];
  double gain[GRIP_FINGERS];
  bool is_mute[GRIP_FINGERS], is_frozen[GRIP_FINGERS];
  bool take_turns; /* a frame of one fingertip, then one of the other */
  bool gripper_is_mute, is_active, is_activated; /* the last: by a command */
  uint8_t fault;
  double sent_before_um[64]; /* ring of what was sent, a ms apart */
  double least_sent_um;
};

/* A gripper of steps of 10 um, and its defaults. */
void world_begin(struct world *world);
/* With world->traits and these settings. */
void world_set(struct world *world, const struct grip_settings *settings);
void world_run(struct world *world, uint32_t ms);
/* Runs until the state, a test failure after that long. */
void world_run_to(struct world *world, enum grip_state state, uint32_t most_ms);

#endif
