// The twin's rubber, and its random numbers, in batches.
#include "libfingertip/in_parallel.hpp"
#include "libfingertip/random.hpp"
#include "library/pad/profile.hpp"
#include "report/measure/tables.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/trajectory.hpp"
#include "tool/arrays/entry.hpp"

extern "C" {
#include "common/pad_profile.h"
}

#include <algorithm>

using namespace fingertip;
using namespace fingertip::measure;
using fingertip::twin::in_parallel;

// States of random numbers: what one draws does not change the others.

// seeds: [1 or state]
static void random_begin(Batch<const std::int64_t, 1> seeds, std::int64_t stream, Batch<const std::int64_t, 1> index,
                         Batch<Random, 1> states) {
  same_length(index, states);
  length_or_one(states, seeds);
  for (std::size_t i = 0; i < states.size(); i++) {
    states[i] =
        Random(static_cast<std::uint64_t>(*seeds.row_or_all(i)), static_cast<std::uint64_t>(stream), static_cast<std::uint64_t>(index[i]));
  }
}
MEASURE_ENTRY(random_begin)

template <class Draw> static void draw_all(const Batch<Random, 1> &states, const Batch<double, 2> &values, const Draw &draw) {
  same_length(states, values);
  for (std::size_t i = 0; i < states.size(); i++) {
    std::generate_n(values.row(i), values.size(1), [&] { return draw(states[i]); });
  }
}

static void random_uniform(Batch<Random, 1> states, double low, double high, Batch<double, 2> values) {
  draw_all(states, values, [&](Random &random) { return random.uniform(low, high); });
}
MEASURE_ENTRY(random_uniform)

static void random_log_uniform(Batch<Random, 1> states, double low, double high, Batch<double, 2> values) {
  draw_all(states, values, [&](Random &random) { return random.log_uniform(low, high); });
}
MEASURE_ENTRY(random_log_uniform)

static void random_normal(Batch<Random, 1> states, Batch<double, 2> values) {
  draw_all(states, values, [](Random &random) { return random.normal(); });
}
MEASURE_ENTRY(random_normal)

// All 64 bits: seeds of other numbers.
static void random_bits(Batch<Random, 1> states, Batch<std::int64_t, 2> values) {
  same_length(states, values);
  for (std::size_t i = 0; i < states.size(); i++) {
    std::generate_n(values.row(i), values.size(1), [&] { return static_cast<std::int64_t>(states[i].next()); });
  }
}
MEASURE_ENTRY(random_bits)

// Whole numbers below `end`.
static void random_below(Batch<Random, 1> states, std::int64_t end, Batch<std::int64_t, 2> values) {
  same_length(states, values);
  require(end > 0, "below nothing");
  for (std::size_t i = 0; i < states.size(); i++) {
    std::generate_n(values.row(i), values.size(1),
                    [&] { return static_cast<std::int64_t>(states[i].next() % static_cast<std::uint64_t>(end)); });
  }
}
MEASURE_ENTRY(random_below)

// A contact shape by its measures. The twin's own have names: shape_named.
struct contact_shape {
  std::int32_t kind; // of twin::Indenter::Shape
  double size_x_mm, size_y_mm, size_z_mm, edge_mm, youngs_modulus_Pa;
};
MEASURE_RECORD(contact_shape, FIELD(kind), FIELD(size_x_mm), FIELD(size_y_mm), FIELD(size_z_mm), FIELD(edge_mm), FIELD(youngs_modulus_Pa))
using twin_touch = twin::Touch;
MEASURE_RECORD(twin_touch, FIELD(force_N), FIELD(x_mm), FIELD(y_mm), FIELD(angle_rad), FIELD(pull_x_N), FIELD(pull_y_N), FIELD(stuck_N))
using twin_seat = twin::Pad::Seat;
MEASURE_RECORD(twin_seat, FIELD(dx_mm), FIELD(dy_mm), FIELD(width))

static void shape_named(std::string name, Batch<contact_shape, 1> shape) {
  const twin::Indenter &it = twin::indenter(name);
  shape[0] = {static_cast<std::int32_t>(it.shape), it.size_x_mm, it.size_y_mm, it.size_z_mm, it.edge_mm, it.youngs_modulus_Pa};
}
MEASURE_ENTRY(shape_named)

// Pressure on the base under each sensor [touch][sensor], Pa. name and shape are those of one contact shape, cache the
// folder of the contact tables. dip_share: [1 or touch]; seats [1 or touch][sensor]: how the sensors sit.
static void base_pressure(std::string name, Batch<const contact_shape, 1> shape, double layer_mm, std::string cache,
                          Batch<const double, 1> x_mm, Batch<const double, 1> y_mm, Batch<const twin_touch, 1> touches,
                          Batch<const double, 1> dip_share, Batch<const twin_seat, 2> seats, Batch<double, 2> base_Pa) {
  same_length(touches, base_Pa);
  same_length(x_mm, y_mm);
  length_or_one(touches, dip_share, seats);
  require(base_Pa.size(1) == x_mm.size() && seats.size(1) == x_mm.size(), "another number of sensors");
  const contact_shape &it = shape[0];
  const auto kind = static_cast<twin::Indenter::Shape>(it.kind);
  const twin::Indenter indenter{name, "", kind, it.size_x_mm, it.size_y_mm, it.size_z_mm, it.edge_mm, it.youngs_modulus_Pa};
  const twin::ContactTable &pressure = contact_table(indenter, layer_mm, cache);
  const auto is_pulled = [](const twin::Touch &touch) { return touch.pull_x_N != 0.0 || touch.pull_y_N != 0.0; };
  const twin::TractionTable *const traction =
      std::any_of(touches.data, touches.data + touches.size(), is_pulled) ? &traction_table(indenter, layer_mm, cache) : nullptr;
  in_parallel(touches.size(), [&](std::size_t i) {
    const twin::Touch &touch = touches[i];
    const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
    const twin::TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                         c * touch.pull_y_N - s * touch.pull_x_N};
    for (std::size_t k = 0; k < x_mm.size(); k++) {
      const twin::Pad::Seat &seat = seats.row_or_all(i)[k];
      const double dx = (x_mm[k] + seat.dx_mm - touch.x_mm) / seat.width;
      const double dy = (y_mm[k] + seat.dy_mm - touch.y_mm) / seat.width;
      const double along = c * dx + s * dy, across = c * dy - s * dx;
      double &base = base_Pa.row(i)[k];
      base = pressure.base_pressure_Pa(touch.force_N, along, across, *dip_share.row_or_all(i));
      if (is_pulled(touch)) {
        base += traction->base_pressure_Pa(load, along, across);
      }
    }
  });
}
MEASURE_ENTRY(base_pressure)
