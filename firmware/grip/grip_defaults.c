#include "grip/grip_parts.h"
#include "port/divide.h"

/* Eq. (6) for an actuator on two pads of 12 mm, 2 to 5 N/mm together at 2 to 8 N: most of what is
 * missing comes by the integral, in about five times the actuator's dead time. */
static void default_gains(struct grip_gains *gains, const struct grip_traits *traits) {
  int32_t dead_us = traits->latency_us + traits->poll_us + 10000;
  gains->kp_um_per_N = 60;
  gains->ki_um_per_Ns = grip_clamp(port_divide(60000000, dead_us), 300, 4000);
  gains->kd_um_s_per_N = 0;
}

void grip_default_settings(struct grip_settings *settings, const struct grip_traits *traits) {
  *settings = (struct grip_settings){
      .mode = GRIP_MODE_HOLD,
      .touch_mN = 150,
      .approach_um_s = 8000,
      .force_cap_mN = 20000,
      .travel_cap_um = 12000,
      .release_um_s = 10000,
      .release_width_um = traits->stroke_um,
      .stale_us = 50000,
      .silent_us = 500000,
      .differ_permille = 300,
      .set_mN = 5000,
      .control_us = 10000,
      .first_mN = 1500 + traits->step_um * 8 / 5, /* what a step may miss */
      .blind_mN = 12000,
      .shift_um = 4500,
      .friction_permille = 550,
      .margin_permille = grip_clamp(1175 + port_divide(traits->latency_us, 200), 1000, 1500),
      .slid_permille = grip_clamp(1080 + port_divide(traits->latency_us, 50), 1080, 1250),
      .decay_permille_s = 5000,
      .rest_us = 300000,
  };
  default_gains(&settings->gains, traits);
}
