// The ledger of runs: elements in scenes, systems of the user's own, restart, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "phs/network/elements.h"
#include "phs/system/user_model.h"
#include "tests/run/scenes.h"

namespace porthos::test::ledger_test {
namespace {

/// A scene file with some elements at the joints of the arm.
scene::Scene scene_with(const TemporaryFolder& folder, const std::string& elements) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
              "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder = { position = 1.2 "
              "}\n" +
                  elements +
                  "[integrator]\nmethod = \"gauss12\"\nstep = 0.01\n[run]\nduration = 20\n"
                  "record_every = 0.1\n[verify]\nbalance = 1e-13\n");
  return scene::read_scene((folder / "scene.toml").string());
}
std::string element(const std::string& keys) {
  return "[[element]]\njoint = \"elbow\"\n" + keys + "\n";
}

struct Row {
  const char* what;
  std::string keys, name;
  bool stored, lost, in;
};

TEST(Ledger, EveryElementHasItsRowAndTheBalanceCloses) {
  const Row rows[] = {
      {"spring", "type = \"spring\"\nstiffness = 20.0\nrest = 0.3\ncubic = 5.0", "elbow.spring",
       true, false, false},
      {"table", "type = \"spring\"\nname = \"measured\"\nelongation = [-20, 20]\nforce = [-40, 40]",
       "measured", true, false, false},
      {"damper", "type = \"damper\"\ndamping = 0.4", "elbow.damper", false, true, false},
      {"friction",
       "type = \"friction\"\ncoulomb = 0.2\nbreakaway = 0.3\nstribeck = 1.0\nviscous = "
       "0.1\nsmoothing = 1.0",
       "elbow.friction", false, true, false},
      {"constant", "type = \"force\"\nconstant = 0.5", "elbow.force", false, false, true},
      {"sine", "type = \"force\"\nsine = { amplitude = 2, frequency = 0.3, phase = 0.5 }",
       "elbow.force", false, false, true},
      {"profile", "type = \"force\"\nprofile = { times = [0, 5, 10, 20], values = [0, 1, -1, 0] }",
       "elbow.force", false, false, true},
      {"motor",
       "type = \"dc_motor\"\nname = \"m\"\ninductance = 0.05\nresistance = 1.0\nconstant = "
       "0.05\ngear = 30\nrotor_inertia = 1e-4\nfriction = 1e-5\nvoltage = { constant = 6.0 }",
       "m.voltage", false, false, true}};
  for (const Row& row : rows) {
    TemporaryFolder folder;
    const scene::Scene s = scene_with(folder, element(row.keys));
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    ASSERT_EQ(r.outcome, integrators::Outcome::ok) << row.what;
    const auto has = [&](const scene::RunReport::Named& list) {
      for (const auto& [name, joule] : list)
        if (name == row.name) return joule != 0;
      return false;
    };
    EXPECT_EQ(has(r.storages), row.stored) << row.what;
    EXPECT_EQ(has(r.losses), row.lost) << row.what;
    EXPECT_EQ(has(r.ports), row.in) << row.what;
    const double defect = std::fabs(r.defect_J) / r.energy.scale_J;
    std::printf("  %-9s stored %+8.3f = supplied %8.3f - dissipated %8.3f J, defect %.1e (1e-13)\n",
                row.what, r.stored_J, r.supplied_J, r.dissipated_J, defect);
    EXPECT_LT(defect, 1e-13) << row.what;
    EXPECT_TRUE(r.passed());
    EXPECT_GT(fs::file_size(folder / "out" / "ledger.svg"), 1000u);
  }
}

// A spline through sharp bends swings; straight lines do not.
TEST(Ledger, AProfileThatSwingsBeyondItsValuesIsNoted) {
  const std::string says_so =
      "element 'elbow.force': the profile reaches -0.0531 at 31.1 s, beyond its values 0 to 0.02: "
      "it "
      "is a smooth curve";
  const std::pair<const char*, bool> cases[] = {
      {"type = \"force\"\nprofile = { times = [0, 5, 10, 60], values = [0, 0.02, 0, 0] }", true},
      {"type = \"force\"\nprofile = { times = [0, 1, 2, 3], values = [0, 1, 2, 3] }", false},
      {"type = \"force\"\nprofile = { times = [0, 5, 10, 15], values = [0, 0, 0, 0] }", false},
      {"type = \"force\"\npieces = { period = 5.0, nodes = 2, values = [0.0042265, 0.0157735,  "
       "0.02, 0.02,  0.0157735, 0.0042265] }",
       false}};
  for (const auto& [keys, noted] : cases) {
    TemporaryFolder folder;
    const auto a = scene::assemble(scene_with(folder, element(keys)));
    std::string notes;
    for (const auto& n : a.notes) notes += n.where + ": " + n.text + "\n";
    EXPECT_EQ(notes.find("the profile reaches") != std::string::npos, noted) << notes;
    EXPECT_EQ(says(notes, says_so), noted) << notes;
  }
}

// Limits are C²: the defect is that of a jump in the third derivative, and falls with the step.
TEST(Ledger, LimitsOfTheModelFileOrTheScene) {
  double defect[2];
  for (const int i : {0, 1}) {
    TemporaryFolder folder;
    scene::Scene s = scene_with(
        folder, element("type = \"limits\"\nlower = -0.2\nupper = 0.2\nstiffness = 2000.0"));
    s.step = i ? 0.0025 : 0.005;
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    defect[i] = r.energy.max_rel_error;
    EXPECT_LT(std::fabs(r.final_state.x[1]), 0.5);
  }
  std::printf("  limits: energy error %.1e -> %.1e with half the step\n", defect[0], defect[1]);
  EXPECT_LT(defect[1], 1e-7);
  EXPECT_LT(defect[1], 0.5 * defect[0]);
  TemporaryFolder folder;
  const scene::Scene none = scene_with(folder, element("type = \"limits\"\nstiffness = 10.0"));
  EXPECT_TRUE(says(refusal([&] { scene::assemble(none); }),
                   "gives the lower limit of joint 'elbow', expected it here"));
}

TEST(Ledger, BadElementsAreRefusedWithTheirLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"type = \"sprng\"", "scene.toml:11:8: type is \"sprng\", expected \"spring\", \"damper\""},
      {"name = \"a\"", "[[element]] lacks the key 'type', expected one"},
      {"type = \"spring\"", "lacks the key 'stiffness', expected a number of N m/rad or N/m"},
      {"type = \"spring\"\nstifness = 1",
       "unknown key 'stifness' in [[element]], the nearest known one is 'stiffness'"},
      {"type = \"damper\"\ndamping = -1", "viscous damper: damping is -1"},
      {"type = \"friction\"\ncoulomb = 1.0\nbreakaway = 0.5\nsmoothing = 0.1", "breakaway is 0.5"},
      {"type = \"force\"",
       "[[element]] has 0 of the keys constant, sine, profile and file, expected one"},
      {"type = \"force\"\nprofile = { times = [0, 0], values = [1, 2] }",
       "profile: point 2 stands at 0"},
      {"type = \"spring\"\nstiffness = 1.0\nelongation = [0, 1]\nforce = [0, 1]",
       "is given with a table of forces"}};
  for (const auto& [keys, text] : cases) {
    TemporaryFolder folder;
    EXPECT_TRUE(says(refusal([&, &k = keys] { scene_with(folder, element(k)); }), text));
  }
  TemporaryFolder folder;
  const auto unknown =
      scene_with(folder, "[[element]]\njoint = \"wrist\"\ntype = \"damper\"\ndamping = 1.0\n");
  EXPECT_TRUE(says(refusal([&] { scene::assemble(unknown); }),
                   "scene.toml:9:1: element 'wrist.damper': the model has no joint 'wrist', "
                   "expected one of: shoulder, elbow"));
  const auto twice = scene_with(folder, element("type = \"damper\"\ndamping = 1.0") +
                                            element("type = \"damper\"\ndamping = 1.0"));
  EXPECT_TRUE(
      says(refusal([&] { scene::assemble(twice); }), "two elements are named 'elbow.damper'"));
}

/// A user's own system: the Duffing oscillator with damping and a drive.
struct Duffing {
  phs::Description description() const {
    return {.name = "duffing",
            .nx = 2,
            .nu = 0,
            .blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}},
            .ports = {},
            .invariants = {},
            .traits = {.autonomous = false, .canonical = true, .lossless = false}};
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[1] * x[1] - x[0] * x[0]) + T(0.25) * x[0] * x[0] * x[0] * x[0];
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(0.1) * e[1];
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[1] = dx[1] + T(0.35) * phs::cos(T(1.4) * t);
  }
};

TEST(Ledger, SystemsOfTheUsersOwnRunLikeScenes) {
  TemporaryFolder folder;
  scene::Scene s;
  s.title = "Duffing";
  s.method = "gauss8";
  s.step = 0.05;
  s.duration = 200;
  s.record_every = 0.5;
  s.verify.balance = 1e-8;
  const double start[] = {1.0, 0.0};
  const auto a = scene::assembly_of(std::make_shared<phs::UserModel<Duffing>>(Duffing{}), start);
  auto o = into(folder / "out");
  o.check_symmetry = true;
  const auto r = scene::run(s, a, o);
  EXPECT_TRUE(r.passed());
  ASSERT_EQ(r.losses.size(), 1u);
  ASSERT_EQ(r.ports.size(), 1u);
  std::printf("  supplied %.3f J, dissipated %.3f J, defect %.1e of what was turned over (1e-8)\n",
              r.supplied_J, r.dissipated_J, r.defect_J / r.turned_over_J);
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  EXPECT_EQ(j["final_state"]["q"]["q"].get<double>(), r.final_state.x[0]);
  EXPECT_TRUE(says(refusal([&] { scene::assembly_of(a.model, std::span(start, 1)); }),
                   "start state has 1 entries, expected 2"));
}

TEST(Ledger, AResumedRunKeepsItsBooksBitForBit) {
  TemporaryFolder folder;
  const std::string elements =
      element("type = \"damper\"\ndamping = 0.4") +
      element("type = \"force\"\nsine = { amplitude = 2, frequency = 0.3 }");
  scene::Scene s = scene_with(folder, elements);
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  std::atomic<bool> stop{false};
  auto o = into(folder / "part");
  o.stop = &stop;
  o.progress = [&](double done, double, double) { stop = done > 0.2; };
  s.duration = 20;
  int parts = 0;
  for (auto r = scene::run(s, a, o);; r = scene::run(s, a, o)) {
    ++parts;
    if (!r.interrupted) {
      EXPECT_EQ(r.supplied_J, whole.supplied_J);
      EXPECT_EQ(r.dissipated_J, whole.dissipated_J);
      EXPECT_EQ(r.defect_J, whole.defect_J);
      break;
    }
    stop = false;
    o.progress = nullptr;
    o.resume = true;
  }
  std::printf("  in %d parts\n", parts);
}

}  // namespace
}  // namespace porthos::test::ledger_test
