#include "scene/compare/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

/// Whether the motion of a trial is another one than the exact, however well it keeps the energy.
bool moves_wrongly(const Comparison& c, const Trial& t) {
  return c.by_energy && t.complete() && t.trajectory_error.value_or(0) > most_trajectory_error;
}

/// Value of y at x, interpolated between (x1, y1) and (x2, y2) linearly in logarithms.
double between(double x, double x1, double x2, double y1, double y2) {
  if (!(x1 > 0 && x2 > 0 && y1 > 0 && y2 > 0) || x1 == x2) return y2;
  const double f = std::clamp(std::log(x / x1) / std::log(x2 / x1), 0.0, 1.0);
  return y1 * std::pow(y2 / y1, f);
}

/// Where the trials, from coarse to fine, first get below the target and are still below it in the
/// next trial.
std::optional<Reach> reach(const Comparison& c, const MethodTrials& m, double target) {
  std::vector<const Trial*> known;
  bool left_out = false;
  for (const Trial& t : m.trials)
    if (moves_wrongly(c, t))
      left_out = true;
    else if (!std::isnan(c.error_of(t)) && t.report.cpu_s > 0)
      known.push_back(&t);
  for (size_t i = 0; i < known.size(); ++i) {
    const double error = c.error_of(*known[i]);
    if (error > target || (i + 1 < known.size() && c.error_of(*known[i + 1]) > target)) continue;
    const Trial& fine = *known[i];
    Reach r{.of = &m,
            .step_s = fine.setting.step,
            .rtol = fine.setting.rtol,
            .iteration_tolerance = fine.setting.iteration_tolerance,
            .control_rate = fine.setting.control_rate,
            .control_length = fine.setting.control_length,
            .cpu_s = fine.report.cpu_s,
            .at_most = i == 0 && !left_out,
            .drifts = c.by_energy && drifts(fine.report.energy)};
    if (i > 0) {
      const Trial& coarse = *known[i - 1];
      const double above = c.error_of(coarse);
      const auto at = [&](double y1, double y2) { return between(target, above, error, y1, y2); };
      if (above > target) {
        r.step_s = at(coarse.setting.step, fine.setting.step);
        r.rtol = at(coarse.setting.rtol, fine.setting.rtol);
        r.iteration_tolerance =
            at(coarse.setting.iteration_tolerance, fine.setting.iteration_tolerance);
        r.cpu_s = at(coarse.report.cpu_s, fine.report.cpu_s);
      }
    }
    return r;
  }
  return {};
}

/// Rounds down to two digits: a finer step is on the safe side.
double two_digits_down(double x) {
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 1);
  return std::floor(x / unit * (1 + 1e-12)) * unit;
}

std::string sweeps_text(double iteration_tolerance) {
  return iteration_tolerance > 0 ? fmt::format(", iteration_tolerance {:.1g}", iteration_tolerance)
                                 : "";
}
std::string control_text(integrators::StepControl control, double rate, double length) {
  if (control == integrators::StepControl::fixed) return "";
  return fmt::format(", step_control {}, step_control_rate {:.3g}", to_string(control), rate) +
         (length > 0 ? fmt::format(", step_control_length {:.3g}", length) : "");
}
std::string setting_text(const Reach& r) {
  return r.rtol > 0 ? fmt::format("rtol {:.2g}", r.rtol)
                    : fmt::format("step {:.2g} s{}{}", two_digits_down(r.step_s),
                                  sweeps_text(r.iteration_tolerance),
                                  control_text(r.of->control, r.control_rate, r.control_length));
}
std::string setting_text(const Setting& s) {
  return s.rtol > 0 ? fmt::format("rtol {:.2g}", s.rtol)
                    : fmt::format("step {:.3g} s{}{}", s.step, sweeps_text(s.iteration_tolerance),
                                  control_text(s.control, s.control_rate, s.control_length));
}

std::string what(const Comparison& c, double target) {
  return c.by_energy
             ? fmt::format("an energy error of {:.2g} over {:g} s", target, c.duration_s)
             : fmt::format("a trajectory error of {:.2g} at {:g} s", target, c.trajectory_time_s);
}

struct Smallest {
  const Trial* trial = nullptr;
  double error = HUGE_VAL;
};
Smallest smallest(const Comparison& c, bool rivals) {
  Smallest s;
  for (const auto& m : c.methods)
    if (m.method.rival == rivals && c.speaks_of(m))
      for (const Trial& t : m.trials)
        if (!moves_wrongly(c, t) && c.error_of(t) < s.error) s = {&t, c.error_of(t)};
  return s;
}

std::string smallest_text(const Smallest& s) {
  return fmt::format("{:.2g} ({}, {}, {:.2g} s of CPU)", s.error, s.trial->setting.method,
                     setting_text(s.trial->setting), s.trial->report.cpu_s);
}

bool any(const Comparison& c, bool rivals) {
  return std::any_of(c.methods.begin(), c.methods.end(),
                     [&](const auto& m) { return m.method.rival == rivals; });
}

/// What no method did of which there is no smallest error.
std::string came_to_the_end(const Comparison& c, bool rivals) {
  for (const auto& m : c.methods)
    for (const Trial& t : m.trials)
      if (m.method.rival == rivals && moves_wrongly(c, t))
        return fmt::format("came to the end with a trajectory error of at most {:g}",
                           most_trajectory_error);
  return "came to the end";
}

std::string rival_clause(const Comparison& c, const Reach* own, const Reach* rival) {
  if (!any(c, true)) return "";
  if (rival && own) {
    const double ratio = rival->cpu_s / own->cpu_s;
    return fmt::format("; {} ({}) needs {:.2g} x that{}", rival->of->method.name,
                       setting_text(*rival), ratio, rival->drifts ? " and drifts" : "");
  }
  const Smallest s = smallest(c, true);
  if (!s.trial) return "; no reference solver " + came_to_the_end(c, true);
  return "; no reference solver reached it, the smallest error was " + smallest_text(s);
}

std::string sentence(const Comparison& c, const Advice& a) {
  const Reach *own = nullptr, *rival = nullptr;
  for (const Reach& r : a.reaching) {
    const Reach*& first = r.of->method.rival ? rival : own;
    if (!first) first = &r;
  }
  const std::string goal = what(c, a.target);
  if (own)
    return fmt::format("for {}: {}, {}{}, {:.2g} s of CPU{}{}", goal, own->of->method.name,
                       setting_text(*own), own->at_most ? " or coarser" : "", own->cpu_s,
                       own->drifts ? ", with a drift" : "", rival_clause(c, own, rival));
  std::string text;
  const Smallest s = smallest(c, false);
  if (!any(c, false))
    text = fmt::format("for {}: ", goal);
  else if (!s.trial)
    text = fmt::format("no method of ours {} for {}", came_to_the_end(c, false), goal);
  else
    text = fmt::format("no method of ours reached {}{}, the smallest error was {}", goal,
                       c.interrupted ? " before the interruption" : "", smallest_text(s));
  if (!rival) return text + rival_clause(c, nullptr, nullptr);
  return text + fmt::format("{}{}, {}, {:.2g} s of CPU{}", any(c, false) ? "; " : "",
                            rival->of->method.name, setting_text(*rival), rival->cpu_s,
                            rival->drifts ? ", with a drift" : "");
}

}  // namespace

std::optional<double> Comparison::order_below_declared(const MethodTrials& m) const {
  if (m.method.order < 1 || m.short_sweeps || m.control != integrators::StepControl::fixed ||
      !reference)
    return {};
  constexpr double short_of = 0.5, coarsest = 0.3, resolved = 2e-2, rounding = 1e-11;
  const double floor = std::max(rounding, 100 * reference->error);
  std::optional<double> before, finest;
  for (size_t i = 1; i < m.trials.size(); ++i) {
    const auto order = observed_order(m.trials[i - 1], m.trials[i]);
    const auto &coarse = m.trials[i - 1].trajectory_error, &fine = m.trials[i].trajectory_error;
    const bool known = order && *coarse < coarsest && floor < *fine;
    // On the way to the declared order what is missing at least halves from row to row.
    if (known && before && *fine < resolved) {
      const double agree = (m.method.order - *order) / 16;
      finest = std::fabs(*order - *before) < agree ? order : std::nullopt;
    }
    before = known ? order : std::nullopt;
  }
  return finest && *finest < m.method.order - short_of ? finest : std::nullopt;
}

bool Comparison::contradicted(const MethodTrials& m) {
  return m.method.energy_exact == integrators::Claim::holds &&
         std::ranges::any_of(m.trials, [](const Trial& t) {
           return t.complete() && contradicts_exact_energy(t.report);
         });
}

bool drifts(const EnergyReport& e) { return e.drift_is_significant && e.growth_exponent > 0.75; }

size_t nearest_trial(const Comparison& c, const MethodTrials& m, double target) {
  size_t nearest = m.trials.size() - 1;
  std::pair least(true, HUGE_VAL);  // moves wrongly, factor
  for (size_t i = 0; i < m.trials.size(); ++i) {
    const Trial& t = m.trials[i];
    if (!t.complete()) continue;
    const double error = c.speaks_of(m) ? c.error_of(t) : t.trajectory_error.value_or(HUGE_VAL);
    const double factor = std::fabs(std::log(std::max(error, 1e-300) / target));
    const std::pair distance(moves_wrongly(c, t), std::isnan(factor) ? 1e300 : factor);
    if (distance < least) least = distance, nearest = i;
  }
  return nearest;
}

Advice advise(const Comparison& c, double target) {
  Advice a;
  a.target = target;
  for (const auto& m : c.methods)
    if (const auto r = c.speaks_of(m) ? reach(c, m, target) : std::nullopt)
      a.reaching.push_back(*r);
  std::stable_sort(a.reaching.begin(), a.reaching.end(),
                   [](const Reach& x, const Reach& y) { return x.cpu_s < y.cpu_s; });
  a.sentence = sentence(c, a);
  return a;
}

}  // namespace porthos::scene
