#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "phs/system/user_model.h"
#include "tests/support/kepler.h"

/// Plain Hamiltonian systems with a literature of their own. All are canonical, lossless and
/// separable.
namespace porthos::test {

inline phs::Description separable_description(const std::string& name, int freedoms) {
  phs::Description d;
  d.name = name;
  d.nx = 2 * freedoms;
  d.blocks = {{"q", phs::BlockKind::linear, 0, freedoms, freedoms, "1", "1"}};
  d.traits = {.canonical = true, .separable = true};
  return d;
}

/// Bodies that attract each other in space: H = Σ |p_i|²/2m_i - G Σ m_i m_j / |q_i - q_j|.
struct GravitatingBodies {
  double G;
  std::vector<double> m;

  phs::Description description() const {
    auto d = separable_description("gravitating bodies", 3 * int(m.size()));
    d.invariants = {{"linear_momentum", 3, 0, 1, "1"}, {"angular_momentum", 3, 3, 2, "1"}};
    return d;
  }
  template <class T>
  void invariants(std::span<const T> x, std::span<T> values) const {
    const size_t n = 3 * m.size();
    for (auto& v : values) v = T(0.0);
    for (size_t i = 0; i < n; i += 3)
      for (size_t a = 0; a < 3; ++a) {
        const size_t b = (a + 1) % 3, c = (a + 2) % 3;
        values[a] = values[a] + x[n + i + a];
        values[3 + a] = values[3 + a] + (x[i + b] * x[n + i + c] - x[i + c] * x[n + i + b]);
      }
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    using phs::sqrt;
    const size_t N = m.size(), n = 3 * N;
    T H(0.0);
    for (size_t i = 0; i < N; ++i) {
      const T *q = &x[3 * i], *p = &x[n + 3 * i];
      H = H + (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) / T(2 * m[i]);
      for (size_t j = 0; j < i; ++j) {
        const T *o = &x[3 * j], d[3] = {q[0] - o[0], q[1] - o[1], q[2] - o[2]};
        H = H - T(G * m[i] * m[j]) / sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      }
    }
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    using phs::sqrt;
    const size_t N = m.size(), n = 3 * N;
    for (size_t i = 0; i < n; ++i) {
      e[i] = T(0.0);
      e[n + i] = x[n + i] / T(m[i / 3]);
    }
    for (size_t i = 0; i < N; ++i)
      for (size_t j = 0; j < i; ++j) {
        const T *q = &x[3 * i], *o = &x[3 * j], d[3] = {q[0] - o[0], q[1] - o[1], q[2] - o[2]};
        const T r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        const T k = T(G * m[i] * m[j]) / (r2 * sqrt(r2));
        for (size_t a = 0; a < 3; ++a) {
          const T f = k * d[a];
          e[3 * i + a] = e[3 * i + a] + f;
          e[3 * j + a] = e[3 * j + a] - f;
        }
      }
  }
};

/// Fermi, Pasta, Ulam 1955 with alternating stiff linear and soft cubic springs, in the coordinates
/// of Hairer, Lubich, Wanner 2006, I.5.1: q = (centres, lengths) of `m` stiff springs.
///   H = ½|p|² + ω²/2 Σ q_{m+i}² + ¼ [(q_1 - q_{m+1})⁴ + Σ (q_{i+1} - q_{m+i+1} - q_i - q_{m+i})⁴ +
///   (q_m + q_{2m})⁴]
struct FermiPastaUlam {
  static constexpr size_t m = 3;
  double omega = 50;

  phs::Description description() const {
    return separable_description("Fermi-Pasta-Ulam", 2 * int(m));
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    T H(0.0);
    for (size_t i = 0; i < 2 * m; ++i) H = H + T(0.5) * x[2 * m + i] * x[2 * m + i];
    for (size_t i = 0; i < m; ++i) H = H + T(0.5 * omega * omega) * x[m + i] * x[m + i];
    for (size_t i = 0; i <= m; ++i) {
      const T s = stretch(x, i), s2 = s * s;
      H = H + T(0.25) * s2 * s2;
    }
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    for (size_t i = 0; i < 2 * m; ++i) e[2 * m + i] = x[2 * m + i];
    for (size_t i = 0; i < m; ++i) {
      e[i] = T(0.0);
      e[m + i] = T(omega * omega) * x[m + i];
    }
    for (size_t i = 0; i <= m; ++i) {
      const T s = stretch(x, i), f = s * s * s;
      if (i < m) {
        e[i] = e[i] + f;
        e[m + i] = e[m + i] - f;
      }
      if (i > 0) {
        e[i - 1] = e[i - 1] - f;
        e[m + i - 1] = e[m + i - 1] - f;
      }
    }
  }
  /// Energy of stiff spring i.
  template <class T>
  T oscillatory(std::span<const T> x, size_t i) const {
    return T(0.5) * (x[3 * m + i] * x[3 * m + i] + T(omega * omega) * x[m + i] * x[m + i]);
  }

 private:
  /// of soft spring i, 0 … m; the walls hold the first and the last
  template <class T>
  T stretch(std::span<const T> x, size_t i) const {
    T s(0.0);
    if (i < m) s = s + x[i] - x[m + i];
    if (i > 0) s = s - x[i - 1] - x[m + i - 1];
    return s;
  }
};

/// A unit mass on a spring of unit length and frequency omega in the plane, unit gravity along -y.
///   H = ½|p|² + ω²/2 (|q| - 1)² + q_y
struct SpringPendulum {
  double omega;

  phs::Description description() const { return separable_description("spring pendulum", 2); }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    using phs::sqrt;
    const T s = sqrt(x[0] * x[0] + x[1] * x[1]) - T(1.0);
    return T(0.5) * (x[2] * x[2] + x[3] * x[3]) + T(0.5 * omega * omega) * s * s + x[1];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    using phs::sqrt;
    const T k = T(omega * omega) * (T(1.0) - T(1.0) / sqrt(x[0] * x[0] + x[1] * x[1]));
    e[0] = k * x[0];
    e[1] = k * x[1] + T(1.0);
    e[2] = x[2];
    e[3] = x[3];
  }
};

}  // namespace porthos::test
