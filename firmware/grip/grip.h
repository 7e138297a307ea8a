/* The controller of a grasp: frames of two fingertips and a gripper's status in, one command out.
 *
 *   struct grip grip;
 *   grip_init(&grip, &settings, &traits);
 *   grip_request(&grip, GRIP_REQUEST_GRASP);
 *   for (;;) {
 *     grip_take_touch(&grip, finger, &touch);     for every frame of either fingertip
 *     grip_take_status(&grip, &status);           for every answer of the gripper
 *     grip_step(&grip, now_us, &command, &report);
 *   }
 *
 * Two modes. `fixed` holds a set force: De Clercq et al., RA-L 2022, eq. (5) and (6). `hold` holds
 * an object of unknown weight by its load: grip force = margin x tangential load / friction. The
 * grip rises at once where the object slides, and falls slowly while it rests. CONTROL.md has the
 * reasons.
 *
 * Integers throughout, so that every machine gives the same bits. No clock, no allocation, no
 * floats. Times are the caller's, in us, on one clock for all inputs, and never go back. Forces are
 * mN, lengths um, of one fingertip: its normal force is the grip force. The controller clamps
 * values beyond their range. Main context only: it divides with port/divide.h.
 *
 * Cost on a Cortex-M0+: grip_step 3500 cycles in the median, at most 15 000 (test
 * emulated.fit_bits), 400 bytes of stack (checks.stack_grip). */
#ifndef GRIP_GRIP_H
#define GRIP_GRIP_H

#include "common/contact_flags.h"
#include "common/status.h"

#include <stdbool.h>
#include <stdint.h>

#define GRIP_FINGERS 2

/* One frame of a fingertip: a contact packet in integers. A value whose VALID flag is off is 0. */
struct grip_touch {
  uint64_t t_us;  /* when it was measured */
  uint32_t flags; /* enum contact_flag */
  int32_t force_mN, force_sd_mN;
  int32_t x_um, y_um, sigma_um;
  int32_t qx_mN, qy_mN, q_sd_mN; /* tangential load of the object on the rubber */
  int32_t vx_um_s, vy_um_s;
};

/* What a gripper can do. */
struct grip_traits {
  int32_t stroke_um;                      /* between the pads when open; 0 is closed */
  int32_t step_um;                        /* of the commanded width */
  int32_t deadband_um;                    /* moves shorter than that are not made; 0: none */
  int32_t speed_min_um_s, speed_max_um_s; /* of the width */
  int32_t force_min_mN, force_max_mN;     /* of its own limit of force; 0: it has none */
  int32_t latency_us;                     /* from a command to motion */
  int32_t poll_us;                        /* between two commands, at the least */
};

enum grip_object { GRIP_OBJECT_UNKNOWN, GRIP_OBJECT_NONE, GRIP_OBJECT_HELD };

/* What a gripper says. */
struct grip_status {
  uint64_t t_us; /* when it was asked */
  int32_t width_um;
  bool is_active; /* it has been activated and takes commands */
  bool is_moving;
  uint8_t object; /* enum grip_object: what the gripper itself believes */
  uint8_t fault;  /* the gripper's own code; 0: none */
};

/* What the gripper is to do. */
enum grip_motion {
  GRIP_STAY,     /* hold the position: nothing is sent but what keeps the line alive */
  GRIP_ACTIVATE, /* only where nothing is gripped */
  GRIP_MOVE,     /* to width_um at speed_um_s */
};
struct grip_command {
  uint8_t motion; /* enum grip_motion */
  int32_t width_um;
  int32_t speed_um_s;
  int32_t force_mN; /* the gripper's own limit; 0: it has none */
};

enum grip_mode { GRIP_MODE_FIXED, GRIP_MODE_HOLD };

/* Romano et al., "Human-inspired robotic grasp control with tactile sensing", IEEE Trans. Robotics
 * 27, 2011, has the course of it. */
enum grip_state {
  GRIP_IDLE, /* no request yet */
  GRIP_ACTIVATING,
  GRIP_APPROACH, /* closing until both fingertips feel the object */
  GRIP_SQUEEZE,  /* up to the first force */
  GRIP_READY,    /* that force stands; the present load counts as zero */
  GRIP_HOLDING,
  GRIP_SLIPPING, /* as HOLDING, and an object that slides is being caught */
  GRIP_STILL,    /* the width stays, because it was asked for */
  GRIP_RELEASE,  /* opening, because it was asked for */
  GRIP_OPEN,     /* done */
  GRIP_DROPPED,  /* nothing is between the fingertips any more; the width stays */
  GRIP_MISSED,   /* closed, and nothing was there */
  GRIP_FAULT,    /* the width stays */
  GRIP_STATES,
};

/* Troubles; bits. Each is on while it lasts, those of GRIP_FAULT stay. */
enum grip_trouble {
  GRIP_FINGER_0_STALE = 1 << 0, /* no frame for settings.stale_us */
  GRIP_FINGER_1_STALE = 1 << 1,
  GRIP_FINGER_0_FROZEN = 1 << 2, /* frames whose values never change */
  GRIP_FINGER_1_FROZEN = 1 << 3,
  GRIP_FINGER_0_FORCE_ONLY =
      1 << 4, /* location and load are not to be trusted: UNCERTAIN, FLAT... */
  GRIP_FINGER_1_FORCE_ONLY = 1 << 5,
  GRIP_FINGER_0_OVER = 1 << 6, /* SATURATED or FORCE_LOWER_BOUND: never tightens further */
  GRIP_FINGER_1_OVER = 1 << 7,
  GRIP_FINGERS_DIFFER = 1 << 8,  /* forces by more than settings.differ_permille */
  GRIP_AT_CAP = 1 << 9,          /* more force than force_cap_mN is wanted */
  GRIP_AT_TRAVEL_CAP = 1 << 10,  /* closing further than travel_cap_um since the touch is wanted */
  GRIP_GRIPPER_SILENT = 1 << 11, /* no status for settings.silent_us */
  GRIP_GRIPPER_FAULT = 1 << 12,  /* its own code in the report */
  GRIP_GRIPPER_INACTIVE = 1 << 13, /* it was activated and is no longer */
  GRIP_NO_LOAD = 1 << 14, /* mode hold: no fingertip reports a load; the grip does not loosen */
  GRIP_FINGER_0_UNTOLD = 1 << 15, /* frames, but none with a measured force */
  GRIP_FINGER_1_UNTOLD = 1 << 16,
};

#define GRIP_GRIPPER_FAULTS (GRIP_GRIPPER_FAULT | GRIP_GRIPPER_INACTIVE)

enum grip_request { GRIP_REQUEST_GRASP, GRIP_REQUEST_HOLD, GRIP_REQUEST_RELEASE };

/* Of one actuator, for eq. (6): dP = kp e + ki integral(e) + kd de/dt, closing from the width at
 * which both fingertips touched. */
struct grip_gains {
  int32_t kp_um_per_N;
  int32_t ki_um_per_Ns;
  int32_t kd_um_s_per_N;
};

struct grip_settings {
  uint8_t mode; /* enum grip_mode */
  /* Both modes */
  int32_t touch_mN;      /* of a fingertip: contact. 20..2000 */
  int32_t approach_um_s; /* of the width. 500..8000: faster, and the first touch is a blow */
  int32_t force_cap_mN;  /* never aimed above. Beyond it a fingertip's force is never added to */
  int32_t travel_cap_um; /* never closed further since the touch */
  int32_t release_um_s, release_width_um; /* opening: how fast, until where */
  uint32_t stale_us;       /* a fingertip without a frame for so long is ignored */
  uint32_t silent_us;      /* the same for the gripper */
  int32_t differ_permille; /* of the larger force: GRIP_FINGERS_DIFFER above it */
  /* fixed */
  int32_t set_mN; /* F_des */
  struct grip_gains gains;
  uint32_t control_us; /* between two steps of eq. (6) */
  /* hold */
  int32_t first_mN;          /* grip before anything pulls, and never less; half as much again of a
                              * contact whose load can only be guessed */
  int32_t blind_mN;          /* grip where no load can be estimated, reached before anything pulls
                              */
  int32_t shift_um;          /* by which a tangential load as large as the force moves a location
                              * that is not corrected for it; 0: no guesses from that */
  int32_t friction_permille; /* until a slide, or a load that does not slide, shows better */
  int32_t margin_permille;   /* grip over load / friction, */
  int32_t slid_permille;     /* and so much of that since it has slid: it will again */
  int32_t decay_permille_s;  /* decay of a grip that is too large, share of it a second */
  uint32_t rest_us;          /* no sooner after a slide */
};

/* The defaults of grip_defaults.c for these traits. */
void grip_default_settings(struct grip_settings *settings, const struct grip_traits *traits);

struct grip_report {
  uint8_t state;    /* enum grip_state */
  uint32_t trouble; /* enum grip_trouble */
  uint8_t gripper_fault; /* its own code; that of FAULT stays, until there is another */
  int32_t wanted_mN; /* the grip force that it aims at */
  int32_t force_mN;  /* as reported: the smaller of both fingertips' */
  int32_t load_mN;   /* tangential load of one fingertip since READY; 0 if unknown */
  int32_t margin_permille; /* force x friction / load, at most 100 000; 0: no load */
  int32_t friction_permille;
  int32_t width_um;
  uint32_t slides; /* so many since GRASP */
};

/* The fields are for the files of this folder only. */
struct grip_zero {
  int32_t x, y;         /* before any load */
  int32_t x_sum, y_sum; /* while it is measured */
  uint32_t sums;
};
struct grip_finger {
  struct grip_touch touch; /* the newest */
  uint64_t changed_us;     /* when its values last changed */
  uint64_t told_us;        /* of the newest frame that reports a force, */
  int32_t force_mN;        /* and that force */
  uint32_t unchanged;      /* frames whose values are those of the one before */
  struct grip_zero pull;   /* mN */
  struct grip_zero place;  /* um, of a location that is not corrected */
  uint64_t pulled_us;      /* the newest frame that reported a tangential load */
  uint64_t still_us;       /* the newest that reported no slide */
  bool is_heard, is_new, has_pulled, has_place;
  bool tells_load, guesses_load; /* itself; from how the location has moved, */
  bool shifts;                   /* by more than a load moves it */
  int32_t load_mN;
  int32_t told_x_mN, told_y_mN;    /* the last reported load, */
  bool has_told;                   /* and none has been guessed since */
  int32_t guess_x, guess_y;        /* the load that is guessed: times settings.shift_um / 64, */
  int32_t at_x_um, at_y_um, at_mN; /* as of this location and force */
};

#define GRIP_WIDTHS 16
struct grip_width {
  uint64_t t_us;
  int32_t width_um;
};

struct grip_hold {
  int32_t load_mN;      /* as last reported */
  int32_t slow_load_mN; /* behind it */
  int32_t rate_mN_s;    /* of the load, upwards */
  uint64_t load_us;     /* when it was reported */
  uint64_t decayed_us;
  int32_t friction_permille;
  int32_t share_permille;        /* recent largest load over force */
  int32_t floor_mN;              /* since the last slide */
  uint64_t slid_us;              /* the last frame that reported a slide */
  uint64_t raised_us;            /* the last reflex, */
  int32_t raised_share_permille; /* and load over force then */
  bool has_told, has_slid, sliding, load_is_believed;
  uint32_t slides;
};

struct grip_pid {
  bool runs;
  uint64_t t_us;
  int32_t error_mN;
  int64_t integral_mN_us;
};

struct grip {
  struct grip_settings settings;
  struct grip_traits traits;
  uint64_t now_us;
  uint8_t state;
  uint64_t since_us; /* the state has been */
  struct grip_finger finger[GRIP_FINGERS];
  struct grip_status status;
  bool status_is_heard;
  struct grip_width widths[GRIP_WIDTHS]; /* ring */
  uint32_t newest_width, width_count;
  int32_t touch_width_um;
  int32_t target_um; /* the width that was last commanded */
  uint64_t aimed_us; /* when it last changed for a force */
  int32_t wanted_mN;
  int32_t tightened_mN;   /* what was wanted when it last closed for a force */
  uint64_t empty_us;      /* since when neither fingertip feels anything; 0: one does */
  uint64_t stood_us;      /* since when the gripper stands where an approach ends */
  uint64_t ramped_us;     /* the last step of an approach or a release */
  uint32_t trouble;       /* as of the last step */
  uint32_t fault_trouble; /* that of FAULT, */
  uint8_t fault_code;     /* and the gripper's own */
  bool may_activate;
  bool is_entered;   /* the state is new */
  bool still_grasps; /* STILL with an object */
  bool is_blind;     /* squeezed without a fingertip that could estimate a load; */
  bool is_guessing;  /* without one that reported one */
  struct grip_hold hold;
  struct grip_pid pid;
};

/* FT_ERR_ARGUMENT: a setting or a trait outside its range. */
enum ft_status grip_init(struct grip *grip, const struct grip_settings *settings,
                         const struct grip_traits *traits);

/* Ignores a frame older than the last of this finger. */
void grip_take_touch(struct grip *grip, unsigned finger, const struct grip_touch *touch);

void grip_take_status(struct grip *grip, const struct grip_status *status);

/* GRASP: from IDLE, OPEN, DROPPED, MISSED. HOLD: the width stays, from every state. RELEASE: opens,
 * from every state but FAULT of the gripper itself. False: not from this state. */
bool grip_request(struct grip *grip, enum grip_request request);

/* Decides what to do now. Call it after every input, and every 10 ms without one. */
void grip_step(struct grip *grip, uint64_t now_us, struct grip_command *command,
               struct grip_report *report);

#endif
