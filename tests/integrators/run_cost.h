#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "integrators/derivatives/run_gradient.h"
#include "integrators/tables/collocation_table.h"
#include "phs/network/network.h"
#include "tests/integrators/problems.h"
#include "tests/integrators/quadratic_cost.h"

/// A cost with all its parts for the tests of derivatives of runs, in double and in 113 bits.
namespace porthos::integrators::run_cost {

using phs::Quad;
using Vec = std::vector<double>;

inline Vec random_vector(size_t n, unsigned seed) {
  std::mt19937 rng(seed);
  Vec v(n);
  for (double& x : v) x = std::uniform_real_distribution<double>(-1, 1)(rng);
  return v;
}
/// λ·δ, and the sum of its moduli.
inline std::pair<double, double> product(const Vec& lambda, const Vec& delta) {
  Quad sum = 0;
  double moduli = 0;
  for (size_t i = 0; i < lambda.size(); ++i) {
    sum += Quad(lambda[i]) * Quad(delta[i]);
    moduli += std::fabs(lambda[i] * delta[i]);
  }
  return {double(sum), moduli};
}

/// A cost with all three parts, in the scalar T.
template <class T>
T running_cost(const T& t, std::span<const T> x) {
  return (T(1.0) + t) * x[0] * x[0] * x[x.size() - 1];
}
inline Objective objective() {
  Objective o;
  o.end = [](double, std::span<const double> x, std::span<double> g) {
    test::add_quadratic_gradient(x, 1, g);
    return test::quadratic(x);
  };
  o.running = [](double t, std::span<const double> x, std::span<double> g) {
    const size_t last = x.size() - 1;
    g[0] = 2 * (1 + t) * x[0] * x[last];
    g[last] = (1 + t) * x[0] * x[0];
    return running_cost(t, x);
  };
  o.sampled = [](double, std::span<const double> x, std::span<double> g) {
    g[1] = x[1];
    return x[1] * x[1] / 2;
  };
  o.end_curvature = [](double, std::span<const double>, std::span<const double> v,
                       std::span<double> out) { test::add_quadratic_gradient(v, 1, out); };
  o.running_curvature = [](double t, std::span<const double> x, std::span<const double> v,
                           std::span<double> out) {
    const size_t last = x.size() - 1;
    out[0] = 2 * (1 + t) * (v[0] * x[last] + x[0] * v[last]);
    out[last] = 2 * (1 + t) * x[0] * v[0];
  };
  return o;
}
/// The same cost of the same run in 113 bits.
inline Quad cost_in_113_bits(const phs::Model& model, const std::string& method,
                             const std::vector<Quad>& start, double h, int steps) {
  const auto table = gauss_table<Quad>(gauss_stages(method));
  std::vector<Quad> b(size_t(table.s)), x(start.size());
  table.weights(Quad(h), b);
  const auto integrator = make_basic_integrator<Quad>(method, model, Quad(h));
  phs::BasicState<Quad> state(model.description(), start);
  Quad cost = 0;
  for (int i = 0; i < steps; ++i) {
    const Quad t = integrator->time(state);
    EXPECT_EQ(integrator->step(state), Outcome::ok);
    for (size_t j = 0; j < b.size(); ++j) {
      integrator->interpolate(state, table.c[j], x);
      cost += b[j] * running_cost<Quad>(t + Quad(h) * table.c[j], x);
    }
    cost += (state.x[1] + state.lo[1]) * (state.x[1] + state.lo[1]) / 2;
  }
  for (size_t k = 0; k < x.size(); ++k) x[k] = state.x[k] + state.lo[k];
  return cost + test::quadratic<Quad>(x);
}

/// A double pendulum with a hard spring, friction that grows with the third power of the rate, and
/// a torque, each times a factor.
inline std::shared_ptr<const phs::Model> pendulum(double mass, double spring, double dry,
                                                  double torque) {
  auto model = std::make_shared<mechanics::MechanicalModel>(
      test::planar_chain({mass, 1}, {1, 1}, {0.5, 0.5}, {0.125, 0.125}, 9.81));
  phs::Network net("pendulum");
  net.add("arm", model)
      .potential("hard", "arm.link0", phs::spring(3 * spring, 0.25, 8 * spring))
      .resist("dry", "arm.link1.torque", phs::function([dry](auto v) {
                using T = decltype(v);
                return T(dry) * (v + v * v * v);
              }))
      .source("push", "arm.link1.torque", phs::sine(2 * torque, 0.5));
  return net.build();
}

}  // namespace porthos::integrators::run_cost
