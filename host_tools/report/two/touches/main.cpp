// two_touches: what the fingertip says of one contact, a long one, one that pulls, and two.
//
// The twin's objects press on calibrated pads of 12 mm with a dip, and hold still while the
// firmware's fit_shapes answers, as scene grasp runs it. What it says first is looked at, and what
// it says HELD_FRAMES later. Two contacts are the sum of their pressures. One JSON object on the
// standard output: the keys that are judged, and under "touches" the table behind them. The
// constants of fit_shapes were chosen with the seeds 20000 and 30000, the rules of shapes_locate
// were tried with 50000 and 60000.
#include "libfingertip/in_parallel.hpp"
#include "report/reference/options.hpp"
#include "shear/static/pulled.hpp"
#include "truth/fit/statistics.hpp"
#include "two/touches/bound.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "contact/shapes.h"
#include "fit/fit_doubt.h"
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace fingertip;
using namespace fingertip::truth;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: two_touches [--seed S] [--pads N] [--cache DIR]\n"
                        "  --seed S     of pads and touches, 40000 by default\n"
                        "  --pads N     calibrated pads, 200 by default\n"
                        "  --cache DIR  folder of the contact tables\n";

constexpr double LAYER_mm = 12.0, DIP_PERCENT = 1.25, FRICTION = 0.5, LOAD = 0.3;
constexpr int TOUCHES = 20;                        // of each pad, in each case
constexpr double NEAR_mm = 1.5, FORCE_SHARE = 0.1; // a pair is right within these
constexpr double BAD_mm = 1.0;
constexpr int HELD_FRAMES = 40;                          // after the first answer
constexpr two::Right RIGHT{NEAR_mm, FORCE_SHARE, 0.002}; // and as often a long contact called two
constexpr std::size_t BOUNDED = 1;                       // touches of each pad whose bounds are computed
// What a judge's model is off by, of the largest reading: as the firmware states of its own, half
// and a quarter of it, and nothing.
struct JudgeOf {
  const char *possible;
  double model_share;
};
constexpr JudgeOf JUDGES[] = {{"possible", 0.002},
                              {"possible_model_halved", 0.001},
                              {"possible_model_quartered", 0.0005},
                              {"possible_rubber_known", 0.0}};
constexpr double WEAKER_MIN_N = 2.0, WEAKER_MAX_N = 5.0;
constexpr double DEGREES = 180.0 / M_PI;

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR;
  std::uint64_t seed = 40000, pads = 200;
};

struct DippedPad {
  Pad gains;
  calibrating::Shape shape;
  shear::Cast cast;
};

enum class Towards { any, along, across }; // the pad's longer side, and its shorter one

struct Case {
  std::string name;
  std::vector<const shear::Object *> objects; // one of them, or the same twice
  double apart_mm = 0.0, ratio = 1.0;         // of a pair; forces, stronger to weaker
  double load = 0.0;
  bool exact = false; // no gain has an error, nor is one expected
  Towards towards = Towards::any;
  bool shown_only = false; // and not judged
};

struct Judged {
  fit_shapes_result said;
  // What the packet shows, and its standard deviation. Of two the worse place; of one contact its
  // place (shapes_locate), for a pair from the middle of the forces.
  double off_mm, off_sd_mm;
  double force;     // relative error of the sum
  double angle_deg; // of a long contact or the line through two
  bool pair, silent;
  using Bounds = std::array<two::PairBound, std::size(JUDGES)>;
  std::optional<Bounds> bounds; // of some of the pairs
};

double distance(const Touch &touch, float x_mm, float y_mm) {
  return std::hypot(static_cast<double>(x_mm) - touch.x_mm, static_cast<double>(y_mm) - touch.y_mm);
}

// Between undirected lines.
double angle_deg(const fit_shapes_result &said, double angle_rad) {
  const double off = std::atan2(static_cast<double>(said.along_y), static_cast<double>(said.along_x)) - angle_rad;
  return DEGREES * std::abs(std::remainder(off, M_PI));
}

Judged judge_touch(const fit_shapes_result &said, const shapes_place &shown, const std::vector<Touch> &touches) {
  Judged judged{};
  judged.said = said;
  judged.pair = touches.size() == 2;
  double force_N = 0.0;
  for (const Touch &touch : touches) {
    force_N += touch.force_N;
  }
  judged.force = static_cast<double>(said.force_N[0] + said.force_N[1]) / force_N - 1.0;
  const bool told = said.shape == FIT_SHAPE_ROUND || said.shape == FIT_SHAPE_PULLED ||
                    said.shape == FIT_SHAPE_ELONGATED || said.shape == FIT_SHAPE_TWO;
  const auto sd_mm = [&](int c) { return static_cast<double>(said.location_sd_mm[c]); };
  if (judged.pair && said.shape == FIT_SHAPE_TWO) {
    double off_mm[2][2];
    for (int c = 0; c < 2; c++) {
      for (std::size_t t = 0; t < 2; t++) {
        off_mm[c][t] = distance(touches[t], said.x_mm[c], said.y_mm[c]);
      }
    }
    const double straight = std::max(off_mm[0][0], off_mm[1][1]);
    const double crossed = std::max(off_mm[0][1], off_mm[1][0]);
    const bool is_straight = straight <= crossed;
    judged.off_mm = std::min(straight, crossed);
    const int worse = is_straight ? (off_mm[0][0] >= off_mm[1][1] ? 0 : 1) : (off_mm[0][1] >= off_mm[1][0] ? 0 : 1);
    judged.off_sd_mm = sd_mm(worse);
  } else if (told) {
    Touch middle{};
    for (const Touch &touch : touches) {
      middle.x_mm += touch.x_mm * touch.force_N / force_N;
      middle.y_mm += touch.y_mm * touch.force_N / force_N;
    }
    judged.off_mm = distance(middle, shown.x_mm, shown.y_mm);
    judged.off_sd_mm = static_cast<double>(shown.location_sd_mm);
    if (said.shape == FIT_SHAPE_TWO) { // of one contact: the nearer place
      judged.off_mm =
          std::min(distance(middle, said.x_mm[0], said.y_mm[0]), distance(middle, said.x_mm[1], said.y_mm[1]));
      judged.off_sd_mm = std::max(sd_mm(0), sd_mm(1));
    }
  }
  if (said.shape == FIT_SHAPE_ELONGATED) {
    judged.angle_deg =
        judged.pair ? angle_deg(said, std::atan2(touches[1].y_mm - touches[0].y_mm, touches[1].x_mm - touches[0].x_mm))
                    : angle_deg(said, touches[0].angle_rad + 0.5 * M_PI); // a roller lies along y
  }
  // One place for two contacts is wrong whatever its error, unless it is called long.
  const bool is_far = judged.off_mm > BAD_mm ||
                      (judged.pair && (said.shape == FIT_SHAPE_ROUND || said.shape == FIT_SHAPE_PULLED)) ||
                      (!judged.pair && said.shape == FIT_SHAPE_TWO);
  judged.silent = told && is_far && judged.off_sd_mm <= static_cast<double>(FIT_LOCATION_SD_LIMIT_mm);
  return judged;
}

bool is_right(const Judged &j) {
  return j.said.shape == FIT_SHAPE_TWO && j.off_mm <= NEAR_mm && std::abs(j.force) <= FORCE_SHARE;
}

double share(const std::vector<Judged> &judged, bool (*predicate)(const Judged &)) {
  return percent(static_cast<double>(std::count_if(judged.begin(), judged.end(), predicate)),
                 static_cast<double>(judged.size()));
}

template <fit_shape SHAPE> bool is(const Judged &j) {
  return j.said.shape == SHAPE;
}

template <typename Value>
double quantile_where(const std::vector<Judged> &judged, double at, bool (*predicate)(const Judged &),
                      const Value &value) {
  std::vector<double> values;
  for (const Judged &j : judged) {
    if (predicate(j)) {
      values.push_back(value(j));
    }
  }
  return quantile(values, at);
}

bool has_place(const Judged &j) {
  return j.said.shape != FIT_SHAPE_NONE && j.said.shape != FIT_SHAPE_UNDECIDED;
}

bool is_warned(const Judged &j) {
  return has_place(j) && j.off_sd_mm > static_cast<double>(FIT_LOCATION_SD_LIMIT_mm);
}

double chi_square_median(const std::vector<Judged> &judged, int model) {
  return quantile_where(judged, 0.5, has_place,
                        [model](const Judged &j) { return static_cast<double>(j.said.chi_square[model]); });
}

// What no judge of these pairs does better than: of each the smaller of its two limits, in percent.
void put_bounds(const std::vector<Judged> &judged, ordered_json &row) {
  for (std::size_t judge = 0; judge < std::size(JUDGES); judge++) {
    double found = 0.0, pairs = 0.0;
    for (const Judged &j : judged) {
      if (j.bounds) {
        const two::PairBound &bound = (*j.bounds)[judge];
        found += std::min(bound.placed, bound.told);
        pairs += 1.0;
      }
    }
    if (pairs > 0.0) {
      row[JUDGES[judge].possible] = percent(found, pairs);
    }
  }
}

// The same touches twice: in the first answer, and in one when they have been held for a while.
struct Answers {
  std::vector<Judged> first, held;
};

ordered_json row_of(const std::string &name, const Answers &answers) {
  const std::vector<Judged> &judged = answers.held;
  const auto off = [](const Judged &j) { return j.off_mm; };
  const auto angle = [](const Judged &j) { return j.angle_deg; };
  std::vector<Judged> placed;
  std::copy_if(judged.begin(), judged.end(), std::back_inserter(placed), has_place);
  ordered_json row{{"case", name},
                   {"touches", judged.size()},
                   {"one", share(judged, is<FIT_SHAPE_ROUND>)},
                   {"pulled", share(judged, is<FIT_SHAPE_PULLED>)},
                   {"long", share(judged, is<FIT_SHAPE_ELONGATED>)},
                   {"two", share(judged, is<FIT_SHAPE_TWO>)},
                   {"none", share(judged, is<FIT_SHAPE_NONE>)},
                   {"undecided", share(judged, is<FIT_SHAPE_UNDECIDED>)},
                   {"two_and_right", share(judged, is_right)},
                   {"silent", share(judged, [](const Judged &j) { return j.silent; })},
                   {"warned", share(judged, is_warned)},
                   {"off_p50_mm", quantile_where(judged, 0.5, has_place, off)},
                   {"off_p95_mm", quantile_where(judged, 0.95, has_place, off)},
                   {"within_1sd", share(placed, [](const Judged &j) { return j.off_mm <= j.off_sd_mm; })},
                   {"within_2sd", share(placed, [](const Judged &j) { return j.off_mm <= 2.0 * j.off_sd_mm; })},
                   {"angle_p50_deg", quantile_where(judged, 0.5, is<FIT_SHAPE_ELONGATED>, angle)},
                   {"angle_p90_deg", quantile_where(judged, 0.9, is<FIT_SHAPE_ELONGATED>, angle)},
                   {"chi_square_one", chi_square_median(judged, 0)},
                   {"chi_square_long", chi_square_median(judged, 1)},
                   {"chi_square_two", chi_square_median(judged, 2)}};
  row["two_first"] = share(answers.first, is<FIT_SHAPE_TWO>);
  row["two_and_right_first"] = share(answers.first, is_right);
  row["silent_first"] = share(answers.first, [](const Judged &j) { return j.silent; });
  put_bounds(judged, row);
  return row;
}

std::vector<DippedPad> dipped_pads(const Options &options) {
  const Feet feet(LAYER_mm, options.cache);
  std::vector<DippedPad> pads(options.pads);
  const std::uint64_t stream = stream_of("dipped sessions");
  twin::in_parallel(pads.size(), [&](std::size_t i) {
    PadOptions kind; // half of the pads relax, and have sensors off their places
    kind.dip_percent = DIP_PERCENT;
    kind.relaxation_percent = i % 2 == 0 ? 0.0 : 17.5;
    kind.misplaced_mm = i % 2 == 0 ? 0.0 : 0.1;
    const std::uint64_t seed = Random(options.seed, stream, i).next();
    const Calibrated session = calibrated_session(feet, kind, seed);
    pads[i] = {calibrated_pad(session), session.shape, shear::cast_of(session)};
  });
  return pads;
}

// Anywhere on the array, both.
std::vector<Touch> draw_touches(const fit_array &array, const Case &c, Random &random) {
  std::vector<Touch> touches{draw_touch(array, random)};
  if (c.apart_mm <= 0.0) {
    return touches;
  }
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  const double x_max = pitch_mm * static_cast<double>(array.x[SENSORS - 1]);
  const double y_max = pitch_mm * static_cast<double>(array.y[SENSORS - 1]);
  for (;;) {
    Touch other = touches[0] = draw_touch(array, random);
    double direction = random.uniform(-0.25 * M_PI, 0.25 * M_PI);
    direction = c.towards == Towards::any      ? 4.0 * direction
                : c.towards == Towards::across ? direction
                                               : direction + 0.5 * M_PI;
    other.x_mm += c.apart_mm * std::cos(direction);
    other.y_mm += c.apart_mm * std::sin(direction);
    if (std::abs(other.x_mm) <= x_max && std::abs(other.y_mm) <= y_max) {
      other.force_N = random.uniform(WEAKER_MIN_N, WEAKER_MAX_N);
      touches[0].force_N = c.ratio * other.force_N;
      touches.push_back(other);
      return touches;
    }
  }
}

Readings base_of(const fit_array &array, const shear::Object &object, const std::vector<Touch> &touches, double load,
                 const shear::Cast &cast, Random &random) {
  Readings base{};
  const double direction = random.uniform(0.0, 2.0 * M_PI);
  for (const Touch &touch : touches) {
    const double load_N = load * touch.force_N;
    const Readings felt =
        shear::base_Pa(array, object,
                       {touch.force_N, touch.x_mm, touch.y_mm, touch.angle_rad, load_N * std::cos(direction),
                        load_N * std::sin(direction), twin::stuck_force_N(touch.force_N, load_N, FRICTION)},
                       nullptr, cast);
    for (std::size_t k = 0; k < SENSORS; k++) {
      base[k] += felt[k];
    }
  }
  return base;
}

Judged::Bounds bounds_of(const two::Rubber &rubber, const std::vector<Touch> &touches, two::ReadingErrors errors,
                         const Random &random) {
  two::Unknowns<two::PAIR> pair;
  pair << touches[0].x_mm, touches[0].y_mm, touches[0].force_N, touches[1].x_mm, touches[1].y_mm, touches[1].force_N;
  Judged::Bounds bounds;
  for (std::size_t judge = 0; judge < std::size(JUDGES); judge++) {
    errors.model_share = JUDGES[judge].model_share;
    Random same = random;
    bounds[judge] = two::bound_of(rubber, pair, errors, RIGHT, same);
  }
  return bounds;
}

Answers run(const Case &c, const std::vector<DippedPad> &pads, const Options &options) {
  const fit_array array = firmware_array();
  const pad_profile profile = shear::profile_of(LAYER_mm);
  Answers answers{std::vector<Judged>(pads.size() * TOUCHES), std::vector<Judged>(pads.size() * TOUCHES)};
  twin::in_parallel(pads.size(), [&](std::size_t p) {
    Random random(options.seed, stream_of(c.name), p);
    shapes_job shapes{};
    shapes.array = &array;
    if (fit_shapes_init(&shapes.pad, &array, &profile) != FT_OK) {
      throw std::runtime_error("the firmware refuses the pad's profile");
    }
    const Pad pad = c.exact ? perfect_pad() : pads[p].gains;
    const std::vector<fit_own> own =
        c.exact ? std::vector<fit_own>{} : calibrating::own_of(session_array(), pads[p].shape);
    const shear::Cast cast = c.exact ? shear::Cast{pads[p].cast.dip_share, {}} : pads[p].cast;
    shear::KnownPad known{pad, {}, pads[p].shape, cast};
    if (c.exact) {
      known.shape.own.clear();
    }
    shear::Fingertip load_estimate(profile);
    Random of_load(options.seed, stream_of("load, " + c.name), p);
    for (std::size_t t = 0; t < TOUCHES; t++) {
      const shear::Object &object = *c.objects[random.next() % c.objects.size()];
      const std::vector<Touch> touches = draw_touches(array, c, random);
      const Readings base = base_of(array, object, touches, c.load, cast, random);
      const double noise_Pa = draw_noise_Pa(random);
      fit_settings settings = settings_for(pad, noise_Pa);
      settings.cut_noises = 0; // as where a profile acts
      settings.own = own.empty() ? nullptr : own.data();
      settings.dip_share = static_cast<float>(pads[p].shape.dip_share);
      settings.dip_sd_mm = static_cast<float>(pads[p].shape.dip_sd_mm);
      auto &question = shapes.question;
      question = {};
      question.parts = FIT_SHAPES_PARTS;
      question.settings = settings;
      fit_result &fit = question.fit;
      fit_doubt doubt{};
      shear::Said loaded{};
      const bool has_load =
          load_estimate.feel(base, known, noise_Pa, shear::ALL_SENSORS, of_load, loaded) && loaded.valid;
      for (int frame = 0; frame < FIT_SHAPES_FRAMES + HELD_FRAMES; frame++) {
        question.begins = frame == 0;
        auto &readings = question.pressure_Pa_q10;
        for (std::size_t k = 0; k < SENSORS; k++) {
          const double reading_Pa = pad.gain[k] * base[k] + noise_Pa * random.normal();
          readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * reading_Pa));
        }
        fit_gaussian_grid(&array, readings, shear::ALL_SENSORS, &settings, &fit);
        shapes_estimate(&shapes);
        fit_doubt_follow(&doubt, &array, readings, &settings, &fit);
        const bool first = frame == FIT_SHAPES_FRAMES - 1;
        if (first || frame == FIT_SHAPES_FRAMES + HELD_FRAMES - 1) {
          fit_doubt_widen(&doubt, &array, &settings, &fit);
          const shapes_place shown = shapes_locate(&shapes.report, &fit, has_load ? &loaded.load : nullptr);
          fit_shapes_result said = shapes.result;
          said.shape = shapes.report.shape; // which stays, while what is none of these begins again
          (first ? answers.first : answers.held)[p * TOUCHES + t] = judge_touch(said, shown, touches);
        }
      }
      Judged &found = answers.held[p * TOUCHES + t];
      if (found.pair && t < BOUNDED) {
        const Random draws(options.seed, stream_of("bounds, " + c.name), p * TOUCHES + t);
        found.bounds = bounds_of({array, profile, object, cast.dip_share}, touches,
                                 {noise_Pa / std::sqrt(double(FIT_SHAPES_FRAMES)), pad.gain_sd, 0.0}, draws);
      }
    }
  });
  std::fprintf(stderr, "two_touches: %s\n", c.name.c_str());
  return answers;
}

ordered_json judge(const Options &options) {
  if (options.pads == 0) {
    throw std::runtime_error("--pads needs at least one pad");
  }
  shear::Objects objects(options.cache);
  const auto named = [&](std::initializer_list<const char *> names) {
    std::vector<const shear::Object *> found;
    for (const char *name : names) {
      found.push_back(&objects.on(LAYER_mm, name));
    }
    return found;
  };
  const auto round = named({"sphere6", "sphere15", "cylinder6", "cube6", "ping_pong"});
  const auto everyday = named({"rubber_duck", "lime"});
  const auto ball = named({"sphere6"});
  std::vector<Case> cases{{"round", round},
                          {"everyday", everyday},
                          {"round, Q/F 0.3", round, 0.0, 1.0, LOAD},
                          {"everyday, Q/F 0.3", everyday, 0.0, 1.0, LOAD}};
  for (const char *name : {"cylinder6x12", "edge10", "edge14", "edge20", "cube15"}) {
    cases.push_back({name, named({name})});
  }
  for (const char *name : {"edge24", "edge30", "edge36"}) { // longer than the array is wide
    cases.push_back({name, named({name}), 0.0, 1.0, 0.0, false, Towards::any, true});
  }
  for (const double ratio : {1.0, 3.0}) {
    for (const int apart_mm : {6, 8, 10, 12, 15, 20}) {
      const std::string name = "two, " + std::to_string(apart_mm) + " mm, ";
      cases.push_back({name + (ratio > 1.0 ? "3:1" : "1:1"), ball, double(apart_mm), ratio});
    }
  }
  const auto cube = named({"cube6"}); // of all, it reaches furthest for its spread
  for (const double ratio : {1.0, 3.0}) {
    cases.push_back({std::string("two, 8 mm, ") + (ratio > 1.0 ? "3:1" : "1:1") + ", cubes", cube, 8.0, ratio, 0.0,
                     false, Towards::any, true});
  }
  for (const int apart_mm : {8, 10, 12}) {
    const std::string name = "two, " + std::to_string(apart_mm) + " mm, 1:1, ";
    cases.push_back({name + "exact gains", ball, double(apart_mm), 1.0, 0.0, true});
    cases.push_back({name + "along the pad", ball, double(apart_mm), 1.0, 0.0, false, Towards::along});
    cases.push_back({name + "across the pad", ball, double(apart_mm), 1.0, 0.0, false, Towards::across});
  }
  const std::vector<DippedPad> pads = dipped_pads(options);
  std::fprintf(stderr, "two_touches: %zu calibrations\n", pads.size());
  ordered_json out;
  out["seed"] = options.seed;
  out["pads"] = options.pads;
  double called_two = 0.0, silent = 0.0, touches = 0.0;
  for (const Case &c : cases) {
    const Answers answers = run(c, pads, options);
    const ordered_json row = row_of(c.name, answers);
    out["touches"].push_back(row);
    const auto number = [&](const char *of_row) { return row[of_row].get<double>(); };
    if (c.apart_mm <= 0.0 && !c.shown_only && c.name != "cube15") { // neither round nor long
      called_two = std::max({called_two, number("two"), number("two_first")});
    }
    if (!c.exact && c.towards == Towards::any && !c.shown_only) {
      const double all = static_cast<double>(answers.held.size());
      silent += std::max(number("silent"), number("silent_first")) * all;
      touches += all;
    }
    const auto key = [&](const char *name, const char *of_case, const char *of_row) {
      if (c.name == of_case) {
        out[name] = row[of_row];
      }
    };
    const auto right = [&](const char *name, const char *of_case) {
      if (c.name == of_case) {
        out[name] = std::min(number("two_and_right"), number("two_and_right_first"));
      }
    };
    right("two_right_percent_8mm", "two, 8 mm, 1:1");
    right("two_right_percent_12mm", "two, 12 mm, 1:1");
    right("two_right_percent_10mm_3to1", "two, 10 mm, 3:1");
    for (const JudgeOf &judge : JUDGES) {
      const auto of = [&](const char *apart, const char *of_case) {
        key((std::string("two_") + judge.possible + "_percent_" + apart).c_str(), of_case, judge.possible);
      };
      of("8mm", "two, 8 mm, 1:1");
      of("12mm", "two, 12 mm, 1:1");
      of("10mm_3to1", "two, 10 mm, 3:1");
    }
    key("edge_angle_p50_deg_20mm", "edge20", "angle_p50_deg");
    key("edge_angle_p50_deg_10mm", "edge10", "angle_p50_deg");
  }
  out["one_called_two_percent"] = called_two;
  out["silent_over_1mm_percent"] = silent / touches;
  return out;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  return reference::print_found(
      "two_touches", argc, argv,
      {{"--cache", &options.cache}, {"--seed", nullptr, &options.seed}, {"--pads", nullptr, &options.pads}}, HELP,
      [&] { return judge(options); });
}
