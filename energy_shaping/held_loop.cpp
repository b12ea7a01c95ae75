#include "energy_shaping/held_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/scalars/derivative.h"

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

}  // namespace

HeldLoop held_loop(const phs::Model& plant, const std::vector<PortLaw>& laws,
                   std::span<const double> x) {
  const auto& d = plant.description();
  const int n = d.nx;
  HeldLoop loop{Matrix(n, n), Matrix(n, d.nu), Matrix(d.nu, n)};
  loop.A.a = field_jacobian(plant, x);
  const auto system = plant.instantiate<double>();
  std::vector<double> u(size_t(d.nu)), dx(x.size());
  for (int k = 0; k < d.nu; ++k) {
    u[size_t(k)] = 1;
    system->apply_input(x, u, dx);
    u[size_t(k)] = 0;
    for (int i = 0; i < n; ++i) loop.B(i, k) = dx[size_t(i)];
  }
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
  }
  certificate.at_most("sampled", now, bound, text);
}

}  // namespace porthos::energy_shaping
