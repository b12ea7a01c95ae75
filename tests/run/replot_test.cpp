// porthos plot: pictures from run.h5 are those the run has drawn from its log.
#include "scene/session/replot.h"
#include "scene/plot/time_axis.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "scene/files/hdf5_reader.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

namespace porthos::test::replot_test {
namespace {

/// Runs a scene of the arm, arm.urdf, into out/.
scene::Scene run_arm(const TemporaryFolder& folder, const std::string& text) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml", text);
  auto s = scene::read_scene((folder / "scene.toml").string());
  scene::run(s, scene::assemble(s), into(folder / "out"));
  return s;
}

TEST(Replot, PicturesAreThoseOfTheRunByteForByte) {
  const TemporaryFolder folder;
  for (const double damping : {0.0, 0.3}) {
    const Case c = pendulum(folder, damping);
    const fs::path out = folder / ("out" + std::to_string(damping));
    scene::run(c.scene, c.assembly, into(out));
    std::vector<std::string> before;
    for (const char* name : {"energy_error.svg", "ledger.svg"}) {
      before.push_back(read_bytes(out / name));
      fs::remove(out / name);
    }
    const auto files = scene::replot(out);
    ASSERT_EQ(files.size(), 2u);
    EXPECT_EQ(read_bytes(files[0]), before[0]);
    EXPECT_EQ(read_bytes(files[1]), before[1]);
    EXPECT_NE(before[0], before[1]);
  }
}

TEST(Replot, TheMotionIsThatOfTheRunInEveryPhase) {
  const TemporaryFolder folder;
  run_arm(folder,
          "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[environment]\ngravity = 'uniform'\n"
          "vector = [0, 0, -9.81]\n[initial]\njoints.shoulder = { position = 1.2 }\n"
          "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 2\n"
          "[[event]]\ntype = 'lock'\njoint = 'elbow'\nat = 1.0\n");
  std::vector<std::string> before;
  for (const char* phase : {"phase_1", "phase_2"}) {
    const fs::path svg = folder / "out" / phase / "motion.svg";
    before.push_back(read_bytes(svg));
    fs::remove(svg);
  }
  EXPECT_EQ(scene::replot(folder / "out").size(), 6u);
  EXPECT_EQ(read_bytes(folder / "out/phase_1/motion.svg"), before[0]);
  EXPECT_EQ(read_bytes(folder / "out/phase_2/motion.svg"), before[1]);
  EXPECT_NE(before[0].find("elbow"), std::string::npos);
  EXPECT_EQ(before[1].find("elbow"), std::string::npos) << "a locked joint does not move";

  // Single panels: the motion over both phases, a picture for each of the rest.
  EXPECT_EQ(scene::figures(folder / "out", "joints").size(), 1u);
  EXPECT_EQ(scene::figures(folder / "out", "residual").size(), 2u);
  // The instant of the event is marked where both phases are in one picture.
  const std::string mark = ">phase 2: lock of elbow<";
  EXPECT_NE(scene::figures(folder / "out", "joints")[0].find(mark), std::string::npos);
  EXPECT_EQ(scene::figures(folder / "out", "joints", {1.5, 2})[0].find(mark), std::string::npos);
  EXPECT_EQ(scene::figures(folder / "out/phase_2", "joints")[0].find(mark), std::string::npos);
  const auto motion = scene::motion_in(folder / "out", 40);
  const auto line = [](const scene::Motion& m, const std::string& what, const std::string& name) {
    const auto p = std::ranges::find(m.panels, what, &scene::TracePanel::what);
    return std::ranges::find(p->lines, name, &scene::TraceLine::name)->value;
  };
  ASSERT_EQ(motion.t.size(), 40u);
  EXPECT_EQ(motion.t[19], motion.t[20]) << "the instant of the event";
  const auto elbow = line(motion, "joints [rad]", "elbow");
  EXPECT_TRUE(std::isfinite(elbow[19]) && std::isnan(elbow[20]) && std::isnan(elbow[39]));
  const auto shoulder = line(motion, "joints [rad]", "shoulder");
  EXPECT_NEAR(shoulder[19], shoulder[20], 1e-12);
  EXPECT_TRUE(says(refusal([&] { scene::figures(folder / "out", "joins"); }),
                   "what is 'joins', the nearest is 'joints', expected motion, energies, works, "
                   "residual, joints, rates of joints or a line"));
  EXPECT_NE(scene::figures(folder / "out", "shoulder")[0].find(">shoulder [rad]<"),
            std::string::npos);
  // A part of the run: the phases in it keep their place, and only records of none are refused.
  const double end = scene::motion_in(folder / "out/phase_1", 20).panels[0].lines[0].t.back();
  const double last = scene::motion_in(folder / "out", 20).panels[0].lines[0].t.back();
  for (const char* what : {"energies", "residual"}) {
    const auto late = scene::figures(folder / "out", what, {end + 0.01, last});
    ASSERT_EQ(late.size(), 2u);
    EXPECT_EQ(late[0], "") << what;
    EXPECT_NE(late[1], "") << what;
    EXPECT_NE(scene::figures(folder / "out", what, {0, last})[0], "") << "control";
    EXPECT_TRUE(says(refusal([&] {
                       scene::figures(folder / "out", what, {2 * last, 3 * last});
                     }),
                     fmt::format("expected two or more of 0 to {:g} s", last)));
  }
  // The elbow is locked in the second: a panel of it alone has nothing to show.
  EXPECT_TRUE(says(refusal([&] {
                     scene::figures(folder / "out", "elbow", {end + 0.01, last});
                   }),
                   "there are 0 records"));
  EXPECT_NE(scene::figures(folder / "out", "elbow", {0, last})[0].find(">elbow"),
            std::string::npos);
  // A phase by itself is that part of the whole.
  const auto second = scene::motion_in(folder / "out/phase_2", 20);
  EXPECT_EQ(line(second, "joints [rad]", "shoulder"),
            std::vector<double>(shoulder.begin() + 20, shoulder.end()));

  const fs::path summary = folder / "out/summary.json";
  const std::string whole = read_bytes(summary);
  for (const std::string& bad :
       {whole.substr(0, whole.size() / 2), std::string("{\"events\": 3}")}) {
    write_bytes(summary, bad);
    EXPECT_TRUE(
        says(refusal([&] { scene::motion_in(folder / "out", 20); }), "summary.json is damaged"));
  }
}

TEST(Replot, APanelIsChosenByItsName) {
  const TemporaryFolder folder;
  const Case c = pendulum(folder, 0.3);
  scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto figure = [&](const std::string& what) {
    return scene::figures(folder / "out", what).at(0);
  };
  for (const char* what : {"energies", "works", "residual", "energies [J]"}) {
    const auto svg = figure(what);
    const std::string name = std::string(what).substr(0, std::string(what).find(" ["));
    EXPECT_NE(svg.find(">" + name + " ["), std::string::npos) << what;
  }
  EXPECT_NE(figure("works").find("(lost)"), std::string::npos);
  // Of a part they begin at zero.
  const auto works = scene::figures(folder / "out", "works", {5, 6}).at(0);
  EXPECT_NE(works.find(">works since 5 s [J]<"), std::string::npos);
  EXPECT_NE(works.find(">0</text>"), std::string::npos);
  const auto refused = [&](const char* of, const std::string& what) {
    return refusal([&] { scene::figures(folder / of, what); });
  };
  EXPECT_TRUE(says(refused("none", "works"), "is no folder"));
  const Case free = pendulum(folder, 0.0);
  scene::run(free.scene, free.assembly, into(folder / "free"));
  EXPECT_TRUE(says(refused("free", "works"), "has no panel 'works': nothing is supplied or lost"));
}

/// From the left, of the first point that is drawn.
double first_place(const std::string& svg) {
  const std::string points = "points=\"";
  return std::stod(svg.substr(svg.find(points) + points.size()));
}

TEST(Replot, APartOfARunHasItsRecordsAlone) {
  const TemporaryFolder folder;
  const auto s =
      run_arm(folder,
              "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\njoints.elbow = { velocity = 3 "
              "}\n[integrator]\nmethod = 'gauss8'\nstep = 0.02\n[run]\nduration = 8\n");
  const double end = s.duration;
  for (const char* what : {"motion", "energies", "residual", "states"}) {
    const auto drawn = [&](double from, double to) {
      return scene::figures(folder / "out", what, {from, to}).at(0);
    };
    const auto whole = scene::figures(folder / "out", what).at(0);
    EXPECT_EQ(drawn(-HUGE_VAL, HUGE_VAL), whole);
    const auto part = drawn(0.25 * end, 0.75 * end);
    EXPECT_LT(part.size(), whole.size()) << what;
    EXPECT_EQ(first_place(part), first_place(whole)) << what << ": the axis of a part begins there";
    EXPECT_NE(part, drawn(0.25 * end, 0.5 * end)) << what;
    EXPECT_TRUE(
        says(refusal([&] { drawn(2 * end, 3 * end); }), "there are 0 records, expected two"))
        << what;
  }
}

TEST(Replot, TheBeginningOfANameIsEnoughAndAComponentHasItsUnit) {
  const TemporaryFolder folder;
  run_arm(folder,
          "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[[output]]\nquantity = "
          "'joint_wrench'\nname = 'load'\njoint = 'elbow'\n"
          "[integrator]\nmethod = 'gauss8'\nstep = "
          "0.02\n[run]\nduration = 1\n");
  const auto figure = [&](const char* what) { return scene::figures(folder / "out", what); };
  EXPECT_EQ(figure("rates of base"), figure("rates of base, own axes"));
  for (const auto& [what, unit] : {std::pair{"load.mx", "N m"}, {"mx", "N m"}, {"load.fz", "N"}})
    EXPECT_TRUE(says(figure(what).at(0), std::string(what) + " [" + unit + "]")) << what;
  EXPECT_TRUE(says(figure("load").at(0), "load [N m, N]"));
  EXPECT_EQ(figure("rot"), figure("rotation of base"));
  EXPECT_TRUE(says(refusal([&] { figure("rates of"); }), ", 'rates of base, own axes', "));
}

TEST(TimeAxis, OfALatePartTellsItsTicksApart) {
  for (const auto& [first, last] :
       {std::pair{396.0, 400.0}, {0.0, 10.0}, {1e6, 1e6 + 4}, {9e6, 3e7}}) {
    const auto axis = scene::even_times(first, last, 5);
    std::set<std::string> texts;
    for (const auto& tick : axis.ticks) {
      texts.insert(tick.text);
      EXPECT_TRUE(tick.t >= first - 1e-9 && tick.t <= last * (1 + 1e-9)) << tick.t;
    }
    std::printf("  %g to %g: %zu ticks, %s ... %s %s\n", first, last, axis.ticks.size(),
                axis.ticks.front().text.c_str(), axis.ticks.back().text.c_str(), axis.unit.c_str());
    EXPECT_EQ(texts.size(), axis.ticks.size());
    EXPECT_GE(texts.size(), 3u);
  }
}

// A part is thinned by what it has itself: of 4000 records the quarter shows its 1000, or as many
// as a panel has.
TEST(Replot, APartOfALongRunIsNotThinnedAsTheWhole) {
  const TemporaryFolder folder;
  run_arm(folder,
          "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\njoints.elbow = { velocity = 3 "
          "}\n[integrator]\nmethod = 'gauss8'\nstep = 0.02\n[run]\nduration = 80\nrecord_every "
          "= 0.02\n");
  for (const char* what : {"joints", "energies", "residual"}) {
    const auto points = [&](const scene::TimeSpan& span) {
      const std::string svg = scene::figures(folder / "out", what, span).at(0);
      return double(std::ranges::count(svg, ','));
    };
    const double whole = points({}), part = points({20, 40});
    std::printf("  %s: %g coordinates of the whole, %g of a quarter\n", what, whole, part);
    EXPECT_GT(part, 0.5 * whole) << what;
    EXPECT_GT(part, 1.4 * points({20, 26})) << what;
  }
}

TEST(Replot, APanelTellsJointsThatAreInAnother) {
  const TemporaryFolder folder;
  const auto told = [&](const std::string& rate, const std::string& what) {
    run_arm(folder,
            "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\njoints.elbow = { velocity = " +
                rate + " }\n[integrator]\nmethod = 'gauss8'\nstep = 0.02\n[run]\nduration = 20\n");
    const auto svg = scene::figures(folder / "out", what).at(0);
    const size_t at = svg.find("1 other is in '");
    return at == svg.npos ? "" : svg.substr(at, svg.find('<', at) - at);
  };
  EXPECT_EQ(told("-6.0", "joints"), "1 other is in 'turning joints'");
  EXPECT_EQ(told("-6.0", "rates of joints [rad/s]"), "1 other is in 'rates of turning joints'");
  EXPECT_EQ(told("-6.0", "turning joints"), "");
  EXPECT_EQ(told("-0.1", "joints"), "") << "control: none turns often";
}

TEST(Replot, ANameOfTwoPanelsIsRefusedWithTheirUnits) {
  const TemporaryFolder folder;
  write_bytes(folder / "model.urdf", arm_urdf());
  std::string outputs;
  for (const char* joint : {"shoulder", "elbow"})
    for (const char* of : {"rate", "torque"})
      outputs += fmt::format(
          "[[output]]\nquantity = 'joint_{0}'\nname = '{1}_{0}'\njoint = '{1}'\n", of, joint);
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = 'model.urdf'\nbase = 'fixed'\n" + outputs +
                  "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  scene::run(s, scene::assemble(s), into(folder / "out"));
  const auto refused = [&](const std::string& what) {
    return refusal([&] { scene::figures(folder / "out", what); });
  };
  EXPECT_EQ(refused("outputs"),
            "what is 'outputs', the name of several panels, expected one of: outputs [rad/s], "
            "outputs [N m]");
  EXPECT_TRUE(says(refused("output"), "residual, outputs [rad/s], outputs [N m], joints"));
  EXPECT_EQ(refused("joints"), "") << "one panel needs no unit";
  EXPECT_NE(scene::figures(folder / "out", "outputs [N m]")[0].find(">elbow_torque<"),
            std::string::npos);
}

/// A run of a system made in code has no scene: its states are shown, its motion is refused as what
/// it is. Control: the same run with its scene shows the same angles as its motion.
TEST(Replot, ASystemMadeInCodeShowsItsStates) {
  const TemporaryFolder folder;
  scene::Scene turning = pendulum(folder).scene;
  turning.joints["shoulder"] = {1.2, 14};
  turning.duration = 2;
  Case c = make_case(folder, turning, turning.urdf_text);
  scene::run(c.scene, c.assembly, into(folder / "scene"));
  c.scene.text.clear();
  scene::run(c.scene, c.assembly, into(folder / "code"));
  const auto refused = [&](const std::string& what) {
    return refusal([&] { scene::figures(folder / "code", what); });
  };
  const std::string why = refused("motion");
  EXPECT_TRUE(says(why,
                   "code has no mechanism whose motion could be shown, expected a scene or a "
                   "MechanicalModel; what = \"states\" shows its states"))
      << why;
  EXPECT_TRUE(says(refused("joints"), "expected states, energies, works, residual, momenta or"));
  const auto all = scene::figures(folder / "code", "states").at(0);
  EXPECT_TRUE(says(all, ">states [rad]<"));
  EXPECT_TRUE(says(all, ">momenta ["));
  EXPECT_TRUE(says(scene::figures(folder / "code", "elbow").at(0), ">elbow [rad]<"));
  EXPECT_TRUE(says(scene::figures(folder / "scene", "states").at(0), ">states [rad]<"));

  const auto shoulder = [](const scene::Motion& m) {  // of the first panel that has it
    for (const auto& p : m.panels)
      for (const auto& l : p.lines)
        if (l.name == "shoulder") return l.value;
    return std::vector<double>();
  };
  const auto angle = shoulder(scene::states_in(folder / "code", 50)),
             known = shoulder(scene::motion_in(folder / "scene", 50, c.assembly.mechanism));
  ASSERT_EQ(angle.size(), 50u);
  ASSERT_EQ(angle.size(), known.size());
  double off = 0, most = 0;
  for (size_t i = 0; i < angle.size(); ++i) {
    off = std::max(off, std::fabs(angle[i] - known[i]));
    most = std::max(most, std::fabs(angle[i]));
  }
  keeps("states against the motion [rad]", off, 1e-14);
  breaks("control: more than half a turn", most, 3.2);
}

TEST(Replot, FoldersWithoutAFinishedRunAreRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& name) {
    return refusal([&] { scene::replot(folder / name); });
  };
  EXPECT_TRUE(says(refused("none"), "is no folder"));
  fs::create_directories(folder / "run/checkpoint");
  EXPECT_TRUE(says(refused("run"), "unfinished run: continue it with --resume"));
  fs::remove(folder / "run/checkpoint");
  EXPECT_TRUE(says(refused("run"), "has no summary.json"));
  write_bytes(folder / "run/summary.json", "{");
  EXPECT_TRUE(says(refused("run"), "summary.json is damaged"));
  write_bytes(folder / "run/summary.json", "{}");
  EXPECT_TRUE(says(refused("run"), "has no run.h5"));
}

TEST(Replot, DamagedSeriesAreRefused) {
  const TemporaryFolder folder;
  const Case c = pendulum(folder);
  scene::run(c.scene, c.assembly, into(folder / "out"));
  const std::string whole = read_bytes(folder / "out/run.h5");
  const auto refused = [&] { return refusal([&] { scene::replot(folder / "out"); }); };
  for (const double part : {0.0, 0.3, 0.9}) {
    write_bytes(folder / "out/run.h5", whole.substr(0, size_t(part * double(whole.size()))));
    EXPECT_TRUE(says(refused(), "run.h5: it is cut off, damaged or no HDF5 file")) << part;
  }
  // Bytes turned over in the middle: the checksum of the compressed chunk or the file's own
  // structure finds some of them; whatever is found is a sentence, and nothing crashes.
  for (size_t at = whole.size() / 20; at < whole.size(); at += whole.size() / 20) {
    std::string bad = whole;
    for (size_t k = 0; k < 32 && at + k < bad.size(); ++k) bad[at + k] = char(~bad[at + k]);
    write_bytes(folder / "out/run.h5", bad);
    try {
      scene::replot(folder / "out");
    } catch (const InvalidArgument& e) {
      EXPECT_TRUE(says(e.what(), "run.h5"));
    }
  }
}

/// A row of the ledger alone, a work or a stored energy. Controls: a line of the motion comes
/// first, and another name is refused.
TEST(Replot, ARowOfTheLedgerIsAPanel) {
  const TemporaryFolder folder;
  run_arm(folder,
          "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[initial]\njoints.shoulder = { velocity = 1 "
          "}\n[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 2\n"
          "[[element]]\nname = 'grease'\ntype = 'damper'\njoint = 'elbow'\ndamping = 0.1\n"
          "[[element]]\nname = 'elbow'\ntype = 'damper'\njoint = 'shoulder'\ndamping = 0.1\n");
  const auto of = [&](const std::string& what) {
    return scene::figures(folder / "out", what).at(0);
  };
  EXPECT_NE(of("grease").find(">grease [J]<"), std::string::npos);
  EXPECT_NE(of("kinetic").find(">kinetic [J]<"), std::string::npos);
  EXPECT_NE(of("elbow").find(">elbow [rad]<"), std::string::npos);
  EXPECT_TRUE(says(refusal([&] { of("oil"); }), "what is 'oil', the nearest is"));
}

}  // namespace
}  // namespace porthos::test::replot_test
