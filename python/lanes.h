#pragma once
#include <array>
#include <span>
#include <vector>

#include "phs/scalar.h"

/// Many states through one kernel: eight at a time in SIMD lanes, the last few as one more pack or singly. Lanes give the
/// bits of one state, so that a batch equals its rows evaluated one by one.
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
  Lanes(const std::array<Source, I>& in, const std::array<Target, O>& out) : in_(in), out_(out) {
    size_t total = 0;
    for (const auto& s : in_) total += s.data ? s.n : 0;
    for (const auto& t : out_) total += t.n;
    packs_.resize(total);
  }

  /// f(in, out) with arrays of spans over T, for the scalars one and eight: `one` takes double, `eight` takes Pack8.
  template <class One, class Eight>
  void run(size_t rows, One&& one, Eight&& eight) {
    std::array<std::span<const Pack>, I> in;
    std::array<std::span<Pack>, O> out;
    size_t at = 0;
    for (size_t k = 0; k < I; ++k)
      if (in_[k].data) in[k] = {packs_.data() + at, in_[k].n}, at += in_[k].n;
    for (size_t k = 0; k < O; ++k) out[k] = {packs_.data() + at, out_[k].n}, at += out_[k].n;
    size_t r = 0;
    for (; r + W <= rows; r += W) {
      load<W>(r, W);
      eight(in, out);
      store<W>(r, W, out);
    }
    if (rows - r > 2) {  // lanes beyond the last row repeat it
      load<0>(r, rows - r);
      eight(in, out);
      store<0>(r, rows - r, out);
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
  template <size_t fixed>
  void load(size_t r, size_t count) {
    Pack* to = packs_.data();
    for (const auto& s : in_) {
      if (!s.data) continue;
      const double* row[W];
      for (size_t l = 0; l < W; ++l)
        row[l] = s.data + (r + (fixed || l < count ? l : count - 1)) * s.n;
      for (size_t i = 0; i < s.n; ++i, ++to) {
        alignas(64) double v[W];
        for (size_t l = 0; l < W; ++l) v[l] = row[l][i];
        static_assert(sizeof v == sizeof *to);
        __builtin_memcpy(static_cast<void*>(to), v, sizeof v);
      }
    }
  }
  template <size_t fixed>
  void store(size_t r, size_t count, const std::array<std::span<Pack>, O>& out) {
    for (size_t k = 0; k < O; ++k) {
      double* to = out_[k].data + r * out_[k].n;
      const size_t n = out_[k].n, lanes = fixed ? fixed : count;
      for (size_t i = 0; i < n; ++i) {
        alignas(64) double v[W];
        __builtin_memcpy(v, static_cast<const void*>(&out[k][i]), sizeof v);
        for (size_t l = 0; l < lanes; ++l) to[l * n + i] = v[l];
      }
    }
  }

  std::array<Source, I> in_;
  std::array<Target, O> out_;
  std::vector<Pack> packs_;
};

}  // namespace porthos::python
