#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "energy_shaping/laws/lqr.h"
#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/runge_kutta.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::energy_shaping {
namespace {

using Direction = std::vector<double>;

/// A random direction, or one within about `size` of another.
Direction random_direction(size_t n, std::mt19937_64& generator, const Direction* near = nullptr,
                           double size = 1) {
  std::normal_distribution<double> normal(0, size / std::sqrt(double(n)));
  Direction z(n);
  double squares = 0;
  for (size_t i = 0; i < n; ++i) {
    z[i] = (near ? (*near)[i] : 0.0) + normal(generator);
    squares += z[i] * z[i];
  }
  for (double& value : z) value /= std::sqrt(squares);
  return z;
}

}  // namespace

/// States at which the cost-to-go has a level, and their rates under the law.
struct Lqr::Shell {
  Shell(const Lqr& of, const std::vector<double>& limits)
      : lqr(of),
        laws(lqr.port_laws(limits)),
        at(port_offsets(lqr.plant_->description(), lqr.actuators_)),
        plant(lqr.plant_->instantiate<double>()),
        n(lqr.rest_.size()),
        L(n * n),
        e(n),
        x(n),
        u(size_t(lqr.plant_->description().nu), 0.0) {
    phs::dense::cholesky(n, lqr.P_.a.data(), L.data());
  }
  /// x = x* + e with V = eᵀP e = level in the direction z of the unit sphere: Lᵀe = √level z. False
  /// if a periodic angle is beyond the middle between two rests.
  bool place(double level, const Direction& z) {
    bool within = true;
    for (size_t i = n; i-- > 0;) {
      e[i] = std::sqrt(level) * z[i];
      for (size_t j = i + 1; j < n; ++j) e[i] -= L[j * n + i] * e[j];
      e[i] /= L[i * n + i];
      x[i] = lqr.rest_[i] + e[i];
      if (lqr.periodic_[i] && std::fabs(e[i]) > std::numbers::pi) within = false;
    }
    return within;
  }
  /// u of the law at y.
  void look(std::span<const double> y) {
    for (size_t j = 0; j < laws.size(); ++j)
      (*laws[j].law)(0.0, y, {}, std::span(u).subspan(size_t(at[j]), 1));
  }
  /// dx at y.
  void rates(std::span<const double> y, std::span<double> dx) {
    look(y);
    plant->field(0.0, y, u, dx);
  }

  const Lqr& lqr;
  std::vector<PortLaw> laws;
  std::vector<int> at;
  std::unique_ptr<phs::System<double>> plant;
  size_t n;
  std::vector<double> L, e, x, u;
};

double Lqr::falling_level(const std::vector<double>& limits) const {
  Shell shell(*this, limits);
  const size_t n = shell.n;
  std::vector<double> dx(n);
  // ½ V'/√level = zᵀLᵀx'; infinite beyond the middle between two rests of a periodic angle.
  const auto rise = [&](double level, const Direction& z) {
    if (!shell.place(level, z)) return HUGE_VAL;
    shell.rates(shell.x, dx);
    double rate = 0;
    for (size_t i = 0; i < n; ++i)
      for (size_t j = i; j < n; ++j) rate += z[i] * shell.L[j * n + i] * dx[j];
    return rate;
  };
  std::mt19937_64 generator(1);
  std::vector<Direction> directions;
  double first = HUGE_VAL;  // a shell within 1e-3 of a unit of the rest
  for (int i = 0; i < 400; ++i) {
    directions.push_back(random_direction(n, generator));
    shell.place(1, directions.back());
    for (const double part : shell.e) first = std::fmin(first, 1e-6 / (part * part));
  }
  const auto falls = [&](double level) {
    Direction worst;
    double most = -HUGE_VAL;
    const auto take = [&](const Direction& z) {
      const double value = rise(level, z);
      if (value <= most) return;  // not a number is the worst
      most = value;
      worst = z;
    };
    for (const auto& z : directions) take(z);
    for (double size = 0.5; size > 0.01; size *= 0.8)
      for (int trial = 0; trial < 10; ++trial) take(random_direction(n, generator, &worst, size));
    directions.push_back(worst);  // where the next shell begins to climb
    return most < 0;
  };
  double level = 0;
  for (double next = first; next < first * 1e12 && falls(next); next *= 1.1) level = next;
  return level;
}

int Lqr::lost(double level, double falling, const std::vector<double>& limits, double period,
              int starts) const {
  Shell shell(*this, limits);
  const size_t n = shell.n;
  // a held law's steps fill its periods
  const double parts = std::ceil(8 * period / fastest_),
               h = period > 0 ? period / parts : fastest_ / 8;
  std::mt19937_64 generator(1);
  RungeKutta<double> kutta(n);
  // What is beyond the middle of a periodic angle has another V, that of the nearest rest: no start
  const auto start = [&] {
    for (int tries = 0; tries < 100000; ++tries)
      if (shell.place(level, random_direction(n, generator))) return true;
    return false;
  };
  const auto returns = [&] {
    if (!start()) return false;
    int part = 0;
    for (double t = 0; t < 10 * slowest_; t += h, ++part) {
      if (period > 0 && part % int(parts) == 0) shell.look(shell.x);
      kutta.step(h, shell.x, [&](const auto& y, auto& dx) {
        if (period > 0)
          shell.plant->field(0.0, y, shell.u, dx);
        else
          shell.rates(y, dx);
      });
      const double V = cost_to_go(shell.x);
      if (!std::isfinite(V)) return false;
      if (V < falling) return true;
    }
    return false;
  };
  int lost = 0;
  for (int i = 0; i < starts; ++i) lost += !returns();
  return lost;
}

}  // namespace porthos::energy_shaping
