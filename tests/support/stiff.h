#pragma once
#include "tests/support/robots.h"

/// Stiff problems.
namespace porthos::test {

/// n links of 1 kg and 0.5 m on joints about x and y in turn, hanging; springs of k·m g l and
/// dampers of `damping` times what is critical for one link alone. It starts with deflections and
/// rates that the springs' energy keeps alike. With a free base of 20 kg and 0.2 rad/s, without
/// gravity.
inline Robot stiff_chain(int n, double k, double damping, double amplitude = 0.2,
                         bool floating = false) {
  const double l = 0.5, g = 9.81, K = k * g * l, I = 0.03 + 0.25 * 0.25;
  mechanics::MechanismBuilder b("stiff chain");
  if (!floating) b.gravity({0, 0, -g});
  for (int i = 0; i < n + floating; ++i) {
    mechanics::BodySpec s;
    const bool base = floating && i == 0;
    s.name = "link" + std::to_string(i);
    s.parent = i == 0 ? "world" : "link" + std::to_string(i - 1);
    s.joint.name = "joint" + std::to_string(i);
    s.joint.type = base ? "free" : "revolute";
    s.joint.axis = i % 2 ? mechanics::Vec3d{0, 1, 0} : mechanics::Vec3d{1, 0, 0};
    if (!base) {
      s.joint.stiffness = K;
      s.joint.damping = damping * 2 * std::sqrt(K * I);
    }
    s.placement.r = {0, 0, i ? -l : 0};
    s.mass = {base ? 20.0 : 1.0, {0, 0, -l / 2}, {0.03, 0, 0, 0.03, 0, 0.01}};
    b.add(s);
  }
  const auto m = std::make_shared<mechanics::Mechanism>(b.build());
  std::vector<double> q(size_t(n), 0.0), v(size_t(n), 0.0);
  for (size_t i = 0; i < q.size(); ++i) {
    q[i] = amplitude * std::sin(1.0 + double(i)) / (1 + k);
    v[i] = 1.5 * amplitude * std::cos(2.0 + double(i)) / (1 + std::sqrt(k));
  }
  auto robot = make_robot(m, q, v);
  if (floating) {
    std::vector<double> all(m->neutral()), rates(size_t(m->nv()), 0.0);
    std::copy(q.begin(), q.end(), all.end() - n), std::copy(v.begin(), v.end(), rates.end() - n);
    rates[0] = 0.2;
    rates[1] = -0.1;
    rates[2] = 0.15;
    rates[3] = 0.1;
    robot.start = phs::State(robot.model->description(), robot.model->state(all, rates));
  }
  return robot;
}

/// Masses 1 on a line between walls, springs with the energy ½ linear d² + ¼ quartic d⁴. No solver
/// of its own.
struct QuarticChain {
  int masses;
  double linear = 1, quartic = 1e3, damping = 0;

  phs::Description description() const {
    phs::Description d;
    d.name = "quartic chain";
    d.nx = 2 * masses;
    d.traits.canonical = d.traits.separable = true;
    d.traits.lossless = damping == 0;
    for (int i = 0; i < masses; ++i)
      d.blocks.push_back(
          {"x" + std::to_string(i), phs::BlockKind::linear, i, 1, masses + i, "m", "kg m/s"});
    return d;
  }
  template <class T>
  T stretch(std::span<const T> x, int i) const {
    const T left = i == 0 ? T(0.0) : x[size_t(i - 1)], right = i == masses ? T(0.0) : x[size_t(i)];
    return right - left;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    T H(0.0);
    for (int i = 0; i < masses; ++i) H = H + T(0.5) * x[size_t(masses + i)] * x[size_t(masses + i)];
    for (int i = 0; i <= masses; ++i) {
      const T d = stretch(x, i);
      H = H + d * d * (T(0.5 * linear) + T(0.25 * quartic) * d * d);
    }
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    T before(0.0);
    for (int i = 0; i <= masses; ++i) {
      const T d = stretch(x, i), force = d * (T(linear) + T(quartic) * d * d);
      if (i > 0) e[size_t(i - 1)] = before - force;
      before = force;
    }
    for (int i = 0; i < masses; ++i) e[size_t(masses + i)] = x[size_t(masses + i)];
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    for (int i = 0; i < masses; ++i) {
      Re[size_t(i)] = T(0.0);
      Re[size_t(masses + i)] = T(damping) * e[size_t(masses + i)];
    }
  }
};

}  // namespace porthos::test
