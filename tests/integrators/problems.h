#pragma once
#include "integrators/claims.h"
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

inline std::vector<std::vector<double>> tangents(const Problem& p) {
  return integrators::tangents(*p.model, p.start.x);
}

}  // namespace porthos::test
