#pragma once
#include <vector>

#include "tests/support/linkages.h"

namespace porthos::test {

/// The start in 113 bits: one Newton step from the double start doubles its digits.
inline std::vector<phs::Quad> exact_start(Linkage& l, const mechanics::MechanicalModel& model) {
  const Vec x0 = l.start();
  const auto system = model.instantiate<phs::Quad>();
  const auto rows = system->constraints();
  const size_t m = size_t(rows->count()), nx = x0.size();
  std::vector<phs::Quad> x(x0.begin(), x0.end()), r(m), force(nx), e(nx);
  for (int twice = 0; twice < 3; ++twice) {
    // Positions along M⁻¹Gᵀ: the rates that the impulse -D⁻¹ g gives.
    rows->place(x, r);
    rows->factor(x);
    rows->solve(r);
    rows->forces(r, force);
    std::vector<phs::Quad> y(x.begin(), x.begin() + std::ptrdiff_t(nx / 2));
    for (size_t i = nx / 2; i < nx; ++i) y.push_back(-force[i]);
    system->gradient(y, e);
    for (size_t i = 0; i < nx / 2; ++i) x[i] += e[nx / 2 + i];
  }
  rows->place(x, r);
  rows->factor(x);
  system->gradient(x, e);
  rows->rates(e, r);
  rows->solve(r);
  rows->forces(r, force);
  for (size_t i = 0; i < nx; ++i) x[i] -= force[i];
  return x;
}

}  // namespace porthos::test
