// What a gradient costs: a product with the transposed derivative against a field, all derivatives
// of the dynamics against their values, and the gradient of a run against the run.
#include <benchmark/benchmark.h>

#include "bench/gradient_bench.h"
#include "integrators/core/stage_lanes.h"
#include "integrators/derivatives/run_gradient.h"
#include "mechanics/aba.h"
#include "mechanics/derivatives/dynamics_derivatives.h"
#include "mechanics/derivatives/field_tangent.h"
#include "mechanics/derivatives/linearised_mechanism.h"
#include "mechanics/rnea.h"

namespace porthos::bench {
namespace {

using integrators::GradientOptions;
using Lanes = phs::Pack<double, integrators::stage_lanes>;
enum class Work { field, at, product, parameters };

/// One evaluation in lanes.
template <class T>
void in_lanes(benchmark::State& state, std::shared_ptr<const mechanics::MechanicalModel> model,
              const phs::State& start, Work work) {
  const auto system = model->instantiate<T>();
  const auto linear = mechanics::linearise<T>(model->mechanism());
  std::vector<T> x(start.x.begin(), start.x.end()), f(x.size()), l(x.size());
  std::vector<T> gradient(linear->parameters().size(), T(0.0));
  for (size_t k = 0; k < l.size(); ++k) l[k] = T(0.5 + 0.01 * double(k));
  linear->at(T(0.0), x, f);
  linear->transpose_times(l, f);
  for (auto _ : state) {
    if (work == Work::field) system->field(T(0.0), x, {}, f);
    if (work == Work::at) linear->at(T(0.0), x, f);
    if (work == Work::product) linear->transpose_times(l, f);
    if (work == Work::parameters) linear->add_gradient(T(1.0), gradient);
    benchmark::ClobberMemory();
  }
}

enum class Kernel { rnea, rnea_derivatives, aba, aba_derivatives };

/// Inverse or forward dynamics, alone and with all its derivatives.
template <class T>
void dynamics(benchmark::State& state, std::shared_ptr<const mechanics::MechanicalModel> model,
              const phs::State& start, Kernel kernel) {
  const auto& m = model->mechanism();
  const size_t n = size_t(m.nv());
  mechanics::Workspace<T> w(m);
  mechanics::DerivativeWorkspace<T> d(m);
  const std::vector<T> q(start.x.begin(), start.x.begin() + m.nq()), v(n, T(0.3)), a(n, T(0.2));
  std::vector<T> out(n), dq(n * n), dv(n * n), du(n * n);
  for (auto _ : state) {
    if (kernel == Kernel::rnea) mechanics::rnea<T>(m, w, q, v, a, {}, out);
    if (kernel == Kernel::aba) mechanics::aba<T>(m, w, q, v, {a, {}}, out);
    if (kernel == Kernel::rnea_derivatives)
      mechanics::rnea_derivatives<T>(m, w, d, q, v, a, {}, out, dq, dv);
    if (kernel == Kernel::aba_derivatives)
      mechanics::aba_derivatives<T>(m, w, d, q, v, {a, {}}, out, dq, dv, du);
    benchmark::ClobberMemory();
  }
}

void run(benchmark::State& state, std::shared_ptr<const mechanics::MechanicalModel> model,
         const phs::State& start, double h, std::int64_t steps) {
  for (auto _ : state) {
    phs::State s = start;
    const auto method = integrators::make_integrator("gauss16", *model, h, {.port_work = false});
    for (std::int64_t i = 0; i < steps; ++i)
      if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
    state.counters["sweeps"] = double(method->cost().sweeps) / double(steps);
  }
}

/// twice: with a product of the Hessian.
void gradient(benchmark::State& state, std::shared_ptr<const mechanics::MechanicalModel> model,
              const phs::State& start, double h, std::int64_t steps, size_t memory, bool twice) {
  const integrators::Objective objective{
      .end =
          [](double, std::span<const double>, std::span<double> g) {
            g[0] = 1;
            return 0.0;
          },
      .sampled = {},
      .running = {},
      .end_curvature = [](double, auto, auto, auto) {}};
  std::vector<double> direction(twice ? start.x.size() : 0, 1.0);
  for (auto _ : state) {
    const auto g = integrators::gradient_of_run("gauss16", *model, start, h, steps, objective,
                                                {.memory = memory, .direction = direction});
    if (g.outcome != integrators::Outcome::ok) state.SkipWithError(g.remark.c_str());
    state.counters["sweeps"] = double(g.adjoint.sweeps) / double(steps);
    state.counters["steps"] = double(g.steps_taken) / double(steps);
  }
}

}  // namespace

void add_gradients(const std::string& name,
                   const std::shared_ptr<const mechanics::MechanicalModel>& model,
                   const phs::State& start, double h) {
  const auto add = [&](const std::string& what, auto work, auto... more) {
    benchmark::RegisterBenchmark((what + "/" + name).c_str(), work, model, start, more...);
  };
  const std::pair<const char*, Work> works[]{{"field", Work::field},
                                             {"linearised_at", Work::at},
                                             {"transposed_product", Work::product},
                                             {"parameter_gradient", Work::parameters}};
  for (const auto& [what, work] : works) {
    add(what, in_lanes<double>, work);
    add(std::string(what) + "_lanes", in_lanes<Lanes>, work);
  }
  const std::pair<const char*, Kernel> kernels[]{{"rnea", Kernel::rnea},
                                                 {"rnea_derivatives", Kernel::rnea_derivatives},
                                                 {"aba", Kernel::aba},
                                                 {"aba_derivatives", Kernel::aba_derivatives}};
  for (const auto& [what, kernel] : kernels) {
    add(what, dynamics<double>, kernel);
    add(std::string(what) + "_lanes", dynamics<Lanes>, kernel);
  }
  const std::int64_t steps = 2000;
  add("run", run, h, steps);
  add("gradient_kept_stages", gradient, h, steps, size_t(64) << 20, false);
  add("gradient_checkpoints", gradient, h, steps, size_t(1) << 19, false);
  add("hessian_product", gradient, h, steps, size_t(64) << 20, true);
}

}  // namespace porthos::bench
