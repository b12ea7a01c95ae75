// `porthos verify` on every scene that is shipped, as far as a test has time for it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::examples_test {
namespace {

/// Shorter durations [s]; a scene that is not listed runs as it is.
const std::map<std::string, double> shorter{
    {"canadarm/scene.toml", 100},       {"dc_motor_arm/scene.toml", 10},
    {"double_pendulum/scene.toml", 50}, {"dzhanibekov/scene.toml", 1000},
    {"envisat_tumble/scene.toml", 2e4}, {"ets_vii/scene.toml", 500},
    {"ets_vii_orbit/scene.toml", 7200}, {"flexible_panel/scene.toml", 5},
    {"ledger/scene.toml", 500},         {"qbmove_arm/scene.toml", 2},
    {"throwing_arm/scene.toml", 0.2},   {"deployment/scene.toml", 20},
    {"four_bar/scene.toml", 20},        {"bricard/scene.toml", 20},
    {"andrews/scene.toml", 0.02},       {"two_arms/scene.toml", 100},
    {"mission/scene.toml", 300},        {"station_keeping/scene.toml", 6000},
    {"box_of_balls/scene.toml", 0.4},   {"quadruped_trot/scene.toml", 5},
};

std::vector<std::string> scenes() {
  const fs::path folder = fs::path(PORTHOS_SOURCE_DIR) / "examples";
  std::vector<std::string> found;
  for (const auto& file : fs::recursive_directory_iterator(folder))
    if (file.path().extension() == ".toml" && file.path().parent_path().filename() != "columns")
      found.push_back(fs::relative(file.path(), folder).string());
  std::sort(found.begin(), found.end());
  return found;
}

struct Answer {
  int code = -1;
  std::string out;
};
Answer porthos([[maybe_unused]] const std::string& arguments) {
  Answer a;
#ifdef PORTHOS_CLI
  FILE* pipe =
      popen((std::string("'") + PORTHOS_CLI + "' " + arguments + " 2>&1 </dev/null").c_str(), "r");
  char piece[4096];
  for (size_t n; (n = fread(piece, 1, sizeof piece, pipe)) > 0;) a.out.append(piece, n);
  const int status = pclose(pipe);
  a.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
#endif
  return a;
}

class VerifyExample : public testing::TestWithParam<std::string> {};

TEST_P(VerifyExample, Passes) {
#ifndef PORTHOS_CLI
  GTEST_SKIP() << "built without the porthos command";
#endif
  TemporaryFolder folder;
  const auto known = shorter.find(GetParam());
  const std::string duration =
      known == shorter.end() ? "" : fmt::format(" --duration {}", known->second);
  const Answer a =
      porthos(fmt::format("verify {}/examples/{} --no-report --out {}{}", PORTHOS_SOURCE_DIR,
                          GetParam(), (folder / "out").string(), duration));
  ASSERT_EQ(a.code, 0) << a.out;
  const auto s = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  EXPECT_EQ(s["verdict"], "pass");
  size_t telling = 0, axioms = 0;
  for (const auto& c : s["checks"]) {
    telling += c["telling"].get<bool>();
    axioms += c["name"].get<std::string>().starts_with("axiom");
  }
  EXPECT_GE(telling, 1u);
  EXPECT_GE(axioms, 8u);
  // The way forth and back is judged, or it is said why not.
  const auto names_symmetry = [](const auto& c) { return c["name"] == "symmetry"; };
  EXPECT_TRUE(std::any_of(s["checks"].begin(), s["checks"].end(), names_symmetry) !=
              std::any_of(s["not_applicable"].begin(), s["not_applicable"].end(), names_symmetry));
  fmt::print("  {} checks, {} telling, {} not applicable, {:.2f} s CPU\n", s["checks"].size(),
             telling, s["not_applicable"].size(), s["cpu_s"].get<double>());
}
std::string test_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Shipped, VerifyExample, testing::ValuesIn(scenes()), test_name);

TEST(VerifyExamples, AreThere) {
  const auto found = scenes();
  EXPECT_GE(found.size(), 17u);
  for (const auto& [scene, seconds] : shorter)
    EXPECT_TRUE(std::binary_search(found.begin(), found.end(), scene)) << scene << " is gone";
}

/// Negative control: the same scene by a method that keeps nothing, with what `run` takes.
TEST(VerifyExamples, VerifyTakesWhatRunTakes) {
#ifndef PORTHOS_CLI
  GTEST_SKIP() << "built without the porthos command";
#endif
  TemporaryFolder folder;
  const Answer a = porthos(fmt::format(
      "verify {}/examples/double_pendulum/scene.toml --no-report --out {} --method rk4 --step 0.2 "
      "--duration 20",
      PORTHOS_SOURCE_DIR, (folder / "out").string()));
  EXPECT_EQ(a.code, 1) << a.out;
  const auto s = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  EXPECT_EQ(s["method"], "rk4");
  EXPECT_EQ(s["step_s"], 0.2);
  EXPECT_EQ(s["steps"], 100);
  EXPECT_EQ(s["verdict"], "fail");
}

/// Limits that mean nothing for the model judge nothing; none at all are the defaults.
TEST(VerifyExamples, NotJudgedIsAnExitCodeOfItsOwn) {
#ifndef PORTHOS_CLI
  GTEST_SKIP() << "built without the porthos command";
#endif
  TemporaryFolder folder;
  const fs::path shipped = fs::path(PORTHOS_SOURCE_DIR) / "examples" / "double_pendulum";
  for (const auto& file : fs::directory_iterator(shipped))
    if (file.path().extension() == ".urdf")
      fs::copy_file(file.path(), folder / file.path().filename().string());
  std::string text = read_bytes(shipped / "scene.toml");
  text.erase(text.find("[verify]"));
  const std::pair<const char*, int> cases[] = {
      {"", 1}, {"[verify]\n", 1}, {"[verify]\nquaternion_norm = 1e-12\n", 4}};
  for (const auto& [verify, code] : cases) {
    write_bytes(folder / "scene.toml", text + verify);
    const Answer a =
        porthos(fmt::format("run {} --no-report --out {} --method rk4 --step 0.2 --duration 20",
                            (folder / "scene.toml").string(), (folder / "out").string()));
    EXPECT_EQ(a.code, code) << verify << a.out;
  }
}

}  // namespace
}  // namespace porthos::test::examples_test
