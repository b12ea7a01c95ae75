// `porthos judge`: a trajectory made elsewhere gets the figures a run of our own has, and a file
// that is wrong a sentence.
#include "scene/judge/judge_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "scene/files/digest.h"
#include "tests/run/recorded_table.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_test {
namespace {

scene::RunReport judge(const TemporaryFolder& folder, const std::string& file,
                       const std::string& map = "") {
  if (!map.empty()) write_bytes(folder / "map.toml", map);
  return scene::judge_file({(folder / file).string(), (folder / "model.urdf").string(),
                            map.empty() ? "" : (folder / "map.toml").string(),
                            (folder / "judged").string()});
}

TEST(Judge, ARunOfOursHasTheSameFigures) {
  for (const char* method : {"rk4", "gauss8"}) {
    TemporaryFolder folder;
    Case c = floating_arm(folder, 20, method);
    c.scene.record_every = c.scene.step;
    const auto ours = scene::run(c.scene, c.assembly, into(folder / "out"));
    write_bytes(folder / "run.csv", csv_of(c, folder / "out"));
    const auto judged = judge(folder, "run.csv"), again = judge(folder, "out/run.h5");
    std::printf("  %-7s energy %.6e, of the CSV %.6e, of run.h5 %.6e\n", method,
                ours.energy.max_rel_error, judged.energy.max_rel_error, again.energy.max_rel_error);
    for (const auto& r : {judged, again}) {
      EXPECT_NEAR(r.energy.scale_J / ours.energy.scale_J, 1, 1e-9);
      EXPECT_EQ(r.records, ours.records);
      EXPECT_TRUE(r.energy.about_centre);
      EXPECT_EQ(r.passed(), std::string(method) == "gauss8")
          << "limits of a scene without [verify]: " << (r.notes.empty() ? "" : r.notes.back());
      if (r.passed()) {
        keeps("energy of doubles", r.energy.max_rel_error, 1e-13);
        keeps("angular momentum of doubles", r.angular_momentum_error, 1e-13);
        keeps("quaternion norm of doubles", r.quaternion_norm_error, 1e-15);
        continue;
      }
      EXPECT_NEAR(r.energy.max_rel_error / ours.energy.max_rel_error, 1, 1e-6);
      if (std::isfinite(ours.energy.growth_exponent))
        EXPECT_NEAR(r.energy.growth_exponent, ours.energy.growth_exponent, 1e-6);
      else
        EXPECT_TRUE(std::isnan(r.energy.growth_exponent));
      EXPECT_NEAR(r.angular_momentum_error / ours.angular_momentum_error, 1, 1e-6);
    }
    const auto j = nlohmann::json::parse(read_bytes(folder / "judged" / "summary.json"));
    EXPECT_EQ(j["method"], "recorded");
    const std::string digest = j["provenance"]["trajectory_sha256"];
    EXPECT_EQ(digest, scene::sha256(read_bytes(folder / "out" / "run.h5")));
    EXPECT_NE(digest, scene::sha256(read_bytes(folder / "run.csv"))) << "control";
    EXPECT_FALSE(fs::exists(folder / "judged" / "records.bin"));
  }
}

TEST(Judge, TorquesAreBooked) {
  TemporaryFolder folder;
  scene::Scene s;
  s.title = "driven";
  s.urdf.gravity = {0, 0, -9.81};
  s.joints["shoulder"] = {0.4, 0};
  s.method = "gauss8";
  s.step = 1e-3;
  s.duration = 5;
  s.record_every = 1e-3;
  s.path = (folder / "scene.toml").string();
  const std::string urdf = arm_urdf();
  write_bytes(folder / "model.urdf", urdf);
  const std::string head =
      "[model]\nurdf = \"model.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
      "\"uniform\"\nvector = [0, 0, -9.81]\n";
  write_bytes(folder / "scene.toml",
              head +
                  "[initial]\njoints.shoulder = { position = 0.4 }\n[[element]]\ntype = "
                  "\"force\"\njoint = \"elbow\"\nsine = { amplitude = 3.0, frequency = 0.4 "
                  "}\n[integrator]\nmethod = \"gauss8\"\nstep = 0.001\n[run]\nduration = "
                  "5.0\nrecord_every = 0.001\n[verify]\nbalance = 1e-12\n");
  const auto scene = scene::read_scene((folder / "scene.toml").string());
  const Case c{scene, scene::assemble(scene)};
  const auto ours = scene::run(c.scene, c.assembly, into(folder / "out"));
  write_bytes(folder / "run.csv", csv_of(c, folder / "out", "elbow"));
  write_bytes(folder / "free.csv", csv_of(c, folder / "out"));
  const std::string map =
      head + "[columns]\ntorque_between = \"linear\"\n[verify]\nenergy = 1e-6\n";
  const auto judged = judge(folder, "run.csv", map);
  ASSERT_EQ(judged.ports.size(), 1u);
  std::printf("  torque gave %.6f J, by the columns %.6f J, defect %.1e J\n", ours.ports[0].second,
              judged.ports[0].second, judged.defect_J);
  EXPECT_EQ(judged.ports[0].first, "elbow.torque");
  EXPECT_NEAR(judged.ports[0].second, ours.ports[0].second, 1e-5) << "lines through a sine: 3.4e-6";
  EXPECT_TRUE(judged.passed()) << judged.energy.max_rel_error;
  EXPECT_FALSE(judge(folder, "free.csv", map).passed()) << "control: energy from nowhere";
}

std::string refusal(const TemporaryFolder& folder, const std::string& csv,
                    const std::string& map = "") {
  write_bytes(folder / "bad.csv", csv);
  try {
    judge(folder, "bad.csv", map);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "it was not refused";
}

namespace {
/// A run of an arm that floats, recorded at every step, as another program might write it.
std::string every_step(const TemporaryFolder& folder) {
  Case c = floating_arm(folder, 5, "gauss8");
  c.scene.record_every = c.scene.step;
  (void)scene::run(c.scene, c.assembly, into(folder / "out"));
  return csv_of(c, folder / "out");
}
std::string in_milliseconds(const std::string& text) {
  std::string all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto comma = line.find(',');
    const bool head = line.starts_with("time");
    all += (head ? "time" : fmt::format("{}", 1000 * std::stod(line))) + line.substr(comma) + "\n";
  }
  return all;
}
scene::Check rates_in(const scene::RunReport& r) {
  for (const auto& check : r.checks)
    if (check.name == "rates") return check;
  ADD_FAILURE() << "no check of rates";
  return {};
}
}  // namespace

/// The check `rates`: the control of each case is the same file as it was written.
TEST(Judge, PositionsMoveAsTheirRatesSay) {
  TemporaryFolder folder;
  const std::string text = every_step(folder);
  const auto rates_of = [&](const std::string& csv, const std::string& map = "") {
    write_bytes(folder / "run.csv", csv);
    fs::remove_all(folder / "judged");
    const auto r = judge(folder, "run.csv", map);
    return std::pair{rates_in(r), r.notes.back()};
  };
  const auto [right, unused] = rates_of(text);
  std::printf("  rates against positions: %.1e, limit %.1e\n", right.value, right.limit);
  EXPECT_TRUE(right.pass);
  EXPECT_LT(right.value, 0.2 * right.limit);

  const auto [late, why] = rates_of(in_milliseconds(text));
  EXPECT_FALSE(late.pass);
  EXPECT_GT(late.value, 0.5);
  EXPECT_NE(why.find("does not move as its rates say"), why.npos) << why;
}

/// Joints that turn more than half a turn between rows have any angle that the rates say: a file in
/// milliseconds does not pass for it. Controls: the same file in seconds, and true angles, which
/// show their turns.
TEST(Judge, TurnsThatAnglesDoNotShowTellNothing) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.joints["shoulder"] = {0.3, 25};
  c.scene.joints["elbow"] = {0.2, 5};
  c.scene.duration = 1;
  c.assembly = scene::assemble(c.scene);
  (void)scene::run(c.scene, c.assembly, into(folder / "out"));
  const std::string counted = csv_of(c, folder / "out");
  std::string text;
  std::istringstream lines(counted);
  for (std::string line; std::getline(lines, line); text += "\n") {
    std::istringstream cells(line);
    int k = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++k)
      text +=
          (k > 0 ? "," : "") + (line.starts_with("time") || k == 0 || k > 2
                                    ? cell
                                    : fmt::format("{}", std::remainder(std::stod(cell), 2 * M_PI)));
  }
  write_bytes(folder / "run.csv", text);
  const auto right = judge(folder, "run.csv");
  EXPECT_TRUE(rates_in(right).pass);
  const auto told = [](const scene::RunReport& r) {
    return std::ranges::any_of(r.notes, [](const auto& n) {
      return says(n,
                  "turns between two rows, which angles do not show: if nothing turns that fast, "
                  "are times in another unit, as milliseconds?");
    });
  };
  EXPECT_FALSE(told(right));
  fs::remove_all(folder / "judged");
  write_bytes(folder / "run.csv", in_milliseconds(text));
  const auto late = judge(folder, "run.csv");
  EXPECT_TRUE(
      std::ranges::none_of(late.checks, [](const auto& check) { return check.name == "rates"; }));
  EXPECT_TRUE(std::ranges::any_of(late.not_applicable, [](const auto& n) {
    return n.name == "rates" && says(n.why, "turns between rows, and its angles do not show them");
  }));
  EXPECT_TRUE(told(late));
  fs::remove_all(folder / "judged");
  write_bytes(folder / "run.csv", in_milliseconds(counted));
  EXPECT_FALSE(rates_in(judge(folder, "run.csv")).pass);
}

TEST(Judge, RowsTooFarApartTellNothingOfRates) {
  TemporaryFolder folder;
  std::string few, degrees;
  Case c = pendulum(folder);
  c.scene.record_every = c.scene.step;
  (void)scene::run(c.scene, c.assembly, into(folder / "out"));
  std::istringstream lines(csv_of(c, folder / "out"));
  int n = 0;
  for (std::string line; std::getline(lines, line); ++n) {
    if (n == 0 || n % 50 == 1) few += line + "\n";
    std::istringstream cells(line);
    int k = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++k)
      degrees += (k > 0 ? "," : "") +
                 (n == 0 || k == 0 ? cell : fmt::format("{}", std::stod(cell) * 180 / M_PI));
    degrees += "\n";
  }
  write_bytes(folder / "run.csv", few);
  const auto r = judge(folder, "run.csv");
  EXPECT_TRUE(std::ranges::none_of(r.checks, [](const auto& c) { return c.name == "rates"; }));
  EXPECT_TRUE(std::ranges::any_of(r.not_applicable, [](const auto& c) {
    return c.name == "rates" && says(c.why, "the rows are too far apart to tell");
  }));
  fs::remove_all(folder / "judged");
  write_bytes(folder / "run.csv", degrees);
  const auto wrong = judge(folder, "run.csv",
                           "[model]\nbase = \"fixed\"\n[environment]\ngravity = "
                           "\"uniform\"\nvector = [0, 0, -9.81]\n");
  EXPECT_FALSE(wrong.passed());
  EXPECT_TRUE(says(wrong.notes.back(), "are angles and rates in degrees?")) << wrong.notes.back();
}

/// Six digits are enough, where the way from row to row has few of them; wrong rates still show.
TEST(Judge, TheDigitsOfAFileAreAllowedFor) {
  TemporaryFolder folder;
  const std::string text = every_step(folder);
  const auto rates_of = [&](double scale) {
    std::string rounded;
    std::istringstream lines(text);
    std::vector<bool> is_rate;
    for (std::string line; std::getline(lines, line); rounded += "\n") {
      std::istringstream cells(line);
      size_t k = 0;
      for (std::string cell; std::getline(cells, cell, ','); ++k) {
        if (k > 0) rounded += ",";
        if (line.starts_with("time")) is_rate.push_back(cell.starts_with("v."));
        rounded += line.starts_with("time")
                       ? cell
                       : fmt::format("{:.5g}", (is_rate[k] ? scale : 1) * std::stod(cell));
      }
    }
    write_bytes(folder / "run.csv", rounded);
    fs::remove_all(folder / "judged");
    return rates_in(judge(folder, "run.csv"));
  };
  const auto check = rates_of(1), wrong = rates_of(1.3);
  std::printf("  five digits: %.1e, limit %.1e; rates 1.3 times: %.1e, limit %.1e\n", check.value,
              check.limit, wrong.value, wrong.limit);
  EXPECT_TRUE(check.pass);
  EXPECT_FALSE(wrong.pass) << "control";
}

/// A brick that spins about a principal axis keeps its energy whatever its attitudes are.
TEST(Judge, AttitudesTurnAsTheirRatesSay) {
  TemporaryFolder folder;
  write_bytes(folder / "brick.urdf",
              "<robot name='brick'><link name='brick'><inertial><mass value='2'/><inertia ixx='1' "
              "iyy='2' izz='3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  const auto judged = [&](double turning, double stated, const std::string& limits) {
    std::string text = "time";
    for (const char* name : {"base.position", "v.base.position", "v.base.attitude"})
      for (int k = 0; k < 3; ++k) text += fmt::format(",{}[{}]", name, k);
    for (int k = 0; k < 4; ++k) text += fmt::format(",base.attitude[{}]", k);
    for (int i = 0; i <= 200; ++i) {
      const double t = 0.05 * i, half = 0.5 * turning * t;
      text += fmt::format("\n{},0,0,0,0,0,0,0,0,{},{},0,0,{}", t, stated, std::cos(half),
                          std::sin(half));
    }
    write_bytes(folder / "brick.csv", text + "\n");
    write_bytes(folder / "map.toml", "[model]\nbase = \"free\"\n" + limits);
    fs::remove_all(folder / "out");
    return scene::judge_file({.file = (folder / "brick.csv").string(),
                              .model = (folder / "brick.urdf").string(),
                              .map = (folder / "map.toml").string(),
                              .out = (folder / "out").string()});
  };
  const std::string energy = "[verify]\nenergy = 1e-6\n";
  EXPECT_TRUE(judged(0.7, 0.7, "").passed());
  EXPECT_TRUE(judged(30, 30, "").passed()) << "1.5 rad from row to row";
  for (const double wrong : {0.0, 0.35, -0.7, 0.7 * M_PI / 180}) {
    const auto r = judged(wrong, 0.7, energy);
    EXPECT_FALSE(r.passed()) << wrong;
    EXPECT_NE(r.notes.back().find("'base.attitude' does not move as its rates say"),
              std::string::npos);
  }
  // The limit of the energy holds for the momenta too: this brick's speed changes.
  const auto r = judged(0.7, 0.7, energy);
  EXPECT_TRUE(std::any_of(r.checks.begin(), r.checks.end(), [](const auto& c) {
    return c.name == "angular_momentum" && c.limit == 1e-6;
  }));
}

/// A brick whose spin grows. Control: one that keeps it.
TEST(Judge, HowAMomentumThatFailsGrowsIsTold) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf",
              "<robot name='brick'><link name='brick'><inertial><mass value='2'/><inertia ixx='1' "
              "iyy='2' izz='3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  const auto notes_of = [&](double grows) {
    std::string text = "time";
    for (const char* name : {"base.position", "v.base.position", "v.base.attitude"})
      for (int k = 0; k < 3; ++k) text += fmt::format(",{}[{}]", name, k);
    for (int k = 0; k < 4; ++k) text += fmt::format(",base.attitude[{}]", k);
    for (int i = 0; i <= 500; ++i) {
      const double t = 0.05 * i, half = 0.35 * (t + 0.5 * grows * t * t);
      text += fmt::format("\n{},0,0,0,0,0,0,0,0,{},{},0,0,{}", t, 0.7 * (1 + grows * t),
                          std::cos(half), std::sin(half));
    }
    write_bytes(folder / "brick.csv", text + "\n");
    fs::remove_all(folder / "judged");
    std::string all;
    for (const auto& note :
         judge(folder, "brick.csv",
               "[model]\nbase = \"free\"\n[verify]\nenergy = 0.1\nangular_momentum = 1e-6\n")
             .notes)
      all += note + "\n";
    return all;
  };
  EXPECT_TRUE(says(notes_of(1e-4), "the error of angular_momentum drifts, like t or faster"));
  EXPECT_FALSE(says(notes_of(0), "the error of"));
}

TEST(Judge, WhatIsWrongIsSaidInASentence) {
  TemporaryFolder folder;
  const auto arm = pendulum(folder);
  const std::string names = "time,shoulder,elbow,v.shoulder,v.elbow\n";
  EXPECT_TRUE(says(refusal(folder, names + "0,1,2,3,4\n0.1,1,2,nan,4\n"),
                   "bad.csv:3: 'v.shoulder' is 'nan', expected a finite number"));
  EXPECT_TRUE(says(refusal(folder, names + "0,1,2,3,4\n0.1,1,2,three,4\n"),
                   "bad.csv:3: 'v.shoulder' is 'three', expected a finite number"));
  EXPECT_TRUE(says(refusal(folder, names + "0,1,2,3,4\n0.2,1,2,3,4\n\n0.1,1,2,3,4\n"),
                   "bad.csv:5: 'time' is 0.1 after 0.2, expected time to go forward"));
  EXPECT_TRUE(says(refusal(folder, names + "0,1,2,3,4\n0.1,1,2,3\n"),
                   "bad.csv:3: the row has 4 numbers, expected 5"));
  EXPECT_TRUE(says(refusal(folder, "time,shoulder,elbow,v.shoulder\n0,1,2,3\n1,1,2,3\n"),
                   "no column for the rate of 'elbow', expected 'v.elbow' or a [columns.v]"));
  EXPECT_TRUE(
      says(refusal(folder, "Time,shoulder\n0,1\n1,1\n"), "bad.csv:1: there is no column 't'"));
  EXPECT_TRUE(says(refusal(folder, names + "0,1,2,3,4\n"), "1 row of numbers, expected 2 or more"));
  EXPECT_TRUE(says(refusal(folder, "time,time\n0,1\n"), "two columns are called 'time'"));
  EXPECT_TRUE(says(refusal(folder, "0,1,2,3,4\n0.1,1,2,3,4\n"),
                   "bad.csv:1: the line has numbers, expected the names of the columns"));
  const std::string good = names + "0,1,2,3,4\n0.1,1,2,3,4\n";
  EXPECT_TRUE(says(refusal(folder, good, "[columns]\n[columns.q]\nelbow = \"elbw\"\n"),
                   "there is no column 'elbw', the nearest one is 'elbow'"));
  EXPECT_TRUE(says(refusal(folder, good, "[columns]\n[columns.q]\nknee = \"elbow\"\n"),
                   "map.toml:3:1: columns.q.knee: the model has no coordinate of this name"));
  EXPECT_TRUE(says(refusal(folder, good, "[columns]\nspeed = 1\n"), "unknown key 'speed'"));
  EXPECT_TRUE(says(refusal(folder, good, "[columns]\ntime = \"time\"\n[verify]\nenrgy = 1\n"),
                   "map.toml:4:1: unknown key 'enrgy'"));
  EXPECT_TRUE(says(refusal(folder, good, "[columns.q]\nelbow = [\"elbow\", \"shoulder\"]\n"),
                   "map.toml:2:1: columns.q.elbow has 2 columns, expected 1"));
  write_bytes(folder / "bad.csv", good);
  EXPECT_NO_THROW(judge(folder, "bad.csv")) << "control";
}

}  // namespace
}  // namespace porthos::test::judge_test
