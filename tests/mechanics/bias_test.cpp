// The field's rounding must be unbiased: along a trajectory the power its errors put in, ∇H·δf,
// averages to zero. A bias is an energy drift linear in time that no step size and no method can
// mend.
#include <gtest/gtest.h>

#include <random>

#include "integrators/core/integrator.h"
#include "mechanics/builder.h"
#include "mechanics/hamiltonian_field.h"
#include "tests/support/robots.h"

namespace porthos::mechanics::bias_test {
namespace {

test::Robot floating_arm() {
  MechanismBuilder b("arm");
  const auto add = [&](const char* name, const char* parent, const char* joint, Vec3d axis,
                       double mass) {
    BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.type = joint;
    s.joint.axis = axis;
    if (std::string(parent) != "world") s.placement.r = {0, 0, -0.5};
    const double i = 0.1 * mass;
    s.mass = {mass, {0.1, 0.05, -0.4}, {i, 0, 0, i, 0, i}};
    b.add(s);
  };
  add("body", "world", "free", {0, 0, 1}, 20);
  add("upper", "body", "revolute", {0, 1, 0}, 3);
  add("lower", "upper", "revolute", {1, 0, 0}, 2);
  return test::make_robot(std::make_shared<Mechanism>(b.build()), {0.4, -0.7}, {1.5, -2.5});
}

struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    n += 1;
  }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(squares) / n; }
};

TEST(Bias, OfTheFieldIsNone) {
  using E = long double;
  const auto robot = floating_arm();
  const auto method = integrators::make_integrator("gauss16", *robot.model, 0.05);
  const auto in_double = robot.model->instantiate<double>();
  const auto exact = robot.model->instantiate<E>();
  phs::State s = robot.start;
  const size_t n = s.x.size();
  std::vector<double> f(n);
  std::vector<E> x(n), e(n), fe(n);
  constexpr double bound = 2e-18;
  Mean field, biased;
  double H = 0;
  for (int step = 0; step < 200000; ++step) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    std::copy(s.x.begin(), s.x.end(), x.begin());
    in_double->field(0, s.x, {}, f);
    exact->field(0, x, {}, fe);
    exact->gradient(x, e);
    if (step == 0) H = double(exact->hamiltonian(x));
    E power = 0;
    for (size_t i = 0; i < n; ++i) power += e[i] * (f[i] - fe[i]);
    field.add(double(power) / H);
    biased.add(double(power) / H + 2 * bound);
  }
  std::printf("  power of the rounding, relative to H, per s: %+.1e ± %.1e (bound %.0e)\n",
              field.value(), field.error(), bound);
  EXPECT_LE(std::fabs(field.value()), bound);
  EXPECT_LE(4 * field.error(), bound) << "so many steps that a bias of this size stands out";
  EXPECT_GT(std::fabs(biased.value()), bound) << "the control: the same numbers with a bias";
}

// 1/|ξ|² near the unit sphere: 1 - c is rounded without bias, the quotient 1/|ξ|² is not.
TEST(Bias, OfTheNormFactorIsNone) {
  using E = long double;
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal;
  Mean ours, quotient;
  for (int i = 0; i < 1000000; ++i) {
    Quaternion<double> q{normal(rng), {normal(rng), normal(rng), normal(rng)}};
    const double n = std::sqrt(q.norm2());
    q = {q.w / n, {q.v.x / n, q.v.y / n, q.v.z / n}};
    const E exact = 1 / Quaternion<E>{q.w, Vec3<E>(q.v)}.norm2();
    ours.add(double((1 - E(norm_defect(q))) / exact - 1));
    quotient.add(double(E(1 / q.norm2()) / exact - 1));
  }
  std::printf(
      "  relative error of 1/|ξ|²: ours %+.1e ± %.1e (bound 5 sigma)   quotient %+.1e ± %.1e (must "
      "exceed 20 sigma)\n",
      ours.value(), ours.error(), quotient.value(), quotient.error());
  EXPECT_LE(std::fabs(ours.value()), 5 * ours.error());
  EXPECT_GT(std::fabs(quotient.value()), 20 * quotient.error());
}

}  // namespace
}  // namespace porthos::mechanics::bias_test
