#include "shear/static/tables.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;

// A handful to look at.
void draw_arrows(Bench &bench, ordered_json &out) {
  constexpr double FORCE_N = 5.0;
  const Object &object = bench.objects.on(LAYER_mm, "sphere15");
  Fingertip fingertip(bench.profile);
  Random random(bench.options.seed, truth::stream_of("arrows"), 0);
  const KnownPad pad = bench.calibrated(0);
  for (int column = -1; column <= 1; column++) {
    for (int row = -2; row <= 2; row++) {
      const double direction = random.uniform(0.0, 2.0 * M_PI);
      twin::Touch touch;
      touch.x_mm = 6.0 * column + random.uniform(-1.5, 1.5);
      touch.y_mm = 7.5 * row + random.uniform(-1.5, 1.5);
      touch.force_N = FORCE_N;
      touch.pull_x_N = SHARE * FORCE_N * std::cos(direction);
      touch.pull_y_N = SHARE * FORCE_N * std::sin(direction);
      touch.stuck_N = twin::stuck_force_N(FORCE_N, SHARE * FORCE_N, FRICTION);
      Said said{};
      fingertip.feel(base_Pa(fingertip.array(), object, touch, nullptr, pad.cast), pad, noise_Pa(1024), ALL_SENSORS,
                     random, said);
      out["arrows"].push_back({{"x_mm", touch.x_mm},
                               {"y_mm", touch.y_mm},
                               {"qx", touch.pull_x_N / FORCE_N},
                               {"qy", touch.pull_y_N / FORCE_N},
                               {"said_x_mm", said.x_mm},
                               {"said_y_mm", said.y_mm},
                               {"said_qx", said.qx},
                               {"said_qy", said.qy},
                               {"without_x_mm", said.gaussian_x_mm},
                               {"without_y_mm", said.gaussian_y_mm}});
    }
  }
}

} // namespace fingertip::shear
