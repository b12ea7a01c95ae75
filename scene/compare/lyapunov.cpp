#include "scene/compare/lyapunov.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "integrators/core/integrator.h"
#include "scene/compare/sound_method.h"
#include "scene/run/cpu_clock.h"

namespace porthos::scene {

using integrators::Outcome;
using phs::Dual;

double find_step(const Assembly& a, double guess, std::int64_t steps, StateScale& scale) {
  double h = guess;
  for (int halvings = 0; halvings <= 60; ++halvings, h /= 2) {
    const auto method = make_integrator(a, sound_method(*a.model, 8), h);
    phs::State s = a.initial;
    bool ok = true;
    for (std::int64_t i = 0; ok && i < steps; ++i) ok = method->step(s) == Outcome::ok;
    if (!ok) continue;
    s = a.initial;  // once more, now that the scale may see it
    scale.see(s.x);
    for (std::int64_t i = 0; i < steps; ++i)
      if (method->step(s) == Outcome::ok) scale.see(s.x);
    return h;
  }
  throw InvalidArgument(fmt::format(
      "no step size from {} s down to {:.1g} s takes the first {} steps", guess, h, steps));
}

double Sensitivity::time_of_growth(double factor) const {
  const double want = std::log(factor);
  const auto reached =
      std::find_if(log_growth.begin(), log_growth.end(), [&](double g) { return g >= want; });
  if (reached == log_growth.end()) return observed_s;
  return double(reached - log_growth.begin() + 1) * step_s;
}

namespace {

/// Seeds the derivative with a vector whose weighted components are uniform in ±1.
void seed_deviation(phs::BasicState<Dual>& s, const StateScale& scale) {
  std::mt19937_64 rng(1);
  for (size_t k = 0; k < s.x.size(); ++k)
    s.x[k].d = (double(rng() >> 11) * 0x1p-52 - 1) / scale.weight(k);
}

double size_of_deviation(const phs::BasicState<Dual>& s, const StateScale& scale) {
  double sum = 0;
  for (size_t k = 0; k < s.x.size(); ++k) {
    const double d = (s.x[k].d + s.lo[k].d) * scale.weight(k);
    sum += d * d;
  }
  return std::sqrt(sum);
}

void judge(Sensitivity& r) {
  if (r.log_growth.empty()) return;
  r.observed_s = double(r.log_growth.size()) * r.step_s;
  r.growth = std::exp(r.log_growth.back());
  const size_t half = r.log_growth.size() / 2;
  if (half == 0) return;
  const double gained = r.log_growth.back() - r.log_growth[half - 1];
  r.exponent_per_s = gained / (double(r.log_growth.size() - half) * r.step_s);
  r.chaotic = gained > 5;
}

}  // namespace

Sensitivity sensitivity(const Assembly& a, const StateScale& scale, const SensitivityOptions& o) {
  Sensitivity r;
  r.step_s = o.step;
  const auto method =
      integrators::make_basic_integrator<Dual>(sound_method(*a.model, 16), *a.model, Dual(o.step));
  phs::BasicState<Dual> s(a.model->description(), {a.initial.x.begin(), a.initial.x.end()});
  for (size_t k = 0; k < s.x.size(); ++k) s.lo[k] = a.initial.lo[k];
  s.turns = a.initial.turns;
  seed_deviation(s, scale);
  const double start = size_of_deviation(s, scale), begun = thread_cpu_now();
  const auto steps =
      std::min(o.most_steps, std::max<std::int64_t>(1, std::llround(o.duration / o.step)));
  while (s.step < steps) {
    if (o.stop && o.stop->load(std::memory_order_relaxed)) break;
    if (s.step % 16 == 0 && thread_cpu_now() - begun > o.cpu_limit) break;
    if (method->step(s) != Outcome::ok) break;
    r.log_growth.push_back(std::log(size_of_deviation(s, scale) / start));
    if (!(r.log_growth.back() < std::log(o.most_growth))) break;
  }
  judge(r);
  return r;
}

}  // namespace porthos::scene
