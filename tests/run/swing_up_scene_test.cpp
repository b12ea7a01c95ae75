// Swing-ups from scenes: the shipped missions arrive, with every joule in the ledger; the handover
// at a sampling instant is the same in resumed, extended and differently stepped runs; refusals.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "scene/session/extension.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::swing_up_scene_test {
namespace {

constexpr double pi = std::numbers::pi;

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
std::string handover_of(const scene::RunReport& r) {
  for (const auto& note : r.notes)
    if (note.find("hand") != note.npos) return note;
  return "";
}
/// Largest distance from the upright of one of two joints, whole turns apart, and of rest.
double from_upright(const scene::RunReport& r, size_t pendulum) {
  const auto& x = r.final_state.x;
  const double other = x[1 - pendulum], rates = std::hypot(x[2], x[3]);
  return std::max({std::fabs(std::remainder(x[pendulum] - pi, 2 * pi)), std::fabs(other), rates});
}
double supplied_by(const scene::RunReport& r) {
  double sum = 0;
  for (const auto& row : r.ports) sum += row.second;
  return sum;
}
std::string refusal(const std::string& name, const std::vector<Change>& changes,
                    const std::string& more = "") {
  TemporaryFolder folder;
  try {
    (void)scene::assemble(shipped(folder, name, changes, more));
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

/// The lines of a scene that a note names between two of its parts.
std::string settings_in(const std::string& note,
                        const std::string& before = "in runs of the mechanism alone ",
                        const std::string& behind = " hands over at ") {
  const size_t at = note.find(before), end = note.find(behind);
  if (at == note.npos || end == note.npos) return "none = 0";
  std::string lines = note.substr(at + before.size(), end - at - before.size());
  lines = lines.substr(0, lines.find(" in place"));
  for (size_t k; (k = lines.find(", ")) != lines.npos;) lines.replace(k, 2, "\n");
  return lines + "\n";
}
/// A scene in which a driven joint swings the other up, and an lqr holds it there.
struct SwingUp {
  std::string urdf, drives, swings;
  double start;                  ///< of the joint that swings [rad]
  std::string driven, swinging;  ///< what the lqr knows of both besides their targets
  std::string name;              ///< of the swing-up
  int rate;                      ///< [Hz]
  double limit, step, duration, record_every;
};
scene::Scene scene_of(const TemporaryFolder& folder, const SwingUp& s, const std::string& gains) {
  write_bytes(folder / "model.urdf", s.urdf);
  write_bytes(folder / "scene.toml",
              fmt::format(R"([model]
urdf = "model.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.{swings} = {{ position = {start} }}
[[controller]]
type = "lqr"
name = "hold"
rate = {rate}
joints.{drives} = {{ target = 0, {driven} }}
joints.{swings} = {{ target = 3.141592653589793, {swinging}, actuated = false, periodic = true }}
[integrator]
method = "gauss8"
step = {step}
[run]
duration = {duration}
record_every = {record_every}
[[controller]]
type = "swing_up"
name = "{name}"
rate = {rate}
drives = "{drives}"
joints.{drives} = {{ target = 0 }}
joints.{swings} = {{ target = 3.141592653589793 }}
limit = {limit}
then = "hold"
{gains})",
                          fmt::arg("swings", s.swings), fmt::arg("start", s.start),
                          fmt::arg("rate", s.rate), fmt::arg("drives", s.drives),
                          fmt::arg("driven", s.driven), fmt::arg("swinging", s.swinging),
                          fmt::arg("step", s.step), fmt::arg("duration", s.duration),
                          fmt::arg("record_every", s.record_every), fmt::arg("name", s.name),
                          fmt::arg("limit", s.limit), fmt::arg("gains", gains)));
  return scene::read_scene((folder / "scene.toml").string());
}
/// A rotary pendulum of 0.25 kg and 0.12 kg without friction, 0.3 N m, at a rate [Hz]. gains: those
/// of its swing-up.
scene::Scene without_friction(const TemporaryFolder& folder, int rate, const std::string& gains) {
  return scene_of(folder,
                  {R"(<robot name="free"><link name="stand"/>
<link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="0.25"/>
<inertia ixx="1e-6" iyy="8e-4" izz="8e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.15"/><mass value="0.12"/>
<inertia ixx="9e-4" iyy="9e-4" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="continuous"><parent link="stand"/><child link="arm"/>
<axis xyz="0 0 1"/></joint>
<joint name="swing" type="continuous"><parent link="arm"/><child link="rod"/>
<origin xyz="0.2 0 0"/><axis xyz="1 0 0"/></joint></robot>)",
                   "turn", "swing", 0.01,
                   "position = 0.3, speed = 0.01, effort = 100, limit = 0.3, periodic = true",
                   "position = 1, speed = 0.01", "up", rate, 0.3, 0.002, 30, 0.02},
                  gains);
}
/// A rotary pendulum of 0.26 kg and 0.128 kg with friction in both pivots, at 250 Hz. gains: those
/// of its swing-up.
scene::Scene with_friction(const TemporaryFolder& folder, const std::string& gains) {
  return scene_of(folder,
                  {R"(<robot name="rotary"><link name="table"/>
<link name="arm"><inertial><origin xyz="0.11 0 0"/><mass value="0.26"/>
<inertia ixx="1e-5" iyy="0.0011" izz="0.0011" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.157"/><mass value="0.128"/>
<inertia ixx="0.0012" iyy="0.0012" izz="5e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="yaw" type="continuous"><parent link="table"/><child link="arm"/>
<axis xyz="0 0 1"/><dynamics damping="0.0024"/></joint>
<joint name="pitch" type="continuous"><parent link="arm"/><child link="rod"/>
<origin xyz="0.216 0 0"/><axis xyz="1 0 0"/><dynamics damping="0.0008"/></joint></robot>)",
                   "yaw", "pitch", 0.05, "position = 1, speed = 0.05, effort = 50, limit = 0.4",
                   "position = 2, speed = 0.05", "pump", 250, 0.4, 0.002, 30, 0.02},
                  gains);
}
/// A rod of 0.15 kg without friction, with a wheel of 2.1e-4 kg m² and 0.25 kg at 0.2 m, from
/// 0.5 rad beside its lowest place. gains: those of its swing-up.
scene::Scene light_wheel(const TemporaryFolder& folder, const std::string& gains) {
  return scene_of(folder,
                  {R"(<robot name="wheel_pendulum"><link name="stand"/>
<link name="rod"><inertial><origin xyz="0 0 -0.088"/><mass value="0.15"/>
<inertia ixx="0.00134" iyy="0.00134" izz="4e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="wheel"><inertial><mass value="0.25"/>
<inertia ixx="0.000105" iyy="0.00021" izz="0.000105" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pivot" type="continuous"><parent link="stand"/><child link="rod"/>
<axis xyz="0 1 0"/></joint>
<joint name="motor" type="continuous"><parent link="rod"/><child link="wheel"/>
<origin xyz="0 0 -0.2"/><axis xyz="0 1 0"/></joint></robot>)",
                   "motor", "pivot", 0.5,
                   "position = 1e-4, speed = 1e-4, effort = 1, limit = 3, periodic = true",
                   "position = 1, speed = 0.01", "up", 500, 3, 0.001, 60, 0.1},
                  gains);
}
/// Whether a note has a part.
::testing::AssertionResult has(const std::string& note, const std::string& part) {
  if (note.find(part) != note.npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << note << " has no " << part;
}

}  // namespace

/// A rate too low for an lqr is refused at its line; that of the example holds.
TEST(SwingUpScene, TheSampledLoopIsCertified) {
  TemporaryFolder folder;
  const auto a = scene::assemble(shipped(folder, "furuta_swing_up"));
  double z = 2;
  for (const auto& c : a.certificates)
    if (c.has("sampled")) z = c.item("sampled").value;
  test::keeps("largest |z| of the example at 500 Hz", z, 1);
  EXPECT_TRUE(has(a.certificates.at(0).item("sampled").text,
                  "not checked: a law that pumps energy has no rest"));
  std::string slow = "rate = 12.5";
  const std::string why =
      refusal("furuta_swing_up", {{"rate = 500.0", slow}, {"rate = 500.0", slow}});
  EXPECT_TRUE(has(why, "sampled fails: "));
  EXPECT_TRUE(has(why, "at rate = 12.5 Hz, whose torques are held: a rate of "));
  EXPECT_TRUE(has(why, "scene.toml:"));
}

/// Without `then` both laws act on one motor: told. Control: the example.
TEST(SwingUpScene, TwoLimitedLawsAtOnePortAreTold) {
  const auto remarks = [](const std::vector<Change>& changes) {
    TemporaryFolder folder;
    return scene::assemble(shipped(folder, "furuta_swing_up", changes)).remarks;
  };
  EXPECT_TRUE(remarks({}).empty());
  const auto told = remarks({{"then = \"balance\"\n", ""}});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_TRUE(has(told[0], "'swing_up' and 'balance' both act at turn.torque"));
  EXPECT_TRUE(has(told[0], "then = \"balance\""));
  const auto other = remarks({{"drives = \"turn\"", "drives = \"swing\""}});
  ASSERT_EQ(other.size(), 1u);
  EXPECT_TRUE(has(other[0], "'swing_up' hands over to 'balance', which acts at other joints"));
}

/// Friction without actuator holds the four gains below the upright; a pump pays for it. The user
/// comes there by the notes alone.
TEST(SwingUpScene, WithFrictionTheNotesLeadToTheUpright) {
  TemporaryFolder folder;
  const auto gains = run_of(with_friction(folder, "bandwidth = 2.0\n"));
  EXPECT_TRUE(has(handover_of(gains), "its energy was "));
  EXPECT_TRUE(has(handover_of(gains),
                  "0.1971 J of the upright wanted; friction without actuator is "
                  "0.0008 N m s/rad"));
  EXPECT_TRUE(has(handover_of(gains), " in place of its gains hands over at "));
  const std::string named = settings_in(handover_of(gains));
  std::printf("  the note names %s", named.c_str());  // pump = 25, bandwidth = 1, level = 0.73
  const auto s = with_friction(folder, named);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  EXPECT_TRUE(has(handover_of(r), "controller 'pump' handed over to 'hold' at "));
  std::printf("  %.3g from the upright\n", from_upright(r, 1));
  EXPECT_LT(from_upright(r, 1), 1e-10);  // measured 4e-15
  // Control: without the margin it does not stand.
  EXPECT_FALSE(run_of(with_friction(folder, named + "energy_margin = 0.0\n")).passed());
  // The gains of the regulator, for other computers: those of an independent computation.
  const auto certificates = scene::assemble(s).certificates;
  const auto& K = certificates[0].item("gains of yaw.torque").numbers;
  const std::array known{-0.1414, 1.9107, -0.1025, 0.2493};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(K.at(i), known[i], 5.1e-5) << i;
  EXPECT_TRUE(has(certificates[1].text(), "pump over friction"));
  EXPECT_TRUE(has(certificates[1].text(), "that E arrives is not proved"));
}

/// A light wheel without friction: the four gains stay below the upright by whatever bandwidth, and
/// the note names the pump that goes there. Control: too large a pump stays above it.
TEST(SwingUpScene, WithoutFrictionTheNoteNamesAPumpThatWorks) {
  TemporaryFolder folder;
  for (const char* bandwidth : {"3", "8", "20"}) {
    const auto gains = run_of(light_wheel(folder, std::string("bandwidth = ") + bandwidth + "\n"));
    EXPECT_FALSE(gains.passed());
    EXPECT_TRUE(has(handover_of(gains),
                    " pump = 730, bandwidth = 1, level = 0.93 in place of its gains hands over"));
    EXPECT_TRUE(run_of(light_wheel(folder, settings_in(handover_of(gains)))).passed());
  }
  const auto pumped = [&](double pump) {
    return run_of(light_wheel(folder, fmt::format("bandwidth = 1\npump = {:g}\n", pump)));
  };
  const auto r = pumped(730);
  EXPECT_TRUE(r.passed());
  EXPECT_TRUE(has(handover_of(r), "controller 'up' handed over to 'hold' at "));
  test::keeps("pivot from the upright [rad]",
              std::fabs(std::remainder(r.final_state.x[0] - pi, 2 * pi)), 1e-3);
  const auto above = pumped(4000);
  EXPECT_FALSE(above.passed());
  EXPECT_TRUE(has(handover_of(above), "0.62 J of the upright wanted"));
  EXPECT_TRUE(has(handover_of(above), " pump = 4000, bandwidth = 1, level = 0.93 hands over"));
  test::breaks("control, four thousand",
               std::fabs(std::remainder(above.final_state.x[0] - pi, 2 * pi)), 1e-3);
}

/// What a note names after runs of the sampled laws does it in the scene, too: at rates at which a
/// held torque takes energy, from the certificate's pump and from gains. Control: before it not.
TEST(SwingUpScene, TheSettingsOfTheNoteHandOver) {
  TemporaryFolder folder;
  for (const int rate : {100, 500})
    for (const char* gains : {"bandwidth = 1\npump = 3.3\n", "bandwidth = 8\n"}) {
      const auto low = run_of(without_friction(folder, rate, gains));
      EXPECT_FALSE(low.passed());
      const std::string named = settings_in(handover_of(low));
      EXPECT_TRUE(has(named, "pump = ")) << handover_of(low);
      const auto r = run_of(without_friction(folder, rate, named));
      EXPECT_TRUE(r.passed()) << named << handover_of(r);
      EXPECT_TRUE(has(handover_of(r), "controller 'up' handed over to 'hold' at "));
      test::keeps(fmt::format("rod from the upright, {} Hz", rate),
                  std::fabs(std::remainder(r.final_state.x[1] - pi, 2 * pi)), 1e-3);
      test::breaks("control, before", std::fabs(std::remainder(low.final_state.x[1] - pi, 2 * pi)),
                   1e-3);
    }
}

/// The bandwidth of a scene with a pump is tried first, and that of the note does it. Control: the
/// test before, where it is 1.
TEST(SwingUpScene, TheNoteKeepsTheBandwidthThatIsStated) {
  TemporaryFolder folder;
  const auto low = run_of(without_friction(folder, 500, "bandwidth = 1.5\npump = 3.3\n"));
  EXPECT_FALSE(low.passed());
  const std::string named = settings_in(handover_of(low));
  EXPECT_TRUE(has(named, "bandwidth = 1.5\n")) << handover_of(low);
  EXPECT_TRUE(run_of(without_friction(folder, 500, named)).passed()) << named;
}

/// Where none does in the duration, the note says what is missing, here time. Control: with that it
/// hands over.
TEST(SwingUpScene, WhereNoSettingsDoTheNoteSaysWhatIsMissing) {
  TemporaryFolder folder;
  auto brief = without_friction(folder, 100, "bandwidth = 1\npump = 3.3\n");
  brief.duration = 2.5;
  const std::string note = handover_of(run_of(brief));
  EXPECT_TRUE(has(note,
                  "settings of pump (3.3 to 46), energy_margin and level hands over and "
                  "holds with bandwidth = 1, the only one tried"))
      << note;
  auto stated = without_friction(folder, 100, "bandwidth = 3\npump = 3.3\n");
  stated.duration = brief.duration;
  EXPECT_TRUE(has(handover_of(run_of(stated)),
                  "hands over and holds with bandwidth = 3 or 1, the only ones tried"));
  const auto named = settings_in(note, "in three times the duration ", " reaches the level");
  auto longer = without_friction(folder, 100, named);
  longer.duration = 3 * brief.duration;
  EXPECT_TRUE(has(handover_of(run_of(longer)), "handed over")) << named;
}

/// A start from which it falls before there is time, and beside which the upright is.
TEST(SwingUpScene, TheNoteSaysWhetherAnotherStartWouldDo) {
  TemporaryFolder folder;
  auto beside = without_friction(folder, 100, "bandwidth = 1\npump = 3.3\n");
  beside.duration = 0.2;
  beside.joints["turn"].position = -0.3;
  beside.joints["swing"].position = pi - 0.3;
  EXPECT_TRUE(
      has(handover_of(run_of(beside)), "; from 0.3 rad (m) more of each coordinate pump = "))
      << handover_of(run_of(beside));
  beside.joints["turn"].position = 0.3;
  beside.joints["swing"].position = pi + 0.3;
  EXPECT_TRUE(
      has(handover_of(run_of(beside)), "; from 0.3 rad (m) less of each coordinate pump = "))
      << handover_of(run_of(beside));
  beside.joints["swing"].position = 0.01;
  EXPECT_TRUE(has(handover_of(run_of(beside)), ", from 0.3 rad (m) less of each coordinate"))
      << "control: none does";
}

TEST(SwingUpScene, TheRotaryPendulumGoesUpAgainstFriction) {
  const Change friction{"<axis xyz=\"1 0 0\"/>",
                        "<axis xyz=\"1 0 0\"/><dynamics damping=\"5e-6\"/>"};
  TemporaryFolder folder;
  const auto r = run_of(shipped(folder, "furuta_swing_up",
                                {friction,
                                 {"energy = 60000.0", "pump = 20.0\nbandwidth = 1.0"},
                                 {"inertia = 1.0\n", ""},
                                 {"stiffness = 60.0\n", ""},
                                 {"damping = 0.5\n", ""}}));
  EXPECT_TRUE(r.passed());
  EXPECT_TRUE(has(handover_of(r), "handed over to 'balance' at "));
  std::printf("  %s; %.3g from the upright\n", handover_of(r).c_str(), from_upright(r, 1));
  EXPECT_LT(from_upright(r, 1), 1e-10);  // measured 8e-16
  // Control: the four gains do not, in four times the time, and the note says why.
  const auto gains = run_of(shipped(folder, "furuta_swing_up", 40, {friction}));
  EXPECT_TRUE(
      has(handover_of(gains), "has not handed over to 'balance': its V came down to 0.1009"));
  EXPECT_TRUE(has(handover_of(gains), "0.01519 J of the upright wanted"));
}

TEST(SwingUpScene, TheRotaryPendulumGoesUpAndStays) {
  TemporaryFolder folder;
  const auto r = run_of(shipped(folder, "furuta_swing_up"));
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(handover_of(r), "controller 'swing_up' handed over to 'balance' at 5.456 s");
  EXPECT_LT(from_upright(r, 1), 1e-10);  // measured 2e-11: e^(-8.1·4.5 s) of 0.1 rad
  // What the motor supplied is what the rod rose: m g l (cos 0.01 + 1).
  EXPECT_NEAR(supplied_by(r), 0.024 * 9.81 * 0.0645 * (1 + std::cos(0.01)), 1e-15);
  EXPECT_GT(std::fabs(entry_of(r.ports, "balance")), 1e-3);
  // Negative control: without a handover the energy law passes the upright and does not stay.
  const auto text = std::string("then = \"balance\"");
  const auto alone =
      run_of(shipped(folder, "furuta_swing_up", {{text, "then = \"balance\"\nlevel = 1e-9"}}));
  EXPECT_NE(handover_of(alone).find("has not handed over"), std::string::npos);
  EXPECT_GT(from_upright(alone, 1), 1e-3);
}

TEST(SwingUpScene, TheAcrobotGoesUpAndStays) {
  TemporaryFolder folder;
  const auto r = run_of(shipped(folder, "acrobot_swing_up"));
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(handover_of(r), "controller 'swing_up' handed over to 'balance' at 8.79 s");
  EXPECT_LT(from_upright(r, 0), 1e-9);  // measured 2e-10
  const double rise = 9.8 * (1.5 + 1) * (1 + std::cos(pi / 2 - 1.4));
  EXPECT_NEAR(supplied_by(r), rise, 1e-12 * rise);
}

TEST(SwingUpScene, TheHandoverIsThatOfTheMotionAndNotOfTheSteps) {
  for (const auto& changed :
       {Change{"step = 0.001", "step = 0.0005"}, Change{"\"gauss8\"", "\"gauss12\""},
        Change{"step = 0.001", "step = 0.001\nstep_control = \"reversible\""}}) {
    TemporaryFolder folder;
    const auto r = run_of(shipped(folder, "furuta_swing_up", 6, {changed}));
    EXPECT_NE(handover_of(r).find("at 5.456 s"), std::string::npos) << changed.to << handover_of(r);
  }
}

TEST(SwingUpScene, AResumedAndAnExtendedRunHaveTheSameBits) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "furuta_swing_up", 6);
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  auto parts = into(folder / "parts");
  for (const std::int64_t at : {1001, 5457}) {  // between two samples, and behind the handover
    parts.stop_at = at;
    EXPECT_TRUE(scene::run(s, a, parts).interrupted);
    parts.resume = true;
  }
  const auto rest = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(whole.final_state, rest.final_state);
  EXPECT_EQ(whole.held.size(), rest.held.size());
  EXPECT_EQ(handover_of(rest), handover_of(whole));

  auto shorter = s;
  shorter.duration = 3;
  const auto first = scene::run(shorter, scene::assemble(shorter), into(folder / "longer"));
  EXPECT_NE(handover_of(first).find("has not"), std::string::npos);
  auto longer = shorter;
  scene::extend_to(longer, (folder / "longer").string(), 6);
  const auto again = scene::assemble(longer);
  scene::reopen((folder / "longer").string(), longer, again);
  const auto r = scene::run(longer, again, into(folder / "longer", true));
  EXPECT_EQ(whole.final_state, r.final_state);
  EXPECT_EQ(handover_of(r), handover_of(whole));
  const auto j = nlohmann::json::parse(read_bytes(folder / "longer/summary.json"));
  EXPECT_EQ(j["certificates"].size(), 2u);
}

/// Four gains by a bandwidth, and a level of which runs say how often the law loses it.
TEST(SwingUpScene, ByBandwidth) {
  TemporaryFolder folder;
  const std::vector<Change> gains{{"energy = 60000.0", "bandwidth = 6.0"},
                                  {"inertia = 1.0\n", ""},
                                  {"stiffness = 60.0\n", ""},
                                  {"damping = 0.5\n", "level = 0.15\n"},
                                  {"duration = 10.0", "duration = 30.0"}};
  const auto s = shipped(folder, "furuta_swing_up", gains);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed()) << handover_of(r);
  EXPECT_NE(handover_of(r).find("handed over"), std::string::npos) << handover_of(r);
  EXPECT_LT(from_upright(r, 1), 1e-3);
  std::string certificates;
  for (const auto& one : scene::assemble(s).certificates) certificates += one.text();
  EXPECT_NE(certificates.find("0.9 of the largest"), std::string::npos) << certificates;
  // Control: a level from which most runs are lost is refused, with their number.
  auto high = gains;
  high[3].to = "damping_ratio = 0.3\nlevel = 10.0\n";
  const std::string why = refusal("furuta_swing_up", high);
  EXPECT_NE(why.find("of 100 runs from 10 it loses"), std::string::npos) << why;
}

TEST(SwingUpScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_NE(text.find("scene.toml:"), std::string::npos) << text;
  };
  const auto furuta = [&](const Change& change, const std::string& part) {
    says(refusal("furuta_swing_up", {change}), part);
  };
  furuta({"inertia = 1.0", "inertia = 0.5"}, "inertia gain");
  furuta({"position = 0.01 }", "position = 0.0 }"}, "for ever");
  furuta({"then = \"balance\"", "then = \"nobody\""}, "expected another controller");
  furuta({"then = \"balance\"", "then = \"swing_up\""}, "expected another controller");
  furuta({"then = \"balance\"", "level = 1.0"}, "without then");
  furuta({"then = \"balance\"", "then = \"balance\"\nlevel = 10.0"}, "is known to hold");
  furuta({"energy = 60000.0", "bandwidth = 5.0"}, "is given besides bandwidth");
  furuta({"energy = 60000.0", "energy = 60000.0\npump = 20.0"}, "pump is given without bandwidth");
  furuta({"energy = 60000.0", "energy = 60000.0\nenergy_margin = -1.0"}, "energy_margin");
  furuta({"energy = 60000.0", ""}, "the gain of the error of the energy, or bandwidth");
  furuta({"energy = 60000.0", "energy = 60000.0\ndamping_ratio = 0.3"}, "without bandwidth");
  furuta({"then = \"balance\"", "then = \"balance\"\nleave = 0.9"}, "leave is not above 1");
  furuta({"rate = 500.0", "rate = 250.0"}, "expected one rate");
  furuta({"drives = \"turn\"", "drives = \"wheel\""}, "no joint 'wheel'");
  furuta({"damping = 0.5", "damping = 0.0"}, "damping");
  furuta({"target = 3.141592653589793, position", "target = 3.14159, position"},
         "force without actuator: 2.65");
  furuta({"target = 3.141592653589793, position", "target = 3.14159, position"},
         "; the target of 'swing' is 3.14159, expected all digits of 3.141592653589793 if");
  says(refusal("furuta_swing_up", {{"then = \"balance\"", "then = \"other\""}},
               "[[controller]]\ntype = \"swing_up\"\nname = \"other\"\nrate = 500.0\n"
               "drives = \"turn\"\nenergy = 1.0\njoints.swing = { target = 3.14 }\n"),
       "no level set is known");
}

}  // namespace porthos::test::swing_up_scene_test
