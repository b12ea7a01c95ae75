// `porthos judge`: the turns of angles. True angles count them; of angles modulo 2π they are known
// where the rates tell of less than half a turn.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "scene/files/hdf5_reader.h"
#include "scene/judge/judge_file.h"
#include "tests/run/recorded_table.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_turns_test {
namespace {

using Angle = std::function<double(double)>;
double as_it_is(double q) { return q; }
double about_zero(double q) { return std::remainder(q, 2 * M_PI); }
double of_fmod(double q) { return std::fmod(q, 2 * M_PI); }

/// A double pendulum whose elbow turns many times against a spring.
class JudgeTurns : public ::testing::Test {
 protected:
  static std::string head(bool spring) {
    return "base = \"fixed\"\n[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n"
           "[verify]\nenergy = 1e-9\n" +
           std::string(spring ? "[[element]]\ntype = \"spring\"\njoint = \"elbow\"\nstiffness = "
                                "1.0\n"
                              : "");
  }
  void run(bool spring, double record_every = 0.01) {
    write_bytes(folder_ / "model.urdf", arm_urdf());
    write_bytes(folder_ / "scene.toml",
                "[model]\nurdf = \"model.urdf\"\n" + head(spring) +
                    "[initial]\njoints.shoulder = { position = 0.4 }\njoints.elbow = { "
                    "velocity = 12.0 }\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n"
                    "[run]\nduration = 10.0\n" +
                    fmt::format("record_every = {}\n", record_every));
    const auto scene = scene::read_scene((folder_ / "scene.toml").string());
    const Case c{scene, scene::assemble(scene)};
    fs::remove_all(folder_ / "out");
    (void)scene::run(c.scene, c.assembly, into(folder_ / "out"));
    table_ = csv_of(c, folder_ / "out");
    write_bytes(folder_ / "map.toml", "[model]\n" + head(spring));
  }
  scene::RunReport judge(const std::string& file) {
    fs::remove_all(folder_ / "judged");
    return scene::judge_file({(folder_ / file).string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "judged").string()});
  }
  /// The file with the rows that are kept.
  scene::RunReport judged(const Angle& angle, const std::function<bool(int)>& kept) {
    std::string text;
    std::istringstream lines(table_);
    int n = -1;
    for (std::string line; std::getline(lines, line); ++n) {
      if (n >= 0 && !kept(n)) continue;
      std::istringstream cells(line);
      int k = 0;
      for (std::string cell; std::getline(cells, cell, ','); ++k)
        text += (k > 0 ? "," : "") +
                (n >= 0 && (k == 1 || k == 2) ? fmt::format("{}", angle(std::stod(cell))) : cell);
      text += "\n";
    }
    write_bytes(folder_ / "run.csv", text);
    return judge("run.csv");
  }
  /// The angle of the elbow at the end, as run.h5 has it.
  double elbow() const {
    const scene::Hdf5Reader file(folder_ / "judged" / "run.h5");
    std::vector<double> q(size_t(file.dataset("state/elbow").size()));
    std::vector<std::int64_t> turns(size_t(file.dataset("turns").size()));
    file.read("state/elbow", q.data());
    file.read("turns", turns.data());
    return q.back() + 2 * M_PI * double(turns.back());
  }
  TemporaryFolder folder_;
  std::string table_;
};

bool every(int) { return true; }
bool hole(int i) { return i < 300 || i >= 637; }
bool few(int i) { return i % 50 == 0; }
bool fewer(int i) { return i % 125 == 0; }

const scene::NotApplicable* undecided(const scene::RunReport& r) {
  const auto at = std::ranges::find(r.not_applicable, "energy", &scene::NotApplicable::name);
  return at != r.not_applicable.end() && at->undecided ? &*at : nullptr;
}
bool notes_say(const scene::RunReport& r, const std::string& part) {
  return std::ranges::any_of(r.notes, [&](const auto& n) { return says(n, part); });
}
const char* const unknown = "the turns of 'elbow' behind row";

TEST_F(JudgeTurns, TrueAnglesCountTheirTurns) {
  run(true);
  const auto whole = judged(as_it_is, every);
  const double end = elbow();
  for (const auto& kept : {every, hole, few}) {
    const auto r = judged(as_it_is, kept);
    keeps("energy of true angles against a spring", r.energy.max_rel_error, 1e-12);
    EXPECT_EQ(r.verdict(), scene::Verdict::pass);
    EXPECT_NEAR(elbow(), end, 1e-12);
    EXPECT_FALSE(notes_say(r, unknown));
  }
}

TEST_F(JudgeTurns, AnglesModuloATurnAreCountedByRatesInCloseRows) {
  run(true);
  (void)judged(as_it_is, every);
  const double end = elbow();
  for (const Angle& angle :
       {Angle(about_zero), Angle(of_fmod), Angle([](double q) { return about_zero(q - 3) + 3; })}) {
    const auto r = judged(angle, every);
    EXPECT_EQ(r.verdict(), scene::Verdict::pass) << r.energy.max_rel_error;
    EXPECT_NEAR(elbow(), end, 1e-12);
    EXPECT_FALSE(notes_say(r, unknown));
  }
}

TEST_F(JudgeTurns, WhereTheyAreNotKnownTheEnergyOfASpringIsNotJudged) {
  run(true);
  for (const auto& kept : {hole, fewer}) {
    const auto r = judged(about_zero, kept);
    breaks("energy with turns guessed", r.energy.max_rel_error, 1e-3);
    EXPECT_EQ(r.verdict(), scene::Verdict::not_judged);
    ASSERT_TRUE(undecided(r));
    EXPECT_TRUE(says(undecided(r)->why, unknown));
  }
  EXPECT_FALSE(undecided(judged(about_zero, few))) << "the rates tell them right";
  EXPECT_TRUE(notes_say(judged(about_zero, hole), "behind row 300 are not known"));
}

/// Control: without a spring nothing depends on the turns.
TEST_F(JudgeTurns, WithoutASpringANoteTellsThem) {
  run(false);
  for (const auto& kept : {hole, few}) {
    const auto r = judged(about_zero, kept);
    keeps("energy without a spring", r.energy.max_rel_error, 1e-12);
    EXPECT_FALSE(undecided(r));
    EXPECT_TRUE(notes_say(r, unknown));
  }
  EXPECT_EQ(judged(about_zero, hole).verdict(), scene::Verdict::pass);
  EXPECT_FALSE(notes_say(judged(about_zero, every), unknown));
}

/// run.h5 of Porthos has the turns beside the angles.
TEST_F(JudgeTurns, ARunOfOursTellsThem) {
  run(true, 0.5);
  const auto r = judge("out/run.h5");
  EXPECT_EQ(r.verdict(), scene::Verdict::pass) << r.energy.max_rel_error;
  const double end = elbow();
  (void)judged(as_it_is, every);
  EXPECT_NEAR(elbow(), end, 1e-12);
}

}  // namespace
}  // namespace porthos::test::judge_turns_test
