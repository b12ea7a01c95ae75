// The kernels: time, operations (counted by a scalar of its own), bytes, and what the machine could
// do at most. docs/benchmarks.md is made of this (bench/page.py).
#include <benchmark/benchmark.h>

#include "bench/chain.h"
#include "bench/kernels/counted.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "mechanics/urdf.h"

namespace porthos::bench {
namespace {

using benchmark::Counter;
using mechanics::Mechanism;
using mechanics::Workspace;
using Model = std::shared_ptr<const Mechanism>;
using Vec = std::vector<double>;

template <class T>
size_t bytes(const Workspace<T>& w) {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(w.X) + of(w.screw) + of(w.A) + of(w.b) + of(w.g) + of(w.a) + of(w.V) + of(w.K) +
         of(w.D_inverse) + of(w.u) + of(w.rate) + of(w.mu) + of(w.turn_angle) + of(w.angle) +
         of(w.sine) + of(w.cosine);
}
size_t bytes(const Mechanism& m) { return m.nodes().size() * sizeof(mechanics::Node); }

/// The arguments of all kernels for one state, or for a state in each lane.
template <class T>
struct Arguments {
  Arguments(const Mechanism& m, std::uint64_t seed)
      : q(size_t(m.nq())), p(q), v(size_t(m.nv())), tau(v) {
    Workspace<double> w(m);
    constexpr bool lanes = phs::is_pack<T>;
    for (int lane = 0; lane < phs::lanes<T>; ++lane) {
      const auto s = seed * 64 + std::uint64_t(lane) + 1;
      const Vec q1 = configuration(m, s), v1 = numbers(v.size(), 1, s + 1000),
                tau1 = numbers(v.size(), 1, s + 2000);
      Vec p1(q1.size());
      mechanics::momenta_from_rates<double>(m, w, q1, v1, p1);
      const auto put = [&](std::vector<T>& to, const Vec& from) {
        for (size_t k = 0; k < from.size(); ++k)
          if constexpr (lanes)
            to[k].set(lane, from[k]);
          else
            to[k] = T(from[k]);
      };
      put(q, q1);
      put(p, p1);
      put(v, v1);
      put(tau, tau1);
    }
  }
  std::vector<T> q, p, v, tau;
};

enum class Kernel { field, aba, rnea, crba };

template <class T>
struct Run {
  explicit Run(Model model)
      : m(model), w(*m), q_dot(size_t(m->nq())), p_dot(q_dot), a(size_t(m->nv())) {}
  void operator()(Kernel k, const Arguments<T>& x) {
    if (k == Kernel::field) mechanics::hamiltonian_field<T>(*m, w, x.q, x.p, {}, q_dot, p_dot);
    if (k == Kernel::aba) mechanics::aba<T>(*m, w, x.q, x.v, {x.tau, {}}, a);
    if (k == Kernel::rnea) mechanics::rnea<T>(*m, w, x.q, x.v, x.tau, {}, a);
    if (k == Kernel::crba) {
      if (M.empty()) M.resize(a.size() * a.size());
      mechanics::crba<T>(*m, w, x.q, M);
    }
  }
  Model m;
  Workspace<T> w;
  std::vector<T> q_dot, p_dot, a, M;
};

template <class T>
void kernel(benchmark::State& state, Model m, Kernel k) {
  const int states = m->body_count() > 200 ? 2 : 16;
  std::vector<Arguments<T>> x;
  for (int s = 0; s < states; ++s) x.emplace_back(*m, std::uint64_t(s));
  Run<T> run(m);
  size_t i = 0;
  for (auto _ : state) {
    run(k, x[i]);
    benchmark::ClobberMemory();
    i = i + 1 < x.size() ? i + 1 : 0;
  }
  Run<Counted> counting(m);
  const Arguments<Counted> y(*m, 1);
  const Operations n = count([&] { counting(k, y); });
  const double lanes = phs::lanes<T>, total = double(n.total());
  const auto rate = Counter::kIsIterationInvariantRate;
  state.counters["bodies"] = m->body_count();
  state.counters["freedoms"] = m->nv();
  state.counters["lanes"] = lanes;
  state.counters["adds"] = double(n.add);
  state.counters["muls"] = double(n.mul);
  state.counters["fmas"] = double(n.fma);
  state.counters["divs"] = double(n.div);
  state.counters["flops"] = total;
  state.counters["flop_rate"] = Counter(total * lanes, rate);
  state.counters["states"] = Counter(lanes, rate);
  state.counters["workspace_bytes"] = double(bytes(run.w));
  state.counters["model_bytes"] = double(bytes(*m));
}

/// As many independent multiplications and additions as the machine takes at once; T: one number,
/// or a register of them.
template <class T>
void peak(benchmark::State& state) {
  constexpr int n = 6;
  T a[n], b[n], one(1.0), zero(0.0);
  for (int i = 0; i < n; ++i) {
    a[i] = T(1.0);
    b[i] = T(1.0);
  }
  const auto unknown = [](T& x) {
    if constexpr (phs::is_pack<T>)
      asm volatile("" : "+x"(x.v));
    else
      asm volatile("" : "+x"(x));
  };
  unknown(one);
  unknown(zero);
  for (auto _ : state)
    for (int k = 0; k < 1000; ++k)
      for (int i = 0; i < n; ++i) {
        a[i] = a[i] * one;
        b[i] = b[i] + zero;
        unknown(a[i]);
        unknown(b[i]);
      }
  state.counters["flop_rate"] =
      Counter(1000.0 * 2 * n * phs::lanes<T>, Counter::kIsIterationInvariantRate);
}

Model read(const std::string& path, bool free_base, const mechanics::Vec3d& gravity = {0, 0, 0}) {
  mechanics::UrdfOptions o;
  o.base = free_base ? mechanics::UrdfOptions::Base::free : mechanics::UrdfOptions::Base::fixed;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  o.accept_unphysical_inertia = true;
  o.gravity = gravity;
  return std::make_shared<Mechanism>(mechanics::read_urdf(path, o).mechanism);
}

template <class T>
benchmark::internal::Benchmark* add(const std::string& name, const Model& m, Kernel k) {
  // Set and not found by trial, which a busy machine misleads: some milliseconds a repetition.
  return benchmark::RegisterBenchmark(name.c_str(), kernel<T>, m, k)
      ->Iterations(std::max(4, 20000 / m->body_count()));
}

void add_model(const std::string& name, const Model& m) {
  add<double>("field/" + name, m, Kernel::field);
  add<double>("aba/" + name, m, Kernel::aba);
  add<double>("rnea/" + name, m, Kernel::rnea);
  add<double>("crba/" + name, m, Kernel::crba);
  add<phs::Pack4>("field_4_lanes/" + name, m, Kernel::field);
  add<phs::Pack8>("field_8_lanes/" + name, m, Kernel::field);
  add<phs::Pack4>("aba_4_lanes/" + name, m, Kernel::aba);
}

}  // namespace
}  // namespace porthos::bench

int main(int argc, char** argv) {
  using namespace porthos::bench;
  namespace phs = porthos::phs;
  using Wide = phs::Pack<double, phs::native_lanes>;
  benchmark::Initialize(&argc, argv);
  benchmark::AddCustomContext("porthos_simd", phs::simd_name);
  benchmark::AddCustomContext("porthos_compiler", PORTHOS_COMPILER);
  benchmark::AddCustomContext("porthos_flags", PORTHOS_FLAGS);
  benchmark::RegisterBenchmark("peak/one_number", peak<double>)->Iterations(500);
  benchmark::RegisterBenchmark("peak/one_register", peak<Wide>)->Iterations(500);

  const std::string ets_vii = PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf";
  const auto arm = read(ets_vii, true);
  add_model("ets_vii", arm);
  add<double>("field_with_gravity/ets_vii", read(ets_vii, true, {0, 0, -9.81}), Kernel::field);
  const std::string data = PORTHOS_SOURCE_DIR "/tests/data/";
  for (const auto& [name, file, free_base] :
       {std::tuple{"panda7", "reference/pinocchio/urdf/panda7.urdf", false},
        {"sat_panda", "reference/pinocchio/urdf/sat_panda.urdf", true},
        {"hyq", "reference/pinocchio/urdf/hyq.urdf", true},
        {"talos", "models/talos.urdf", true}})
    add_model(name, read(data + file, free_base));
  for (int n : {10, 100, 1000, 10000}) {
    const auto m = chain(n, false);
    const std::string name = "chain" + std::to_string(n);
    add<double>("field/" + name, m, Kernel::field);
    add<double>("aba/" + name, m, Kernel::aba);
    add<double>("rnea/" + name, m, Kernel::rnea);
    add<phs::Pack4>("field_4_lanes/" + name, m, Kernel::field);
  }
  for (int threads : {1, 2})
    add<phs::Pack4>("threads/field_4_lanes", arm, Kernel::field)
        ->Threads(threads)
        ->UseRealTime()
        ->Iterations(200000);  // long against the start of a thread
  benchmark::RunSpecifiedBenchmarks();
}
