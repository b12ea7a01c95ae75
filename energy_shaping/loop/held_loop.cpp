#include "energy_shaping/loop/held_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/loop/closed_loop.h"
#include "mechanics/crba.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/scalars/derivative.h"
#include "phs/system/constraints.h"

namespace porthos::energy_shaping {
namespace {

using phs::Matrix;

/// The largest |z| of x(k + 1) = Φ x(k) + Γ u(k), u(k) = -K x(k - delay), over periods of h.
double radius(const HeldLoop& of, double h, int delay) {
  const auto& [A, B, K] = of;
  const int n = A.rows, m = B.cols, all = n + m * delay;
  Matrix plant(n + m, n + m);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) plant(i, j) = h * A(i, j);
    for (int j = 0; j < m; ++j) plant(i, n + j) = h * B(i, j);
  }
  plant.a = phs::exponential(size_t(n + m), plant.a);
  // (x, what is under way): the oldest torque acts, -K x is the youngest.
  Matrix loop(all, all);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      loop(i, j) = plant(i, j);
      for (int k = 0; k < m && delay == 0; ++k) loop(i, j) -= plant(i, n + k) * K(k, j);
    }
  for (int k = 0; k < m && delay > 0; ++k) {
    for (int i = 0; i < n; ++i) loop(i, n + k) = plant(i, n + k);
    for (int j = 0; j < n; ++j) loop(all - m + k, j) = -K(k, j);
  }
  for (int i = n; i < all - m; ++i) loop(i, i + m) = 1;
  for (int i = 0; i < all; ++i) loop(i, i) -= 1;  // z - 1: what stays where it is has zeros
  double most = 0;
  for (const auto& z : phs::spectrum(size_t(all), loop.a, 1e-11).rest)
    most = std::isnan(std::abs(z)) ? HUGE_VAL : std::max(most, std::abs(1.0 + z));
  return most;
}

/// q'' = M⁻¹ p' at rest has a slope of M(q) too where the plant accelerates: -M⁻¹ (∂M/∂q_j) q''.
/// @param to_rates  M⁻¹ behind the coordinates
void add_change_of_inertia(const mechanics::MechanicalModel& plant, const std::vector<double>& x,
                           std::span<const double> u, const Matrix& to_rates, Matrix& A) {
  const auto& m = plant.mechanism();
  const int n = m.nq();
  std::vector<double> in(u.begin(), u.end()), dx(x.size());
  in.resize(size_t(plant.description().nu));
  plant.instantiate<double>()->field(0.0, x, in, dx);
  const auto rates = [&](std::vector<double> momenta) {
    Matrix column(2 * n, 1);
    column.a = std::move(momenta);
    return (to_rates * column).a;
  };
  const auto acceleration = rates(dx);  // behind q', which is 0
  mechanics::Workspace<phs::Dual> w(m);
  std::vector<phs::Dual> q(x.begin(), x.begin() + n), M(size_t(n) * size_t(n));
  phs::along_each(q, [&](size_t j) {
    mechanics::crba<phs::Dual>(m, w, q, M);
    std::vector<double> force(x.size(), 0.0);
    for (int k = 0; k < n; ++k)
      for (int i = 0; i < n; ++i)
        force[size_t(n + i)] += M[size_t(i + n * k)].d * acceleration[size_t(n + k)];
    const auto slope = rates(force);
    for (int i = n; i < 2 * n; ++i) A(i, int(j)) -= slope[size_t(i)];
  });
}

}  // namespace

LinearPlant linear_plant(const phs::Model& plant, std::span<const double> x,
                         std::span<const double> u) {
  const auto& d = plant.description();
  phs::refuse_constraints(d, "a linearisation");
  if (!plant.holds().empty())
    throw InvalidArgument("a linearisation takes no sampled law, and '" +
                          plant.holds().front()->name +
                          "' is one, expected the continuous law or the plant alone");
  require_size("x", x.size(), size_t(d.nx));
  if (!u.empty()) require_size("u", u.size(), size_t(d.nu));
  LinearPlant of{Matrix(d.nx, d.nx), Matrix(d.nx, d.nu)};
  const auto system = plant.instantiate<phs::Dual>();
  std::vector<phs::Dual> at(x.begin(), x.end()), in(u.begin(), u.end()), dx(x.size());
  in.resize(size_t(d.nu));
  const auto column = [&](Matrix& M, size_t j) {
    system->field(phs::Dual(0.0), at, in, dx);
    for (size_t i = 0; i < dx.size(); ++i) M(int(i), int(j)) = dx[i].d;
  };
  phs::along_each(at, [&](size_t j) { column(of.A, j); });
  phs::along_each(in, [&](size_t j) { column(of.B, j); });
  return of;
}

LinearPlant linear_plant_in_rates(const mechanics::MechanicalModel& plant,
                                  std::span<const double> q, std::span<const double> u) {
  const auto& m = plant.mechanism();
  for (const auto& c : m.coordinates())
    if (c.nq != 1)
      throw InvalidArgument("a linearisation in rates takes joints of one degree of freedom; '" +
                            c.joint + "' has several");
  const int n = m.nq();
  require_size("q", q.size(), size_t(n));
  std::vector<double> x(q.begin(), q.end());
  x.resize(2 * x.size(), 0.0);
  const LinearPlant of = linear_plant(plant, x, u);
  // at rest δp = M δv
  Matrix in = Matrix::identity(2 * n), out = in;
  mechanics::Workspace<double> w(m);
  std::vector<double> mass(size_t(n) * size_t(n));
  mechanics::crba<double>(m, w, q, mass);
  for (int j = 0; j < n; ++j) {
    std::vector<double> unit(size_t(n), 0.0);
    unit[size_t(j)] = 1;
    const auto column = phs::linear_solve(size_t(n), mass, unit);
    for (int i = 0; i < n; ++i) {
      in(n + i, n + j) = mass[size_t(i + n * j)];
      out(n + i, n + j) = column[size_t(i)];
    }
  }
  LinearPlant rates{out * of.A * in, out * of.B};
  add_change_of_inertia(plant, x, u, out, rates.A);
  return rates;
}

std::string unbalanced(const mechanics::MechanicalModel& plant, std::span<const double> q,
                       std::span<const double> u) {
  const auto& m = plant.mechanism();
  std::vector<double> x(q.begin(), q.end()), in(u.begin(), u.end()), dx(2 * q.size());
  x.resize(dx.size(), 0.0);
  const LinearPlant of = linear_plant(plant, x, u);
  in.resize(size_t(of.B.cols));
  plant.instantiate<double>()->field(0.0, x, in, dx);
  const double weight = m.total_mass() * mechanics::norm(m.gravity());  // on an arm of 1 m
  UnheldForce left;
  for (const auto& c : m.coordinates()) {
    const int row = m.nq() + c.v;
    double terms = weight;
    for (int j = 0; j < m.nq(); ++j)
      terms += std::fabs(of.A(row, j)) * std::fmax(1, std::fabs(x[size_t(j)]));
    for (int k = 0; k < of.B.cols; ++k) terms += std::fabs(of.B(row, k) * in[size_t(k)]);
    if (const double force = dx[size_t(row)]; !(std::fabs(force) <= 1e-9 * terms))
      left.take(force, c.joint);
  }
  if (left.joint.empty()) return "";
  return fmt::format(
      "the state is no equilibrium: a force or torque of {:.3g} is left at '{}'; A and B are of a "
      "motion there, and their eigenvalues tell nothing of stability",
      left.size, left.joint);
}

HeldLoop held_loop(const phs::Model& plant, const std::vector<PortLaw>& laws,
                   std::span<const double> x) {
  const auto& d = plant.description();
  auto [A, B] = linear_plant(plant, x);
  HeldLoop loop{std::move(A), std::move(B), Matrix(d.nu, d.nx)};
  std::vector<phs::Dual> at(x.begin(), x.end());
  for (const PortLaw& law : laws) {
    const auto& port = find_named(d.ports, law.port, "there is no port");
    std::vector<phs::Dual> y(size_t(port.size)), force(y);
    phs::along_each(at, [&](size_t j) {
      (*law.law)(phs::Dual(0.0), at, y, force);
      for (int k = 0; k < port.size; ++k) loop.K(port.at + k, int(j)) = -force[size_t(k)].d;
    });
  }
  return loop;
}

void certify_sampled(Certificate& certificate, const HeldLoop& loop, double period, int delay) {
  constexpr double bound = 1 + 1e-6;
  const auto holds_at = [&](double rate) { return radius(loop, 1 / rate, delay) <= bound; };
  const double rate = 1 / period, now = radius(loop, period, delay);
  std::string text = fmt::format("largest |z| of the linearised loop at rate = {:.6g} Hz", rate);
  if (delay > 0) text += fmt::format(" with a delay of {} periods", delay);
  if (!(now <= bound)) {
    double low = rate, high = 2 * rate;
    for (int i = 0; i < 40 && !holds_at(high); ++i) {
      low = high;
      high *= 2;
    }
    for (int i = 0; i < 20; ++i) {
      const double middle = std::sqrt(low * high);
      (holds_at(middle) ? high : low) = middle;
    }
    const double digit = std::pow(10, std::floor(std::log10(high)) - 2);
    text += fmt::format(", whose torques are held: a rate of {:.6g} Hz would do",
                        std::ceil(high / digit) * digit);
  } else {
    text += "; below 1 small motions die out from hold to hold";
  }
  certificate.all_at_most("sampled", now, bound, text);
}

}  // namespace porthos::energy_shaping
