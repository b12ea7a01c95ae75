#include <cmath>
#include <numbers>
#include <random>

#include "energy_shaping/closed_loop.h"
#include "energy_shaping/lqr.h"
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

double Lqr::falling_level(const std::vector<double>& limits) const {
  const auto laws = port_laws(limits);
  const auto& d = plant_->description();
  const auto at = port_offsets(d, actuators_);
  const auto f = plant_->instantiate<double>();
  const size_t n = rest_.size();
  std::vector<double> L(n * n), e(n), x(n), dx(n), u(size_t(d.nu), 0.0);
  phs::dense::cholesky(n, P_.a.data(), L.data());

  // e with V = eᵀP e = level in the direction z of the unit sphere: Lᵀe = √level z.
  const auto error_at = [&](double level, const Direction& z) {
    for (size_t i = n; i-- > 0;) {
      e[i] = std::sqrt(level) * z[i];
      for (size_t j = i + 1; j < n; ++j) e[i] -= L[j * n + i] * e[j];
      e[i] /= L[i * n + i];
    }
  };
  // ½ V'/√level = zᵀLᵀx'; infinite beyond the middle between two rests of a periodic angle.
  const auto rise = [&](double level, const Direction& z) {
    error_at(level, z);
    for (size_t i = 0; i < n; ++i) {
      if (periodic_[i] && std::fabs(e[i]) > std::numbers::pi) return HUGE_VAL;
      x[i] = rest_[i] + e[i];
    }
    for (size_t j = 0; j < laws.size(); ++j)
      (*laws[j].law)(0.0, std::span<const double>(x), {}, std::span(u).subspan(size_t(at[j]), 1));
    f->field(0.0, x, u, dx);
    double rate = 0;
    for (size_t i = 0; i < n; ++i)
      for (size_t j = i; j < n; ++j) rate += z[i] * L[j * n + i] * dx[j];
    return rate;
  };
  std::mt19937_64 generator(1);
  std::vector<Direction> directions;
  double first = HUGE_VAL;  // a shell within 1e-3 of a unit of the rest
  for (int i = 0; i < 400; ++i) {
    directions.push_back(random_direction(n, generator));
    error_at(1, directions.back());
    for (const double part : e) first = std::fmin(first, 1e-6 / (part * part));
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

}  // namespace porthos::energy_shaping
