// Laws of a user's own in scenes: in Python and in C the same bits as the library's; what they
// remember is continued; what is wrong with them is said.
#include <cmath>

#include "scene/files/hdf5_reader.h"
#include "scene/session/extension.h"
#include "scene/session/memory_run.h"
#include "scene/session/replot.h"
#include "tests/run/foreign_law.h"
#include "tests/run/shipped.h"

namespace porthos::test::foreign_law_test {

namespace {
scene::RunReport in_memory(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
}  // namespace

class ForeignLaw : public testing::Test {
 protected:
  void SetUp() override {
    if (!have_python()) GTEST_SKIP() << "built without Python";
  }
  scene::Scene python(const std::string& text, double duration = 2, const std::string& more = "") {
    write_bytes(folder / "law.py", text);
    return arm_with_law(folder, "python", in_python, duration, more);
  }
  std::string said(const std::string& text) {
    return refused([&] { in_memory(python(text)); });
  }
  TemporaryFolder folder;
};

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_F(ForeignLaw, TheSampledControllerOfOneJointHasTheBitsOfTheSameLawInPython) {
  write_bytes(folder / "law.py",
              "class Law:\n    def __init__(self, joints): pass\n    def __call__(self, t, q, v):\n"
              "        return 30 * (0.2 - q[0]) + 3 * (0.0 - v[0])\n");
  const auto own = in_memory(arm_with_law(
      folder, "python", "python = \"law.py:Law\"\njoints = [\"elbow\"]\n", 2, "", "20"));
  auto s = arm_with_law(folder, "python", in_python, 2,
                        "[[element]]\ntype = \"controller\"\njoint = \"elbow\"\ntarget = "
                        "0.2\nstiffness = 30\ndamping = 3\nrate = 20\n");
  s.controllers.clear();
  const auto known = in_memory(s);
  EXPECT_EQ(own.final_state.x, known.final_state.x);
  // One row for what two rows say: what the law gives, and what holding it adds.
  EXPECT_NEAR(
      entry_of(own.ports, "law"),
      entry_of(known.ports, "elbow.controller") + entry_of(known.ports, "elbow.controller.hold"),
      1e-13);  // measured 9e-16
  EXPECT_TRUE(own.passed());
}

TEST_F(ForeignLaw, PythonAndCGiveTheSameBits) {
  compile_law(folder, c_law);
  const auto in = in_memory(python(python_law()));
  const auto c = in_memory(arm_with_law(folder, "shared_library", in_c));
  EXPECT_EQ(in.final_state.x, c.final_state.x);
  EXPECT_EQ(entry_of(in.ports, "law"), entry_of(c.ports, "law"));
  EXPECT_TRUE(in.passed() && c.passed());
  // Negative control: without the integral it is another motion.
  const auto p = in_memory(python(python_law("", "        self.sum = [0.0, 0.0]\n")));
  EXPECT_NE(p.final_state.x, c.final_state.x);
}

TEST_F(ForeignLaw, WhatItRemembersIsContinued) {
  compile_law(folder, c_law);
  int bytes = 0;
  for (const std::string language : {"python", "shared_library", "forgetful"}) {
    const bool python_too = language != "shared_library", honest = language != "forgetful";
    write_bytes(folder / "law.py", python_law(honest ? "" : "        self.stateless = True\n"));
    // Instants are 13 steps apart, so that the end is between two of them.
    const auto s = arm_with_law(folder, python_too ? "python" : language,
                                python_too ? in_python : in_c, 4, "", "7.6923076923076925");
    const fs::path whole = folder / (language + "/whole"), parts = folder / (language + "/parts");
    run_into(s, whole);
    EXPECT_TRUE(run_into(s, parts, 123).interrupted);  // between two instants
    EXPECT_TRUE(run_into(s, parts, 240, true).interrupted);
    run_into(s, parts, -1, true);
    // A law that says it remembers nothing begins anew: the negative control.
    EXPECT_EQ(read_bytes(whole / "run.h5") == read_bytes(parts / "run.h5"), honest) << language;
    bytes += int(read_bytes(parts / "run.h5").size());
    if (!honest) continue;
    const fs::path extended = folder / (language + "/extended");
    auto half = s;
    half.duration = 1.5;
    run_into(half, extended);
    auto longer = s;
    scene::extend_to(longer, extended.string(), 4);
    scene::reopen(extended.string(), longer, scene::assemble(longer));
    run_into(longer, extended, -1, true);
    EXPECT_TRUE(read_bytes(whole / "run.h5") == read_bytes(extended / "run.h5")) << language;
  }
  EXPECT_GT(bytes, 3000);
}

/// Samples the first controller of a scene at time t; its memory is renewed. @return its torques
std::vector<double> sampled(const scene::Assembly& a, double t, std::vector<double>& memory) {
  const auto system = a.model->instantiate<double>();
  system->sample(0, t, a.initial.x, memory);
  return {memory.begin(), memory.begin() + 2};
}

TEST_F(ForeignLaw, ItIsAFunctionOfTheMemoryOfItsRun) {
  compile_law(folder, c_law);
  const std::string law = python_law();
  for (const auto& [s, honest] :
       {std::pair{python(law), true},
        {arm_with_law(folder, "shared_library", in_c), true},
        {python(python_law("        self.sum = sums\n        self.stateless = True\n",
                           "        self.sum = sums\n") +
                "sums = [0.0, 0.0]\n"),
         false}}) {
    const auto a = scene::assemble(s);
    const auto begin = a.model->holds()[0]->fresh;
    auto memory = begin;
    const auto first = sampled(a, 0, memory);
    const auto before = memory;
    const auto second = sampled(a, 0.05, memory);
    EXPECT_NE(first, second);
    // Back by one instant, by two, and another run beside this one.
    auto again = before, anew = begin;
    EXPECT_EQ(sampled(a, 0.05, again) == second, honest);
    EXPECT_EQ(sampled(a, 0, anew) == first, honest);  // else: it counts its calls
    EXPECT_EQ(anew == before && again == memory, honest);
  }
}

TEST_F(ForeignLaw, WhatIsWrongIsSaidWithThePlaceInTheLaw) {
  const std::string at_half = "        if t > 0.49: ";
  EXPECT_EQ(said(python_law("", at_half + "1 / 0\n")),
            "controller 'law' at t = 0.5 s: ZeroDivisionError: division by zero (law.py:10)");
  EXPECT_EQ(said(python_law("", at_half + "return q * np.nan\n")),
            "controller 'law' at t = 0.5 s: the torque of 'shoulder' is nan, expected a finite "
            "number");
  EXPECT_TRUE(has(said(python_law("", "        return [1.0]\n")),
                  "the law returned an array of shape (1,), expected (2,)"));
  EXPECT_TRUE(has(said(python_law("        self.file = open(__file__)\n")),
                  "the law's state cannot be pickled (cannot pickle '_io.TextIOWrapper' object)"));
  EXPECT_EQ(said(python_law("        self.file = open(__file__)\n        self.stateless = True\n")),
            "");
  EXPECT_TRUE(has(said("def Law(joints, settings):\n    return lambda t, q, v: q\n"),
                  "Law makes no object whose attributes are its state"));
  EXPECT_TRUE(has(said("class Other: pass\n"), "law.py has no class 'Law'"));
  EXPECT_TRUE(has(said("class Law\n    pass\n"), "SyntaxError: expected ':' (law.py:1)"));
  EXPECT_TRUE(has(said("import sys\nsys.exit(3)\n"), "SystemExit: 3 (law.py:2)"));
  EXPECT_TRUE(has(said(python_law("        self.past = []\n", "        self.past += [t] * 100\n")),
                  "expected memory = "));
  EXPECT_TRUE(has(refused([&] { arm_with_law(folder, "python", "python = \"no.py:Law\"\n"); }),
                  "no.py: No such file"));
  EXPECT_TRUE(has(refused([&] { arm_with_law(folder, "python", "python = \"law.py\"\n"); }),
                  "expected a file and a class"));
}

TEST_F(ForeignLaw, WhatIsWrongWithALibraryIsSaid) {
  compile_law(folder, c_law);
  const auto said = [&](const std::string& keys) {
    return refused([&] { in_memory(arm_with_law(folder, "shared_library", keys, 0.1)); });
  };
  EXPECT_TRUE(has(said("library = \"law.so\"\njoints = [\"elbow\"]\n"),
                  "it is for a shoulder and an elbow"));
  EXPECT_TRUE(has(said("library = \"scene.toml\"\n" + both_joints), "cannot be loaded"));
  EXPECT_TRUE(has(said("library = \"law.so\"\njoints = [\"elbow\", \"elbow\"]\n"), "twice"));
  EXPECT_TRUE(has(said("library = \"law.so\"\njoints = [\"knee\"]\n"), "knee"));
  std::string text = c_law;
  text.replace(text.find("{PORTHOS_LAW_VERSION"), 20, "{7");
  TemporaryFolder other;
  compile_law(other, text);
  EXPECT_TRUE(has(refused([&] { in_memory(arm_with_law(other, "shared_library", in_c)); }),
                  "is of version 7 of porthos_law.h, expected 1"));
}

/// Results are read again without the law, and run no code that lies beside them.
TEST_F(ForeignLaw, ResultsRunNoCode) {
  const TemporaryFolder folder;
  write_bytes(folder / "law.py", python_law());
  const auto s = arm_with_law(folder, "python", in_python);
  scene::run(s, scene::assemble(s), into(folder / "out"));
  const std::string marker = (folder / "marker").string(),
                    hostile = "open('" + marker + "', 'w').write('x')\n" + python_law();
  fs::remove(folder / "law.py");
  write_bytes(folder / "out" / "law.py", hostile);
  EXPECT_EQ(scene::moved_in(folder / "out").mechanisms.size(), 1u);
  EXPECT_FALSE(fs::exists(marker));
  write_bytes(folder / "law.py", hostile);
  (void)scene::assemble(scene::read_scene((folder / "scene.toml").string()));
  EXPECT_TRUE(fs::exists(marker)) << "control: a scene runs it";
}

TEST_F(ForeignLaw, ItSeesOutputsOfTheSceneAsTheyAreRecorded) {
  // The law returns its inputs one after another, instant by instant.
  write_bytes(folder / "law.py",
              "class Law:\n    def __init__(self, joints): self.at = 0\n"
              "    def __call__(self, t, q, v, inputs):\n        assert inputs.shape == (9,)\n"
              "        self.at = (self.at + 1) % 9\n        return inputs[self.at - 1] / 100\n");
  const std::string outputs =
      "[[output]]\nquantity = \"velocity\"\nname = \"speed\"\nlink = \"lower\"\nrelative_to = "
      "\"upper\"\nat = [0, 0, -1]\n"
      "[[output]]\nquantity = \"attitude\"\nname = \"turned\"\nlink = \"body\"\n"
      "[[output]]\nquantity = \"joint_rate\"\nname = \"rate\"\njoint = \"elbow\"\n"
      "[[output]]\nquantity = \"formula\"\nname = \"f\"\nformula = \"rate + speed.x\"\n"
      "[[output]]\nquantity = \"position\"\nname = \"tip\"\nlink = \"lower\"\n"
      "[[output]]\nquantity = \"joint_torque\"\nname = \"tau\"\njoint = \"elbow\"\n";
  const auto floating = [&](const std::string& inputs, const std::string& more = "") {
    arm_with_law(
        folder, "python",
        "python = \"law.py:Law\"\njoints = [\"elbow\"]\ninputs = [" + inputs + "]\n" + more, 1,
        outputs);
    auto text = read_bytes(folder / "scene.toml");
    text.replace(text.find("\"fixed\""), 7, "\"free\"");
    const auto from = text.find("[environment]"), to = text.find("[initial]") + 10;
    text.replace(from, to - from,
                 "[initial]\nbase.angular_velocity = [0.3, 0.2, 0.5]\njoints.elbow.velocity = "
                 "0.4\n");
    write_bytes(folder / "scene.toml", text);
    return scene::read_scene((folder / "scene.toml").string());
  };
  for (const std::string noise : {"", "noise.rate = 1e-3\n"}) {
    const auto s = floating("\"f\", \"speed\", \"turned\", \"rate\"", noise);
    const fs::path out = folder / ("out" + std::to_string(noise.size()));
    run_into(s, out);
    const scene::Hdf5Reader file(out / "run.h5");
    const auto series = [&](const std::string& name) {
      std::vector<double> all(size_t(file.dataset("output/" + name).size()));
      file.read("output/" + name, all.data());
      return all;
    };
    const auto f = series("f"), speed = series("speed"), turned = series("turned"),
               rate = series("rate"), tau = series("tau");
    // Records are 5 steps apart, and so are the instants; the record at an instant is made before.
    for (size_t k = 0; k < 9; ++k) {
      const double seen = k == 0   ? f[0]
                          : k < 4  ? speed[3 * k + k - 1]
                          : k == 8 ? rate[k]
                                   : turned[4 * k + k - 4];
      EXPECT_NEAR(100 * tau[k + 1], seen, 1e-10) << k;  // of what joint_torque is the difference
      EXPECT_NE(seen, 0) << k;
    }
  }
  const auto said = [&](const std::string& inputs) {
    return refused([&] { scene::assemble(floating(inputs)); });
  };
  EXPECT_TRUE(has(said("\"tip\""), "the input 'tip' is a motion in the world where bodies float"));
  EXPECT_TRUE(has(said("\"tau\""), "the input 'tau' is a force"));
  EXPECT_TRUE(has(said("\"hand\""), "there is no [[output]] 'hand'"));
}

TEST_F(ForeignLaw, ThousandSecondsAt100HzCostLittle) {
  const bool longer = std::getenv("PORTHOS_LONG") != nullptr;
  const double duration = longer ? 1000 : 20;
  write_bytes(folder / "law.py", python_law());
  const auto with = in_memory(arm_with_law(folder, "python", in_python, duration, "", "100"));
  compile_law(folder, c_law);
  const auto c = in_memory(arm_with_law(folder, "shared_library", in_c, duration, "", "100"));
  EXPECT_EQ(with.final_state.x, c.final_state.x);
  std::printf("  a law in Python: %.2g us an instant more than in C, %d instants\n",
              1e6 * (with.cpu_s - c.cpu_s) / (100 * duration), int(100 * duration));
}

}  // namespace porthos::test::foreign_law_test
