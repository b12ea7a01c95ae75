// The cost of the dynamics is linear in the number of bodies: operations per body, counted exactly,
// from 10 to 1000 bodies within ±20 % of the mean. What the clock says of it is in
// docs/benchmarks.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/chain.h"
#include "bench/kernels/counted.h"
#include "mechanics/aba-inl.h"
#include "mechanics/crba-inl.h"
#include "mechanics/hamiltonian_field-inl.h"

namespace porthos::mechanics::cost_test {
namespace {

using bench::Counted;

struct Costs {
  double field, forward, mass_matrix;
};

/// Operations per body of a chain of n.
Costs costs_of(int n) {
  const auto m = bench::chain(n, false);
  Workspace<Counted> w(*m);
  const auto counted = [](const std::vector<double>& x) {
    return std::vector<Counted>(x.begin(), x.end());
  };
  const auto q = counted(bench::configuration(*m)), v = counted(bench::numbers(size_t(m->nv()), 1));
  auto p = counted(bench::numbers(q.size(), 1));
  std::vector<Counted> q_dot(q), p_dot(q), a(v), M(v.size() * v.size());
  const auto per_body = [&](auto&& call) { return double(bench::count(call).total()) / n; };
  return {per_body([&] { hamiltonian_field<Counted>(*m, w, q, p, {}, q_dot, p_dot); }),
          per_body([&] {
            aba<Counted>(*m, w, q, v, {v, {}}, a);
          }),
          n > 100 ? 0 : per_body([&] { crba<Counted>(*m, w, q, M); })};
}

TEST(Cost, PerBodyIsConstantFrom10To1000Bodies) {
  std::vector<double> field, forward, mass_matrix;
  for (int n : {10, 30, 100, 300, 1000}) {
    const Costs c = costs_of(n);
    field.push_back(c.field);
    forward.push_back(c.forward);
    mass_matrix.push_back(c.mass_matrix);
    std::printf("  %4d bodies: operations per body, field %.1f, ABA %.1f, mass matrix %.1f\n", n,
                c.field, c.forward, c.mass_matrix);
    EXPECT_GT(c.field, 100) << "the counter counts";
  }
  for (const auto& cost : {field, forward}) {
    const auto [low, high] = std::minmax_element(cost.begin(), cost.end());
    EXPECT_LE(*high / *low, 1.2 / 0.8);
  }
  EXPECT_GT(mass_matrix[2] / mass_matrix[0], 1.2 / 0.8) << "the control: it is of order n²";
}

}  // namespace
}  // namespace porthos::mechanics::cost_test
