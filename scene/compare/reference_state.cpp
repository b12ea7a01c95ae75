#include "scene/compare/reference_state.h"

#include <fmt/format.h>

#include <algorithm>

#include "integrators/methods/collocation.h"
#include "scene/assemble/contacts.h"
#include "scene/compare/sound_method.h"
#include "scene/run/cpu_clock.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;
using phs::Quad;

constexpr int reference_stages = 12;
constexpr double unit = 1e-19;    // of the numbers passed on
constexpr double agreed = 1e-17;  // differences in double are not smaller
constexpr int most_halvings = 5;

std::unique_ptr<integrators::BasicIntegrator<Quad>> make(const Assembly& a, Quad h) {
  if (!a.model->description().constraints.empty())
    return integrators::make_basic_integrator<Quad>(sound_method(*a.model, 16), *a.model, h,
                                                    {.max_sweeps = 400});
  return integrators::make_collocation<Quad>({.name = "reference"},
                                             integrators::gauss_table<Quad>(reference_stages),
                                             *a.model, h, {.max_sweeps = 400});
}
std::unique_ptr<integrators::Integrator> make(const Assembly& a, double h) {
  return make_integrator(a, sound_method(*a.model, 16), h);
}

template <class T>
std::string maker_of(const phs::Model& model) {
  const std::string method = sound_method(model, 16);
  if (!std::is_same_v<T, Quad>) return method + ", two steps that agree";
  return model.description().constraints.empty() ? "Gauss collocation of 12 stages in 113 bits"
                                                 : method + " in 113 bits";
}

std::vector<long double> values(const phs::Description&, const phs::BasicState<Quad>& s) {
  std::vector<long double> x(s.x.size());
  for (size_t k = 0; k < x.size(); ++k) x[k] = (long double)(s.x[k] + s.lo[k]);
  return x;  // never wrapped in 113 bits
}
std::vector<long double> values(const phs::Description& d, const phs::State& s) {
  return unwrapped(d, s);
}

/// A run of n steps, or nothing if it was stopped or a step failed.
template <class T>
std::optional<std::vector<long double>> run(const Assembly& a, double time, std::int64_t n,
                                            double cpu_limit, const std::atomic<bool>* stop) {
  const auto method = make(a, T(time) / T(double(n)));
  phs::BasicState<T> s(a.model->description(), {a.initial.x.begin(), a.initial.x.end()});
  for (size_t k = 0; k < s.x.size(); ++k) s.lo[k] = T(a.initial.lo[k]);
  s.turns = a.initial.turns;
  const double start = thread_cpu_now();
  for (std::int64_t i = 0; i < n; ++i) {
    if (stop && stop->load(std::memory_order_relaxed)) return {};
    // After two steps the total time can be estimated.
    if (i >= 2 && (thread_cpu_now() - start) * double(n) / double(i) > cpu_limit) return {};
    if (method->step(s) != Outcome::ok) return {};
  }
  auto x = values(a.model->description(), s);
  if constexpr (std::is_same_v<T, Quad>) {  // turns taken off before the start
    phs::State start_turns = a.initial;
    std::fill(start_turns.x.begin(), start_turns.x.end(), 0.0);
    std::fill(start_turns.lo.begin(), start_turns.lo.end(), 0.0);
    const auto turns = unwrapped(a.model->description(), start_turns);
    for (size_t k = 0; k < x.size(); ++k) x[k] += turns[k];
  }
  return x;
}

template <class T>
std::optional<ReferenceState> converge(const Assembly& a, const StateScale& scale,
                                       const ReferenceOptions& o, double cpu_limit) {
  const double begun = thread_cpu_now();
  const auto n0 = std::max<std::int64_t>(1, std::llround(o.time / o.step / 2));
  std::optional<ReferenceState> best;
  std::optional<std::vector<long double>> before;
  for (int k = 0; k <= most_halvings; ++k) {
    const std::int64_t n = n0 << k;
    const double left = cpu_limit - (thread_cpu_now() - begun);
    auto x = run<T>(a, o.time, n, left, o.stop);
    if (!x) {
      if (before) break;
      continue;  // the largest step may be too large
    }
    if (before) {
      const double error = std::max(distance(scale, *x, *before), unit);
      if (best && !(error < 0.5 * best->error)) break;  // only rounding is left
      best.emplace();
      best->time = o.time;
      best->x = *x;
      best->error = error;
      best->made_by = fmt::format("{}, step {:.3g} s", maker_of<T>(*a.model), o.time / double(n));
      if (error < agreed) break;
    }
    before = std::move(x);
  }
  return best;
}

}  // namespace

std::optional<ReferenceState> reference_state(const Assembly& a, const StateScale& scale,
                                              const ReferenceOptions& o) {
  std::optional<ReferenceState> exact;
  try {
    // Rigid contacts and dry friction are known in double alone.
    if (!jumps(*a.model)) exact = converge<Quad>(a, scale, o, o.cpu_limit);
  } catch (
      const InvalidArgument&) {  // forces that act in the split of orbit and internal motion only
    if (!a.spacecraft) throw;
  }
  if (exact && exact->error < 1e-14) return exact;
  auto in_double = converge<double>(a, scale, o, HUGE_VAL);
  if (!exact || (in_double && in_double->error < exact->error)) return in_double;
  return exact;
}

}  // namespace porthos::scene
