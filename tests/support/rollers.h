#pragma once
#include "tests/support/linkages.h"

/// Mechanisms that roll, and joints that move as told, for tests.
namespace porthos::test {

/// Chaplygin's sleigh of reference q_chaplygin_sleigh: a body on a plane whose blade, at its
/// origin, runs along x; its centre of mass lies 1/2 m ahead.
inline Linkage sleigh() {
  mechanics::MechanismBuilder b("sleigh");
  mechanics::BodySpec body;
  body.name = "sleigh";
  body.parent = "world";
  body.joint.name = "ice";
  body.joint.type = "planar";
  body.mass = {2, {0.5, 0, 0}, {0.5, 0, 0, 0.5, 0, 0.75}, mechanics::Mat3<double>::identity()};
  b.add(body);
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {0, 0, 0}, {0, 0, 0}};
  l.v[size_t(l.mechanism->coordinate("ice.x").v)] = 0.5;
  l.v[size_t(l.mechanism->coordinate("ice.angle").v)] = 2;
  const mechanics::Mat3<double> across{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};  // z along the body's y
  l.spec.rollings.push_back({"blade", "blade", {}, {"sleigh", {across, {0, 0, 0}}}});
  return l;
}

/// The thin disk of reference q_rolling_disk, radius 1/2 m, 2 kg, on z = 0. omega: in its axes, at
/// the tilt theta of its axle from the vertical, rolling.
inline Linkage rolling_disk(double theta, const mechanics::Vec3d& omega) {
  mechanics::MechanismBuilder b("rolling_disk");
  mechanics::BodySpec disk;
  disk.name = "disk";
  disk.parent = "world";
  disk.joint.name = "disk";
  disk.joint.type = "free";
  disk.mass = {2, {0, 0, 0}, {0.125, 0, 0, 0.125, 0, 0.25}, mechanics::Mat3<double>::identity()};
  b.add(disk).gravity({0, 0, -157. / 16});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {}, {}};
  l.q = l.mechanism->neutral();
  l.v.assign(6, 0);
  const auto &turn = l.mechanism->coordinate("disk.attitude"),
             &place = l.mechanism->coordinate("disk.position");
  l.q[size_t(turn.q)] = std::cos(theta / 2);
  l.q[size_t(turn.q) + 1] = std::sin(theta / 2);
  l.q[size_t(place.q) + 2] = 0.5 * std::sin(theta);
  for (int k = 0; k < 3; ++k) l.v[size_t(turn.v + k)] = omega[k];
  l.v[size_t(place.v)] = -0.5 * omega.z;
  l.v[size_t(place.v) + 2] = 0.5 * omega.x;
  l.spec.rollings.push_back({"wheel", "disk", {}, at("disk", 0, 0), 0.5});
  return l;
}

/// A crank of 0.5 m that a motion turns, with a pendulum of 0.75 m on it, under gravity along -y.
inline Linkage driven_pendulum(const phs::Motion& motion) {
  mechanics::MechanismBuilder b("driven_pendulum");
  b.add(rod("crank", "world", 0, 0, 0.5, 1)).add(rod("pendulum", "crank", 0.5, 0, 0.75, 2));
  b.gravity({0, -9.8125, 0});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {0, -1.25}, {0, 0.5}};
  l.q[0] = (*motion.position)(0.0);
  l.v[0] = (*motion.rate)(0.0);
  l.spec.driven.push_back({"motor", "crank_joint", motion});
  return l;
}

}  // namespace porthos::test
