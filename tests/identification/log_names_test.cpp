// Logs as other commands write them, and logs in degrees.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "scene/files/files.h"
#include "scene/identification/identification.h"
#include "scene/session/export.h"
#include "scene/session/run.h"
#include "tests/identification/support.h"
#include "tests/support/bounds.h"

namespace porthos::scene::log_names_test {
namespace {

using test::breaks;
using test::keeps;

/// A bus that floats with a hinged rod.
constexpr const char* craft_urdf = R"(<robot name="craft">
<link name="bus"><inertial><mass value="30"/>
<inertia ixx="4" iyy="5" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="4"/>
<inertia ixx="0.4" iyy="0.41" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="bus"/><child link="rod"/>
<origin xyz="0.3 0 -0.2"/><axis xyz="0 1 0"/></joint></robot>)";

std::string craft(double factor) {
  return fmt::format(R"([model]
urdf = "craft.urdf"
base = "free"
mass_factor.rod = {}
[initial]
base = {{ linear_velocity = [0.01, 0.02, 0], angular_velocity = [0.02, 0.05, 0.1] }}
joints.hinge = {{ position = 0.4, velocity = 1.5 }}
[integrator]
method = "gauss8"
step = 0.05
[run]
duration = 10
record_every = 0.1
)",
                     factor);
}

class LogNames : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    write("craft.urdf", craft_urdf);
  }
  Identification found(const std::string& log, double sigma = 1e-6) const {
    return identify(read(craft(0.7)), log,
                    {.parameters = {"model.mass_factor.rod"}, .noise = {.of_all = sigma}});
  }
  /// The run, as run.h5 and as its table.
  void run_it() const {
    const Scene s = read(craft(1));
    RunOptions o;
    o.out = (folder_ / "out").string();
    (void)run(s, assemble(s), o);
    export_csv(folder_ / "out", folder_ / "table.csv");
  }
};

bool uses(const Identification& r, const std::string& column) {
  return std::ranges::any_of(r.columns, [&](const auto& c) { return c.of.name == column; });
}

TEST_F(LogNames, RunFilesAndTheirExportsAreRead) {
  run_it();
  for (const char* log : {"out/run.h5", "table.csv"}) {
    const auto r = found((folder_ / log).string());
    for (const char* name :
         {"base.position.x", "base.position.y", "base.position.z", "hinge.position"})
      EXPECT_TRUE(uses(r, name)) << log << " " << name;
    EXPECT_TRUE(r.converged);
    keeps(std::string("factor on a mass from ") + log, std::fabs(r.found[0].value - 1), 1e-7);
  }
}

/// Columns as porthos judge names them, and with letters: what a run has, in the same axes.
TEST_F(LogNames, NamesOfJudgeAreRead) {
  const std::vector<std::string> names{"hinge.position", "hinge.velocity", "base.position.z",
                                       "base.linear_velocity.x", "base.angular_velocity.y"};
  const auto log = run_of(read(craft(1)), names, 10, 2);
  const auto csv = [&](const std::vector<std::string>& heads) {
    std::string text = "t";
    for (const auto& head : heads) text += "," + head;
    for (size_t i = 0; i < log.at("time").size(); ++i) {
      text += fmt::format("\n{}", log.at("time")[i]);
      for (const auto& name : names) text += fmt::format(",{}", log.at(name)[i]);
    }
    return text + "\n";
  };
  const auto path = [&](const std::vector<std::string>& heads) {
    return write("judge.csv", csv(heads));
  };
  const auto r = found(
      path({"hinge", "v.hinge", "base.position[2]", "v.base.position[0]", "v.base.attitude[1]"}));
  EXPECT_EQ(r.columns.size(), names.size());
  keeps("factor from the names of judge", std::fabs(r.found[0].value - 1), 1e-7);
  const auto other = found(
      path({"hinge", "w.hinge", "base.position_2", "u.base.position[0]", "u.base.attitude[1]"}));
  EXPECT_EQ(other.columns.size(), 1u) << "control: other names are not used";
}

TEST_F(LogNames, DegreesAreAskedAboutAndNothingIsFound) {
  const auto log = run_of(read(craft(1)), {"hinge.position"}, 10);
  const auto judged = [&](double unit) {
    std::string text = "t,hinge.position\n";
    for (size_t i = 0; i < log.at("time").size(); ++i)
      text += fmt::format("{},{}\n", log.at("time")[i], unit * log.at("hinge.position")[i]);
    return found(write("angle.csv", text), 1e-3);
  };
  const auto right = judged(1), wrong = judged(180 / std::numbers::pi);
  EXPECT_TRUE(right.converged);
  keeps("rms of an angle in radians [rad]", right.columns[0].after, 1e-3);
  EXPECT_FALSE(wrong.converged);
  breaks("rms of an angle in degrees [rad]", wrong.columns[0].after, 0.5);
  EXPECT_NE(wrong.notes[0].find("are angles and rates in degrees?"), std::string::npos)
      << wrong.notes[0];
}

TEST_F(LogNames, AClockThatBeganEarlierIsNoted) {
  const auto log = run_of(read(craft(1)), {"hinge.position"}, 10);
  const auto noted = [&](double later) {
    std::string text = "t,hinge.position\n";
    for (size_t i = 0; i < log.at("time").size(); ++i)
      text += fmt::format("{},{}\n", log.at("time")[i] + later, log.at("hinge.position")[i]);
    const auto notes = found(write("clock.csv", text), 1e-3).notes;
    return std::ranges::any_of(
        notes, [](const auto& n) { return n.find("the log begins at 12.5 s") != n.npos; });
  };
  EXPECT_TRUE(noted(12.5));
  EXPECT_FALSE(noted(0));
}

/// From values that are found already nothing gets nearer, and they stay found.
TEST_F(LogNames, ValuesThatAreRightAtTheStartAreFound) {
  const Scene s = read(craft(1));
  const auto log = noisy(run_of(s, {"hinge.position"}, 10), {.of_all = 1e-3}, 5);
  const auto first = identify(s, log, {.parameters = {"hinge.velocity"}});
  EXPECT_TRUE(first.converged);
  std::string text = craft(1);
  text.replace(text.find("1.5 }"), 3, fmt::format("{}", first.found[0].value));
  const auto again = identify(read(text), log, {.parameters = {"hinge.velocity"}});
  EXPECT_TRUE(again.converged) << (again.notes.empty() ? "" : again.notes[0]);
}

}  // namespace
}  // namespace porthos::scene::log_names_test
