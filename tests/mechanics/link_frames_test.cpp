// The frames that the builder chooses for the links: transforms by screws, and nothing that a user
// sees moves.
#include "mechanics/detail/link_frames.h"

#include <gtest/gtest.h>

#include "mechanics/kinematics.h"
#include "mechanics/urdf.h"
#include "tests/support/bounds.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::link_frames_test {
namespace {

using Turn = FixedScrew::Turn;

Mechanism robot(const std::string& file, bool free_base) {
  UrdfOptions o;
  o.base = free_base ? UrdfOptions::Base::free : UrdfOptions::Base::fixed;
  return read_urdf(PORTHOS_SOURCE_DIR "/tests/data/reference/pinocchio/urdf/" + file, o).mechanism;
}

TEST(LinkFrames, EveryJointOfAnArmIsTwoScrews) {
  for (const bool free_base : {false, true}) {
    const auto arm = robot("panda7.urdf", free_base);
    for (size_t i = 1; i < arm.nodes().size(); ++i) {
      const Node& n = arm.nodes()[i];
      EXPECT_TRUE(n.axial) << i;
      EXPECT_NE(n.tilt.turn, Turn::any) << i << ": this arm has right angles only";
      const bool chained = n.parent > 0 || !free_base;
      EXPECT_TRUE(!chained || n.before.is_identity()) << i;
    }
  }
}
TEST(LinkFrames, AtABranchOneChildDecides) {
  const auto dog = robot("hyq.urdf", true);
  int axial = 0, chained = 0;
  for (const Node& n : dog.nodes()) {
    axial += n.axial;
    chained += n.axial && n.before.is_identity();
  }
  EXPECT_EQ(axial, 12);
  EXPECT_GE(chained, 8) << "two joints of each leg";
}

/// A right angle written with twelve digits is not one: its cosine counts, though its sine is 1.
TEST(LinkFrames, OnlyExactRightAnglesAreTakenAsSuch) {
  EXPECT_EQ(FixedScrew(Screw<double>{0, 1, 0.1}).turn, Turn::right);
  EXPECT_EQ(FixedScrew(Screw<double>{0, -1, 0.1}).turn, Turn::left);
  EXPECT_EQ(FixedScrew(Screw<double>{4.9e-12, 1, 0.1}).turn, Turn::any);
  EXPECT_EQ(FixedScrew(Screw<double>{1, 0, 0.1}).turn, Turn::none);
  EXPECT_EQ(FixedScrew(Screw<double>{1, 4.9e-12, 0.1}).turn, Turn::any);
}

MechanismBuilder two_links(const Pose& second) {
  MechanismBuilder b;
  for (const char* name : {"first", "second"}) {
    BodySpec s;
    s.name = name;
    s.parent = b.bodies().empty() ? "world" : "first";
    s.joint.type = "revolute";
    if (!b.bodies().empty()) s.placement = second;
    s.mass = {2, {0.1, 0.2, 0.3}, {1, 0, 0, 1.1, 0, 1.2}};
    b.add(s);
  }
  return b;
}
TEST(LinkFrames, NearlyParallelAxesKeepTheirMatrix) {
  const Vec3d r{0.3, 0.4, 0.1};
  EXPECT_TRUE(two_links({rotation_from_rpy(0, 0, 0.7), r}).build().nodes()[1].axial);
  EXPECT_TRUE(two_links({rotation_from_rpy(0.5, 0, 0.7), r}).build().nodes()[1].axial);
  // The common normal would be 10 km away.
  EXPECT_FALSE(two_links({rotation_from_rpy(4e-5, 0, 0.7), r}).build().nodes()[1].axial);
}
TEST(LinkFrames, TheUsersFramesStay) {
  double worst = 0;
  for (int seed = 0; seed < 50; ++seed) {
    test::RandomTree random{std::uint64_t(seed)};
    const Pose second = random.pose();
    const auto b = two_links(second);
    const auto m = b.build();
    Workspace<double> w(m);
    std::vector<Pose> nodes(m.nodes().size());
    forward_kinematics<double>(m, w, m.neutral(), nodes);
    const Pose body = body_pose<double>(m, m.body("second"), nodes);
    worst = std::max({worst, norm(body.r - second.r), norm(body.R.x - second.R.x),
                      norm(body.R.y - second.R.y), norm(body.R.z - second.R.z)});
  }
  test::keeps("a body's pose at q = 0 against its placement", worst, 1e-14);
}
/// The control: a link's frame that moved without its inertia would be another mechanism.
TEST(LinkFrames, InertiasMoveWithTheirFrames) {
  const auto m = two_links({rotation_from_rpy(0.5, 0.3, 0.7), {0.3, 0.4, 0.1}}).build();
  const Node& n = m.nodes()[1];
  const Pose& user = m.body("second").pose;  // the user's frame in the chosen one
  const Vec3d mc = 2.0 * (user.R * Vec3d{0.1, 0.2, 0.3} + user.r);
  test::keeps("first moment in the chosen frame", norm(n.inertia.mc - mc), 1e-15);
  EXPECT_GT(norm(n.inertia.mc - 2.0 * Vec3d{0.1, 0.2, 0.3}), 0.1);
}

}  // namespace
}  // namespace porthos::mechanics::link_frames_test
