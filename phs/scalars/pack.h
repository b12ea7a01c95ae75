#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "phs/scalars/fma.h"

/// SIMD lanes as a scalar: Pack<double, W> is W independent doubles that every kernel treats as one
/// number. Each lane performs exactly the IEEE operations of the scalar kernel, so lane k equals
/// the scalar run bit for bit. Comparisons give a mask. Kernels use select(mask, a, b) and never
/// branch on a Pack.
namespace porthos::phs {

#if defined(__AVX512F__)
inline constexpr int native_lanes = 8;
inline constexpr const char* simd_name = "AVX-512";
#elif defined(__AVX__)
inline constexpr int native_lanes = 4;
inline constexpr const char* simd_name = "AVX";
#else
inline constexpr int native_lanes = 2;
#if defined(__ARM_NEON)
inline constexpr const char* simd_name = "NEON";
#else
inline constexpr const char* simd_name = "SSE2";
#endif
#endif

template <int W>
struct NativeVector;
template <>
struct NativeVector<2> {
  typedef double type __attribute__((vector_size(16)));
  typedef std::int64_t mask __attribute__((vector_size(16)));
};
template <>
struct NativeVector<4> {
  typedef double type __attribute__((vector_size(32)));
  typedef std::int64_t mask __attribute__((vector_size(32)));
};
template <>
struct NativeVector<8> {
  typedef double type __attribute__((vector_size(64)));
  typedef std::int64_t mask __attribute__((vector_size(64)));
};

#if defined(__AVX512F__)
/// Square roots by compiler built-in, because <immintrin.h> adds half a second to every
/// compilation. 4: use the current rounding mode.
inline NativeVector<8>::type sqrt512(NativeVector<8>::type x) {
#if defined(__clang__)
  return __builtin_ia32_sqrtpd512(x, 4);
#else
  return __builtin_ia32_sqrtpd512_mask(x, x, -1, 4);
#endif
}
inline NativeVector<8>::type fma512(NativeVector<8>::type a, NativeVector<8>::type b,
                                    NativeVector<8>::type c) {
  return __builtin_ia32_vfmaddpd512_mask(a, b, c, -1, 4);
}
#endif

/// A mask of W lanes: one register if the machine has one that wide, else two halves.
template <int W, bool native = (W <= native_lanes)>
struct Mask {
  typename NativeVector<W>::mask m;
  friend Mask operator&(Mask a, Mask b) { return {a.m & b.m}; }
  friend Mask operator|(Mask a, Mask b) { return {a.m | b.m}; }
  friend Mask operator!(Mask a) { return {~a.m}; }
  bool operator[](int i) const { return m[i] != 0; }
};
template <int W>
struct Mask<W, false> {
  Mask<W / 2> lo, hi;
  friend Mask operator&(Mask a, Mask b) { return {a.lo & b.lo, a.hi & b.hi}; }
  friend Mask operator|(Mask a, Mask b) { return {a.lo | b.lo, a.hi | b.hi}; }
  friend Mask operator!(Mask a) { return {!a.lo, !a.hi}; }
  bool operator[](int i) const { return i < W / 2 ? lo[i] : hi[i - W / 2]; }
};

template <class T, int W, bool native = (W <= native_lanes)>
struct Pack;

/// W lanes that fit one machine register.
template <int W>
struct Pack<double, W, true> {
  static constexpr int width = W;
  using V = typename NativeVector<W>::type;
  V v;

  Pack() = default;
  Pack(V x) : v(x) {}
  Pack(double x) : v(x - V{}) {}  // x - 0, not x + 0: keeps the sign of a zero

  double operator[](int i) const { return v[i]; }
  void set(int i, double x) { v[i] = x; }

  friend Pack operator+(Pack a, Pack b) { return a.v + b.v; }
  friend Pack operator-(Pack a, Pack b) { return a.v - b.v; }
  friend Pack operator*(Pack a, Pack b) { return a.v * b.v; }
  friend Pack operator/(Pack a, Pack b) { return a.v / b.v; }
  friend Pack operator-(Pack a) { return -a.v; }
  friend Pack abs(Pack a) {
    using Bits = typename NativeVector<W>::mask;
    return V((Bits)a.v & (Bits{} + std::numeric_limits<std::int64_t>::max()));
  }
  friend Mask<W> operator<(Pack a, Pack b) { return {a.v < b.v}; }
  friend Mask<W> operator>(Pack a, Pack b) { return {a.v > b.v}; }
  friend Mask<W> operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
  friend Mask<W> operator>=(Pack a, Pack b) { return {a.v >= b.v}; }
  friend Mask<W> operator==(Pack a, Pack b) { return {a.v == b.v}; }
  friend Pack select(Mask<W> m, Pack a, Pack b) { return m.m ? a.v : b.v; }

  friend Pack sqrt(Pack a) {
#if defined(__AVX512F__)
    if constexpr (W == 8) return Pack(sqrt512(a.v));
#endif
#if defined(__AVX__)
    if constexpr (W == 4) return Pack(V(__builtin_ia32_sqrtpd256(a.v)));
#endif
#if defined(__SSE2__)
    if constexpr (W == 2) return Pack(V(__builtin_ia32_sqrtpd(a.v)));
#endif
    Pack r;
    for (int i = 0; i < W; ++i) r.v[i] = __builtin_sqrt(a.v[i]);
    return r;
  }
  friend Pack fma(Pack a, Pack b, Pack c) {
#if defined(__AVX512F__)
    if constexpr (W == 8) return Pack(fma512(a.v, b.v, c.v));
#endif
#if defined(__FMA__)
    if constexpr (W == 4) return Pack(V(__builtin_ia32_vfmaddpd256(a.v, b.v, c.v)));
    if constexpr (W == 2) return Pack(V(__builtin_ia32_vfmaddpd(a.v, b.v, c.v)));
#endif
    if constexpr (!fuses) return Pack(a.v * b.v + c.v);
    Pack r;
    for (int i = 0; i < W; ++i) r.v[i] = __builtin_fma(a.v[i], b.v[i], c.v[i]);
    return r;
  }
};

/// W lanes in two halves.
template <int W>
struct Pack<double, W, false> {
  static constexpr int width = W;
  using Half = Pack<double, W / 2>;
  Half lo, hi;

  Pack() = default;
  Pack(Half a, Half b) : lo(a), hi(b) {}
  Pack(double x) : lo(x), hi(x) {}

  double operator[](int i) const { return i < W / 2 ? lo[i] : hi[i - W / 2]; }
  void set(int i, double x) { i < W / 2 ? lo.set(i, x) : hi.set(i - W / 2, x); }

  friend Pack operator+(Pack a, Pack b) { return {a.lo + b.lo, a.hi + b.hi}; }
  friend Pack operator-(Pack a, Pack b) { return {a.lo - b.lo, a.hi - b.hi}; }
  friend Pack operator*(Pack a, Pack b) { return {a.lo * b.lo, a.hi * b.hi}; }
  friend Pack operator/(Pack a, Pack b) { return {a.lo / b.lo, a.hi / b.hi}; }
  friend Pack operator-(Pack a) { return {-a.lo, -a.hi}; }
  friend Pack abs(Pack a) { return {abs(a.lo), abs(a.hi)}; }
  friend Mask<W> operator<(Pack a, Pack b) { return {a.lo < b.lo, a.hi < b.hi}; }
  friend Mask<W> operator>(Pack a, Pack b) { return {a.lo > b.lo, a.hi > b.hi}; }
  friend Mask<W> operator<=(Pack a, Pack b) { return {a.lo <= b.lo, a.hi <= b.hi}; }
  friend Mask<W> operator>=(Pack a, Pack b) { return {a.lo >= b.lo, a.hi >= b.hi}; }
  friend Mask<W> operator==(Pack a, Pack b) { return {a.lo == b.lo, a.hi == b.hi}; }
  friend Pack select(Mask<W> m, Pack a, Pack b) {
    return {select(m.lo, a.lo, b.lo), select(m.hi, a.hi, b.hi)};
  }
  friend Pack sqrt(Pack a) { return {sqrt(a.lo), sqrt(a.hi)}; }
  friend Pack fma(Pack a, Pack b, Pack c) { return {fma(a.lo, b.lo, c.lo), fma(a.hi, b.hi, c.hi)}; }
};

template <int W, bool n>
bool any(Mask<W, n> m) {
#if defined(__AVX__)
  if constexpr (W == 4 && n)
    return __builtin_ia32_movmskpd256((typename NativeVector<W>::type)m.m) != 0;
#endif
  if constexpr (!n) {
    return any(m.lo | m.hi);
  } else {
    bool r = false;
    for (int i = 0; i < W; ++i) r |= m[i];
    return r;
  }
}

template <int W, bool n>
Pack<double, W, n>& operator+=(Pack<double, W, n>& a, Pack<double, W, n> b) {
  return a = a + b;
}
template <int W, bool n>
Pack<double, W, n>& operator-=(Pack<double, W, n>& a, Pack<double, W, n> b) {
  return a = a - b;
}
template <int W, bool n>
Pack<double, W, n>& operator*=(Pack<double, W, n>& a, Pack<double, W, n> b) {
  return a = a * b;
}

// Qualified calls, phs::sqrt(x), do not see the friends of a Pack; within these the friend is the
// better match.
template <int W, bool n>
Pack<double, W, n> sqrt(Pack<double, W, n> x) {
  return sqrt(x);
}
template <int W, bool n>
Pack<double, W, n> abs(Pack<double, W, n> x) {
  return abs(x);
}
template <int W, bool n>
Pack<double, W, n> fma(Pack<double, W, n> a, Pack<double, W, n> b, Pack<double, W, n> c) {
  return fma(a, b, c);
}
template <int W, bool n>
Pack<double, W, n> select(Mask<W, n> m, Pack<double, W, n> a, Pack<double, W, n> b) {
  return select(m, a, b);
}

using Pack4 = Pack<double, 4>;
using Pack8 = Pack<double, 8>;

}  // namespace porthos::phs
