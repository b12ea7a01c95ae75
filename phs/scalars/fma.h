#pragma once
#include "phs/scalars/quad.h"

/// The multiply-add fma(a, b, c) = a·b + c of every scalar. Kernels write it out, and contraction
/// by the compiler stays off. So one state, each of the lanes, any number of threads and any
/// machine that fuses give the same bits. The rule for a sum of products is that the first product
/// is the last to be added: a·b + c·d is fma(a, b, c·d), and a·b - c·d is fma(a, b, -(c·d)).
namespace porthos::phs {

/// Whether fma() of double and of lanes rounds once in this build. Where the machine has no fused
/// multiply-add it rounds the product and the sum; such a build has bits of its own.
#if defined(__FMA__) || defined(__aarch64__)
inline constexpr bool fuses = true;
#else
inline constexpr bool fuses = false;
#endif

/// a·b + c, rounded once if this build `fuses`.
[[gnu::always_inline]] inline double fma(double a, double b, double c) {
  if constexpr (fuses)
    return __builtin_fma(a, b, c);
  else
    return a * b + c;
}
/// a·b + c, rounded twice: the fused form of these scalars is a slow library function.
inline long double fma(long double a, long double b, long double c) { return a * b + c; }
/// a·b + c, rounded twice.
inline Quad fma(Quad a, Quad b, Quad c) { return a * b + c; }

}  // namespace porthos::phs
