// The cost of the dynamics is linear in the number of bodies: cost per body from 10 to 1000 bodies within ±20 % of the mean.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "bench/chain.h"
#include "mechanics/aba.h"
#include "mechanics/momentum.h"

namespace porthos::mechanics::cost_test {
namespace {

/// Shortest of many batches [ns per call]: the machine's noise only ever adds.
template <class F>
double nanoseconds(F&& call, int calls) {
  double best = HUGE_VAL;
  for (int batch = 0; batch < 60; ++batch) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) call();
    best = std::min(
        best,
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() /
            calls);
  }
  return best;
}

TEST(Cost, PerBodyIsConstantFrom10To1000Bodies) {
  std::vector<double> field, forward;
  for (int n : {10, 30, 100, 300, 1000}) {
    const auto m = bench::chain(n, false);
    Workspace<double> w(*m);
    const auto q = bench::configuration(*m), v = bench::numbers(size_t(m->nv()), 1);
    std::vector<double> p(q.size()), q_dot(q), p_dot(q), a(v);
    momenta_from_rates<double>(*m, w, q, v, p);
    const int calls = std::max(1, 2000 / n);
    field.push_back(
        nanoseconds([&] { hamiltonian_field<double>(*m, w, q, p, {}, q_dot, p_dot); }, calls) / n);
    forward.push_back(nanoseconds([&] { aba<double>(*m, w, q, v, {v, {}}, a); }, calls) / n);
    std::printf("  %4d bodies: field %5.1f ns per body, ABA %5.1f ns per body\n", n, field.back(),
                forward.back());
  }
  for (const auto& cost : {field, forward}) {
    const auto [low, high] = std::minmax_element(cost.begin(), cost.end());
    EXPECT_LE(*high / *low, 1.2 / 0.8);
  }
}

}  // namespace
}  // namespace porthos::mechanics::cost_test
