#pragma once
#include "contact/rigid.h"
#include "tests/contact/support.h"

/// Runs of models with rigid contacts.
namespace porthos::test {

inline Law rigid_law(double e, contact::Simultaneous rule = contact::Simultaneous::reflections) {
  Law law;
  law.form = Law::Form::rigid;
  law.restitution = e;
  law.simultaneous = rule;
  return law;
}
/// With friction.
inline Law rough_law(double e, double mu) {
  Law law = rigid_law(e);
  law.friction = mu;
  return law;
}
/// A run whose steps jump at impacts.
struct RigidRun {
  const ContactModel& model;
  std::unique_ptr<integrators::Integrator> method;
  phs::State state;
  Gauge gauge;
  std::vector<phs::PowerAccount> powers;
  std::vector<integrators::Jump> jumps = {};
  long double H0 = 0, lost = 0;
  double least_loss = 0;  ///< of a step and a power
  Outcome outcome = Outcome::ok;

  RigidRun(const ContactModel& m, const Numbers& x, double h, const char* name = "gauss16")
      : RigidRun(m, m, x, h, name) {}
  /// whole: `contacts` with what acts on it
  RigidRun(const phs::Model& whole, const ContactModel& contacts, const Numbers& x, double h,
           const char* name = "gauss16")
      : model(contacts),
        method(contact::with_rigid_contacts(
            whole, contacts, h,
            [&](const phs::Model& run) { return integrators::make_integrator(name, run, h); })),
        state(whole.description(), x),
        gauge(whole),
        powers(whole.description().powers) {
    H0 = energy();
  }
  long double energy() { return gauge.energy(state); }
  bool step() {
    outcome = method->step(state);
    if (outcome != Outcome::ok) return false;
    for (const auto& j : method->jumps()) jumps.push_back(j);
    for (size_t a = 0; a < method->port_work().size(); ++a)
      if (powers[a].kind == phs::PowerKind::supplied) {
        lost -= method->port_work()[a];
      } else if (powers[a].kind == phs::PowerKind::dissipated) {
        lost += method->port_work()[a];
        least_loss = std::min(least_loss, method->port_work()[a]);
      }
    return true;
  }
  double defect() { return double(energy() - H0 + lost); }
};

}  // namespace porthos::test
