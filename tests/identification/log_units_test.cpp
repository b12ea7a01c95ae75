// Logs in other units than s, rad and rad/s, and logs that begin within a longer one.
#include <fmt/format.h>

#include <numbers>

#include "tests/identification/support.h"
#include "tests/support/bounds.h"

namespace porthos::scene::log_units_test {
namespace {

using test::keeps;
using test::refusal;

constexpr const char* swing_urdf = R"(<robot name="swing"><link name="ground"/>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="0.2" iyy="0.21" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/></joint>
</robot>)";

class LogUnits : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    write("swing.urdf", swing_urdf);
  }
  Scene swing(double stiffness, double position = 1.2, double velocity = 0.3) const {
    return read(fmt::format(R"([model]
urdf = "swing.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.hinge = {{ position = {}, velocity = {} }}
[[element]]
type = "spring"
name = "coil"
joint = "hinge"
stiffness = {}
[integrator]
method = "gauss8"
step = 0.02
[run]
duration = 4
)",
                            position, velocity, stiffness));
  }
  NamedColumns log(std::vector<std::string> names, double duration = 6) const {
    return noisy(run_of(swing(6), names, duration, 2), {.of_all = 1e-3}, 4);
  }
  /// As a file; heads by column.
  std::string file(const NamedColumns& log, std::map<std::string, std::string> heads = {}) const {
    std::string text;
    for (const auto& [name, values] : log)
      text += (text.empty() ? "" : ",") + (heads.contains(name) ? heads[name] : name);
    for (size_t i = 0; i < log.at("time").size(); ++i) {
      std::string row;
      for (const auto& [name, values] : log) add_to_list(row, fmt::format("{}", values[i]));
      text += "\n" + row;
    }
    return write("log.csv", text + "\n");
  }
  template <class L>
  Identification found(const L& log, std::vector<std::string> parameters = {"coil.stiffness"},
                       const Scene* from = nullptr) const {
    return identify(from ? *from : swing(5), log,
                    {.parameters = std::move(parameters), .noise = {.of_all = 1e-3}});
  }
};

void scale(std::vector<double>& values, double factor) {
  for (double& x : values) x *= factor;
}
constexpr double in_degrees = 180 / std::numbers::pi;

struct Wrong {
  const char *column, *unit;
  double factor;
};

/// What the column and the unit of a wrong one are, before a fit; the head of a file says them.
TEST_F(LogUnits, RatesAndTimesInOtherUnitsAreNamedBeforeAFit) {
  const auto right = log({"hinge.position", "hinge.velocity"});
  EXPECT_NO_THROW(found(right)) << "control";
  for (const Wrong w : {Wrong{"hinge.velocity", "deg/s", in_degrees},
                        {"hinge.position", "deg", in_degrees},
                        {"time", "ms", 1e3},
                        {"time", "us", 1e6}}) {
    auto wrong = right;
    scale(wrong[w.column], w.factor);
    const auto why = refusal([&] { found(wrong); });
    EXPECT_NE(why.find(fmt::format("is '{}' in {}? expected ", w.column, w.unit)),
              std::string::npos)
        << why;
    EXPECT_LE(why.size(), 220u);
    const auto r = found(file(wrong, {{w.column, fmt::format("{} [{}]", w.column, w.unit)}}));
    keeps(fmt::format("stiffness of a log whose head says {}", w.unit),
          std::fabs(r.found[0].value - 6), 4 * r.found[0].deviation);
  }
}

TEST_F(LogUnits, AngleAloneInMilliseconds) {
  auto wrong = log({"hinge.position"});
  scale(wrong["time"], 1e3);
  EXPECT_EQ(
      refusal([&] { found(file(wrong)); }),
      "log.csv: 'time' ends at 6000 s, and the scene at 4 s: is it in ms? expected s; in a file "
      "the head 'time [ms]' says so, else give the scene a longer duration");
  EXPECT_NO_THROW(found(log({"hinge.position"}, 60))) << "control: a long log";
}

/// Of one kind of column alone nothing contradicts it: a question, told before the fit.
TEST_F(LogUnits, RatesAloneInDegreesAreAskedAbout) {
  const auto asked = [&](double factor) {
    auto rates = log({"hinge.velocity"});
    scale(rates["hinge.velocity"], factor);
    std::vector<std::string> told;
    identify(swing(5), file(rates),
             {.parameters = {"coil.stiffness"},
              .noise = {.of_all = 1e-3},
              .say = [&](const std::string& line) { told.push_back(line); }});
    return told.empty() ? "" : told[0];
  };
  EXPECT_NE(asked(in_degrees).find("note: 'hinge.velocity' is 6"), std::string::npos)
      << asked(in_degrees);
  EXPECT_NE(asked(in_degrees).find("is it in degrees? expected rad/s"), std::string::npos);
  EXPECT_EQ(asked(1), "");
}

/// A part of a longer log, which begins where the scene does not.
TEST_F(LogUnits, ALogCutFromTheMiddleIsFoundWithItsStart) {
  auto whole = log({"hinge.position"}, 12);
  NamedColumns part;
  for (auto& [name, values] : whole) part[name].assign(values.begin() + 120, values.end());
  for (double& t : part["time"]) t -= whole["time"][120];
  part["hinge.position"][0] += 2 * std::numbers::pi;  // of an encoder that wraps
  const auto without = found(part);
  ASSERT_FALSE(without.notes.empty());
  EXPECT_TRUE(std::ranges::any_of(without.notes, [](const auto& n) {
    return n.find(
               "where the log was cut from a longer one, ask for its start too: "
               "hinge.position") != n.npos;
  })) << without.notes[0];
  const auto r = found(part, {"coil.stiffness", "hinge.position", "hinge.velocity"});
  EXPECT_LE(r.iterations, 12) << "it begins at the first rows; 6, by the first row alone 23";
  EXPECT_TRUE(r.converged);
  EXPECT_TRUE(r.notes.empty()) << r.notes[0];
  keeps("stiffness", std::fabs(r.found[0].value - 6), 4 * r.found[0].deviation);
  keeps("place at the start", std::fabs(r.found[1].value - whole["hinge.position"][120]), 4e-3);
  test::breaks("control: without its start", std::fabs(without.found[0].value - 6), 0.1);
}

}  // namespace
}  // namespace porthos::scene::log_units_test
