// Time series as a table, against run.h5.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "scene/files/hdf5_reader.h"
#include "scene/session/export.h"
#include "scene/session/run.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

namespace porthos::test::export_test {
namespace {

/// Cells of a table; the first row is its head.
std::vector<std::vector<std::string>> cells(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    auto& row = rows.emplace_back();
    for (size_t from = 0; from <= line.size();) {
      const size_t to = std::min(line.find(',', from), line.size());
      row.push_back(line.substr(from, to - from));
      from = to + 1;
    }
  }
  return rows;
}

TEST(Export, HasTheNumbersOfTheFileAndTrueAngles) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf(""));
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[initial]\njoints.shoulder = { "
              "velocity = 9.0 }\n[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = "
              "2.0\nrecord_every = 0.5\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  scene::run(s, scene::assemble(s), into(folder / "out"));
  scene::export_csv(folder / "out", folder / "new/all.csv");
  const auto rows = cells(read_bytes(folder / "new/all.csv"));
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(rows[0][0], "time [s]");
  const auto column = [&](const std::string& head) {
    const auto at = std::ranges::find(rows[0], head);
    EXPECT_NE(at, rows[0].end()) << head;
    std::vector<double> all;
    for (size_t i = 1; i < rows.size(); ++i)
      all.push_back(std::stod(rows[i][size_t(at - rows[0].begin())]));
    return all;
  };
  const scene::Hdf5Reader file(folder / "out/run.h5");
  std::vector<double> kept(5);
  for (const char* name : {"stored/kinetic", "energy_error"}) {
    file.read(name, kept.data());
    EXPECT_EQ(column(std::string(name) + " [J]"), kept) << name;
  }
  // Each angle is that of the file and whole turns; the shoulder has turned more than once.
  file.read("state/shoulder", kept.data());
  const auto angle = column("state/shoulder [rad]");
  for (size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(std::remainder(angle[i] - kept[i], 2 * M_PI), 0, 1e-14);
  EXPECT_GT(angle.back(), 2 * M_PI);
  EXPECT_LE(kept.back(), M_PI);  // control
  const auto heads_of = [&](const char* head) { return std::ranges::count(rows[0], head); };
  EXPECT_EQ(heads_of("quaternion_norm_error [1]"), 0) << "there is no quaternion";
  EXPECT_EQ(heads_of("energy_error [J]"), 1) << "control";

  scene::export_csv(folder / "out", folder / "some.csv", {"momentum", "state/elbow"});
  const auto some = cells(read_bytes(folder / "some.csv"));
  const std::vector<std::string> heads{"time [s]", "momentum/elbow [kg m^2/s]",
                                       "momentum/shoulder [kg m^2/s]", "state/elbow [rad]"};
  EXPECT_EQ(some[0], heads);
  EXPECT_TRUE(says(refusal([&] { scene::export_csv(folder / "out", folder / "x", {"elbow"}); }),
                   "the run has no series 'elbow', expected one of time, "));
  EXPECT_FALSE(fs::exists(folder / "x"));
  EXPECT_TRUE(says(refusal([&] { scene::export_csv(folder / "out", folder / "x.xlsx"); }),
                   "x.xlsx is the name of another kind of file, expected .csv"));
  EXPECT_TRUE(says(refusal([&] { scene::export_csv(folder / "none", folder / "x"); }),
                   "is no folder, expected one with the results of a run"));
}

TEST(Export, NamesComponentsAndTakesOneOfThem) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf(""));
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\nbase.angular_velocity = [0.1, "
              "0.2, 0.3]\n[[output]]\nquantity = 'position'\nname = 'tip'\nlink = 'lower'\n"
              "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  scene::run(s, scene::assemble(s), into(folder / "out"));
  const auto table = [&](const std::vector<std::string>& names) {
    scene::export_csv(folder / "out", folder / "t.csv", names);
    return cells(read_bytes(folder / "t.csv"));
  };
  const auto all = table({"output", "state/base.attitude"});
  const std::vector<std::string> heads{"time [s]",
                                       "output/tip.x [m]",
                                       "output/tip.y [m]",
                                       "output/tip.z [m]",
                                       "state/base.attitude.w [1]",
                                       "state/base.attitude.x [1]",
                                       "state/base.attitude.y [1]",
                                       "state/base.attitude.z [1]"};
  EXPECT_EQ(all[0], heads);
  const auto one = table({"output/tip.y"});
  ASSERT_EQ(one[0], (std::vector<std::string>{"time [s]", "output/tip.y [m]"}));
  for (size_t i = 1; i < all.size(); ++i) EXPECT_EQ(one[i][1], all[i][2]);
  EXPECT_EQ(table({"output/tip.1"}), one) << "by its place";
  EXPECT_TRUE(says(refusal([&] { table({"output/tip.w"}); }), "has no series 'output/tip.w'"));
}

}  // namespace
}  // namespace porthos::test::export_test
