#pragma once
#include "integrators/core/integrator.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/user_model.h"
#include "tests/support/henon_heiles.h"
#include "tests/support/linkages.h"
#include "tests/support/robots.h"

/// The problems every method of the catalogue is judged on. None is linear but the oscillator,
/// which is there for its invariants: a linear problem hides order defects.
namespace porthos::test {

struct Problem {
  std::string name;
  std::shared_ptr<const phs::Model> model;
  phs::State start;
  double h;  ///< a step that resolves the motion [s]
};

/// Two oscillators; the energy of each is a quadratic invariant that is not bilinear in q and p.
struct Oscillators {
  static constexpr double stiffness[2] = {1.0, 2.5};
  phs::Description description() const {
    phs::Description d;
    d.name = "oscillators";
    d.nx = 4;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
    d.invariants = {{"energy_of_each", 2, 0, 2, "J"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  void invariants(std::span<const T> x, std::span<T> values) const {
    for (size_t i = 0; i < 2; ++i)
      values[i] = T(0.5) * (x[2 + i] * x[2 + i] + T(stiffness[i]) * x[i] * x[i]);
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    T values[2];
    invariants(x, std::span<T>(values));
    return values[0] + values[1];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    for (size_t i = 0; i < 2; ++i) {
      e[i] = T(stiffness[i]) * x[i];
      e[2 + i] = x[2 + i];
    }
  }
};

template <class S>
Problem user_problem(S system, std::vector<double> x, double h) {
  auto model = std::make_shared<phs::UserModel<S>>(system);
  const auto name = model->description().name;
  return {name, model, phs::State(model->description(), std::move(x)), h};
}

/// Variable mass and angles; H far from separable.
inline Problem double_pendulum() {
  auto model = std::make_shared<mechanics::MechanicalModel>(
      planar_chain({1, 1}, {1, 1}, {0.5, 0.5}, {1. / 12, 1. / 12}, 9.81));
  return {"double pendulum", model, phs::State(model->description(), {0.7, -0.4, 1.1, 0.5}), 0.1};
}

/// ETS-VII at five times its rates: quaternion, base, six joints.
inline Problem floating_arm() {
  const auto robot = ets_vii(5);
  return {"floating arm", robot.model, robot.start, 0.125};
}

/// Loops: only methods that keep constraints fit.
inline Problem loop_problem(Linkage l, double h) {
  const auto x = l.start();
  auto model = std::make_shared<mechanics::MechanicalModel>(l.model());
  return {model->description().name, model, phs::State(model->description(), x), h};
}

inline const std::vector<Problem>& problems() {
  static const std::vector<Problem> all{double_pendulum(),
                                        floating_arm(),
                                        user_problem(HenonHeiles{}, {0, 0.3, 0.35, 0.2}, 0.1),
                                        user_problem(Oscillators{}, {0.5, -0.3, 0.2, 0.7}, 0.1),
                                        loop_problem(four_bar(), 1. / 32),
                                        loop_problem(holding_arms(), 0.125)};
  return all;
}

inline bool fits(const integrators::Declaration& d, const Problem& p) {
  return !integrators::misfit(d, p.model->description());
}

/// Those of given directions that keep g = 0 and Bᵀe = 0 to first order: their projections.
inline std::vector<Vec> along_constraints(const Problem& p, const std::vector<Vec>& basis) {
  const auto system = p.model->instantiate<phs::Dual>();
  const auto rows = system->constraints();
  if (!rows) return basis;
  const size_t m = size_t(rows->count()), n = basis.size();
  const int cols = int(n), all = 2 * rows->count();
  phs::Matrix C(all, cols);
  for (size_t j = 0; j < n; ++j) {
    std::vector<phs::Dual> x(p.start.x.begin(), p.start.x.end()), g(m), rate(m), e(x.size());
    for (size_t i = 0; i < x.size(); ++i) x[i].d = basis[j][i];
    rows->place(x, g);
    system->gradient(x, e);
    rows->rates(e, rate);
    for (size_t r = 0; r < m; ++r) {
      C(int(r), int(j)) = g[r].d;
      C(int(m + r), int(j)) = rate[r].d;
    }
  }
  const phs::Matrix P = phs::pseudo_inverse(C).inverse * C;
  std::vector<Vec> along;
  for (size_t j = 0; j < n; ++j) {
    Vec u = basis[j];
    for (size_t l = 0; l < n; ++l)
      for (size_t i = 0; i < u.size(); ++i) u[i] -= P(int(l), int(j)) * basis[l][i];
    along.push_back(std::move(u));
  }
  return along;
}

/// The directions a state can move in: where x holds a quaternion block, those that keep |ξ| = 1
/// and ξ·π = 0; with constraints, along them.
inline std::vector<std::vector<double>> tangents(const Problem& p) {
  const auto& d = p.model->description();
  const auto& x = p.start.x;
  std::vector<std::vector<double>> basis;
  const auto fresh = [&]() -> std::vector<double>& {
    basis.emplace_back(x.size(), 0.0);
    return basis.back();
  };
  // ξ ∘ e_k, with e_k = i, j, k
  const auto times_unit = [](const double* a, int k, double* out) {
    const double w = a[0], i = a[1], j = a[2], l = a[3];
    const double table[3][4] = {{-i, w, l, -j}, {-j, -l, w, i}, {-l, j, -i, w}};
    std::copy(table[k], table[k] + 4, out);
  };
  for (const auto& b : d.blocks) {
    const size_t q = size_t(b.at), m = size_t(b.momentum), n = size_t(b.size);
    if (b.kind == phs::BlockKind::rotation) {
      for (int k = 0; k < 3; ++k) {
        auto& turn = fresh();
        times_unit(&x[q], k, &turn[q]);
        times_unit(&x[m], k, &turn[m]);
        times_unit(&x[q], k, &fresh()[m]);
      }
    } else {
      for (size_t i = 0; i < n; ++i) {
        fresh()[q + i] = 1;
        fresh()[m + i] = 1;
      }
    }
  }
  return along_constraints(p, basis);
}

}  // namespace porthos::test
