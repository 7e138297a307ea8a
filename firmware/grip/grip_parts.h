/* What the files of the controller share. */
#ifndef GRIP_GRIP_PARTS_H
#define GRIP_GRIP_PARTS_H

#include "grip/grip.h"

/* The reports of both fingertips, as far as they are believed. */
struct grip_view {
  uint32_t trouble;                  /* those of the fingertips */
  uint8_t fingers, touches;          /* so many report a force; feel a contact */
  int32_t low_mN, high_mN, mean_mN;  /* of those; 0 without any */
  uint64_t t_us;                     /* of the older of them */
  bool fresh;                        /* there has been a frame since the last step */
  bool over;                         /* never tighten */
  bool has_load, tells_load, slides; /* tells_load: it is no guess */
  bool creeps, runs;                 /* what slides does so slowly; fast */
  bool may_tell;                     /* a load, once there is a zero for it */
  int32_t load_mN;                   /* tangential load of one fingertip, since its zero */
};

int32_t grip_clamp(int32_t value, int32_t low, int32_t high);
/* value x numerator / denominator for products of up to 63 bits; denominator above 0. */
int32_t grip_scale(int32_t value, int32_t numerator, int32_t denominator);

void grip_look(struct grip *grip, struct grip_view *view);
/* The present load counts as zero: begins, adds the newest frames, ends. */
void grip_zero_begin(struct grip *grip);
void grip_zero_end(struct grip *grip);
bool grip_zero_has(const struct grip *grip, uint32_t frames);

/* After a slide: the motion of a location since its zero is no load any more. */
void grip_guess_anew(struct grip *grip);

/* The width that the gripper had then. */
int32_t grip_width_at(const struct grip *grip, uint64_t t_us);
/* mN for each mm that the gripper closes. */
int32_t grip_stiffness(const struct grip *grip, int32_t force_mN, int32_t width_um);
/* Has target_um follow what is wanted, in whole steps. Trouble: which cap keeps it from it. */
uint32_t grip_aim(struct grip *grip, const struct grip_view *view, int32_t wanted_mN);
/* A width that no cap forbids, in whole steps. */
int32_t grip_allowed_width(const struct grip *grip, const struct grip_view *view, int32_t width_um,
                           uint32_t *trouble);

void grip_hold_begin(struct grip *grip);
/* Grip before anything pulls. */
int32_t grip_first_force(const struct grip *grip);
/* The force that is wanted now. */
int32_t grip_hold_wants(struct grip *grip, const struct grip_view *view);

void grip_fixed_begin(struct grip *grip);
uint32_t grip_fixed_step(struct grip *grip, const struct grip_view *view);

#endif
