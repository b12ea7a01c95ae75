// `porthos judge`: a question where a part of the columns is in another unit or order, or where
// gravity is another one. A free base keeps its energy, momenta and rates only with all of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "scene/judge/judge_file.h"
#include "tests/run/recorded_table.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_units_test {
namespace {

class JudgeUnits : public ::testing::Test {
 protected:
  void SetUp() override {
    Case c = floating_arm(folder_, 5);
    c.scene.record_every = c.scene.step;
    (void)scene::run(c.scene, c.assembly, into(folder_ / "out"));
    table_ = csv_of(c, folder_ / "out");
    write_bytes(folder_ / "map.toml", "[verify]\nenergy = 1e-6\n");
  }
  /// @param heads  other names, by name
  scene::RunReport judged_as(const std::map<std::string, std::string>& heads) {
    std::string head = table_.substr(0, table_.find('\n')), names;
    std::istringstream cells(head);
    for (std::string cell; std::getline(cells, cell, ',');) {
      const auto other = heads.find(cell);
      names += (names.empty() ? "" : ",") + (other == heads.end() ? cell : other->second);
    }
    const std::string right = table_;
    table_ = names + table_.substr(head.size());
    const auto r = judged([](const auto&) { return 1; });
    table_ = right;
    return r;
  }
  /// @param unit  by what the numbers of the column of that name are multiplied
  scene::RunReport judged(const std::function<double(const std::string&)>& unit) {
    std::string text;
    std::vector<double> units;
    std::istringstream lines(table_);
    for (std::string line; std::getline(lines, line); text += "\n") {
      std::istringstream cells(line);
      size_t k = 0;
      const bool head = line.starts_with("time");
      for (std::string cell; std::getline(cells, cell, ','); ++k) {
        if (head) units.push_back(unit(cell));
        text += (k > 0 ? "," : "") +
                (head || units[k] == 1 ? cell : fmt::format("{}", units[k] * std::stod(cell)));
      }
    }
    write_bytes(folder_ / "run.csv", text);
    fs::remove_all(folder_ / "judged");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "judged").string()});
  }
  /// The places of the question in the notes; behind all if it is not asked.
  static size_t at(const scene::RunReport& r, const std::string& part) {
    const auto found = std::ranges::find_if(r.notes, [&](const auto& n) { return says(n, part); });
    return size_t(found - r.notes.begin());
  }
  TemporaryFolder folder_;
  std::string table_;
};

bool is_joint(const std::string& name) {
  return name.ends_with("shoulder") || name.ends_with("elbow");
}
bool is_rate(const std::string& name) { return name.starts_with("v."); }
bool is_turning(const std::string& name) {
  return is_rate(name) && (is_joint(name) || name.starts_with("v.base.attitude"));
}
bool is_place(const std::string& name) { return name.find("base.position") != name.npos; }

TEST_F(JudgeUnits, APartOfTheColumnsInDegreesIsAskedAbout) {
  using Part = std::function<bool(const std::string&)>;
  const std::pair<Part, const char*> parts[] = {
      {is_joint, "are the joints' angles and rates in degrees? expected radians. The error of"},
      {[](const auto& n) { return is_joint(n) && !is_rate(n); }, "are the joints' angles in deg"},
      {[](const auto& n) { return is_joint(n) && is_rate(n); }, "are the joints' rates in deg"},
      {[](const auto& n) { return is_joint(n) || is_turning(n); }, "are angles and rates in deg"},
      {is_turning, "are all angular rates in degrees?"},
      {[](const auto& n) { return is_turning(n) && !is_joint(n); },
       "are the rates of the attitude in degrees?"}};
  for (const auto& one : parts) {
    const Part& part = one.first;
    const char* const question = one.second;
    const auto r = judged([&](const auto& name) { return part(name) ? 180 / M_PI : 1; });
    EXPECT_FALSE(r.passed()) << question;
    EXPECT_LT(at(r, question), r.notes.size()) << question;
    EXPECT_EQ(at(r, "as milliseconds?"), r.notes.size()) << question;
    EXPECT_LE(at(r, question), at(r, "does not move as its rates say")) << question;
    EXPECT_EQ(std::ranges::count_if(r.notes, [](const auto& n) { return says(n, "? expected"); }),
              1);
  }
}

TEST_F(JudgeUnits, LengthsAndTimesAreAskedAbout) {
  const auto scaled = [&](bool places, bool velocities, double by, const char* question) {
    const auto r = judged([&](const std::string& name) {
      return is_place(name) && (is_rate(name) ? velocities : places) ? by : 1;
    });
    EXPECT_FALSE(r.passed()) << question;
    EXPECT_LT(at(r, question), r.notes.size()) << question;
  };
  scaled(true, true, 1e3, "are lengths and velocities in millimetres? expected metres. The error");
  scaled(true, false, 1e3, "are lengths in millimetres? expected metres. Positions would move");
  scaled(false, true, 1e3, "are velocities in millimetres? expected metres. The error of the cent");
  scaled(true, true, 1e-3, "are lengths and velocities in kilometres?");
  const auto late = judged([](const auto& name) { return name == "time" ? 1e3 : 1; });
  EXPECT_LT(at(late, "are times in milliseconds? expected seconds."), late.notes.size());
}

std::map<std::string, std::string> both_ways(const std::string& a, const std::string& b) {
  return {{a, b}, {b, a}};
}

TEST_F(JudgeUnits, QuaternionsAndPlacesInAnotherOrderAreAskedAboutFirst) {
  const auto is_first = [](const scene::RunReport& r, const std::string& question) {
    EXPECT_FALSE(r.passed()) << question;
    EXPECT_LT(at(r, question), r.notes.size()) << question;
    EXPECT_EQ(at(r, "are rows missing"), r.notes.size()) << question;
    EXPECT_LE(at(r, question), at(r, "does not move as its rates say")) << question;
  };
  const std::string n = "base.attitude";
  const auto rolled = judged_as({{n + "[0]", n + "[3]"},
                                 {n + "[1]", n + "[0]"},
                                 {n + "[2]", n + "[1]"},
                                 {n + "[3]", n + "[2]"}});
  is_first(rolled, "is the quaternion x y z w? expected w x y z. The error of the centre of mass");
  const std::string q = "base.position", v = "v.base.position";
  is_first(judged_as(both_ways(q + "[0]", q + "[1]")),
           "are x and y of the positions in each other's place?");
  is_first(judged_as(both_ways(v + "[0]", v + "[2]")),
           "are x and z of the velocities in each other's place?");
  auto both = both_ways(q + "[1]", q + "[2]");
  both.merge(both_ways(v + "[1]", v + "[2]"));
  is_first(judged_as(both), "are y and z of the positions and velocities in each other's place?");
  // Another order is none of these.
  const auto other = judged_as(both_ways(n + "[1]", n + "[2]"));
  EXPECT_FALSE(other.passed());
  EXPECT_EQ(at(other, "is the quaternion x y z w?"), other.notes.size()) << "control";
}

/// A map that says other axes of the base's rates than the file has; control: as the file has them.
TEST_F(JudgeUnits, RatesAlongOtherAxesAreAskedAbout) {
  const auto said = [&](const char* linear, const char* angular) {
    write_bytes(folder_ / "map.toml",
                fmt::format("[verify]\nenergy = 1e-6\n[model]\nbase = \"free\"\n[columns]\n"
                            "linear_velocity_axes = \"{}\"\nangular_velocity_axes = \"{}\"\n",
                            linear, angular));
    const auto r = judged([](const auto&) { return 1; });
    std::string all = r.passed() ? "pass" : "";
    for (const auto& note : r.notes) all += note + "\n";
    return all;
  };
  EXPECT_TRUE(said("world", "body").starts_with("pass")) << said("world", "body");
  EXPECT_TRUE(says(said("body", "body"),
                   "are linear velocities along the world's axes? "
                   "linear_velocity_axes = \"world\" in the map."))
      << said("body", "body");
  EXPECT_TRUE(says(said("world", "world"),
                   "are angular velocities along the base's own axes? "
                   "angular_velocity_axes = \"body\" in the map."))
      << said("world", "world");
  EXPECT_TRUE(says(said("body", "world"), "are all velocities along other axes? "))
      << said("body", "world");
}

/// Gravity that only the map or only the file has.
TEST_F(JudgeUnits, AnotherGravityIsAskedAbout) {
  const std::string map = "[verify]\nenergy = 1e-6\n[model]\nbase = \"free\"\n",
                    down = "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n";
  const auto right = [](const auto&) { return 1; };
  write_bytes(folder_ / "map.toml", map + down);
  const auto floats = judged(right);
  EXPECT_FALSE(floats.passed());
  EXPECT_LT(at(floats,
               "is the file without gravity? the map has (0, 0, -9.81) m/s². The error of "
               "the centre of mass would be "),
            floats.notes.size());
  EXPECT_EQ(at(floats, "? expected metres"), floats.notes.size());

  Case c = floating_arm(folder_, 5);
  c.scene.record_every = c.scene.step;
  c.scene.urdf.gravity = {0, 0, -9.81};
  c = make_case(folder_, c.scene, arm_urdf());
  (void)scene::run(c.scene, c.assembly, into(folder_ / "falls"));
  table_ = csv_of(c, folder_ / "falls");
  EXPECT_TRUE(judged(right).passed()) << "control";
  write_bytes(folder_ / "map.toml", map);
  const auto falls = judged(right);
  EXPECT_FALSE(falls.passed());
  EXPECT_LT(at(falls, "does the file fall by (0, 0, -9.81) m/s²? the map has no gravity."),
            falls.notes.size());
}

TEST_F(JudgeUnits, OtherErrorsAndRightFilesAreNotAskedAbout) {
  const auto right = judged([](const auto&) { return 1; });
  EXPECT_TRUE(right.passed());
  EXPECT_EQ(at(right, "?"), right.notes.size());
  const auto doubled = judged([](const auto& name) { return is_joint(name) ? 2 : 1; });
  EXPECT_FALSE(doubled.passed());
  EXPECT_EQ(at(doubled, "? expected"), doubled.notes.size());
}

}  // namespace
}  // namespace porthos::test::judge_units_test
