// The runs of a certificate.
#include "energy_shaping/certify/detail/certify_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "energy_shaping/certify/detail/held_offset.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/held_loop.h"
#include "energy_shaping/loop/port_law.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

double distance(const ClosedLoop& loop, const Vec& x) {
  double d = 0;
  for (size_t i = 0; i < x.size(); ++i) d = std::max(d, std::fabs(x[i] - loop.rest()[i]));
  return d;
}

/// The time after which H_d stays as near to that of the rest as `left` [s].
double settling_time(const Run& r, double rest, double left) {
  size_t k = r.H.size();
  while (k > 0 && std::fabs(r.H[k - 1] - rest) <= left) --k;
  return k < r.t.size() ? r.t[k] : HUGE_VAL;
}

}  // namespace

std::string share_of_limits(const Vec& peak, const Vec& limits) {
  if (limits.empty()) return "";
  double share = 0;
  for (size_t j = 0; j < limits.size(); ++j) share = std::max(share, peak[j] / limits[j]);
  return fmt::format("{:.0f} % of its limit", 100 * share);
}

/// The condition "sampled" of the longest of the periods. Not of what has no linear loop, as with
/// constraints.
void certify_periods(const ClosedLoop& loop, const std::vector<double>& periods, Certificate& c) {
  const double longest = *std::ranges::max_element(periods);
  if (!(longest > 0)) return;
  const std::shared_ptr<const ClosedLoop> borrowed(std::shared_ptr<const ClosedLoop>(), &loop);
  try {
    certify_sampled(c, held_loop(loop.plant(), port_laws(borrowed), loop.rest()), longest, 0);
  } catch (const InvalidArgument&) {
  }
}

std::string of_start(const CertifyOptions& o, size_t s) {
  return o.starts.size() > 1 ? fmt::format(", start {}", s + 1) : "";
}

/// Whether the limits are why a run does not settle, by the same run without them.
/// @param free_run  (H_d settles, the time it takes [s])
void add_help_on_limits(const Run& r, double limited_from,
                        const std::function<std::pair<bool, double>()>& free_run, bool has_settled,
                        Certificate& c) {
  std::string cause;
  if (!has_settled)
    if (const auto [settles, time] = free_run(); settles)
      cause = fmt::format("the limit is the cause: without it H_d settles in {:.3g} s", time);
  if (r.H.front() > limited_from)
    c.help(
        fmt::format("{}the limit acts from H_d = {:.4g} and the start has {:.4g}: raise the "
                    "limit, or start below that level",
                    cause.empty() ? "" : cause + "; ", limited_from, r.H.front()));
  else if (!cause.empty())
    c.help(cause + ": raise the limit, or start nearer to the rest");
}

/// Runs of other plants under the law.
void certify_plants(const ClosedLoop& loop, const CertifyOptions& o,
                    const std::function<bool(const Run&)>& settled, Certificate& c) {
  if (o.plants.empty() || o.starts.empty()) return;
  size_t good = 0, all = 0;
  for (const auto& plant : o.plants)
    for (const auto& start : o.starts) {
      RunOptions run = o.run;
      run.plant = plant.get();
      run.period = o.periods.back();
      run.record = run.duration / 10;
      good += settled(simulate(loop, start, run));
      ++all;
    }
  c.report("settles with other parameters", double(good) / double(all),
           fmt::format("{} of {} runs on {} plants", good, all, o.plants.size()));
}

void certify_runs(const ClosedLoop& loop, const CertifyOptions& o, double limited_from,
                  Certificate& c) {
  const auto system = loop.instantiate<double>();
  const double rest = system->hamiltonian(loop.rest());
  HeldOffset offset(loop, *system, hessian(loop, loop.rest()));
  const auto elsewhere = [&](const Run& r) {
    const double left = std::fabs(r.H.back() - rest), begun = std::fabs(r.H.front() - rest);
    return r.finished && left <= o.settled * begun && offset.elsewhere(r.x.back(), left, begun);
  };
  const auto settled = [&](const Run& r) {
    return r.finished &&
           std::fabs(r.H.back() - rest) <= o.settled * std::fabs(r.H.front() - rest) &&
           !elsewhere(r);
  };
  // If some directions have no stiffness (a floating base, a quaternion's sign), there is no single
  // state from which a distance could be measured.
  const bool whole = !loop.certificate().has("directions without stiffness") ||
                     loop.certificate().item("directions without stiffness").value == 0;
  for (size_t s = 0; s < o.starts.size(); ++s)
    for (const double period : o.periods) {
      RunOptions run = o.run;
      run.period = period;
      const Run r = simulate(loop, o.starts[s], run);
      const double H0 = std::fabs(r.H.front() - rest);
      const bool lost = elsewhere(r);
      const std::string name =
          (period > 0 ? fmt::format("run at {:g} ms", 1e3 * period) : "run, continuous") +
          of_start(o, s);
      c.add({name,
             !r.finished            ? Finding::not_judged
             : H0 > 0 && settled(r) ? Finding::holds
                                    : Finding::fails,
             r.finished ? (r.H.back() - rest) / H0 : std::numeric_limits<double>::quiet_NaN(),
             o.settled,
             !r.finished ? "did not finish: " + r.outcome
             : !(H0 > 0) ? "H_d is that of the rest at the start already: expected another start"
             : lost      ? fmt::format("H_d left, relative; {:g} s; it ends at another minimum",
                                       run.duration)
             : whole ? fmt::format("H_d left, relative; {:g} s, state off by {:.2e}", run.duration,
                                   distance(loop, r.x.back()))
                     : fmt::format("H_d left, relative; {:g} s", run.duration),
             {},
             lost ? Vec(r.x.back().begin(), r.x.back().begin() + long(loop.rest().size() / 2))
                  : Vec{}});
      if (!run.limits.empty())
        add_help_on_limits(
            r, limited_from,
            [&] {
              RunOptions unlimited = run;
              unlimited.limits = {};
              const Run other = simulate(loop, o.starts[s], unlimited);
              return std::pair(settled(other), settling_time(other, rest, o.settled * H0));
            },
            settled(r), c);
      if (H0 > 0 && settled(r))
        c.report(name + ", settling time", settling_time(r, rest, o.settled * H0),
                 fmt::format("[s] until H_d stays below {:g} of its start", o.settled));
      // With a hold H_d may rise; with the law in continuous time it must not.
      const double allowed = 1e-11 * std::max(H0, std::fabs(rest));
      const std::string rise = name + ", rise of H_d";
      if (period == 0 && run.limits.empty() && !r.finished && r.rise <= allowed)
        c.add({rise, Finding::not_judged, r.rise, allowed, "in a step [J], up to its end", {}, {}});
      else if (period == 0 && run.limits.empty())
        c.at_most(rise, r.rise, allowed, "in a step [J]");
      else
        c.report(rise, r.rise, "in a step [J]");
      if (period > 0 || !run.limits.empty())
        c.report(name + ", injected", r.injected,
                 fmt::format("energy put into H_d [J], to {:.1g} of the quadrature", r.quadrature));
      c.report(name + ", input peak", *std::max_element(r.peak.begin(), r.peak.end()),
               share_of_limits(r.peak, run.limits), r.peak.size() > 1 ? r.peak : Vec{});
    }
  certify_periods(loop, o.periods, c);
  certify_plants(loop, o, settled, c);
}

}  // namespace porthos::energy_shaping
