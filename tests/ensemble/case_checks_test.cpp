// The failed checks of each case: in its row, in ensemble.h5, in ensemble.json and for the page.
#include "scene/ensemble/case_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/ensemble/case_scene.h"
#include "scene/files/hdf5_reader.h"
#include "scene/session/memory_run.h"
#include "tests/ensemble/rows.h"
#include "tests/run/scenes.h"

namespace porthos::test::case_checks_test {
namespace {

using scene::Ensemble;
using Names = std::vector<std::string>;
using Cases = std::vector<std::int64_t>;

/// A double pendulum from twelve heights; what more is asked of it.
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& more) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
              "\"uniform\"\nvector = [0, 0, -9.81]\n[integrator]\nmethod = \"gauss8\"\nstep = "
              "0.01\n[run]\nduration = 1\n[ensemble]\ncases = 12\n[ensemble.vary]\n"
              "\"initial.joints.shoulder.position\" = { uniform = [0.1, 2.5] }\n" +
                  more);
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string fast =
    "[[output]]\nquantity = \"joint_rate\"\nname = \"rate\"\njoint = \"shoulder\"\n[[output]]\n"
    "quantity = \"formula\"\nname = \"size\"\nformula = \"abs(rate)\"\nunit = \"rad/s\"\n[[stop]]\n"
    "name = \"too fast\"\noutput = \"size\"\nabove = 3\noutcome = \"fail\"\n";

/// The same, of runs that go on to their end.
std::string judged() {
  std::string text = fast;
  text.replace(text.find("\"fail\""), 6, "\"judge\"");
  return text;
}

Names failed_in(const scene::RunReport& r) {
  Names names;
  for (const auto& c : r.checks)
    if (!c.pass) names.push_back(c.name);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST(CaseChecks, ARowNamesThoseThatFailInTheRunOfItsCase) {
  const std::string energy = "[verify]\nenergy = 1e-30\n", both = energy + "balance = 1e-30\n";
  for (const std::string& more : {std::string(), energy, both, fast, both + fast}) {
    const TemporaryFolder folder;
    const Ensemble e(scene_of(folder, more));
    EXPECT_EQ(e.in_lanes(), more.find("stop") == more.npos);
    int failed = 0;
    for (const auto& row : rows_of(e)) {
      const auto s = scene_of_case(e, scene::integer(row[e.layout().index]));
      const auto r = scene::run_in_memory(s, scene::assemble(s), {});
      Names names = e.checks().names_of(scene::integer(row[e.layout().failed]));
      std::sort(names.begin(), names.end());
      EXPECT_EQ(names, failed_in(r));
      failed += !names.empty();
    }
    std::printf("  cases with failed checks: %d of 12\n", failed);
    if (more.empty()) {
      EXPECT_EQ(failed, 0);
    } else if (more == fast) {
      EXPECT_GT(failed, 0);
      EXPECT_LT(failed, 12);
    } else {
      EXPECT_EQ(failed, 12);
    }
  }
}

TEST(CaseChecks, AreCountedAndNamedInTheResults) {
  const TemporaryFolder folder;
  const Ensemble e(scene_of(folder, "[verify]\nenergy = 1e-30\nbalance = 1e-6\n" + fast));
  const auto r = run_ensemble(e, {.out = (folder / "out").string(), .part = {}, .threads = 1});
  ASSERT_EQ(r.failed_checks.size(), 2u);
  EXPECT_EQ(r.failed_checks[0].name, "energy");
  EXPECT_EQ(r.failed_checks[0].count, 12);
  EXPECT_EQ(r.failed_checks[0].first, (Cases{0, 1, 2, 3, 4, 5, 6, 7})) << "no more than eight";
  EXPECT_EQ(r.failed_checks[1].name, "stop.too fast");
  EXPECT_EQ(r.failed_checks[1].count, r.stopped[0]);
  const auto json = nlohmann::json::parse(read_bytes(folder / "out/ensemble.json"));
  EXPECT_EQ(json.at("failed_checks"),
            (nlohmann::json{{"energy", 12}, {"stop.too fast", r.stopped[0]}}));
  EXPECT_EQ(json["first_cases"]["failed_checks"]["energy"], (Cases{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(json["check_limits"],
            (nlohmann::json{{"energy", "1e-30"}, {"stop.too fast", "at most 3 rad/s"}}));
  EXPECT_EQ(json["outputs"]["size"]["unit"], "rad/s");
  EXPECT_EQ(json["requirements"]["stop.too fast"]["limit"], 3);
  EXPECT_EQ(json["requirements"]["stop.too fast"]["unit"], "rad/s");
  int fast_ones = 0;
  for (const auto& one : json.at("first_not_passed")) {
    const auto names = one.at("failed_checks").get<Names>();
    EXPECT_EQ(names.front(), "energy");
    fast_ones += names.size() == 2 && names[1] == "stop.too fast";
  }
  EXPECT_GT(fast_ones, 0);
  EXPECT_LT(fast_ones, 10);
  const scene::Hdf5Reader file(folder / "out/ensemble.h5");
  std::vector<std::int64_t> bits(12);
  file.read("failed_checks", bits.data());
  std::int64_t stopped = 0;
  for (const auto b : bits) stopped += e.checks().names_of(b).size() == 2;
  EXPECT_EQ(stopped, r.stopped[0]);
  EXPECT_TRUE(file.texts("failed_checks").at("names").starts_with("energy\n"));
  EXPECT_EQ(file.texts("outputs/largest").at("units"), "rad/s\nrad/s");
  EXPECT_EQ(file.texts("inputs").at("units"), "rad");
  Cases fast_cases;
  for (std::int64_t i = 0; i < 12; ++i)
    if (e.checks().names_of(bits[size_t(i)]).size() == 2) fast_cases.push_back(i);
  EXPECT_EQ(
      r.failed_checks[1].first,
      Cases(fast_cases.begin(), fast_cases.begin() + long(std::min<size_t>(8, fast_cases.size()))));
}

TEST(CaseChecks, OfStopsThatJudge) {
  const TemporaryFolder folder, other;
  const Ensemble e(scene_of(folder, judged())), ends(scene_of(other, fast));
  const auto r = run_ensemble(e, {.out = (folder / "out").string(), .part = {}, .threads = 1});
  const auto ended =
      run_ensemble(ends, {.out = (other / "out").string(), .part = {}, .threads = 1});
  ASSERT_EQ(r.failed_checks.size(), 1u);
  ASSERT_EQ(ended.failed_checks.size(), 1u);
  EXPECT_EQ(r.failed_checks[0].first, ended.failed_checks[0].first);
  EXPECT_EQ(r.failed_checks[0].count, ended.failed_checks[0].count);
  EXPECT_EQ(r.stopped[0], 0);
  EXPECT_EQ(ended.stopped[0], r.failed_checks[0].count) << "control";
  double largest = -HUGE_VAL, of = -1;
  for (const auto& row : rows_of(e))
    if (const double v = row[e.layout().output_largest() + 1]; v > largest) {
      largest = v;
      of = row[e.layout().index];
    }
  ASSERT_EQ(r.requirements.size(), 1u);
  EXPECT_EQ(r.requirements[0].value, largest);
  EXPECT_EQ(r.requirements[0].of_case, scene::integer(of));
  EXPECT_EQ(r.requirements[0].unit, "rad/s");
  EXPECT_EQ(r.requirements[0].limit, 3);
  EXPECT_EQ(scene::limit_text(e, "stop.too fast"), "at most 3 rad/s");
  EXPECT_EQ(scene::limit_text(e, "stop.other"), "") << "control";
  const auto json = nlohmann::json::parse(read_bytes(folder / "out/ensemble.json"));
  EXPECT_EQ(json["requirements"]["stop.too fast"]["value"], largest);
  EXPECT_FALSE(json.contains("stopped")) << "it ends nothing";
  for (const auto& row : rows_of(e)) EXPECT_EQ(row[e.layout().end_time()], 1);
}

// A requirement that no case could judge has not held: it begins beyond the end, or the case broke
// off before. Control: one that is looked at is never among them.
TEST(CaseChecks, RequirementsThatWereNotJudgedAreCountedApart) {
  const std::string late =
      "[[stop]]\nname = \"late\"\noutput = \"size\"\nabove = 3\nafter = 7\noutcome = \"judge\"\n";
  using Counts = std::vector<std::pair<std::string, Cases>>;
  const auto counted = [&](const std::string& more) {
    const TemporaryFolder folder;
    const Ensemble e(scene_of(folder, more));
    const auto r = run_ensemble(e, {.out = (folder / "out").string(), .part = {}, .threads = 1});
    const auto json = nlohmann::json::parse(read_bytes(folder / "out/ensemble.json"));
    std::vector<std::int64_t> bits(12);
    scene::Hdf5Reader(folder / "out/ensemble.h5").read("not_judged_checks", bits.data());
    std::int64_t in_cases = 0;
    for (const auto b : bits) in_cases += std::int64_t(e.checks().names_of(b).size());
    std::int64_t all = 0;
    Counts counts;
    for (const scene::CaseKind& kind : r.not_judged_checks) {
      EXPECT_EQ(json.at("not_judged_checks").at(kind.name), kind.count);
      all += kind.count;
      counts.emplace_back(kind.name, kind.first);
    }
    EXPECT_EQ(in_cases, all);
    return counts;
  };
  EXPECT_TRUE(counted(judged()).empty());
  EXPECT_EQ(counted(judged() + late), (Counts{{"stop.late", {0, 1, 2, 3, 4, 5, 6, 7}}}));
  const TemporaryFolder folder;
  scene::Scene coarse =
      scene_of(folder, judged() + "[monitor]\nstep_limit = 1e-14\naction = \"stop\"\n");
  coarse.step = 0.1;
  const Ensemble broken(coarse);
  int off = 0;
  for (const auto& row : rows_of(broken)) {
    const scene::CaseLayout& l = broken.layout();
    const bool ended = scene::integer(row[l.status]) == 0;
    off += !ended;
    const Names open = broken.checks().names_of(scene::integer(row[l.open()]));
    EXPECT_EQ(open, ended || scene::integer(row[l.failed]) != 0 ? Names{} : Names{"stop.too fast"});
  }
  std::printf("  cases that broke off: %d of 12\n", off);
  EXPECT_GT(off, 0);
}

TEST(CaseChecks, WhatHasNoNameIsAnother) {
  const scene::CaseChecks checks{scene::Scene()};
  scene::RunReport r;
  r.checks = {{"balance", 1, 0, false}, {"energy", 0, 1, true}, {"outcome", 1, 0, false}};
  EXPECT_EQ(checks.names_of(checks.failed(r)), Names{"balance"});
  r.checks.push_back({"of a later version", 1, 0, false});
  EXPECT_EQ(checks.names_of(checks.failed(r)), (Names{"balance", "another"}));
  scene::Scene many;
  for (int k = 0; k < 100; ++k) {
    scene::Stop stop;
    stop.name = std::to_string(k);
    stop.output = "q";
    stop.fails = true;
    many.stops.push_back(stop);
  }
  const scene::CaseChecks most(many);
  EXPECT_EQ(most.names().size(), 63u) << "the bits of a number that is not negative";
  r.checks = {{"stop.99", 1, 0, false}};
  EXPECT_EQ(most.failed(r), std::int64_t(1) << 62);
}

}  // namespace porthos::test::case_checks_test
