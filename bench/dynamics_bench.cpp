// Cost of the dynamics: one state and eight lanes, and per body from 10 to 1000 bodies.
// Peers (RBDL, Pinocchio, ...) are measured beside it, in the same session, on the same URDF files.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>

#include "bench/chain.h"
#include "integrators/integrator.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "mechanics/urdf.h"

namespace porthos::bench {
namespace {

using mechanics::Mechanism;
using Vec = std::vector<double>;
using Model = std::shared_ptr<const Mechanism>;

/// 64 random states made outside the timed region.
struct States {
  explicit States(const Mechanism& m) {
    mechanics::Workspace<double> w(m);
    for (std::uint64_t s = 0; s < 64; ++s) {
      q.push_back(configuration(m, s + 1)), v.push_back(numbers(size_t(m.nv()), 1, s + 100));
      p.emplace_back(q.back().size());
      mechanics::momenta_from_rates<double>(m, w, q.back(), v.back(), p.back());
    }
  }
  std::vector<Vec> q, v, p;
};

void per_body(benchmark::State& state, const Mechanism& m, int per_call = 1) {
  using benchmark::Counter;
  state.counters["time_per_body"] = Counter(double(m.body_count() * per_call),
                                            Counter::kIsIterationInvariantRate | Counter::kInvert);
}

void field(benchmark::State& state, Model m) {
  const States s(*m);
  mechanics::Workspace<double> w(*m);
  Vec q_dot(s.q[0].size()), p_dot(q_dot);
  size_t i = 0;
  for (auto _ : state) {
    mechanics::hamiltonian_field<double>(*m, w, s.q[i], s.p[i], {}, q_dot, p_dot);
    benchmark::DoNotOptimize(p_dot.data());
    i = (i + 1) % 64;
  }
  per_body(state, *m);
}

void field_lanes(benchmark::State& state, Model m) {
  using phs::Pack8;
  const States s(*m);
  mechanics::Workspace<Pack8> w(*m);
  const size_t n = s.q[0].size();
  std::vector<Pack8> q(n), p(n), q_dot(n), p_dot(n);
  for (size_t k = 0; k < n; ++k)
    for (int l = 0; l < 8; ++l) q[k].set(l, s.q[size_t(l)][k]), p[k].set(l, s.p[size_t(l)][k]);
  for (auto _ : state) {
    mechanics::hamiltonian_field<Pack8>(*m, w, q, p, {}, q_dot, p_dot);
    benchmark::DoNotOptimize(p_dot.data());
  }
  per_body(state, *m, 8);
}

void aba(benchmark::State& state, Model m) {
  const States s(*m);
  mechanics::Workspace<double> w(*m);
  Vec a(size_t(m->nv()));
  size_t i = 0;
  for (auto _ : state) {
    mechanics::aba<double>(*m, w, s.q[i], s.v[i], {s.v[i], {}}, a);
    benchmark::DoNotOptimize(a.data());
    i = (i + 1) % 64;
  }
  per_body(state, *m);
}

void rnea(benchmark::State& state, Model m) {
  const States s(*m);
  mechanics::Workspace<double> w(*m);
  Vec tau(size_t(m->nv()));
  size_t i = 0;
  for (auto _ : state) {
    mechanics::rnea<double>(*m, w, s.q[i], s.v[i], s.v[i], {}, tau);
    benchmark::DoNotOptimize(tau.data());
    i = (i + 1) % 64;
  }
}

void crba(benchmark::State& state, Model m) {
  const States s(*m);
  mechanics::Workspace<double> w(*m);
  Vec M(size_t(m->nv() * m->nv()));
  size_t i = 0;
  for (auto _ : state) {
    mechanics::crba<double>(*m, w, s.q[i], M);
    benchmark::DoNotOptimize(M.data());
    i = (i + 1) % 64;
  }
}

void gauss16_step(benchmark::State& state, Model m, double h, bool lanes) {
  const mechanics::MechanicalModel model(m);
  phs::State s(
      model.description(),
      model.state(configuration(*m),
                  numbers(size_t(m->nv()),
                          5.0 / double(m->nv() * m->nv()))));  // long chains amplify: slower joints
  integrators::Options o;
  o.lanes = lanes;
  const auto method = integrators::make_integrator("gauss16", model, h, o);
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
  state.counters["sweeps"] = double(method->cost().sweeps) / double(method->cost().steps);
  per_body(state, *m);
}

Model read(const std::string& path, bool free_base) {
  mechanics::UrdfOptions o;
  o.base = free_base ? mechanics::UrdfOptions::Base::free : mechanics::UrdfOptions::Base::fixed;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  o.accept_unphysical_inertia = true;
  return std::make_shared<Mechanism>(mechanics::read_urdf(path, o).mechanism);
}

/// One gauss16 step with its stages as lanes, and stage by stage: their ratio is what the lanes bring.
void add_steps(const std::string& name, Model m, double h) {
  benchmark::RegisterBenchmark(("gauss16_step/" + name).c_str(), gauss16_step, m, h, true);
  benchmark::RegisterBenchmark(("gauss16_step_scalar_stages/" + name).c_str(), gauss16_step, m, h,
                               false);
}

void add(const std::string& name, Model m) {
  benchmark::RegisterBenchmark(("field/" + name).c_str(), field, m);
  benchmark::RegisterBenchmark(("field_8_lanes/" + name).c_str(), field_lanes, m);
  benchmark::RegisterBenchmark(("aba/" + name).c_str(), aba, m);
  benchmark::RegisterBenchmark(("rnea/" + name).c_str(), rnea, m);
  benchmark::RegisterBenchmark(("crba/" + name).c_str(), crba, m);
}

}  // namespace
}  // namespace porthos::bench

int main(int argc, char** argv) {
  using namespace porthos::bench;
  benchmark::Initialize(&argc, argv);
  const auto ets_vii = read(PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf", true);
  add("ets_vii", ets_vii), add_steps("ets_vii", ets_vii, 0.25);
  const std::filesystem::path shared =
      std::filesystem::path(PORTHOS_SOURCE_DIR) / "../shared/reference/pinocchio/urdf";
  for (const auto& [name, free_base] :
       {std::pair{"panda7", false}, {"ur5", false}, {"sat_panda", true}, {"hyq", true}})
    if (std::filesystem::exists(shared / (std::string(name) + ".urdf")))
      add(name, read((shared / (std::string(name) + ".urdf")).string(), free_base));
  for (int n : {10, 100, 1000}) {
    const auto m = chain(n, false);
    const std::string name = "chain" + std::to_string(n);
    benchmark::RegisterBenchmark(("field/" + name).c_str(), field, m);
    benchmark::RegisterBenchmark(("aba/" + name).c_str(), aba, m);
    add_steps(name, m, 0.02);
  }
  benchmark::RunSpecifiedBenchmarks();
}
