#pragma once

/// The 113-bit float of reference solutions, with libquadmath's names for its functions. It is the
/// __float128 of GCC and Clang. Where long double already has 113 bits (aarch64), it is a class
/// around long double, so that the list of scalars can hold both types.
#if defined(__SIZEOF_FLOAT128__)

namespace porthos::phs {

__extension__ typedef __float128 Quad;

// Declared here because Clang does not find GCC's <quadmath.h>.
extern "C" {
Quad sinq(Quad);
Quad cosq(Quad);
void sincosq(Quad, Quad*, Quad*);
Quad sqrtq(Quad);
Quad fabsq(Quad);
Quad expq(Quad);
Quad logq(Quad);
Quad tanhq(Quad);
Quad sinhq(Quad);
Quad coshq(Quad);
Quad atanq(Quad);
Quad powq(Quad, Quad);
Quad strtoflt128(const char*, char**);
int quadmath_snprintf(char*, unsigned long, const char*, ...);
}

}  // namespace porthos::phs

#else

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <concepts>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace porthos::phs {

static_assert(LDBL_MANT_DIG == 113, "phs::Quad: neither __float128 nor a long double of 113 bits");

class Quad {
 public:
  Quad() = default;
  template <class N>
  requires std::integral<N> || std::floating_point<N>
  constexpr Quad(N x) : v_(x) {}
  template <class N>
  requires std::integral<N> || std::floating_point<N>
  constexpr explicit operator N() const { return static_cast<N>(v_); }

  constexpr friend Quad operator+(Quad a, Quad b) { return a.v_ + b.v_; }
  constexpr friend Quad operator-(Quad a, Quad b) { return a.v_ - b.v_; }
  constexpr friend Quad operator*(Quad a, Quad b) { return a.v_ * b.v_; }
  constexpr friend Quad operator/(Quad a, Quad b) { return a.v_ / b.v_; }
  constexpr friend Quad operator-(Quad a) { return -a.v_; }
  constexpr friend auto operator<=>(Quad a, Quad b) { return a.v_ <=> b.v_; }
  constexpr friend bool operator==(Quad a, Quad b) { return a.v_ == b.v_; }
  constexpr Quad& operator+=(Quad b) { return *this = *this + b; }
  constexpr Quad& operator-=(Quad b) { return *this = *this - b; }
  constexpr Quad& operator*=(Quad b) { return *this = *this * b; }
  constexpr Quad& operator/=(Quad b) { return *this = *this / b; }

 private:
  long double v_;
};

inline long double wide(Quad x) { return static_cast<long double>(x); }
inline Quad sinq(Quad x) { return std::sin(wide(x)); }
inline Quad cosq(Quad x) { return std::cos(wide(x)); }
inline void sincosq(Quad x, Quad* s, Quad* c) {
  *s = sinq(x);
  *c = cosq(x);
}
inline Quad sqrtq(Quad x) { return std::sqrt(wide(x)); }
inline Quad fabsq(Quad x) { return std::fabs(wide(x)); }
inline Quad expq(Quad x) { return std::exp(wide(x)); }
inline Quad logq(Quad x) { return std::log(wide(x)); }
inline Quad tanhq(Quad x) { return std::tanh(wide(x)); }
inline Quad sinhq(Quad x) { return std::sinh(wide(x)); }
inline Quad coshq(Quad x) { return std::cosh(wide(x)); }
inline Quad atanq(Quad x) { return std::atan(wide(x)); }
inline Quad powq(Quad x, Quad y) { return std::pow(wide(x), wide(y)); }
inline Quad strtoflt128(const char* text, char** end) { return std::strtold(text, end); }
/// `format` has libquadmath's length modifier Q, which is L for a long double.
inline int quadmath_snprintf(char* text, unsigned long size, const char* format, Quad x) {
  std::string f = format;
  std::replace(f.begin(), f.end(), 'Q', 'L');
  return std::snprintf(text, size, f.c_str(), wide(x));
}

}  // namespace porthos::phs

#endif
