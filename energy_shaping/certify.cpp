#include "energy_shaping/certify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/derivatives.h"
#include "energy_shaping/detail/region.h"
#include "energy_shaping/modes.h"
#include "energy_shaping/potential_loop.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

/// A random state of the region, with momenta of rates up to region.rate if the plant relates
/// momenta to rates.
Vec random_state_of(const ClosedLoop& loop, const Region& r, std::mt19937_64& generator) {
  const auto* matched = dynamic_cast<const MatchedLoop*>(&loop);
  if (!matched) {
    Vec x = phs::random_state(loop.description(), 0.5, generator);
    const auto* shaped = dynamic_cast<const PotentialLoop*>(&loop);
    if (shaped && shaped->parts().zero_momentum)
      for (size_t i = 0; i < 7; ++i) x[x.size() / 2 + shaped->parts().base_q + i] = 0;
    return x;
  }
  Vec v(r.lower.size());
  for (double& y : v) y = std::uniform_real_distribution<double>(-r.rate, r.rate)(generator);
  return matched->state(random_coordinates(r, generator), v);
}

void rate_of_energy(const ClosedLoop& loop, const Region& region, Certificate& c) {
  const auto law = loop.loop<double>();
  const auto plant = loop.plant().instantiate<double>();
  std::mt19937_64 generator(region.seed + 1);
  const size_t nx = loop.rest().size();
  Vec u(size_t(loop.plant().description().nu)), dx(nx), e(nx), Re(nx), worst_at;
  double worst = 0;
  for (int i = 0; i < std::min(region.samples, 500); ++i) {
    const Vec x = random_state_of(loop, region, generator);
    law->law(0.0, x, u);
    plant->field(0.0, x, u, dx);
    law->gradient(x, e);
    law->apply_dissipation(x, e, Re);
    double power = 0, size = 1e-300;
    for (size_t k = 0; k < nx; ++k) {
      power += e[k] * (dx[k] + Re[k]);
      size += std::fabs(e[k] * dx[k]) + std::fabs(e[k] * Re[k]);
    }
    if (!(std::fabs(power) / size <= worst)) {
      worst = std::fabs(power) / size;
      worst_at = x;
    }
  }
  const auto* matched = dynamic_cast<const MatchedLoop*>(&loop);
  const double bound = std::max(1e-9, matched ? matched->options().matching : 0.0);
  c.at_most("H_d' = -∂H_dᵀ R_d ∂H_d", worst, bound, "of the plant under the law, relative",
            worst_at);
}

void linearised(const ClosedLoop& loop, Certificate& c) {
  const auto s = phs::spectrum(loop.rest().size(), field_jacobian(loop, loop.rest()));
  // The bound is the rounding of eigenvalues: slower stable modes cannot be distinguished from
  // unstable ones.
  certify_modes(
      c, s.rest, 1e-12,
      s.zeros ? fmt::format("linearised at rest, {} zeros apart", s.zeros) : "linearised at rest");
}

/// H_d says nothing of a joint that has neither stiffness nor actuator: it may drift away.
void held_joints(const ClosedLoop& loop, Certificate& c) {
  const auto* shaped = dynamic_cast<const PotentialLoop*>(&loop);
  if (!shaped || shaped->free_joints().empty()) return;
  std::string names;
  for (const auto& joint : shaped->free_joints()) add_to_list(names, joint);
  c.at_most("joints that nothing holds", double(shaped->free_joints().size()), 0,
            names +
                ": neither stiffness nor actuator; drive them, give their URDF joints springs, "
                "or fix them");
}

/// "40 % of its limit", the largest share of an input; empty: there are no limits.
std::string share_of_limits(const Vec& peak, const Vec& limits) {
  if (limits.empty()) return "";
  double share = 0;
  for (size_t j = 0; j < limits.size(); ++j) share = std::max(share, peak[j] / limits[j]);
  return fmt::format("{:.0f} % of its limit", 100 * share);
}

void inputs_on_basin(const ClosedLoop& loop, const Region& region, const Basin& basin,
                     const Vec& limits, Certificate& c) {
  const auto law = loop.loop<double>();
  std::mt19937_64 generator(region.seed + 2);
  Vec u(size_t(loop.plant().description().nu)), at, peaks(loop.actuated().size());
  double peak = 0;
  int inside_basin = 0;
  const size_t n = region.lower.size();
  for (int i = 0; i < 20000; ++i) {
    Vec x = random_state_of(loop, region, generator);
    Vec still = x;
    std::fill(still.begin() + long(n), still.end(), 0.0);
    const double V = law->hamiltonian(still), T = law->hamiltonian(x) - V;
    if (!(V < basin.level) || !(T > 0)) continue;
    const double scale = std::sqrt((basin.level - V) / T);  // onto the level set
    for (size_t k = n; k < 2 * n; ++k) x[k] *= scale;
    law->law(0.0, x, u);
    ++inside_basin;
    for (size_t j = 0; j < peaks.size(); ++j) {
      const double size = std::fabs(u[size_t(loop.actuated()[j])]);
      peaks[j] = std::max(peaks[j], size);
      if (size > peak) {
        peak = size;
        at = x;
      }
    }
  }
  const std::string share = share_of_limits(peaks, limits);
  c.report("input on the basin", peak,
           fmt::format("largest |u| on H_d = c, {} states sampled{}{}", inside_basin,
                       share.empty() ? "" : "; ", share),
           {}, at);
}

/// ", start 2", where there are several.
std::string of_start(const CertifyOptions& o, size_t s) {
  return o.starts.size() > 1 ? fmt::format(", start {}", s + 1) : "";
}

/// H_d of each start against the level c of the basin. Where V_d stays below c on the straight way
/// to the rest point, the start is in its component.
void starts_in_basin(const ClosedLoop& loop, const CertifyOptions& o, const Basin& basin,
                     Certificate& c) {
  const auto law = loop.instantiate<double>();
  const Vec& rest = loop.rest();
  const double level = basin.level, clear = level - 0.01 * std::max(basin.depth, 0.0);
  for (size_t s = 0; s < o.starts.size(); ++s) {
    require_size("start state", o.starts[s].size(), rest.size());
    const double H = law->hamiltonian(o.starts[s]);
    const bool straight = straight_way_below(loop, o.starts[s], clear);
    c.report("basin, H_d" + of_start(o, s), H,
             !(H < level) ? fmt::format("at the start: outside the basin, c = {:.6g}", level)
             : straight   ? fmt::format("at the start: inside the basin, c = {:.6g}", level)
                          : fmt::format("at the start: below c = {:.6g}, but on the straight way "
                                          "to the rest V_d comes within 1 % of it",
                                        level));
  }
}

double distance(const ClosedLoop& loop, const Vec& x) {
  double d = 0;
  for (size_t i = 0; i < x.size(); ++i) d = std::max(d, std::fabs(x[i] - loop.rest()[i]));
  return d;
}

/// What the offset of a state from the rest point costs by H_d's Hessian there, ½ δqᵀ K δq [J]. At
/// another minimum of H_d it is not small, as H_d is. A coordinate without stiffness adds nothing,
/// and neither do full turns of an angle where H_d repeats. 0 too where H_d says no more: of
/// quaternions, and where directions without stiffness are no coordinates, so that they may bend.
class HeldOffset {
 public:
  explicit HeldOffset(const ClosedLoop& loop)
      : loop_(loop), system_(loop.instantiate<double>()), n_(loop.rest().size() / 2) {
    if (has_quaternions(loop)) return;
    K_ = hessian(loop, loop.rest());
    double stiffest = 0;
    for (size_t i = 0; i < n_; ++i) stiffest = std::max(stiffest, K(i, i));
    for (size_t i = 0; i < n_; ++i)
      if (K(i, i) > 1e-12 * stiffest) held_.push_back(i);
    Vec scaled;
    for (const size_t i : held_)
      for (const size_t j : held_) scaled.push_back(K(i, j) / std::sqrt(K(i, i) * K(j, j)));
    if (held_.empty() || phs::symmetric_eigenvalues(held_.size(), scaled)[0] < 1e-9) held_.clear();
  }
  double operator()(const Vec& x) {
    Vec d(n_);
    for (const size_t i : held_) d[i] = x[i] - loop_.rest()[i];
    for (const auto& b : loop_.plant().description().blocks)
      if (b.kind == phs::BlockKind::angle && size_t(b.at) < n_) d[size_t(b.at)] -= turns(b, d);
    double sum = 0;
    for (const size_t i : held_)
      for (const size_t j : held_) sum += 0.5 * d[i] * K(i, j) * d[j];
    return sum;
  }

 private:
  double K(size_t i, size_t j) const { return K_[i * loop_.rest().size() + j]; }
  /// The full turns in an offset, or 0 where H_d is another after them.
  double turns(const phs::Block& b, const Vec& d) const {
    const auto i = size_t(b.at);
    const double turn = 2 * std::acos(-1.0), whole = turn * std::round(d[i] / turn);
    Vec x = loop_.rest();
    const double rest = system_->hamiltonian(x);
    x[i] += whole;
    return system_->hamiltonian(x) - rest < 1e-9 * K(i, i) ? whole : 0;
  }

  const ClosedLoop& loop_;
  std::unique_ptr<phs::System<double>> system_;
  size_t n_;
  Vec K_;
  std::vector<size_t> held_;
};

void runs(const ClosedLoop& loop, const CertifyOptions& o, Certificate& c) {
  const double rest = loop.instantiate<double>()->hamiltonian(loop.rest());
  HeldOffset offset(loop);
  // Near the rest point both energies are alike; ten times leaves room for a V_d that is not
  // quadratic, and a part of the start for rounding.
  const auto elsewhere = [&](const Run& r) {
    const double left = std::fabs(r.H.back() - rest), begun = std::fabs(r.H.front() - rest);
    return r.finished && left <= o.settled * begun && offset(r.x.back()) > 10 * left + 1e-6 * begun;
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
             H0 > 0 && settled(r) ? Finding::holds : Finding::fails,
             (r.H.back() - rest) / H0,
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
      // With a hold H_d may rise; with the law in continuous time it must not.
      const double allowed = 1e-11 * std::max(H0, std::fabs(rest));
      const std::string rise = name + ", rise of H_d";
      if (period == 0 && run.limits.empty())
        c.at_most(rise, r.rise, allowed, "in a step [J]");
      else
        c.report(rise, r.rise, "in a step [J]");
      if (period > 0 || !run.limits.empty())
        c.report(name + ", injected", r.injected,
                 fmt::format("energy put into H_d [J], to {:.1g} of the quadrature", r.quadrature));
      c.report(name + ", input peak", *std::max_element(r.peak.begin(), r.peak.end()),
               share_of_limits(r.peak, run.limits), r.peak.size() > 1 ? r.peak : Vec{});
    }
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

}  // namespace

Certificate certify(const ClosedLoop& loop, const CertifyOptions& o) {
  Certificate c = loop.certificate();
  const size_t n = loop.rest().size() / 2;
  if (o.region.samples < 1)
    throw InvalidArgument(fmt::format("samples is {}, expected 1 or more: none would show nothing",
                                      o.region.samples));
  check_limits(loop, o.run.limits);
  rate_of_energy(loop, o.region, c);
  linearised(loop, c);
  held_joints(loop, c);
  if (n <= 3 && !has_quaternions(loop)) {
    const auto points = critical_points(loop, o.region);
    int minima = 0;
    for (const auto& p : points) minima += p.descending == 0;
    c.report("critical points of V_d", double(points.size()),
             fmt::format("in the region, {} of them minima", minima));
    for (size_t i = 0; i < std::min<size_t>(points.size(), 8); ++i)
      c.report(points[i].descending == 0   ? "  minimum"
               : points[i].descending == 1 ? "  pass"
                                           : "  summit",
               points[i].value, "V_d", {}, points[i].q);
    const Basin b = basin(loop, o.region);
    const bool empty = !(b.depth > 0);
    c.add({"basin, c - H_d(rest)",
           empty ? Finding::fails : Finding::holds,
           b.depth,
           0,
           (empty ? "no level above the rest point holds a state; "
                  : "no state of its component of {H_d < c} leaves; ") +
               b.method,
           {},
           b.at});
    c.report("basin, c", b.level, "");
    starts_in_basin(loop, o, b, c);
    if (!empty) inputs_on_basin(loop, o.region, b, o.run.limits, c);
  }
  runs(loop, o, c);
  return c;
}

}  // namespace porthos::energy_shaping
