#include "shear/static/bench.hpp"

#include "libfingertip/in_parallel.hpp"
#include "simulation/twin/traction.hpp"

extern "C" {
#include "config/defaults.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace fingertip::shear {

namespace {

// In turn, each with the scale that a known weight tells.
PadOf weighed(std::vector<KnownPad> pads, double layer_mm, Objects &objects) {
  const Object &sphere15 = objects.on(layer_mm, "sphere15");
  Fingertip fingertip(profile_of(layer_mm));
  for (KnownPad &pad : pads) {
    pad = fingertip.weighed(pad, sphere15);
  }
  return [pads = std::move(pads)](std::size_t pad) { return pads[pad % pads.size()]; };
}

bool is_on_array(double x_mm, double y_mm) {
  return std::abs(x_mm) <= 9.0 && std::abs(y_mm) <= 18.0;
}

} // namespace

double noise_Pa(std::uint16_t osr) {
  return ms58xx_find_osr(osr)->noise_Pa_q10 / 1024.0;
}

const char *place_of(const twin::Touch &touch) {
  const bool at_x = std::abs(touch.x_mm) > 4.5, at_y = std::abs(touch.y_mm) > 13.5;
  return at_x && at_y ? "corner" : at_x || at_y ? "border" : "inner";
}

Bench::Bench(const Options &given) : options(given), objects(given.cache), profile(profile_of(LAYER_mm)) {
  if (options.pads == 0) {
    throw std::runtime_error("--pads needs at least one pad");
  }
  calibrated = calibrated_as(truth::USUAL_PADS);
  progress("calibrations");
  equal = [](std::size_t) { return KnownPad{truth::perfect_pad(), {}}; };
  const auto spread = [seed = options.seed](double sd, double told) {
    return [seed, sd, told](std::size_t pad) {
      Random random(seed, truth::stream_of("raw pads"), pad);
      return KnownPad{truth::raw_pad(sd, told, random), {}};
    };
  };
  raw5 = spread(0.05, 0.05);
  raw10 = spread(0.10, static_cast<double>(DEFAULT_GAIN_SD));
}

std::vector<const Object *> Bench::on(double layer_mm, const std::vector<std::string> &names) {
  std::vector<const Object *> found;
  for (const std::string &name : names) {
    found.push_back(&objects.on(layer_mm, name));
  }
  return found;
}

Case Bench::usual() {
  Case c;
  c.objects = on(LAYER_mm, SEVEN);
  c.pad = calibrated;
  return c;
}

PadOf Bench::calibrated_on(double layer_mm) {
  std::vector<KnownPad> pads;
  for (const truth::Pad &pad : truth::calibrated_pads(options.pads, options.seed, options.cache)) {
    pads.push_back({pad, {}});
  }
  return weighed(std::move(pads), layer_mm, objects);
}

PadOf Bench::calibrated_as(const std::vector<truth::PadOptions> &kinds) {
  std::vector<KnownPad> pads;
  for (const truth::Calibrated &session : truth::calibrations_of(kinds, options.pads, options.seed, options.cache)) {
    pads.push_back({truth::calibrated_pad(session), {}, session.shape, cast_of(session)});
  }
  return weighed(std::move(pads), LAYER_mm, objects);
}

std::size_t Bench::units(const Case &c) const {
  const double pads = std::ceil(c.fewer * static_cast<double>(options.pads));
  return static_cast<std::size_t>(pads) * UNITS_PER_PAD;
}

void Bench::progress(const char *what) {
  std::fprintf(stderr, "shear_static: %s\n", what);
}

twin::Touch Bench::draw(const Case &c, const fit_array &array, Random &random) const {
  twin::Touch touch;
  do {
    const truth::Touch drawn = truth::draw_touch(array, random);
    touch.x_mm = drawn.x_mm * (1.0 + c.beyond_mm / 9.0);
    touch.y_mm = drawn.y_mm * (1.0 + c.beyond_mm / 18.0);
    touch.angle_rad = drawn.angle_rad;
  } while (c.beyond_mm > 0.0 && is_on_array(touch.x_mm, touch.y_mm));
  touch.force_N = random.uniform(c.force_min_N, c.force_max_N);
  const double share = c.history == History::slides ? FRICTION : c.share;
  const double direction = random.uniform(0.0, 2.0 * M_PI), load_N = share * touch.force_N;
  touch.pull_x_N = load_N * std::cos(direction);
  touch.pull_y_N = load_N * std::sin(direction);
  touch.stuck_N = c.history == History::held ? twin::stuck_force_N(touch.force_N, load_N, FRICTION) : 0.0;
  return touch;
}

Results Bench::run(const std::string &table, const Case &c, const pad_profile *told) const {
  std::vector<Judged> judged(units(c) * TOUCHES);
  const std::uint64_t stream = truth::stream_of(table);
  twin::in_parallel(units(c), [&](std::size_t unit) {
    Random random(options.seed, stream, unit), errors(options.seed, stream + 1, unit);
    Fingertip fingertip(told ? *told : profile);
    const KnownPad pad = c.pad(unit / UNITS_PER_PAD);
    for (std::size_t t = 0; t < TOUCHES;) {
      Judged &j = judged[unit * TOUCHES + t];
      j.truth = draw(c, fingertip.array(), random);
      j.object = random.next() % c.objects.size();
      const Readings base = base_Pa(fingertip.array(), *c.objects[j.object], j.truth, c.block, pad.cast);
      const std::uint32_t usable = truth::choose_sensors(c.sensors, errors);
      // Without a positive reading among the sensors in use there is nothing to judge.
      t += fingertip.feel(base, pad, noise_Pa(c.osr), usable, errors, j.said);
    }
  });
  return Results(std::move(judged));
}

} // namespace fingertip::shear
