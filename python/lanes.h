#pragma once
#include <array>
#include <span>
#include <vector>

#include "phs/scalars/scalar.h"

/// Evaluates one kernel for many states: eight at a time in SIMD lanes, the last few as one more
/// pack or singly. Lanes give the same bits as one state, so a batch equals its rows evaluated one
/// by one.
namespace porthos::python {

/// An array of rows: n numbers per state, null for an input that is not given.
template <class Number>
struct Table {
  Number* data = nullptr;
  size_t n = 0;
};
using Source = Table<const double>;
using Target = Table<double>;

/// Scratch of one call in packs, made once.
template <size_t I, size_t O>
class Lanes {
  static constexpr size_t W = 8;
  using Pack = phs::Pack8;

 public:
  Lanes(const std::array<Source, I>& in, const std::array<Target, O>& out) : in_(in), out_(out) {}

  /// f(in, out) with arrays of spans over T, for the scalars one and eight: `one` takes double,
  /// `eight` takes Pack8.
  template <class One, class Eight>
  void run(size_t rows, One&& one, Eight&& eight) {
    if (rows > 2) {
      size_t total = 0;
      for (const auto& s : in_) total += s.data ? s.n : 0;
      for (const auto& t : out_) total += t.n;
      packs_.resize(total);
    }
    std::array<std::span<const Pack>, I> in;
    std::array<std::span<Pack>, O> out;
    size_t at = 0;
    for (size_t k = 0; k < I; ++k)
      if (in_[k].data) {
        in[k] = {packs_.data() + at, in_[k].n};
        at += in_[k].n;
      }
    for (size_t k = 0; k < O; ++k) {
      out[k] = {packs_.data() + at, out_[k].n};
      at += out_[k].n;
    }
    size_t r = 0;
    for (; r + W <= rows; r += W) {
      load(r, W);
      eight(in, out);
      store(r, W, out);
    }
    if (rows - r > 2) {  // lanes beyond the last row repeat it
      load(r, rows - r);
      eight(in, out);
      store(r, rows - r, out);
      r = rows;
    }
    for (; r < rows; ++r) {
      std::array<std::span<const double>, I> a;
      std::array<std::span<double>, O> b;
      for (size_t k = 0; k < I; ++k)
        if (in_[k].data) a[k] = {in_[k].data + r * in_[k].n, in_[k].n};
      for (size_t k = 0; k < O; ++k) b[k] = {out_[k].data + r * out_[k].n, out_[k].n};
      one(a, b);
    }
  }

 private:
  // Rows become columns of four by four doubles at a time. Halves joined as they are loaded leave
  // one shuffle per vector.
  typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));
  typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));
  static Four join(const double* lo, const double* hi) {
    return __builtin_shufflevector(*reinterpret_cast<const Two*>(lo),
                                   *reinterpret_cast<const Two*>(hi), 0, 1, 2, 3);
  }
  static void transpose(const double* a, const double* b, const double* c, const double* d,
                        Four* r) {
    for (int k = 0; k < 4; k += 2) {
      const Four s = join(a + k, c + k), t = join(b + k, d + k);
      r[k] = __builtin_shufflevector(s, t, 0, 4, 2, 6);
      r[k + 1] = __builtin_shufflevector(s, t, 1, 5, 3, 7);
    }
  }
  static void put(double* p, const Four& v) { *reinterpret_cast<Four*>(p) = v; }

  /// Rows r ... r + count of the inputs into the packs; lanes beyond them repeat the last.
  void load(size_t r, size_t count) {
    static_assert(sizeof(Pack) == W * sizeof(double));
    auto* to = reinterpret_cast<double*>(packs_.data());
    for (const auto& s : in_) {
      if (!s.data) continue;
      const double* row[W];
      for (size_t l = 0; l < W; ++l) row[l] = s.data + (r + (l < count ? l : count - 1)) * s.n;
      size_t i = 0;
      for (; i + 4 <= s.n; i += 4, to += 4 * W)
        for (size_t half = 0; half < W; half += 4) {
          Four v[4];
          transpose(row[half] + i, row[half + 1] + i, row[half + 2] + i, row[half + 3] + i, v);
          for (size_t k = 0; k < 4; ++k) put(to + k * W + half, v[k]);
        }
      for (; i < s.n; ++i, to += W)
        for (size_t half = 0; half < W; half += 4)
          put(to + half, Four{row[half][i], row[half + 1][i], row[half + 2][i], row[half + 3][i]});
    }
  }
  /// The packs of the outputs into rows r ... r + count.
  void store(size_t r, size_t count, const std::array<std::span<Pack>, O>& out) {
    for (size_t k = 0; k < O; ++k) {
      const auto* from = reinterpret_cast<const double*>(out[k].data());
      const size_t n = out_[k].n;
      double* to = out_[k].data + r * n;
      size_t i = 0;
      if (count == W)
        for (; i + 4 <= n; i += 4, from += 4 * W)
          for (size_t half = 0; half < W; half += 4) {
            Four v[4];
            const double* f = from + half;
            transpose(f, f + W, f + 2 * W, f + 3 * W, v);
            for (size_t l = 0; l < 4; ++l) put(to + (half + l) * n + i, v[l]);
          }
      for (; i < n; ++i, from += W)
        for (size_t l = 0; l < count; ++l) to[l * n + i] = from[l];
    }
  }

  std::array<Source, I> in_;
  std::array<Target, O> out_;
  std::vector<Pack> packs_;
};

}  // namespace porthos::python
