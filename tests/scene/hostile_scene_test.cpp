// A scene file is input like any other: whatever stands in it, it is read, or refused by a sentence
// that says where.
#include <random>
#include <regex>

#include "scene/assemble/assembly.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::hostile_scene_test {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}
std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& l : lines) text += l + "\n";
  return text;
}

/// Reads scenes that lie beside the files of an example.
class Reading {
 public:
  explicit Reading(const std::string& example) {
    const fs::path examples = fs::path(PORTHOS_SOURCE_DIR) / "examples";
    fs::copy(examples / example, folder_ / "x", fs::copy_options::recursive);
    fs::copy(examples / "ets_vii", folder_ / "ets_vii", fs::copy_options::recursive);  // of two
    path_ = folder_ / "x" / "scene.toml";
    lines = lines_of(read_bytes(path_));
  }
  void attempt(const std::string& text) {
    write_bytes(path_, text);
    ++tried;
    try {
      scene::read_scene(path_.string());
    } catch (const InvalidArgument& e) {
      ++refused;
      EXPECT_NE(std::string(e.what()).find((folder_ / "").string()), std::string::npos) << e.what();
    }
  }

  std::vector<std::string> lines;
  int tried = 0, refused = 0;

 private:
  TemporaryFolder folder_;
  fs::path path_;
};

class HostileScene : public testing::TestWithParam<const char*> {};

TEST_P(HostileScene, EachLineLeftOutOrExchangedIsReadOrRefused) {
  Reading r(GetParam());
  const auto whole = r.lines;
  r.attempt(joined(whole));
  ASSERT_EQ(r.refused, 0);
  static const std::regex pair("^\\s*([^=#\\[]+)=");
  const char* const values[] = {"0",    "-1", "1e300", "nan",        "9223372036854775807",
                                "\"\"", "[]", "{}",    "1979-05-27", "[[1], \"x\"]",
                                "true"};
  for (size_t i = 0; i < whole.size(); ++i) {
    auto lines = whole;
    lines[i].clear();
    r.attempt(joined(lines));
    std::smatch m;
    if (!std::regex_search(whole[i], m, pair)) continue;
    for (const char* value : values) {
      lines[i] = m[1].str() + " = " + value;
      r.attempt(joined(lines));
    }
  }
  std::printf("  %d scenes, %d refused\n", r.tried, r.refused);
  EXPECT_GT(r.tried, 150);
  EXPECT_GT(r.refused, r.tried / 3);
}

TEST_P(HostileScene, EachPrefixAndDamagedTextIsReadOrRefused) {
  Reading r(GetParam());
  const std::string whole = joined(r.lines);
  for (size_t n = 0; n < whole.size(); n += 7) r.attempt(whole.substr(0, n));
  std::mt19937_64 random(3);
  for (int k = 0; k < 200; ++k) {
    std::string bad = whole;
    for (int n = 0; n < 1 + k % 5; ++n) bad[random() % bad.size()] = char(random());
    r.attempt(bad);
  }
  std::printf("  %d texts, %d refused\n", r.tried, r.refused);
  EXPECT_GT(r.refused, r.tried / 4);
}

INSTANTIATE_TEST_SUITE_P(Examples, HostileScene,
                         testing::Values("ets_vii_orbit", "capture", "qbmove_arm", "ledger",
                                         "flexible_panel", "throwing_arm"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace porthos::test::hostile_scene_test
