#pragma once
#include "phs/scalars/scalar.h"

/// A double that counts what is done with it: exact operation counts of every template.
namespace porthos::bench {

struct Operations {
  long add = 0, mul = 0, fma = 0, div = 0, sqrt = 0;
  /// A fused multiply-add is one.
  long total() const { return add + mul + fma + div + sqrt; }
};
inline thread_local Operations operations;

/// Negations, comparisons and selections are not counted.
struct Counted {
  double v = 0;
  Counted() = default;
  Counted(double x) : v(x) {}
  friend Counted operator+(Counted a, Counted b) {
    ++operations.add;
    return a.v + b.v;
  }
  friend Counted operator-(Counted a, Counted b) {
    ++operations.add;
    return a.v - b.v;
  }
  friend Counted operator*(Counted a, Counted b) {
    ++operations.mul;
    return a.v * b.v;
  }
  friend Counted operator/(Counted a, Counted b) {
    ++operations.div;
    return a.v / b.v;
  }
  friend Counted operator-(Counted a) { return -a.v; }
  Counted& operator+=(Counted b) { return *this = *this + b; }
  Counted& operator-=(Counted b) { return *this = *this - b; }
  friend bool operator<(Counted a, Counted b) { return a.v < b.v; }
  friend bool operator==(Counted a, Counted b) { return a.v == b.v; }
  friend Counted fma(Counted a, Counted b, Counted c) {
    ++operations.fma;
    return phs::fma(a.v, b.v, c.v);
  }
  friend Counted sqrt(Counted a) {
    ++operations.sqrt;
    return std::sqrt(a.v);
  }
  friend void sincos(Counted x, Counted& s, Counted& c) { phs::trig::sincos_fast(x, s, c); }
};

/// What one call of f costs.
template <class F>
Operations count(F&& f) {
  operations = {};
  f();
  return operations;
}

}  // namespace porthos::bench
