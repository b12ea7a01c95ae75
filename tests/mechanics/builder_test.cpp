// MechanismBuilder: every refusal by its words, what is merged and remarked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "mechanics/builder.h"
#include "mechanics/crba.h"
#include "mechanics/joint_list.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "tests/mechanics/same.h"

namespace porthos::mechanics::builder_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
const Mat3<double> I3 = Mat3<double>::identity();

/// A sound body of 2 kg on a revolute joint about z.
BodySpec body(const std::string& name, const std::string& parent = "world",
              const std::string& type = "revolute") {
  BodySpec b;
  b.name = name;
  b.parent = parent;
  b.joint.type = type;
  b.mass = {2, {0.1, 0.2, 0.3}, {0.3, 0, 0, 0.4, 0, 0.5}};
  return b;
}
Mechanism build(const std::vector<BodySpec>& bodies) {
  MechanismBuilder b("test");
  for (const auto& s : bodies) b.add(s);
  return b.build();
}
std::string refusal(const std::vector<BodySpec>& bodies) {
  try {
    build(bodies);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "accepted";
}
/// The refusal of one body changed by `change`.
template <class F>
std::string refusal_of(F&& change) {
  BodySpec b = body("arm");
  change(b);
  return refusal({b});
}
BodySpec massless(BodySpec b) {
  b.mass = {};
  return b;
}

TEST(Builder, RefusesBadTrees) {
  EXPECT_EQ(refusal({}), "mechanism 'test' has no bodies");
  EXPECT_EQ(refusal({body("")}), "a body has no name");
  EXPECT_EQ(refusal({body("a"), body("a")}), "body 'a': there is already a body of this name");
  EXPECT_EQ(refusal({body("world")}),
            "body 'world': the name 'world' is taken by the inertial frame");
  EXPECT_EQ(refusal({body("a"), body("b", "c")}), "body 'b': its parent 'c' does not exist");
  EXPECT_EQ(refusal({body("a", "a")}),
            "body 'a': is part of a cycle of joints that never reaches the world");
  EXPECT_EQ(refusal({body("r"), body("a", "b"), body("b", "a")}),
            "body 'a': is part of a cycle of joints that never reaches the world");
  EXPECT_EQ(refusal({body("a", "world", "fixed"), body("b", "a", "fixed")}),
            "mechanism 'test' has no moving bodies: every joint is fixed");
  BodySpec a = body("a"), b = body("b", "a");
  a.joint.name = b.joint.name = "hinge";
  EXPECT_EQ(refusal({a, b}), "joint 'hinge': there is already a joint of this name");
  b = body("b", "a");
  b.joint.name = "a";
  EXPECT_EQ(refusal({body("a"), b}), "joint 'a': there is already a joint of this name")
      << "an unnamed joint has its body's name";
  MechanismBuilder g("test");
  EXPECT_THROW(g.add(body("a")).gravity({0, nan, 0}).build(), InvalidArgument);
}

TEST(Builder, RefusesBadMass) {
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.mass = -1; }),
            "body 'arm': mass is -1 kg, expected a number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.mass = nan; }),
            "body 'arm': mass is nan kg, expected a number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.mass = inf; }),
            "body 'arm': mass is inf kg, expected a number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.com.y = nan; }),
            "body 'arm': centre of mass is not finite");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.inertia.xz = inf; }),
            "body 'arm': inertia is not finite");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.mass = 0; }), "body 'arm': has inertia but no mass");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.inertia = {-0.25, 0, 0, 1, 0, 1}; }),
            "body 'arm': inertia is not positive: its smallest principal moment is -0.25 kg m^2");
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.inertia = {1, 0, 0, 1, 0, 2.5}; }),
            "body 'arm': inertia breaks the triangle inequality: principal moments 1, 1, 2.5 kg "
            "m^2, expected the largest <= the sum of the "
            "other two");
  // Products of inertia count: eigenvalues of [1 2 0; 2 1 0; 0 0 1] are -1, 1, 3.
  EXPECT_NE(refusal_of([](auto& b) {
              b.mass.inertia = {1, 2, 0, 1, 0, 1};
            }).find("inertia is not positive: its smallest principal moment is -1"),
            std::string::npos);
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.inertia = {1, 0, 0, 1, 0, 2}; }), "accepted")
      << "a flat body";
  EXPECT_EQ(refusal_of([](auto& b) { b.mass.inertia = {1, 0, 0, 1, 0, 2 + 1e-7}; }), "accepted")
      << "rounded digits";
}

TEST(Builder, RefusesBadJoints) {
  EXPECT_EQ(refusal_of([](auto& b) {
              b.joint.axis = {0, 0, 0};
            }),
            "joint 'arm': its axis is zero or not finite, expected a direction");
  EXPECT_EQ(refusal_of([](auto& b) {
              b.joint.axis = {nan, 0, 1};
              b.joint.name = "j";
            }),
            "joint 'j': its axis is zero or not finite, expected a direction");
  const auto universal = [](auto second) {
    return [=](auto& b) {
      b.joint.type = "universal";
      b.joint.second_axis = second;
    };
  };
  EXPECT_EQ(refusal_of(universal(Vec3d{0, 0, -3})),
            "joint 'arm': its two axes are parallel, expected different directions");
  EXPECT_EQ(refusal_of(universal(Vec3d{0, 0, 0})),
            "joint 'arm': its axis is zero or not finite, expected a direction");
  EXPECT_EQ(refusal_of(universal(Vec3d{1, 0, 1})), "accepted");
  const auto unknown = refusal_of([](auto& b) { b.joint.type = "ball"; });
  EXPECT_TRUE(unknown.starts_with(
      "joint 'arm': unknown type 'ball', expected one of revolute, prismatic, helical, "))
      << unknown;
  for (const auto& type : joint_type_names()) EXPECT_NE(unknown.find(type), std::string::npos);
  EXPECT_EQ(refusal_of([](auto& b) {
              b.joint.type = "helical";
              b.joint.pitch = inf;
            }),
            "joint 'arm': its pitch is not finite");
  EXPECT_EQ(refusal_of([](auto& b) { b.joint.damping = -0.5; }),
            "joint 'arm': damping is -0.5, expected a finite number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.joint.damping = nan; }),
            "joint 'arm': damping is nan, expected a finite number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.joint.stiffness = -2; }),
            "joint 'arm': stiffness is -2, expected a finite number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) { b.joint.friction = -1; }),
            "joint 'arm': friction is -1, expected a finite number >= 0");
  for (const std::string type : {"cylindrical", "spherical", "free", "universal", "planar"}) {
    const std::string expected =
        "joint 'arm': damping and stiffness need a joint of one degree of freedom, '" + type +
        "' has several";
    EXPECT_EQ(refusal_of([&](auto& b) {
                b.joint.type = type;
                b.joint.damping = 1;
              }),
              expected);
    EXPECT_EQ(refusal_of([&](auto& b) {
                b.joint.type = type;
                b.joint.stiffness = 1;
              }),
              expected);
  }
  for (const std::string type : {"revolute", "continuous", "prismatic", "helical"})
    EXPECT_EQ(refusal_of([&](auto& b) {
                b.joint.type = type;
                b.joint.damping = 1;
              }),
              "accepted");
}

TEST(Builder, RefusesWhatMovesNoInertia) {
  const std::string reason =
      " moves no inertia: the bodies beyond it are massless about it, expected mass properties for "
      "them or the joint locked";
  EXPECT_EQ(refusal({massless(body("a"))}), "joint 'a'" + reason);
  BodySpec b = massless(body("b", "a"));
  b.joint.name = "wrist";
  EXPECT_EQ(refusal({body("a"), b}), "joint 'wrist'" + reason);
  EXPECT_EQ(refusal({massless(body("a")), massless(body("b", "a", "fixed"))}),
            "joint 'a'" + reason);
  EXPECT_EQ(refusal({massless(body("a")), body("b", "a")}), "joint 'a'" + reason)
      << "a second joint on the same axis takes it all";
  EXPECT_EQ(refusal({massless(body("a")), body("b", "a", "fixed")}), "accepted");
  b = body("b", "a");
  b.joint.axis = {1, 0, 0};
  EXPECT_EQ(refusal({massless(body("a")), b}), "accepted") << "a massless gimbal";
  b = body("point");
  b.mass.inertia = {0, 0, 0, 0, 0, 0};
  EXPECT_EQ(refusal({b}), "accepted") << "a point mass off the axis";
  b.mass.com = {0, 0, 0.3};
  EXPECT_EQ(refusal({b}), "joint 'point'" + reason) << "a point mass on the axis";
  b.mass.com = {0.1, 0.2, 0.3};
  b.joint.type = "spherical";
  EXPECT_EQ(refusal({b}), "joint 'point'" + reason) << "it spins about its arm";
}

TEST(Builder, SaysWhere) {
  EXPECT_EQ(refusal_of([](auto& b) {
              b.where = "robot.urdf:12";
              b.mass.mass = -1;
            }),
            "robot.urdf:12: body 'arm': mass is -1 kg, expected a number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) {
              b.where = "robot.urdf:12";
              b.joint.damping = -1;
            }),
            "robot.urdf:12: joint 'arm': damping is -1, expected a finite number >= 0");
  EXPECT_EQ(refusal_of([](auto& b) {
              b.where = "robot.urdf:12";
              b.joint.where = "robot.urdf:40";
              b.joint.damping = -1;
            }),
            "robot.urdf:40: joint 'arm': damping is -1, expected a finite number >= 0");
}

TEST(Builder, AcceptsUnphysicalInertiaOnDemand) {
  BodySpec b = body("arm");
  b.where = "robot.urdf:7";
  b.mass.inertia = {1, 0, 0, 1, 0, 2.5};
  MechanismBuilder builder("test");
  const auto m = builder.add(b).accept_unphysical_inertia(true).build();
  ASSERT_EQ(m.remarks().size(), 1u);
  EXPECT_EQ(m.remarks()[0].where, "robot.urdf:7");
  EXPECT_EQ(m.remarks()[0].text,
            "body 'arm': inertia breaks the triangle inequality: principal moments 1, 1, 2.5 kg "
            "m^2, expected the largest <= the "
            "sum of the other two; tolerated because unphysical inertias were accepted");
  EXPECT_THROW(builder.accept_unphysical_inertia(false).build(), InvalidArgument);
  MechanismBuilder negative("test");
  b.mass.inertia = {-1, 0, 0, 1, 0, 1};
  EXPECT_THROW(negative.add(b).accept_unphysical_inertia(true).build(), InvalidArgument)
      << "a negative moment stays refused";
}

TEST(Builder, RemarksFaultyLinksMergedIntoSoundBodies) {
  BodySpec cover = body("cover", "arm", "fixed"), tag = body("tag", "arm", "fixed");
  cover.where = "robot.urdf:30";
  cover.mass = {0.01, {0, 0, 0}, {1e-6, 0, 0, 1e-6, 0, 1e-5}};
  tag.mass = {0, {0, 0, 0}, {1e-6, 0, 0, 1e-6, 0, 1e-6}};
  const auto m = build({body("arm"), cover, tag});
  ASSERT_EQ(m.remarks().size(), 2u);
  EXPECT_EQ(m.remarks()[0].where, "robot.urdf:30");
  EXPECT_EQ(m.remarks()[0].text,
            "body 'cover': inertia breaks the triangle inequality: principal moments 1e-06, 1e-06, "
            "1e-05 kg m^2, expected the "
            "largest <= the sum of the other two; tolerated because the moving body it is fixed to "
            "is sound as a whole");
  EXPECT_EQ(m.remarks()[1].text,
            "body 'tag': has inertia but no mass; tolerated because the moving body it is fixed to "
            "is sound as a whole");
  EXPECT_TRUE(build({body("arm")}).remarks().empty());
  cover.mass.inertia = {-10, 0, 0, 1e-6, 0, 1e-6};
  EXPECT_NE(
      refusal({body("arm"), cover}).find("robot.urdf:30: body 'cover': inertia is not positive"),
      std::string::npos)
      << "where the whole is unsound the faulty link is named";
}

// --- what is built -------------------------------------------------------------------------------

TEST(Builder, MergesFixedJoints) {
  const Mat3<double> quarter{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};  // about z
  BodySpec arm = body("arm"), box = body("box", "arm", "fixed"),
           lamp = body("lamp", "box", "fixed"), floor = body("floor", "world", "fixed");
  arm.parent = "floor";
  arm.placement.r = {0, 0, 1};
  floor.placement = {quarter, {5, 0, 0}};
  box.placement = {quarter, {1, 0, 0}};
  lamp.placement = {quarter, {0, 2, 0}};
  lamp.mass = {0.5, {0, 0, 1}, {0, 0, 0, 0, 0, 0}};
  const auto m = build({arm, box, lamp, floor});
  EXPECT_EQ(m.body_count(), 1);
  EXPECT_EQ(m.nv(), 1);
  EXPECT_EQ(m.total_mass(), 4.5) << "what is fixed to the world does not count";
  EXPECT_EQ(m.bodies().size(), 4u);
  EXPECT_EQ(m.body("floor").node, -1);
  expect_same(m.body("floor").pose.r, {5, 0, 0}, "floor");
  EXPECT_EQ(m.body("lamp").node, 0);
  expect_same(m.body("arm").pose.r, {0, 0, 0}, "arm");
  expect_same(m.body("arm").pose.R, I3, "arm");
  expect_same(m.body("box").pose.r, {1, 0, 0}, "box");
  expect_same(m.body("box").pose.R, quarter, "box");
  expect_same(m.body("lamp").pose.r, {-1, 0, 0}, "lamp");
  expect_same(m.body("lamp").pose.R, quarter * quarter, "lamp");
  expect_same(m.nodes()[0].placement.r, {5, 0, 1}, "joint");
  expect_same(m.nodes()[0].placement.R, quarter, "joint");
  // First moments: 2 (0.1, 0.2, 0.3) + 2 (1 - 0.2, 0.1, 0.3) + 0.5 (-1, 0, 1).
  const auto& I = m.nodes()[0].inertia;
  EXPECT_NEAR(norm(I.mc - Vec3d{1.3, 0.6, 1.7}), 0, 1e-15);
  // About z: 0.5 + 2·0.05 (arm), 0.5 + 2·(0.8² + 0.1²) (box, Izz unturned), 0.5·1 (lamp).
  EXPECT_NEAR(I.I.zz, 0.6 + 1.8 + 0.5, 1e-15);
  // About x: 0.3 + 2·0.13 (arm), 0.4 + 2·(0.1² + 0.3²) (box, turned: its Iyy), 0.5·1 (lamp).
  EXPECT_NEAR(I.I.xx, 0.56 + 0.6 + 0.5, 1e-15);
}

TEST(Builder, ForestMomentumIsTheSum) {
  BodySpec a = body("a", "world", "free"), b = body("b", "world", "free");
  b.placement = {rotation_from_rpy(0.3, -0.2, 0.7), {1, -2, 0.5}};
  b.mass.mass = 3;
  const auto both = build({a, b});
  EXPECT_EQ(both.body_count(), 2);
  EXPECT_EQ(both.nv(), 12);
  EXPECT_EQ(both.total_mass(), 5);
  EXPECT_EQ(both.nodes()[1].parent, -1);
  EXPECT_EQ(both.coordinates()[0].name, "a.position");
  EXPECT_EQ(both.coordinate("b.attitude").q, 10);
  std::vector<double> q, v;
  Momentum<double> sum{{0, 0, 0}, {0, 0, 0}};
  for (const auto& one : {build({a}), build({b})}) {
    const double k = q.empty() ? 1 : -0.7;
    const std::vector<double> qi{0.4 * k, 1.1, -0.6 * k, 0.8, 0.36 * k, -0.48, 0},
        vi{0.3, -0.2 * k, 0.5, 1.5 * k, -1, 0.25 * k};
    Workspace<double> w(one);
    std::vector<double> p(7);
    momenta_from_rates<double>(one, w, qi, vi, p);
    const auto h = momentum<double>(one, w, qi, p);
    // by hand: m v_c, and R I ω + c × m v_c, with c and v_c of the centre of mass
    const auto& I = one.nodes()[0].inertia;
    const auto& P = one.nodes()[0].placement;
    const Mat3<double> R = P.R * rotation_matrix(Quaternion<double>::load(&qi[3]));
    const Vec3d omega{vi[0], vi[1], vi[2]}, c0 = (1 / I.m) * I.mc,
                                            c = P.r + P.R * Vec3d{qi[0], qi[1], qi[2]} + R * c0;
    const Vec3d l = I.m * (R * (Vec3d{vi[3], vi[4], vi[5]} + cross(omega, c0)));
    const Vec3d spin = R * Vec3d{0.3 * omega.x, 0.4 * omega.y, 0.5 * omega.z};
    EXPECT_LE(norm(h.linear - l), 1e-14);
    EXPECT_LE(norm(h.angular - (spin + cross(c, l))), 1e-14);
    sum.linear += h.linear;
    sum.angular += h.angular;
    q.insert(q.end(), qi.begin(), qi.end());
    v.insert(v.end(), vi.begin(), vi.end());
  }
  Workspace<double> w(both);
  std::vector<double> p(14);
  momenta_from_rates<double>(both, w, q, v, p);
  const auto h = momentum<double>(both, w, q, p);
  EXPECT_LE(norm(h.linear - sum.linear), 1e-15 * norm(sum.linear));
  EXPECT_LE(norm(h.angular - sum.angular), 1e-15 * norm(sum.angular));
  EXPECT_GT(norm(sum.angular), 1);
}

/// The mass matrix at a configuration that depends on the coordinates' names alone.
std::vector<double> mass_matrix(const Mechanism& m, const std::vector<std::string>& order) {
  Workspace<double> w(m);
  std::vector<double> q = m.neutral(), M(size_t(m.nv() * m.nv())), sorted;
  for (const auto& c : m.coordinates()) q[size_t(c.q)] = 0.1 * double(c.name[0] - 'a' + 1);
  crba<double>(m, w, q, M);
  for (const auto& r : order)
    for (const auto& c : order)
      sorted.push_back(M[size_t(m.coordinate(r).v + m.nv() * m.coordinate(c).v)]);
  return sorted;
}

TEST(Builder, OrderOfAddingDoesNotMatter) {
  BodySpec a = body("a"), b = body("b", "a"), c = body("c", "b", "prismatic"), d = body("d", "a"),
           e = body("e", "d");
  b.placement.r = d.placement.r = {0.5, 0.1, 0};
  e.placement.r = {0, 0.5, 0.2};
  e.mass.mass = 7;
  b.joint.axis = {1, 0, 0};
  c.joint.axis = {0.6, 0, 0.8};
  d.joint.axis = {0, 1, 0};
  e.joint.axis = {1, 1, 1};
  const std::vector<std::string> names{"a", "b", "c", "d", "e"};
  const auto m = build({a, b, c, d, e});
  const auto expected = mass_matrix(m, names);
  // children before parents, siblings in the same order: the same numbering and the same bits
  const auto same_order = build({c, e, b, d, a});
  for (const auto& n : names) EXPECT_EQ(m.coordinate(n).v, same_order.coordinate(n).v) << n;
  EXPECT_EQ(mass_matrix(same_order, names), expected);
  // siblings exchanged: other numbers for the joints, the same mechanism up to the order of its
  // sums
  const auto other = build({e, d, c, b, a});
  EXPECT_NE(m.coordinate("b").v, other.coordinate("b").v);
  EXPECT_EQ(other.total_mass(), m.total_mass());
  const auto M = mass_matrix(other, names);
  for (size_t i = 0; i < M.size(); ++i) EXPECT_NEAR(M[i], expected[i], 1e-14);
}

TEST(Mechanism, LooksUpByName) {
  BodySpec b = body("b", "a");
  b.joint.name = "elbow";
  const auto m = build({body("a"), b, body("c", "b", "universal")});
  EXPECT_EQ(m.coordinate("elbow").v, 1);
  EXPECT_EQ(m.coordinate("elbow").joint, "elbow");
  EXPECT_EQ(m.coordinate("c.second").joint, "c");
  EXPECT_EQ(m.body("b").node, 1);
  const auto message = [](auto&& call) {
    try {
      call();
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message([&] { (void)m.coordinate("knee"); }),
            "there is no joint coordinate 'knee', expected one of a, elbow, c.first, c.second");
  EXPECT_EQ(message([&] { (void)m.body("leg"); }),
            "there is no body 'leg', expected one of a, b, c");
}

TEST(Mechanism, KeepsJointProperties) {
  BodySpec a = body("a"), b = body("b", "a", "prismatic");
  a.joint.damping = 0.5;
  a.joint.stiffness = 3;
  a.joint.rest = 0.1;
  b.joint.friction = 2;
  b.joint.upper = 1.5;
  const auto m = build({a, b, body("c", "b")});
  ASSERT_EQ(m.joint_properties().size(), 2u) << "none of a plain joint";
  const auto &p = m.joint_properties()[0], &s = m.joint_properties()[1];
  EXPECT_TRUE(p.joint == "a" && p.damping == 0.5 && p.stiffness == 3 && p.rest == 0.1 &&
              p.turn == 0 && !p.upper);
  EXPECT_TRUE(s.joint == "b" && s.friction == 2 && s.upper == 1.5 && s.turn == -1 && s.v == 1)
      << "a translation does not turn";
}

}  // namespace
}  // namespace porthos::mechanics::builder_test
