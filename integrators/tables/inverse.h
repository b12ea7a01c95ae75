#pragma once
#include <utility>
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::integrators {

/// The inverse of an n × n row-major matrix, by elimination with row exchange.
inline std::vector<phs::Quad> inverse_of(size_t n, std::vector<phs::Quad> a) {
  using phs::Quad;
  std::vector<Quad> b(n * n, Quad(0));
  for (size_t i = 0; i < n; ++i) b[i * n + i] = 1;
  for (size_t k = 0; k < n; ++k) {
    size_t best = k;
    for (size_t i = k; i < n; ++i)
      if (phs::abs(a[i * n + k]) > phs::abs(a[best * n + k])) best = i;
    for (size_t j = 0; j < n; ++j) {
      std::swap(a[k * n + j], a[best * n + j]);
      std::swap(b[k * n + j], b[best * n + j]);
    }
    const Quad pivot = a[k * n + k];
    for (size_t j = 0; j < n; ++j) {
      a[k * n + j] /= pivot;
      b[k * n + j] /= pivot;
    }
    for (size_t i = 0; i < n; ++i) {
      const Quad factor = a[i * n + k];
      if (i == k || factor == 0) continue;
      for (size_t j = 0; j < n; ++j) {
        a[i * n + j] -= factor * a[k * n + j];
        b[i * n + j] -= factor * b[k * n + j];
      }
    }
  }
  return b;
}

}  // namespace porthos::integrators
