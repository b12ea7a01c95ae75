#include "vsa/minimum_energy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "phs/error.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::vsa {
namespace {

constexpr size_t unknowns = 12, degree = unknowns + 3, places = 64;
using Powers = std::array<double, degree + 1>;
using Coefficients = std::array<double, unknowns>;

/// Value or derivative of a polynomial of u.
template <class T, class P>
T evaluate(const P& powers, int order, const T& u) {
  T sum(0.0);
  for (size_t k = powers.size(); k-- > size_t(order);) {
    double factor = powers[k];
    for (int d = 0; d < order; ++d) factor *= double(k) - d;
    sum = sum * u + T(factor);
  }
  return sum;
}

/// (1 - u²)² P_k(u), with Legendre's P_k: zero value and slope at both ends.
std::array<Powers, unknowns> make_basis() {
  std::array<Powers, unknowns> legendre{}, basis{};
  legendre[0][0] = legendre[1][1] = 1;
  for (size_t k = 1; k + 1 < unknowns; ++k)
    for (size_t i = 0; i <= k + 1; ++i)
      legendre[k + 1][i] = ((i > 0 ? double(2 * k + 1) * legendre[k][i - 1] : 0.0) -
                            double(k) * legendre[k - 1][i]) /
                           double(k + 1);
  for (size_t k = 0; k < unknowns; ++k)
    for (size_t i = 0; i <= k; ++i) {
      basis[k][i] += legendre[k][i];
      basis[k][i + 2] -= 2 * legendre[k][i];
      basis[k][i + 4] += legendre[k][i];
    }
  return basis;
}

/// Solves a x = b, a symmetric; false unless a is positive definite.
bool solve(std::array<Coefficients, unknowns> a, Coefficients& b) {
  double* const A = a[0].data();
  phs::dense::cholesky(unknowns, A, A);
  for (size_t j = 0; j < unknowns; ++j)
    if (!(a[j][j] > 0)) return false;
  phs::dense::solve(unknowns, A, b.data(), b.data());
  return true;
}

class Search {
 public:
  Search(const Elastic& e, double inertia, double damping, const StiffnessChange& c)
      : e_(e), J_(inertia), d_(damping), c_(c) {
    for (size_t i = 0; i < places; ++i) {  // Fejér's first rule on [-1, 1]
      const double angle = std::numbers::pi * (double(i) + 0.5) / places;
      double sum = 0;
      for (size_t j = 1; j <= places / 2; ++j)
        sum += std::cos(2 * double(j) * angle) / (4 * double(j * j) - 1);
      u_[i] = -std::cos(angle);
      weight_[i] = c.duration / places * (1 - 2 * sum);
      for (size_t k = 0; k < unknowns; ++k)
        for (int order = 0; order < 3; ++order)
          at_[i][k][size_t(order)] = scale(order) * evaluate(basis_[k], order, u_[i]);
    }
  }

  struct Costs {
    double friction = 0, winding = 0, peak = 0;
    double sum() const { return friction + winding; }
  };
  Costs costs(const Coefficients& a) const {
    Costs r;
    for (size_t i = 0; i < places; ++i) {
      const auto s = motion(a, i);
      const double torque = torque_of(s, e_.slopes(c_.deflection, 0.0, s[0]).sigma);
      r.friction += weight_[i] * d_ * s[1] * s[1];
      r.winding += weight_[i] * c_.winding_loss * torque * torque;
      r.peak = std::max(r.peak, std::fabs(torque));
    }
    return r;
  }

  /// Finds the best coefficients. @return the remaining gradient, relative to its terms
  double run(Coefficients& a) const {
    double left = HUGE_VAL;
    for (int sweep = 0; sweep < 60; ++sweep) {
      std::array<Coefficients, unknowns> exact{}, gauss{};
      Coefficients slope{}, terms{};
      for (size_t i = 0; i < places; ++i) add_place(a, i, exact, gauss, slope, terms);
      double now = 0;
      for (size_t k = 0; k < unknowns; ++k)
        if (terms[k] > 0) now = std::max(now, std::fabs(slope[k]) / terms[k]);
      if (now < 1e-10 && now >= 0.5 * left) return now;
      left = now;
      Coefficients step = slope;
      if (!solve(exact, step)) {
        step = slope;
        if (!solve(gauss, step)) break;
      }
      const double before = costs(a).sum();
      Coefficients next;
      for (double part = 1;; part /= 2) {
        for (size_t k = 0; k < unknowns; ++k) next[k] = a[k] - part * step[k];
        if (costs(next).sum() <= before * (1 + 1e-13) || part < 1e-9) break;
      }
      a = next;
    }
    return left;
  }

  std::array<double, 3> motion(const Coefficients& a, size_t i) const {
    std::array<double, 3> s;
    for (int order = 0; order < 3; ++order) {
      s[size_t(order)] = scale(order) * evaluate(base(), order, u_[i]);
      for (size_t k = 0; k < unknowns; ++k) s[size_t(order)] += a[k] * at_[i][k][size_t(order)];
    }
    return s;
  }
  std::vector<double> powers(const Coefficients& a) const {
    const Powers b = base();
    std::vector<double> sum(b.begin(), b.end());
    for (size_t k = 0; k < unknowns; ++k)
      for (size_t i = 0; i <= degree; ++i) sum[i] += a[k] * basis_[k][i];
    return sum;
  }

 private:
  double scale(int order) const { return std::pow(2 / c_.duration, order); }
  /// The cubic between the ends.
  Powers base() const {
    const double mean = (c_.from + c_.to) / 2, half = (c_.to - c_.from) / 2;
    return {mean, 1.5 * half, 0, -0.5 * half};
  }
  double torque_of(const std::array<double, 3>& s, double spring) const {
    return J_ * s[2] + d_ * s[1] + spring;
  }
  void add_place(const Coefficients& a, size_t i, std::array<Coefficients, unknowns>& exact,
                 std::array<Coefficients, unknowns>& gauss, Coefficients& slope,
                 Coefficients& terms) const {
    const auto s = motion(a, i);
    const double phi = c_.deflection;
    const double torque = torque_of(s, e_.slopes(phi, 0.0, s[0]).sigma);
    const double bend = e_.hessian(phi, 0, s[0])[2][2];
    // The third derivative; it affects only the speed of Newton's iteration.
    const double eps = 1e-5 * (std::fabs(c_.to - c_.from) + 1e-3);
    const double third =
        (e_.hessian(phi, 0, s[0] + eps)[2][2] - e_.hessian(phi, 0, s[0] - eps)[2][2]) / (2 * eps);
    const double of_torque = 2 * c_.winding_loss * weight_[i], of_rate = 2 * d_ * weight_[i];
    Coefficients dt;
    for (size_t k = 0; k < unknowns; ++k) {
      const auto& b = at_[i][k];
      dt[k] = J_ * b[2] + d_ * b[1] + bend * b[0];
      const double x = of_torque * torque * dt[k], y = of_rate * s[1] * b[1];
      slope[k] += x + y;
      terms[k] += std::fabs(x) + std::fabs(y);
    }
    for (size_t k = 0; k < unknowns; ++k)
      for (size_t l = 0; l < unknowns; ++l) {
        const double g = of_torque * dt[k] * dt[l] + of_rate * at_[i][k][1] * at_[i][l][1];
        gauss[k][l] += g;
        exact[k][l] += g + of_torque * torque * third * at_[i][k][0] * at_[i][l][0];
      }
  }

  const Elastic& e_;
  double J_, d_;
  StiffnessChange c_;
  std::array<Powers, unknowns> basis_ = make_basis();
  std::array<double, places> u_, weight_;
  std::array<std::array<std::array<double, 3>, unknowns>, places> at_;
};

void check(const ElasticPtr& e, const Drive& d, const StiffnessChange& c) {
  const auto refuse = [](const std::string& why) {
    throw InvalidArgument("minimum-energy change of stiffness: " + why);
  };
  if (!e) refuse("has no elastic energy, expected a device or a family");
  const auto& t = e->traits();
  if (!t.translation_invariant || t.sigma.empty())
    refuse(
        fmt::format("the energy of '{}' {}, expected one of deflection and sigma", t.family,
                    t.sigma.empty() ? "does not depend on sigma" : "is not translation invariant"));
  if (d.kind != Drive::Kind::torque) refuse("sigma has no torque drive, expected one");
  if (!(d.inertia > 0 && d.inertia < HUGE_VAL))
    refuse(fmt::format("inertia is {}, expected more than 0 kg m^2", d.inertia));
  if (d.friction || d.torque_limit < HUGE_VAL || d.rate_limit < HUGE_VAL)
    refuse("the drive has a friction law or a limit, expected viscous friction only");
  if (!(c.duration > 0 && c.duration < HUGE_VAL))
    refuse(fmt::format("the duration is {}, expected more than 0 s", c.duration));
  if (!(c.winding_loss > 0 && c.winding_loss < HUGE_VAL))
    refuse(
        fmt::format("winding_loss is {}, expected more than 0 W/(N m)^2: without it the least is "
                    "not attained",
                    c.winding_loss));
  e->require_inside("minimum-energy change of stiffness, start", c.deflection, 0, c.from);
  e->require_inside("minimum-energy change of stiffness, end", c.deflection, 0, c.to);
}

}  // namespace

double StiffnessPlan::derivative(int order, double t) const {
  return std::pow(2 / duration, order) * evaluate(powers, order, 2 * t / duration - 1);
}

StiffnessPlan minimum_energy_change(const ElasticPtr& e, const Drive& drive,
                                    const StiffnessChange& c) {
  check(e, drive, c);
  const double n2 = drive.gear * drive.gear, J = n2 * drive.inertia, d = n2 * drive.viscous;
  const Search search(*e, J, d, c);
  Coefficients a{};
  StiffnessPlan plan;
  plan.stationarity = search.run(a);
  if (!(plan.stationarity < 1e-8))
    throw InvalidArgument(fmt::format(
        "minimum-energy change of stiffness: the search stays at a relative slope of {:.1e}, "
        "expected 1e-8 or less: a smoother energy, or a shorter duration",
        plan.stationarity));
  const auto costs = search.costs(a);
  plan.duration = c.duration;
  plan.powers = search.powers(a);
  plan.friction = costs.friction;
  plan.winding = costs.winding;
  plan.peak_torque = costs.peak;
  plan.spring = e->energy(c.deflection, 0.0, c.to) - e->energy(c.deflection, 0.0, c.from);
  const Limits& l = e->traits().limits;
  for (size_t i = 0; i < places; ++i)
    if (const double s = search.motion(a, i)[0]; s < l.sigma_lower || s > l.sigma_upper)
      throw InvalidArgument(fmt::format(
          "minimum-energy change of stiffness: the best path passes sigma = {:.6g}, expected it to "
          "stay from {} to {}: a shorter duration",
          s, l.sigma_lower, l.sigma_upper));
  plan.torque = phs::function([e, p = plan.powers, phi = c.deflection, T = c.duration, J,
                               d](auto t) {
    using S = decltype(t);
    using phs::max, phs::min, phs::select;
    const S u = min(max(S(S(2 / T) * t - S(1.0)), S(-1.0)), S(1.0)), zero(0.0);
    const auto moving = (S(0.0) < t) & (t < S(T));
    const S sigma = evaluate(p, 0, u), v = S(2 / T) * evaluate(p, 1, u),
            w = S(4 / (T * T)) * evaluate(p, 2, u);
    return S(select(moving, S(S(J) * w + S(d) * v), zero) + e->slopes(S(phi), zero, sigma).sigma);
  });
  return plan;
}

}  // namespace porthos::vsa
