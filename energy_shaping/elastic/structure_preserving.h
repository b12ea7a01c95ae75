#pragma once
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "energy_shaping/elastic/elastic_plant.h"
#include "energy_shaping/loop/port_law.h"
#include "phs/scalars/derivative.h"

namespace porthos::energy_shaping {

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
    using D = phs::BasicDual<S>;
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
    phs::along_each(x, [&](size_t i) {
      j_.arm.mass(std::span<const D>(x), std::span<D>(dM));
      S bend(0.0);
      for (size_t k = 0; k < N; ++k)
        for (size_t l = 0; l < N; ++l) bend = bend + v[k] * dM[k * N + l].d * v[l];
      tau[i] = tau[i] - S(0.5) * bend + j_.arm.potential(std::span<const D>(x)).d;
    });
  }
  /// n, n', n'' along the motion of the plant.
  template <class T>
  void motion(std::span<const T> x, std::array<T, N>& n, std::array<T, N>& dn,
              std::array<T, N>& ddn) const {
    using D = phs::BasicDual<T>;
    using DD = phs::BasicDual<D>;
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
    // ∂V with two derivatives in time; the gradient by one dual more
    using G = phs::BasicDual<DD>;
    std::array<G, N> s;
    for (size_t i = 0; i < N; ++i) s[i] = G(DD(D(q[i], v[i]), D(v[i], a[i])));
    phs::along_each(s, [&](size_t i) {
      const DD g = j_.arm.potential(std::span<const G>(s)).d;
      const T d(g_.link_damping[i]);
      n[i] = g.v.v - d * v[i];
      dn[i] = g.v.d - d * a[i];
      ddn[i] = g.d.d - d * jerk[i];
    });
  }

  ElasticJoints<F> j_;
  Gains g_;
};

}  // namespace porthos::energy_shaping
