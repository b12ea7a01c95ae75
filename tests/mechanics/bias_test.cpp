// The field's rounding must be unbiased: along a trajectory the power its errors put in, ∇H·δf, averages to zero. A bias
// is an energy drift linear in time that no step size and no method can mend.
#include <gtest/gtest.h>

#include "integrators/integrator.h"
#include "mechanics/builder.h"
#include "mechanics/hamiltonian_field.h"
#include "tests/support/robots.h"

namespace porthos::mechanics {
namespace {

test::Robot floating_arm() {
  MechanismBuilder b("arm");
  const auto add = [&](const char* name, const char* parent, const char* joint, Vec3d axis, double mass) {
    BodySpec s;
    s.name = name, s.parent = parent, s.joint.type = joint, s.joint.axis = axis;
    if (std::string(parent) != "world") s.placement.r = {0, 0, -0.5};
    const double i = 0.1 * mass;
    s.mass = {mass, {0.1, 0.05, -0.4}, {i, 0, 0, i, 0, i}};
    b.add(s);
  };
  add("body", "world", "free", {0, 0, 1}, 20), add("upper", "body", "revolute", {0, 1, 0}, 3), add("lower", "upper", "revolute", {1, 0, 0}, 2);
  return test::make_robot(std::make_shared<Mechanism>(b.build()), {0.4, -0.7}, {1.5, -2.5});
}

struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, n += 1; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(squares) / n; }
};

/// R by the short way, with s = 2/|ξ|².
Mat3<double> short_rotation_matrix(const Quaternion<double>& q) {
  const double s = 2 / q.norm2(), x = s * q.v.x, y = s * q.v.y, z = s * q.v.z;
  return {{1 - (q.v.y * y + q.v.z * z), q.v.x * y + q.w * z, q.v.x * z - q.w * y},
          {q.v.x * y - q.w * z, 1 - (q.v.x * x + q.v.z * z), q.v.y * z + q.w * x},
          {q.v.x * z + q.w * y, q.v.y * z - q.w * x, 1 - (q.v.x * x + q.v.y * y)}};
}

TEST(Bias, OfTheFieldIsNone) {
  using E = long double;
  const auto robot = floating_arm();
  const auto method = integrators::make_integrator("gauss16", *robot.model, 0.05);
  const auto in_double = robot.model->instantiate<double>();
  const auto exact = robot.model->instantiate<E>();
  phs::State s = robot.start;
  const size_t n = s.x.size(), nq = n / 2;
  std::vector<double> f(n);
  std::vector<E> x(n), e(n), fe(n);
  Mean field, control;
  double H = 0;
  for (int step = 0; step < 200000; ++step) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    std::copy(s.x.begin(), s.x.end(), x.begin());
    in_double->field(0, s.x, {}, f), exact->field(0, x, {}, fe), exact->gradient(x, e);
    if (step == 0) H = double(exact->hamiltonian(x));
    E power = 0;
    for (size_t i = 0; i < n; ++i) power += e[i] * (f[i] - fe[i]);
    field.add(double(power) / H);

    // Negative control: the torque -v × RᵀP of the base with the short rotation matrix; its power is ω·δt.
    const auto rate = robot.model->rates(s.x);
    const auto xi = Quaternion<double>::load(&s.x[3]);
    const Vec3d w{rate[0], rate[1], rate[2]}, v{rate[3], rate[4], rate[5]}, P{s.x[nq], s.x[nq + 1], s.x[nq + 2]};
    const Vec3<E> right = cross(Vec3<E>(v), rotation_matrix(Quaternion<E>::load(&x[3])).tmul(Vec3<E>(P)));
    const Vec3<E> wrong = cross(Vec3<E>(v), Vec3<E>(short_rotation_matrix(xi).tmul(P)));
    control.add(double(dot(Vec3<E>(w), right - wrong)) / H);
  }
  std::printf("  power of the rounding, relative to H, per s: field %+.1e ± %.1e (bound 2e-18)   short R alone %+.1e ± %.1e (must exceed 1e-17)\n",
              field.value(), field.error(), control.value(), control.error());
  EXPECT_LE(std::fabs(field.value()), 2e-18);
  EXPECT_GT(std::fabs(control.value()), 1e-17);
}

}  // namespace
}  // namespace porthos::mechanics
