// Every kind of drive: axioms, the ledger, limits, and what is refused.
#include <set>
#include <string>

#include "integrators/core/integrator.h"
#include "phs/system/check.h"
#include "tests/support/bounds.h"
#include "tests/support/robots.h"
#include "tests/vsa/actuators.h"

namespace porthos::test::drives_test {
namespace {

using Kind = vsa::Drive::Kind;

vsa::Drive drive(Kind kind) {
  vsa::Drive d{.kind = kind};
  if (kind == Kind::torque || kind == Kind::position) {
    d.inertia = 2e-5;
    d.gear = 50;
    d.viscous = 1e-5;
    d.torque_limit = 4;
    d.rate_limit = 6;
    d.friction = phs::viscous(0.01);
  }
  if (kind == Kind::position) {
    d.kp = 20;
    d.kd = 1;
  }
  if (kind == Kind::servo) d.p = {14000, 1150, 38};
  if (kind == Kind::rate) d.rate_limit = 3;
  if (kind != Kind::fixed) d.command = phs::sine(0.2, 0.5);
  return d;
}

TEST(Drives, EveryPairIsPortHamiltonianAndKeepsItsBooks) {
  const std::pair<Kind, const char*> kinds[] = {{Kind::fixed, "fixed"},
                                                {Kind::torque, "torque"},
                                                {Kind::position, "position"},
                                                {Kind::rate, "rate"},
                                                {Kind::servo, "servo"}};
  for (const auto& [theta, theta_name] : kinds)
    for (const auto& [sigma, sigma_name] : kinds) {
      vsa::Actuator a;
      a.elastic = vsa::elastic_of(vsa::device("qbmove_advanced"));
      a.theta = drive(theta);
      a.sigma = drive(sigma);
      if (theta == Kind::torque) a.damping = 0.05;
      const auto bare = phs::check(*vsa::actuator_model(a), {.samples = 8, .spread = 0.3});
      EXPECT_TRUE(bare.holds()) << theta_name << ", " << sigma_name << "\n" << bare.text();
      phs::Network n("joint");
      n.add("mechanism", pendulum(0.5, 2)).main("mechanism");
      vsa::attach(n, "vsa", "mechanism.hinge.torque", a);
      const auto model = n.build();
      const auto whole = phs::check(*model, {.samples = 8, .spread = 0.3});
      EXPECT_TRUE(whole.holds()) << theta_name << ", " << sigma_name << "\n" << whole.text();
      const auto start =
          state_of(*model, {0.3, 0}, {{"vsa", vsa::actuator_start("vsa", a, 0.3, 0.1, 0.2)}});
      const auto method = integrators::make_integrator("gauss16", *model, 0.005);
      Gauge gauge(*model);
      phs::State s = start;
      long double in = 0, turned = 0;
      for (int i = 0; i < 400; ++i) {
        ASSERT_EQ(method->step(s), integrators::Outcome::ok) << theta_name << ", " << sigma_name;
        for (size_t k = 0; k < method->port_work().size(); ++k) {
          const double w = method->port_work()[k];
          in += model->description().powers[k].kind == phs::PowerKind::supplied ? w : -w;
          turned += std::fabs(w);
        }
      }
      const double defect =
          double(std::fabs(gauge.energy(s) - gauge.energy(start) - in) / (turned + 1));
      keeps(std::string("theta by ") + theta_name + ", sigma by " + sigma_name + ": defect", defect,
            1e-13);
    }
}

/// docs/actuators.md lists the rows of the ledger for each drive. Controls: without viscous,
/// coulomb, a rate limit or a command these rows are not there.
TEST(Drives, RowsOfTheLedgerAreThoseOfThePage) {
  const auto rows = [](vsa::Drive theta, bool dampers) {
    vsa::Actuator a;
    a.elastic = vsa::elastic_of(vsa::device("qbmove_advanced"));
    a.theta = std::move(theta);
    a.sigma = drive(Kind::torque);
    if (dampers) a.damping = 0.05;
    if (dampers) a.damper = phs::sine(0.2, 0.5);
    phs::Network n("joint");
    n.add("m", pendulum(0.5, 2)).main("m");
    vsa::attach(n, "a", "m.hinge.torque", a);
    const auto model = n.build();
    const auto& d = model->description();
    std::set<std::string> all;
    for (const auto& name : d.storages)
      if (name.starts_with("a.")) all.insert("stored " + name.substr(2));
    for (const auto& p : d.powers)
      all.insert((p.kind == phs::PowerKind::supplied ? "supplied " : "dissipated ") +
                 p.name.substr(2));
    for (const char* of_sigma :
         {"stored spring", "stored sigma_rotor", "supplied sigma.torque",
          "dissipated sigma.viscous", "dissipated sigma.friction", "dissipated sigma.brake"})
      EXPECT_EQ(all.erase(of_sigma), 1u) << of_sigma;
    return all;
  };
  using Rows = std::set<std::string>;
  const Rows losses{"stored rotor", "dissipated theta.viscous", "dissipated theta.friction",
                    "dissipated theta.brake"};
  const auto with = [&](Rows more) {
    more.insert(losses.begin(), losses.end());
    return more;
  };
  EXPECT_EQ(rows(drive(Kind::fixed), false), Rows{});
  EXPECT_EQ(rows(drive(Kind::torque), true),
            with({"supplied theta.torque", "dissipated damping", "supplied damper"}));
  EXPECT_EQ(rows(drive(Kind::position), false), with({"supplied theta.controller"}));
  EXPECT_EQ(rows(drive(Kind::rate), false), Rows{"supplied theta.rate"});
  EXPECT_EQ(rows(drive(Kind::servo), false), Rows{"supplied theta.servo"});
  EXPECT_EQ(rows({.kind = Kind::torque, .inertia = 1}, false), Rows{"stored rotor"});
}

TEST(Drives, TorquesAndRatesStayWithinTheirLimits) {
  vsa::Actuator a;
  a.elastic = vsa::series_elastic({0.0});  // nothing pulls back
  a.theta = {.kind = Kind::torque,
             .inertia = 0.01,
             .torque_limit = 4,
             .rate_limit = 6,
             .command = phs::constant(100)};
  phs::Network n("joint");
  n.add("mechanism", pendulum(0.5, 0)).main("mechanism");
  vsa::attach(n, "vsa", "mechanism.hinge.torque", a);
  const auto model = n.build();
  const auto f = model->instantiate<double>();
  auto x = state_of(*model, {0, 0}, {}).x;
  std::vector<double> dx(x.size());
  const size_t p = size_t(model->offset("vsa")) + 2;
  f->field(0, x, {}, dx);
  EXPECT_NEAR(dx[p], 4, 1e-12) << "100 N m are asked for";
  x[p] = 0.01 * 6;
  f->field(0, x, {}, dx);
  EXPECT_NEAR(dx[p], 4, 1e-12) << "at the rate limit the brake begins";
  x[p] = 0.01 * 6.3;
  f->field(0, x, {}, dx);
  EXPECT_NEAR(dx[p], 0, 1e-9) << "5 % above, it holds the full torque";
}

TEST(Drives, ADamperOnlyTakes) {
  vsa::Actuator a;
  a.elastic = vsa::elastic_of(vsa::device("maccepa_vd"));
  a.damper = phs::sine(1.0, 0.5);
  a.damper_limit = 0.107;  // asked for more than there is, and for less than nothing
  phs::Network n("joint");
  n.add("mechanism", pendulum(0.5, 0)).main("mechanism");
  vsa::attach(n, "vsa", "mechanism.hinge.torque", a);
  const auto model = n.build();
  const auto f = model->instantiate<double>();
  auto x = state_of(*model, {0, 1.0}, {{"vsa", vsa::actuator_start("vsa", a, 0, 0, 1)}}).x;
  std::vector<double> dx(x.size());
  for (const auto& [t, torque] : {std::pair{0.5, -0.107 * 2}, {1.5, 0.0}}) {
    f->field(t, x, {}, dx);
    EXPECT_NEAR(dx[1], torque, 1e-12) << t;
  }
}

TEST(Drives, WrongOnesAreRefused) {
  const auto qbmove = vsa::elastic_of(vsa::device("qbmove_advanced"));
  const std::pair<vsa::Actuator, const char*> bad[] = {
      {{}, "actuator: has no elastic energy"},
      {{.elastic = qbmove, .theta = {.kind = Kind::torque}},
       "actuator: theta inertia is 0, expected more than 0 kg m^2: a torque on no inertia has no "
       "rate"},
      {{.elastic = qbmove, .sigma = {.kind = Kind::torque, .inertia = -1}},
       "actuator: sigma inertia is -1"},
      {{.elastic = qbmove, .theta = {.kind = Kind::rate, .inertia = 1}},
       "only a drive by torque or position has a rotor"},
      {{.elastic = qbmove,
        .theta = {.kind = Kind::servo, .command = phs::constant(0), .p = {14000, 100, 38}}},
       "expected p1 less than p2 p3"},
      {{.elastic = qbmove, .theta = {.kind = Kind::servo, .p = {1, 2, 3}}},
       "theta has no command, expected a position"},
      {{.elastic = qbmove, .theta = {.kind = Kind::torque, .inertia = 1, .rate_limit = 3}},
       "as a rate limit is given"},
      {{.elastic = qbmove, .theta = {.kind = Kind::rate}, .damping = 1},
       "damping between link and rotor is given, but theta has no rotor"},
      {{.elastic = vsa::series_elastic({10}), .sigma = {.kind = Kind::rate}},
       "sigma has a drive, but the energy of 'series_elastic' does not depend on sigma"}};
  for (const auto& [a, says] : bad) {
    const std::string why = refusal([&, actuator = a] { vsa::actuator_model(actuator); });
    EXPECT_NE(why.find(says), std::string::npos) << why << "\n  instead of: " << says;
  }
}

}  // namespace
}  // namespace porthos::test::drives_test
