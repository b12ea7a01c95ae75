#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/places.h"
#include "tests/run/scenes.h"
#include "tests/support/reference.h"

/// `porthos verify` on every published and generated robot of tests/data: floating free, no
/// gravity, seeded random joints, 100 s.
namespace porthos::test::models_test {
namespace {

constexpr double longest_step = 0.1;  // s
constexpr int most_halvings = 8;
constexpr double energy_bound = 1e-11, momentum_bound = 1e-12, quaternion_bound = 1e-13;

/// What a model needs beyond a scene that only names it. A file that is not listed is tried
/// without.
struct Needs {
  std::vector<std::string> lines;  ///< of [model]; LeavingOutWhatAModelNeeds shows they are needed
  bool rename_world = false;
};

const std::map<std::string, Needs> needs{
    // A massless root that carries one hinge cannot float: turned about the hinge's axis against
    // what hangs on it, it moves no mass. A body of 10 kg takes its place.
    {"models/tree63.urdf", {{"inertia.base = { mass = 10, inertia = [1, 1, 1, 0, 0, 0] }"}}},
    {"reference/pinocchio/urdf/chain30.urdf",
     {{"inertia.base = { mass = 10, inertia = [1, 1, 1, 0, 0, 0] }"}}},
    // Made for a fixed base: their root is called as the inertial frame is, so it gets another
    // name.
    {"reference/pinocchio/urdf/dpend.urdf",
     {{"inertia.root = { mass = 10, inertia = [1, 1, 1, 0, 0, 0] }"}, true}},
    {"reference/pinocchio/urdf/ur5.urdf", {{}, true}},
    // Published with an inertia of arm_1_link that no rigid body can have.
    {"reference/pinocchio/urdf/tiago_continuous.urdf", {{"unphysical_inertia = \"accept\""}}},
};

/// The models there are, as paths below tests/data.
std::vector<std::string> models() {
  std::vector<std::string> found;
  for (const std::string folder : {"models", "reference/pinocchio/urdf"}) {
    for (const auto& file : fs::directory_iterator(data_file(folder)))
      if (file.path().extension() == ".urdf")
        found.push_back(folder + "/" + file.path().filename().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

Needs needs_of(const std::string& model) {
  const auto found = needs.find(model);
  return found == needs.end() ? Needs{} : found->second;
}

struct Answer {
  int code = -1;
  std::string out, err;
  nlohmann::json summary;  ///< of a run that was made
};

/// One model in a folder of its own.
class Verifier {
 public:
  Verifier(std::string model, Needs its_needs)
      : model_(std::move(model)), needs_(std::move(its_needs)) {
    std::string urdf = read_bytes(test::data_file(model_));
    if (needs_.rename_world) urdf = std::regex_replace(urdf, std::regex("\"world\""), "\"root\"");
    write_bytes(folder_ / "model.urdf", urdf);
  }

  Answer run(double step, const std::string& method = "gauss16") const {
    std::string lines;
    for (const auto& line : needs_.lines) lines += line + "\n";
    write_bytes(folder_ / "scene.toml",
                fmt::format(R"([model]
urdf = "model.urdf"
base = "free"
{}[initial]
random = {{ seed = 1, joint_position = 1.5, joint_velocity = 0.5 }}
[integrator]
method = "{}"
step = {}
[run]
duration = 100
[verify]
energy = {}
linear_momentum = {}
angular_momentum = {}
quaternion_norm = {}
)",
                            lines, method, step, energy_bound, momentum_bound, momentum_bound,
                            quaternion_bound));
    Answer a;
#ifdef PORTHOS_CLI
    const std::string command = "cd '" + (folder_ / "").string() + "' && '" + PORTHOS_CLI +
                                "' verify scene.toml --json --out results 2>stderr.txt </dev/null";
    FILE* pipe = popen(command.c_str(), "r");
    char piece[4096];
    for (size_t n; (n = fread(piece, 1, sizeof piece, pipe)) > 0;) a.out.append(piece, n);
    const int status = pclose(pipe);
    a.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    a.err = read_bytes(folder_ / "stderr.txt");
    if (a.code == 0 || a.code == 1 || a.code == 3)
      a.summary = nlohmann::json::parse(read_bytes(folder_ / "results" / "summary.json"));
#endif
    return a;
  }

 private:
  std::string model_;
  Needs needs_;
  TemporaryFolder folder_;
};

/// A number of the summary; one that is not finite stands there as null and fails every bound.
double figure(const nlohmann::json& number) {
  return number.is_number() ? number.get<double>() : HUGE_VAL;
}

struct Errors {
  double energy, linear, angular, quaternion;
  explicit Errors(const nlohmann::json& s)
      : energy(figure(s.at("energy").at("max_rel_error"))),
        linear(figure(s.at("linear_momentum").at("max_rel_error"))),
        angular(figure(s.at("angular_momentum").at("max_rel_error"))),
        quaternion(figure(s.at("quaternion_norm").at("max_error"))) {}
};

int freedoms(const nlohmann::json& summary) {
  int n = 0;
  for (const auto& rate : summary.at("final_state").at("v"))
    n += rate.is_array() ? int(rate.size()) : 1;
  return n;
}

#ifdef PORTHOS_CLI
#define PORTHOS_NEEDS_THE_COMMAND() (void)0
#else
#define PORTHOS_NEEDS_THE_COMMAND() GTEST_SKIP() << "built without the porthos command"
#endif

class VerifyModel : public testing::TestWithParam<std::string> {};

TEST_P(VerifyModel, PassesWithAStepChosenForIt) {
  PORTHOS_NEEDS_THE_COMMAND();
  const Verifier verifier(GetParam(), needs_of(GetParam()));
  double step = longest_step, cpu_of_all = 0;
  Answer a;
  for (int halvings = 0; halvings <= most_halvings; ++halvings, step /= 2) {
    a = verifier.run(step);
    ASSERT_TRUE(a.code == 0 || a.code == 1 || a.code == 3) << "exit code " << a.code << "\n"
                                                           << a.err;
    cpu_of_all += figure(a.summary.at("cpu_s"));
    // Momenta and norms are quadratic at most: Gauss methods keep them with any step.
    const Errors e(a.summary);
    EXPECT_LE(e.linear, momentum_bound) << "step " << step;
    EXPECT_LE(e.angular, momentum_bound) << "step " << step;
    EXPECT_LE(e.quaternion, quaternion_bound) << "step " << step;
    if (a.code == 0) break;
    fmt::print("  step {} s is too long: {}\n", step,
               a.code == 3 ? a.summary.at("outcome").get<std::string>()
                           : fmt::format("energy error {:.1e}", e.energy));
  }
  ASSERT_EQ(a.code, 0) << "no step down to " << step * 2 << " s passes\n" << a.out << a.err;

  const auto& s = a.summary;
  const Errors e(s);
  fmt::print(
      "  {}: {} degrees of freedom, step {} s (bound {}), energy error {:.1e} (bound {:.0e}), "
      "linear "
      "momentum "
      "{:.1e} and angular momentum {:.1e} (bound {:.0e}), quaternion norm {:.1e} (bound {:.0e}), "
      "{:.2f} s CPU, {:.2f} s with the steps that were too long (no bound)\n",
      GetParam(), freedoms(s), step, std::ldexp(longest_step, -most_halvings), e.energy,
      energy_bound, e.linear, e.angular, momentum_bound, e.quaternion, quaternion_bound,
      figure(s.at("cpu_s")), cpu_of_all);
  EXPECT_EQ(s, nlohmann::json::parse(a.out)) << "--json prints what the file holds";
  EXPECT_EQ(s.at("verdict"), "pass");
  EXPECT_EQ(s.at("outcome"), "ok");
  EXPECT_EQ(s.at("method"), "gauss16");
  EXPECT_EQ(s.at("steps"), std::llround(100 / step));
  EXPECT_NEAR(figure(s.at("simulated_s")), 100, 1e-9);
  EXPECT_GT(figure(s.at("energy").at("initial_J")), 0) << "it stands still";
  EXPECT_LE(e.energy, energy_bound);
  std::map<std::string, bool> checked;
  for (const auto& check : s.at("checks")) checked[check.at("name")] = check.at("pass");
  for (const char* name : {"energy", "angular_momentum", "quaternion_norm", "symmetry"})
    EXPECT_TRUE(checked.contains(name) && checked.at(name)) << name;
  // One tree that floats: its centre of mass is not integrated.
  EXPECT_FALSE(checked.contains("linear_momentum"));
  const auto& others = s.at("not_applicable");
  EXPECT_TRUE(std::any_of(others.begin(), others.end(),
                          [](const auto& o) { return o.at("name") == "linear_momentum"; }));
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
  const fs::path path(info.param);
  std::string name = path.stem().string();
  if (info.param.starts_with("reference/")) name += "_of_the_reference";
  return std::regex_replace(name, std::regex("[^A-Za-z0-9_]"), "_");
}
INSTANTIATE_TEST_SUITE_P(Data, VerifyModel, testing::ValuesIn(models()), test_name);

TEST(VerifyModels, AreThere) {
  const auto found = models();
  EXPECT_FALSE(found.empty());
  for (const auto& [model, its_needs] : needs)
    EXPECT_TRUE(std::binary_search(found.begin(), found.end(), model)) << model << " is gone";
}

/// Negative control: what keeps nothing must be told from what keeps it.
TEST(VerifyModels, RungeKuttaFailsAtTheStepGaussPassesWith) {
  PORTHOS_NEEDS_THE_COMMAND();
  const std::string model = "reference/pinocchio/urdf/sat_panda.urdf";
  const Verifier verifier(model, needs_of(model));
  const Answer gauss = verifier.run(longest_step), rk4 = verifier.run(longest_step, "rk4");
  EXPECT_EQ(gauss.code, 0) << gauss.out << gauss.err;
  ASSERT_EQ(rk4.code, 1) << rk4.out << rk4.err;
  const Errors g(gauss.summary), r(rk4.summary);
  fmt::print("  {}, step {} s, bound {:.0e}: energy error {:.1e} with gauss16, {:.1e} with rk4\n",
             model, longest_step, energy_bound, g.energy, r.energy);
  EXPECT_GT(r.energy, energy_bound);
  EXPECT_GT(r.angular, momentum_bound);
  EXPECT_EQ(rk4.summary.at("verdict"), "fail");
}

/// Negative control of the table above: nothing stands there that a model could do without.
TEST(VerifyModels, LeavingOutWhatAModelNeedsIsRefused) {
  PORTHOS_NEEDS_THE_COMMAND();
  const auto expect_refusal = [](const std::string& model, const Needs& less) {
    const Answer a = Verifier(model, less).run(longest_step);
    EXPECT_EQ(a.code, 2) << model;
    EXPECT_TRUE(a.err.starts_with("porthos: model.urdf:")) << model << ": " << a.err;
    EXPECT_EQ(std::count(a.err.begin(), a.err.end(), '\n'), 1) << model << ": " << a.err;
  };
  for (const auto& [model, its_needs] : needs) {
    for (size_t i = 0; i < its_needs.lines.size(); ++i) {
      Needs less = its_needs;
      less.lines.erase(less.lines.begin() + long(i));
      expect_refusal(model, less);
    }
    if (its_needs.rename_world) {
      Needs less = its_needs;
      less.rename_world = false;
      for (auto& line : less.lines)
        line = std::regex_replace(line, std::regex("^inertia.root"), "inertia.world");
      expect_refusal(model, less);
    }
  }
}

/// A massless root with one hinge stays refused when its frame is called massless, too.
TEST(VerifyModels, AMasslessRootWithOneHingeIsIllPosed) {
  PORTHOS_NEEDS_THE_COMMAND();
  for (const std::string model : {"models/tree63.urdf", "reference/pinocchio/urdf/chain30.urdf"}) {
    const Answer a = Verifier(model, {{"links_without_inertia = \"massless\""}}).run(longest_step);
    EXPECT_EQ(a.code, 2) << model;
    EXPECT_TRUE(says(a.err, "joint 'base' moves no inertia"));
  }
}

}  // namespace
}  // namespace porthos::test::models_test
