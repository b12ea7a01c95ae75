#include "scene/run/soft_stops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/assemble/assembly.h"
#include "scene/run/lone_inertia.h"
#include "scene/run/run_report.h"
#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

/// With the limits of the model file where the scene states none; none: no soft stop.
std::optional<JointStop> soft_stop(const Element& e, const mechanics::Mechanism& m) {
  JointStop s;
  if (const auto* const own = e.add.target<SoftLimits>())
    s = {own->lower,
         own->upper,
         {.form = contact::Law::Form::power, .stiffness = own->stiffness, .exponent = 2}};
  else if (e.stop && !e.stop->law.rigid())
    s = *e.stop;
  else
    return {};
  for (const auto& j : m.joint_properties()) {
    if (j.joint != e.joint) continue;
    if (!s.lower) s.lower = j.lower;
    if (!s.upper) s.upper = j.upper;
  }
  return s;
}

struct ShortestContact {
  std::string name;
  double tenth = HUGE_VAL;  ///< [s]
};
/// Of the soft stops that `wanted` admits by stop, element, coordinate and rate of the joint.
template <class Wanted>
ShortestContact shortest_contact(const Scene& scene, const Assembly& a, const phs::State& s,
                                 const Wanted& wanted) {
  ShortestContact best;
  if (!a.mechanical) return best;
  const auto& m = a.mechanical->mechanism();
  const size_t nq = size_t(m.nq());
  mechanics::Workspace<double> w(m);
  w.set_turns(s.turns);
  const auto q = std::span(s.x).first(nq);
  mechanics::rates_from_momenta<double>(m, w, q, std::span(s.x).subspan(nq, nq));
  const auto rates = w.rate;
  size_t turn = 0;
  for (const auto& c : m.coordinates()) {
    const size_t at = size_t(c.q), v = size_t(c.v);
    double z = s.x[at];
    if (c.kind == phs::BlockKind::angle) z += phs::two_pi_hi * double(s.turns[turn++]);
    for (const Element& e : scene.elements) {
      const auto stop = e.joint == c.name ? soft_stop(e, m) : std::nullopt;
      if (!stop || c.nq != 1 || !wanted(*stop, e, z, rates[v])) continue;
      const double inertia = lone_inertia(m, w, q, c),
                   tenth = 0.1 * contact::contact_time(stop->law, inertia, std::fabs(rates[v]));
      if (tenth < best.tenth) best = {e.name, tenth};
    }
  }
  return best;
}

}  // namespace

void advise_at_soft_stops(RunReport& r, const Scene& scene, const Assembly& assembly,
                          const phs::State& end) {
  using integrators::Outcome;
  if ((r.outcome != Outcome::not_converged && r.outcome != Outcome::not_finite) ||
      !r.trouble.empty() || !std::isfinite(r.energy.initial_J))
    return;
  const auto meets = [&](const JointStop& stop, const Element&, double z, double rate) {
    const double ahead = z + 2 * r.step_s * rate;
    return (stop.lower && std::min(z, ahead) < *stop.lower) ||
           (stop.upper && std::max(z, ahead) > *stop.upper);
  };
  const auto contact = shortest_contact(scene, assembly, end, meets);
  if (contact.tenth < r.step_s)
    r.trouble = fmt::format("{}, to begin with {:.2g} s, a tenth of a contact with '{}'", ending(r),
                            contact.tenth, contact.name);
}

void note_soft_limits(RunReport& r, const Scene& scene, const Assembly& assembly,
                      const phs::State& end) {
  const auto fails = [](const Check& c) { return c.name == "energy" && !c.pass; };
  const auto limits = std::ranges::find(scene.elements, "limits", &Element::type);
  if (r.outcome != integrators::Outcome::ok || limits == scene.elements.end() ||
      std::ranges::none_of(r.checks, fails))
    return;
  const auto are_limits = [](const JointStop&, const Element& e, double, double) {
    return e.type == "limits";
  };
  const auto contact = shortest_contact(scene, assembly, end, are_limits);
  const bool known = contact.tenth < r.step_s;
  r.notes.push_back(
      fmt::format("the slope of the force of '{}' jumps where the limit begins, inside a step: "
                  "expected there a shorter step, {}or \"joint_stop\" with law = \"rigid\" and a "
                  "restitution",
                  known ? contact.name : limits->name,
                  known ? fmt::format("to begin with {:.2g} s, ", contact.tenth) : ""));
}

}  // namespace porthos::scene
