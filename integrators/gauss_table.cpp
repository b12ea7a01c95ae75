#include "integrators/gauss_table.h"

#include <cmath>

#include "phs/error.h"
#include "phs/scalar.h"

namespace porthos::integrators {
namespace {

using phs::Quad;

constexpr int most_stages = 12;
/// P_0(x) … P_n(x), n <= most_stages + 1.
template <class T>
struct Legendre {
  T p[most_stages + 2];
  Legendre(int n, T x) {
    p[0] = T(1.0), p[1] = x;
    for (int k = 1; k < n; ++k)
      p[k + 1] = (T(2.0 * k + 1) * x * p[k] - T(double(k)) * p[k - 1]) / T(k + 1.0);
  }
  const T& operator[](int k) const { return p[k]; }
};

/// P_n'(x)
Quad legendre_slope(int n, Quad x, const Legendre<Quad>& p) {
  return n * (p[n - 1] - x * p[n]) / (1 - x * x);
}

/// The zeros of P_s, ascending and symmetric.
std::vector<Quad> zeros(int s) {
  std::vector<Quad> x(size_t(s), Quad(0));
  for (int i = 0; i < s / 2; ++i) {
    Quad z = std::cos(M_PI * (i + 0.75) / (s + 0.5));
    for (int it = 0; it < 10; ++it) {
      const Legendre<Quad> p(s, z);
      z -= p[s] / legendre_slope(s, z, p);
    }
    x[size_t(s - 1 - i)] = z, x[size_t(i)] = -z;
  }
  return x;
}

/// ∫₀^c ℓ_j / b_j = c + ½ Σ_{k=1}^{s-1} P_k(x_j) (P_{k+1}(x) - P_{k-1}(x)),  x = 2c - 1;  Pj: P_0(x_j) … P_{s-1}(x_j).
template <class T>
T integral_of_lagrange(int s, const T* Pj, const T& x, const Legendre<T>& p) {
  T sum = (x + T(1.0)) * T(0.5);
  for (int k = 1; k < s; ++k) sum += Pj[k] * (p[k + 1] - p[k - 1]) * T(0.5);
  return sum;
}

template <class T>
GaussTable<T> make(int s, bool round_lower) {
  const auto x = zeros(s);
  GaussTable<T> t;
  t.s = s;
  t.mu.resize(size_t(s * s));
  for (int i = 0; i < s; ++i) {
    const Quad slope = legendre_slope(s, x[size_t(i)], Legendre<Quad>(s, x[size_t(i)]));
    t.c.push_back(T((x[size_t(i)] + 1) / 2));
    const Legendre<Quad> P(s, x[size_t(i)]);
    for (int k = 0; k < s; ++k) t.legendre.push_back(T(P[k]));
    t.b.push_back(T(1 / ((1 - x[size_t(i)] * x[size_t(i)]) * slope * slope)));
  }
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j) {
      T& mu = t.mu[size_t(i * s + j)];
      if (i == j)
        mu = T(0.5);
      else if ((i > j) == round_lower)
        mu = T(integral_of_lagrange(s, Legendre<Quad>(s, x[size_t(j)]).p, x[size_t(i)],
                                    Legendre<Quad>(s, x[size_t(i)])));
    }
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j)
      if (i != j && (i > j) != round_lower)
        t.mu[size_t(i * s + j)] = T(1.0) - t.mu[size_t(j * s + i)];
  return t;
}

}  // namespace

template <class T>
void GaussTable<T>::weights(T h, std::span<T> hb) const {
  Quad inner = 0;
  for (size_t i = 1; i + 1 < b.size(); ++i) inner += Quad(hb[i] = h * b[i]);
  if (b.size() == 1)
    hb[0] = h;
  else
    hb.front() = hb.back() = T((Quad(h) - inner) / 2);
}

template <class T>
void GaussTable<T>::polynomial(T theta, std::span<T> B) const {
  const T x = T(2.0) * theta - T(1.0);
  const Legendre<T> p(s, x);
  for (size_t j = 0; j < B.size(); ++j)
    B[j] = integral_of_lagrange(s, &legendre[j * size_t(s)], x, p);
}

template <class T>
GaussTable<T> gauss_table(int s) {
  const int most = std::is_same_v<T, double> ? 8 : most_stages;
  if (s < 1 || s > most)
    throw InvalidArgument("Gauss with " + std::to_string(s) + " stages: expected 1 to " +
                          std::to_string(most));
  return make<T>(s, true);
}
GaussTable<double> gauss_table_wrong_triangle(int s) { return make<double>(s, false); }

template struct GaussTable<double>;
template struct GaussTable<Quad>;
template GaussTable<double> gauss_table<double>(int);
template GaussTable<Quad> gauss_table<Quad>(int);

}  // namespace porthos::integrators
