// Batches over lanes and threads: each run has the bits it has alone.
#include "ensemble/batch.h"

#include <cmath>
#include <cstring>
#include <random>

#include "phs/random_state.h"
#include "phs/tunable.h"
#include "phs/user_model.h"
#include "tests/support/bounds.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/robots.h"

namespace porthos::ensemble {
namespace {

using integrators::Outcome;
using test::keeps, test::breaks, test::refusal;

bool same_bits(const phs::State& a, const phs::State& b) {
  return a.x.size() == b.x.size() &&
         std::memcmp(a.x.data(), b.x.data(), a.x.size() * sizeof(double)) == 0 &&
         std::memcmp(a.lo.data(), b.lo.data(), a.lo.size() * sizeof(double)) == 0 &&
         a.turns == b.turns && a.step == b.step;
}

std::vector<BatchResult> one_by_one(const phs::Model& model, const std::string& method, double h,
                                    std::int64_t steps,
                                    const std::vector<std::vector<double>>& starts) {
  std::vector<BatchResult> results;
  for (const auto& x : starts) {
    const auto one = integrators::make_integrator(method, model, h, {.books = false});
    BatchResult r{phs::State(model.description(), x)};
    while (r.state.step < steps && (r.outcome = one->step(r.state)) == Outcome::ok) {
    }
    results.push_back(r);
  }
  return results;
}

/// Random states of a mechanism: rates up to `spread`.
std::vector<std::vector<double>> starts_of(const mechanics::MechanicalModel& model, int count,
                                           double spread) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal(0, spread);
  std::vector<std::vector<double>> starts;
  for (int i = 0; i < count; ++i) {
    std::vector<double> q = model.mechanism().neutral(), v(size_t(model.mechanism().nv()));
    for (const auto& c : model.mechanism().coordinates())
      if (c.nq == 1) q[size_t(c.q)] = normal(rng);
    for (double& rate : v) rate = normal(rng);
    starts.push_back(model.state(q, v));
  }
  return starts;
}

int differing(const std::vector<BatchResult>& a, const std::vector<BatchResult>& b) {
  int n = 0;
  for (size_t i = 0; i < a.size(); ++i)
    n += !(same_bits(a[i].state, b[i].state) && a[i].outcome == b[i].outcome);
  return n;
}

TEST(Batch, HasTheBitsOfEachRunAlone) {
  const auto model = test::ets_vii().model;
  const auto starts = starts_of(*model, 13, 0.3);  // 13: lanes that end with nothing left to do
  for (const char* method : {"gauss4", "gauss8", "gauss16", "hbvm4", "midpoint", "rk4"}) {
    const double h = std::string(method) == "gauss16" ? 0.4 : 0.1;
    const auto alone = one_by_one(*model, method, h, 40, starts);
    for (const int threads : {1, 2, 3}) {
      const auto batch = simulate_batch(*model, method, h, 40, starts, {.threads = threads});
      EXPECT_EQ(differing(batch, alone), 0) << method << ", " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace porthos::ensemble
