// Flexible panels: bending frequencies of the segments against the clamped Euler-Bernoulli beam.
#include "mechanics/panel.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>

#include "mechanics/crba.h"
#include "mechanics/mechanical_model.h"

namespace porthos::mechanics::panel_test {
namespace {

constexpr double EI = 120;

Panel boom(int segments) {
  Panel p;
  p.name = "boom";
  p.link = "hub";
  p.length = 4;
  p.width = 0.5;
  p.mass = 6;
  p.bending_stiffness = EI;
  p.segments = segments;
  return p;
}
MechanismBuilder hub() {
  MechanismBuilder b("panel");
  BodySpec s;
  s.name = "hub";
  s.parent = "world";
  s.mass.mass = 1;
  b.add(s);
  return b;
}
/// The lowest three frequencies of small motions about q = 0 [rad/s].
std::array<double, 3> frequencies(const Mechanism& m) {
  const int n = m.nv();
  Workspace<double> w(m);
  std::vector<double> M(size_t(n) * size_t(n));
  crba<double>(m, w, m.neutral(), M);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, n);
  for (const auto& j : m.joint_properties()) K(j.v, j.v) = j.stiffness;
  const Eigen::Map<const Eigen::MatrixXd> mass(M.data(), n, n);
  const Eigen::VectorXd e =
      Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(K, mass, Eigen::EigenvaluesOnly)
          .eigenvalues();
  return {std::sqrt(e(0)), std::sqrt(e(1)), std::sqrt(e(2))};
}
/// The same with the hinges at the inner end of each piece: what one would write down first.
Mechanism hinges_at_the_ends(int segments) {
  MechanismBuilder b = hub();
  const Panel p = boom(segments);
  const double l = p.length / segments, m = p.mass / segments;
  for (int i = 0; i < segments; ++i) {
    BodySpec s;
    s.name = "s" + std::to_string(i);
    s.parent = i ? "s" + std::to_string(i - 1) : "hub";
    s.placement.r = {i ? l : 0, 0, 0};
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.joint.stiffness = EI / l;
    s.mass.mass = m;
    s.mass.com = {l / 2, 0, 0};
    s.mass.inertia.xx = m * 0.25 / 12;
    s.mass.inertia.yy = m * l * l / 12;
    s.mass.inertia.zz = s.mass.inertia.xx + s.mass.inertia.yy;
    b.add(s);
  }
  return b.build();
}

TEST(Panel, BendsAsTheClampedBeamToSecondOrder) {
  std::array<double, 3> before{}, crude_before{};
  for (const int n : {4, 8, 16, 32, 64}) {
    MechanismBuilder b = hub();
    add_panel(b, boom(n));
    const auto w = frequencies(b.build()), crude = frequencies(hinges_at_the_ends(n));
    std::printf("  N = %2d:", n);
    for (int k = 0; k < 3; ++k) {
      const double exact = bending_frequency(boom(n), k + 1);
      const double error = std::fabs(w[size_t(k)] / exact - 1),
                   other = std::fabs(crude[size_t(k)] / exact - 1);
      const double order = std::log2(before[size_t(k)] / error),
                   crude_order = std::log2(crude_before[size_t(k)] / other);
      std::printf("  %.2e (order %.2f; hinges at the ends %.2e, %.2f)", error, n > 4 ? order : 0,
                  other, n > 4 ? crude_order : 0);
      if (n > 16) {
        EXPECT_NEAR(order, 2, 0.05);
        EXPECT_NEAR(crude_order, 1, 0.15);
      }
      before[size_t(k)] = error;
      crude_before[size_t(k)] = other;
    }
    std::printf("\n");
  }
  EXPECT_LE(before[0], 2e-4);
  EXPECT_NEAR(bending_frequency(boom(8), 1), 3.5160152685 * std::sqrt(EI / (1.5 * 256)), 1e-9);
}

TEST(Panel, HasTheMassOfTheBeamAndRefusesWhatIsNone) {
  MechanismBuilder b = hub();
  Panel p = boom(5);
  p.damping_ratio = 0.01;
  add_panel(b, p);
  const Mechanism m = b.build();
  double mass = 0;
  for (const auto& s : b.bodies()) mass += s.mass.mass;
  EXPECT_NEAR(mass, 7, 1e-14);
  EXPECT_EQ(m.nv(), 5);
  for (const auto& j : m.joint_properties())
    EXPECT_NEAR(j.damping * bending_frequency(p, 1) / (2 * j.stiffness), 0.01, 1e-16);
  for (const auto change :
       {+[](Panel& x) { x.length = 0; }, +[](Panel& x) { x.mass = -1; },
        +[](Panel& x) { x.bending_stiffness = NAN; }, +[](Panel& x) { x.segments = 0; }}) {
    Panel bad = boom(5);
    change(bad);
    MechanismBuilder other = hub();
    EXPECT_THROW(add_panel(other, bad), InvalidArgument);
  }
}

}  // namespace
}  // namespace porthos::mechanics::panel_test
