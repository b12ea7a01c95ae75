#pragma once
#include <cmath>
#include <memory>

#include "mechanics/builder.h"
#include "mechanics/rotation.h"
#include "space/split_integrator.h"
#include "tests/support/bounds.h"
#include "tests/support/reference.h"
#include "tests/support/robots.h"

namespace porthos::test {

using space::Vec3d;

/// One rigid body, free.
inline std::shared_ptr<const mechanics::MechanicalModel> rigid_body(double mass, const Vec3d& I) {
  mechanics::MechanismBuilder b("body");
  mechanics::BodySpec body;
  body.name = "body";
  body.parent = "world";
  body.joint.name = "base";
  body.joint.type = "free";
  body.mass.mass = mass;
  body.mass.inertia.xx = I.x;
  body.mass.inertia.yy = I.y;
  body.mass.inertia.zz = I.z;
  b.add(body);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// q and v of a lone body: unit quaternion body to inertial, body rates.
inline std::vector<double> body_state(const mechanics::MechanicalModel& m, const double* wxyz,
                                      const Vec3d& rate) {
  const std::vector<double> q{0, 0, 0, wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
  const std::vector<double> v{rate.x, rate.y, rate.z, 0, 0, 0};
  return m.state(q, v);
}

inline mechanics::Mat3<double> attitude(const phs::State& s) {
  return mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&s.x[3]));
}

/// A quaternion of the rotation with these columns, its w not small.
inline std::array<double, 4> quaternion(const mechanics::Mat3<double>& R) {
  const double w = 0.5 * std::sqrt(1 + R.x.x + R.y.y + R.z.z);
  return {w, (R.y.z - R.z.y) / (4 * w), (R.z.x - R.x.z) / (4 * w), (R.x.y - R.y.x) / (4 * w)};
}

/// Two hinged links on a free base, of inertias without any symmetry.
inline std::shared_ptr<const mechanics::MechanicalModel> small_arm() {
  mechanics::MechanismBuilder b("arm");
  const auto add = [&](const char* name, const char* parent, const char* type, Vec3d axis,
                       Vec3d place, double m, Vec3d com) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = std::string(name) + "_joint";
    s.joint.type = type;
    s.joint.axis = axis;
    s.placement.r = place;
    s.mass.mass = m;
    s.mass.com = com;
    s.mass.inertia.xx = 1.1 * m;
    s.mass.inertia.yy = 1.3 * m;
    s.mass.inertia.zz = 0.7 * m;
    s.mass.inertia.xy = 0.1 * m;
    s.mass.inertia.xz = -0.05 * m;
    s.mass.inertia.yz = 0.08 * m;
    b.add(s);
  };
  add("base", "world", "free", {0, 0, 1}, {0, 0, 0}, 20, {0.3, -0.1, 0.2});
  add("upper", "base", "revolute", {0.6, 0.8, 0}, {1, 0.5, -0.2}, 5, {0.1, 1.2, 0.3});
  add("lower", "upper", "revolute", {0, 0.6, 0.8}, {0.2, 2.0, 0.1}, 3, {-0.4, 0.2, 1.5});
  add("slide", "lower", "prismatic", {1, 0, 0}, {0, 0.4, 1}, 2, {0.5, 0, 0.1});
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

}  // namespace porthos::test
