#pragma once
#include <random>

#include "phs/linear/linear_system.h"

/// Linear port-Hamiltonian systems with known transfer functions, and random ones.
namespace porthos::test {

/// `masses` in a row, springs k between neighbours and from the last to a wall, a damper c at each;
/// forces on the first two. x = (q1, p1, q2, p2, ...). Gugercin, Polyuga, Beattie, van der Schaft,
/// Automatica 48, 2012.
inline phs::LinearSystem mass_spring_damper_chain(int masses = 50, double m = 4, double k = 4,
                                                  double c = 1) {
  const int n = 2 * masses;
  phs::LinearMatrices s{.J = {n, n}, .R = {n, n}, .Q = {n, n}, .G = {n, 2}};
  for (int i = 0; i < masses; ++i) {
    const int q = 2 * i, p = q + 1;
    s.J(q, p) = 1;
    s.J(p, q) = -1;
    s.R(p, p) = c;
    s.Q(p, p) = 1 / m;
    s.Q(q, q) += k;
    if (i + 1 < masses) {
      s.Q(q + 2, q + 2) += k;
      s.Q(q, q + 2) = s.Q(q + 2, q) = -k;
    }
  }
  s.G(1, 0) = s.G(3, 1) = 1;
  return phs::LinearSystem(s, "mass-spring-damper chain");
}

/// Capacitors to ground and coils with resistors in turn, fed by a current at the first capacitor;
/// the last coil ends in the load. x = (charge, flux, charge, flux, ...). Polyuga, van der Schaft,
/// Automatica 46, 2010.
inline phs::LinearSystem rcl_ladder(int cells = 50, double R = 0.2, double load = 0.4, double C = 1,
                                    double L = 1) {
  const int n = 2 * cells;
  phs::LinearMatrices s{.J = {n, n}, .R = {n, n}, .Q = {n, n}, .G = {n, 1}};
  for (int i = 0; i < n; ++i) {
    if (i + 1 < n) {
      s.J(i, i + 1) = -1;
      s.J(i + 1, i) = 1;
    }
    s.Q(i, i) = i % 2 ? 1 / L : 1 / C;
    if (i % 2) s.R(i, i) = R;
  }
  s.R(n - 1, n - 1) += load;
  s.G(0, 0) = 1;
  return phs::LinearSystem(s, "RCL ladder");
}

struct DcMotor {
  double La = 0.01, Ra = 0.5, k = 0.05, Jm = 2e-4, b = 1e-4;

  /// x = (flux, angular momentum), driven by a voltage.
  phs::LinearSystem system() const {
    return phs::LinearSystem({.J = {{0, -k}, {k, 0}},
                              .R = {{Ra, 0}, {0, b}},
                              .Q = {{1 / La, 0}, {0, 1 / Jm}},
                              .G = {{1}, {0}}},
                             "DC motor");
  }
  std::complex<double> transfer(std::complex<double> s) const {
    return (Jm * s + b) / ((La * s + Ra) * (Jm * s + b) + k * k);
  }
};

/// Every matrix full but Q, which is diagonal: random J, N, W = LLᵀ of the given rank (0: full),
/// EᵀQ > 0.
inline phs::LinearMatrices random_matrices(std::mt19937_64& rng, int n, int m, int rank = 0) {
  std::normal_distribution<double> number;
  const auto random = [&](int rows, int cols) {
    phs::Matrix M(rows, cols);
    for (double& x : M.a) x = number(rng);
    return M;
  };
  const auto gram = [](const phs::Matrix& M) {
    phs::Matrix out(M.rows, M.rows);
    for (int i = 0; i < M.rows; ++i)
      for (int j = 0; j < M.rows; ++j)
        for (int k = 0; k < M.cols; ++k) out(i, j) += M(i, k) * M(j, k) / M.cols;
    return out;
  };
  const auto skew = [&](int size) {
    phs::Matrix M(size, size);
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < i; ++j) {
        M(i, j) = number(rng);
        M(j, i) = -M(i, j);
      }
    return M;
  };
  phs::LinearMatrices s{.E = {n, n},
                        .J = skew(n),
                        .R = {n, n},
                        .Q = {n, n},
                        .G = random(n, m),
                        .P = {n, m},
                        .S = {m, m},
                        .N = skew(m)};
  const phs::Matrix W = gram(random(n + m, rank ? rank : n + m)), K = gram(random(n, 2 * n));
  for (int i = 0; i < n; ++i) {
    s.Q(i, i) = std::exp(0.5 * number(rng));
    for (int j = 0; j < n; ++j) {
      s.R(i, j) = W(i, j);
      s.E(i, j) = K(i, j) / s.Q(i, i);
    }
    for (int j = 0; j < m; ++j) s.P(i, j) = W(i, n + j);
  }
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j) s.S(i, j) = W(n + i, n + j);
  return s;
}

}  // namespace porthos::test
