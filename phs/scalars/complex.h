#pragma once
#include "phs/scalars/pack.h"

namespace porthos::phs {

/// A complex number over a real scalar; over a Pack, one complex number per lane.
template <class T>
struct Complex {
  T re, im;

  Complex() = default;
  Complex(double x) : re(x), im(0.0) {}
  Complex(T a, T b) : re(a), im(b) {}

  friend Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
  friend Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }
  friend Complex operator-(Complex a) { return {-a.re, -a.im}; }
  friend Complex operator*(Complex a, Complex b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  }
  friend Complex operator*(double s, Complex a) { return {T(s) * a.re, T(s) * a.im}; }
  friend Complex operator/(Complex a, Complex b) { return a * b.inverse(); }
  Complex& operator+=(Complex b) { return *this = *this + b; }
  Complex& operator-=(Complex b) { return *this = *this - b; }

  Complex conj() const { return {re, -im}; }
  T norm2() const { return re * re + im * im; }
  Complex inverse() const {
    const T n = T(1.0) / norm2();
    return {re * n, -(im * n)};
  }
};

using Complex4 = Complex<Pack4>;

}  // namespace porthos::phs
