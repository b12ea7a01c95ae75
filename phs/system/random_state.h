#pragma once
#include <cmath>
#include <random>
#include <vector>

#include "phs/system/description.h"

namespace porthos::phs {

/// A state of normally distributed numbers with standard deviation `spread`. Rotation blocks are
/// unit quaternions ξ with ξ·π = 0.
template <class Generator>
std::vector<double> random_state(const Description& d, double spread, Generator& generator) {
  std::normal_distribution<double> normal;
  std::vector<double> x(size_t(d.nx));
  for (auto& v : x) v = spread * normal(generator);
  for (const auto& b : d.blocks) {
    if (b.kind != BlockKind::rotation) continue;
    double* xi = x.data() + b.at;
    double norm2 = 0;
    for (int i = 0; i < 4; ++i) norm2 += xi[i] * xi[i];
    for (int i = 0; i < 4; ++i) xi[i] /= std::sqrt(norm2);
    if (b.momentum < 0) continue;
    double* pi = x.data() + b.momentum;
    double along = 0;
    for (int i = 0; i < 4; ++i) along += xi[i] * pi[i];
    for (int i = 0; i < 4; ++i) pi[i] -= along * xi[i];
  }
  return x;
}

}  // namespace porthos::phs
