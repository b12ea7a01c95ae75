// Every pair of features runs and its verdict says pass, or it is refused before the run by one
// sentence that names both; and docs/combinations.md says which. After a change: PORTHOS_WRITE=1
// build/native/tests/test_combinations
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "tests/combinations/page.h"
#include "tests/combinations/runs.h"
#include "tests/places.h"
#include "tests/run/foreign_law.h"

namespace porthos::test::combinations {
namespace {

const std::string page_path = std::string(PORTHOS_SOURCE_DIR) + "/docs/combinations.md";

/// What was quoted in this process; with PORTHOS_WRITE the page is written from it when all is
/// done.
class Quotes : public testing::Environment {
 public:
  std::vector<std::pair<int, std::string>> seen;
  void SetUp() override {
    (void)have_python();
    // A thousand small runs, each of which waits for the disk.
    if (fs::exists("/dev/shm")) setenv("TMPDIR", "/dev/shm", 0);
  }
  void TearDown() override {
    if (std::getenv("PORTHOS_WRITE")) write_bytes(page_path, page(seen));
  }
};
Quotes* const quotes =
    static_cast<Quotes*>(testing::AddGlobalTestEnvironment(new Quotes));  // gtest deletes it

class Pairs : public testing::TestWithParam<size_t> {};

TEST_P(Pairs, RunOrAreRefused) {
  const Feature& b = features()[GetParam()];
  const std::string committed = read_bytes(page_path);
  const bool compared = !std::getenv("PORTHOS_WRITE");
  EXPECT_TRUE(!compared || committed.find(row_of(GetParam())) != committed.npos)
      << row_of(GetParam());
  for (size_t j = 0; j < GetParam(); ++j) {
    const Feature& a = features()[j];
    if (alternatives(a, b) || b.mode == Mode::python)
      continue;  // tests/python/test_combinations.py
    const std::string names = fmt::format("{} with {}", a.name, b.name);
    const Seen seen = run_pair(a, b);
    EXPECT_EQ(seen.trouble, "") << names;
    const int expected = refusal_of(a, b);
    EXPECT_TRUE(expected || seen.refusal.empty()) << names << ": " << seen.refusal;
    if (!expected || !seen.trouble.empty()) continue;
    EXPECT_TRUE(names_both(seen.refusal, a, b)) << names << ": " << seen.refusal;
    const std::string line = line_of(a, b, seen.refusal);
    quotes->seen.emplace_back(expected, line);
    EXPECT_TRUE(!compared || committed.find(line) != committed.npos) << line;
  }
}
INSTANTIATE_TEST_SUITE_P(Of, Pairs, testing::Range<size_t>(0, features().size()),
                         [](const auto& i) {
                           std::string name = features()[i.param].name;
                           std::erase_if(name, [](unsigned char c) { return !std::isalnum(c); });
                           return name;
                         });

TEST(Combinations, FewAreRefused) {
  const Count c = count();
  fmt::print("{} pairs, {} refused, {} of them by methods without multipliers\n", c.pairs,
             c.refused, c.by_method);
  EXPECT_LE(c.refused - c.by_method, 0.055 * c.pairs);  // 5.1 %
  for (const Refusal& r : refusals())
    for (const auto* names : {&r.of, &r.with})
      for (const auto& name : *names) EXPECT_NO_THROW(feature(name));
}

/// But for what is quoted the page follows from the tables; the quotes are compared pair by pair.
TEST(Combinations, AreInTheDocumentation) {
  if (std::getenv("PORTHOS_WRITE")) GTEST_SKIP();
  std::istringstream lines(read_bytes(page_path));
  std::string text;
  int quoted = 0;
  for (std::string line; std::getline(lines, line);)
    is_quote(line) ? void(++quoted) : void(text += line + "\n");
  EXPECT_EQ(text, page({})) << "PORTHOS_WRITE=1 build/native/tests/test_combinations";
  EXPECT_EQ(quoted, count().refused);
}

/// Controls: the same harness fails a step that does not resolve the motion, and a sentence that
/// names one of two.
TEST(Combinations, AreJudged) {
  const Seen coarse = run_pair(feature("uniform gravity"), feature("spring"),
                               {{"integrator.method", "'midpoint'"}, {"run.duration", "2"}});
  EXPECT_TRUE(says(coarse.trouble, "fail; energy")) << coarse.refusal;
  EXPECT_FALSE(names_both("[orbit] is given", feature("orbit"), feature("uniform gravity")));
  EXPECT_TRUE(
      names_both("[orbit] is given with gravity", feature("orbit"), feature("uniform gravity")));
  const Seen wrong = run_pair(feature("spring"), feature("damper"), {{"run.duraton", "2"}});
  EXPECT_TRUE(says(wrong.refusal, "duration"));
}

/// For tests/python/test_combinations.py: the scene of each feature, in a folder each.
TEST(Combinations, ScenesForPython) {
  const char* const folder = std::getenv("PORTHOS_SCENES");
  if (!folder) return;
  for (const Feature& f : features())
    if (f.mode == Mode::verify)
      write_scene(fs::path(folder) / f.name, scene_of(f, feature("Python")));
}

}  // namespace
}  // namespace porthos::test::combinations
