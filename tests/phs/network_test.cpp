// Compositions are port-Hamiltonian again: axioms, Casimirs and the ledger by number, against
// systems written by hand.
#include "phs/network/network.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "integrators/core/integrator.h"
#include "phs/functions/of_time.h"
#include "phs/system/check.h"
#include "phs/system/user_model.h"
#include "tests/support/random_phs.h"

namespace porthos::test::network_test {
namespace {

using phs::function;
using phs::Matrix;
using phs::Network;
using phs::PowerKind;

double worst(const phs::CheckReport& r, const std::string& axiom) {
  for (const auto& a : r.axioms)
    if (a.axiom == axiom) return a.worst;
  ADD_FAILURE() << "no axiom " << axiom;
  return -1;
}

std::string refusal(const std::function<void()>& f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "(not refused)";
}
#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// Two masses at the ends of a damped spring.
Network two_masses() {
  Network n("two masses");
  n.add("a", phs::inertia_element(2, phs::translation));
  n.add("b", phs::inertia_element(3, phs::translation));
  n.add("spring", phs::spring_element(phs::spring(10), phs::translation));
  n.zero_junction("ends", {{"spring.ends"}, {"a.body"}, {"b.body", -1}});
  n.resist("damper", {"a.body", "b.body"}, Matrix{{0.5, -0.5}, {-0.5, 0.5}});
  return n;
}

TEST(Network, TwoMassesOnASpringByHand) {
  const auto model = two_masses().build();
  EXPECT_TRUE(phs::check(*model).holds()) << phs::check(*model).text();
  const auto f = model->instantiate<double>();
  const std::vector<double> x{1.0, 0.6, 0.2};  // p_a, p_b, z
  std::vector<double> dx(3), stored(3), powers(1), e(3);
  f->field(0, x, {}, dx);
  const double va = 0.5, vb = 0.2, force = 10 * 0.2, damping = 0.5 * (va - vb);
  EXPECT_NEAR(dx[0], -force - damping, 1e-15);
  EXPECT_NEAR(dx[1], force + damping, 1e-15);
  EXPECT_NEAR(dx[2], va - vb, 1e-15);
  f->gradient(x, e);
  f->powers(0, x, e, powers);
  f->stored(x, stored);
  EXPECT_NEAR(powers[0], 0.5 * (va - vb) * (va - vb), 1e-16);
  EXPECT_NEAR(stored[0] + stored[1] + stored[2], 0.25 + 0.06 + 0.2, 1e-16);
}

TEST(Network, FindsItsCasimirs) {
  const auto masses = two_masses().build();
  ASSERT_EQ(masses->casimirs().size(), 1u) << "the total momentum, damper or not";
  EXPECT_EQ(masses->casimirs()[0].text, "a.momentum + b.momentum");
  const auto f = masses->instantiate<double>();
  const std::vector<double> x{1.0, 0.6, 0.2};
  double value;
  f->invariants(x, std::span(&value, 1));
  EXPECT_EQ(std::fabs(value), 1.6);
  // Negative control: a force from outside takes it away.
  Network pushed = two_masses();
  pushed.source("push", "a.body", phs::constant(1));
  EXPECT_TRUE(pushed.build()->casimirs().empty());
}

TEST(Network, FiftyRandomSystemsComposedArePortHamiltonian) {
  constexpr int members = 50;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  Network n("fifty");
  std::vector<std::string> ports;
  for (int i = 0; i < members; ++i) {
    const std::string name = "s" + std::to_string(i);
    n.add(name, std::make_shared<phs::UserModel<RandomSystem>>(
                    RandomSystem(unsigned(i), 2 + i % 4, 1 + i % 3)));
    for (int k = 0; k < 1 + i % 3; ++k) ports.push_back(name + ".port_" + std::to_string(k));
  }
  Matrix K(int(ports.size()), int(ports.size()));
  for (int i = 0; i < K.rows; ++i)
    for (int j = 0; j < i; ++j) {
      K(i, j) = normal(generator);
      K(j, i) = -K(i, j);
    }
  n.couple(ports, K);
  n.resist(
      "friction", "s3.port_0",
      phs::friction(
          {.coulomb = 1, .breakaway = 1.5, .stribeck = 0.1, .viscous = 0.2, .smoothing = 1e-2}));
  n.resist("damper", {"s4.port_0", "s5.port_1"}, Matrix{{2, 1}, {-1, 3}});
  const auto model = n.build();
  const auto r = phs::check(*model, {.samples = 4});
  EXPECT_TRUE(r.holds()) << r.text();
  const double skew = worst(r, "J skew"), balance = worst(r, "power balance"),
               R = worst(r, "R >= 0");
  std::printf(
      "  %d systems, %d states: J skew to %.1e, R >= 0 to %.1e, balance defect %.1e (1e-13)\n",
      members, model->description().nx, skew, R, balance);
  EXPECT_LE(skew, 1e-14);
  EXPECT_LE(R, 1e-14);
  EXPECT_LE(balance, 1e-13);
}

// Negative control: one entry of K put in the wrong way round is found, by the builder and, past
// it, by the ledger.
TEST(Network, ACouplingThatMakesPowerIsRefused) {
  Network n = two_masses();
  n.add("c", phs::inertia_element(1, phs::translation))
      .add("d", phs::inertia_element(1, phs::translation));
  EXPECT_SAYS(refusal([&] {
                n.couple({"c.body", "d.body"}, Matrix{{0, 1}, {1, 0}});
              }),
              "K(1, 0) = 1 and K(0, 1) = 1, expected a skew matrix");
  EXPECT_SAYS(refusal([&] { n.resist("x", {"c.body"}, Matrix{{-1}}); }), "eigenvalue -1");
  EXPECT_SAYS(refusal([&] { n.resist("x", "c.body", function([](auto v) { return -v; })); }),
              "expected the same sign");
  EXPECT_SAYS(refusal([&] { phs::viscous(-1); }), "damping is -1");
}

// A step asks for the same few times at every sweep. Where a source is kept it has the same bits,
// whatever the order of times, and another lane's time is another time.
TEST(Network, SourcesAreAskedOncePerTime) {
  const auto calls = std::make_shared<int>(0);
  Network n("driven mass");
  n.add("mass", phs::inertia_element(2, phs::translation));
  n.source("push", "mass.body", phs::of_time_alone(function([calls](auto t) {
             ++*calls;
             return t * t;
           })));
  const auto model = n.build();
  const auto push = [&]<class T>(phs::System<T>& f, T t) {
    std::vector<T> x{T(0.3)}, dx(1);
    f.field(t, x, {}, dx);
    return dx[0];
  };
  const auto one = model->instantiate<double>();
  for (int sweep = 0; sweep < 5; ++sweep)
    for (int stage = 0; stage < 8; ++stage) {
      const double t = 1 + 0.1 * stage;
      EXPECT_EQ(push(*one, t), t * t);
    }
  EXPECT_EQ(*calls, 8);
  for (int k = 0; k < 100; ++k)
    EXPECT_EQ(push(*one, 0.25 * (k % 11)), 0.0625 * (k % 11) * (k % 11));
  EXPECT_TRUE(std::isnan(push(*one, std::nan(""))));
  EXPECT_TRUE(std::isnan(push(*one, std::nan(""))));
  EXPECT_EQ(push(*one, 2.0), 4);

  const auto lanes = model->instantiate<phs::Pack4>();
  phs::Pack4 t(3.0), later = t;
  later.set(2, 5.0);
  EXPECT_EQ(push(*lanes, t)[2], 9);
  EXPECT_EQ(push(*lanes, later)[2], 25);
  EXPECT_EQ(push(*lanes, later)[1], 9);
  const auto dual = model->instantiate<phs::Dual>();
  EXPECT_EQ(push(*dual, phs::Dual(3.0, 0.0)).d, 0);
  EXPECT_EQ(push(*dual, phs::Dual(3.0, 1.0)).d, 6) << "the same value, another derivative";
}

// The control: what may change between two questions for one time is asked each time.
TEST(Network, ASourceThatIsSetIsAskedEachTime) {
  phs::Held held;
  double setpoint = 1;
  Network n("driven mass");
  n.add("mass", phs::inertia_element(2, phs::translation));
  n.source("held", "mass.body", held.signal());
  n.source("user's", "mass.body", function([&](auto t) { return decltype(t)(setpoint); }));
  n.source("steady", "mass.body", phs::constant(100));
  const auto f = n.build()->instantiate<double>();
  const std::vector<double> x{0.3};
  std::vector<double> dx(1);
  for (const double value : {1.0, 2.0, 3.0}) {
    held.set(value);
    setpoint = 10 * value;
    f->field(0.5, x, {}, dx);
    EXPECT_EQ(dx[0], 100 + 11 * value);
  }
}

TEST(Network, TransformersGyratorsAndJunctionsMakeNoPower) {
  // A motor with its rotor drives, through a gear and an elastic shaft, two loads that turn
  // together with one spring each.
  Network n("drive train");
  n.add("motor", phs::dc_motor({.inductance = 1e-3,
                                .resistance = 0.5,
                                .constant = 0.05,
                                .gear = 1,
                                .rotor_inertia = 1e-4,
                                .friction = 1e-4}));
  n.add("shaft", phs::spring_element(phs::spring(100)));
  n.add("load", phs::inertia_element(0.02));
  n.add("clutch", phs::spring_element(phs::spring(5, 0, 2)));
  n.transformer("motor.shaft", "shaft.ends", 0.1);
  n.feedback("load.body", "clutch.ends");
  n.source("battery", "motor.supply", phs::constant(12));
  const auto open = n.build();
  const auto r = phs::check(*open);
  EXPECT_TRUE(r.holds()) << r.text();
  EXPECT_EQ(open->description().ports.size(), 1u) << "the supply stays open beside its battery";

  Network wheel("wheels");
  wheel.add("left", phs::inertia_element(1)).add("right", phs::inertia_element(2));
  wheel.gyrator("left.body", "right.body", 3);
  const auto wheels = wheel.build();
  const auto f = wheels->instantiate<double>();
  const std::vector<double> p{1, 1};
  std::vector<double> dp(2);
  f->field(0, p, {}, dp);
  EXPECT_DOUBLE_EQ(dp[1], 3 * 1.0);
  EXPECT_DOUBLE_EQ(dp[0], -3 * 0.5);
  EXPECT_DOUBLE_EQ(dp[0] * 1 + dp[1] * 0.5, 0) << "no power";
}

// y = p + F u on both sides of a coupling: the loop is solved, and its ledger closes.
/// A unit mass in the plane, a port along each axis.
struct Particle {
  static phs::Description description() {
    phs::Description d;
    d.name = "particle";
    d.nx = 4;
    d.nu = 2;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
    d.ports = {{"x", phs::PortKind::effort_in, 1, 0, "N", "m/s"},
               {"y", phs::PortKind::effort_in, 1, 1, "N", "m/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[0] * x[0] + T(2.0) * x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = Gu[1] = T(0.0);
    Gu[2] = u[0];
    Gu[3] = u[1];
  }
};

// What couples a member to itself changes its J: a magnetic field is no canonical system, and
// splittings refuse it.
TEST(Network, ASelfCouplingEndsTheClaimsOfItsMember) {
  const auto particle = std::make_shared<phs::UserModel<Particle>>(Particle{});
  const auto traits = [&](const std::function<void(Network&)>& join) {
    Network n("magnet");
    n.add("p", particle);
    join(n);
    const auto model = n.build();
    EXPECT_TRUE(phs::check(*model).holds()) << phs::check(*model).text();
    return model->description().traits;
  };
  const auto alone = traits([](Network&) {});
  EXPECT_TRUE(alone.canonical && alone.separable) << "the control: nothing is joined";
  const auto magnet = traits([](Network& n) { n.gyrator("p.x", "p.y", 1.5); });
  EXPECT_FALSE(magnet.canonical || magnet.separable);
  EXPECT_TRUE(magnet.lossless);
  const auto damped = traits([](Network& n) {
    n.resist("damper", {"p.x", "p.y"}, Matrix{{1, 0.2}, {0.2, 1}});
  });
  EXPECT_TRUE(damped.canonical && damped.separable) << "J and H are the member's";
  EXPECT_FALSE(damped.lossless);
  const auto lopsided = traits([](Network& n) {
    n.resist("damper", {"p.x", "p.y"}, Matrix{{1, 0.3}, {-0.3, 1}});
  });
  EXPECT_FALSE(lopsided.canonical || lopsided.separable) << "half of it is a gyrator";

  Network n("magnet");
  n.add("p", particle).gyrator("p.x", "p.y", 1.5);
  const auto model = n.build();
  for (const char* name : {"stormer_verlet", "kahan_li8_sv", "strang", "lobatto4", "tao2"}) {
    const auto text = refusal([&] { integrators::make_integrator(name, *model, 0.1); });
    if (integrators::declaration_of(name).needs.canonical ||
        integrators::declaration_of(name).needs.flows)
      EXPECT_SAYS(text, "needs a ");
    else
      EXPECT_EQ(text, "(not refused)") << name;
  }
}

TEST(Network, FeedthroughIsSolvedAndBooked) {
  Network n("loop");
  n.add("a", phs::inertia_element(1)).add("b", phs::spring_element(phs::spring(4)));
  n.feedback("a.body", "b.ends");
  n.feedthrough("a", Matrix{{0.5}}).feedthrough("b", Matrix{{0.25}});
  const auto model = n.build();
  const auto r = phs::check(*model);
  EXPECT_TRUE(r.holds()) << r.text();
  const auto f = model->instantiate<double>();
  const std::vector<double> x{1, 1};
  std::vector<double> dx(2);
  f->field(0, x, {}, dx);
  // u_a = -(4 z + u_b/4), u_b = p + u_a/2
  const double u_a = -(4 + 0.25) / (1 + 0.125), u_b = 1 + 0.5 * u_a;
  EXPECT_NEAR(dx[0], u_a, 1e-15);
  EXPECT_NEAR(dx[1], u_b, 1e-15);

  Network singular("singular");
  singular.add("a", phs::inertia_element(1)).add("b", phs::spring_element(phs::spring(4)));
  singular.couple({"a.body", "b.ends"}, Matrix{{0, -1}, {1, 0}});
  singular.feedthrough("a", Matrix{{0}});
  EXPECT_NO_THROW(singular.build());
  EXPECT_SAYS(refusal([&] { singular.feedthrough("b", Matrix{{-1}}); }), "eigenvalue -1");
}

TEST(Network, WrongJoinsAreRefusedByName) {
  const auto base = [] {
    Network n("net");
    n.add("a", phs::inertia_element(1)).add("b", phs::inertia_element(1));
    n.add("s", phs::spring_element(phs::spring(1)));
    n.add("mass", phs::inertia_element(1, phs::translation));
    n.add("pair", std::make_shared<phs::UserModel<RandomSystem>>(RandomSystem(1, 2, 2)));
    return n;
  };
  Network n = base();
  EXPECT_SAYS(refusal([&] { n.feedback("a.body", "b.body"); }),
              "'a.body' and 'b.body' of one flow, but the storages of 'a' and 'b' both set theirs");
  EXPECT_SAYS(refusal([&] {
                n.one_junction("j", {{"a.body"}, {"b.body"}, {"s.ends"}});
              }),
              "1-junction 'j' makes 'a.body' and 'b.body' of one flow");
  EXPECT_SAYS(refusal([&] { n.one_junction("j", {{"s.ends"}}); }), "none that is effort in");
  EXPECT_SAYS(refusal([&] { n.feedback("mass.body", "s.ends"); }),
              "port 'mass.body' takes N and gives m/s, port 's.ends' takes rad/s and gives N m");
  EXPECT_SAYS(refusal([&] { n.feedback("a.bdy", "s.ends"); }),
              "unknown port 'a.bdy', expected one of a.body");
  EXPECT_SAYS(refusal([&] { n.feedback("c.body", "s.ends"); }),
              "with a member of a, b, s, mass, pair");
  EXPECT_SAYS(refusal([&] { n.add("a", phs::inertia_element(1)); }), "two elements are named 'a'");
  EXPECT_SAYS(refusal([&] { n.resist("d", "a.body", phs::viscous(1), 1); }), "has no component 1");
  EXPECT_SAYS(refusal([&] { n.build(); }), "port 's.ends' is not joined to anything");
  n.feedback("a.body", "s.ends");
  EXPECT_SAYS(refusal([&] { n.feedback("a.body", "pair.port_1"); }),
              "port 'a.body' is joined by the feedback of 'a.body' and 's.ends' already");
  EXPECT_SAYS(refusal([&] { n.potential("u", "a.momentum", phs::spring(1)); }),
              "unknown coordinate 'a.momentum'");
  EXPECT_NO_THROW(n.build());
  EXPECT_SAYS(refusal([&] { n.couple({"b.body"}, Matrix(2, 2)); }), "2 x 2, expected 1 x 1");
}

TEST(Elements, SlopesAreDerivativesAndForcesHaveTheSignOfRates) {
  const std::vector<phs::Potential> potentials{
      phs::spring(3, 0.2, 5), phs::soft_limits(-0.5, 0.7, 100),
      phs::tabulated_spring({-1, -0.2, 0.1, 0.8, 2}, {-3, -0.1, 0.2, 1.5, 9})};
  for (const auto& U : potentials)
    for (double z = -2.5; z < 3; z += 0.0501) {
      const double by_duals = (*U.energy)(phs::Dual(z, 1)).d;
      EXPECT_NEAR((*U.slope)(z), by_duals, 1e-12 * (1 + std::fabs(by_duals))) << z;
      const phs::Pack4 lanes(z);
      EXPECT_EQ((*U.slope)(lanes)[2], (*U.slope)(z)) << "lanes give the bits of one";
    }
  // C²: the slope of the slope does not jump at limits and at points of the table.
  for (const auto& U : potentials)
    for (const double z : {-1.0, -0.5, -0.2, 0.1, 0.7, 0.8, 2.0}) {
      const double before = (*U.slope)(phs::Dual(z - 1e-9, 1)).d,
                   after = (*U.slope)(phs::Dual(z + 1e-9, 1)).d;
      EXPECT_NEAR(before, after, 1e-5) << z;
    }
  const auto law = phs::friction(
      {.coulomb = 1, .breakaway = 1.5, .stribeck = 0.1, .viscous = 0.2, .smoothing = 1e-3});
  double most = 0;
  for (double v = -1; v <= 1; v += 1e-3) {
    EXPECT_GE(v * (*law)(v), 0);
    most = std::max(most, std::fabs((*law)(v)) - 0.2 * std::fabs(v));
  }
  EXPECT_NEAR(most, 1.5, 0.02) << "breakaway";
  EXPECT_NEAR((*law)(1.0), 1.2, 1e-12) << "Coulomb and viscous";
  EXPECT_SAYS(refusal([] { phs::friction({.coulomb = 1, .smoothing = -1e-9}); }),
              "smoothing is -1e-09, expected a rate above 0");
  EXPECT_SAYS(refusal([] { phs::soft_limits(1, 0, 1); }), "less than the upper limit");
  EXPECT_SAYS(refusal([] { phs::tabulated_spring({0, 0}, {1, 2}); }), "point 2 stands at 0");
}

}  // namespace
}  // namespace porthos::test::network_test
