// The machine itself: axioms, matching on plants it was not written for, and everything it must
// refuse.
#include <random>

#include "energy_shaping/matching/plant.h"
#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/check.h"
#include "tests/energy_shaping/loops.h"

namespace porthos::energy_shaping::matching_test {
namespace {

using test::agrees, test::breaks, test::keeps, test::law_at, test::refusal, test::run_loop,
    test::Vec;

std::vector<std::pair<std::string, LoopPtr>> all_designs() {
  return {{"inertia wheel", inertia_wheel_pendulum({})},
          {"ball and beam", ball_and_beam({})},
          {"cart-pole", cart_pole({})},
          {"acrobot", acrobot({})},
          {"VTOL", vtol({})}};
}

TEST(Matching, EveryDesignIsAPortHamiltonianSystem) {
  for (const auto& [name, loop] : all_designs()) {
    const auto report = phs::check(*loop, {.samples = 32, .spread = 0.4, .tolerance = 1e-9});
    EXPECT_TRUE(report.holds()) << name << "\n" << report.text();
    EXPECT_TRUE(loop->certificate().holds()) << loop->certificate().text();
    for (const char* item : {"matching, kinetic energy", "matching, potential energy"})
      keeps(name + ", " + item, loop->certificate().item(item).value, 1e-10);
  }
}

/// The greatest difference between the plant under the law and the target dynamics, relative.
double law_against_target(const MatchedLoop& loop, const Vec& spread, unsigned seed = 1) {
  const auto target = loop.loop<double>();
  const auto plant = loop.plant().instantiate<double>();
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  double worst = 0;
  const size_t nx = size_t(loop.description().nx);
  Vec x(nx), u(size_t(loop.plant().description().nu)), a(nx), b(nx);
  for (int i = 0; i < 200; ++i) {
    for (size_t k = 0; k < nx; ++k) x[k] = spread[k] * normal(generator);
    target->law(0.0, x, u);
    plant->field(0.0, x, u, a);
    target->field(0.0, x, {}, b);
    double size = 0, difference = 0;
    for (size_t k = 0; k < nx; ++k) {
      size = std::max({size, std::fabs(a[k]), std::fabs(b[k])});
      difference = std::max(difference, std::fabs(a[k] - b[k]));
    }
    worst = std::max(worst, difference / size);
  }
  return worst;
}

TEST(Matching, PlantUnderTheLawMovesAsTheTarget) {
  for (const auto& [name, loop] : all_designs()) {
    Vec spread(size_t(loop->description().nx), 0.4);
    keeps(name + ", plant under the law against the target", law_against_target(*loop, spread),
          1e-10);
  }
}

/// An acrobot out of bodies: links of uniform inertia, hanging up, coordinates from upright.
mechanics::MechanicalModel acrobot_of_bodies(double damping = 0) {
  mechanics::MechanismBuilder b("two links");
  b.gravity({0, 0, -9.8});
  const auto link = [&](const char* name, const char* parent, double m, double I, double lc,
                        double at, const char* joint) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = joint;
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.joint.damping = damping;
    s.placement.r = {0, 0, at};
    s.mass.mass = m;
    s.mass.com = {0, 0, lc};
    s.mass.inertia = {I, 0, 0, I, 0, I};
    b.add(s);
  };
  link("upper", "world", 4, 0.3333, 0.5, 0, "shoulder");
  link("lower", "upper", 1, 1.3333, 2, 1, "elbow");
  return mechanics::MechanicalModel(std::make_shared<mechanics::Mechanism>(b.build()));
}

TEST(Matching, AMechanismOfBodies) {
  const auto model = std::make_shared<mechanics::MechanicalModel>(acrobot_of_bodies());
  Acrobot d = Acrobot::of(*model, 9.8);
  const Acrobot published;
  agrees("c1", d.c1, published.c1, 1e-12);
  agrees("c2", d.c2, published.c2, 1e-12);
  agrees("c3", d.c3, published.c3, 1e-12);
  agrees("c4", d.c4, published.c4, 1e-12);
  agrees("c5", d.c5, published.c5, 1e-12);
  d.ku = 200;
  d.kv = 2;
  const auto loop = acrobot(d, model, {}, "elbow.torque");
  keeps("bodies: kinetic residual", loop->certificate().item("matching, kinetic energy").value,
        1e-10);
  keeps("bodies: plant under the law against the target",
        law_against_target(*loop, {0.5, 0.5, 2, 2}), 1e-10);
  // The same loop from formulas.
  const Vec x{0.3, -0.4, 1, 2};
  agrees("law from bodies and from formulas", law_at(*loop, x)[0],
         law_at(*acrobot(d, acrobot_plant(d)), x)[0], 1e-11);
  // Another mechanism: the law does not match it, and the constructor says so.
  Acrobot wrong = d;
  wrong.c3 *= 1.001;
  const auto why = refusal([&] { (void)acrobot(wrong, model, {}, "elbow.torque"); });
  EXPECT_NE(why.find("matching, potential energy fails"), std::string::npos) << why;
}

// Friction in the plant stays: the target has it as D M⁻¹M_d, and H_d falls by what the ledger
// says.
TEST(Matching, FrictionOfThePlant) {
  const auto model = std::make_shared<mechanics::MechanicalModel>(acrobot_of_bodies(0.05));
  Acrobot d = Acrobot::of(*model, 9.8);
  d.ku = 200;
  d.kv = 2;
  // An unactuated joint with friction: sym(D M⁻¹M_d) is indefinite here, which must be found and
  // refused.
  const auto why = refusal([&] { (void)acrobot(d, model, {}, "elbow.torque"); });
  EXPECT_NE(why.find("damping >= 0 fails"), std::string::npos) << why;
  std::printf("  %s\n", why.c_str());
  // Made all the same, it is still a system whose plant moves as its target does.
  const auto loop = acrobot(
      d, model, MatchingOptions{.region = {{-1, -1}, {1, 1}, 2}, .refuse = false}, "elbow.torque");
  EXPECT_FALSE(loop->certificate().holds());
  keeps("with friction: plant under the law against the target",
        law_against_target(*loop, {0.5, 0.5, 2, 2}), 1e-10);
}

struct Bare {  // what a user writes: H_d of an inertia wheel with gains of his own
  static constexpr int n = 2;
  std::string name = "my wheel";
  double a2 = -1.5, sign = 1;
  std::vector<Gain> gains() const { return {{"kv", 10}}; }
  template <class S, class T>
  void mass(std::span<const S>, std::span<const T>, std::span<S> Md) const {
    Md[0] = S(1.0);
    Md[1] = Md[2] = S(a2);
    Md[3] = S(6.0);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T>) const {
    const S z = q[1] + S(4.5) * q[0];
    return S(-2.0 * sign) * phs::cos(q[0]) + S(0.05) * z * z;
  }
};

std::string refusal_of(Bare b, Region region = {{-3, -3}, {3, 3}},
                       const char* port = "wheel.force") {
  return refusal([&] {
    MatchedLoop(inertia_wheel_plant({}), shaping(b), {port}, {0, 0}, {.region = region});
  });
}

TEST(Certificate, PrintsNanWithoutItsSign) {
  Certificate c("made up");
  const double nan = std::copysign(NAN, -1.0);
  c.at_most("matching, kinetic energy", nan, 1, "made up", {nan});
  c.report("figure", nan, "made up", {nan, -2});
  for (const std::string& told : {c.text(), c.html(), refusal([&] { refuse_failure(c); })}) {
    EXPECT_NE(told.find("nan"), told.npos) << told;
    EXPECT_EQ(told.find("-nan"), told.npos) << told;
  }
  EXPECT_NE(c.text().find("-2"), std::string::npos) << "control: other numbers keep theirs";
}

TEST(Matching, RefusesWithTheReason) {
  EXPECT_EQ(refusal_of({}), "");
  const std::pair<std::string, std::string> cases[] = {
      {refusal_of({.a2 = -3}), "M_d > 0 fails"},
      {refusal_of({.a2 = -1.6}), "matching, potential energy fails"},
      {refusal_of({.sign = -1}), "matching, potential energy fails"},
      {refusal_of({}, {{-3, -3}, {3, 3}}, "motor.force"), "no port 'motor.force'"},
      {refusal_of({}, {{1, -3}, {3, 3}}), "outside the region"},
      {refusal_of({}, {{-3}, {3}}), "region.lower has 1 entries, expected 2"},
      {refusal([] { (void)inertia_wheel_pendulum({.a2 = -0.5}); }), "a1 + a2 < 0"},
      {refusal([] { (void)inertia_wheel_pendulum({.kv = -1}); }), "Kv >= 0 fails"},
      {refusal([] { (void)inertia_wheel_pendulum({.kv = -NAN}); }),
       "gain 'kv' is nan, expected a finite number"},
      {refusal([] { (void)inertia_wheel_pendulum({.k1 = HUGE_VAL}); }), "gain 'k1' is inf, "},
      {refusal([] { (void)vtol({.k2 = 5}); }), "k1/epsilon > k2"},
      {refusal([] {
         (void)cart_pole({}, nullptr, MatchingOptions{.region = {{-1.7, -1}, {1.7, 1}}});
       }),
       "M_d > 0 fails"},
      {refusal([] {
         MatchedLoop(vtol_plant({}), shaping(Bare{}), {"u1.force"}, {0, 0},
                     {.region = {{-1, -1}, {1, 1}}});
       }),
       "the design is for 2 coordinates"}};
  for (const auto& [got, expected] : cases) {
    std::printf("  %s\n", got.c_str());
    EXPECT_NE(got.find(expected), std::string::npos)
        << "expected: " << expected << "\ngot: " << got;
  }
}

// A heavy first link: the published design does not apply, and says so (numbers of the DFKI
// acrobot, design C.1).
TEST(Matching, AcrobotThatIsNotApplicable) {
  const double m2 = 0.62557, l1 = 0.2, I1 = 0.031887, I2 = 0.050870;
  const auto why = refusal([&] {
    (void)acrobot({.c1 = I1 + m2 * l1 * l1, .c2 = I2, .c3 = 0.032, .c4 = 0.2, .c5 = 0.15});
  });
  std::printf("  %s\n", why.c_str());
  EXPECT_NE(why.find("c2 > c1"), std::string::npos) << why;
}

TEST(Negative, AcrobotWithLowStiffnessIsRefused) {
  for (const double ku : {20.0, 60.0}) {
    const auto why = refusal([&] { (void)acrobot({.ku = ku}); });
    std::printf("  ku = %g: %s\n", ku, why.c_str());
    EXPECT_NE(why.find("Hessian of V_d > 0 fails"), std::string::npos) << why;
  }
}

// The same design as a run that settles, but stiffer: H_d falls all the time, and still the state
// leaves. The rest point is a local minimum of a V_d that is not bounded below.
TEST(Negative, AcrobotLeavesItsBasin) {
  Acrobot d{.ku = 400, .kv = 5};
  d.a3 = 2 / (1 - std::sqrt(d.c1 / d.c2));
  const auto loop = acrobot(d);
  Vec times;
  for (int i = 0; i <= 400; ++i) times.push_back(0.5 * i);
  const auto run = run_loop(*loop, {0.5, 0, 0, 0}, times, 0.01);
  double last = HUGE_VAL;
  for (const auto& [t, s] : run) {
    EXPECT_LE(s.H, last + 1e-9);
    last = s.H;
  }
  const auto& end = run.at(200);
  std::printf("  q(200 s) = (%.3f, %.3f), H_d = %.2f\n", end.x[0], end.x[1], end.H);
  agrees("q1", end.x[0], -5.88, 2e-3);
  agrees("q2", end.x[1], 9.66, 2e-3);
  agrees("H_d", end.H, -139.5, 1e-3);
}

/// Ball and beam with J2 of either sign: only one solves the kinetic equation.
struct BallWithSkew {
  static constexpr int n = 2;
  double sign;
  std::string name = "ball and beam, sign of J2";
  std::vector<Gain> gains() const { return {{"kv", 3}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    using phs::sqrt;
    const S s = S(1.0) + q[0] * q[0], r = sqrt(s);
    Md[0] = S(std::sqrt(2.0)) * r;
    Md[1] = Md[2] = s;
    Md[3] = S(std::sqrt(2.0)) * s * r;
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T>) const {
    using phs::asinh;
    const S z = q[1] - asinh(q[0]) / S(std::sqrt(2.0));
    return S(9.81) * (S(1.0) - phs::cos(q[1])) + S(2.5) * z * z;
  }
  template <class T>
  void skew(std::span<const T> q, std::span<const T> p, std::span<const T>, std::span<T> J2) const {
    using phs::sqrt;
    const T j = T(sign) * q[0] * (p[0] - T(std::sqrt(2.0)) * p[1] / sqrt(T(1.0) + q[0] * q[0]));
    J2[0] = J2[3] = T(0.0);
    J2[1] = j;
    J2[2] = -j;
  }
};

TEST(Negative, SignOfJ2) {
  const auto loop = [](double sign) {
    return MatchedLoop(ball_and_beam_plant({}), shaping(BallWithSkew{.sign = sign}), {"beam.force"},
                       {0, 0}, {.region = {{-1, -1.5}, {1, 1.5}}, .refuse = false});
  };
  keeps("sign +, kinetic residual", loop(1).certificate().item("matching, kinetic energy").value,
        1e-10);
  breaks("sign -, kinetic residual", loop(-1).certificate().item("matching, kinetic energy").value,
         1e-2);
}

/// The cart-pole without a J2 of its own: the machine solves for it.
struct CartPoleWithoutJ2 {
  static constexpr int n = 2;
  static constexpr bool solve_skew = true;
  std::string name = "cart-pole, J2 solved for";
  std::vector<Gain> gains() const { return {{"kv", 3}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    const S c = phs::cos(q[0]);
    Md[0] = S(1.0 / 3) * c * c * c;
    Md[1] = Md[2] = S(-0.5) * c * c;
    Md[3] = c + S(0.1);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T>) const {
    using phs::log;
    const S c = phs::cos(q[0]), s = phs::sin(q[0]);
    const S z = q[1] + S(3.0) * log((S(1.0) + s) / c) + S(0.6) * s / c;
    return S(30.0) / (c * c) + S(0.5) * z * z;
  }
};

struct Spoilt : CartPoleWithoutJ2 {
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    const S c = phs::cos(q[0]);
    Md[0] = S(0.34) * c * c * c;
    Md[1] = Md[2] = S(-0.5) * c * c;
    Md[3] = c + S(0.1);
  }
};

TEST(Matching, J2CanBeSolvedFor) {
  const MatchedLoop solved(cart_pole_plant({}), shaping(CartPoleWithoutJ2{}), {"cart.force"},
                           {0, 0}, {.region = {{-1.4, -10}, {1.4, 10}, 3}});
  const auto given = cart_pole({});
  keeps("kinetic residual", solved.certificate().item("matching, kinetic energy").value, 1e-10);
  for (const Vec& x : {Vec{0.5, 0, 0, 0}, Vec{-0.3, 1, 0.4, -2}, Vec{1.2, 3, -1, 5}})
    agrees("law with J2 solved and given", law_at(solved, x)[0], law_at(*given, x)[0], 1e-12);
  // One coefficient of M_d off: no J2 solves it any more.
  const MatchedLoop spoilt(cart_pole_plant({}), shaping(Spoilt{}), {"cart.force"}, {0, 0},
                           {.region = {{-1.2, -10}, {1.2, 10}, 3}, .refuse = false});
  breaks("spoilt M_d, kinetic residual",
         spoilt.certificate().item("matching, kinetic energy").value, 1e-4);
}

// With a discrete gradient H_d never rises by more than rounding, step for step; Runge-Kutta at
// that step does worse.
TEST(Monotone, DiscreteGradientSteps) {
  struct Case {
    std::string name;
    LoopPtr loop;
    Vec x0;
  };
  const Case cases[] = {{"inertia wheel", inertia_wheel_pendulum({}), {3.14, 0, 0, 0}},
                        {"ball and beam", ball_and_beam({}), {0.5, 0.3, 0, 0}},
                        {"cart-pole", cart_pole({}), {0.5, 0, 0, 0}},
                        {"acrobot", acrobot({}), {0.1, 0, 0, 0}},
                        {"VTOL", vtol({}), {1, 1, 0.3, 0, 0, 0}}};
  for (const auto& c : cases) {
    const auto integrator = integrators::make_integrator("gonzalez", *c.loop, 0.01);
    const auto system = c.loop->instantiate<long double>();
    phs::State s(c.loop->description(), c.x0);
    const auto energy = [&] {
      std::vector<long double> x(s.x.begin(), s.x.end());
      for (size_t i = 0; i < x.size(); ++i) x[i] += s.lo[i];
      return system->hamiltonian(x);
    };
    long double H = energy(), scale = std::fabs(H), worst = 0;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_EQ(integrator->step(s), integrators::Outcome::ok) << c.name << " step " << i;
      const long double next = energy();
      worst = std::max(worst, next - H);
      scale = std::max(scale, std::fabs(next));
      H = next;
    }
    keeps(c.name + ", greatest rise of H_d in a step, relative", double(worst / scale), 1e-14);
  }
}

TEST(Monotone,
     ControlOfTheMethod) {  // no damping: H_d is to stay; a method that is not exact lets it rise
  const auto loop = acrobot({.kv = 0});
  const auto rise = [&](const char* method) {
    const auto integrator = integrators::make_integrator(method, *loop, 0.01);
    const auto system = loop->instantiate<double>();
    phs::State s(loop->description(), {0.1, 0, 0, 0});
    double H = system->hamiltonian(s.x), first = H, worst = 0;
    for (int i = 0; i < 500; ++i) {
      if (integrator->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
      const double next = system->hamiltonian(s.x);
      worst = std::max(worst, next - H);
      H = next;
    }
    return worst / std::fabs(first);
  };
  keeps("kv = 0, gonzalez, greatest rise of H_d in a step", rise("gonzalez"), 1e-14);
  breaks("kv = 0, rk4", rise("rk4"), 1e-12);
}

TEST(Lanes, SameBitsAsOneState) {
  for (const auto& [name, loop] : all_designs()) {
    const size_t nx = size_t(loop->description().nx);
    const auto one = loop->instantiate<double>();
    const auto eight = loop->instantiate<phs::Pack8>();
    std::mt19937_64 generator(3);
    std::normal_distribution<double> normal(0, 0.3);
    std::vector<phs::Pack8> x(nx), dx(nx);
    Vec y(nx), dy(nx);
    for (auto& v : x)
      for (int l = 0; l < 8; ++l) v.set(l, normal(generator));
    eight->field(0.0, x, {}, dx);
    for (int l = 0; l < 8; ++l) {
      for (size_t i = 0; i < nx; ++i) y[i] = x[i][l];
      one->field(0.0, y, {}, dy);
      for (size_t i = 0; i < nx; ++i) EXPECT_EQ(dx[i][l], dy[i]) << name << " lane " << l;
    }
  }
}

}  // namespace
}  // namespace porthos::energy_shaping::matching_test
