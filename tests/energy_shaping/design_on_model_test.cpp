// The designs on mechanisms of rigid bodies: the numbers read off, the motions against the
// reference runs of the formulas, and what is refused.
#include "energy_shaping/matching/design_on_model.h"

#include <complex>
#include <numbers>
#include <random>

#include "energy_shaping/loop/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::design_on_model_test {
namespace {

using test::Vec;
constexpr double pi = std::numbers::pi;

/// A link, its mass at a point and its moment of inertia about all axes there.
mechanics::BodySpec link(const std::string& name, const std::string& parent,
                         const std::string& type, mechanics::Vec3d axis, mechanics::Vec3d at,
                         double mass, mechanics::Vec3d com, double inertia) {
  mechanics::BodySpec s;
  s.name = name;
  s.parent = parent;
  s.joint.name = name + "_joint";
  s.joint.type = type;
  s.joint.axis = axis;
  s.placement.r = at;
  s.mass.mass = mass;
  s.mass.com = com;
  s.mass.inertia = {inertia, 0, 0, inertia, 0, inertia};
  return s;
}
ModelPtr two(double g, const mechanics::BodySpec& first, const mechanics::BodySpec& second) {
  mechanics::MechanismBuilder b("two joints");
  b.gravity({0, 0, -g});
  b.add(first);
  b.add(second);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

/// a = g/l = 10, b = 1/l = 1 for a bob at 1 m under 10 m/s². 0: it hangs. axis: of the hinge
ModelPtr cart_and_pole(double axis, double damping = 0) {
  auto pole = link("pole", "cart", "revolute", {0, axis, 0}, {0, 0, 0}, 0.3, {0, 0, -1}, 0);
  pole.joint.damping = damping;
  return two(10, link("cart", "world", "prismatic", {1, 0, 0}, {0, 0, 0}, 2, {0, 0, 0}, 1), pole);
}
/// The numbers of the acrobot in the facts: 4 kg, 1 m; 1 kg, 4 m. 0: it hangs.
ModelPtr acrobot_of_two_rods(double upper = 1, double lower = 1) {
  return two(9.8,
             link("upper", "world", "revolute", {0, upper, 0}, {0, 0, 0}, 4, {0, 0, -0.5}, 1 / 3.0),
             link("lower", "upper", "revolute", {0, lower, 0}, {0, 0, -1}, 1, {0, 0, -2}, 4 / 3.0));
}
/// I1 = 0.1, I2 = 0.2, m3 = 10; the wheel turns about the pivot, with or against the pendulum.
/// off: its centre of mass from its axis [m]
ModelPtr wheel_pendulum(double axis, double off = 0) {
  return two(10,
             link("pendulum", "world", "revolute", {0, 1, 0}, {0, 0, 0}, 20, {0, 0, 0.05}, 0.05),
             link("wheel", "pendulum", "revolute", {0, axis, 0}, {0, 0, 0}, 3, {off, 0, 0}, 0.2));
}
/// A beam of moment of inertia m L² with L = 1 and a ball of mass m on it.
ModelPtr beam(double offset = 0) {
  return two(9.81, link("beam", "world", "revolute", {0, -1, 0}, {0, 0, 0}, 1, {0, 0, 0}, 1.7),
             link("ball", "beam", "prismatic", {1, 0, 0}, {0, 0, offset}, 1.7, {0, 0, 0}, 0));
}

/// The state after a time under the continuous law, from rest at q.
Vec after(double t, const ModelPtr& model, const DesignOnModel& design, Vec q,
          double step = 0.002) {
  phs::Network n("closed loop");
  n.add("plant", model).main("plant");
  control(n, "law", "plant", {design.port_law()});
  const auto loop = n.build();
  q.resize(4, 0.0);
  phs::State s(loop->description(), q);
  const auto method = integrators::make_integrator("gauss8", *loop, step);
  for (int i = 0; i < int(std::lround(t / step)); ++i)
    if (method->step(s) != integrators::Outcome::ok) ADD_FAILURE();
  Vec x(4);
  for (size_t k = 0; k < 4; ++k) x[k] = s.x[k] + s.lo[k];
  const auto& d = loop->description();
  for (size_t b = 0, angle = 0; b < d.blocks.size(); ++b)  // with their turns
    if (d.blocks[b].kind == phs::BlockKind::angle)
      x[size_t(d.blocks[b].at)] += 2 * pi * double(s.turns[angle++]);
  return x;
}
template <class F>
std::string words_of(F f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}
double difference(const DesignOnModel& d) {
  const double value = d.certificate().item("moves as the design's plant").value;
  std::printf("  model against design: %.2g\n", value);
  return value;
}

}  // namespace

TEST(DesignOnModel, ACartPoleMovesAsTheReferenceRunOfTheFormulas) {
  for (const double axis : {-1.0, 1.0}) {
    const auto model = cart_and_pole(axis);
    const auto d =
        cart_pole_on(model, {"cart_joint.force", {0, pi}}, {.k = 1, .m22 = 0.1, .P = 1, .kv = 3});
    EXPECT_LT(difference(d), 1e-12);  // measured 1e-16, of all designs at most 1.4e-15
    // Reference run (RK4, 5 ms) of Acosta et al. 2005 with a = 10, b = 1, from 0.5 rad, after 1 s:
    // pole -0.238618, cart 2.122035, to its six digits.
    const double sign = axis < 0 ? -1 : 1;  // of the hinge against the design's angle
    const auto x = after(1, model, d, {0, pi + sign * 0.5});
    EXPECT_NEAR(x[0], 2.122035, 1e-6);
    EXPECT_NEAR(sign * (x[1] - pi), -0.238618, 1e-6);
    double beyond = 1;  // the horizontal: no law there
    (*d.port_law().law)(0.0, std::span<const double>(Vec{0, pi + 2, 0.1, 0.2}), {},
                        std::span(&beyond, 1));
    EXPECT_EQ(beyond, 0);
    const auto end = after(30, model, d, {0, pi + sign * 0.5}, 0.01);
    EXPECT_NEAR(std::hypot(end[0], end[1] - pi), 0, 0.05);
  }
}

TEST(DesignOnModel, AnInertiaWheelSwingsUpAsTheReferenceRun) {
  for (const double axis : {1.0, -1.0}) {
    const auto model = wheel_pendulum(axis);
    const auto d = inertia_wheel_on(model, {"wheel_joint.torque", {0, 0}}, {});
    EXPECT_LT(difference(d), 1e-12);
    // Ortega et al. 2002, from (3.14, 0), after 5 s: (-0.044486, 0.328469), the wheel in the world.
    const auto x = after(5, model, d, {3.14, -axis * 3.14});
    EXPECT_NEAR(x[0], -0.044486, 1e-6);
    EXPECT_NEAR(x[0] + axis * x[1], 0.328469, 1e-6);
  }
}

/// The numbers of each design, by hand from masses. Control: I1 without the wheel's mass.
TEST(DesignOnModel, ReadsTheNumbersOffTheMasses) {
  const char* const urdf = R"(<robot name="wheel_pendulum"><link name="stand"/>
<link name="rod"><inertial><origin xyz="0 0 -0.12"/><mass value="0.2"/>
<inertia ixx="0.0012" iyy="0.0012" izz="4e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="wheel"><inertial><mass value="0.3"/>
<inertia ixx="0.0006" iyy="0.0012" izz="0.0006" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pivot" type="continuous"><parent link="stand"/><child link="rod"/>
<axis xyz="0 1 0"/></joint>
<joint name="motor" type="continuous"><parent link="rod"/><child link="wheel"/>
<origin xyz="0 0 -0.25"/><axis xyz="0 1 0"/></joint></robot>)";
  mechanics::UrdfOptions fixed;
  fixed.base = mechanics::UrdfOptions::Base::fixed;
  fixed.gravity = {0, 0, -9.81};
  const auto pendulum =
      std::make_shared<mechanics::MechanicalModel>(std::make_shared<mechanics::Mechanism>(
          mechanics::parse_urdf(urdf, "wheel.urdf", fixed).mechanism));
  const auto off = [](const DesignOnModel& d, const char* name, double known) {
    return std::fabs(d.certificate().item(name).value / known - 1);
  };
  const auto wheel = inertia_wheel_on(pendulum, {"motor.torque", {pi, 0}}, 5, 0.8);
  const double rod = 0.0012 + 0.2 * 0.12 * 0.12;
  test::keeps("I1", off(wheel, "I1", rod + 0.3 * 0.25 * 0.25), 1e-14);
  test::breaks("control: I1 without the wheel's mass", off(wheel, "I1", rod), 1e-14);
  test::keeps("I2", off(wheel, "I2", 0.0012), 1e-14);
  test::keeps("m3", off(wheel, "m3", 9.81 * (0.2 * 0.12 + 0.3 * 0.25)), 1e-14);

  const auto cart =
      cart_pole_on(cart_and_pole(1), {"cart_joint.force", {0, pi}}, {.k = 1, .m22 = 0.1});
  test::keeps("a of a point mass, g/l", off(cart, "a", 10), 1e-14);
  test::keeps("b, 1/l", off(cart, "b", 1), 1e-14);
  const auto acrobot = acrobot_on(acrobot_of_two_rods(), {"lower_joint.torque", {pi, 0}}, {});
  test::keeps("c1", off(acrobot, "c1", 1 / 3.0 + 4 * 0.25 + 1), 1e-14);
  test::keeps("c2", off(acrobot, "c2", 4 / 3.0 + 4), 1e-14);
  test::keeps("c3", off(acrobot, "c3", 2), 1e-14);
  test::keeps("c4", off(acrobot, "c4", 4 * 0.5 + 1), 1e-14);
  test::keeps("c5", off(acrobot, "c5", 2), 1e-14);
  const auto ball = ball_and_beam_on(beam(), {"beam_joint.torque", {0, 0}}, {});
  test::keeps("L", off(ball, "L", 1), 1e-14);
  test::keeps("g", off(ball, "g", 9.81), 1e-14);
}

/// The characteristic polynomial of the plant under the law, by values at three complex numbers:
/// (s² + 2ζω s + ω²)². Control: another kv.
TEST(DesignOnModel, AnInertiaWheelHasTheWantedPoles) {
  std::mt19937_64 generator(3);
  const auto draw = [&](double low, double high) {
    return std::exp(
        std::uniform_real_distribution<double>(std::log(low), std::log(high))(generator));
  };
  double worst = 0, control = HUGE_VAL;
  for (int i = 0; i < 200; ++i) {
    const double omega = draw(0.5, 20), zeta = draw(0.2, 2);
    InertiaWheelPendulum d{.I1 = draw(0.01, 1), .I2 = draw(1e-3, 1), .m3 = draw(0.1, 10)};
    d = inertia_wheel_gains(d, omega, zeta);
    const auto off = [&](const InertiaWheelPendulum& gains) {
      const auto loop = inertia_wheel_pendulum(
          gains, nullptr, MatchingOptions{.region = {{-3, -3}, {3, 3}, 5, 20}, .refuse = false});
      auto A = field_jacobian(*loop, loop->rest());
      const double unit[4] = {1, 1, gains.I1 * omega, gains.I2 * omega};
      for (size_t k = 0; k < 16; ++k) A[k] *= unit[k % 4] / unit[k / 4] / omega;
      double most = 0, largest = 0;
      for (const double entry : A) largest = std::max(largest, std::fabs(entry));
      for (const std::complex<double> s :
           {std::complex<double>(0.3, 0.8), {-0.6, 1.1}, {1.7, 0.0}}) {
        std::complex<double> p = 1, wanted = std::pow(s * s + 2 * zeta * s + 1.0, 2);
        for (const auto& pole : phs::eigenvalues(4, A)) p *= s - pole;
        most = std::max(most, std::abs(p - wanted) / std::abs(wanted));
      }
      return std::pair(most, most / (largest * largest));  // what rounds is squared in it
    };
    worst = std::max(worst, off(d).second);
    d.kv *= 1.01;
    control = std::min(control, off(d).first);
  }
  test::keeps("polynomial, relative, over the square of the largest entry", worst, 5e-13);
  test::breaks("of a kv 1 % off", control, 1e-4);
  EXPECT_THROW((void)inertia_wheel_gains({}, 0, 1), InvalidArgument);
  EXPECT_THROW((void)inertia_wheel_gains({}, 1, -1), InvalidArgument);
}

TEST(DesignOnModel, AnAcrobotAndABallOnABeamComeToRest) {
  const auto acrobot = acrobot_of_two_rods();
  const auto a =
      acrobot_on(acrobot, {"lower_joint.torque", {pi, 0}}, {.a2 = 1, .a3 = 4, .ku = 200, .kv = 2});
  EXPECT_LT(difference(a), 1e-12);
  const auto x = after(14, acrobot, a, {pi + 0.1, 0});
  EXPECT_LT(std::hypot(x[0] - pi, x[1]), 0.02);  // 0.031 after 10 s, of 0.1
  // The same motion with axes of any sign.
  for (const auto& [upper, lower] : {std::pair{1.0, -1.0}, {-1.0, 1.0}, {-1.0, -1.0}}) {
    const auto turned = acrobot_of_two_rods(upper, lower);
    const auto law = acrobot_on(turned, {"lower_joint.torque", {upper * pi, 0}},
                                {.a2 = 1, .a3 = 4, .ku = 200, .kv = 2});
    EXPECT_LT(difference(law), 1e-12);
    const auto y = after(2, turned, law, {upper * (pi + 0.1), 0}),
               z = after(2, acrobot, a, {pi + 0.1, 0});
    test::keeps("off the acrobot with both axes up",
                std::hypot(upper * y[0] - z[0], lower * y[1] - z[1]), 1e-10);
  }

  const auto on_beam = beam();
  const auto b = ball_and_beam_on(on_beam, {"beam_joint.torque", {0, 0}}, {.kp = 5, .kv = 3});
  EXPECT_LT(difference(b), 1e-12);
  const auto y = after(40, on_beam, b, {0.3, 0.5});
  EXPECT_LT(std::hypot(y[0], y[1]), 1e-3);
}

/// As a model file has it the wheel's angle is that against the pendulum. Controls: a plant of the
/// design's coordinates, and inertia_wheel_on of the same model.
TEST(DesignOnModel, APlantOfOtherCoordinatesIsToldTheDesigns) {
  const InertiaWheelPendulum d;
  const std::string why = words_of([&] { (void)inertia_wheel_pendulum(d, wheel_pendulum(1)); });
  EXPECT_NE(why.find("the plant is to have the pendulum's angle from upright and the wheel's in "
                     "the world: for a model file a scene's design = \"inertia_wheel\""),
            std::string::npos)
      << why;
  EXPECT_EQ(words_of([&] { (void)inertia_wheel_pendulum(d, inertia_wheel_plant(d)); }), "");
  EXPECT_EQ(words_of([] {
              inertia_wheel_on(wheel_pendulum(1), {"wheel_joint.torque", {0, 0}}, {});
            }),
            "");
  const auto seen = inertia_wheel_pendulum(
      d, wheel_pendulum(1), MatchingOptions{.region = {{-3, -3}, {3, 3}}, .refuse = false});
  EXPECT_FALSE(seen->certificate().holds());
}

TEST(DesignOnModel, RefusesAModelThatIsNotTheDesigns) {
  const auto says = [](auto f, const std::string& part) {
    const auto text = words_of(f);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const CartPole gains{.k = 1, .m22 = 0.1, .P = 1, .kv = 3};
  // An acrobot is no cart-pole: only the motion tells.
  says(
      [&] {
        cart_pole_on(acrobot_of_two_rods(), {"lower_joint.torque", {pi, 0}}, gains);
      },
      "moves as the design's plant");
  // A slide 0.2 m above the hinge couples ball and beam.
  says(
      [] {
        ball_and_beam_on(beam(0.2), {"beam_joint.torque", {0, 0}}, {.kp = 5, .kv = 3});
      },
      "moves as the design's plant");
  // Friction of 0.1 N m s is no part of the design.
  says(
      [&] {
        cart_pole_on(cart_and_pole(1, 0.1), {"cart_joint.force", {0, pi}}, gains);
      },
      "has a damping of 0.1, expected 0: the design knows none");
  says(
      [&] {
        cart_pole_on(cart_and_pole(1, 0.1), {"cart_joint.force", {0, pi}}, gains);
      },
      "; design on the model without it and add it as an [[element]]");
  // Hanging instead of upright: a < 0.
  says(
      [&] {
        cart_pole_on(cart_and_pole(1), {"cart_joint.force", {0, 0}}, gains);
      },
      "'pole_joint' hangs at its target, expected the upright; likely cause: the target of "
      "'pole_joint' is 0 rad, which may be 3.14159265358979");
  says(
      [&] {
        cart_pole_on(cart_and_pole(1), {"cart_joint.force", {0, pi - 0.5}}, gains);
      },
      "'pole_joint' leans by 0.5 rad at its target, expected the upright; likely cause: the target "
      "of 'pole_joint' is 2.64159 rad, which may be 3.14159265358979");
  says(
      [&] {
        inertia_wheel_on(wheel_pendulum(1), {"wheel_joint.torque", {pi, 0}}, {});
      },
      "'pendulum_joint' hangs at its target");
  // A wheel whose centre of mass is 1 mm off its axis: 3 kg · 10 m/s² · 1 mm. Control: none.
  const auto unbalanced = [](double off) {
    return words_of([&] {
      inertia_wheel_on(wheel_pendulum(1, off), {"wheel_joint.torque", {0, 0}}, {});
    });
  };
  EXPECT_EQ(unbalanced(0.001),
            "design 'inertia-wheel pendulum' does not apply: gravity pulls at 'wheel_joint' by up "
            "to 0.03 N m; likely cause: the wheel's centre of mass is off its axis; balance it in "
            "the model, or take an lqr");
  EXPECT_EQ(unbalanced(0), "");
  // A rotary pendulum is no wheel pendulum. Control: AnInertiaWheelSwingsUpAsTheReferenceRun.
  const auto rotary =
      two(10, link("arm", "world", "revolute", {0, 0, 1}, {0, 0, 0}, 0.3, {0.1, 0, 0}, 0.001),
          link("rod", "arm", "revolute", {1, 0, 0}, {0.2, 0, 0}, 0.12, {0, 0, -0.2}, 0.0016));
  const auto why = words_of([&] {
    inertia_wheel_on(rotary, {"arm_joint.torque", {0, pi}}, 5, 0.8);
  });
  EXPECT_EQ(why,
            "design 'inertia-wheel pendulum' does not apply: the axes of 'arm_joint' and "
            "'rod_joint' are 1.571 rad apart, expected parallel ones; a rotary pendulum is for "
            "swing_up and lqr, or Python's numerical_matching");
  test::keeps("characters of this sentence", double(why.size()), 220);
  // The pole driven instead of the cart: a = 0.
  says(
      [&] {
        cart_pole_on(cart_and_pole(1), {"pole_joint.torque", {0, pi}}, gains);
      },
      "gravity does not act at 'cart_joint', the joint without actuator, expected the pendulum "
      "there; likely cause: drives = \"pole_joint\", which may be \"cart_joint\"");
  says([&] { cart_pole_on(test::arm(3), {"joint_0.torque", {0, 0, 0}}, gains); }, "two joints");
  says(
      [] {
        acrobot_on(acrobot_of_two_rods(), {"upper_joint.torque", {pi, 0}}, {});
      },
      "the elbow driven");
  says(
      [] {
        acrobot_on(acrobot_of_two_rods(), {"lower_joint.torque", {pi, 0}},
                   {.a2 = 1, .a3 = 4, .ku = 20, .kv = 2});
      },
      "Hessian");
}

}  // namespace porthos::energy_shaping::design_on_model_test
