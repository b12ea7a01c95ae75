// The conditions of a MatchedLoop, by number.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/matched_system-inl.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/scalars/derivative.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

/// Coordinates of the region: corners first, then a Halton sequence.
class Coordinates {
 public:
  Coordinates(const Region& r, size_t n) : r_(r), n_(n) {}
  Vec operator()(size_t i) const {
    Vec q(n_);
    const size_t corners = size_t(1) << n_;
    for (size_t a = 0; a < n_; ++a) {
      const double f = i < corners ? double((i >> a) & 1) : radical_inverse(i - corners + 1, a);
      q[a] = r_.lower[a] + f * (r_.upper[a] - r_.lower[a]);
    }
    return q;
  }

 private:
  static double radical_inverse(size_t i, size_t axis) {
    static constexpr size_t primes[max_coordinates] = {2, 3, 5, 7, 11, 13, 17, 19};
    const double base = double(primes[axis]);
    double f = 1, x = 0;
    for (; i > 0; i /= primes[axis]) {
      f /= base;
      x += f * double(i % primes[axis]);
    }
    return x;
  }
  const Region& r_;
  size_t n_;
};

/// Keeps the worst value (by a NaN, then by size) and where it was.
struct Worst {
  double value;
  Vec at;
  void more(double x, const Vec& where) {
    if (std::isnan(value)) return;
    if (at.empty() || std::isnan(x) || x > value) {
      value = x;
      at = where;
    }
  }
  void less(double x, const Vec& where) {
    if (std::isnan(value)) return;
    if (at.empty() || std::isnan(x) || x < value) {
      value = x;
      at = where;
    }
  }
};

double norm(std::span<const double> v) {
  double s = 0;
  for (const double x : v) s += x * x;
  return std::sqrt(s);
}

/// p with M⁻¹p = v.
Vec momenta(MatchedSystem<double>& s, const Vec& q, std::span<const double> v) {
  Vec x = q;
  x.resize(2 * q.size(), 0.0);
  s.evaluate(x);
  const Vec p = phs::linear_solve(q.size(), s.inverse_mass(), v);
  std::copy(p.begin(), p.end(), x.begin() + long(q.size()));
  return x;
}

MatchingResidual residual_at(MatchedSystem<double>& s, Vec x) {
  const size_t n = x.size() / 2;
  s.forces(x);
  Vec moving(s.force().begin(), s.force().end()),
      size(s.force_sizes().begin(), s.force_sizes().end());
  std::fill(x.begin() + long(n), x.end(), 0.0);
  s.forces(x);
  Vec still(s.force().begin(), s.force().end());
  const double still_size = norm(s.force_sizes()), moving_size = norm(size);
  for (size_t i = 0; i < n; ++i) moving[i] -= still[i];
  s.off_input(still);
  s.off_input(moving);
  const auto relative = [](double r, double scale) { return r == 0 ? 0 : r / scale; };
  return {relative(norm(moving), moving_size), relative(norm(still), still_size)};
}

}  // namespace

MatchingResidual MatchedLoop::residual(std::span<const double> x) const {
  MatchedSystem<double> s(*this);
  require_size("x", x.size(), 2 * size_t(shaping_->size()));
  return residual_at(s, Vec(x.begin(), x.end()));
}

std::vector<double> MatchedLoop::state(std::span<const double> q, std::span<const double> v) const {
  require_size("q", q.size(), size_t(shaping_->size()));
  require_size("v", v.size(), q.size());
  MatchedSystem<double> s(*this);
  return momenta(s, Vec(q.begin(), q.end()), v);
}

void MatchedLoop::check() {
  const size_t n = size_t(shaping_->size()), m = actuated_.size();
  const Region& region = options_.region;
  const Coordinates coordinates(region, n);
  const auto plant = plant_->instantiate<double>();
  MatchedSystem<double> s(*this);
  std::mt19937_64 generator(region.seed);
  std::uniform_real_distribution<double> uniform(-region.rate, region.rate);
  Certificate& c = certificate_;
  const Vec q_rest(rest_.begin(), rest_.begin() + long(n));
  const std::string sampled = fmt::format("{} points of the region", region.samples);

  // M_d first: nothing else means anything without it.
  Worst mass{0, {}}, kv{0, {}}, rank{0, {}};
  for (size_t i = 0; i <= size_t(region.samples); ++i) {
    Vec x = i == 0 ? q_rest : coordinates(i - 1);
    const Vec q = x;
    x.resize(2 * n, 0.0);
    s.evaluate(x);
    const auto e = phs::symmetric_eigenvalues(n, s.target_mass_matrix());
    mass.less(e.front() / std::max(std::fabs(e.back()), std::fabs(e.front())), q);
    const auto k = phs::symmetric_eigenvalues(m, s.kv());
    kv.less(k.front() / std::max(std::fabs(k.back()), 1e-300), q);
    Vec GG(m * m);
    for (size_t a = 0; a < m; ++a)
      for (size_t b = 0; b < m; ++b)
        for (size_t r = 0; r < n; ++r) GG[a * m + b] += s.input()[r * m + a] * s.input()[r * m + b];
    const auto g = phs::symmetric_eigenvalues(m, GG);
    rank.less(g.front() / std::max(g.back(), 1e-300), q);
  }
  c.at_least("M_d > 0", mass.value, 1e-12, "least over greatest eigenvalue, " + sampled, mass.at);
  c.at_least("rank of G", rank.value, 1e-14, "least over greatest eigenvalue of GᵀG", rank.at);
  if (!c.holds()) return;

  // The plant is what the method takes it for.
  Worst quadratic{0, {}}, kinetic{0, {}}, potential{0, {}}, skew{0, {}}, passive{0, {}};
  Vec v(n), e(2 * n), r1(2 * n), still;
  for (size_t i = 0; i < size_t(region.samples); ++i) {
    const Vec q = coordinates(i);
    for (double& y : v) y = uniform(generator);
    const Vec x = momenta(s, q, v);
    still = x;
    std::fill(still.begin() + long(n), still.end(), 0.0);
    double T = 0;
    for (size_t a = 0; a < n; ++a) T += 0.5 * v[a] * x[n + a];
    const double H = plant->hamiltonian(x), V = plant->hamiltonian(still);
    quadratic.more(std::fabs(H - V - T) / (std::fabs(H) + std::fabs(V) + std::fabs(T)), x);

    const auto residual = residual_at(s, x);
    kinetic.more(residual.kinetic, x);
    potential.more(residual.potential, q);
    s.evaluate(x);
    const auto J2 = s.skew_matrix();
    double odd = 0;
    for (size_t a = 0; a < n; ++a)
      for (size_t b = 0; b < n; ++b)
        odd = std::max(odd, std::fabs(J2[a * n + b] + J2[b * n + a]) / (1e-300 + norm(J2)));
    skew.more(odd, x);
    Vec R(n * n);
    double scale = 1e-300;
    for (size_t a = 0; a < n; ++a)
      for (size_t b = 0; b < n; ++b) {
        for (size_t j = 0; j < m; ++j)
          for (size_t k = 0; k < m; ++k)
            R[a * n + b] += s.input()[a * m + j] * s.kv()[j * m + k] * s.input()[b * m + k];
        scale = std::max(scale, std::fabs(R[a * n + b]));
        R[a * n + b] += s.friction()[a * n + b];
        scale = std::max(scale, std::fabs(s.friction()[a * n + b]));
      }
    passive.less(phs::symmetric_eigenvalues(n, R).front() / scale, q);
  }
  c.at_most("H = T + V", quadratic.value, 1e-11, "kinetic energy ½ pᵀM⁻¹p, relative, " + sampled,
            quadratic.at);
  c.at_most("matching, kinetic energy", kinetic.value, options_.matching, "relative, " + sampled,
            kinetic.at);
  c.at_most("matching, potential energy", potential.value, options_.matching,
            "relative, " + sampled, potential.at);
  c.at_most("J2 skew", skew.value, 1e-12, "relative", skew.at);
  c.at_least("Kv >= 0", kv.value, -1e-12, "least over greatest eigenvalue", kv.at);
  c.at_least("damping >= 0", passive.value, -1e-12,
             "least eigenvalue of G Kv Gᵀ + sym(D M⁻¹M_d), relative", passive.at);

  // The rest point.
  std::vector<phs::Dual> qd(q_rest.begin(), q_rest.end()), dV(n), k;
  for (const auto& g : shaping_->gains()) k.push_back(g.value);
  Vec hessian_V(n * n), slope(n);
  phs::along_each(qd, [&](size_t j) {
    (void)shaping_->potential(qd, k, dV);
    for (size_t i = 0; i < n; ++i) {
      hessian_V[i * n + j] = dV[i].d;
      slope[i] = dV[i].v;
    }
  });
  const auto curvature = phs::symmetric_eigenvalues(n, hessian_V);
  c.at_most("rest point", norm(phs::linear_solve(n, hessian_V, slope)), 1e-8,
            "Newton's step to the critical point of V_d", q_rest);
  c.at_least(
      "Hessian of V_d > 0",
      curvature.front() / std::max(std::fabs(curvature.back()), std::fabs(curvature.front())), 1e-9,
      "at the rest point, least over greatest eigenvalue");
  c.report("curvature of V_d", curvature.front(), "eigenvalues of the Hessian", curvature);
}

}  // namespace porthos::energy_shaping
