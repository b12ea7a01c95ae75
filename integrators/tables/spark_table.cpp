#include "integrators/tables/spark_table.h"

#include <span>

#include "integrators/tables/inverse.h"
#include "integrators/tables/legendre.h"

namespace porthos::integrators {
namespace {

using phs::Quad;
using Quads = std::vector<Quad>;

/// B_jk, row j - 1, column k.
Quads response_matrix(size_t s, const Quads& nu, const Quads& b) {
  Quads B;
  for (size_t j = 1; j <= s; ++j)
    for (size_t k = 0; k < s; ++k) {
      Quad sum = 0;
      for (size_t i = 0; i < s; ++i) sum += nu[j * s + i] * b[i] * (1 - nu[k * s + i]);
      B.push_back(sum);
    }
  return B;
}

template <class T>
std::vector<T> modes(const SparkTable<T>& t) {
  std::vector<Legendre<T>> at_node;
  for (const T c : t.node) at_node.emplace_back(t.s(), 2 * c - 1);
  std::vector<T> mode;
  for (int k = 0; k < t.s(); ++k) {
    T gamma(0.0);
    for (size_t l = 0; l < t.node.size(); ++l) gamma += t.weight[l] * at_node[l][k] * at_node[l][k];
    for (const auto& P : at_node) mode.push_back(P[k] / gamma);
  }
  return mode;
}

}  // namespace

template <class T>
SparkTable<T> spark_table(int s) {
  const auto lobatto = lobatto_table<Quad>(s + 1);
  const auto gauss = gauss_table<Quad>(s);
  const size_t n = size_t(s);
  SparkTable<T> t;
  t.gauss = gauss_table<T>(s);
  for (const Quad c : lobatto.c) t.node.push_back(T(c));
  for (const Quad b : lobatto.b) t.weight.push_back(T(b));
  Quads nu((n + 1) * n, Quad(0));
  for (size_t j = 0; j <= n; ++j) {
    const auto row = std::span(nu).subspan(j * n, n);
    if (j > 0) gauss.polynomial(lobatto.c[j], row);
    if (j == n) std::fill(row.begin(), row.end(), Quad(1));
    for (const Quad exact : row) {
      const bool large = exact >= Quad(0.5);  // the larger is rounded, the other is exact then
      const T rounded = large ? T(exact) : T(1 - exact), other = T(1.0) - rounded;
      t.nu.push_back(large ? rounded : other);
      t.rest.push_back(large ? other : rounded);
    }
  }
  for (const Quad x : inverse_of(n, response_matrix(n, nu, gauss.b))) t.response.push_back(T(x));
  t.mode = modes(t);
  return t;
}

#define PORTHOS_INSTANTIATE(T)   \
  template struct SparkTable<T>; \
  template SparkTable<T> spark_table<T>(int);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(Quad)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::integrators
