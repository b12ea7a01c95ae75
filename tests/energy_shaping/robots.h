#pragma once
#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/run.h"
#include "mechanics/builder.h"
#include "mechanics/momentum.h"
#include "mechanics/urdf.h"
#include "tests/energy_shaping/loops.h"
#include "tests/places.h"

namespace porthos::test {

using ModelPtr = std::shared_ptr<const mechanics::MechanicalModel>;

/// A rigid body free in the world.
inline ModelPtr free_body() {
  mechanics::MechanismBuilder b("satellite");
  mechanics::BodySpec s;
  s.name = "base";
  s.parent = "world";
  s.joint.type = "free";
  s.mass.mass = 12;
  s.mass.inertia = {3, 0.2, -0.1, 2, 0.1, 1.5};
  b.add(s);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

/// An arm of `n` equal links with axes in turn along y and z, under gravity, and a spring at the
/// last joint.
inline ModelPtr arm(int n, double damping = 0, double g = 9.81, double last_spring = 0) {
  mechanics::MechanismBuilder b("arm");
  b.gravity({0, 0, -g});
  for (int i = 0; i < n; ++i) {
    mechanics::BodySpec s;
    s.name = "link_" + std::to_string(i);
    s.parent = i ? "link_" + std::to_string(i - 1) : "world";
    s.joint.name = "joint_" + std::to_string(i);
    s.joint.type = "revolute";
    s.joint.axis = i % 2 ? mechanics::Vec3d{0, 0.8, 0.6} : mechanics::Vec3d{0, 1, 0};
    s.joint.damping = damping;
    s.joint.stiffness = i + 1 == n ? last_spring : 0;
    s.placement.r = {i ? 0.4 : 0.0, 0, 0};
    s.mass.mass = 2;
    s.mass.com = {0.2, 0.01, 0};
    s.mass.inertia = {0.01, 0, 0, 0.04, 0, 0.04};
    b.add(s);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

inline ModelPtr ets_vii_model(bool wheels) {
  mechanics::UrdfOptions o;
  o.base = mechanics::UrdfOptions::Base::free;
  o.accept_unphysical_inertia = true;
  const std::string root = std::string(PORTHOS_SOURCE_DIR) + "/examples/";
  const auto urdf = mechanics::read_urdf(
      root + (wheels ? "space_arm_regulation/ets_vii_with_wheels.urdf" : "ets_vii/ets_vii.urdf"),
      o);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(urdf.mechanism));
}

/// Greatest change of the total momentum over the states of a run, relative to what the bodies
/// carry at most.
inline double momentum_change(const mechanics::MechanicalModel& model, const std::vector<Vec>& x) {
  const auto& m = model.mechanism();
  const size_t nq = size_t(m.nq());
  mechanics::Workspace<double> w(m);
  double linear = 0, angular = 0, P = 1e-300, L = 1e-300;
  mechanics::Momentum<double> first{};
  for (size_t k = 0; k < x.size(); ++k) {
    const std::span<const double> s(x[k]);
    const auto total = mechanics::momentum<double>(m, w, s.first(nq), s.subspan(nq));
    if (k == 0) first = total;
    const Vec v = model.rates(s);
    const auto scale = mechanics::momentum_scale(m, w, s.first(nq), v);
    P = std::max(P, scale.linear);
    L = std::max(L, scale.angular);
    linear = std::max(linear, norm(total.linear - first.linear));
    angular = std::max(angular, norm(total.angular - first.angular));
  }
  return std::max(linear / P, angular / L);
}

}  // namespace porthos::test
