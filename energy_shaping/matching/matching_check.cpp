// Numerical checks of the conditions of a MatchedLoop.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/matching/matched_system-inl.h"
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

/// Keeps the worst value (a NaN first, then the largest) and its place.
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

/// The conditions of a matched loop, in an order in which each assumes the previous ones.
class Checks {
 public:
  Checks(MatchedSystem<double>& s, const Region& region, size_t actuators, Certificate& c)
      : s_(s),
        region_(region),
        n_(region.lower.size()),
        m_(actuators),
        coordinates_(region, n_),
        c_(c),
        sampled_(fmt::format("{} points of the region", region.samples)) {}

  /// M_d > 0 and the rank of G.
  void shape(const Vec& rest) {
    Worst mass{0, {}}, rank{0, {}};
    for (size_t i = 0; i <= size_t(region_.samples); ++i) {
      Vec x = i == 0 ? rest : coordinates_(i - 1);
      const Vec q = x;
      x.resize(2 * n_, 0.0);
      s_.evaluate(x);
      mass.less(phs::definiteness(n_, s_.target_mass_matrix()).least, q);
      const auto k = phs::symmetric_eigenvalues(m_, s_.kv());
      kv_.less(k.front() / std::max(std::fabs(k.back()), 1e-300), q);
      const auto g = phs::symmetric_eigenvalues(m_, input_squared());
      rank.less(g.front() / std::max(g.back(), 1e-300), q);
    }
    c_.at_least("M_d > 0", mass.value, 1e-12, "least eigenvalue, its diagonal 1, " + sampled_,
                mass.at);
    c_.at_least("rank of G", rank.value, 1e-14, "least over greatest eigenvalue of GᵀG", rank.at);
  }

  /// The plant has the form that the method assumes, and the matching equations hold.
  void matching(phs::System<double>& plant, double tolerance) {
    Worst quadratic{0, {}}, kinetic{0, {}}, potential{0, {}}, skew{0, {}}, passive{0, {}};
    std::mt19937_64 generator(region_.seed);
    std::uniform_real_distribution<double> uniform(-region_.rate, region_.rate);
    Vec v(n_);
    for (size_t i = 0; i < size_t(region_.samples); ++i) {
      const Vec q = coordinates_(i);
      for (double& y : v) y = uniform(generator);
      const Vec x = momenta(s_, q, v);
      quadratic.more(not_quadratic(plant, x, v), x);
      const auto residual = residual_at(s_, x);
      kinetic.more(residual.kinetic, x);
      potential.more(residual.potential, q);
      s_.evaluate(x);
      skew.more(not_skew(), x);
      passive.less(least_damping(), q);
    }
    c_.at_most("H = T + V", quadratic.value, 1e-11,
               "kinetic energy ½ pᵀM⁻¹p, relative, " + sampled_, quadratic.at);
    c_.at_most("matching, kinetic energy", kinetic.value, tolerance, "relative, " + sampled_,
               kinetic.at);
    c_.at_most("matching, potential energy", potential.value, tolerance, "relative, " + sampled_,
               potential.at);
    c_.at_most("J2 skew", skew.value, 1e-12, "relative", skew.at);
    c_.at_least("Kv >= 0", kv_.value, -1e-12, "least over greatest eigenvalue", kv_.at);
    c_.at_least("damping >= 0", passive.value, -1e-12,
                "least eigenvalue of G Kv Gᵀ + sym(D M⁻¹M_d), relative", passive.at);
  }

  /// V_d has a minimum there.
  void rest_point(const Shaping& shaping, const Vec& rest) {
    std::vector<phs::Dual> q(rest.begin(), rest.end()), dV(n_), k;
    for (const auto& g : shaping.gains()) k.push_back(g.value);
    Vec hessian(n_ * n_), slope(n_);
    phs::along_each(q, [&](size_t j) {
      (void)shaping.potential(q, k, dV);
      for (size_t i = 0; i < n_; ++i) {
        hessian[i * n_ + j] = dV[i].d;
        slope[i] = dV[i].v;
      }
    });
    const auto curvature = phs::symmetric_eigenvalues(n_, hessian);
    c_.at_most("rest point", norm(phs::linear_solve(n_, hessian, slope)), 1e-8,
               "Newton's step to the critical point of V_d", rest);
    const auto [least, softest] = phs::definiteness(n_, hessian);
    c_.at_least("Hessian of V_d > 0", least, 1e-12,
                "at the rest point, least eigenvalue, its diagonal 1: the softest is '" +
                    c_.coordinates().at(softest) + "'");
    c_.report("curvature of V_d", curvature.front(), "eigenvalues of the Hessian", curvature);
  }
  /// A design for the hanging position may be meant for the upright.
  void rest_without_law(const phs::Model& plant, const Vec& state) {
    const Vec H = hessian(plant, state);
    Vec V;
    for (size_t i = 0; i < n_; ++i)
      V.insert(V.end(), H.begin() + long(2 * n_ * i), H.begin() + long(2 * n_ * i + n_));
    const auto curvature = phs::symmetric_eigenvalues(n_, V);
    const double least = curvature.front(), most = curvature.back();
    if (most > 0 && least >= -1e-9 * most)
      c_.report("rest without the law", least,
                "V of the plant falls nowhere from the rest point: a pendulum hangs there; for the "
                "upright state another rest",
                curvature, state);
  }

 private:
  Vec input_squared() const {  // GᵀG
    Vec GG(m_ * m_);
    for (size_t a = 0; a < m_; ++a)
      for (size_t b = 0; b < m_; ++b)
        for (size_t r = 0; r < n_; ++r)
          GG[a * m_ + b] += s_.input()[r * m_ + a] * s_.input()[r * m_ + b];
    return GG;
  }
  double not_quadratic(phs::System<double>& plant, const Vec& x, const Vec& v) const {
    Vec still = x;
    std::fill(still.begin() + long(n_), still.end(), 0.0);
    double T = 0;
    for (size_t a = 0; a < n_; ++a) T += 0.5 * v[a] * x[n_ + a];
    const double H = plant.hamiltonian(x), V = plant.hamiltonian(still);
    return std::fabs(H - V - T) / (std::fabs(H) + std::fabs(V) + std::fabs(T));
  }
  double not_skew() const {
    const auto J2 = s_.skew_matrix();
    double odd = 0;
    for (size_t a = 0; a < n_; ++a)
      for (size_t b = 0; b < n_; ++b)
        odd = std::max(odd, std::fabs(J2[a * n_ + b] + J2[b * n_ + a]) / (1e-300 + norm(J2)));
    return odd;
  }
  double least_damping() const {
    Vec R(n_ * n_);
    double scale = 1e-300;
    for (size_t a = 0; a < n_; ++a)
      for (size_t b = 0; b < n_; ++b) {
        for (size_t j = 0; j < m_; ++j)
          for (size_t k = 0; k < m_; ++k)
            R[a * n_ + b] += s_.input()[a * m_ + j] * s_.kv()[j * m_ + k] * s_.input()[b * m_ + k];
        scale = std::max(scale, std::fabs(R[a * n_ + b]));
        R[a * n_ + b] += s_.friction()[a * n_ + b];
        scale = std::max(scale, std::fabs(s_.friction()[a * n_ + b]));
      }
    return phs::symmetric_eigenvalues(n_, R).front() / scale;
  }

  MatchedSystem<double>& s_;
  const Region& region_;
  size_t n_, m_;
  Coordinates coordinates_;
  Certificate& c_;
  std::string sampled_;
  Worst kv_{0, {}};
};

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
  MatchedSystem<double> s(*this);
  const Vec rest(rest_.begin(), rest_.begin() + long(shaping_->size()));
  Checks checks(s, options_.region, actuated_.size(), certificate_);
  checks.shape(rest);
  if (!certificate_.holds()) return;  // the other conditions assume it
  checks.matching(*plant_->instantiate<double>(), options_.matching);
  checks.rest_point(*shaping_, rest);
  checks.rest_without_law(*plant_, rest_);
}

}  // namespace porthos::energy_shaping
