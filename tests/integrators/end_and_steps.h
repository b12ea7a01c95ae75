#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/derivatives/run_gradient.h"
#include "tests/integrators/problems.h"
#include "tests/integrators/quadratic_cost.h"

/// A cost at the end and at the ends of steps, for any method of the catalogue, in double and in
/// 113 bits.
namespace porthos::integrators::end_and_steps {

using phs::Quad;
using test::Problem, test::quadratic;
using Vec = std::vector<double>;

inline Objective::Part weighted(double weight) {
  return [weight](double, std::span<const double> x, std::span<double> g) {
    test::add_quadratic_gradient(x, weight, g);
    return weight * quadratic(x);
  };
}

/// The direction that all slopes are taken along.
inline Vec direction(size_t n) {
  Vec d(n);
  for (size_t i = 0; i < n; ++i) d[i] = std::cos(1.0 + 2.5 * double(i));
  return d;
}

/// quadratic() at the end, and an eighth of it at the end of each step, in 113 bits. For radau15,
/// whose steps follow the flow to rounding, by gauss16, which does so at once.
/// @param longer  the steps are longer by this part
inline Quad cost_in_113_bits(const Problem& p, const std::string& method, Quad by, int steps,
                             double last, Quad longer = 0) {
  const size_t n = p.start.x.size();
  std::vector<Quad> x(n);
  const Vec d = direction(n);
  for (size_t i = 0; i < n; ++i) x[i] = Quad(p.start.x[i]) + by * Quad(d[i]);
  const Quad stretch = 1 + longer;
  const auto integrator = make_basic_integrator<Quad>(method == "radau15" ? "gauss16" : method,
                                                      *p.model, stretch * Quad(p.h));
  phs::BasicState<Quad> state(p.model->description(), x);
  Quad cost = 0;
  for (int i = 0; i < steps + (last != 0); ++i) {
    const Outcome o =
        i < steps ? integrator->step(state) : integrator->step_by(state, stretch * Quad(last));
    EXPECT_EQ(o, Outcome::ok);
    for (size_t k = 0; k < n; ++k) x[k] = state.x[k] + state.lo[k];
    cost += quadratic<Quad>(x) / 8;
  }
  return cost + quadratic<Quad>(x);
}

/// How far the slope along direction() is from that of 113 bits, of the moduli of its terms.
inline double off(const RunGradient& r, const Problem& p, const std::string& method, int steps,
                  double last) {
  EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
  const Quad by = Quad(1e-10);
  const Quad up = cost_in_113_bits(p, method, by, steps, last),
             down = cost_in_113_bits(p, method, -by, steps, last);
  const double expected = double((up - down) / (2 * by));
  const Vec d = direction(r.start.size());
  double mine = 0, moduli = 0;
  for (size_t i = 0; i < d.size(); ++i) {
    mine += r.start[i] * d[i];
    moduli += std::fabs(r.start[i] * d[i]);
  }
  EXPECT_NEAR(r.cost, double((up + down) / 2), 1e-13 * std::fabs(r.cost));
  return std::fabs(mine - expected) / moduli;
}

inline Objective objective() {
  return {.end = weighted(1), .sampled = weighted(0.125), .running = {}};
}

/// How far the gradient is from that of the midpoint rule, relative: a control.
inline double apart_from_midpoint(const RunGradient& r, const Problem& p, int steps) {
  const auto midpoint = gradient_of_run("midpoint", *p.model, p.start, p.h, steps, objective());
  double apart = 0, size = 0;
  for (size_t i = 0; i < r.start.size(); ++i) {
    apart += std::fabs(midpoint.start[i] - r.start[i]);
    size += std::fabs(r.start[i]);
  }
  return apart / size;
}

/// Slopes along direction() and by the duration against Richardson's differences of the cost.
/// gradient(by, longer): of a start moved by so much of the direction, and steps longer by that
/// part.
template <class Gradient>
void expect_slopes_of_differences(const std::string& method, const Gradient& gradient,
                                  double duration, double by) {
  const auto richardson = [by](const auto& cost) {
    const auto once = [&](double d) { return (cost(d) - cost(-d)) / (2 * d); };
    return (4 * once(by) - once(2 * by)) / 3;
  };
  const RunGradient r = gradient(0, 0);
  const Vec d = direction(r.start.size());
  double slope = 0;
  for (size_t i = 0; i < d.size(); ++i) slope += r.start[i] * d[i];
  const double expected = richardson([&](double x) { return gradient(x, 0).cost; }),
               longer = richardson([&](double x) { return gradient(0, x).cost; }) / duration;
  std::printf("  %-20s slope %.9g off by %.1e, by the duration %.9g off by %.1e (bounds 1e-8)\n",
              method.c_str(), slope, std::fabs(slope / expected - 1), r.duration,
              std::fabs(r.duration / longer - 1));
  EXPECT_NEAR(slope, expected, 1e-8 * std::fabs(expected));
  EXPECT_NEAR(r.duration, longer, 1e-8 * std::fabs(longer));
}

inline Problem henon_heiles() {
  return test::user_problem(test::HenonHeiles{}, {0, 0.3, 0.35, 0.2}, 0.1);
}

}  // namespace porthos::integrators::end_and_steps
