// What no judge of a pair does better than, on a pad whose gains are known as well as its
// calibration knows them. The judge knows all else: the rubber's response to the ball and its dip,
// but for a share of the largest reading by which its model is off at each sensor; the noise, as
// the mean of the frames that are looked at; and that it is one of the two contacts below.
//
// Two limits, each of its own. Placed: the Cramer-Rao bound is the least covariance of unbiased
// estimates of two places and two forces. Told: a long contact under a pull may make nearly the
// same readings. Among the tests that call it two in at most false_two of its touches, the
// likelihood ratio finds most pairs (Neyman and Pearson): Phi(d - Phi^-1(1 - false_two)), d the
// distance of the readings of both in standard deviations. Each long contact sets such a limit, and
// the nearest that is found sets this one: no longer than the report's longest edge, pulled by no
// more than its loads.
#pragma once

#include "shear/static/pulled.hpp"

#include <Eigen/Core>
#include <array>

namespace fingertip::two {

using Column = Eigen::Matrix<double, truth::SENSORS, 1>;
template <int N> using Unknowns = Eigen::Matrix<double, N, 1>;
constexpr int PAIR = 6; // x, y, force of each; mm and N
constexpr int LINE = 7; // middle, force, half the line along x and y, load along x and y
constexpr double LINE_LONGEST_mm = 20.0, LINE_LOAD_MOST = 0.3; // the load of the force

// Balls on the rubber, in a pair or evenly along a line that a load pulls.
struct Rubber {
  const fit_array &array;
  const pad_profile &profile; // of the response to a pull
  const shear::Object &object;
  double dip_share;

  Column readings_Pa(const Unknowns<PAIR> &pair) const;
  Column readings_Pa(const Unknowns<LINE> &line) const;
};

// Standard deviations of a reading: noise, its gain's share of it, and the model's of the largest.
struct ReadingErrors {
  double noise_Pa;
  truth::Readings gain_sd;
  double model_share;
};
Column per_sd(const Column &readings_Pa, const ReadingErrors &errors); // 1 / Pa

// What is right: within near_mm each, and the sum of the forces within force_share of it.
struct Right {
  double near_mm, force_share, false_two;
};
bool is_right(const Right &right, const Unknowns<PAIR> &truth, const Unknowns<PAIR> &found);

// Most likely unknowns by Levenberg and Marquardt's steps from there, and the sum of squares left.
template <int N> struct Fitted {
  Unknowns<N> at;
  double left;
};
template <int N>
Fitted<N> fitted(const Rubber &rubber, const Column &readings_Pa, const Column &per_sd, const Unknowns<N> &start);
// With the pair's middle and second moment: where the search for the nearest line begins.
Unknowns<LINE> line_like(const Unknowns<PAIR> &pair);

struct PairBound {
  double placed, told;
  Unknowns<LINE> line; // the long contact that told is about
};
PairBound bound_of(const Rubber &rubber, const Unknowns<PAIR> &pair, const ReadingErrors &errors, const Right &right,
                   Random &random);

} // namespace fingertip::two
