#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "contact/contact.h"
#include "integrators/control/switching.h"
#include "mechanics/builder.h"
#include "tests/support/robots.h"
#include "tests/support/tree_case.h"

namespace porthos::test {

using contact::Contact;
using contact::ContactModel;
using contact::Kind;
using contact::Law;
using contact::Shape;
using integrators::Outcome;
using mechanics::Vec3d;
using Numbers = std::vector<double>;

inline mechanics::BodySpec body_on(const char* name, const char* joint, double mass) {
  mechanics::BodySpec b;
  b.name = name;
  b.parent = "world";
  b.joint.type = joint;
  b.mass.mass = mass;
  b.mass.inertia = {0.02 * mass, 0, 0, 0.03 * mass, 0, 0.04 * mass};
  return b;
}
inline std::shared_ptr<const mechanics::MechanicalModel> mechanism_of(
    const std::vector<mechanics::BodySpec>& bodies, double gravity = 0) {
  mechanics::MechanismBuilder b("bodies");
  for (const auto& each : bodies) b.add(each);
  b.gravity({0, 0, -gravity});
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}
/// Two links of 1 m that hang along -z and turn about y by upper and lower, 2 kg and 1 kg.
inline std::shared_ptr<const mechanics::MechanicalModel> two_links(double gravity) {
  auto upper = body_on("upper", "revolute", 2), lower = body_on("lower", "revolute", 1);
  lower.parent = "upper";
  lower.placement.r = {0, 0, -1};
  for (auto* b : {&upper, &lower}) {
    b->joint.axis = {0, -1, 0};
    b->mass.com = {0, 0, -0.5};
  }
  return mechanism_of({upper, lower}, gravity);
}
inline Shape ball(double radius) {
  Shape s;
  s.radius = radius;
  return s;
}
inline Shape ground() {
  Shape s;
  s.kind = Kind::plane;
  return s;
}
inline Law power_law(double k, double n, double loss = 0) {
  return {.form = Law::Form::power, .stiffness = k, .exponent = n, .loss = loss};
}

/// A method, its order, its longest step [s], and how often that is halved.
struct Rung {
  const char* method;
  double order, coarse;
  int halvings;
};
/// error(method, step) falls by each method's order from its longest step to its shortest.
template <class Error>
void expect_orders(std::initializer_list<Rung> rungs, const Error& error) {
  for (const auto& [method, order, coarse, halvings] : rungs) {
    const double first = std::fabs(error(method, coarse));
    const double last = std::fabs(error(method, std::ldexp(coarse, -halvings)));
    const double measured = std::log2(first / last) / halvings;
    std::printf("  %s: errors %.1e to %.1e m, order %.2f   bound %g\n", method, first, last,
                measured, order - 0.5);
    EXPECT_GE(measured, order - 0.5);
  }
}

/// A run by gauss16 whose steps end at touches, or one without (`blind`).
struct ContactRun {
  const ContactModel& model;
  std::unique_ptr<integrators::Integrator> method;
  phs::State state;
  Gauge gauge;
  long double H0 = 0;
  Numbers works;
  Outcome outcome = Outcome::ok;
  double least_work = 0;  ///< of a step and a loss

  ContactRun(const ContactModel& m, const Numbers& x, double h, bool blind = false,
             const integrators::Options& options = {})
      : model(m),
        method(integrators::make_integrator("gauss16", m, h, options)),
        state(m.description(), x),
        gauge(m),
        works(m.description().powers.size()) {
    if (!blind) method = integrators::make_switched(std::move(method), m, h, m.depths());
    H0 = energy();
  }
  long double energy() { return gauge.energy(state); }
  bool step() {
    outcome = method->step(state);
    if (outcome != Outcome::ok) return false;
    for (size_t k = 0; k < works.size(); ++k) {
      works[k] += method->port_work()[k];
      least_work = std::min(least_work, method->port_work()[k]);
    }
    return true;
  }
  /// H - H(start) + losses [J].
  double defect() {
    long double d = energy() - H0;
    for (const double w : works) d += w;
    return double(d);
  }
};

}  // namespace porthos::test
