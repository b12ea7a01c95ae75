#include "integrators/tables/collocation_table.h"

#include <algorithm>
#include <cmath>

#include "integrators/tables/legendre.h"
#include "phs/error.h"
#include "phs/scalars/scalar.h"

namespace porthos::integrators {
namespace {

using phs::Quad;

/// P_n'(x), |x| < 1
Quad slope(int n, Quad x) {
  const Legendre<Quad> p(n, x);
  return n * (p[n - 1] - x * p[n]) / (1 - x * x);
}

/// Newton's method in 113 bits from a double start value; f returns value divided by slope.
template <class F>
Quad root(double start, F f) {
  Quad x = start;
  for (int i = 0; i < 10; ++i) x -= f(x);
  return x;
}

/// Nodes on [-1, 1], ascending and symmetric, with weights of sum 2, and the square of the discrete
/// norm of P_{s-1}.
struct Quadrature {
  std::vector<Quad> x, w;
  Quad last_norm;
};

Quadrature gauss_quadrature(int s) {
  Quadrature q{std::vector<Quad>(size_t(s), Quad(0)), {}, Quad(2) / (2 * s - 1)};
  for (int i = 0; i < s / 2; ++i) {
    const Quad z = root(std::cos(M_PI * (i + 0.75) / (s + 0.5)),
                        [s](Quad x) { return Legendre<Quad>(s, x)[s] / slope(s, x); });
    q.x[size_t(s - 1 - i)] = z;
    q.x[size_t(i)] = -z;
  }
  for (const Quad x : q.x) q.w.push_back(2 / ((1 - x * x) * slope(s, x) * slope(s, x)));
  return q;
}

/// The ends and the zeros of P'_{s-1}. It is exact to one degree less than Gauss, so the discrete
/// norm of P_{s-1} differs.
Quadrature lobatto_quadrature(int s) {
  const int n = s - 1;
  Quadrature q{std::vector<Quad>(size_t(s), Quad(0)), {}, Quad(2) / n};
  q.x.front() = -1;
  q.x.back() = 1;
  for (int i = 1; i < s / 2; ++i) {
    const Quad z = root(std::cos(M_PI * i / n), [n](Quad x) {
      const Quad d = slope(n, x);
      return d * (1 - x * x) / (2 * x * d - n * (n + 1) * Legendre<Quad>(n, x)[n]);
    });
    q.x[size_t(n - i)] = z;
    q.x[size_t(i)] = -z;
  }
  for (const Quad x : q.x) {
    const Quad p = Legendre<Quad>(n, x)[n];
    q.w.push_back(2 / (n * s * p * p));
  }
  return q;
}

/// ∫₀^θ Σ_k c_k P_k(2θ' - 1) dθ' with x = 2θ - 1 and p its Legendre polynomials, k < r.
template <class T>
T integral(int r, const T* c, const T& x, const Legendre<T>& p) {
  T sum = c[0] * (x + T(1.0)) * T(0.5);
  for (int k = 1; k < r; ++k) sum += c[k] * (p[k + 1] - p[k - 1]) * (T(0.5) / T(2.0 * k + 1));
  return sum;
}

/// A table of `quadrature` with the slope's Legendre expansion truncated to r terms; μ in 113 bits.
template <class T>
CollocationTable<T> expansion(const Quadrature& quadrature, int r, std::vector<Quad>& mu) {
  const auto& [x, w, last_norm] = quadrature;
  const int s = int(x.size());
  CollocationTable<T> t;
  t.s = s;
  std::vector<Quad> coefficients;
  for (int j = 0; j < s; ++j) {
    t.c.push_back(T((x[size_t(j)] + 1) / 2));
    t.b.push_back(T(w[size_t(j)] / 2));
    const Legendre<Quad> p(s, x[size_t(j)]);
    for (int k = 0; k < r; ++k)
      coefficients.push_back(k < s - 1 ? (2 * k + 1) * p[k] : 2 * p[k] / last_norm);
  }
  for (const Quad c : coefficients) t.legendre.push_back(T(c));
  mu.clear();
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j)
      mu.push_back(
          integral(r, &coefficients[size_t(j * r)], x[size_t(i)], Legendre<Quad>(r, x[size_t(i)])));
  return t;
}

/// For a pair with a + b = 1, rounds the larger and sets the other to 1 minus it, which is exact by
/// Sterbenz' lemma.
template <class T>
void round_pair(Quad exact, bool first, T& a, T& b) {
  if (first) {
    a = T(exact);
    b = T(1.0) - a;
  } else {
    b = T(1 - exact);
    a = T(1.0) - b;
  }
}

template <class T>
constexpr int most_gauss = std::is_same_v<T, double> ? 8 : 12;

void require_stages(const char* what, int s, int least, int most) {
  if (s < least || s > most)
    throw InvalidArgument(std::string(what) + " with " + std::to_string(s) + " stages: expected " +
                          std::to_string(least) + " to " + std::to_string(most));
}

}  // namespace

template <class T>
void step_weights(std::span<const T> b, T h, std::span<T> hb) {
  const size_t last = b.size() - 1;
  const bool symmetric = b.front() == b.back();
  const size_t first = symmetric ? 0 : size_t(std::ranges::max_element(b) - b.begin());
  Quad rest = h;
  for (size_t i = 0; i <= last; ++i)
    if (i != first && !(symmetric && i == last)) rest -= Quad(hb[i] = h * b[i]);
  if (symmetric && last > 0)
    hb[first] = hb[last] = T(rest / 2);
  else
    hb[first] = T(rest);
}

template <class T>
void CollocationTable<T>::polynomial(T theta, std::span<T> B) const {
  const T x = T(2.0) * theta - T(1.0);
  const int r = degree();
  const Legendre<T> p(r, x);
  for (int j = 0; j < s; ++j) B[size_t(j)] = integral(r, &legendre[size_t(j * r)], x, p);
}
template <class T>
void CollocationTable<T>::slope(T theta, std::span<T> B) const {
  const int r = degree();
  const Legendre<T> p(r, T(2.0) * theta - T(1.0));
  for (int j = 0; j < s; ++j) {
    B[size_t(j)] = T(0.0);
    for (int k = 0; k < r; ++k) B[size_t(j)] += legendre[size_t(j * r + k)] * p[k];
  }
}

template <class T>
CollocationTable<T> gauss_table(int s) {
  require_stages("Gauss", s, 1, most_gauss<T>);
  std::vector<Quad> mu;
  auto t = expansion<T>(gauss_quadrature(s), s, mu);
  t.mu.assign(size_t(s * s), T(0.5));
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < i; ++j)  // the lower triangle holds values near 1
      round_pair(mu[size_t(i * s + j)], true, t.mu[size_t(i * s + j)], t.mu[size_t(j * s + i)]);
  return t;
}

template <class T>
CollocationTable<T> hbvm_table(int k, int r) {
  require_stages("HBVM", k, std::max(r, 1), most_stages);
  std::vector<Quad> mu;
  auto t = expansion<T>(gauss_quadrature(k), r, mu);
  for (const Quad a : mu) t.mu.push_back(T(a));
  return t;
}

template <class T>
CollocationTable<T> lobatto_table(int s) {
  require_stages("Lobatto", s, 2, most_gauss<T>);
  std::vector<Quad> mu;
  auto t = expansion<T>(lobatto_quadrature(s), s, mu);
  t.mu.resize(mu.size());
  t.mu_p.resize(mu.size());
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j) {
      const Quad a = mu[size_t(i * s + j)];
      round_pair(a, a >= 0.5, t.mu[size_t(i * s + j)], t.mu_p[size_t(j * s + i)]);
    }
  return t;
}

template <class T>
CollocationTable<T> runge_kutta_table(std::span<const Quad> c, std::span<const Quad> b,
                                      std::span<const Quad> a, int degree) {
  const size_t s = b.size();
  CollocationTable<T> t;
  t.s = int(s);
  for (size_t i = 0; i < s; ++i) {
    t.c.push_back(T(c[i]));
    t.b.push_back(T(b[i]));
    for (size_t j = 0; j < s; ++j) t.mu.push_back(T(a[i * s + j] / b[j]));
    const Legendre<Quad> p(degree, 2 * c[i] - 1);
    for (int k = 0; k < degree; ++k) t.legendre.push_back(T((2 * k + 1) * p[k]));
  }
  return t;
}

#define PORTHOS_INSTANTIATE(T)                                                                    \
  template void step_weights<T>(std::span<const T>, T, std::span<T>);                             \
  template CollocationTable<T> runge_kutta_table<T>(std::span<const Quad>, std::span<const Quad>, \
                                                    std::span<const Quad>, int);                  \
  template struct CollocationTable<T>;                                                            \
  template CollocationTable<T> gauss_table<T>(int);                                               \
  template CollocationTable<T> hbvm_table<T>(int, int);                                           \
  template CollocationTable<T> lobatto_table<T>(int);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(Quad)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::integrators
