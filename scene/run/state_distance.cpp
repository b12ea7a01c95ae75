#include "scene/run/state_distance.h"

#include <algorithm>
#include <cmath>

namespace porthos::scene {

using phs::BlockKind;

void StateScale::see(std::span<const double> x) {
  const auto widen = [&](int at, int size, double& largest) {
    for (int k = at; k < at + size; ++k)
      if (std::isfinite(x[size_t(k)])) largest = std::max(largest, std::fabs(x[size_t(k)]));
  };
  const auto fill = [&](int at, int size, double unit) {
    std::fill_n(weight_.begin() + at, size, unit > 0 ? 1 / unit : 1.0);
  };
  const auto alone = [](const phs::Block& b) {
    return b.kind == BlockKind::linear && b.momentum < 0;
  };
  for (const auto& b : d_.blocks) {
    if (alone(b)) {
      double largest = 1 / weight_[size_t(b.at)];
      widen(b.at, b.size, largest);
      fill(b.at, b.size, largest);
    } else if (b.kind == BlockKind::linear) {
      widen(b.at, b.size, largest_position_);
    }
    if (b.momentum >= 0) widen(b.momentum, b.size, largest_momentum_);
  }
  for (const auto& b : d_.blocks) {
    if (b.kind == BlockKind::linear && !alone(b)) fill(b.at, b.size, largest_position_);
    if (b.momentum >= 0) fill(b.momentum, b.size, largest_momentum_);
  }
}

std::vector<long double> unwrapped(const phs::Description& d, const phs::State& s) {
  constexpr long double two_pi = 6.283185307179586476925286766559005768394L;
  std::vector<long double> x(s.x.begin(), s.x.end());
  for (size_t k = 0; k < x.size(); ++k) x[k] += s.lo[k];
  size_t turn = 0;
  for (const auto& b : d.blocks)
    if (b.kind == BlockKind::angle) x[size_t(b.at)] += two_pi * (long double)(s.turns[turn++]);
  return x;
}

double distance(const StateScale& scale, std::span<const long double> a,
                std::span<const long double> b) {
  double worst = 0;
  for (size_t k = 0; k < a.size(); ++k) {
    const double off = std::fabs(double(a[k] - b[k])) * scale.weight(k);
    if (!(off <= worst)) worst = off;  // keeps a NaN
  }
  return worst;
}

}  // namespace porthos::scene
