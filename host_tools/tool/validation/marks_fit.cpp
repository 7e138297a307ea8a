#include "tool/validation/marks_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace fingertip::validating {
namespace {

using calibrating::HUBER;
using calibrating::NARROW;

enum Common { LOG_PEAK, LOG_WIDTH, MIXING, DIP, DIP_WIDTH, SLOPE_X, SLOPE_Y, COMMON };
enum Print { SHIFT_X, SHIFT_Y, TURN, PRINT };
constexpr int OF_SENSOR = 5; /* gain, x, y, log of its own width, memory */
constexpr int OF_PRESS = 3;  /* x, y, log force */
constexpr int TOUCHED = COMMON + OF_SENSOR + OF_PRESS;

/* Priors: as calibration/solver.hpp assumes of real pads and of a hand. */
constexpr double MIXING_0 = 0.2, MIXING_SD = 0.1, DIP_0 = 0.03, DIP_SD = 0.03;
/* The dip's width, in pitches: between that of the twin's pads and what calibrations find. */
constexpr double DIP_PITCHES_0 = 1.9, DIP_LOG_SD = 0.3;
constexpr double MEMORY_0 = 0.02, MEMORY_SD = 0.02;
constexpr double SLOPE_SD = 0.3, GAIN_SD = 0.5, OWN_WIDTH_SD = 0.035, FORCE_SD = 0.025;
constexpr double FREE_pitches = 3.0, SEATED_mm = 0.1; /* of a sensor from where it should be */
constexpr double FIXED = 1e-6;
constexpr double HAND_BEGIN_mm = 0.5, HAND_MIN_mm = 0.02;
/* Of a reading: what the picture itself is off by, of the peak and of the reading. */
constexpr double MODEL_SHARE = 0.003, READING_SHARE = 0.005;
constexpr int STEPS = 40, HAND_TURNS = 4;
constexpr double CAUCHY_mm = 1.0; /* a sensor found further off hardly says where the print lies */
constexpr int ALIGN_TURNS = 30;

struct Felt {
  double ratio;    /* the reading over the expected one */
  double variance; /* of the expected one, by what is not known of the press, as a share */
};

/* The scatter among the presses of one mark that what is not known of the presses does not explain.
 * Where a neighbour is dead, some presses are hardly known: each counts by how well it would show a
 * scatter of LOOSE_SCATTER. */
double scatter_of(const std::map<std::size_t, std::vector<Felt>> &of_mark) {
  double unexplained = 0.0, weights = 0.0;
  for (const auto &[mark, presses] : of_mark) {
    const double count = double(presses.size());
    double mean = 0.0;
    for (const Felt &press : presses) {
      mean += press.ratio / count;
    }
    for (const Felt &press : presses) {
      const double weight = std::pow(press.variance + LOOSE_SCATTER * LOOSE_SCATTER, -2.0);
      unexplained += weight * (std::pow(press.ratio - mean, 2) - press.variance * (1.0 - 1.0 / count));
      weights += weight * (1.0 - 1.0 / count);
    }
  }
  return weights > 0.0 ? std::sqrt(std::max(unexplained / weights, 0.0)) : 0.0;
}

/* First with sensors anywhere, in the print's axes; then, seated, with sensors at their places in
 * the layout's axes, but for what hands and solder do, and the print shifted and turned. */
class Fit {
public:
  Fit(const Measured &measured, std::vector<calibrating::Placement> placements, std::uint32_t without)
      : measured_(measured), placements_(std::move(placements)), without_(without),
        sensors_(static_cast<int>(measured.array.sensors())), presses_(static_cast<int>(measured.presses.size())),
        print_(COMMON + OF_SENSOR * sensors_ + OF_PRESS * presses_), unknowns_(print_ + PRINT) {
    for (const Press &press : measured.presses) {
      reach_x_ = std::max(reach_x_, std::abs(press.at.x_mm));
      reach_y_ = std::max(reach_y_, std::abs(press.at.y_mm));
    }
    begin();
  }

  void solve() {
    for (int turn = 0; turn < HAND_TURNS; turn++) {
      double cost = build(value_, nullptr, nullptr), damping = 1e-3;
      for (int step = 0; step < STEPS; step++) {
        Eigen::MatrixXd square(unknowns_, unknowns_);
        Eigen::VectorXd slope(unknowns_);
        build(value_, &square, &slope);
        bool is_better = false;
        double gained = 0.0;
        while (!is_better && damping < 1e8) {
          Eigen::MatrixXd damped = square;
          damped.diagonal() *= 1.0 + damping;
          const Eigen::VectorXd next = value_ - damped.ldlt().solve(slope);
          const double next_cost = build(next, nullptr, nullptr);
          is_better = next_cost < cost;
          if (is_better) {
            gained = cost - next_cost;
            value_ = next;
            cost = next_cost;
          }
          damping *= is_better ? 0.3 : 10.0;
        }
        if (!is_better || gained < 1e-6 * (1.0 + cost)) {
          break;
        }
      }
      Eigen::MatrixXd square(unknowns_, unknowns_);
      Eigen::VectorXd slope(unknowns_);
      build(value_, &square, &slope);
      covariance_ = square.ldlt().solve(Eigen::MatrixXd::Identity(unknowns_, unknowns_));
      learn_hand();
    }
  }

  void judge_by_others();
  /* From where the first fit has found them. */
  void seat(const MarksFit &found);
  MarksFit result() const;

private:
  int of_sensor(int k) const { return COMMON + OF_SENSOR * k; }
  int of_press(int i) const { return COMMON + OF_SENSOR * sensors_ + OF_PRESS * i; }
  const calibrating::Placement &placement(int i) const { return placements_[static_cast<std::size_t>(i)]; }
  const Mark &mark(int i) const { return measured_.presses[static_cast<std::size_t>(i)].at; }
  bool is_usable(int i, int k) const { return placement(i).usable >> k & 1u; }
  double reading(int i, int k) const { return placement(i).reading_Pa[static_cast<std::size_t>(k)]; }

  void begin() {
    value_ = Eigen::VectorXd::Zero(unknowns_);
    double strongest = 1.0;
    for (int i = 0; i < presses_; i++) {
      for (int k = 0; k < sensors_; k++) {
        strongest = std::max(strongest, is_usable(i, k) ? reading(i, k) : 0.0);
      }
    }
    peak_Pa_ = strongest;
    value_[LOG_PEAK] = std::log(strongest);
    value_[LOG_WIDTH] = std::log(0.6 * measured_.array.pitch_mm);
    value_[MIXING] = MIXING_0;
    value_[DIP] = DIP_0;
    value_[DIP_WIDTH] = std::log(DIP_PITCHES_0 * measured_.array.pitch_mm);
    begin_places_.resize(static_cast<std::size_t>(sensors_));
    for (int k = 0; k < sensors_; k++) {
      /* The middle of where it feels most; a sensor that feels nothing is left where it should be.
       */
      double weight = 0.0, x = 0.0, y = 0.0, most = 0.0;
      for (int i = 0; i < presses_; i++) {
        const double felt = is_usable(i, k) ? std::max(reading(i, k), 0.0) : 0.0;
        weight += felt * felt;
        x += felt * felt * mark(i).x_mm;
        y += felt * felt * mark(i).y_mm;
        most = std::max(most, felt);
      }
      const auto at = static_cast<std::size_t>(k);
      const bool feels = most > FELT_SHARE * FELT_SHARE * strongest;
      begin_places_[at] =
          feels ? Mark{x / weight, y / weight} : Mark{measured_.array.x_mm[at], measured_.array.y_mm[at]};
      value_[of_sensor(k)] = most / strongest;
      value_[of_sensor(k) + 4] = MEMORY_0;
      value_[of_sensor(k) + 1] = begin_places_[at].x_mm;
      value_[of_sensor(k) + 2] = begin_places_[at].y_mm;
    }
    for (int i = 0; i < presses_; i++) {
      value_[of_press(i)] = mark(i).x_mm;
      value_[of_press(i) + 1] = mark(i).y_mm;
    }
  }

  /* What sensor k reads in press i, and its derivatives by what it depends on. */
  double model(const Eigen::VectorXd &v, int i, int k, double *by) const {
    const double X = reach_x_ > 0.0 ? mark(i).x_mm / reach_x_ : 0.0;
    const double Y = reach_y_ > 0.0 ? mark(i).y_mm / reach_y_ : 0.0;
    const int s = of_sensor(k), p = of_press(i);
    const double width = std::exp(v[LOG_WIDTH] + v[s + 3] + v[SLOPE_X] * X + v[SLOPE_Y] * Y);
    const double dx = v[p] - v[s + 1], dy = v[p + 1] - v[s + 2], square = dx * dx + dy * dy;
    const double own = 1.0 / (width * width), narrow = own / (NARROW * NARROW);
    const double outer = std::exp(-2.0 * v[DIP_WIDTH]);
    const double a = std::exp(-0.5 * square * own), b = std::exp(-0.5 * square * narrow);
    const double c = std::exp(-0.5 * square * outer);
    const double profile = (1.0 - v[MIXING]) * a + v[MIXING] * b - v[DIP] * c;
    const double earlier = placement(i).earlier_Pa[static_cast<std::size_t>(k)];
    const double full = std::exp(v[LOG_PEAK] + v[p + 2]), felt = v[s] * full * profile;
    const calibrating::Hidden hidden = calibrating::hidden_by(v[s + 4] * earlier, felt);
    const double height = (1.0 - hidden.by_felt) * full, scale = v[s] * height;
    if (by) {
      /* profile by the square of the distance, and by the log of the width */
      const double by_square = -0.5 * ((1.0 - v[MIXING]) * a * own + v[MIXING] * b * narrow - v[DIP] * c * outer);
      const double by_width = square * ((1.0 - v[MIXING]) * a * own + v[MIXING] * b * narrow);
      by[LOG_PEAK] = scale * profile;
      by[LOG_WIDTH] = scale * by_width;
      by[MIXING] = scale * (b - a);
      by[DIP] = -scale * c;
      by[DIP_WIDTH] = -scale * v[DIP] * c * square * outer;
      by[SLOPE_X] = scale * by_width * X;
      by[SLOPE_Y] = scale * by_width * Y;
      by[COMMON] = height * profile;
      by[COMMON + 1] = -2.0 * scale * by_square * dx;
      by[COMMON + 2] = -2.0 * scale * by_square * dy;
      by[COMMON + 3] = scale * by_width;
      by[COMMON + 4] = -hidden.by_remembered * earlier;
      by[COMMON + OF_SENSOR] = 2.0 * scale * by_square * dx;
      by[COMMON + OF_SENSOR + 1] = 2.0 * scale * by_square * dy;
      by[COMMON + OF_SENSOR + 2] = scale * profile;
    }
    return felt - hidden.Pa;
  }

  double sd_of(int i, int k) const {
    return std::hypot(std::hypot(MODEL_SHARE * peak_Pa_, READING_SHARE * reading(i, k)), placement(i).noise_Pa);
  }

  /* The cost, half of the squares, with its normal equations. */
  double build(const Eigen::VectorXd &v, Eigen::MatrixXd *square, Eigen::VectorXd *slope) const {
    double cost = 0.0;
    if (square) {
      square->setZero();
      slope->setZero();
    }
    const auto hold = [&](int at, double mean, double sd) {
      const double off = (v[at] - mean) / sd;
      cost += 0.5 * off * off;
      if (square) {
        (*square)(at, at) += 1.0 / (sd * sd);
        (*slope)[at] += off / sd;
      }
    };
    hold(LOG_PEAK, std::log(peak_Pa_), 1.0);
    hold(LOG_WIDTH, std::log(0.6 * measured_.array.pitch_mm), 1.0);
    hold(MIXING, MIXING_0, MIXING_SD);
    hold(DIP, DIP_0, DIP_SD);
    hold(DIP_WIDTH, std::log(DIP_PITCHES_0 * measured_.array.pitch_mm), DIP_LOG_SD);
    hold(SLOPE_X, 0.0, SLOPE_SD);
    hold(SLOPE_Y, 0.0, SLOPE_SD);
    for (int k = 0; k < sensors_; k++) {
      const Mark &place = begin_places_[static_cast<std::size_t>(k)];
      hold(of_sensor(k), 1.0, GAIN_SD);
      const double sd_mm = is_seated_ ? SEATED_mm : FREE_pitches * measured_.array.pitch_mm;
      hold(of_sensor(k) + 1, place.x_mm, sd_mm);
      hold(of_sensor(k) + 2, place.y_mm, sd_mm);
      hold(of_sensor(k) + 3, 0.0, OWN_WIDTH_SD);
      hold(of_sensor(k) + 4, MEMORY_0, MEMORY_SD);
    }
    for (int j = 0; j < PRINT && !is_seated_; j++) {
      hold(print_ + j, 0.0, FIXED);
    }
    for (int i = 0; i < presses_; i++) {
      aim(v, i, &cost, square, slope);
      hold(of_press(i) + 2, 0.0, FORCE_SD);
      for (int k = 0; k < sensors_; k++) {
        if (!is_usable(i, k) || (without_ >> k & 1u)) {
          continue;
        }
        double by[TOUCHED];
        const double sd = sd_of(i, k);
        const double off = (model(v, i, k, square ? by : nullptr) - reading(i, k)) / sd;
        const double size = std::abs(off);
        cost += size <= HUBER ? 0.5 * off * off : HUBER * (size - 0.5 * HUBER);
        if (!square) {
          continue;
        }
        const double weight = (size <= HUBER ? 1.0 : HUBER / size) / (sd * sd);
        int at[TOUCHED];
        for (int j = 0; j < TOUCHED; j++) {
          at[j] = j < COMMON               ? j
                  : j < COMMON + OF_SENSOR ? of_sensor(k) + j - COMMON
                                           : of_press(i) + j - COMMON - OF_SENSOR;
        }
        for (int a = 0; a < TOUCHED; a++) {
          (*slope)[at[a]] += weight * sd * off * by[a];
          for (int b = 0; b < TOUCHED; b++) {
            (*square)(at[a], at[b]) += weight * by[a] * by[b];
          }
        }
      }
    }
    return cost;
  }

  /* Where the print has the mark, in the axes of the fit. */
  Mark printed(const Eigen::VectorXd &v, int i) const {
    const double c = std::cos(v[print_ + TURN]), s = std::sin(v[print_ + TURN]);
    return {c * mark(i).x_mm - s * mark(i).y_mm + v[print_ + SHIFT_X],
            s * mark(i).x_mm + c * mark(i).y_mm + v[print_ + SHIFT_Y]};
  }

  /* The hand aims at the mark. */
  void aim(const Eigen::VectorXd &v, int i, double *cost, Eigen::MatrixXd *square, Eigen::VectorXd *slope) const {
    const Mark at = printed(v, i);
    const double x = at.x_mm - v[print_ + SHIFT_X], y = at.y_mm - v[print_ + SHIFT_Y];
    const int p = of_press(i);
    const double off[2] = {(v[p] - at.x_mm) / hand_mm_, (v[p + 1] - at.y_mm) / hand_mm_};
    const double by_turn[2] = {y / hand_mm_, -x / hand_mm_};
    for (int axis = 0; axis < 2; axis++) {
      *cost += 0.5 * off[axis] * off[axis];
      if (!square) {
        continue;
      }
      const int where[3] = {p + axis, print_ + axis, print_ + TURN};
      const double by[3] = {1.0 / hand_mm_, -1.0 / hand_mm_, by_turn[axis]};
      for (int a = 0; a < 3; a++) {
        (*slope)[where[a]] += off[axis] * by[a];
        for (int b = 0; b < 3; b++) {
          (*square)(where[a], where[b]) += by[a] * by[b];
        }
      }
    }
  }

  /* By expectation and maximisation. */
  void learn_hand() {
    double sum = 0.0;
    for (int i = 0; i < presses_; i++) {
      const int p = of_press(i);
      const Mark at = printed(value_, i);
      sum += std::pow(value_[p] - at.x_mm, 2) + std::pow(value_[p + 1] - at.y_mm, 2) + covariance_(p, p) +
             covariance_(p + 1, p + 1);
    }
    hand_mm_ = std::max(std::sqrt(0.5 * sum / presses_), HAND_MIN_mm);
  }

  /* Of what a sensor is expected to read, by what is not known of the press; by: as model() has it.
   */
  double variance_of_press(int i, const double *by) const {
    double variance = 0.0;
    for (int a = 0; a < OF_PRESS; a++) {
      for (int b = 0; b < OF_PRESS; b++) {
        variance +=
            by[COMMON + OF_SENSOR + a] * by[COMMON + OF_SENSOR + b] * covariance_(of_press(i) + a, of_press(i) + b);
      }
    }
    return variance;
  }

  void align(MarksFit &fit) const;
  void place(MarksFit &fit) const;

  const Measured &measured_;
  const std::vector<calibrating::Placement> placements_; /* with earlier_Pa */
  const std::uint32_t without_;
  const int sensors_, presses_, print_, unknowns_;
  bool is_seated_ = false;
  double reach_x_ = 0.0, reach_y_ = 0.0, peak_Pa_ = 0.0, hand_mm_ = HAND_BEGIN_mm;
  std::vector<Mark> begin_places_;
  Eigen::VectorXd value_;
  Eigen::MatrixXd covariance_;
};

/* A shift and a turn that bring the sensors as found to their places in the layout. */
void Fit::align(MarksFit &fit) const {
  const calibrating::Array &array = measured_.array;
  for (int turn = 0; turn < ALIGN_TURNS; turn++) {
    double weight = 0.0, fx = 0.0, fy = 0.0, lx = 0.0, ly = 0.0;
    const double c = std::cos(fit.turn_rad), s = std::sin(fit.turn_rad);
    std::vector<double> weights;
    for (std::size_t k = 0; k < fit.sensors.size(); k++) {
      const FoundSensor &sensor = fit.sensors[k];
      const double off = std::hypot(c * sensor.x_mm - s * sensor.y_mm + fit.shift_x_mm - array.x_mm[k],
                                    s * sensor.x_mm + c * sensor.y_mm + fit.shift_y_mm - array.y_mm[k]);
      const double own =
          sensor.answers && sensor.gain > FEELS_NOTHING ? 1.0 / (1.0 + off * off / (CAUCHY_mm * CAUCHY_mm)) : 0.0;
      weights.push_back(own);
      weight += own;
      fx += own * sensor.x_mm;
      fy += own * sensor.y_mm;
      lx += own * array.x_mm[k];
      ly += own * array.y_mm[k];
    }
    if (!(weight > 0.0)) {
      return;
    }
    fx /= weight;
    fy /= weight;
    lx /= weight;
    ly /= weight;
    double along = 0.0, across = 0.0;
    for (std::size_t k = 0; k < fit.sensors.size(); k++) {
      const double ax = fit.sensors[k].x_mm - fx, ay = fit.sensors[k].y_mm - fy;
      const double bx = array.x_mm[k] - lx, by = array.y_mm[k] - ly;
      along += weights[k] * (ax * bx + ay * by);
      across += weights[k] * (ax * by - ay * bx);
    }
    fit.turn_rad = std::atan2(across, along);
    const double cc = std::cos(fit.turn_rad), ss = std::sin(fit.turn_rad);
    fit.shift_x_mm = lx - cc * fx + ss * fy;
    fit.shift_y_mm = ly - ss * fx - cc * fy;
  }
}

/* Of a sensor that teaches nothing: what its readings are of those that the others expect of it. */
void Fit::judge_by_others() {
  for (int k = 0; k < sensors_; k++) {
    if (!(without_ >> k & 1u)) {
      continue;
    }
    double both = 0.0, square = 0.0;
    value_[of_sensor(k)] = 1.0;
    for (int i = 0; i < presses_; i++) {
      const double expected = is_usable(i, k) ? model(value_, i, k, nullptr) : 0.0;
      both += expected * (is_usable(i, k) ? reading(i, k) : 0.0);
      square += expected * expected;
    }
    value_[of_sensor(k)] = square > 0.0 ? both / square : 0.0;
  }
}

MarksFit Fit::result() const {
  MarksFit fit;
  fit.solved = true;
  fit.hand_sd_mm = hand_mm_;
  fit.width_mm = std::exp(value_[LOG_WIDTH]);
  fit.slope_x = value_[SLOPE_X];
  fit.slope_y = value_[SLOPE_Y];
  fit.slope_x_sd = std::sqrt(covariance_(SLOPE_X, SLOPE_X));
  fit.slope_y_sd = std::sqrt(covariance_(SLOPE_Y, SLOPE_Y));
  double gains = 0.0, feeling = 0.0;
  for (int k = 0; k < sensors_; k++) {
    FoundSensor sensor;
    int measured = 0;
    double squares = 0.0, felt = 0.0;
    std::map<std::size_t, std::vector<Felt>> of_mark;
    for (int i = 0; i < presses_; i++) {
      measured += is_usable(i, k);
      double by[TOUCHED];
      const double expected = model(value_, i, k, by);
      if (is_usable(i, k) && expected > FELT_SHARE * value_[of_sensor(k)] * std::exp(value_[LOG_PEAK])) {
        squares += std::pow((reading(i, k) - expected) / expected, 2);
        felt += 1.0;
        of_mark[measured_.presses[static_cast<std::size_t>(i)].mark].push_back(
            {reading(i, k) / expected, variance_of_press(i, by) / (expected * expected)});
      }
    }
    sensor.felt = static_cast<std::size_t>(felt);
    sensor.scatter_share = scatter_of(of_mark);
    sensor.answers = 2 * measured > presses_;
    sensor.gain = value_[of_sensor(k)];
    sensor.residual_share = felt > 0.0 ? std::sqrt(squares / felt) : 0.0;
    sensor.x_mm = value_[of_sensor(k) + 1];
    sensor.y_mm = value_[of_sensor(k) + 2];
    gains += sensor.answers ? sensor.gain : 0.0;
    feeling += sensor.answers;
    fit.sensors.push_back(sensor);
  }
  /* Of those that feel. */
  const double all = gains / std::max(feeling, 1.0);
  double mean = 0.0, count = 0.0;
  for (const FoundSensor &sensor : fit.sensors) {
    const bool feels = sensor.answers && sensor.gain > FEELS_NOTHING * all;
    mean += feels ? sensor.gain : 0.0;
    count += feels;
  }
  mean /= std::max(count, 1.0);
  for (FoundSensor &sensor : fit.sensors) {
    sensor.gain /= mean;
  }
  fit.peak_Pa = mean * std::exp(value_[LOG_PEAK]);
  if (is_seated_) {
    fit.shift_x_mm = value_[print_ + SHIFT_X];
    fit.shift_y_mm = value_[print_ + SHIFT_Y];
    fit.turn_rad = value_[print_ + TURN];
  } else {
    align(fit);
  }
  for (int i = 0; i < presses_; i++) {
    const int p = of_press(i);
    const Mark at = printed(value_, i);
    fit.presses.push_back({value_[p], value_[p + 1], std::sqrt(0.5 * (covariance_(p, p) + covariance_(p + 1, p + 1))),
                           at.x_mm, at.y_mm, value_[p + 2]});
  }
  if (!is_seated_) {
    place(fit);
  }
  return fit;
}

/* Into the layout's axes, and whose place each sensor has. */
void Fit::place(MarksFit &fit) const {
  const double c = std::cos(fit.turn_rad), s = std::sin(fit.turn_rad);
  const auto turned = [&](double &x, double &y) {
    const double was_x = x;
    x = c * was_x - s * y + fit.shift_x_mm;
    y = s * was_x + c * y + fit.shift_y_mm;
  };
  for (FoundPress &press : fit.presses) {
    turned(press.x_mm, press.y_mm);
    turned(press.mark_x_mm, press.mark_y_mm);
  }
  const calibrating::Array &array = measured_.array;
  for (std::size_t k = 0; k < fit.sensors.size(); k++) {
    FoundSensor &sensor = fit.sensors[k];
    turned(sensor.x_mm, sensor.y_mm);
    sensor.off_mm = std::hypot(sensor.x_mm - array.x_mm[k], sensor.y_mm - array.y_mm[k]);
    sensor.place = k;
    double nearest_mm = SWAPPED_PITCHES * array.pitch_mm;
    if (!sensor.answers || sensor.gain < FEELS_NOTHING || sensor.off_mm <= nearest_mm) {
      continue;
    }
    for (std::size_t j = 0; j < array.sensors(); j++) {
      const double off = std::hypot(sensor.x_mm - array.x_mm[j], sensor.y_mm - array.y_mm[j]);
      if (off < nearest_mm) {
        nearest_mm = off;
        sensor.place = j;
      }
    }
  }
}

void Fit::seat(const MarksFit &found) {
  is_seated_ = true;
  hand_mm_ = HAND_BEGIN_mm;
  for (int k = 0; k < sensors_; k++) {
    const auto at = found.sensors[static_cast<std::size_t>(k)].place;
    begin_places_[static_cast<std::size_t>(k)] = {measured_.array.x_mm[at], measured_.array.y_mm[at]};
    value_[of_sensor(k) + 1] = measured_.array.x_mm[at];
    value_[of_sensor(k) + 2] = measured_.array.y_mm[at];
  }
  for (int i = 0; i < presses_; i++) {
    const FoundPress &press = found.presses[static_cast<std::size_t>(i)];
    value_[of_press(i)] = press.x_mm;
    value_[of_press(i) + 1] = press.y_mm;
  }
  value_[print_ + SHIFT_X] = found.shift_x_mm;
  value_[print_ + SHIFT_Y] = found.shift_y_mm;
  value_[print_ + TURN] = found.turn_rad;
}

} // namespace

MarksFit fit_marks(const Measured &measured, std::uint32_t without) {
  std::set<std::size_t> marks;
  for (const Press &press : measured.presses) {
    marks.insert(press.mark);
  }
  if (marks.size() < MARKS_MIN) {
    return {};
  }
  std::vector<calibrating::Placement> placements;
  for (const Press &press : measured.presses) {
    placements.push_back(press.placement);
  }
  calibrating::remember(placements);
  Fit fit(measured, std::move(placements), without);
  fit.solve();
  const MarksFit found = fit.result();
  fit.seat(found);
  fit.solve();
  fit.judge_by_others();
  MarksFit seated = fit.result();
  for (std::size_t k = 0; k < found.sensors.size(); k++) {
    seated.sensors[k].x_mm = found.sensors[k].x_mm;
    seated.sensors[k].y_mm = found.sensors[k].y_mm;
    seated.sensors[k].off_mm = found.sensors[k].off_mm;
    seated.sensors[k].place = found.sensors[k].place;
  }
  return seated;
}

} // namespace fingertip::validating
