#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/elastic/elastic_plant.h"
#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/shaping.h"

namespace porthos::energy_shaping {

/// Gains of regulators of elastic joints, diagonal.
template <class F>
struct ElasticGains {
  std::array<double, size_t(F::n)> rest{};      ///< q_d
  std::array<double, size_t(F::n)> kp{}, kd{};  ///< at the motors
  std::array<double, size_t(F::n)>
      motor{};  ///< B_d; 0: as the plant's, which needs no torque sensor
};

/// Motor PD with constant gravity (Tomei 1991), with torque feedback that makes the motors B_d
/// light (after Ott, Albu-Schäffer, Kugi, Hirzinger 2008, with constant gravity): as an energy
/// shaping,
///   M_d = diag(M, B B_d⁻¹ B),  V_d = V + ½ φᵀKφ + ½ (θ - θ_d)ᵀKp(θ - θ_d) - g(q_d)ᵀθ,
///   θ_d = q_d + K⁻¹g(q_d).
template <class F>
struct MotorSide {
  static constexpr int n = 2 * F::n;
  static constexpr size_t N = size_t(F::n);
  ElasticForm<F> form;
  ElasticGains<F> gain;
  std::string name = "motor PD with torque feedback";
  std::array<double, N> g = gravity_of(form.j.arm, gain.rest);

  double target_motor(size_t a) const {
    return gain.motor[a] > 0 ? gain.motor[a] : form.j.motor[a];
  }
  double theta(size_t a) const { return gain.rest[a] + g[a] / form.j.stiffness[a]; }
  std::vector<Gain> gains() const {
    std::vector<Gain> list;
    for (const double k : gain.kp) list.push_back({"kp", k});
    for (const double k : gain.kd) list.push_back({"kd", k});
    return list;
  }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    form.mass(q, Md);
    for (size_t a = 0; a < N; ++a)
      Md[(N + a) * 2 * N + N + a] = S(form.j.motor[a] / target_motor(a) * form.j.motor[a]);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    S V = form.potential(q);
    for (size_t a = 0; a < N; ++a) {
      const S off = q[N + a] - S(theta(a));
      V = V + S(0.5) * S(k[a]) * off * off - S(g[a]) * q[N + a];
    }
    return V;
  }
  template <class T>
  void damping(std::span<const T>, std::span<const T> k, std::span<T> Kv) const {
    // u = (B/B_d) u' + ...: in ∂H_d/∂p_θ = (B_d/B) θ' the motor's damping kd of u' reads kd
    // (B/B_d)².
    for (T& y : Kv) y = T(0.0);
    for (size_t a = 0; a < N; ++a) {
      const double r = form.j.motor[a] / target_motor(a);
      Kv[a * N + a] = T(r * r) * k[N + a];
    }
  }
};

/// @throws InvalidArgument if V_d has no minimum at the rest point: Kp and K must exceed the
/// Hessian of V
template <class F>
LoopPtr motor_side(const ElasticJoints<F>& j, const ElasticGains<F>& gain,
                   std::array<double, size_t(2 * F::n)> damping = {}) {
  check_elastic(j);
  const MotorSide<F> design{.form = {.j = j}, .gain = gain};
  MatchingOptions o;
  std::vector<double> rest;
  std::vector<std::string> ports;
  for (size_t a = 0; a < MotorSide<F>::N; ++a) rest.push_back(gain.rest[a]);
  for (size_t a = 0; a < MotorSide<F>::N; ++a) {
    rest.push_back(design.theta(a));
    ports.push_back(design.form.inputs[a] + ".force");
  }
  for (const double q : rest) {
    o.region.lower.push_back(q - 2);
    o.region.upper.push_back(q + 2);
  }
  return std::make_shared<MatchedLoop>(elastic_plant(j, damping), shaping(design), ports, rest, o);
}

}  // namespace porthos::energy_shaping
