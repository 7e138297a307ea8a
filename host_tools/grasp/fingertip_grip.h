/* The controller of a grasp in C: contact packets of two fingertips and a gripper's answers in, one
 * command out. CONTROL.md describes what it does, and where it fails.
 *
 *   const struct fingertip_grip_traits traits = {85, 0.374, 0.4, 20, 150, 20, 235, 0.025, 0.005};
 *   struct fingertip_grip *grip = fingertip_grip_new(&traits, NULL, NULL, 0);
 *   fingertip_grip_ask(grip, GRIP_REQUEST_GRASP);
 *   for (;;) {
 *     fingertip_grip_take_contact(grip, finger, t_s, values, count);     for every contact packet
 *     fingertip_grip_take_answer(grip, &answer);                         for every answer of the gripper
 *     fingertip_grip_step(grip, now_s, &command, &report);
 *   }
 *
 * Handles, threads and errors: see fingertip.h. Forces are N, lengths mm, of one fingertip: its normal force is the grip force. Times are
 * s, finite and at least 0, on one clock of the caller's for all inputs; the library has none. What a step and its inputs do is decided by
 * these inputs alone. They wait for nothing and allocate nothing, errors apart. Together they take about 2 us on a desktop computer. */
#ifndef FINGERTIP_GRIP_H
#define FINGERTIP_GRIP_H

#include "libfingertip/fingertip.h"

#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif
#ifdef __cplusplus
extern "C" {
#endif

#ifdef __cplusplus
#define FINGERTIP_GRIP_BITS : uint32_t
#else
#define FINGERTIP_GRIP_BITS
#endif

/* The phases of a grasp follow Romano et al., "Human-inspired robotic grasp control with tactile
 * sensing", IEEE Trans. Robotics 27, 2011. From SQUEEZE to HANDING an object is held. */
enum fingertip_grip_state {
  GRIP_IDLE, /* no request yet */
  GRIP_ACTIVATING,
  GRIP_APPROACH, /* closing until both fingertips have contact */
  GRIP_SQUEEZE,  /* closing until the start force is reached */
  GRIP_READY,    /* the start force is reached; the zero of the load is measured */
  GRIP_HOLDING,
  GRIP_SLIPPING, /* as HOLDING, while the object slides */
  GRIP_PLACING,  /* as HOLDING, until a table has taken the load: then RELEASE */
  GRIP_HANDING,  /* as HOLDING, until someone pulls: then RELEASE */
  GRIP_STILL,    /* the width stays, on request */
  GRIP_RELEASE,  /* opening, on request */
  GRIP_OPEN,     /* opened */
  GRIP_DROPPED,  /* the object is gone; the width stays */
  GRIP_MISSED,   /* closed without an object */
  GRIP_FAULT,    /* the width stays */
  GRIP_STATES
};

/* Bits. Each is on while its trouble lasts; those that led to GRIP_FAULT stay on. */
enum fingertip_grip_trouble FINGERTIP_GRIP_BITS {
  GRIP_FINGER_0_STALE = 1 << 0, /* no new frame for the setting stale_s */
  GRIP_FINGER_1_STALE = 1 << 1,
  GRIP_FINGER_0_FROZEN = 1 << 2, /* frames whose values never change */
  GRIP_FINGER_1_FROZEN = 1 << 3,
  GRIP_FINGER_0_FORCE_ONLY = 1 << 4, /* the tangential force is not trusted: UNCERTAIN, FLAT... */
  GRIP_FINGER_1_FORCE_ONLY = 1 << 5,
  GRIP_FINGER_0_OVER = 1 << 6, /* SATURATED or FORCE_LOWER_BOUND: never tightens further */
  GRIP_FINGER_1_OVER = 1 << 7,
  GRIP_FINGERS_DIFFER = 1 << 8,     /* forces by more than the setting differ while the gripper rests */
  GRIP_AT_CAP = 1 << 9,             /* the wanted force exceeds cap_N */
  GRIP_AT_TRAVEL_CAP = 1 << 10,     /* the wanted width is further than travel_cap_mm from the touch */
  GRIP_GRIPPER_SILENT = 1 << 11,    /* no answer for the setting silent_s */
  GRIP_GRIPPER_FAULT = 1 << 12,     /* its own code in the report */
  GRIP_GRIPPER_INACTIVE = 1 << 13,  /* it was activated and is no longer */
  GRIP_NO_LOAD = 1 << 14,           /* mode hold: no fingertip reports a load; the grip does not loosen */
  GRIP_FINGER_0_NO_FORCE = 1 << 15, /* frames, but none with a measured force */
  GRIP_FINGER_1_NO_FORCE = 1 << 16,
  GRIP_FINGER_0_LATE = 1 << 17, /* frames older than the setting late_s when they come */
  GRIP_FINGER_1_LATE = 1 << 18,
  GRIP_FINGER_0_EMPTY = 1 << 19, /* no contact in a hold, while the other has more than twice touch_N */
  GRIP_FINGER_1_EMPTY = 1 << 20,
  GRIP_NO_GRIP = 1 << 21 /* squeezed for 3 s, and less than half of the wanted force has come */
};

enum fingertip_grip_request {
  GRIP_REQUEST_GRASP,
  GRIP_REQUEST_HOLD,
  GRIP_REQUEST_RELEASE,
  GRIP_REQUEST_PLACE,
  GRIP_REQUEST_HAND_OVER,
  GRIP_REQUESTS
};

/* The motion that the gripper is asked for. */
enum fingertip_grip_motion {
  GRIP_STAY,     /* hold the position: only keep the line alive */
  GRIP_ACTIVATE, /* only while nothing is gripped */
  GRIP_MOVE
};

/* Of the gripper, all at least 0; stroke, step and both speeds above 0; each least at most the largest. grip_table.py lists those of
 * the known models. */
struct fingertip_grip_traits {
  double stroke_mm;   /* width between the pads when open */
  double step_mm;     /* of the commanded width; of a servo's jaw the largest */
  double deadband_mm; /* moves shorter than this are not made */
  double speed_min_mm_s, speed_max_mm_s;
  double force_min_N, force_max_N; /* of its own limit of force; 0: it has none */
  double latency_s;                /* from a command to motion */
  double poll_s;                   /* between two answers, at the least */
};

struct fingertip_grip_answer {
  double width_mm;
  uint8_t moving;
  uint8_t active; /* it takes commands */
  uint8_t fault;  /* the maker's code; 0: none */
  double t_s;     /* when the width was measured */
};

struct fingertip_grip_command {
  double width_mm, speed_mm_s; /* of GRIP_MOVE */
  double force_N;              /* for the gripper's own limit of force, if it has one */
  uint32_t motion;             /* enum fingertip_grip_motion */
};

struct fingertip_grip_report {
  uint8_t state;         /* enum fingertip_grip_state */
  uint8_t gripper_fault; /* the gripper's own code; in FAULT the last one stays */
  uint32_t trouble;      /* enum fingertip_grip_trouble */
  uint32_t slides;       /* since GRASP */
  double wanted_N;       /* grip force that the controller aims at */
  double force_N;        /* grip force, from both fingertips */
  double finger_N[2];    /* force of each fingertip */
  double load_N;         /* tangential force at one fingertip since READY; 0: unknown */
  double margin;         /* force x friction / load; 0: no load */
  double friction, width_mm;
  double delay_s; /* from a fingertip's measurement to the controller */
};

/* Settings, in the units of their names: set_N, which chooses the mode that holds this force, cap_N, travel_cap_mm, start_N, floor_N,
 * blind_N, friction, margin, slid, decay_1_s, rest_s, pull_N, mass_kg, lift_m_s2, touch_N, approach_mm_s, release_mm_s, release_width_mm,
 * stale_s, late_s, silent_s, differ, kp_mm_N, ki_mm_Ns, kd_mm_s_N, control_s; `fingertip grasp --help` describes them in this order.
 * A setting that is not given has the gripper's default. NULL: fingertip_error has the setting and its range. */
struct fingertip_grip;
struct fingertip_grip *fingertip_grip_new(const struct fingertip_grip_traits *traits, const char *const *names, const double *values,
                                          size_t count);
void fingertip_grip_free(struct fingertip_grip *grip);
/* Other settings from the next step on, in any state; what is not given stays. FINGERTIP_ERR_VALUE: out of range, or of the
 * other mode; all stay as they were. */
enum fingertip_status fingertip_grip_set(struct fingertip_grip *grip, const char *const *names, const double *values, size_t count);
enum fingertip_status fingertip_grip_setting(const struct fingertip_grip *grip, const char *name, double *value);

/* A contact packet's numbers, fingertip_value_count(0x01); what is no number counts as 0. finger: 0 or 1. t_s: when it
 * was measured. A packet that is no newer than the last is ignored. */
enum fingertip_status fingertip_grip_take_contact(struct fingertip_grip *grip, size_t finger, double t_s, const double *values,
                                                  size_t count);
enum fingertip_status fingertip_grip_take_answer(struct fingertip_grip *grip, const struct fingertip_grip_answer *answer);
/* FINGERTIP_END: not from this state (CONTROL.md). */
enum fingertip_status fingertip_grip_ask(struct fingertip_grip *grip, enum fingertip_grip_request request);
/* Call it after every input, and every 10 ms without one. */
enum fingertip_status fingertip_grip_step(struct fingertip_grip *grip, double now_s, struct fingertip_grip_command *command,
                                          struct fingertip_grip_report *report);

#ifdef __cplusplus
}
#endif
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
