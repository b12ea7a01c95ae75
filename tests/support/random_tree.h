#pragma once
#include <memory>
#include <random>
#include <string>

#include "mechanics/builder.h"
#include "mechanics/joint_list.h"

/// Seeded random mechanisms with every joint type, for property tests.
namespace porthos::test {

class RandomTree {
 public:
  explicit RandomTree(std::uint64_t seed) : rng_(seed) {}

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(rng_); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(rng_); }
  mechanics::Vec3d vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }

  /// Rotor inertias of the joints of one freedom: up to this. No random number is drawn for them,
  /// so that the same seed gives the same tree without rotors.
  double rotor = 0;
  /// Frames without rotation: exactly orthonormal in every scalar.
  bool aligned = false;

  mechanics::Pose pose(double reach = 0.5) {
    if (aligned) return {mechanics::Mat3<double>::identity(), vector(reach)};
    return {mechanics::rotation_from_rpy(uniform(-3, 3), uniform(-1.5, 1.5), uniform(-3, 3)),
            vector(reach)};
  }
  /// A box of random sides and density: always physical.
  mechanics::MassProperties mass() {
    const double m = uniform(0.5, 5), a = uniform(0.1, 0.6), b = uniform(0.1, 0.6),
                 c = uniform(0.1, 0.6);
    const double k = m / 12;
    return {m,
            vector(0.3),
            {k * (b * b + c * c), 0, 0, k * (a * a + c * c), 0, k * (a * a + b * b)},
            pose().R};
  }
  mechanics::BodySpec body(int i, const std::string& parent, const std::string& type) {
    mechanics::BodySpec b;
    b.name = "body_" + std::to_string(i);
    b.parent = parent;
    b.joint.name = "joint_" + std::to_string(i);
    b.joint.type = type;
    b.joint.axis = aligned ? mechanics::Vec3d{0, 0, 1} : vector(1);
    b.joint.pitch = uniform(-0.3, 0.3);
    if (rotor > 0 && mechanics::freedoms(type) == 1)
      b.joint.rotor_inertia = rotor * (1 + i % 3) / 3;
    // a second axis at least 45 degrees off the first: nearly parallel ones make M nearly singular
    const auto first = b.joint.axis;
    do b.joint.second_axis = aligned ? mechanics::Vec3d{1, 0, 0} : vector(1);
    while (dot(*b.joint.second_axis, first) * dot(*b.joint.second_axis, first) >
           0.5 * dot(first, first) * dot(*b.joint.second_axis, *b.joint.second_axis));
    b.placement = pose();
    b.mass = mass();
    return b;
  }
  /// `root` names the type of the first joint, `only` that of all others ("" = any moving type).
  std::shared_ptr<const mechanics::Mechanism> tree(int bodies, const std::string& root,
                                                   const std::string& only = "",
                                                   mechanics::Vec3d gravity = {0, 0, -9.81}) {
    mechanics::MechanismBuilder builder("random");
    const auto types = mechanics::joint_type_names();
    for (int i = 0; i < bodies; ++i) {
      const std::string parent =
          i == 0 ? "world" : "body_" + std::to_string(std::max(0, i - 1 - below(std::min(i, 4))));
      std::string type = i == 0         ? root
                         : only.empty() ? types[size_t(below(int(types.size())))]
                                        : only;
      builder.add(body(i, parent, type));
    }
    return std::make_shared<mechanics::Mechanism>(builder.gravity(gravity).build());
  }

  /// A random configuration with unit quaternions.
  std::vector<double> q(const mechanics::Mechanism& m) {
    std::vector<double> q(size_t(m.nq()));
    for (auto& x : q) x = uniform(-1.5, 1.5);
    for (const auto& c : m.coordinates())
      if (c.kind == phs::BlockKind::rotation) {
        double n = 0;
        for (int k = 0; k < 4; ++k) n += q[size_t(c.q + k)] * q[size_t(c.q + k)];
        for (int k = 0; k < 4; ++k) q[size_t(c.q + k)] /= std::sqrt(n);
      }
    return q;
  }
  std::vector<double> numbers(int n, double size = 1) {
    std::vector<double> v(static_cast<size_t>(n));
    for (auto& x : v) x = uniform(-size, size);
    return v;
  }

 private:
  std::mt19937_64 rng_;
};

}  // namespace porthos::test
