#include "layer_collocation.hpp"
#include "partial_slip.hpp"
#include "simulation/twin/best_gaussian.hpp"
#include "simulation/twin/traction_table.hpp"

#include <gtest/gtest.h>
#include <map>
#include <tuple>

namespace fingertip::twin {

const std::filesystem::path CACHE = FINGERTIP_TEST_CACHE_DIR;

struct Pair {
  ContactTable pressure;
  TractionTable traction;
};

static const Pair &tables_of(const std::string &name, double thickness_mm) {
  static std::map<std::pair<std::string, double>, Pair> known;
  const auto key = std::make_pair(name, thickness_mm);
  if (known.find(key) == known.end()) {
    const Layer layer = silicone(thickness_mm);
    const ContactTable table = ContactTable::load_or_build(indenter(name), layer, CACHE);
    known.emplace(key, Pair{table, TractionTable(table, layer)});
  }
  return known.at(key);
}

static std::size_t at(const Grid &grid, int i, int j) {
  return std::size_t(grid.nodes / 2 + i) * std::size_t(grid.nodes) + std::size_t(grid.nodes / 2 + j);
}

static double largest(const std::vector<double> &field) {
  double most = 0.0;
  for (double value : field) {
    most = std::max(most, std::abs(value));
  }
  return most;
}

static std::vector<double> times(const std::vector<double> &field, double factor) {
  std::vector<double> product = field;
  for (double &value : product) {
    value *= factor;
  }
  return product;
}

// friction (p(F) - p(S)), as TractionTable has it.
static std::vector<double> stuck_within(const Contact &whole, const Contact &stuck, double friction) {
  std::vector<double> traction = times(whole.pressure_Pa, friction);
  for (std::size_t n = 0; n < traction.size(); n++) {
    traction[n] -= friction * stuck.pressure_Pa[n];
  }
  return traction;
}

// The wave's response on the traction itself, on the contact's own grid and with its room.
TEST(TwinTraction, TheTableIsTheTransformOfTheTraction) {
  struct Case {
    const char *name;
    double thickness_mm, allowed, allowed_far; // in parts of the peak, to 30 and 44.5 mm
  };
  for (const Case &one : {Case{"sphere6", 12.0, 0.004, 0.013}, Case{"cube6", 6.0, 0.002, 0.002}, Case{"ball_bearing", 6.0, 0.008, 0.008}}) {
    const Layer layer = silicone(one.thickness_mm);
    const Grid grid = grid_for(indenter(one.name), layer);
    ContactSolver solver(indenter(one.name), layer, grid);
    PartialSlip surface(layer, grid);
    const TractionTable &table = tables_of(one.name, one.thickness_mm).traction;
    const double force_N = 4.4, stuck_N = 3.1, friction = 0.5;
    const Contact whole = solver.solve(force_N), stuck = solver.solve(stuck_N);
    const std::vector<double> none(whole.pressure_Pa.size(), 0.0);
    for (bool slides : {true, false}) {
      const std::vector<double> traction = slides ? times(whole.pressure_Pa, friction) : stuck_within(whole, stuck, friction);
      const double carried_N = friction * (slides ? force_N : force_N - stuck_N);
      for (bool along_x : {true, false}) {
        const std::vector<double> base = surface.base_Pa(along_x ? Traction{traction, none} : Traction{none, traction});
        const TractionTable::Load load{force_N, slides ? 0.0 : stuck_N, along_x ? carried_N : 0.0, along_x ? 0.0 : carried_N};
        const double peak = largest(base);
        const auto off = [&](double reach_mm) {
          double most = 0.0;
          const int reach = static_cast<int>(reach_mm / grid.step_mm);
          for (int i = -reach; i <= reach; i += 3) {
            for (int j = -reach; j <= reach; j += 3) {
              const double found = table.base_pressure_Pa(load, i * grid.step_mm, j * grid.step_mm);
              most = std::max(most, std::abs(found - base[at(grid, i, j)]));
            }
          }
          return most / peak;
        };
        EXPECT_LT(off(30.0), one.allowed) << one.name << (slides ? " slides" : " sticks");
        EXPECT_LT(off(44.5), one.allowed_far) << one.name << (slides ? " slides" : " sticks");
      }
    }
  }
}

// Without any grid or transform: p(k) is the Hankel transform of a round pressure, and the wave's
// responses are those that the collocation confirms. Traction presses the base ahead of it.
TEST(TwinTraction, ARoundContactIsItsHankelTransform) {
  for (const double thickness_mm : {12.0, 6.0}) {
    const Layer layer = silicone(thickness_mm);
    const Grid grid{384, 0.15};
    const double force_N = 5.0;
    const Contact contact = ContactSolver(indenter("sphere15"), layer, grid).solve(force_N);
    const double k_step = 0.008; // per mm
    std::vector<double> p_of_k;
    for (int n = 0; n < 750; n++) {
      p_of_k.push_back(0.0);
      for (int i = 1; i < 60; i++) {
        const double r = i * grid.step_mm;
        p_of_k.back() += contact.pressure_Pa[at(grid, i, 0)] * std::cyl_bessel_j(0, k_step * n * r) * r * grid.step_mm;
      }
    }
    const auto exact = [&](int order, double r, double (*response)(double, double)) {
      double sum = 0.0;
      for (std::size_t n = 0; n < p_of_k.size(); n++) {
        const double k = k_step * static_cast<double>(n);
        sum += response(k * thickness_mm, layer.poisson) * p_of_k[n] * std::cyl_bessel_j(order, k * r) * k * k_step;
      }
      return sum;
    };
    const double indentation_mm =
        2.0 * (1.0 - layer.poisson * layer.poisson) * thickness_mm / layer.youngs_modulus_Pa * exact(0, 0.0, surface_compliance);
    EXPECT_NEAR(contact.indentation_mm, indentation_mm, 0.01 * indentation_mm);
    const TractionTable &table = tables_of("sphere15", thickness_mm).traction;
    double peak = 0.0, off = 0.0;
    for (int i = 2; i < 200; i += 7) {
      const double r = i * grid.step_mm, ahead = exact(1, r, tangential_transfer);
      peak = std::max(peak, ahead);
      EXPECT_NEAR(contact.base_Pa[at(grid, i, 0)], exact(0, r, base_transfer), 0.005 * largest(contact.base_Pa)) << r;
      for (double angle : {0.0, 0.7, 2.6}) {
        const double found = table.base_pressure_Pa({force_N, 0.0, force_N, 0.0}, r * std::cos(angle), r * std::sin(angle));
        off = std::max(off, std::abs(found - ahead * std::cos(angle)));
      }
    }
    EXPECT_LT(off, 0.005 * peak);
    EXPECT_NEAR(peak / largest(contact.base_Pa), 0.316, 0.003);
  }
}

TEST(TwinTraction, TheBaseCarriesItsMomentAndNoForce) {
  const double thickness_mm = 3.0, step_mm = 0.5; // 45 mm are all there is
  const TractionTable &table = tables_of("cube6", thickness_mm).traction;
  const TractionTable::Load load{3.0, 1.8, 0.7, -0.4};
  double force = 0.0, moment_x = 0.0, moment_y = 0.0;
  for (double x = -44.5; x < 45.0; x += step_mm) {
    for (double y = -44.5; y < 45.0; y += step_mm) {
      const double here_N = 1e-6 * step_mm * step_mm * table.base_pressure_Pa(load, x, y);
      force += here_N;
      moment_x += x * here_N;
      moment_y += y * here_N;
    }
  }
  EXPECT_NEAR(force, 0.0, 1e-6);
  EXPECT_NEAR(moment_x, thickness_mm * load.x_N, 0.002 * thickness_mm * std::abs(load.x_N));
  EXPECT_NEAR(moment_y, thickness_mm * load.y_N, 0.002 * thickness_mm * std::abs(load.y_N));
}

TEST(TwinTraction, IsOddAlongItselfAndEvenAcross) {
  const TractionTable &round = tables_of("sphere6", 12.0).traction;
  const TractionTable &bar = tables_of("ball_bearing", 12.0).traction;
  for (double x : {0.2, 3.3, 17.0}) {
    for (double y : {0.1, 0.3, 8.4}) {
      const TractionTable::Load along{5.0, 2.0, 1.5, 0.0}, across{5.0, 2.0, 0.0, 1.5};
      const TractionTable::Load both{5.0, 2.0, 1.5, 1.5};
      for (const TractionTable *table : {&round, &bar}) {
        const double here = table->base_pressure_Pa(along, x, y);
        EXPECT_GT(here, 0.0);
        EXPECT_EQ(table->base_pressure_Pa(along, -x, y), -here);
        EXPECT_EQ(table->base_pressure_Pa(along, x, -y), here);
        const double there = table->base_pressure_Pa(across, x, y);
        EXPECT_EQ(table->base_pressure_Pa(across, -x, y), there);
        EXPECT_EQ(table->base_pressure_Pa(across, x, -y), -there);
        EXPECT_NEAR(table->base_pressure_Pa(both, x, y), here + there, 1e-9);
      }
      EXPECT_NEAR(round.base_pressure_Pa(along, x, y), round.base_pressure_Pa(across, y, x), 0.1);
      // A quarter turn of load and place together.
      EXPECT_NEAR(round.base_pressure_Pa(along, x, y), round.base_pressure_Pa({5.0, 2.0, 0.0, 1.5}, -y, x), 0.1);
    }
  }
  // Smooth through the middle.
  const TractionTable::Load load{5.0, 0.0, 1.5, 0.0};
  EXPECT_NEAR(round.base_pressure_Pa(load, 0.0, 2.0), 0.0, 1e-9);
  EXPECT_NEAR(round.base_pressure_Pa(load, 1e-4, 0.0), 1e-3 * round.base_pressure_Pa(load, 0.1, 0.0), 1e-3);
}

// A ring of small contacts, each dragged along the ring: what one presses another relieves.
TEST(TwinTraction, TorsionIsNotFelt) {
  const TractionTable &table = tables_of("sphere6", 12.0).traction;
  const double peak = table.base_pressure_Pa({2.0, 0.0, 1.0, 0.0}, 6.0, 0.0);
  const auto ring = [&](double turn, double x, double y) { // 0: outward; 90 degrees: torsion
    constexpr int CONTACTS = 64;
    double sum = 0.0;
    for (int n = 0; n < CONTACTS; n++) {
      const double angle = 2.0 * M_PI * n / CONTACTS;
      sum += table.base_pressure_Pa({2.0, 0.0, std::cos(angle + turn), std::sin(angle + turn)}, x - 5.0 * std::cos(angle),
                                    y - 5.0 * std::sin(angle)) /
             CONTACTS;
    }
    return sum;
  };
  double torsion = 0.0, outward = 0.0;
  for (double x = 0.0; x < 20.0; x += 1.7) {
    torsion = std::max(torsion, std::abs(ring(0.5 * M_PI, x, 3.1)));
    outward = std::max(outward, std::abs(ring(0.0, x, 3.1)));
  }
  EXPECT_LT(torsion, 2e-3 * peak);
  EXPECT_GT(outward, 0.2 * peak);
}

TEST(TwinTraction, NoLoadIsNothingAndAFullOneSlides) {
  const TractionTable &table = tables_of("sphere6", 12.0).traction;
  EXPECT_EQ(stuck_force_N(5.0, 0.0, 0.5), 5.0);
  EXPECT_EQ(stuck_force_N(5.0, 1.5, 0.5), 2.0);
  EXPECT_EQ(stuck_force_N(5.0, 2.5, 0.5), 0.0);
  EXPECT_EQ(stuck_force_N(5.0, 9.0, 0.5), 0.0);
  EXPECT_EQ(table.base_pressure_Pa({5.0, 5.0, 0.0, 0.0}, 3.0, 2.0), 0.0);
  EXPECT_EQ(table.base_pressure_Pa({0.0, 0.0, 0.0, 0.0}, 3.0, 2.0), 0.0);
  EXPECT_EQ(table.base_pressure_Pa({5.0, 0.0, 0.0, 0.0}, 3.0, 2.0), 0.0);
  // Next to nothing, too, presses in proportion.
  const auto per_newton = [&](double tangential_N) {
    return table.base_pressure_Pa({5.0, stuck_force_N(5.0, tangential_N, 0.5), tangential_N, 0.0}, 6.0, 0.0) / tangential_N;
  };
  EXPECT_NEAR(per_newton(1e-7) / per_newton(1e-2), 1.0, 1e-3);
}

// Cattaneo's and Mindlin's traction between spheres: friction p0 (sqrt(1 - r^2 / a^2) - c / a
// sqrt(1 - r^2 / c^2)), c^3 / a^3 = 1 - Q / (friction F).
TEST(TwinTraction, OnAThickLayerSpheresSlipAsMindlinSays) {
  const Layer layer{400.0, 1e6, 0.49};
  const Grid grid{384, 0.05};
  ContactSolver solver(indenter("sphere15"), layer, grid);
  const double radius_mm = 7.5, modulus_MPa = 1.0 / (1.0 - 0.49 * 0.49);
  const double force_N = 0.4, tangential_N = 0.12, friction = 0.5;
  const double a = std::cbrt(0.75 * force_N * radius_mm / modulus_MPa);
  const double c = a * std::cbrt(1.0 - tangential_N / (friction * force_N));
  const double peak = friction * 1.5e6 * force_N / (M_PI * a * a);
  const Contact whole = solver.solve(force_N);
  const Contact stuck = solver.solve(stuck_force_N(force_N, tangential_N, friction));
  const std::vector<double> traction = stuck_within(whole, stuck, friction);
  for (double r = 0.0; r < 1.2 * a; r += 0.1) {
    const auto cap = [&](double edge) { return r < edge ? std::sqrt(1.0 - r * r / (edge * edge)) : 0.0; };
    const int i = static_cast<int>(std::lround(r / grid.step_mm));
    if (std::abs(r - a) > 0.06 && std::abs(r - c) > 0.06) { // where the slope has no end
      EXPECT_NEAR(traction[at(grid, i, 0)], peak * (cap(a) - c / a * cap(c)), 0.02 * peak) << r;
    }
  }
}

TEST(TwinTraction, CollocationAgreesOnTheShiftOfTheSurface) {
  for (double H : {0.01, 0.5, 2.0, 8.0}) {
    EXPECT_NEAR(solve_layer_wave(H, 0.49, 36).moves_per_traction, surface_shift_along(H, 0.49), 1e-10);
  }
}

// Back at no load, the ring that has slid forth has slid back in its outer half only: the traction
// p(F) - p(S) at most, less twice that of half the load (Mindlin and Deresiewicz).
TEST(TwinTraction, AFallenLoadLeavesLittle) {
  const double force_N = 6.0, friction = 0.5, load_N = 1.8;
  const auto shape = [&](double tangential_N) {
    return TractionTable::Load{force_N, stuck_force_N(force_N, tangential_N, friction), tangential_N, 0.0};
  };
  for (const auto &[name, thickness_mm, allowed] :
       {std::tuple{"sphere6", 12.0, 0.01}, {"sphere15", 12.0, 0.025}, {"sphere15", 6.0, 0.07}}) {
    const TractionTable &table = tables_of(name, thickness_mm).traction;
    double peak = 0.0, left = 0.0;
    for (double x = 0.0; x < 30.0; x += 0.25) {
      const double loaded = table.base_pressure_Pa(shape(load_N), x, 0.0);
      peak = std::max(peak, loaded);
      left = std::max(left, std::abs(loaded - 2.0 * table.base_pressure_Pa(shape(0.5 * load_N), x, 0.0)));
    }
    EXPECT_LT(left, allowed * peak) << name << " on " << thickness_mm << " mm";
  }
}

// Traction shaped by pressures against the traction that the layer's own tangential displacements
// ask for: how far the base can tell them apart, in parts of the peak.
TEST(TwinTraction, WhatSticksOnALayerIsNearlyTheContactOfLessForce) {
  struct Case {
    const char *name;
    double thickness_mm, force_N, shift_mm, allowed;
  };
  const double friction = 0.5;
  for (const Case &one :
       {Case{"sphere6", 12.0, 5.0, 0.35, 0.002}, Case{"sphere15", 12.0, 8.0, 0.5, 0.005}, Case{"sphere15", 6.0, 8.0, 0.5, 0.013},
        Case{"cube6", 12.0, 5.0, 0.4, 0.012}, Case{"cube6", 6.0, 5.0, 0.4, 0.03}}) {
    const Layer layer = silicone(one.thickness_mm);
    const Grid grid{192, 0.25};
    ContactSolver solver(indenter(one.name), layer, grid);
    PartialSlip surface(layer, grid);
    const Contact whole = solver.solve(one.force_N);
    const Traction found = surface.solve(whole.pressure_Pa, friction, one.shift_mm);
    const double tangential_N = surface.force_N(found.x_Pa);
    const double share = tangential_N / (friction * one.force_N);
    ASSERT_GT(share, 0.3) << one.name;
    ASSERT_LT(share, 0.9) << one.name;
    const Contact stuck = solver.solve(stuck_force_N(one.force_N, tangential_N, friction));
    const std::vector<double> none(found.y_Pa.size(), 0.0);
    const std::vector<double> exact = surface.base_Pa(found);
    const auto off = [&](const std::vector<double> &traction) {
      const std::vector<double> base = surface.base_Pa({traction, none});
      double most = 0.0;
      for (std::size_t n = 0; n < base.size(); n++) {
        most = std::max(most, std::abs(base[n] - exact[n]));
      }
      return most / largest(exact);
    };
    const double shaped = off(stuck_within(whole, stuck, friction));
    const double sliding = off(times(whole.pressure_Pa, tangential_N / one.force_N));
    EXPECT_LT(shaped, one.allowed) << one.name << " on " << one.thickness_mm << " mm";
    if (one.name[0] == 's') { // the difference from plain sliding is more than that
      EXPECT_GT(sliding, 3.0 * shaped) << one.name << " on " << one.thickness_mm << " mm";
    }
  }
}

// To the first order, with sensors everywhere.
TEST(TwinTraction, MovesTheClosestGaussianByAShareOfTheThickness) {
  // On 6 mm the contact is not small beside the thickness.
  for (const auto &[thickness_mm, expected] : {std::pair{6.0, 0.296}, {9.0, 0.28}, {12.0, 0.28}, {15.0, 0.28}}) {
    const Pair &tables = tables_of("sphere6", thickness_mm);
    const double force_N = 5.0;
    const BestGaussian::Fit g = BestGaussian(tables.pressure, thickness_mm).at(force_N);
    double with = 0.0, square = 0.0;
    for (double x = -30.0; x <= 30.0; x += 0.5) {
      for (double y = -30.0; y <= 30.0; y += 0.5) {
        const double s2 = g.sigma_mm * g.sigma_mm;
        const double along = g.p0_Pa * std::exp(-0.5 * (x * x + y * y) / s2) * x / s2;
        with += along * tables.traction.base_pressure_Pa({force_N, 0.0, force_N, 0.0}, x, y);
        square += along * along;
      }
    }
    EXPECT_NEAR(with / square / thickness_mm, expected, 0.01);
  }
}

} // namespace fingertip::twin
