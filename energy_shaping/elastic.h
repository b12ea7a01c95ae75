#pragma once
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "energy_shaping/designs.h"
#include "energy_shaping/plant.h"
#include "energy_shaping/port_law.h"
#include "energy_shaping/shaping.h"

/// Arms with elastic joints:  M(q) q'' + C q' + ∂V + D_q q' = K (θ - q),  B θ'' = u - K (θ - q),  K
/// and B diagonal. The arm itself is a form as Plant takes it (its inputs are not used): n
/// coordinates, mass, potential.
namespace porthos::energy_shaping {

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
  double weight = 1;                       ///< of V: 0 where it is compensated
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
  std::array<phs::Tangent<double>, size_t(F::n)> x;
  for (size_t i = 0; i < x.size(); ++i) x[i] = phs::Tangent<double>(q[i]);
  for (size_t i = 0; i < x.size(); ++i) {
    x[i].d = 1;
    g[i] = arm.potential(std::span<const phs::Tangent<double>>(x)).d;
    x[i].d = 0;
  }
  return g;
}

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

/// @throws InvalidArgument where V_d has no minimum at the rest point: Kp and K must exceed the
///   Hessian of V
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

/// Elastic-structure-preserving regulation and link damping (Keppler, Lakatos, Ott, Albu-Schäffer
/// 2018): with n = ∂V - D q' and η = θ - K⁻¹n the law u = u' + n + B K⁻¹n'', u' = -Ke (η - q_d) -
/// De η', leaves an elastic arm
///   M q'' + C q' = K (η - q) - D q',   B η'' = -K (η - q) + u'
/// without gravity, with damping at its links. K and B stay as they are; q'' and q''' come from the
/// model. The physical plant is taken without friction of its links.
template <class F>
class ElasticStructurePreserving {
  static constexpr size_t N = size_t(F::n);

 public:
  struct Gains {
    std::array<double, N> rest{};          ///< q_d
    std::array<double, N> link_damping{};  ///< D
    std::array<double, N> stiffness{};     ///< Ke
    std::array<double, N> damping{};       ///< De
  };
  ElasticStructurePreserving(ElasticJoints<F> joints, Gains gains)
      : j_(std::move(joints)), g_(gains) {
    check_elastic(j_);
    for (size_t a = 0; a < N; ++a)
      if (!(g_.link_damping[a] >= 0) || !(g_.stiffness[a] > 0) || !(g_.damping[a] >= 0))
        throw InvalidArgument(
            "elastic-structure-preserving regulation needs D >= 0, Ke > 0, De >= 0");
  }

  /// The closed loop in z = (q, η, p, B η'): a port-Hamiltonian system with H_d = T + ½
  /// (η-q)ᵀK(η-q) + ½ |η - q_d|²_Ke.
  PlantPtr target() const {
    std::array<double, 2 * N> damping{};
    for (size_t a = 0; a < N; ++a) {
      damping[a] = g_.link_damping[a];
      damping[N + a] = g_.damping[a];
    }
    ElasticForm<F> form{.j = j_, .weight = 0, .spring = g_.stiffness, .rest = g_.rest};
    form.name += ", structure preserved";
    return plant(form, damping);
  }
  PlantPtr plant_model() const { return elastic_plant(j_); }

  /// z of the plant's state x = (q, θ, p, B θ').
  template <class T>
  void to_target(std::span<const T> x, std::span<T> z) const {
    std::array<T, N> n, dn, ddn;
    motion(x, n, dn, ddn);
    for (size_t a = 0; a < N; ++a) {
      const T K(j_.stiffness[a]), B(j_.motor[a]);
      z[a] = x[a];
      z[2 * N + a] = x[2 * N + a];
      z[N + a] = x[N + a] - n[a] / K;
      z[3 * N + a] = x[3 * N + a] - B * dn[a] / K;
    }
  }
  /// u, n numbers.
  template <class T>
  void law(std::span<const T> x, std::span<T> u) const {
    std::array<T, N> n, dn, ddn;
    motion(x, n, dn, ddn);
    for (size_t a = 0; a < N; ++a) {
      const T K(j_.stiffness[a]), B(j_.motor[a]);
      const T eta = x[N + a] - n[a] / K, rate = x[3 * N + a] / B - dn[a] / K;
      u[a] = n[a] + B * ddn[a] / K - T(g_.stiffness[a]) * (eta - T(g_.rest[a])) -
             T(g_.damping[a]) * rate;
    }
  }

  /// The law as controllers of the motors' ports, for a network with plant_model() (port_law.h).
  std::vector<PortLaw> port_laws() const {
    std::vector<int> all(N);
    for (size_t a = 0; a < N; ++a) all[a] = int(a);
    return energy_shaping::port_laws(Source{*this}, plant_model()->description(), all);
  }

  /// The plant under the law, for any integrator; energy: the plant's.
  std::shared_ptr<const phs::Model> under_law() const {
    return std::make_shared<phs::UserModel<UnderLaw>>(
        UnderLaw{{ElasticForm<F>{.j = j_}, {}}, *this});
  }

 private:
  struct Source {
    ElasticStructurePreserving esp;
    template <class T>
    auto evaluator() const {
      return [esp = esp](T, std::span<const T> x, std::span<T> u) { esp.law(x, u); };
    }
  };
  struct UnderLaw : Plant<ElasticForm<F>> {
    ElasticStructurePreserving esp;
    phs::Description description() const {
      auto d = Plant<ElasticForm<F>>::description();
      d.name += " under the structure-preserving law";
      d.traits.canonical = false;
      return d;
    }
    template <class T>
    void structure(std::span<const T>, std::span<const T> e, std::span<T> Je) const {
      for (size_t i = 0; i < 2 * N; ++i) {
        Je[i] = e[2 * N + i];
        Je[2 * N + i] = -e[i];
      }
    }
    template <class T>
    void drive(T, std::span<const T> x, std::span<T> dx) const {
      std::array<T, N> u;
      esp.law(x, std::span<T>(u));
      for (size_t a = 0; a < N; ++a) dx[3 * N + a] = dx[3 * N + a] + u[a];
    }
  };

  /// τ = M(q) a + M'v - ½ ∂(vᵀMv) + ∂V.
  template <class S>
  void inverse_dynamics(const std::array<S, N>& q, const std::array<S, N>& v,
                        const std::array<S, N>& a, std::array<S, N>& tau) const {
    using D = phs::Tangent<S>;
    std::array<S, N * N> M;
    std::array<D, N> x;
    std::array<D, N * N> dM;
    j_.arm.mass(std::span<const S>(q), std::span<S>(M));
    for (size_t i = 0; i < N; ++i) x[i] = D(q[i], v[i]);
    j_.arm.mass(std::span<const D>(x), std::span<D>(dM));
    for (size_t i = 0; i < N; ++i) {
      tau[i] = S(0.0);
      for (size_t k = 0; k < N; ++k) tau[i] = tau[i] + M[i * N + k] * a[k] + dM[i * N + k].d * v[k];
    }
    for (size_t i = 0; i < N; ++i) x[i] = D(q[i]);
    for (size_t i = 0; i < N; ++i) {
      x[i].d = S(1.0);
      j_.arm.mass(std::span<const D>(x), std::span<D>(dM));
      S bend(0.0);
      for (size_t k = 0; k < N; ++k)
        for (size_t l = 0; l < N; ++l) bend = bend + v[k] * dM[k * N + l].d * v[l];
      tau[i] = tau[i] - S(0.5) * bend + j_.arm.potential(std::span<const D>(x)).d;
      x[i].d = S(0.0);
    }
  }
  /// n, n', n'' along the motion of the plant.
  template <class T>
  void motion(std::span<const T> x, std::array<T, N>& n, std::array<T, N>& dn,
              std::array<T, N>& ddn) const {
    using D = phs::Tangent<T>;
    using DD = phs::Tangent<D>;
    std::array<T, N> q, v, a, jerk, zero, tau;
    std::array<T, N * N> M, L;
    for (size_t i = 0; i < N; ++i) {
      q[i] = x[i];
      zero[i] = T(0.0);
    }
    j_.arm.mass(std::span<const T>(q), std::span<T>(M));
    phs::dense::cholesky(N, M.data(), L.data());
    phs::dense::solve(N, L.data(), x.data() + 2 * N, v.data());
    inverse_dynamics(q, v, zero, tau);
    for (size_t i = 0; i < N; ++i) tau[i] = T(j_.stiffness[i]) * (x[N + i] - q[i]) - tau[i];
    phs::dense::solve(N, L.data(), tau.data(), a.data());
    // d/dt of M a + ... = K (θ - q)
    std::array<D, N> qd, vd, ad, td;
    for (size_t i = 0; i < N; ++i) {
      qd[i] = D(q[i], v[i]);
      vd[i] = D(v[i], a[i]);
      ad[i] = D(a[i]);
    }
    inverse_dynamics(qd, vd, ad, td);
    for (size_t i = 0; i < N; ++i)
      tau[i] = T(j_.stiffness[i]) * (x[3 * N + i] / T(j_.motor[i]) - v[i]) - td[i].d;
    phs::dense::solve(N, L.data(), tau.data(), jerk.data());
    // ∂V with two derivatives in time; the gradient by one tangent more
    using G = phs::Tangent<DD>;
    std::array<G, N> s;
    for (size_t i = 0; i < N; ++i) s[i] = G(DD(D(q[i], v[i]), D(v[i], a[i])));
    for (size_t i = 0; i < N; ++i) {
      s[i].d = DD(1.0);
      const DD g = j_.arm.potential(std::span<const G>(s)).d;
      s[i].d = DD(0.0);
      const T d(g_.link_damping[i]);
      n[i] = g.v.v - d * v[i];
      dn[i] = g.v.d - d * a[i];
      ddn[i] = g.d.d - d * jerk[i];
    }
  }

  ElasticJoints<F> j_;
  Gains g_;
};

}  // namespace porthos::energy_shaping
