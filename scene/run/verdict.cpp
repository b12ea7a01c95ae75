#include "scene/run/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/run/growth_words.h"

namespace porthos::scene {
namespace {

using integrators::Claim;
using integrators::Declaration;
using integrators::Outcome;
using Limit = std::optional<double>;

/// The quantities a method keeps with any step: a check of these cannot detect a step that is too
/// long. A claim on the energy that the run contradicts is not believed.
struct Kept {
  bool energy, quadratic, contradicted;
  Kept(const Declaration& d, const Scene& scene, const RunReport& r)
      : energy(d.passivity_exact == Claim::holds ||
               (d.energy_exact == Claim::holds && r.ports.empty() && r.losses.empty())),
        quadratic(d.quadratic_invariants == Claim::holds),
        contradicted(energy && contradicts_exact_energy(r)) {
    energy = (energy && !contradicted) || (scene.monitor && scene.monitor->project);
  }
};

Limits judged_limits(const Scene& scene) {
  return scene.verify.any() ? scene.verify : default_limits(scene.orbit.has_value());
}

class Judge {
 public:
  Judge(RunReport& r, const Scene& scene, const Declaration& method, const Meter& meter)
      : r_(r),
        scene_(scene),
        limits_(judged_limits(scene)),
        meter_(meter),
        method_(method),
        kept_(method, scene, r) {}

  void run() {
    if (r_.outcome != Outcome::ok) {
      r_.checks.push_back({"outcome", double(static_cast<int>(r_.outcome)), 0, false});
      r_.notes.push_back(fmt::format("the run ended at t = {} s: {}", r_.simulated_s, ending(r_)));
    }
    if (kept_.contradicted && r_.outcome == Outcome::ok)
      r_.notes.push_back(
          fmt::format("{} is declared to keep the energy with any step, and its error is {:.2g}, "
                      "expected below {:g}: the declaration is not believed",
                      method_.name, r_.energy.max_rel_error, no_exact_energy));
    check("energy", limits_.energy, r_.energy.max_rel_error,
          !kept_.energy && !next_to_nothing_moves(r_.energy));
    momenta();
    // Time stepping keeps the norm too.
    if (meter_.has_rotations())
      check("quaternion_norm", limits_.quaternion_norm, r_.quaternion_norm_error,
            !kept_.quadratic && !method_.needs.contacts);
    else
      cannot("quaternion_norm", limits_.quaternion_norm, "the system has no rotations");
    doubt_invariants();
    constraints();
    ledgers();
    check("balance", limits_.balance,
          std::fabs(r_.defect_J) / std::max(r_.energy.scale_J, r_.turned_over_J), !kept_.energy);
    cannot("symmetry", limits_.symmetry,
           "porthos verify goes forth and back, porthos run does not");
    choose();
  }

 private:
  /// Of what the motion since the start has changed.
  void check(const char* name, const Limit& limit, double value, bool telling) {
    if (only_start(r_))
      cannot(name, limit, "nothing but the start was seen");
    else if (limit)
      add(name, *limit, value, telling);
  }
  void add(const char* name, double limit, double value, bool telling) {
    r_.checks.push_back({name, value, limit, value <= limit, telling});  // NaN fails
  }
  void cannot(const char* name, const Limit& limit, const char* why) {
    if (limit) r_.not_applicable.push_back({name, why});
  }

  /// Checks the momenta that are invariants, or what remains after the impulses are subtracted.
  void momenta() {
    const bool pushed = !r_.impulses.rows.empty() && !r_.space;
    if (pushed && others_push()) {
      const char* const why = "gravity or the ground push too, and keep no ledger of their impulse";
      cannot("linear_momentum", limits_.linear_momentum, why);
      cannot("angular_momentum", limits_.angular_momentum, why);
      return tell_propellant();
    }
    if (pushed && !r_.impulses.integrated) {
      const char* const why =
          "the method keeps no ledger of its own, and the impulses are known to the order of the "
          "step only";
      cannot("linear_momentum", limits_.linear_momentum, why);
      cannot("angular_momentum", limits_.angular_momentum, why);
      return tell_propellant();
    }
    const bool thrust =
        pushed && std::any_of(r_.impulses.rows.begin(), r_.impulses.rows.end(),
                              [](const ImpulseRow& row) { return row.type != "torquer"; });
    const char* const no_invariant = "the system declares no invariant of this name";
    // Every method of the catalogue keeps linear invariants.
    if (thrust)
      check("linear_momentum (less impulses)", limits_.linear_momentum, r_.impulses.linear_left,
            false);
    else if (meter_.linear_is_structure())
      cannot("linear_momentum", limits_.linear_momentum,
             r_.method == "recorded"
                 ? "the centre of mass is judged beside free fall: centre_of_mass"
                 : "the centre of mass moved in closed form, nothing was left to check");
    else if (meter_.has_linear())
      check("linear_momentum", limits_.linear_momentum, r_.linear_momentum_error, false);
    else
      cannot("linear_momentum", limits_.linear_momentum, no_invariant);
    const bool tells = !kept_.quadratic;
    if (pushed)
      check("angular_momentum (less impulses)", limits_.angular_momentum, r_.impulses.angular_left,
            tells);
    else if (r_.space)
      check("angular_momentum (less impulses)", limits_.angular_momentum, r_.space->angular_defect,
            tells);
    else if (meter_.has_angular())
      check("angular_momentum", limits_.angular_momentum, r_.angular_momentum_error, tells);
    else
      cannot("angular_momentum", limits_.angular_momentum, no_invariant);
    tell_propellant();
  }
  /// A method that is declared to keep quadratic invariants keeps them to rounding.
  void doubt_invariants() {
    if (!kept_.quadratic || r_.outcome != Outcome::ok || scene_.iteration_tolerance > 0) return;
    constexpr double no_rounding = 1e-9;
    for (const Check& c : r_.checks)
      if ((c.name == "angular_momentum" || c.name == "quaternion_norm") && !c.pass &&
          c.value > no_rounding)
        r_.notes.push_back(fmt::format(
            "{} is declared to keep quadratic invariants with any step, and {} is off by {:.2g}, "
            "expected at most {:g}: the declared quadratic_invariants is contradicted",
            method_.name, c.name, c.value, no_rounding));
  }
  void constraints() {
    if (meter_.constraint_rows() == 0)
      return cannot("constraints", limits_.constraints, "the system has no constraints");
    // Always checked. Every method that takes constraints closes both with any step.
    const double limit = limits_.constraints.value_or(usual_constraints);
    add("constraints", limit, r_.constraint_gap, false);
    add("constraint_rates", 10 * limit, r_.constraint_slip, false);
  }
  /// Whether other causes than thrusters, wrenches and torquers change the momentum.
  bool others_push() const {
    const auto& elements = scene_.elements;
    return scene_.urdf.base == mechanics::UrdfOptions::Base::fixed ||
           mechanics::norm(scene_.urdf.gravity) > 0 || scene_.constraints.on_the_world() ||
           std::any_of(elements.begin(), elements.end(),
                       [](const Element& e) { return e.latch && e.latch->body == "world"; });
  }
  void tell_propellant() {
    for (const ImpulseRow& row : r_.impulses.rows)
      if (row.propellant_kg > 0)
        r_.notes.push_back(fmt::format(
            "thruster '{}' took {:.4g} kg of propellant; masses and inertias of the links are held "
            "constant",
            row.name, row.propellant_kg));
  }

  void ledgers() {
    if (r_.space) {
      // The Kepler flow and the works of the kicks are exact: docs/space.md.
      check("orbital", limits_.orbital, r_.space->orbital.relative(), false);
      const double open = r_.space->coupling.relative();
      check("coupling", limits_.coupling, open, true);
      if (limits_.coupling && open > *limits_.coupling)
        r_.notes.push_back(fmt::format(
            "the coupling ledger does not close to its limit: {}a shorter step does{}",
            scene_.controllers.empty()
                ? ""
                : "a controller that moves a joint faster than a few steps opens it, lower its "
                  "damping and stiffness (bandwidth), else ",
            scene_.orbit && scene_.orbit->splitting == "lobatto8c"
                ? ""
                : ", or a splitting of higher order ([orbit] splitting = \"lobatto8c\")"));
      return;
    }
    const char* const why = "it is a ledger of a spacecraft in [orbit]";
    cannot("orbital", limits_.orbital, why);
    cannot("coupling", limits_.coupling, why);
  }

  /// A pass must be meaningful: if all requested checks hold with any step, the energy is judged
  /// too, unless it also holds with any step.
  void choose() {
    if (r_.checks.empty() || only_start(r_) || limits_.step_halving || kept_.energy ||
        limits_.energy ||
        std::any_of(r_.checks.begin(), r_.checks.end(), [](const Check& c) { return c.telling; }))
      return;
    check("energy", default_limits(false).energy, r_.energy.max_rel_error, true);
    r_.notes.push_back(fmt::format(
        "{} keeps all that [verify] asks for with any step: the energy is judged besides, which it "
        "does not keep with any",
        method_.name));
  }

  RunReport& r_;
  const Scene& scene_;
  const Limits limits_;
  const Meter& meter_;
  const Declaration& method_;
  const Kept kept_;
};

}  // namespace

bool next_to_nothing_moves(const EnergyReport& e) {
  double parts = 0;
  for (const auto& [name, joule] : e.scale_parts) parts += joule;
  return parts < e.next_to_nothing * std::fabs(e.initial_J) && e.scale_J == std::fabs(e.initial_J);
}

bool contradicts_exact_energy(const RunReport& r) {
  return !(r.energy.max_rel_error < no_exact_energy);
}

bool Limits::any() const {
  for (const auto& limit : {energy, linear_momentum, angular_momentum, quaternion_norm, balance,
                            symmetry, step_halving, orbital, coupling, constraints})
    if (limit) return true;
  return false;
}

Limits default_limits(bool in_orbit) {
  Limits l;
  l.energy = 1e-9;
  l.linear_momentum = l.angular_momentum = 1e-10;
  l.quaternion_norm = 1e-12;
  if (in_orbit) {
    l.orbital = 1e-12;
    l.coupling = 0.1;
  }
  return l;
}

void judge(RunReport& r, const Scene& scene, const Declaration& method, const Meter& meter) {
  Judge(r, scene, method, meter).run();
}

std::optional<double> limit_of_check(const Scene& scene, const std::string& check) {
  const Limits l = judged_limits(scene);
  const double constraints = l.constraints.value_or(usual_constraints);
  const std::pair<const char*, Limit> known[] = {
      {"energy", l.energy.value_or(*default_limits(false).energy)},
      {"linear_momentum", l.linear_momentum},
      {"linear_momentum (less impulses)", l.linear_momentum},
      {"angular_momentum", l.angular_momentum},
      {"angular_momentum (less impulses)", l.angular_momentum},
      {"quaternion_norm", l.quaternion_norm},
      {"constraints", constraints},
      {"constraint_rates", 10 * constraints},
      {"orbital", l.orbital},
      {"coupling", l.coupling},
      {"balance", l.balance},
      {"step_halving", l.step_halving.value_or(usual_step_halving)},
      {"momentum_across_events", usual_momentum_jump},
      {"missed_events", 0},
      {"missed_handovers", 0}};
  for (const auto& [name, limit] : known)
    if (name == check) return limit;
  return {};
}

std::string ending(const RunReport& r) {
  if (!r.trouble.empty()) return r.trouble;
  const std::string smaller = fmt::format("expected a smaller step than {:g} s", r.step_s);
  switch (r.outcome) {
    case Outcome::not_converged:
      return "the iteration of a step's equations did not converge: " + smaller;
    case Outcome::not_finite:
      if (!std::isfinite(r.energy.initial_J))
        return "the energy of the start is infinite or not a number";
      return fmt::format("{} overflowed, the state before it is finite: {}",
                         r.cost.sweeps > 0 ? "the iteration of a step's equations" : "a step",
                         smaller);
    default:
      return to_string(r.outcome);
  }
}

const char* to_string(Verdict v) {
  return v == Verdict::pass ? "pass" : v == Verdict::fail ? "fail" : "not judged";
}

Verdict RunReport::verdict() const {
  if (outcome != Outcome::ok || interrupted ||
      !std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.pass; }))
    return Verdict::fail;
  const bool tells =
      std::any_of(checks.begin(), checks.end(), [](const Check& c) { return c.telling; });
  return tells && !std::ranges::any_of(not_applicable, &NotApplicable::undecided)
             ? Verdict::pass
             : Verdict::not_judged;
}

}  // namespace porthos::scene
