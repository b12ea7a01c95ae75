// A case of an ensemble as a scene by itself: the bits of the case, from its scene and from its
// results, and what is refused.
#include "scene/ensemble/case_scene.h"

#include "scene/ensemble/ensemble_plot.h"
#include "scene/session/memory_run.h"
#include "tests/ensemble/rows.h"
#include "tests/run/shipped.h"
#include "tests/support/bounds.h"

namespace porthos::test::case_scene_test {
namespace {

using scene::Ensemble, scene::scene_of_case;

const std::string head = R"(title = "Two arms"
[model]
urdf = "two.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.ja = { position = 1.0 }
[integrator]
method = "gauss8"
step = 0.02
[run]
duration = 2.0
record_every = 0.5
[verify]
energy = 1e-6
)";
const std::string law = R"([[controller]]
name = "law"
type = "potential"
rate = 10
joints.ja = { damping = 0.5 }
joints.jb = { damping = 0.5 }
noise = { rate = 0.05 }
)";
const std::string vary = R"([ensemble]
cases = 9
[ensemble.vary]
"initial.joints.*.position" = { uniform = [-2, 2] }
"environment.vector[2]" = { uniform = [-10, -9] }
)";

class CaseScene : public testing::Test {
 protected:
  void SetUp() override { write_bytes(folder_ / "two.urdf", two_arms_urdf()); }
  scene::Scene put(const std::string& text) const {
    write_bytes(folder_ / "scene.toml", text);
    return scene::read_scene((folder_ / "scene.toml").string());
  }
  void run(const scene::Scene& s) const {
    run_ensemble(Ensemble(s), {.out = results().string(), .threads = 1});
  }
  fs::path results() const { return folder_ / "results"; }
  static std::vector<double> numbers(const scene::Scene& s) {
    const auto r = scene::run_in_memory(s, scene::assemble(s), {});
    std::vector<double> all{r.energy.max_rel_error, r.energy.scale_J};
    all.insert(all.end(), r.final_state.x.begin(), r.final_state.x.end());
    return all;
  }
  TemporaryFolder folder_;
};

TEST_F(CaseScene, ThePictureOfTheEnsembleIsDrawnAgainByteForByte) {
  run(put(head + vary));
  const fs::path svg = results() / "ensemble.svg", json = results() / "ensemble.json";
  const std::string drawn = read_bytes(svg);
  fs::remove(svg);
  EXPECT_EQ(scene::replot_ensemble(results()), svg.string());
  EXPECT_EQ(read_bytes(svg), drawn);
  EXPECT_TRUE(says(drawn, "9 cases"));
  EXPECT_TRUE(says(drawn, "limit 10⁻⁶"));
  EXPECT_TRUE(says(refusal([&] { scene::replot_ensemble(folder_ / "none"); }),
                   "has no ensemble.json, expected the results of a finished ensemble"));
  const std::string whole = read_bytes(json);
  write_bytes(json, whole.substr(0, whole.size() / 2));
  EXPECT_TRUE(
      says(refusal([&] { scene::replot_ensemble(results()); }), "ensemble.json is damaged"));
  std::string more = whole;  // cases that ensemble.h5 does not hold
  write_bytes(json, more.replace(more.find("\"cases\": 9"), 10, "\"cases\": 8"));
  EXPECT_TRUE(
      says(refusal([&] { scene::replot_ensemble(results()); }), "has 9 numbers, expected 8"));
}

TEST_F(CaseScene, HasTheBitsOfItsCase) {
  const std::string text = head + law + vary +
                           "\"controller[0].joints.jb.damping\" = "
                           "{ uniform = [0.1, 1] }\n";
  const scene::Scene nominal = put(text);
  const Ensemble e(nominal);
  const auto rows = rows_of(e);
  run(nominal);
  write_bytes(folder_ / "scene.toml", "no scene any more");
  const auto& l = e.layout();
  for (const std::int64_t i : {0, 4, 8}) {
    const auto& row = rows[size_t(i)];
    std::vector<double> expected{row[l.energy], row[l.energy_scale]};
    expected.insert(expected.end(), row.begin() + long(l.x()), row.begin() + long(l.x() + l.nx));
    EXPECT_EQ(numbers(scene_of_case(e, i)), expected) << "from the scene, case " << i;
    const scene::Scene s = scene_of_case(results(), i);
    EXPECT_EQ(numbers(s), expected) << "from the results, case " << i;
    EXPECT_EQ(s.title, "Two arms, case " + std::to_string(i));
    EXPECT_EQ(s.of_case, std::uint64_t(i) + 1);
    EXPECT_FALSE(says(s.text, "[ensemble]"));
    // Controls: the noise is that of the case, and the numbers are.
    scene::Scene other = s;
    other.of_case = 0;
    EXPECT_NE(numbers(other), expected);
    EXPECT_NE(numbers(scene_of_case(results(), i == 0 ? 1 : 0)), expected);
  }
}

TEST_F(CaseScene, KeepsWhatTheCommandLineGaveToTheEnsemble) {
  scene::Scene s = put(head + vary);
  scene::apply(s, {"gauss12", 0.025, 1.0});
  run(s);
  const scene::Scene one = scene_of_case(results(), 3);
  EXPECT_EQ(one.method, "gauss12");
  EXPECT_EQ(one.step, 0.025);
  EXPECT_EQ(one.duration, 1.0);
  // Its results hold its own text, and a run that was interrupted goes on.
  const auto a = scene::assemble(one);
  scene::RunOptions o = into(folder_ / "one");
  const auto whole = scene::run(one, a, o);
  o.out = (folder_ / "two").string();
  o.stop_at = 20;
  EXPECT_TRUE(scene::run(one, a, o).interrupted);
  o.stop_at = -1;
  o.resume = true;
  EXPECT_EQ(scene::run(one, a, o).final_state.x, whole.final_state.x);
  EXPECT_EQ(read_bytes(folder_ / "two" / "run.h5"), read_bytes(folder_ / "one" / "run.h5"));
}

TEST_F(CaseScene, OfATableOfCases) {
  write_bytes(folder_ / "cases.csv",
              "initial.joints.ja.position,environment.vector[2]\n0.25,-9.5\n-1.5,-9.75\n");
  run(put(head + "[ensemble]\ntable = \"cases.csv\"\n"));
  fs::remove(folder_ / "cases.csv");
  const scene::Scene s = scene_of_case(results(), 1);
  EXPECT_EQ(scene::assemble(s).initial.x[0], -1.5);
  EXPECT_EQ(s.urdf.gravity.z, -9.75);
}

/// A swing-up never leaves the middle of the starts, which is none of the cases. Control: starts so
/// near to it that none leaves.
TEST_F(CaseScene, TheMiddleOfARangeIsNoCase) {
  const auto why = [&](const std::string& range) {
    const auto s = shipped(folder_, "furuta_swing_up", {},
                           "[ensemble]\ncases = 3\n[ensemble.vary]\n"
                           "\"initial.joints.swing.position\" = { uniform = " +
                               range + " }\n");
    return refusal([&] { (void)Ensemble(s); });
  };
  EXPECT_EQ(why("[-1.5, 1.5]"), "");
  EXPECT_TRUE(says(why("[-1e-12, 1e-12]"), "\" with 0: "));
  EXPECT_TRUE(says(why("[-1e-12, 1e-12]"), "the start is a rest point of plant and law"));
}

TEST_F(CaseScene, RefusesInOneSentence) {
  const std::string wide = vary + "\"element[0].stiffness\" = { uniform = [-3, 3.5] }\n";
  const scene::Scene s = put(head +
                             "[[element]]\ntype = \"spring\"\njoint = \"jb\"\nstiffness = "
                             "1.0\n" +
                             wide);
  const Ensemble e(s);
  EXPECT_EQ(refusal([&] { scene_of_case(e, 9); }), "there is no case 9, expected one from 0 to 8");
  EXPECT_EQ(refusal([&] { scene_of_case(e, -1); }),
            "there is no case -1, expected one from 0 to 8");
  EXPECT_TRUE(says(refusal([&] { scene_of_case(folder_ / "none", 0); }), "has no ensemble.h5"));
  // A case that its numbers exclude says why, which the ensemble only counts.
  std::string why;
  for (std::int64_t i = 0; i < 9 && why.empty(); ++i) {
    if (e.sampler().values(i).front() >= 0) continue;
    why = refusal([&] { scene::assemble(scene_of_case(e, i)); });
    EXPECT_TRUE(says(why, "stiffness is -")) << why;
    EXPECT_TRUE(says(why, "case " + std::to_string(i) + ": ")) << why;
  }
  EXPECT_NE(why, "") << "no case had a negative stiffness";
  write_bytes(folder_ / "scene.toml", head);
  EXPECT_TRUE(says(refusal([&] { put(head.substr(0, head.find("[verify]")) + "case = -1\n"); }),
                   "case is -1, expected a whole number, 0 or more"));
}

}  // namespace
}  // namespace porthos::test::case_scene_test
