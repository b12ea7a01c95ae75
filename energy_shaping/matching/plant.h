#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "phs/linear_algebra/dense.h"
#include "phs/scalars/derivative.h"
#include "phs/system/user_model.h"

namespace porthos::energy_shaping {

/// A mechanical plant from its formulas, for plants that are no mechanism (for example a normal
/// form after an input change):
///
///   H = ½ pᵀM(q)⁻¹p + V(q),   p' = -∂H/∂q - D q' + G(q) u
///
/// F has  n, m (static constexpr int: coordinates, inputs),  coordinates (n names and units),
/// inputs (m names),
///   template <class S> void mass(std::span<const S> q, std::span<S> M) const;
///       n × n, row by row, constant where empty
///   template <class S> S potential(std::span<const S> q) const;
///   template <class T> void input(std::span<const T> q, std::span<T> G) const;
///       n × m, row by row
/// and name. Gradients are exact, by tangents. Ports "<input>.force" of size 1.
template <class F>
struct Plant {
  F form;
  std::array<double, size_t(F::n)> damping{};  ///< D, viscous

  static constexpr size_t n = size_t(F::n), m = size_t(F::m);

  phs::Description description() const {
    phs::Description d;
    d.name = form.name;
    d.nx = int(2 * n);
    d.nu = int(m);
    d.traits.canonical = d.traits.quadratic = true;
    for (const double c : damping) d.traits.lossless = d.traits.lossless && c == 0;
    for (int i = 0; i < F::n; ++i) {
      const auto& c = form.coordinates[size_t(i)];
      const std::string unit(c.second);
      d.blocks.push_back({std::string(c.first), phs::BlockKind::linear, i, 1, F::n + i, unit,
                          unit == "m" ? "kg m/s" : "kg m^2/s"});
    }
    for (int j = 0; j < F::m; ++j)
      d.ports.push_back({std::string(form.inputs[size_t(j)]) + ".force", phs::PortKind::effort_in,
                         1, j, "1", "1/s"});
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    std::array<T, n * n> M, L;
    std::array<T, n> v;
    form.mass(x.first(n), std::span<T>(M));
    phs::dense::cholesky(n, M.data(), L.data());
    phs::dense::solve(n, L.data(), x.data() + n, v.data());
    return T(0.5) * phs::dense::dot(n, v.data(), x.data() + n) + form.potential(x.first(n));
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    using S = phs::BasicDual<T>;
    std::array<T, n * n> M, L;
    form.mass(x.first(n), std::span<T>(M));
    phs::dense::cholesky(n, M.data(), L.data());
    phs::dense::solve(n, L.data(), x.data() + n, e.data() + n);
    std::array<S, n> q;
    std::array<S, n * n> dM;
    for (size_t i = 0; i < n; ++i) q[i] = S(x[i]);
    phs::along_each(q, [&](size_t k) {
      form.mass(std::span<const S>(q), std::span<S>(dM));
      T bend(0.0);
      for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j < n; ++j) bend = bend + e[n + i] * dM[i * n + j].d * e[n + j];
      e[k] = form.potential(std::span<const S>(q)).d - T(0.5) * bend;
    });
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    for (size_t i = 0; i < n; ++i) {
      Re[i] = T(0.0);
      Re[n + i] = T(damping[i]) * e[n + i];
    }
  }
  template <class T>
  void input(std::span<const T> x, std::span<const T> u, std::span<T> Gu) const {
    std::array<T, n * m> G;
    form.input(x.first(n), std::span<T>(G));
    for (size_t i = 0; i < n; ++i) Gu[i] = T(0.0);
    phs::dense::multiply(n, m, G.data(), u.data(), Gu.data() + n);
  }
};

/// The model of a form. damping: of each coordinate [N s/m | N m s/rad].
template <class F>
std::shared_ptr<const phs::Model> plant(F form, std::array<double, size_t(F::n)> damping = {}) {
  return std::make_shared<phs::UserModel<Plant<F>>>(Plant<F>{std::move(form), damping});
}

}  // namespace porthos::energy_shaping
