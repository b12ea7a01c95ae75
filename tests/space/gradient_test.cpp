#include <random>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "phs/system/check.h"
#include "phs/system/random_state.h"
#include "tests/places.h"
#include "tests/space/support.h"

// Gravity gradient on links: against its own potential, and against gravity itself.
namespace porthos::space::gradient_test {
namespace {

using phs::Quad;
using test::breaks;
using test::keeps;

struct Case {
  std::shared_ptr<const mechanics::MechanicalModel> model = test::small_arm();
  std::vector<Quad> q;
  Vec3<Quad> R;
  double mu = 3.986e14;
  explicit Case(double distance) : R{0.48 * distance, 0.6 * distance, -0.64 * distance} {
    std::mt19937_64 rng(3);
    const auto x = phs::random_state(model->description(), 0.7, rng);
    q.assign(x.begin(), x.begin() + model->mechanism().nq());
  }
};

TEST(GravityGradient, ForcesAreTheSlopeOfThePotential) {
  Case c(7e6);
  const auto& m = c.model->mechanism();
  GravityGradient<Quad> g(m);
  const auto energy = [&](const std::vector<Quad>& q, const Vec3<Quad>& R) {
    g.evaluate(c.mu, q, R);
    return g.energy();
  };
  const Quad d(1e-12), V = energy(c.q, c.R);
  double worst_q = 0, worst_R = 0, worst_t = 0;
  for (const auto& j : m.coordinates()) {
    if (j.nq != 1) continue;
    auto up = c.q, down = c.q;
    up[size_t(j.q)] += d;
    down[size_t(j.q)] -= d;
    const Quad slope = (energy(up, c.R) - energy(down, c.R)) / (d + d);
    energy(c.q, c.R);
    worst_q = std::max(worst_q, double(phs::abs((g.joint_forces()[size_t(j.v)] + slope) / V)));
  }
  for (int k = 0; k < 3; ++k) {
    auto up = c.R, down = c.R;
    up[k] = up[k] + Quad(1e-6);
    down[k] = down[k] - Quad(1e-6);
    const Quad slope = (energy(c.q, up) - energy(c.q, down)) / Quad(2e-6);
    energy(c.q, c.R);
    worst_R = std::max(worst_R, double(phs::abs((g.reaction()[k] + slope) / V)) * 7e6);
  }
  using Q4 = mechanics::Quaternion<Quad>;
  for (int k = 0; k < 3; ++k) {  // turned about the body's axis k, the centre of mass at rest
    Vec3<Quad> axis{Quad(0.0), Quad(0.0), Quad(0.0)};
    axis[k] = d / 2;
    auto up = c.q, down = c.q;
    const Q4 xi = Q4::load(&c.q[3]), by = xi * axis;
    Q4{xi.w + by.w, xi.v + by.v}.store(&up[3]);
    Q4{xi.w - by.w, xi.v - by.v}.store(&down[3]);
    const Quad slope = (energy(up, c.R) - energy(down, c.R)) / (d + d);
    energy(c.q, c.R);
    worst_t = std::max(worst_t, double(phs::abs((g.joint_forces()[size_t(k)] + slope) / V)));
  }
  // A joint's frame is a rotation to the rounding of doubles, also in 113 bits.
  keeps("joint forces", worst_q, 1e-14);
  keeps("torque on the base", worst_t, 1e-14);
  keeps("reaction on the centre of mass", worst_R, 1e-14);
  // What a gradient torque on the hub alone leaves out: the joints' own.
  double largest = 0;
  for (const auto& j : m.coordinates())
    if (j.nq == 1) largest = std::max(largest, double(phs::abs(g.joint_forces()[size_t(j.v)] / V)));
  breaks("joint forces over V, which a torque on the hub alone would not give", largest, 1e-2);
  // The whole turns as the orbit does: R × F + torque = 0.
  const auto sum = cross(c.R, g.reaction()) + g.torque();
  keeps("torque on orbit and on body together",
        double(mechanics::norm(sum) / mechanics::norm(g.torque())), 1e-15);
}

TEST(GravityGradient, AgainstEveryMassPointOfTheLinks) {
  // Each link as six points of its mass and inertia: gravity on them, less that on the centre of
  // mass.
  for (const double distance : {1e4, 1e5}) {
    Case c(distance);
    const auto& m = c.model->mechanism();
    mechanics::Workspace<Quad> w(m);
    std::vector<mechanics::Transform<Quad>> pose(m.nodes().size());
    mechanics::forward_kinematics<Quad>(m, w, c.q, pose);
    const auto centre = mechanics::centre_of_mass<Quad>(m, w, c.q);
    Quad exact(0.0);
    const Quad d = mechanics::norm(c.R);
    for (size_t i = 0; i < pose.size(); ++i) {
      const auto& I = m.nodes()[i].inertia;
      const Vec3d com = (1 / I.m) * I.mc;
      // Second moments J = ½ tr I 1 - I about the centre, by its Cholesky factor L: points at ±√3 L
      // e_k, mass m/6
      mechanics::Sym3<double> J = I.I;
      const double c2 = dot(com, com);
      const auto about = [&](double v, double a, double b, bool diagonal) {
        return v - I.m * ((diagonal ? c2 : 0) - a * b);
      };
      J.xx = about(J.xx, com.x, com.x, true);
      J.yy = about(J.yy, com.y, com.y, true);
      J.zz = about(J.zz, com.z, com.z, true);
      J.xy = about(J.xy, com.x, com.y, false);
      J.xz = about(J.xz, com.x, com.z, false);
      J.yz = about(J.yz, com.y, com.z, false);
      const double half = 0.5 * (J.xx + J.yy + J.zz);
      const double A[3][3] = {
          {half - J.xx, -J.xy, -J.xz}, {-J.xy, half - J.yy, -J.yz}, {-J.xz, -J.yz, half - J.zz}};
      double L[3][3] = {};
      for (int r = 0; r < 3; ++r)
        for (int k = 0; k <= r; ++k) {
          double s = A[r][k];
          for (int l = 0; l < k; ++l) s -= L[r][l] * L[k][l];
          L[r][k] = r == k ? std::sqrt(s) : s / L[k][k];
        }
      for (int k = 0; k < 3; ++k)
        for (const double sign : {1.0, -1.0}) {
          const double f = sign * std::sqrt(3 / I.m);
          const Vec3d at = com + f * Vec3d{L[0][k], L[1][k], L[2][k]};
          const Vec3<Quad> x = pose[i].R * Vec3<Quad>(at) + pose[i].r - centre;
          const Quad first = dot(c.R, x) / (d * d * d);  // sums to nothing
          exact += Quad(-c.mu * I.m / 6) *
                   (Quad(1.0) / mechanics::norm(c.R + x) - Quad(1.0) / d + first);
        }
    }
    GravityGradient<Quad> g(m);
    g.evaluate(c.mu, c.q, c.R);
    const Quad third = g.next_order(c.mu, c.q, c.R);
    const double left = double(phs::abs((g.energy() - exact) / exact));
    const double with = double(phs::abs((g.energy() + third - exact) / exact));
    std::printf(
        "  at %.0e m: second order off by %.2e, reported next order %.2e, left with it %.2e\n",
        distance, left, double(phs::abs(third / g.energy())), with);
    EXPECT_NEAR(double(phs::abs(third / g.energy())) / left, 1, 0.05);
    EXPECT_LT(with, 20 / (distance * distance));
  }
}

TEST(Spacecraft, KeepsTheAxiomsOfAPort) {
  const auto arm = test::small_arm();
  Environment env;
  env.planet.mu = 1;  // random orbits are a metre across
  env.planet.radius = 0.1;
  const Spacecraft model(arm, arm, env);
  const auto report = phs::check(model);
  std::printf("%s", report.text().c_str());
  EXPECT_TRUE(report.holds()) << report.text();
}

TEST(Spacecraft, RefusesWhatDoesNotFloat) {
  mechanics::UrdfOptions o;
  o.base = mechanics::UrdfOptions::Base::fixed;
  o.accept_unphysical_inertia = true;
  const auto urdf =
      mechanics::read_urdf(std::string(PORTHOS_SOURCE_DIR) + "/examples/ets_vii/ets_vii.urdf", o);
  const auto fixed = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(urdf.mechanism));
  EXPECT_NE(test::refusal([&] { Spacecraft(fixed, fixed, {}); }).find("float"), std::string::npos);
}

}  // namespace
}  // namespace porthos::space::gradient_test
