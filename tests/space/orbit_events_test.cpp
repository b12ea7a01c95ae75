#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/run/checkpoint.h"
#include "scene/run/phase_sequence.h"
#include "space/split_integrator.h"
#include "tests/places.h"
#include "tests/run/killed.h"
#include "tests/run/scenes.h"

// Capture, locking and release in orbit: scenes whose mechanism changes about a centre of mass that
// does not notice.
namespace porthos::scene::orbit_events_test {
namespace {

using test::says;
namespace fs = std::filesystem;

/// A line of a table, as in tests/support/bounds.h, whose refusal() is another than that of
/// scenes.h.
void keeps(const std::string& what, double measured, double bound) {
  std::printf("  %-58s %.1e   bound %.1e\n", what.c_str(), measured, bound);
  EXPECT_LE(measured, bound) << what;
}

std::string source(const std::string& name) {
  return test::read_bytes(std::string(PORTHOS_SOURCE_DIR) + "/examples/capture/" + name);
}

/// The example, shorter, each replacement made.
using Edits = std::vector<std::pair<std::string, std::string>>;
Scene orbit_scene(const test::TemporaryFolder& folder, const Edits& edits = {}) {
  test::write_bytes(folder / "servicer.urdf", source("servicer.urdf"));
  std::string text = source("orbit.toml");
  Edits all{{"at = 2800.0", "at = 260.0"}, {"duration = 3000.0", "duration = 300.0"}};
  all.insert(all.end(), edits.begin(), edits.end());
  for (const auto& [from, to] : all) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  test::write_bytes(folder / "scene.toml", text);
  return read_scene((folder / "scene.toml").string());
}
double row(const RunReport::Named& list, const std::string& name) {
  for (const auto& [key, joule] : list)
    if (key == name) return joule;
  return NAN;
}

TEST(OrbitEvents, CaptureLockAndReleaseAboutOneCentre) {
  test::TemporaryFolder folder;
  const Scene s = orbit_scene(folder);
  const auto r = run(s, assemble(s), test::into(folder / "out"));
  for (const auto& c : r.checks)
    std::printf("  %-34s %.2e limit %.0e\n", c.name.c_str(), c.value, c.limit);
  ASSERT_TRUE(r.passed());
  ASSERT_TRUE(r.space);
  const auto j = nlohmann::json::parse(test::read_bytes(folder / "out" / "summary.json"));
  ASSERT_EQ(j["events"].size(), 5u);
  const double lost = row(r.losses, "capture of target by hand");
  EXPECT_EQ(lost, j["events"][0]["dissipated_J"].get<double>());
  // About as much as in free space, where the gradient has not pulled them for 20 s.
  EXPECT_NEAR(lost, 0.074, 0.005);
  EXPECT_LT(row(r.losses, "release of target"), 1e-25);
  for (const char* name : {"orbital", "internal", "coupling"})
    EXPECT_TRUE(j["ledgers"].contains(name)) << name;

  // The orbit does not notice: the last state before an event and the first after it share its
  // bits.
  for (const int k : {1, 2, 3}) {
    const auto end = read_checkpoint(folder / "out" / ("phase_" + std::to_string(k)) / "end").state;
    const size_t n = end.x.size() - 6;
    double momentum = 0;
    for (size_t i = 0; i < 6; ++i) EXPECT_TRUE(std::isfinite(end.x[n + i]));
    const auto next = nlohmann::json::parse(
        test::read_bytes(folder / "out" / ("phase_" + std::to_string(k + 1)) / "summary.json"));
    momentum = next["linear_momentum"]["max_rel_error"];
    keeps("linear momentum about the centre, phase " + std::to_string(k + 1), momentum, 1e-16);
  }
  // Across the events the ledgers go on: their sums are those of the phases.
  double orbital = 0, coupling = 0, dissipated = 0;
  for (int k = 1; k <= 4; ++k) {
    const auto p = nlohmann::json::parse(
        test::read_bytes(folder / "out" / ("phase_" + std::to_string(k)) / "summary.json"));
    orbital += p["ledgers"]["orbital"]["change_J"].get<double>();
    coupling += p["ledgers"]["coupling"]["change_J"].get<double>();
    dissipated += p["balance"]["dissipated_J"].get<double>();
  }
  EXPECT_NEAR(r.space->orbital.change, orbital, 1e-9 * std::fabs(orbital));
  EXPECT_NEAR(r.space->coupling.change, coupling, 1e-12);
  double plastic = 0;
  for (const auto& e : j["events"]) plastic += e["dissipated_J"].get<double>();
  EXPECT_NEAR(r.dissipated_J, dissipated + plastic, 1e-12);
  // The potential of the gradient is that of positions, which an event leaves: it ends where it
  // would.
  EXPECT_LT(std::fabs(r.space->coupling.defect), 1e-2 * r.space->coupling.scale);
}

TEST(OrbitExample, DampersTakeTheSawtoothOfTheKicks) {
  // What the coupling ledger of the year loses, docs/space.md: between kicks the momenta lag behind
  // the smooth motion, and the dampers take of that 2 c h² Fᵀ M⁻¹ D M⁻¹ F, c the number of the
  // splitting's error in h² ε².
  test::TemporaryFolder folder;
  Scene s = read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/ets_vii_orbit/scene.toml");
  s.duration = 60000;
  s.record_every = 6000;
  s.extrema = Extrema::none;
  const auto defect = [&](const char* splitting, double h) {
    s.orbit->splitting = splitting;
    s.step = h;
    const auto r = run(s, assemble(s), test::into(folder / (splitting + std::to_string(h))));
    keeps(std::string(splitting) + ": internal ledger", r.energy.max_rel_error, 1e-11);
    keeps("defect of the coupling over what its gradient turned over",
          std::fabs(r.space->coupling.defect) / r.space->coupling.turned_over, 1e-3);
    return r.space->coupling.defect;
  };
  // (strang's own swing, bounded and of order h² in ε, is as large as this after so short a time.)
  const double four = defect("lobatto4", 12), half = defect("lobatto4", 6),
               six = defect("lobatto6", 12);
  std::printf("  lobatto4 %.3e, at half the step %.3e, lobatto6 %.3e J\n", four, half, six);
  EXPECT_NEAR(six / four, 72 * (13 - 5 * std::sqrt(5.0)) / 288, 0.03);
  EXPECT_NEAR(four / half, 4, 0.2);
}

TEST(OrbitEvents, WhatCannotBeIsRefusedWithItsLine) {
  struct Case {
    const char *from, *to, *says;
  };
  for (const Case& c :
       {Case{"reach = 0.05", "reach = 0.001", "capture of 'target' by 'hand': the distance is"},
        {"speed = 0.02", "speed = 0.0001", "the relative speed is"},
        {"rate = 0.1", "rate = 0.01", "the relative rate is 0.05"},
        {"type = \"lock\"", "type = \"unlock\"", "the joint 'shoulder' is not locked"},
        {"type = \"release\"", "type = \"unlock\"", "'body'"},
        {"position = [3.74347", "position = [12000.0", "km from the common centre of mass"},
        {"altitude = 500e3", "altitude = -5e3", "below the surface of the planet"},
        {"splitting = \"strang\"", "drag = { density = 1e-12, altitude = 4e5, scale_height = 6e4 }",
         "area_coefficient"},
        {"splitting = \"strang\"", "epoch = \"2026-02-30T00:00:00\"", "epoch"},
        {"splitting = \"strang\"", "moon = true", "is given without an epoch"},
        {"splitting = \"strang\"", "plates = [{ link = \"bus\", area = 1.0, normal = [0, 0, 1] }]",
         "expected drag or sunlight"},
        {"extrema = \"all\"", "extrema = \"some\"", "expected \"none\" or \"state\" or \"all\""}}) {
    test::TemporaryFolder folder;
    const auto refused = test::refusal([&] {
      const auto s = orbit_scene(folder, {{c.from, c.to}});
      const auto r = run(s, assemble(s), test::into(folder / "out"));
      EXPECT_FALSE(r.passed());  // a capture that misses: its note says why
      if (!r.notes.empty()) throw InvalidArgument(r.notes.back());
    });
    EXPECT_TRUE(says(refused, c.says)) << c.from << " -> " << c.to;
  }
}

/// At the controller, not at [orbit] and not at the first event.
TEST(OrbitEvents, ARateThatMissesTheStepsIsRefusedWhereItIsStated) {
  const std::string
      element = "[[element]]                       # the arm holds its place, softly\n",
      law =
          "[[controller]]\ntype = \"wheel_attitude\"\nname = \"aocs\"\nlink = "
          "\"bus\"\nwheels = [\"wheel_x\", \"wheel_y\", \"wheel_z\"]\nstiffness = [4, "
          "4, 4]\ndamping = [90, 90, 90]\n";
  const auto why = [&](const std::string& tables) {
    test::TemporaryFolder folder;
    return test::refusal([&] {
      const auto s = orbit_scene(folder, {{element, tables}});
      (void)rehearse(s, assemble(s));
    });
  };
  const auto said = why(law + "rate = 7.0\n" + element);
  EXPECT_TRUE(says(said, "scene.toml:59:1: the controller 'aocs."));
  EXPECT_TRUE(says(said, " is sampled every 0.142857143 s"));
  EXPECT_FALSE(says(said, "after the")) << said;
  keeps("places in the message", double(std::ranges::count(said, ':')), 3);
  EXPECT_TRUE(says(why(element + "rate = 7.0\n"),
                   "scene.toml:59:1: the controller 'shoulder.controller' is sampled every"));
  EXPECT_EQ(why(law + "rate = 10.0\n" + element), "") << "control";
}

TEST(OrbitEvents, TheMonitorWatchesTheInternalLedger) {
  test::TemporaryFolder folder;
  const Edits calm{{"[run]", "[monitor]\nlimit = 1e-10\naction = \"stop\"\n[run]"}};
  auto s = orbit_scene(folder, calm);
  auto r = run(s, assemble(s), test::into(folder / "calm"));
  EXPECT_TRUE(r.passed());
  // A method that does not keep its ledger is caught.
  Edits rough = calm;
  rough.push_back({"method = \"gauss12\"", "method = \"rk4\""});
  rough.push_back({"step = 0.1", "step = 0.5"});
  rough.push_back({"limit = 1e-10", "limit = 1e-14"});
  s = orbit_scene(folder, rough);
  r = run(s, assemble(s), test::into(folder / "rough"));
  EXPECT_FALSE(r.passed());
  EXPECT_NE(r.outcome, integrators::Outcome::ok);
}

// What the monitor projects is the internal motion, which keeps its angular momentum between the
// kicks: the energy of its ledger is met and the ledger of the angular momentum does not notice.
// (Strang's splitting with gauss4 at 0.5 s.)
TEST(OrbitEvents, TheMonitorProjectsTheInternalMotion) {
  test::TemporaryFolder folder;
  const Edits rough{{"method = \"gauss12\"", "method = \"gauss4\""}, {"step = 0.1", "step = 0.5"}};
  Edits projected = rough;
  projected.push_back({"[run]", "[monitor]\nproject = true\n[run]"});
  auto s = orbit_scene(folder, rough);
  const auto without = run(s, assemble(s), test::into(folder / "without"));
  s = orbit_scene(folder, projected);
  const auto a = assemble(s);
  const auto with = run(s, a, test::into(folder / "with"));
  ASSERT_EQ(with.outcome, integrators::Outcome::ok);
  std::printf("  energy %.1e without\n", without.energy.max_rel_error);
  keeps("energy of the internal motion", with.energy.max_rel_error, 1e-14);
  keeps("angular momentum less impulses", with.space->angular_defect, 1e-16);
  keeps("orbital ledger", with.space->orbital.relative(), 1e-15);
  EXPECT_GT(without.energy.max_rel_error, 1e-11);
  // Control: with the invariants of the whole, where there is none, the angular momentum goes with
  // the energy.
  const auto defect = [&](const phs::Model* kept) {
    integrators::MonitorOptions o{.project = true, .keeps = kept};
    integrators::EnergyMonitor method(make_integrator(s, *a.model, s.step), *a.model, s.step, o);
    phs::State x = a.initial;
    for (int k = 0; k < 200; ++k) EXPECT_EQ(method.step(x), integrators::Outcome::ok);
    return dynamic_cast<space::SplitIntegrator&>(method.inner()).ledgers().report().angular_defect;
  };
  const double internal = defect(&a.spacecraft->internal()), whole = defect(a.model.get());
  std::printf("  angular defect %.1e, %.1e with the invariants of the whole\n", internal, whole);
  EXPECT_GT(whole, 100 * internal);
}

// A step that is taken again takes its kicks out of the three ledgers first. Without a monitor this
// method does not get through the stiff arm at this step.
TEST(OrbitEvents, TheMonitorRepeatsSteps) {
  test::TemporaryFolder folder;
  const Edits rough{{"method = \"gauss12\"", "method = \"rk4\""}, {"step = 0.1", "step = 0.2"}};
  Edits watched = rough;
  watched.push_back({"[run]", "[monitor]\nstep_limit = 1e-9\naction = \"repeat\"\n[run]"});
  const auto go = [&](const Edits& edits, const char* name) {
    const auto s = orbit_scene(folder, edits);
    return run(s, assemble(s), test::into(folder / name));
  };
  EXPECT_NE(go(rough, "rough").outcome, integrators::Outcome::ok);
  const auto r = go(watched, "watched");
  ASSERT_EQ(r.outcome, integrators::Outcome::ok);
  bool repeated = false;
  for (const auto& note : r.notes)
    repeated = repeated || note.find("taken again in smaller parts") != std::string::npos;
  EXPECT_TRUE(repeated);
  keeps("orbital ledger", std::fabs(r.space->orbital.defect) / r.space->orbital.scale, 1e-16);
  keeps("internal balance", std::fabs(r.defect_J) / r.turned_over_J, 1e-5);
}

TEST(OrbitEvents, KilledAtRandomMomentsItEndsWithTheSameBits) {
  const bool longer = std::getenv("PORTHOS_LONG") != nullptr;
  test::TemporaryFolder folder;
  Scene s = orbit_scene(folder);
  const Assembly a = assemble(s);
  RunReport whole;
  const double seconds = test::seconds_of([&] { whole = run(s, a, test::into(folder / "whole")); });
  s.checkpoint_every = 0;
  std::srand(3);
  int killed = 0;
  const auto part = [&](int before) { run(s, a, test::into(folder / "parts", before > 0)); };
  ASSERT_NO_FATAL_FAILURE(
      test::kill_at_random(longer ? 20 : 3, (longer ? 0.08 : 0.4) * seconds, part, killed));
  std::printf("  killed %d times in a run of %.2f s\n", killed, seconds);
  EXPECT_GE(killed, longer ? 10 : 1);
  // Edited meanwhile, it is another run, wherever it was killed.
  Scene edited = s;
  edited.text += "\n";
  const auto first = folder / "parts" / "phase_1";
  if (has_checkpoint(first / "checkpoint") || has_checkpoint(first / "end")) {
    EXPECT_TRUE(says(test::refusal([&] { run(edited, a, test::into(folder / "parts", true)); }),
                     "the scene file has changed"));
  }
  const auto r = run(s, a, test::into(folder / "parts", true));
  EXPECT_TRUE(r.final_state == whole.final_state);
  EXPECT_EQ(r.records, whole.records);
  EXPECT_EQ(r.space->orbital.defect, whole.space->orbital.defect);
  for (int k = 1; k <= 4; ++k) {
    const auto phase = "phase_" + std::to_string(k);
    EXPECT_TRUE(test::read_bytes(folder / "whole" / phase / "run.h5") ==
                test::read_bytes(folder / "parts" / phase / "run.h5"))
        << phase;
  }
}

}  // namespace
}  // namespace porthos::scene::orbit_events_test
