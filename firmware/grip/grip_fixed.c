#include "grip/grip_parts.h"
#include "port/divide.h"

/* Sums and differences of what a fingertip can feel in an hour fit. */
#define ERROR_MAX_mN 100000
#define INTEGRAL_MAX_mN_us INT64_C(400000000000000)

/* An error that no move mends is neither added up nor answered: it would make the gripper go to and
 * fro. Rubber that has settled yields more force to opening than to closing. */
#define CLOSES_PERMILLE 625 /* of what the least move makes */
#define OPENS_PERMILLE 1000

void grip_fixed_begin(struct grip *grip) {
  grip->pid = (struct grip_pid){0};
}

static bool is_mended(const struct grip *grip, const struct grip_view *view, int32_t error_mN) {
  int32_t step_um = grip->traits.step_um, deadband_um = grip->traits.deadband_um;
  int32_t steps = deadband_um > step_um ? port_divide(deadband_um + step_um - 1, step_um) : 1;
  int32_t stiffness = grip_stiffness(grip, view->mean_mN, grip->target_um);
  int32_t move_mN = grip_scale(stiffness, steps * step_um, 1000);
  return error_mN > grip_scale(move_mN, CLOSES_PERMILLE, 1000) ||
         error_mN < -grip_scale(move_mN, OPENS_PERMILLE, 1000);
}

uint32_t grip_fixed_step(struct grip *grip, const struct grip_view *view) {
  struct grip_pid *pid = &grip->pid;
  const struct grip_settings *settings = &grip->settings;
  uint32_t trouble = 0;
  grip->wanted_mN = settings->set_mN;
  if (view->fingers == 0 || (pid->runs && grip->now_us - pid->t_us < settings->control_us)) {
    return trouble;
  }
  /* Eq. (5); of one fingertip where the other says nothing. */
  int32_t error_mN = grip_clamp(settings->set_mN - view->mean_mN, -ERROR_MAX_mN, ERROR_MAX_mN);
  int64_t proportional = (int64_t)settings->gains.kp_um_per_N * error_mN;
  bool mends = is_mended(grip, view, error_mN);
  int64_t derivative = 0, integral_mN_us = pid->integral_mN_us;
  if (pid->runs) {
    int64_t step_us = (int64_t)(grip->now_us - pid->t_us);
    derivative =
        (int64_t)settings->gains.kd_um_s_per_N * (error_mN - pid->error_mN) * 1000000 / step_us;
    integral_mN_us += mends ? error_mN * step_us : 0;
  }
  integral_mN_us = integral_mN_us > INTEGRAL_MAX_mN_us    ? INTEGRAL_MAX_mN_us
                   : integral_mN_us < -INTEGRAL_MAX_mN_us ? -INTEGRAL_MAX_mN_us
                                                          : integral_mN_us;
  int64_t integral = settings->gains.ki_um_per_Ns * (integral_mN_us / 1000) / 1000;
  /* Eq. (6), in um / 1000. */
  int64_t change = proportional + integral + derivative;
  const int64_t most = INT64_C(1000) * 1000000;
  change = change > most ? most : change < -most ? -most : change;
  int32_t aimed_um = grip->touch_width_um - (int32_t)(change / 1000);
  int32_t off_um = aimed_um - grip->target_um;
  int32_t steps =
      port_divide(off_um + (off_um < 0 ? -1 : 1) * grip->traits.step_um / 2, grip->traits.step_um);
  int32_t next_um = grip->target_um + (mends ? steps * grip->traits.step_um : 0);
  if (steps < 0 && view->high_mN >= settings->force_cap_mN) {
    trouble |= GRIP_AT_CAP;
    next_um = grip->target_um;
  }
  int32_t allowed_um = grip_allowed_width(grip, view, next_um, &trouble);
  if (allowed_um == next_um || integral_mN_us < pid->integral_mN_us) {
    pid->integral_mN_us = integral_mN_us; /* it does not wind up at a limit */
  }
  grip->target_um = allowed_um;
  pid->error_mN = error_mN;
  pid->t_us = grip->now_us;
  pid->runs = true;
  return trouble;
}
