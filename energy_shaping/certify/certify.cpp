#include "energy_shaping/certify/certify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "energy_shaping/certify/detail/basin_inputs.h"
#include "energy_shaping/certify/detail/certify_runs.h"
#include "energy_shaping/certify/detail/region.h"
#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/modes.h"
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
                ": neither stiffness nor actuator; drive them, fix them, or give them springs, "
                "JointSpec(stiffness=), with compensate = false");
}

/// H_d of each start against the level c of the basin. Where V_d stays below c on the straight way
/// to the rest point, the start is in its component.
void starts_in_basin(const ClosedLoop& loop, const CertifyOptions& o, const Basin& basin,
                     Certificate& c) {
  const auto law = loop.instantiate<double>();
  const double level = basin.level, clear = level - 0.01 * std::max(basin.depth, 0.0);
  for (size_t s = 0; s < o.starts.size(); ++s) {
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

/// A set of points on which V_d is flat is told as one.
void report_points(const ClosedLoop& loop, std::vector<CriticalPoint> points, Certificate& c) {
  const auto names = coordinate_names(loop.plant().description());
  const size_t more = std::erase_if(points, [](const CriticalPoint& p) { return p.again; });
  const auto minima = std::ranges::count(points, 0, &CriticalPoint::descending);
  c.report("critical points of V_d", double(points.size()),
           fmt::format("in the region, {} of them minima", minima));
  std::set<size_t> flat;
  size_t flat_sets = 0;
  for (const auto& p : points) {
    flat.insert(p.flat.begin(), p.flat.end());
    flat_sets += !p.flat.empty();
  }
  if (!flat.empty()) {
    std::string along;
    for (const size_t a : flat) add_to_list(along, "'" + names[a] + "'");
    c.report("V_d is flat", double(flat.size()),
             fmt::format("along {}: {} critical points found there count as {}; H_d does not hold "
                         "these coordinates, a stiffness would",
                         along, more + flat_sets, flat_sets));
  }
  for (size_t i = 0; i < std::min<size_t>(points.size(), 8); ++i) {
    const CriticalPoint& p = points[i];
    c.report(!p.flat.empty()     ? "  flat"
             : p.descending == 0 ? "  minimum"
             : p.descending == 1 ? "  pass"
                                 : "  summit",
             p.value, "V_d", {}, p.q);
  }
}

void check_starts(const ClosedLoop& loop, const CertifyOptions& o) {
  if (o.starts.empty() && (o.periods != std::vector{0.0} || !o.plants.empty()))
    throw InvalidArgument(fmt::format("{} act in runs, and no starts are given, expected some",
                                      o.plants.empty() ? "periods" : "plants"));
  for (size_t s = 0; s < o.starts.size(); ++s) {
    require_size("start state", o.starts[s].size(), loop.rest().size());
    if (const auto why = loop.hindrance(o.starts[s]); !why.empty())
      throw InvalidArgument(fmt::format("starts[{}]: {}", s, why));
  }
}

}  // namespace

Certificate certify(const ClosedLoop& loop, const CertifyOptions& o) {
  Certificate c = loop.certificate();
  const size_t n = loop.rest().size() / 2;
  if (o.region.samples < 1)
    throw InvalidArgument(fmt::format("samples is {}, expected 1 or more: none would show nothing",
                                      o.region.samples));
  check_limits(loop, o.run.limits);
  const bool small = n <= 3 && !has_quaternions(loop);
  const auto points = small ? critical_points(loop, o.region) : std::vector<CriticalPoint>{};
  check_starts(loop, o);
  rate_of_energy(loop, o.region, c);
  linearised(loop, c);
  held_joints(loop, c);
  double limited_from = HUGE_VAL;
  if (small) {
    report_points(loop, points, c);
    const Basin b = basin(loop, o.region, points);
    const bool empty = !(b.depth > 0);
    c.add({"basin, c - H_d(rest)",
           empty ? Finding::fails : Finding::holds,
           b.depth,
           0,
           (empty ? "no level above the rest point holds a state; "
            : o.run.limits.empty()
                ? "no state of its component of {H_d < c} leaves; "
                : "no state of its component of {H_d < c} leaves by the law without its limit; ") +
               b.method,
           {},
           b.at});
    c.report("basin, c", b.level, "");
    starts_in_basin(loop, o, b, c);
    if (!empty) limited_from = inputs_on_basin(loop, o.region, b, o.run.limits, c);
  }
  certify_runs(loop, o, limited_from, c);
  return c;
}

}  // namespace porthos::energy_shaping
