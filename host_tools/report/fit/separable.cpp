#include "common/contact_flags.h"
#include "report/fit/compared.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::fitting {
namespace {

constexpr int COLUMNS = 3, ROWS = 5;
// Nodes are numbered from the one in the middle, the later of two.
constexpr int FIRST_COLUMN = -(COLUMNS / 2), FIRST_ROW = -(ROWS / 2);
constexpr double MARGIN = 1.5, OVERSHOOT = 0.25; // pitches around the array
constexpr double MOVE_LIMIT = 0.65, WIDEN_LIMIT = 0.5;
// 1 / (2 sigma^2) of the widest and the narrowest sigma, pitches; with six nodes the squares of the exponentials would overflow sooner.
constexpr double HEIGHT_MIN = 0.5 / (5.0 * 5.0);
constexpr double HEIGHT_MAX = std::max(COLUMNS, ROWS) < 6 ? 0.5 / (0.158 * 0.158) : 17.0;
// Root of the sum of the model's squares, below which it is taken to be that.
constexpr double LEAST_MODEL = 0.05;

// The guess: marginals below this share of their largest do not enter, and a weak prior on sigma.
constexpr double GUESS_SHARE = 0.08;
constexpr double GUESS_WEIGHT = 0.003;
constexpr double GUESS_HEIGHT = 2.47; // sigma 0.45 pitch
constexpr double GUESS_HEIGHT_MIN = 0.07, GUESS_HEIGHT_MAX = 3.8;

// A step this short, in pitches and in shares of sigma, is the last: what is left is shorter still.
constexpr double SETTLED = 3e-8;

using Readings = double[COLUMNS][ROWS]; // in units of the largest

// Orthogonal polynomials on the nodes first, first + 1, .. under the weights g^2, times g.
template <int N> struct Axis {
  double g[N], u1[N], u2[N];
  double n0, n1, n2;  // sums of the squares of g, u1, u2
  double mean, kappa; // u1 / g = k - mean, u2 / g = (k - mean) (k + mean - kappa) - variance
  double variance;
  double inverse0, inverse1; // of n0 and n1

  void orthogonalise(int first) {
    double m0 = 0.0, m1 = 0.0;
    for (int i = 0; i < N; i++) {
      const double weight = g[i] * g[i];
      m0 += weight;
      m1 += (first + i) * weight;
    }
    inverse0 = 1.0 / m0;
    mean = m1 * inverse0;
    double s1 = 0.0, sk = 0.0;
    for (int i = 0; i < N; i++) {
      u1[i] = g[i] * (first + i - mean);
      s1 += u1[i] * u1[i];
      sk += (first + i) * (u1[i] * u1[i]);
    }
    inverse1 = s1 > 0.0 ? 1.0 / s1 : 0.0; // 0 with one node alone
    const double alpha = s1 > 0.0 ? sk * inverse1 : mean;
    variance = s1 * inverse0;
    double s2 = 0.0;
    for (int i = 0; i < N; i++) {
      u2[i] = u1[i] * (first + i - alpha) - g[i] * variance;
      s2 += u2[i] * u2[i];
    }
    n0 = m0;
    n1 = s1;
    n2 = s2;
    kappa = alpha + mean;
  }

  // g = exp(-height ((k - at)^2 - at^2)), decay = exp(-height): 1 at the node k = 0, and each further one by a product.
  void evaluate(int first, double at, double height, double decay) {
    const double slope = std::exp(2.0 * height * at);
    const double twice = decay * decay;
    g[-first] = 1.0;
    double ratio = decay * slope;
    for (int i = 1 - first; i < N; i++) {
      g[i] = g[i - 1] * ratio;
      ratio *= twice;
    }
    ratio = decay * (1.0 / slope);
    for (int i = -first - 1; i >= 0; i--) {
      g[i] = g[i + 1] * ratio;
      ratio *= twice;
    }
  }
};

struct State {
  double x, y, height;
  double p0; // the best for the shape one step ago, and what the step does to it
};

// Least squares of a parabola to the logarithm of a marginal, as far as it goes on one axis.
template <int N> struct Parabola {
  Axis<N> axis;
  double linear;    // coefficient of u1 / g
  double curvature; // product of u2 with the logarithm

  Parabola(const double (&marginal)[N], int first) {
    const double scale = 1.0 / *std::max_element(marginal, marginal + N);
    double weighted[N];
    for (int i = 0; i < N; i++) {
      const double ratio = marginal[i] * scale;
      axis.g[i] = ratio >= GUESS_SHARE ? ratio : 0.0;
      weighted[i] = axis.g[i] * std::log(std::max(ratio, GUESS_SHARE));
    }
    axis.orthogonalise(first);
    double sum = 0.0;
    curvature = 0.0;
    for (int i = 0; i < N; i++) {
      sum += axis.u1[i] * weighted[i];
      curvature += axis.u2[i] * weighted[i];
    }
    linear = sum / (axis.n1 + GUESS_WEIGHT);
  }
};

// Limited to the nodes and `margin` around them.
double within(double at, int first, int nodes, double margin) { return std::clamp(at, first - margin, first + nodes - 1 + margin); }

State guess(const Readings &p, int peak_column, int peak_row) {
  double along_x[COLUMNS] = {}, along_y[ROWS] = {};
  for (int i = 0; i < COLUMNS; i++) {
    for (int j = 0; j < ROWS; j++) {
      along_x[i] += p[i][j] * p[peak_column][j];
      along_y[j] += p[i][j] * p[i][peak_row];
    }
  }
  const Parabola<COLUMNS> x(along_x, FIRST_COLUMN);
  const Parabola<ROWS> y(along_y, FIRST_ROW);
  const double height = std::clamp((GUESS_WEIGHT * GUESS_HEIGHT - x.curvature - y.curvature) / (x.axis.n2 + y.axis.n2 + GUESS_WEIGHT),
                                   GUESS_HEIGHT_MIN, GUESS_HEIGHT_MAX);
  const double half = 0.5 / height;
  return {within(x.axis.kappa * 0.5 + x.linear * half, FIRST_COLUMN, COLUMNS, 1.0),
          within(y.axis.kappa * 0.5 + y.linear * half, FIRST_ROW, ROWS, 1.0), height, 1.0};
}

// Returns whether it was the last.
bool step(const Readings &p, bool last, State *state) {
  Axis<COLUMNS> x;
  Axis<ROWS> y;
  const double decay = std::exp(-state->height);
  x.evaluate(FIRST_COLUMN, state->x, state->height, decay);
  y.evaluate(FIRST_ROW, state->y, state->height, decay);
  x.orthogonalise(FIRST_COLUMN);
  y.orthogonalise(FIRST_ROW);
  // The residuals need not be formed: the basis is orthogonal to the model.
  double b0 = 0.0, b1 = 0.0, b2 = 0.0, b3 = 0.0;
  for (int i = 0; i < COLUMNS; i++) {
    double d0 = 0.0, d1 = 0.0, d2 = 0.0;
    for (int j = 0; j < ROWS; j++) {
      d0 += p[i][j] * y.g[j];
      d1 += p[i][j] * y.u1[j];
      d2 += p[i][j] * y.u2[j];
    }
    b0 += x.g[i] * d0;
    b1 += x.u1[i] * d0;
    b2 += x.g[i] * d1;
    b3 += x.u2[i] * d0 + x.g[i] * d2;
  }
  const double n0 = x.n0 * y.n0;
  if (!(b0 > 0.0 && b0 * b0 > LEAST_MODEL * LEAST_MODEL * n0)) {
    b0 = LEAST_MODEL * std::sqrt(n0);
  }
  const double peak = b0 * x.inverse0 * y.inverse0; // at the node (0, 0)
  const double gain = 0.5 / (state->height * peak);
  const double c1 = gain * b1 * (x.inverse1 * y.inverse0);
  const double c2 = gain * b2 * (x.inverse0 * y.inverse1);
  const double ratio = gain * b3 / (x.n2 * y.n0 + x.n0 * y.n2); // of the change of sigma to sigma
  const double dx = c1 - ratio * (x.kappa - 2.0 * state->x);
  const double dy = c2 - ratio * (y.kappa - 2.0 * state->y);
  const double excess = std::max(std::max(std::abs(dx), std::abs(dy)) * (1.0 / MOVE_LIMIT), std::abs(ratio) * (1.0 / WIDEN_LIMIT));
  const double share = excess > 1.0 ? 1.0 / excess : 1.0;
  last = last || excess < SETTLED;
  if (last) {
    const double at_x = state->x - x.mean, at_y = state->y - y.mean;
    const double change = c1 * at_x + c2 * at_y +
                          ratio * (at_x * (state->x + x.mean - x.kappa) - x.variance + at_y * (state->y + y.mean - y.kappa) - y.variance);
    const double rise = state->height * (state->x * state->x + state->y * state->y);
    state->p0 = peak * std::exp(rise) * (1.0 + 2.0 * state->height * share * change);
  }
  state->x = within(state->x + share * dx, FIRST_COLUMN, COLUMNS, MARGIN + OVERSHOOT);
  state->y = within(state->y + share * dy, FIRST_ROW, ROWS, MARGIN + OVERSHOOT);
  const double growth = 1.0 + share * ratio;
  state->height = std::clamp(state->height / (growth * growth), HEIGHT_MIN, HEIGHT_MAX);
  return last;
}

} // namespace

KernelResult separable(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map /*usable*/, const KernelSettings &settings) {
  const fit_grid_shape &grid = array.grid;
  if (grid.columns != COLUMNS || grid.rows != ROWS) {
    return {};
  }
  std::int32_t largest = 0;
  int peak = 0;
  for (int n = 0; n < COLUMNS * ROWS; n++) {
    const std::int32_t reading = pressure_Pa_q10[grid.sensor[n]];
    peak = reading > largest ? n : peak;
    largest = std::max(largest, reading);
  }
  if (largest <= 0) {
    return {};
  }
  Readings p;
  const double scale = 1.0 / largest;
  for (int n = 0; n < COLUMNS * ROWS; n++) {
    p[n / ROWS][n % ROWS] = std::max(pressure_Pa_q10[grid.sensor[n]] * scale, -1.0);
  }
  State state = guess(p, peak / ROWS, peak % ROWS);
  int left = settings.iterations;
  while (left > 0 && !step(p, left == 1, &state)) {
    left--;
  }
  state.x = within(state.x, FIRST_COLUMN, COLUMNS, MARGIN);
  state.y = within(state.y, FIRST_ROW, ROWS, MARGIN);

  const auto pitch_mm = static_cast<double>(array.pitch_mm);
  const std::uint8_t origin = grid.sensor[-FIRST_COLUMN * ROWS - FIRST_ROW];
  return {pitch_mm * (state.x + static_cast<double>(array.x[origin])), pitch_mm * (state.y + static_cast<double>(array.y[origin])),
          state.p0 * largest / 1024.0, pitch_mm * std::sqrt(0.5 / state.height), CONTACT_FLAG_FIT_VALID};
}

} // namespace fingertip::fitting
