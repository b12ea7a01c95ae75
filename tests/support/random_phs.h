#pragma once
#include <random>
#include <string>
#include <vector>

#include "phs/system/user_model.h"

namespace porthos::test {

/// A random nonlinear port-Hamiltonian system: H = ½ xᵀQx + ¼ Σ q_i x_i⁴, constant J, R of rank
/// one, one port of each kind.
struct RandomSystem {
  int n, ports;
  std::vector<double> L, q, J, r, G;
  bool lossless;

  RandomSystem(unsigned seed, int states, int port_count, bool is_lossless = false)
      : n(states), ports(port_count), lossless(is_lossless) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    const auto fill = [&](std::vector<double>& v, int size) {
      v.resize(size_t(size));
      for (auto& x : v) x = normal(generator);
    };
    fill(L, n * n);
    fill(q, n);
    fill(J, n * n);
    fill(r, n);
    fill(G, n * ports);
    for (auto& x : q) x *= x;
  }
  phs::Description description() const {
    phs::Description d;
    d.name = "random";
    d.nx = n;
    d.nu = ports;
    d.blocks = {{"x", phs::BlockKind::linear, 0, n, -1, "", ""}};
    for (int k = 0; k < ports; ++k)
      d.ports.push_back({"port_" + std::to_string(k),
                         k % 2 ? phs::PortKind::flow_in : phs::PortKind::effort_in, 1, k, "", ""});
    d.traits.lossless = lossless;
    return d;
  }
  double at(const std::vector<double>& m, int i, int j) const { return m[size_t(i * n + j)]; }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    T H(0.0);
    for (int i = 0; i < n; ++i) {
      T Lx(0.0);
      for (int j = 0; j < n; ++j) Lx = Lx + T(at(L, i, j)) * x[size_t(j)];
      const T x2 = x[size_t(i)] * x[size_t(i)];
      H = H + T(0.5) * Lx * Lx + T(0.25 * q[size_t(i)]) * x2 * x2;
    }
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    for (int i = 0; i < n; ++i)
      e[size_t(i)] = T(q[size_t(i)]) * x[size_t(i)] * x[size_t(i)] * x[size_t(i)];
    for (int i = 0; i < n; ++i) {
      T Lx(0.0);
      for (int j = 0; j < n; ++j) Lx = Lx + T(at(L, i, j)) * x[size_t(j)];
      for (int j = 0; j < n; ++j) e[size_t(j)] = e[size_t(j)] + T(at(L, i, j)) * Lx;
    }
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T> e, std::span<T> Je) const {
    for (int i = 0; i < n; ++i) {
      T sum(0.0);
      for (int j = 0; j < n; ++j) sum = sum + T(at(J, i, j) - at(J, j, i)) * e[size_t(j)];
      Je[size_t(i)] = sum;
    }
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    T along(0.0);
    for (int i = 0; i < n; ++i) along = along + T(r[size_t(i)]) * e[size_t(i)];
    for (int i = 0; i < n; ++i) Re[size_t(i)] = T(lossless ? 0.0 : r[size_t(i)]) * along;
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    for (int i = 0; i < n; ++i) {
      T sum(0.0);
      for (int k = 0; k < ports; ++k) sum = sum + T(G[size_t(i * ports + k)]) * u[size_t(k)];
      Gu[size_t(i)] = sum;
    }
  }
};

}  // namespace porthos::test
