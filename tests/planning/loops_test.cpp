// Loops of the joints that turn a free base without momentum, against closed forms.
#include <gtest/gtest.h>

#include "integrators/tables/collocation_table.h"
#include "mechanics/builder.h"
#include "tests/planning/kinematic_base.h"
#include "tests/support/robots.h"

namespace porthos::planning::loops_test {
namespace {

using Vec = std::vector<double>;

/// The end of a motion with given joint rates.
template <class Rates>
Vec end_of(std::shared_ptr<const mechanics::MechanicalModel> model, const Vec& q, double duration,
           int intervals, const Rates& rates) {
  Problem p;
  p.dynamics = std::make_shared<test::KinematicBase>(model);
  p.stages = 8;
  p.duration = duration;
  p.intervals = intervals;
  p.inputs = Inputs::at_stages;
  p.start = q;
  p.cost.input = Vec(size_t(p.dynamics->nu()), 1.0);
  Trajectory t = straight(p, q);
  const auto table = integrators::gauss_table<double>(p.stages);
  const size_t nu = size_t(p.dynamics->nu());
  for (int k = 0; k < intervals; ++k)
    for (size_t i = 0; i < 8; ++i)
      rates((k + table.c[i]) * p.step(), std::span(t.u).subspan((size_t(k) * 8 + i) * nu, nu));
  follow_inputs(p, t);
  return {t.x.end() - long(q.size()), t.x.end()};
}

/// ETS-VII, joints 2 and 3 round a circle.
TEST(Loops, OfEtsVii) {
  const auto robot = test::ets_vii(0);
  const Vec q(robot.start.x.begin(), robot.start.x.begin() + 13);
  const double exact[] = {-2.0316928747009e-3, -1.0224433379362e-3, 2.94729044543e-5};
  const Vec end = end_of(robot.model, q, 2 * M_PI, 40, [](double s, auto u) {
    u[1] = -0.5 * std::sin(s);
    u[2] = 0.5 * std::cos(s);
  });
  const double w = end[3], norm = std::hypot(end[4], end[5], end[6]);
  const double factor = 2 * std::atan2(norm, w) / norm;  // of the rotation vector
  double off = 0;
  for (size_t i = 0; i < 3; ++i) off = std::max(off, std::fabs(factor * end[4 + i] - exact[i]));
  std::printf("  rotation vector off by %.1e (bound 1e-14)\n", off);
  EXPECT_LT(off, 1e-14);
}

/// Two equal axisymmetric bodies that bend by γ without twist: A, then Rz(ψ) Rx(γ) Rz(-ψ), then B.
std::shared_ptr<const mechanics::MechanicalModel> cat(double I, double J, double distance) {
  mechanics::MechanismBuilder b("cat");
  std::string parent = "world";
  const auto add = [&](const std::string& name, const std::string& type, mechanics::Vec3d axis) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = name;
    s.joint.type = type;
    s.joint.axis = axis;
    if (name == "front" || name == "turn_back") {
      s.mass.mass = 2;
      s.mass.com = {0, 0, name == "front" ? -distance : distance};
      s.mass.inertia = {I, 0, 0, I, 0, J};
    }
    b.add(s);
    parent = name;
  };
  add("front", "free", {0, 0, 1});
  add("turn", "revolute", {0, 0, 1});
  add("bend", "revolute", {1, 0, 0});
  add("turn_back", "revolute", {0, 0, 1});
  return std::make_shared<const mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// One turn of ψ turns the whole about the bisector by 2π (Jκ/(Iσ² + Jκ²) - 1), whatever the
/// distance of the bodies from the joint. Control: the other bend.
TEST(Loops, FallingCat) {
  const double I = 0.8, J = I / 4, half = std::acos((std::sqrt(13.0) - 1) / 3) * 2;
  EXPECT_NEAR(half * 180 / M_PI, 59.426458741516, 1e-12);
  for (const double distance : {0.0, 0.7})
    for (const double gamma : {half, 1.3}) {
      const auto model = cat(I, J, distance);
      Vec q(size_t(model->mechanism().nq()), 0.0);
      q[3] = 1;
      q[8] = gamma;
      const Vec end = end_of(model, q, 1, 20, [](double, auto u) {
        u[0] = 2 * M_PI;
        u[2] = -2 * M_PI;
      });
      const double kappa = std::cos(gamma / 2), sigma = std::sin(gamma / 2),
                   turn = 2 * M_PI * (J * kappa / (I * sigma * sigma + J * kappa * kappa) - 1);
      // the bisector of z and Rx(γ) z
      const double c = std::cos(turn / 2), s = std::sin(turn / 2);
      const double exact[] = {c, 0, -s * sigma, s * kappa};
      double off = 0, sign = 0;
      for (size_t i = 0; i < 4; ++i) sign += exact[i] * end[3 + i];
      sign = sign < 0 ? -1 : 1;
      for (size_t i = 0; i < 4; ++i) off = std::max(off, std::fabs(end[3 + i] - sign * exact[i]));
      std::printf("  bend %.4f: turned by %.6f rad, off by %.1e (bound 1e-13)\n", gamma, turn, off);
      EXPECT_LT(off, 1e-13);
    }
}

}  // namespace
}  // namespace porthos::planning::loops_test
