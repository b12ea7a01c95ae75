// What files of public collections have and every robot tool accepts: taken, and noted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mechanics/momentum.h"
#include "tests/urdf/robots.h"

namespace porthos::mechanics::urdf_real_models_test {
namespace {

std::vector<std::string> notes_of(const UrdfResult& r) {
  std::vector<std::string> notes;
  for (const auto& n : r.notes) notes.push_back(n.where + ": " + n.text);
  for (const auto& n : r.mechanism.remarks()) notes.push_back(n.where + ": " + n.text);
  return notes;
}
std::string refusal(const std::string& text, const Options& o = {}) {
  try {
    parse(text, o);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "(accepted)";
}
std::string body(const std::string& mass, const std::string& xx, const std::string& yy,
                 const std::string& zz) {
  return "<inertial><mass value='" + mass + "'/><inertia ixx='" + xx + "' iyy='" + yy + "' izz='" +
         zz + "' ixy='0' ixz='0' iyz='0'/></inertial>";
}

TEST(UrdfRealModels, ALowerLimitAboveTheUpperOneIsNone) {
  const auto r = parse(arm("revolute", "<limit lower='1' upper='-1'/>"));
  EXPECT_EQ(notes_of(r), Names{"r.urdf:4: joint 'j': its lower limit 1 is above the upper one, -1: "
                               "taken as no limit"});
  EXPECT_TRUE(r.mechanism.joint_properties().empty());
  // The right way round they are limits.
  const auto limited = parse(arm("revolute", "<limit lower='-1' upper='1'/>"));
  EXPECT_EQ(limited.mechanism.joint_properties().at(0).upper, 1);
}

TEST(UrdfRealModels, AParentWorldNeedNotBeDeclared) {
  const std::string text =
      robot({link("a"), link("b"), joint("w", "world", "a", "fixed"), joint("j", "a", "b")});
  const auto r = parse(text);
  EXPECT_EQ(notes_of(r), Names{"r.urdf:4: joint 'w': its parent 'world' is not a link of this "
                               "file, taken as the inertial frame"});
  EXPECT_EQ(r.mechanism.nv(), 1);
  EXPECT_EQ(refusal(text, free_base),
            "r.urdf:4: link 'world' is the inertial frame, expected another name for the root of a "
            "free base");
  EXPECT_EQ(refusal(robot({link("a"), link("b"), joint("j", "earth", "a")})),
            "r.urdf:4: joint 'j': its parent 'earth' is not a link of this file");
}

TEST(UrdfRealModels, ARobotWithoutANameIsCalledLikeItsFile) {
  for (const std::string name : {"", " name=''"}) {
    const auto r = parse_urdf(
        "<robot" + name + ">\n" + link("a") + link("b") + joint("j", "a", "b") + "</robot>",
        "some/where/gripper.urdf");
    EXPECT_EQ(r.mechanism.name(), "gripper");
    EXPECT_EQ(notes_of(r), Names{"some/where/gripper.urdf:1: <robot> has no name, called like its "
                                 "file: 'gripper'"});
  }
}

TEST(UrdfRealModels, APrincipalMomentBelowZeroByRoundingIsZero) {
  const auto r = parse(arm_link(body("0.1", "1e-19", "-5e-20", "1e-19")), free_base);
  ASSERT_EQ(notes_of(r).size(), 1u);
  EXPECT_EQ(notes_of(r)[0],
            "r.urdf:3: body 'arm': its principal moment -5e-20 kg m^2 is below zero "
            "by rounding, taken as zero");
  const auto& I = r.mechanism.nodes().back().inertia.I;
  EXPECT_GE(std::min({I.xx, I.yy, I.zz}), 0);
  // Beside larger moments a relative 1e-12 is rounding as well, 1e-3 is not.
  EXPECT_EQ(notes_of(parse(arm_link(body("1", "1", "-1e-12", "1")))).size(), 1u);
  EXPECT_NE(refusal(arm_link(body("1", "1", "-1e-3", "1"))).find("inertia is not positive"),
            std::string::npos);
  EXPECT_NE(refusal(arm_link(body("1", "-1e-12", "-1e-12", "-1e-12"))).find("is not positive"),
            std::string::npos);
}

TEST(UrdfRealModels, LinksOfNoMassOnFixedJointsAreFrames) {
  // The root of a free base too, whose mass hangs on it by a fixed joint.
  const std::string text =
      robot({link("base_link", ""), link("trunk"), link("arm"),
             joint("f", "base_link", "trunk", "fixed"), joint("j", "trunk", "arm")});
  const auto r = parse(text, free_base);
  EXPECT_EQ(notes_of(r),
            Names{"r.urdf:2: links without <inertial> on fixed joints, taken as frames: "
                  "'base_link'"});
  EXPECT_EQ(r.mechanism.total_mass(), 4);
  // What moves by itself is none.
  EXPECT_NE(refusal(robot({link("a"), link("b", ""), joint("j", "a", "b")})).find("moves on joint"),
            std::string::npos);
}

/// A locked joint gives the mechanism that the file would with a fixed joint there.
TEST(UrdfRealModels, LockedJointsAreFixedWhereTheyStart) {
  const auto hand = [](const std::string& joint_text) {
    return robot({link("a"), link("b"), link("tip"), joint("j", "a", "b"), joint_text});
  };
  const std::string axis = "<axis xyz='0 0 2'/>", origin = "<origin xyz='0.1 0.2 0.3'/>";
  Options o;
  o.locked = {"k"};
  o.locked_at["k"] = {0.5};
  const auto same = [&](const std::string& moving, const std::string& fixed, const Options& how) {
    const auto a = parse(hand(moving), how).mechanism, b = parse(hand(fixed)).mechanism;
    ASSERT_EQ(a.nv(), 1);
    const Pose p = a.body("tip").pose, q = b.body("tip").pose;
    EXPECT_LT(norm(p.r - q.r), 1e-15);
    EXPECT_LT(norm(p.R.x - q.R.x) + norm(p.R.y - q.R.y) + norm(p.R.z - q.R.z), 1e-15);
  };
  same(joint("k", "b", "tip", "revolute", origin + axis),
       joint("k", "b", "tip", "fixed", "<origin xyz='0.1 0.2 0.3' rpy='0 0 0.5'/>"), o);
  same(joint("k", "b", "tip", "prismatic", origin + axis),
       joint("k", "b", "tip", "fixed", "<origin xyz='0.1 0.2 0.8'/>"), o);
  Options ball;
  ball.locked = {"k"};
  ball.locked_at["k"] = {std::cos(0.25), 0, 0, std::sin(0.25)};
  same(joint("k", "b", "tip", "spherical", origin),
       joint("k", "b", "tip", "fixed", "<origin xyz='0.1 0.2 0.3' rpy='0 0 0.5'/>"), ball);

  o.locked_at.clear();
  o.locked = {"elbow"};
  const std::string text = hand(joint("k", "b", "tip", "fixed"));
  EXPECT_EQ(refusal(text, o), "r.urdf: lock: 'elbow' is not a joint of this file");
  o.locked = {"k"};
  EXPECT_EQ(refusal(text, o),
            "r.urdf:6: joint 'k': is to be locked but cannot move, expected a "
            "joint that is not fixed");
  o.locked = {"j"};
  o.locked_at["j.x"] = {1};
  EXPECT_EQ(refusal(text, o), "r.urdf: lock: 'j.x' is not a coordinate of a locked joint");
}

/// The value of a locked joint is a constant of its <mimic>, which holds the other joint.
TEST(UrdfRealModels, AMimicKeepsWhatALockLeavesOfIt) {
  const std::string text =
      robot({link("a"), link("b"), link("tip"), link("end"), joint("j", "a", "b"),
             joint("m", "tip", "end"),
             joint("k", "b", "tip", "revolute", "<mimic joint='j' multiplier='2' offset='0.5'/>")});
  Options o;
  o.couple_mimics = true;
  ASSERT_EQ(parse(text, o).mimics.size(), 1u);
  EXPECT_EQ(parse(text, o).mimics[0].terms.size(), 2u);
  o.locked = {"j"};
  o.locked_at["j"] = {0.25};
  const auto one = parse(text, o).mimics;
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(one[0].terms.size(), 1u);
  EXPECT_EQ(one[0].terms[0].coordinate, "k");
  EXPECT_EQ(one[0].offset, 1);  // k = 2 j + 0.5
  o.locked = {"k"};
  o.locked_at = {{"k", {1}}};
  const auto other = parse(text, o).mimics;
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(other[0].terms[0].coordinate, "j");
  EXPECT_EQ(other[0].offset, -0.5);  // -2 j = 0.5 - k
  o.locked = {"j", "k"};
  EXPECT_TRUE(parse(text, o).mimics.empty());
}

TEST(UrdfRealModels, AMasslessFingerIsSavedByItsLock) {
  const std::string text = robot({link("a"), link("b"), link("finger", ""), joint("j", "a", "b"),
                                  joint("g", "b", "finger", "prismatic")});
  try {
    parse(text);
    FAIL() << "accepted";
  } catch (const MasslessPart& e) {
    EXPECT_EQ(e.joint, "g");
    EXPECT_EQ(e.links, Names{"finger"});
  }
  Options o;
  o.locked = {"g"};
  EXPECT_EQ(parse(text, o).mechanism.nv(), 1);
  // A mass of zero in the file may be given one, any other not.
  Options given;
  given.link_inertia["finger"] = {1, {0, 0, 0}, {1, 0, 0, 1, 0, 1}, Mat3<double>::identity()};
  const std::string zero = robot({link("a"), link("b"), link("finger", body("0", "0", "0", "0")),
                                  joint("j", "a", "b"), joint("g", "b", "finger", "prismatic")});
  EXPECT_EQ(parse(zero, given).mechanism.nv(), 2);
}

/// Two axes that meet in a line at zero: singular there and sound elsewhere.
TEST(UrdfRealModels, AWristThatIsSingularAtZeroAloneIsTaken) {
  const std::string text =
      robot({link("a"), link("b", ""), link("c", ""), link("d", body("1", "0", "0", "0")),
             joint("j1", "a", "b", "revolute", "<axis xyz='0 0 1'/>"),
             joint("j2", "b", "c", "revolute", "<axis xyz='0 1 0'/>"),
             joint("j3", "c", "d", "prismatic", "<origin xyz='0 0 1'/><axis xyz='0 0 1'/>")});
  const auto r = parse(text, massless(Options::Base::fixed));
  EXPECT_EQ(r.mechanism.nv(), 3);
  EXPECT_EQ(joint_without_inertia(r.mechanism, std::vector<double>{0, 0, 0}), "j1");
  EXPECT_EQ(joint_without_inertia(r.mechanism, std::vector<double>{0, 0.3, 0}), std::nullopt);
}

}  // namespace
}  // namespace porthos::mechanics::urdf_real_models_test
