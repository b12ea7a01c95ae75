#pragma once
#include <array>
#include <span>
#include <string>
#include <utility>

#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/plant.h"
#include "phs/scalars/derivative.h"
#include "phs/scalars/scalar.h"

/// Arms with elastic joints:  M(q) q'' + C q' + ∂V + D_q q' = K (θ - q),  B θ'' = u - K (θ - q),  K
/// and B diagonal. The arm itself is a form as Plant takes it (its inputs are not used): n
/// coordinates, mass, potential.
namespace porthos::energy_shaping {

/// An arm F with a spring between each joint and its motor.
template <class F>
struct ElasticJoints {
  F arm;
  std::array<double, size_t(F::n)> stiffness{};  ///< K [N m/rad], > 0
  std::array<double, size_t(F::n)> motor{};      ///< B [kg m²], > 0
};

/// (q, θ) as one form with 2n coordinates, inputs at the motors.
template <class F>
struct ElasticForm {
  static constexpr int n = 2 * F::n, m = F::n;
  static constexpr size_t N = size_t(F::n);
  ElasticJoints<F> j;
  double weight = 1;                       ///< of V: 0 if it is compensated
  std::array<double, N> spring{}, rest{};  ///< ½ spring (θ - rest)² on top
  std::string name = std::string(j.arm.name) + " with elastic joints";
  std::array<std::pair<std::string, std::string>, size_t(n)> coordinates = [this] {
    std::array<std::pair<std::string, std::string>, size_t(n)> c;
    for (size_t i = 0; i < N; ++i) {
      c[i] = {std::string(j.arm.coordinates[i].first), std::string(j.arm.coordinates[i].second)};
      c[N + i] = {c[i].first + ".motor", c[i].second};
    }
    return c;
  }();
  std::array<std::string, size_t(m)> inputs = [this] {
    std::array<std::string, size_t(m)> names;
    for (size_t i = 0; i < N; ++i) names[i] = coordinates[N + i].first;
    return names;
  }();

  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    std::array<S, N * N> own;
    j.arm.mass(q.first(N), std::span<S>(own));
    for (S& x : M) x = S(0.0);
    for (size_t a = 0; a < N; ++a) {
      for (size_t b = 0; b < N; ++b) M[a * 2 * N + b] = own[a * N + b];
      M[(N + a) * 2 * N + N + a] = S(j.motor[a]);
    }
  }
  template <class S>
  S potential(std::span<const S> q) const {
    S U = S(weight) * j.arm.potential(q.first(N));
    for (size_t a = 0; a < N; ++a) {
      const S phi = q[N + a] - q[a], off = q[N + a] - S(rest[a]);
      U = U + S(0.5 * j.stiffness[a]) * phi * phi + S(0.5 * spring[a]) * off * off;
    }
    return U;
  }
  template <class T>
  void input(std::span<const T>, std::span<T> G) const {
    for (T& g : G) g = T(0.0);
    for (size_t a = 0; a < N; ++a) G[(N + a) * N + a] = T(1.0);
  }
};

/// @throws InvalidArgument unless every stiffness and motor inertia is above 0
template <class F>
void check_elastic(const ElasticJoints<F>& j) {
  for (size_t a = 0; a < size_t(F::n); ++a)
    if (!(j.stiffness[a] > 0) || !(j.motor[a] > 0))
      throw InvalidArgument("elastic joint " + std::to_string(a) + " of '" +
                            std::string(j.arm.name) +
                            "' needs stiffness > 0 and motor inertia > 0, has " +
                            std::to_string(j.stiffness[a]) + " and " + std::to_string(j.motor[a]));
}

/// The plant, damping: of the links, then of the motors.
template <class F>
PlantPtr elastic_plant(const ElasticJoints<F>& j,
                       std::array<double, size_t(2 * F::n)> damping = {}) {
  check_elastic(j);
  return plant(ElasticForm<F>{.j = j}, damping);
}

/// ∂V/∂q of an arm.
template <class F>
std::array<double, size_t(F::n)> gravity_of(const F& arm, std::span<const double> q) {
  std::array<double, size_t(F::n)> g;
  std::array<phs::Dual, size_t(F::n)> x;
  phs::gradient_by_duals<double>([&](auto y) { return arm.potential(y); }, q, x, g);
  return g;
}

}  // namespace porthos::energy_shaping
