#pragma once
#include <memory>
#include <random>

#include "mechanics/builder.h"

/// Models for benchmarks that need no file.
namespace porthos::bench {

/// n boxes on revolute joints with alternating axes, the first on a fixed or free base.
inline std::shared_ptr<const mechanics::Mechanism> chain(int n, bool free_base) {
  mechanics::MechanismBuilder b("chain" + std::to_string(n));
  for (int i = 0; i < n + free_base; ++i) {
    mechanics::BodySpec s;
    s.name = "body" + std::to_string(i);
    s.parent = i == 0 ? "world" : "body" + std::to_string(i - 1);
    const bool base = free_base && i == 0;
    s.joint.type = base ? "free" : "revolute";
    s.joint.axis = i % 3 == 0   ? mechanics::Vec3d{0, 0, 1}
                   : i % 3 == 1 ? mechanics::Vec3d{0, 1, 0}
                                : mechanics::Vec3d{1, 0, 0};
    s.placement.r = {0.3, 0.02, -0.01};
    const double k = base ? 20 : 0.05;
    s.mass = {base ? 150.0 : 2.0, {0.15, 0, 0.01}, {k, 0, 0, 1.1 * k, 0, 1.2 * k}};
    b.add(s);
  }
  return std::make_shared<mechanics::Mechanism>(b.build());
}

/// Seeded numbers in ±size.
inline std::vector<double> numbers(size_t n, double size, std::uint64_t seed = 1) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> u(-size, size);
  std::vector<double> v(n);
  for (auto& x : v) x = u(rng);
  return v;
}

/// A configuration with unit quaternions.
inline std::vector<double> configuration(const mechanics::Mechanism& m, std::uint64_t seed = 1) {
  auto q = numbers(size_t(m.nq()), 0.5, seed);
  for (const auto& c : m.coordinates())
    if (c.kind == phs::BlockKind::rotation) {
      double n = 0;
      q[size_t(c.q)] += 1;
      for (int k = 0; k < 4; ++k) n += q[size_t(c.q + k)] * q[size_t(c.q + k)];
      for (int k = 0; k < 4; ++k) q[size_t(c.q + k)] /= std::sqrt(n);
    }
  return q;
}

}  // namespace porthos::bench
