// What an actuator adds to an evaluation: one energy with its slopes, and seven actuators on a
// 7-joint arm against the arm.
#include <benchmark/benchmark.h>

#include "bench/chain.h"
#include "mechanics/mechanical_model.h"
#include "phs/network/network.h"
#include "vsa/actuator.h"
#include "vsa/catalogue.h"
#include "vsa/formula.h"

namespace porthos::bench {
namespace {

void slopes(benchmark::State& state, const vsa::ElasticPtr& e, double theta, double sigma) {
  double q = 0.1;
  for (auto _ : state) {
    const auto s = e->slopes(q, theta, sigma);
    benchmark::DoNotOptimize(q += 1e-12 * s.q);
  }
}

/// The arm's field with and without actuators at its first seven joints.
void field_of_arm(benchmark::State& state, bool actuators) {
  const auto m = chain(7, false);
  const auto bare = std::make_shared<const mechanics::MechanicalModel>(m);
  phs::Network n("arm");
  n.add("arm", bare).main("arm");
  int count = 0;
  for (const auto& p : bare->description().ports) {
    if (p.size != 1 || !actuators) continue;
    vsa::Actuator a;
    a.elastic = vsa::elastic_of(vsa::device("qbmove_advanced"));
    a.theta = {.kind = vsa::Drive::Kind::torque, .inertia = 0.01, .viscous = 0.1};
    a.sigma = {.kind = vsa::Drive::Kind::torque, .inertia = 0.01, .viscous = 0.1};
    vsa::attach(n, "vsa" + std::to_string(count++), "arm." + p.name, a);
  }
  const auto model = n.build();
  const auto f = model->instantiate<double>();
  std::vector<double> x(size_t(model->description().nx), 0.1), dx(x.size());
  for (auto _ : state) {
    for (double& number : x) number += 1e-9;  // nothing may be known from before
    f->field(0, x, {}, dx);
    benchmark::DoNotOptimize(dx.data());
  }
  state.counters["actuators"] = count;
}

const bool registered = [] {
  for (const auto& d : vsa::devices())
    if (!d.family.empty())
      benchmark::RegisterBenchmark(("vsa/slopes/" + d.name).c_str(), slopes, vsa::elastic_of(d),
                                   d.theta, d.sigma.back());
  vsa::Limits range;
  range.sigma_lower = -0.8;
  range.sigma_upper = 0.8;
  const auto formula = vsa::formula(
      {"k/a*(cosh(a*(phi - sigma)) + cosh(a*(phi + sigma)) - 2)", {{"a", 6.7328}, {"k", 0.0222}}},
      range);
  benchmark::RegisterBenchmark("vsa/slopes/qbmove_by_formula", slopes, formula, 0.0, 0.4);
  benchmark::RegisterBenchmark("vsa/arm7/bare", field_of_arm, false);
  benchmark::RegisterBenchmark("vsa/arm7/seven_qbmoves", field_of_arm, true);
  return true;
}();

}  // namespace
}  // namespace porthos::bench
