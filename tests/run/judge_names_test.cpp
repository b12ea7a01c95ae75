// `porthos judge`: what porthos export writes is read, as are other spellings of vectors; the base,
// and the loops of a map.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "scene/judge/judge_file.h"
#include "scene/run/growth_words.h"
#include "scene/session/export.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_names_test {
namespace {

bool has_check(const scene::RunReport& r, const std::string& name) {
  return std::ranges::any_of(r.checks, [&](const auto& c) { return c.name == name; });
}
bool notes_say(const scene::RunReport& r, const std::string& part) {
  return std::ranges::any_of(r.notes, [&](const auto& n) { return says(n, part); });
}

class JudgeNames : public ::testing::Test {
 protected:
  scene::RunReport judge(const std::string& csv, const std::string& map = "") {
    write_bytes(folder_ / "run.csv", csv);
    if (!map.empty()) write_bytes(folder_ / "map.toml", map);
    fs::remove_all(folder_ / "judged");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              map.empty() ? "" : (folder_ / "map.toml").string(),
                              (folder_ / "judged").string()});
  }
  /// The table of a run of an arm that floats.
  std::string exported() {
    const Case c = floating_arm(folder_, 6);
    (void)scene::run(c.scene, c.assembly, into(folder_ / "out"));
    scene::export_csv(folder_ / "out", folder_ / "table.csv");
    return read_bytes(folder_ / "table.csv");
  }
  TemporaryFolder folder_;
};

TEST_F(JudgeNames, ExportsAreReadHoweverVectorsAreSpelled) {
  const std::string table = exported();
  const auto spelled = [&](const std::string& by_three, const std::string& by_four) {
    const std::string head = table.substr(0, table.find('\n'));
    std::string renamed = head;
    for (size_t k = 0; k < 4; ++k) {
      const auto put = [&](const std::string& of, char was, char letter) {
        const std::string end = letter == '[' ? fmt::format("[{}]", k) : fmt::format(".{}", letter);
        renamed = std::regex_replace(renamed, std::regex(fmt::format("(/base.{})\\.{} ", of, was)),
                                     "$1" + end + " ");
      };
      if (k < 3) put("position", "xyz"[k], by_three[k]);
      put("attitude", "wxyz"[k], by_four[k]);
    }
    return renamed + table.substr(head.size());
  };
  for (const auto& csv : {table, spelled("[[[", "[[[["), spelled("012", "0123")}) {
    const auto r = judge(csv);
    EXPECT_TRUE(r.passed()) << csv.substr(0, csv.find('\n'));
    EXPECT_TRUE(has_check(r, "centre_of_mass")) << "a free base";
    EXPECT_TRUE(std::ranges::none_of(
        r.not_applicable, [](const auto& n) { return n.why.find("closed form") != n.why.npos; }));
    EXPECT_FALSE(notes_say(r, "state/base"));
    keeps("energy of an exported run", r.energy.max_rel_error, 1e-13);
  }
  const auto wrong = judge(spelled("abc", "abcd"));
  EXPECT_FALSE(wrong.passed());
  EXPECT_FALSE(has_check(wrong, "centre_of_mass"));
  breaks("energy without the base", wrong.energy.max_rel_error, 1e-13);
}

TEST_F(JudgeNames, ABaseInTheFileThatIsJudgedAsFixedIsTold) {
  const std::string table = exported(), limits = "[verify]\nenergy = 1e-9\n";
  const std::string told = "but the base is judged as fixed: expected [model] base = \"free\"";
  const auto fixed = judge(table, "[model]\nbase = \"fixed\"\n" + limits);
  EXPECT_TRUE(notes_say(fixed, told));
  EXPECT_FALSE(fixed.passed());
  const auto free = judge(table, limits);  // no [model]: the columns decide, as without a map
  EXPECT_FALSE(notes_say(free, told));
  EXPECT_TRUE(free.passed());
}

TEST_F(JudgeNames, UnequalRowsAreTheReason) {
  const auto csv = [](double uneven) {
    std::string text = "t,shoulder,elbow,v.shoulder,v.elbow\n";
    for (int i = 0; i < 100; ++i)
      text += fmt::format("{},0,0,0,0\n", 0.1 * i + uneven * std::sin(1.0 * i * i));
    return text;
  };
  write_bytes(folder_ / "model.urdf", arm_urdf());
  EXPECT_TRUE(notes_say(judge(csv(0.02)), "the rows are at unequal intervals"));
  EXPECT_FALSE(notes_say(judge(csv(0)), "the rows are at unequal intervals")) << "control";
}

/// A body that turns and moves straight on, with its velocity along its own axes: its place must
/// go where that leads. Controls: times in milliseconds; the numbers taken along the world's axes.
TEST_F(JudgeNames, PlacesFollowVelocitiesAlongTheBody) {
  write_bytes(folder_ / "model.urdf",
              "<robot name='m'><link name='b'><inertial><mass value='2'/><inertia ixx='0.3' "
              "iyy='0.3' izz='0.3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  const double w = 1.5;
  const auto judged = [&](double unit, const char* axes) {
    std::string csv = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
    for (int i = 0; i <= 400; ++i) {
      const double t = 0.01 * i, a = w * t;
      csv += fmt::format("{},{},0,0,{},0,0,{},{},{},0,0,0,{}\n", unit * t, 3 * t, std::cos(a / 2),
                         std::sin(a / 2), 3 * std::cos(a), -3 * std::sin(a), w);
    }
    return judge(
        csv, fmt::format("[model]\nbase = \"free\"\n[columns]\ntime = \"t\"\n"
                         "linear_velocity_axes = \"{}\"\n[columns.q]\n\"base.position\" = [\"x\", "
                         "\"y\", \"z\"]\n\"base.attitude\" = [\"qw\", \"qx\", \"qy\", "
                         "\"qz\"]\n[columns.v]\n\"base.position\" = [\"vx\", \"vy\", \"vz\"]\n"
                         "\"base.attitude\" = [\"wx\", \"wy\", \"wz\"]\n[verify]\nenergy = 1e-9\n",
                         axes));
  };
  const auto right = judged(1, "body");
  EXPECT_TRUE(right.passed());
  EXPECT_TRUE(has_check(right, "rates"));
  EXPECT_FALSE(judged(1000, "body").passed());
  EXPECT_FALSE(judged(1, "world").passed());
}

/// The pin of a four-bar, which no start at zero could close.
TEST_F(JudgeNames, LoopsOfAMapAreClosedNearTheFirstRow) {
  const std::string example = PORTHOS_SOURCE_DIR "/examples/four_bar/";
  auto s = scene::read_scene(example + "scene.toml");
  s.duration = 3;
  s.record_every = s.step;
  (void)scene::run(s, scene::assemble(s), into(folder_ / "out"));
  scene::export_csv(folder_ / "out", folder_ / "table.csv");
  fs::copy_file(example + "four_bar.urdf", folder_ / "model.urdf");
  const auto judged = [&](double at) {
    return judge(
        read_bytes(folder_ / "table.csv"),
        fmt::format("[model]\nbase = \"fixed\"\n[environment]\ngravity = \"uniform\"\nvector = "
                    "[0, -9.81, 0]\n[[loop]]\nname = \"pin\"\ntype = \"revolute\"\na = {{ link = "
                    "\"coupler_rod\", position = [{}, 0, 0] }}\nb = {{ link = \"rocker_rod\", "
                    "position = [1.25, 0, 0] }}\n[verify]\nenergy = 1e-11\n",
                    at));
  };
  const auto right = judged(1.5), wrong = judged(1.45);
  EXPECT_TRUE(right.passed());
  keeps("gap of the pin in the rows [m]", right.constraint_gap, 1e-11);
  keeps("energy of the four-bar", right.energy.max_rel_error, 1e-11);
  EXPECT_FALSE(wrong.passed());
  breaks("gap of a pin elsewhere [m]", wrong.constraint_gap, 1e-2);
}

/// Mimic joints, once coupled, have the limit of the energy; without it they are told. Control: a
/// limit of their own.
TEST_F(JudgeNames, MimicJointsHaveTheLimitOfTheEnergy) {
  write_bytes(
      folder_ / "model.urdf",
      "<robot name='m'><link name='b'/><link name='x'><inertial><mass value='1'/><inertia "
      "ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link><link "
      "name='y'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' "
      "ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='a' type='continuous'><parent "
      "link='b'/><child link='x'/><axis xyz='0 0 1'/></joint><joint name='c' "
      "type='continuous'><parent link='b'/><child link='y'/><axis xyz='0 0 1'/><mimic "
      "joint='a' multiplier='-1'/></joint></robot>");
  std::string table = "t,a,c,v.a,v.c\n";
  for (int i = 0; i < 50; ++i)
    table += fmt::format("{0},{0:.12f},{1:.12f},1,-1\n", 0.01 * i, 4e-10 - 0.01 * i);
  const std::string model = "[model]\nbase = \"fixed\"\n", coupled = model + "mimic = \"couple\"\n",
                    energy = "[verify]\nenergy = 1e-6\n";
  const auto r = judge(table, coupled + energy);
  keeps("gap of the rows", r.constraint_gap, 1e-9);
  EXPECT_TRUE(r.passed());
  EXPECT_FALSE(judge(table, coupled + energy + "constraints = 1e-12\n").passed());
  std::vector<std::string> said;
  (void)scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(), "",
                           (folder_ / "again").string(),
                           [&](const std::string& line) { said.push_back(line); }});
  EXPECT_TRUE(std::ranges::any_of(said, [](const auto& line) { return says(line, "mimic"); }));
}

/// Its work is not in the file; the same joint without it is judged.
TEST_F(JudgeNames, AMotionInTheMapIsRefused) {
  const std::string table = exported(), model = "[model]\nbase = \"free\"\n";
  const std::string said = refusal([&] {
    judge(table, model +
                     "[[motion]]\nname = \"drive\"\njoint = \"elbow\"\nsteady = { from = 0, "
                     "rate = 1 }\n");
  });
  EXPECT_TRUE(says(said,
                   "map.toml:3:1: the motion 'drive' does work that positions and rates do "
                   "not tell, expected no [[motion]] and the torque of 'elbow'"));
  EXPECT_EQ(refusal([&] { judge(table, model); }), "") << "control";
}

}  // namespace
}  // namespace porthos::test::judge_names_test
