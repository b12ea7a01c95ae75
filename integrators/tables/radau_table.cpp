#include "integrators/tables/radau_table.h"

#include "phs/scalars/scalar.h"

namespace porthos::integrators {
namespace {

using phs::Quad;
constexpr int s = 8;

/// P_7 + P_8, which vanishes at -1 and at the inner left Radau nodes.
Quad radau_polynomial(Quad x) {
  Quad p0 = 1, p1 = x;
  for (int k = 1; k < s; ++k) {
    const Quad p2 = ((2 * k + 1) * x * p1 - k * p0) / (k + 1);
    p0 = p1;
    p1 = p2;
  }
  return p0 + p1;
}

std::array<Quad, s> nodes() {
  std::array<Quad, s> c{};
  int found = 1;
  constexpr int grid = 256;
  for (int i = 1; i < grid; ++i) {
    Quad a = Quad(2 * i) / grid - 1, b = Quad(2 * i + 2) / grid - 1;
    if (radau_polynomial(a) * radau_polynomial(b) > 0) continue;
    const bool rising = radau_polynomial(a) < 0;
    for (int k = 0; k < 130; ++k) {
      const Quad m = (a + b) / 2;
      ((radau_polynomial(m) < 0) == rising ? a : b) = m;
    }
    c[size_t(found++)] = (a + 1) / 2;
  }
  return c;
}

/// l_j(theta)
Quad lagrange(const std::array<Quad, s>& c, int j, Quad theta) {
  Quad p = 1;
  for (int m = 0; m < s; ++m)
    if (m != j) p *= (theta - c[size_t(m)]) / (c[size_t(j)] - c[size_t(m)]);
  return p;
}

template <class T>
RadauTable<T> make() {
  const auto c = nodes();
  const auto gauss = gauss_table<Quad>(s);
  const auto integral = [&](int j, Quad end) {
    Quad sum = 0;
    for (size_t k = 0; k < s; ++k) sum += gauss.b[k] * lagrange(c, j, end * gauss.c[k]);
    return end * sum;
  };
  RadauTable<T> t;
  for (int j = 0; j < s; ++j) {
    t.c[size_t(j)] = T(c[size_t(j)]);
    t.b[size_t(j)] = T(integral(j, 1));
    t.b_lo[size_t(j)] = double(integral(j, 1) - Quad(t.b[size_t(j)]));
    for (int i = 0; i < s; ++i) t.a[size_t(i)][size_t(j)] = T(integral(j, c[size_t(i)]));
    std::array<Quad, s> p{1};  // product of (theta - c_m)/(c_j - c_m), by powers of theta
    int degree = 0;
    for (int m = 0; m < s; ++m) {
      if (m == j) continue;
      const Quad scale = 1 / (c[size_t(j)] - c[size_t(m)]);
      for (int k = ++degree; k >= 0; --k)
        p[size_t(k)] = ((k > 0 ? p[size_t(k - 1)] : Quad(0)) - c[size_t(m)] * p[size_t(k)]) * scale;
    }
    for (size_t m = 0; m < s; ++m) t.power[m][size_t(j)] = T(p[m]);
  }
  return t;
}

}  // namespace

template <class T>
std::array<T, s> RadauTable<T>::weights(T h) const {
  std::array<T, s> hb;
  step_weights<T>(b, h, hb);
  return hb;
}

template <class T>
std::array<T, s> RadauTable<T>::beyond(T theta) const {
  std::array<T, s> sum{};
  T to(1.0);
  for (size_t m = 0; m < s; ++m) {
    to = to * theta;  // theta^(m + 1)
    for (size_t j = 0; j < s; ++j)
      sum[j] = sum[j] + power[m][j] * ((to - T(1.0)) / T(double(m + 1)));
  }
  return sum;
}

template <class T>
const RadauTable<T>& radau_table() {
  static const RadauTable<T> table = make<T>();
  return table;
}

template <class T>
CollocationTable<T> radau_steps() {
  const auto& q = radau_table<Quad>();
  return runge_kutta_table<T>(q.c, q.b, {q.a.front().data(), s * s}, s);
}

template struct RadauTable<double>;
template struct RadauTable<Quad>;
template const RadauTable<double>& radau_table<double>();
template const RadauTable<Quad>& radau_table<Quad>();
template CollocationTable<double> radau_steps<double>();
template CollocationTable<Quad> radau_steps<Quad>();

}  // namespace porthos::integrators
