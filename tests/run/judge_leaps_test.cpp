// `porthos judge`: rows that are missing or held while their times tell nothing of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "scene/judge/judge_file.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_leaps_test {
namespace {

/// A ball on a rail that bounces without loss, and a disk that turns steadily.
class JudgeLeaps : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string mass =
        "<inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1' "
        "ixy='0' ixz='0' iyz='0'/></inertial></link>";
    write_bytes(folder_ / "model.urdf",
                "<robot name='ball'><link name='foot'/><link name='ball'>" + mass +
                    "<link name='disk'>" + mass +
                    "<joint name='rail' type='prismatic'><parent link='foot'/><child link='ball'/>"
                    "<axis xyz='0 0 1'/><limit lower='-9' upper='9' effort='9' velocity='9'/>"
                    "</joint><joint name='hinge' type='continuous'><parent link='foot'/><child "
                    "link='disk'/><axis xyz='0 0 1'/></joint></robot>");
    write_bytes(folder_ / "map.toml",
                "[model]\nbase = \"fixed\"\n[environment]\ngravity = \"uniform\"\nvector = [0, 0, "
                "-10]\n[verify]\nenergy = 1e-9\n");
  }
  /// @param row  the row of the motion that is written with the time of row i; negative: none
  scene::RunReport judged(double h, int n, const std::function<int(int)>& row) {
    std::string text = "t,rail,hinge,v.rail,v.hinge\n";
    int written = 0;
    for (int i = 0; i < n; ++i) {
      if (row(i) < 0) continue;
      const double t = h * row(i), since = std::fmod(t, 0.8), v = 4 - 10 * since;
      text += fmt::format("{},{},{},{},1.3\n", h * written++, (4 - 5 * since) * since, 1.3 * t, v);
    }
    write_bytes(folder_ / "run.csv", text);
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  }
  TemporaryFolder folder_;
};

bool notes_say(const scene::RunReport& r, const std::string& part) {
  return std::ranges::any_of(r.notes, [&](const auto& n) { return says(n, part); });
}
const scene::Check* rates_of(const scene::RunReport& r) {
  const auto at = std::ranges::find(r.checks, "rates", &scene::Check::name);
  return at == r.checks.end() ? nullptr : &*at;
}
const char* const asks = "are rows missing, times not theirs, or values held?";

TEST_F(JudgeLeaps, ABouncingBallHasNone) {
  for (const double h : {0.01, 0.03, 0.17}) {
    const auto r = judged(h, 2000, [](int i) { return i; });
    EXPECT_EQ(r.verdict(), scene::Verdict::pass) << h;
    EXPECT_FALSE(notes_say(r, asks)) << h;
  }
}

TEST_F(JudgeLeaps, RowsThatAreCutFail) {
  const auto r = judged(0.01, 8000, [](int i) { return i < 3000 || i >= 3050 ? i : -1; });
  EXPECT_EQ(r.verdict(), scene::Verdict::fail);
  ASSERT_TRUE(rates_of(r));
  EXPECT_FALSE(rates_of(r)->pass);
  EXPECT_GT(rates_of(r)->value, rates_of(r)->limit);
  EXPECT_TRUE(notes_say(r,
                        "'hinge' moves by 0.663 from row 3000 to 3001, t = 30 s, and its rates "
                        "tell of 0.013 there"));
  EXPECT_TRUE(notes_say(r, asks));
}

/// One row in ten is late by one: no few rows that are missing.
TEST_F(JudgeLeaps, ManyLeapsAreNoMissingRows) {
  const auto late = judged(0.1, 400, [](int i) { return i % 10 == 5 ? i - 1 : i; });
  EXPECT_EQ(late.verdict(), scene::Verdict::fail);
  EXPECT_FALSE(notes_say(late, asks));
}

TEST_F(JudgeLeaps, RowsThatAreHeldFail) {
  const auto late = judged(0.01, 8000, [](int i) { return i < 3000 || i >= 3040 ? i : 3000; });
  EXPECT_EQ(late.verdict(), scene::Verdict::fail);
  EXPECT_TRUE(notes_say(late, asks));
  // The motion goes on from there, so that nothing leaps.
  const auto on = judged(0.01, 8000, [](int i) { return i < 3000 ? i : std::max(3000, i - 40); });
  EXPECT_EQ(on.verdict(), scene::Verdict::fail);
  EXPECT_TRUE(notes_say(on, "moves by 0 from row 3001 to 3041"));
}

}  // namespace
}  // namespace porthos::test::judge_leaps_test
