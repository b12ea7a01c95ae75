#pragma once
#include <vector>

#include "phs/system/resolvent.h"

namespace porthos::mechanics {

/// LU in place, with the diagonal inverted. No pivoting is needed, because N is near the identity
/// in δq and δp and similar to a mass matrix in δv.
inline void decompose(std::vector<phs::Complex4>& N, size_t n) {
  for (size_t k = 0; k < n; ++k) {
    N[k * n + k] = N[k * n + k].inverse();
    for (size_t r = k + 1; r < n; ++r) {
      const phs::Complex4 factor = N[r * n + k] = N[r * n + k] * N[k * n + k];
      for (size_t c = k + 1; c < n; ++c) N[r * n + c] -= factor * N[k * n + c];
    }
  }
}
inline void substitute(const std::vector<phs::Complex4>& N, size_t n,
                       std::vector<phs::Complex4>& u) {
  for (size_t r = 0; r < n; ++r)
    for (size_t k = 0; k < r; ++k) u[r] -= N[r * n + k] * u[k];
  for (size_t r = n; r-- > 0;) {
    for (size_t k = r + 1; k < n; ++k) u[r] -= N[r * n + k] * u[k];
    u[r] = u[r] * N[r * n + r];
  }
}

}  // namespace porthos::mechanics
