#pragma once
#include <memory>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "mechanics/constraints/projection.h"
#include "mechanics/mechanical_model.h"

/// Mechanisms with loops for tests. Their frames are not rotated, so they are exact in 113 bits.
namespace porthos::test {

using Vec = std::vector<double>;

/// A mechanism, what closes it, and a start on the manifold.
struct Linkage {
  std::shared_ptr<const mechanics::Mechanism> mechanism;
  mechanics::ConstraintSpec spec;
  Vec q, v;
  mechanics::MechanismBuilder parts = mechanics::MechanismBuilder("");  ///< of the mechanism

  mechanics::MechanicalModel model() const {
    return mechanics::MechanicalModel(mechanism, {}, spec);
  }
  /// The flat state on the manifold.
  std::vector<double> start() {
    const mechanics::ConstraintSet set(*mechanism, spec);
    mechanics::close_loops(*mechanism, set, q, v);
    return model().state(q, v);
  }
};

inline mechanics::LinkFrame at(const std::string& link, double x, double y, double z = 0) {
  return {link, {mechanics::Mat3<double>::identity(), {x, y, z}}};
}

/// A uniform rod along x of its frame, hinged about z.
inline mechanics::BodySpec rod(const std::string& name, const std::string& parent, double x,
                               double y, double length, double mass) {
  mechanics::BodySpec b;
  b.name = name;
  b.parent = parent;
  b.joint.name = name + "_joint";
  b.joint.type = "revolute";
  b.placement.r = {x, y, 0};
  const double I = mass * length * length / 12;
  b.mass = {mass, {length / 2, 0, 0}, {I / 4, 0, 0, I, 0, I}, mechanics::Mat3<double>::identity()};
  return b;
}

/// A crank-rocker in the plane z = 0 under gravity along -y: crank 0.5 m, coupler 1.5 m, rocker
/// 1.25 m, ground 1.5 m. type: of the loop joint between coupler and rocker ("revolute" has three
/// dependent rows here, "spherical" one).
inline Linkage four_bar(const std::string& type = "revolute", double gravity = -9.8125) {
  mechanics::MechanismBuilder b("four_bar");
  b.add(rod("crank", "world", 0, 0, 0.5, 1));
  b.add(rod("coupler", "crank", 0.5, 0, 1.5, 2));
  b.add(rod("rocker", "world", 1.5, 0, 1.25, 1.5));
  b.gravity({0, gravity, 0});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {1, -0.5, 2}, {3, 0, 0}, b};
  l.spec.loops.push_back({"pin", type, at("coupler", 1.5, 0), at("rocker", 1.25, 0)});
  return l;
}

/// N crank-rockers on the ground, each for itself.
inline Linkage four_bars(int N) {
  mechanics::MechanismBuilder b("four_bars");
  Linkage l;
  for (int i = 0; i < N; ++i) {
    const auto name = [&](const char* what) { return what + std::to_string(i); };
    b.add(rod(name("crank"), "world", 0, 0, 0.5, 1));
    b.add(rod(name("coupler"), name("crank"), 0.5, 0, 1.5, 2));
    b.add(rod(name("rocker"), "world", 1.5, 0, 1.25, 1.5));
    for (const double q : {1., -0.5, 2.}) l.q.push_back(q);
    for (const double v : {3., 0., 0.}) l.v.push_back(v);
    l.spec.loops.push_back(
        {name("pin"), "revolute", at(name("coupler"), 1.5, 0), at(name("rocker"), 1.25, 0)});
  }
  b.gravity({0, -9.8125, 0});
  l.mechanism = std::make_shared<mechanics::Mechanism>(b.build());
  l.parts = b;
  return l;
}

/// A free-floating base with two arms that hold each other: a loop with a ball joint, two
/// quaternions, 8 freedoms of 11. No position of it lies in a line (1 + 1.5 m against 1 + 1.25 m).
inline Linkage holding_arms() {
  mechanics::MechanismBuilder b("holding_arms");
  mechanics::BodySpec base;
  base.name = "base";
  base.parent = "world";
  base.joint.name = "base";
  base.joint.type = "free";
  base.mass = {4, {0, 0.125, 0}, {0.5, 0, 0, 0.75, 0, 1}, mechanics::Mat3<double>::identity()};
  b.add(base);
  auto shoulder = rod("upper", "base", -0.5, 0.5, 1.25, 1);
  shoulder.joint.type = "spherical";
  b.add(shoulder).add(rod("lower", "upper", 1.25, 0, 1, 0.5));
  b.add(rod("other", "base", 0.5, 0.5, 1.5, 1.25));
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {}, {}, b};
  l.q = l.mechanism->neutral();
  l.v = {0.3, -0.2, 0.4, 0.1, 0, -0.1, 0.5, 0.2, -0.3, 0.7, -0.6};
  const size_t elbow = size_t(l.mechanism->coordinate("lower_joint").q);
  l.q[elbow] = -1.5;
  l.q[elbow + 1] = 1;
  l.spec.loops.push_back({"grip", "spherical", at("lower", 1, 0), at("other", 1.5, 0)});
  return l;
}

/// IFToMM A02, N windows: N + 1 uprights on the ground and N rods on top of them, all 1 m, 1 kg,
/// with the tops' loops closed by pins. equal: with couplings that keep the uprights parallel,
/// which hold the branch where all rods lie in a line.
inline Linkage windows(int N, bool equal) {
  mechanics::MechanismBuilder b("windows");
  Linkage l;
  const auto name = [](const char* what, int i) { return what + std::to_string(i); };
  const auto add = [&](mechanics::BodySpec body, double angle, double rate) {
    b.add(std::move(body));
    l.q.push_back(angle);
    l.v.push_back(rate);
  };
  constexpr double up = 1.5707963267948966;
  for (int i = 0; i <= N; ++i) {
    add(rod(name("upright", i), "world", i, 0, 1, 1), up, -1);
    if (i == N) break;
    add(rod(name("top", i), name("upright", i), 1, 0, 1, 1), -up, 1);
    l.spec.loops.push_back(
        {name("pin", i), "revolute", at(name("top", i), 1, 0), at(name("upright", i + 1), 1, 0)});
    if (equal)
      l.spec.couplings.push_back(
          {name("parallel", i),
           {{name("upright", i) + "_joint", 1}, {name("upright", i + 1) + "_joint", -1}},
           0});
  }
  b.gravity({0, -9.81, 0});
  l.mechanism = std::make_shared<mechanics::Mechanism>(b.build());
  l.parts = b;
  return l;
}

/// A lattice of n × n square cells in the plane: bars of 1 m with hinges where they meet, the first
/// corner on the ground. All upright bars start to lean together.
inline Linkage lattice(int n) {
  mechanics::MechanismBuilder b("lattice");
  Linkage l;
  constexpr double quarter = 1.5707963267948966;
  const auto name = [](bool up, int i, int j) {
    return (up ? "up" : "along") + std::to_string(i) + "_" + std::to_string(j);
  };
  // A bar from node (i, j) hangs on the bar that leads there: along from the left, or the first up.
  const auto add = [&](bool up, int i, int j) {
    const bool first = i == 0 && j == 0, from_up = i == 0;
    b.add(rod(name(up, i, j),
              first     ? "world"
              : from_up ? name(true, i, j - 1)
                        : name(false, i - 1, j),
              first ? 0 : 1, 0, 1, 1));
    const bool parent_up = !first && from_up;
    l.q.push_back((up ? quarter : 0) - (parent_up ? quarter : 0));
    l.v.push_back((up ? 0.5 : 0) - (parent_up ? 0.5 : 0));
  };
  // Depth first, as the builder orders joints.
  const auto grow = [&](const auto& self, bool up, int i, int j) -> void {
    add(up, i, j);
    const int k = up ? i : i + 1, m = up ? j + 1 : j;
    if (up && i > 0) return;  // what starts there hangs on the bar from the left
    if (k < n) self(self, false, k, m);
    if (m < n) self(self, true, k, m);
  };
  grow(grow, false, 0, 0);
  grow(grow, true, 0, 0);
  for (int i = 1; i <= n; ++i)
    for (int j = 1; j <= n; ++j)
      l.spec.loops.push_back({"pin" + std::to_string(i) + "_" + std::to_string(j), "revolute",
                              at(name(false, i - 1, j), 1, 0), at(name(true, i, j - 1), 1, 0)});
  b.gravity({0, -1, 0});
  l.mechanism = std::make_shared<mechanics::Mechanism>(b.build());
  l.parts = b;
  return l;
}

/// A deployable boom of n scissors in the plane: two bars of 1 m cross in each, and their ends are
/// hinged to those of the next. It opens, and the first bar turns on the ground.
inline Linkage scissors(int n) {
  mechanics::MechanismBuilder b("scissors");
  Linkage l;
  constexpr double angle = 0.5, rate = 0.2;  // of the bars that rise
  const auto name = [](const char* what, int i) { return what + std::to_string(i); };
  for (int i = 0; i < n; ++i) {
    b.add(i == 0 ? rod(name("rises", i), "world", 0, 0, 1, 1)
                 : rod(name("rises", i), name("falls", i - 1), 0.5, 0, 1, 1));
    auto falls = rod(name("falls", i), name("rises", i), 0.5, 0, 1, 1);
    falls.mass.com = {0, 0, 0};  // it hangs on its middle
    b.add(falls);
    for (const double sign : {i == 0 ? 1. : 2., -2.}) {
      l.q.push_back(sign * angle);
      l.v.push_back(sign * rate);
    }
    if (i == 0) continue;
    l.spec.loops.push_back({name("pin", i), "revolute", at(name("rises", i - 1), 1, 0),
                            at(name("falls", i), -0.5, 0)});
  }
  b.gravity({0, -0.0625, 0});
  l.mechanism = std::make_shared<mechanics::Mechanism>(b.build());
  l.parts = b;
  return l;
}

/// IFToMM's Bricard mechanism: five rods along edges of a cube, six hinges, each normal to the two
/// edges that meet there. One freedom, though five links and six hinges count none: the five rows
/// of the last hinge have rank 4.
inline Linkage bricard() {
  using mechanics::Vec3d;
  const Vec3d along[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}};
  const Vec3d axis[] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mechanics::MechanismBuilder b("bricard");
  std::string parent = "world";
  Vec3d place{0, 0, 0};
  for (int i = 0; i < 5; ++i) {
    const Vec3d& u = along[i];
    auto body = rod("rod" + std::to_string(i), parent, 0, 0, 1, 1);
    body.placement.r = place;
    body.joint.axis = axis[i];
    const auto I = [](double c) { return 0x1p-10 + (1 - c * c) / 12; };
    body.mass = {
        1, 0.5 * u, {I(u.x), 0, 0, I(u.y), 0, I(u.z)}, mechanics::Mat3<double>::identity()};
    b.add(body);
    parent = body.name;
    place = u;
  }
  b.gravity({0, -9.8125, 0});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, Vec(5, 0.0), Vec(5, 0.0), b};
  // The axis of the last hinge is x: z of both frames.
  const mechanics::Mat3<double> R{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  l.spec.loops.push_back({"hinge5", "revolute", {"rod4", {R, along[4]}}, {"", {R, {0, 0, 1}}}});
  return l;
}

}  // namespace porthos::test
