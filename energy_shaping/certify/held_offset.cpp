#include "energy_shaping/certify/detail/held_offset.h"

#include <algorithm>
#include <cmath>

#include "energy_shaping/certify/detail/region.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {

HeldOffset::HeldOffset(const ClosedLoop& loop, phs::System<double>& system, std::vector<double> K)
    : loop_(loop), system_(system), n_(loop.rest().size() / 2), K_(std::move(K)) {
  if (has_quaternions(loop)) return;
  double stiffest = 0;
  for (size_t i = 0; i < n_; ++i) stiffest = std::max(stiffest, this->K(i, i));
  for (size_t i = 0; i < n_; ++i)
    if (this->K(i, i) > 1e-12 * stiffest) held_.push_back(i);
  std::vector<double> scaled;
  for (const size_t i : held_)
    for (const size_t j : held_)
      scaled.push_back(this->K(i, j) / std::sqrt(this->K(i, i) * this->K(j, j)));
  if (held_.empty() || phs::symmetric_eigenvalues(held_.size(), scaled)[0] < 1e-9) held_.clear();
}

double HeldOffset::operator()(const std::vector<double>& x) {
  if (held_.empty()) return 0;
  std::vector<double> d(n_);
  for (const size_t i : held_) d[i] = x[i] - loop_.rest()[i];
  for (const auto& b : loop_.plant().description().blocks)
    if (b.kind == phs::BlockKind::angle && size_t(b.at) < n_) d[size_t(b.at)] -= turns(b, d);
  double sum = 0;
  for (const size_t i : held_)
    for (const size_t j : held_) sum += 0.5 * d[i] * K(i, j) * d[j];
  return sum;
}

/// The full turns in an offset, or 0 where H_d is another after them.
double HeldOffset::turns(const phs::Block& b, const std::vector<double>& d) const {
  const auto i = size_t(b.at);
  const double turn = 2 * std::acos(-1.0), whole = turn * std::round(d[i] / turn);
  std::vector<double> x = loop_.rest();
  const double rest = system_.hamiltonian(x);
  x[i] += whole;
  return system_.hamiltonian(x) - rest < 1e-9 * K(i, i) ? whole : 0;
}

}  // namespace porthos::energy_shaping
