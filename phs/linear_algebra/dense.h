#pragma once
#include <cstddef>

#include "phs/scalars/scalar.h"

/// Small dense row-major matrices of any scalar, for kernels: no branch on a T, no allocation.
namespace porthos::phs::dense {

/// A = L Lᵀ; reads the lower triangle of A. A matrix that is not positive definite gives NaN.
template <class T>
void cholesky(std::size_t n, const T* A, T* L) {
  using phs::sqrt;
  for (std::size_t j = 0; j < n; ++j) {
    T d = A[j * n + j];
    for (std::size_t k = 0; k < j; ++k) d = d - L[j * n + k] * L[j * n + k];
    L[j * n + j] = sqrt(d);
    for (std::size_t i = j + 1; i < n; ++i) {
      T s = A[i * n + j];
      for (std::size_t k = 0; k < j; ++k) s = s - L[i * n + k] * L[j * n + k];
      L[i * n + j] = s / L[j * n + j];
    }
  }
}

/// x = (L Lᵀ)⁻¹ b; x may alias b.
template <class T>
void solve(std::size_t n, const T* L, const T* b, T* x) {
  for (std::size_t i = 0; i < n; ++i) {
    T s = b[i];
    for (std::size_t k = 0; k < i; ++k) s = s - L[i * n + k] * x[k];
    x[i] = s / L[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    T s = x[i];
    for (std::size_t k = i + 1; k < n; ++k) s = s - L[k * n + i] * x[k];
    x[i] = s / L[i * n + i];
  }
}

/// y = A x.
template <class T>
void multiply(std::size_t rows, std::size_t cols, const T* A, const T* x, T* y) {
  for (std::size_t i = 0; i < rows; ++i) {
    T s(0.0);
    for (std::size_t k = 0; k < cols; ++k) s = s + A[i * cols + k] * x[k];
    y[i] = s;
  }
}

/// y = Aᵀ x, A rows × cols.
template <class T>
void multiply_transposed(std::size_t rows, std::size_t cols, const T* A, const T* x, T* y) {
  for (std::size_t j = 0; j < cols; ++j) {
    T s(0.0);
    for (std::size_t k = 0; k < rows; ++k) s = s + A[k * cols + j] * x[k];
    y[j] = s;
  }
}

/// C = A B.
template <class T>
void multiply(std::size_t n, std::size_t m, std::size_t l, const T* A, const T* B, T* C) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < l; ++j) {
      T s(0.0);
      for (std::size_t k = 0; k < m; ++k) s = s + A[i * m + k] * B[k * l + j];
      C[i * l + j] = s;
    }
}

/// aᵀb.
template <class T>
T dot(std::size_t n, const T* a, const T* b) {
  T s(0.0);
  for (std::size_t i = 0; i < n; ++i) s = s + a[i] * b[i];
  return s;
}

/// aᵀ A b, A n × n.
template <class T>
T form(std::size_t n, const T* a, const T* A, const T* b) {
  T s(0.0);
  for (std::size_t i = 0; i < n; ++i) s = s + a[i] * dot(n, A + i * n, b);
  return s;
}

}  // namespace porthos::phs::dense
