// The URDF reader's exact words: a note for what it does not use, one sentence for what is wrong.
#include <gtest/gtest.h>

#include <fstream>

#include "mechanics/joint_list.h"
#include "tests/urdf/robots.h"

namespace porthos::mechanics::urdf_messages_test {
namespace {

void expect_refused(const std::string& text, const std::string& message, const Options& o = {}) {
  try {
    parse(text, o);
    ADD_FAILURE() << "accepted, expected: " << message << "\n" << text;
  } catch (const InvalidArgument& e) {
    EXPECT_EQ(std::string(e.what()), message) << text;
  }
}
void expect_notes(const std::string& text, const std::vector<std::string>& expected,
                  const Options& o = {}) {
  std::vector<std::string> notes;
  for (const auto& n : parse(text, o).notes) notes.push_back(n.where + ": " + n.text);
  EXPECT_EQ(notes, expected) << text;
}

TEST(UrdfNotes, EveryKind) {
  const std::string dynamics = "<dynamics damping='.5' friction='.25'/>";
  expect_notes(arm("revolute", dynamics),
               {"r.urdf:4: joint 'j': friction 0.25 read but not simulated"});
  Options undamped;
  undamped.use_damping = false;
  expect_notes(arm("revolute", dynamics),
               {"r.urdf:4: joint 'j': friction 0.25 read but not simulated",
                "r.urdf:4: joint 'j': damping 0.5 read but not simulated"},
               undamped);
  EXPECT_TRUE(parse(arm("revolute", "<dynamics damping='.5'/>"), undamped)
                  .mechanism.joint_properties()
                  .empty());
  expect_notes(arm("revolute", "\n<mimic joint='k' multiplier='2' offset='0'/>"),
               {"r.urdf:5: joint 'j': <mimic> ignored without mimic = \"couple\": joint 'k'"});
  expect_notes(arm("revolute", "<limit lower='-1' upper='1'/>"), {});
  expect_notes(arm("revolute", "<limit lower='-1' upper='1' effort='8' velocity='9'/>"),
               {"r.urdf:4: 1 x <limit> effort or velocity: not enforced"});
  expect_notes(arm("planar", "<limit lower='-1' upper='1'/>"),
               {"r.urdf:4: 1 x <limit> lower or upper of a planar joint: ignored"});
  expect_notes(arm("revolute", "<axis2 xyz='1 0 0'/>"),
               {"r.urdf:4: joint 'j': <axis2> means nothing to a revolute joint, ignored"});
  expect_notes(arm("revolute", "<pitch value='1'/>"),
               {"r.urdf:4: joint 'j': <pitch> means nothing to a revolute joint, ignored"});
  expect_notes(arm("revolute", "<spring\nrate='1'/>"),
               {"r.urdf:4: joint 'j': unknown tag <spring> in <joint>, ignored"});
  expect_notes(arm("revolute", "<axis xyz='1 0 0'\nunit='deg'/>"),
               {"r.urdf:5: joint 'j': unknown attribute <axis unit=\"deg\">, ignored"});
  expect_notes(arm_link(some_inertial + "\nbla"),
               {"r.urdf:4: link 'arm': text in <link>, ignored"});
  expect_notes(robot({"<sensor name='s'/>", link("a"), link("b"), joint("j", "a", "b")}),
               {"r.urdf:2: unknown tag <sensor> in <robot>, ignored"});
}

TEST(UrdfNotes, WhatIsKnownButNotReadIsCounted) {
  const std::string shape = "<visual><origin rpy='oops'/></visual><collision/><visual/>";
  expect_notes(
      robot({"<material name='red'/>", link("a", some_inertial + shape),
             link("b", some_inertial + shape),
             joint("j", "a", "b", "revolute",
                   "<calibration rising='0'/><safety_controller k_velocity='1'/>"),
             "<transmission/>", "<gazebo/>", "<gazebo reference='a'/>"}),
      {"r.urdf:5: 1 x <calibration>: not read", "r.urdf:3: 2 x <collision>: only for a [[contact]]",
       "r.urdf:7: 2 x <gazebo>: not read", "r.urdf:2: 1 x <material>: only drawn",
       "r.urdf:5: 1 x <safety_controller>: not read", "r.urdf:6: 1 x <transmission>: not read",
       "r.urdf:3: 4 x <visual>: only drawn"});
}

TEST(UrdfNotes, ImplausibleInertia) {
  const auto tensor = [](const std::string& mass) {
    return arm_link("<inertial><mass value='" + mass +
                    "'/><inertia ixx='80' ixy='0' ixz='0' iyy='80' iyz='0' izz='80'/></inertial>");
  };
  expect_notes(
      tensor("0.2"),
      {"r.urdf:3: link 'arm': a mass of 0.2 kg with a radius of gyration of 20 m is implausible, "
       "expected kg m^2"});
  expect_notes(tensor("90"), {});
}

TEST(UrdfErrors, Numbers) {
  const auto origin = [](const std::string& a) { return arm("revolute", "\n<origin " + a + "/>"); };
  const std::string at = "r.urdf:5: joint 'j': <origin ";
  expect_refused(origin("xyz='0 0'"), at + "xyz=\"0 0\">: expected 3 finite numbers, found 2");
  expect_refused(origin("xyz='0 0 0 0'"),
                 at + "xyz=\"0 0 0 0\">: expected 3 finite numbers, found 4");
  expect_refused(origin("rpy=''"), at + "rpy=\"\">: expected 3 finite numbers, found 0");
  for (const std::string bad :
       {"1,5", "x", "nan", "inf", "-inf", "1e999", "0x10", "1.0f", "+-1", "+", "${pi/2}", "1e"})
    expect_refused(origin("xyz='0 " + bad + " 0'"),
                   at + "xyz=\"0 " + bad + " 0\">: expected 3 finite numbers, found '" + bad + "'");
  expect_refused(origin("quat_xyzw='0 0 0 1'"),
                 at + "quat_xyzw=\"0 0 0 1\"> is not understood, expected rpy");
  expect_refused(arm("helical", "<pitch value='1 2'/>"),
                 "r.urdf:4: joint 'j': <pitch value=\"1 2\">: expected a finite number, found 2");
  expect_refused(arm("revolute", "<limit lower='a'/>"),
                 "r.urdf:4: joint 'j': <limit lower=\"a\">: expected a finite number, found 'a'");
  for (const std::string good : {"1", "+1", "1.", "1e0", " 1 ", "1.0E+00", "\n1\t"})
    EXPECT_EQ(parse(arm("helical", "<pitch value='" + good + "'/>")).mechanism.nodes()[0].pitch, 1)
        << good;
}

TEST(UrdfErrors, Inertials) {
  const std::string inertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>",
                    mass = "<mass value='1'/>";
  const auto refused = [](const std::string& inside, const std::string& message) {
    expect_refused(arm_link("<inertial>" + inside + "</inertial>"),
                   "r.urdf:3: link 'arm': " + message);
  };
  refused(inertia, "<inertial> has no <mass>");
  refused(mass, "<inertial> has no <inertia>");
  refused("<mass/>" + inertia, "<mass> has no attribute 'value'");
  refused(mass + "<inertia ixx='1' ixy='0' ixz='0' iyy='1' izz='1'/>",
          "<inertia> has no attribute 'iyz'");
  refused(mass + mass + inertia, "there is a second <mass>, expected one");
  refused("<mass value='kg'/>" + inertia,
          "<mass value=\"kg\">: expected a finite number, found 'kg'");
  expect_refused(arm_link(some_inertial + "\n" + some_inertial),
                 "r.urdf:4: link 'arm': there is a second <inertial>, expected one");
}

TEST(UrdfErrors, Joints) {
  const auto links = link("a") + link("b");
  const auto refused = [&](const std::string& joints, const std::string& message) {
    expect_refused(robot({links, joints}), "r.urdf:3: " + message);
  };
  refused("<joint name='j' type='revolute'><child link='b'/></joint>",
          "joint 'j': <joint> has no <parent>");
  refused("<joint name='j' type='revolute'><parent link='a'/></joint>",
          "joint 'j': <joint> has no <child>");
  refused("<joint name='j' type='revolute'><parent/><child link='b'/></joint>",
          "joint 'j': <parent> has no attribute 'link'");
  refused("<joint type='revolute'/>", "<joint> has no attribute 'name'");
  refused("<joint name='' type='revolute'/>",
          "joint '': <joint name=\"\"> is empty, expected a name");
  refused("<joint name='j'/>", "joint 'j': <joint> has no attribute 'type'");
  std::string known = "floating";
  for (const auto& type : joint_type_names()) known += ", " + type;
  refused(joint("j", "a", "b", "ball"),
          "joint 'j': <joint type=\"ball\">: unknown type, expected one of " + known);
  refused(joint("j", "a", "b", "helical"), "joint 'j': <joint> has no <pitch>");
  refused(joint("j", "a", "b", "revolute", "<axis/>"), "joint 'j': <axis> has no attribute 'xyz'");
  refused(joint("j", "a", "b", "revolute", "<axis xyz='0 0 0'/>"),
          "joint 'j': <axis xyz=\"0 0 0\"> is zero, expected a direction");
  // A fixed joint does not use its axis, and exporters write it as zero.
  EXPECT_EQ(parse(robot({links, joint("j", "a", "b", "fixed", "<axis xyz='0 0 0'/>")}), free_base)
                .mechanism.nv(),
            6);
}

TEST(UrdfErrors, Tree) {
  const auto refused = expect_refused;
  const Options o;
  refused(robot({link("a"), link("b"), link("a")}),
          "r.urdf:4: link 'a' stands in line 2 already, expected another name", o);
  refused(robot({link("a"), link("b"), link("c"), joint("j", "a", "b"), joint("j", "b", "c")}),
          "r.urdf:6: joint 'j' stands in line 5 already, expected another name", o);
  refused(robot({link("a"), link("b"), joint("j", "a", "x")}),
          "r.urdf:4: joint 'j': its child 'x' is not a link of this file", o);
  refused(robot({link("a"), link("b"), joint("j", "x", "b")}),
          "r.urdf:4: joint 'j': its parent 'x' is not a link of this file", o);
  refused(robot({link("a"), link("b"), link("c"), joint("j", "a", "c"), joint("k", "b", "c")}),
          "r.urdf:6: joint 'k': its child 'c' already hangs on joint 'j' (line 5), expected one "
          "parent per link",
          o);
  refused(robot({link("a"), link("b"), link("c"), joint("j", "a", "c")}),
          "r.urdf:3: link 'b' and link 'a' are no joint's child, expected one root link", o);
  refused(robot({link("a"), link("b"), joint("j", "a", "b"), joint("k", "b", "a")}),
          "r.urdf:5: joint 'k': is part of a cycle ('a' on 'b' on 'a'), expected a tree with one "
          "root link",
          o);
  refused(robot({link("r"), link("a"), link("b"), joint("j", "a", "b"), joint("k", "b", "a")}),
          "r.urdf:6: joint 'k': is part of a cycle ('a' on 'b' on 'a'), expected a tree with one "
          "root link",
          o);
  refused(
      robot({link("a"), joint("j", "a", "a")}),
      "r.urdf:3: joint 'j': is part of a cycle ('a' on 'a'), expected a tree with one root link",
      o);
  refused(robot({}), "r.urdf:1: <robot> has no <link>, expected at least one", o);
  refused(robot({link("a"), link("b"), joint("base", "a", "b")}),
          "r.urdf:4: joint 'base': the joint of the free base has this name, expected another",
          free_base);
  refused(robot({link("world"), link("b"), joint("j", "world", "b")}),
          "r.urdf:2: link 'world' is the inertial frame, expected another name for the root of a "
          "free base",
          free_base);
}

TEST(UrdfErrors, OfTheBuilderHaveTheFile) {
  const auto refused = [](const std::string& text, const std::string& start) {
    try {
      parse(text);
      ADD_FAILURE() << "accepted, expected: " << start;
    } catch (const InvalidArgument& e) {
      EXPECT_TRUE(std::string_view(e.what()).starts_with(start)) << e.what();
    }
  };
  refused(arm_link("<inertial><mass value='-1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' "
                   "izz='1'/></inertial>"),
          "r.urdf:3: body 'arm': mass is -1 kg, expected a number >= 0");
  refused(arm_link("<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' "
                   "izz='9'/></inertial>"),
          "r.urdf:3: body 'arm': inertia breaks the triangle inequality");
  refused(arm("revolute", "<dynamics damping='-1'/>"),
          "r.urdf:3: joint 'j': damping is -1, expected a finite number >= 0");
  refused(robot({link("a"), link("world"), joint("j", "a", "world")}),
          "r.urdf:3: body 'world': the name 'world' is taken");
  refused(arm("fixed"), "r.urdf: mechanism 'r' has no moving bodies");
  refused(arm_link("<inertial><mass value='0'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' "
                   "izz='0'/></inertial>"),
          "r.urdf: joint 'j' moves no inertia");
}

TEST(UrdfErrors, Xml) {
  expect_refused("", "r.urdf: is empty, expected a URDF <robot>");
  expect_refused(" \n\t\n", "r.urdf: is empty, expected a URDF <robot>");
  expect_refused("<!-- nothing -->", "r.urdf: has no XML element, expected a URDF <robot>");
  expect_refused("<?xml version='1.0'?>\n<sdf/>",
                 "r.urdf:2: the top element is <sdf>, expected <robot>");
  expect_refused(robot({link("a")}) + "<robot/>",
                 "r.urdf:4: there is a second top element <robot>, expected one");
  expect_refused("<robot name='r'>\n<link name='a'>\n</robot>",
                 "r.urdf:2: broken XML: error mismatched element (XMLElement name=link)");
  expect_refused("<robot name='r'>\n<link name='a'/>\n", "r.urdf:1: broken XML: error parsing");
  expect_refused(std::string("<robot>\n\0</robot>", 17),
                 "r.urdf:2: has a zero byte, expected XML text in UTF-8");
  expect_refused(
      robot({link("a"), "<xacro:arm/>"}),
      "r.urdf:3: <xacro:arm> is a macro, expected plain URDF: expand it with xacro first");
}

TEST(UrdfErrors, Files) {
  const auto message = [](const std::string& path) -> std::string {
    try {
      read_urdf(path);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message("no/such.urdf"),
            "URDF file 'no/such.urdf' cannot be opened: No such file or directory");
  EXPECT_EQ(message("/"), "URDF file '/' cannot be opened: it is a directory");
  const fs::path path = fs::path(testing::TempDir()) / "porthos_urdf_test.urdf";
  std::ofstream(path) << arm("revolute");
  EXPECT_EQ(read_urdf(path.string()).mechanism.nv(), 1);
  std::ofstream(path) << arm("ball");
  EXPECT_TRUE(message(path.string()).starts_with(path.string() + ":4: joint 'j': "));
  fs::remove(path);
}

TEST(UrdfErrors, LinksWithoutInertia) {
  const auto frame = [](const std::string& name) { return link(name, ""); };
  const std::string text =
      robot({frame("base"), frame("stand"), link("arm"), frame("tool"), frame("tcp"),
             joint("s", "base", "stand", "fixed"), joint("j", "stand", "arm"),
             joint("t", "arm", "tool", "fixed"), joint("u", "tool", "tcp", "fixed")});
  const std::string frames =
      "r.urdf:5: links without <inertial> on fixed joints, taken as frames: 'tool', 'tcp'";
  expect_notes(text, {frames});
  expect_notes(text, {frames}, massless(Options::Base::fixed));
  EXPECT_EQ(parse(text).mechanism.total_mass(), 2);
  const std::string hand =
      robot({link("base"), link("arm"), frame("finger"), frame("tip"), joint("j", "base", "arm"),
             joint("g", "arm", "finger"), joint("t", "finger", "tip", "fixed")});
  expect_refused(hand,
                 "r.urdf:4: link 'finger' has no <inertial> and moves on joint 'g', expected mass "
                 "properties or the joint locked (the same holds for all of 'finger', 'tip')");
  expect_refused(hand,
                 "r.urdf: joint 'g' moves no inertia: the bodies beyond it are massless about it, "
                 "expected mass properties for them or the joint locked",
                 massless(Options::Base::fixed));
  Options given;
  given.link_inertia["tool"] = {7, {0, 0, 0}, {1, 0, 0, 1, 0, 1}, Mat3<double>::identity()};
  given.link_inertia["tcp"] = {};
  expect_notes(text, {}, given);
  EXPECT_EQ(parse(text, given).mechanism.total_mass(), 9);
  given.link_inertia["arm"] = {};
  expect_refused(text,
                 "r.urdf:4: link 'arm' has an <inertial>, expected no [model.inertia.arm] besides",
                 given);
  given.link_inertia = {{"elbow", {}}};
  expect_refused(text, "r.urdf: [model.inertia.elbow]: 'elbow' is not a link of this file", given);
  expect_refused(robot({frame("base"), link("arm"), joint("j", "base", "arm")}),
                 "r.urdf:2: link 'base' has no <inertial> and floats, expected mass properties",
                 free_base);
}

}  // namespace
}  // namespace porthos::mechanics::urdf_messages_test
