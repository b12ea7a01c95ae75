// The page's data of an ensemble: distributions over all cases, the numbers of some, damage.
#include <cstring>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "report/detail/pages.h"
#include "report/report.h"
#include "scene/ensemble/ensemble.h"
#include "scene/files/hdf5_reader.h"
#include "tests/run/scenes.h"

namespace porthos::report::ensemble_page_test {
namespace {

using namespace porthos::test;

class EnsemblePage : public testing::Test {
 protected:
  void SetUp() override {
    write_bytes(folder_ / "two.urdf", two_arms_urdf());
    write_bytes(folder_ / "scene.toml", R"(title = "Two </script> arms"
[model]
urdf = "two.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[integrator]
method = "gauss8"
step = 0.02
[run]
duration = 3.0
[verify]
energy = 1e-10
[[event]]
type = "lock"
joint = "jb"
above = 0.9
[[output]]
quantity = "joint_rate"
joint = "jb"
name = "motion"
[ensemble]
cases = 40
[ensemble.vary]
"initial.joints.ja.position" = { uniform = [-2, 2] }
"initial.joints.jb.velocity" = { uniform = [1, 5] }
)");
    const scene::Ensemble e(scene::read_scene((folder_ / "scene.toml").string()));
    report_ = run_ensemble(e, {.out = out().string(), .threads = 1});
  }
  fs::path out() const { return folder_ / "out"; }
  static std::int64_t total(const Json& counts) {
    std::int64_t n = 0;
    for (const auto& c : counts) n += c.get<std::int64_t>();
    return n;
  }
  static const Json& column(const Json& j, const std::string& name) {
    for (const Json& c : j["cases"]["columns"])
      if (c["name"] == name) return c;
    throw InvalidArgument("there is no column " + name);
  }
  TemporaryFolder folder_;
  scene::EnsembleReport report_;
};

TEST_F(EnsemblePage, CountsEveryCaseOnce) {
  const Json j = Json::parse(report_json(out()));
  EXPECT_EQ(j["kind"], "ensemble");
  EXPECT_EQ(j["status"]["state"], "complete");
  EXPECT_EQ(j["rerun"], out().string());
  EXPECT_EQ(j["limits"]["energy"], 1e-10);
  EXPECT_EQ(j["ensemble"]["passed"], report_.passed);
  ASSERT_GT(report_.passed, 0);
  ASSERT_LT(report_.passed, 40) << "control: cases of both kinds";
  const Json& input = column(j, "initial.joints.ja.position");
  EXPECT_EQ(total(input["passed"]), report_.passed);
  EXPECT_EQ(total(input["others"]), 40 - report_.passed);
  EXPECT_GE(input["low"], -2.0);
  EXPECT_LE(input["high"], 2.0);
  const Json& error = column(j, "energy error");
  EXPECT_TRUE(error["log"]);
  EXPECT_EQ(total(error["passed"]) + total(error["others"]), 40);
  EXPECT_NEAR(error["high"].get<double>(), std::log10(report_.energy.quantiles[6]), 1e-12);
  // An event counts only where it happened.
  const Json& event = column(j, report_.events[0].name);
  EXPECT_EQ(total(event["passed"]) + total(event["others"]), report_.events[0].happened);
  EXPECT_LT(report_.events[0].happened, 40);
  EXPECT_NO_THROW(column(j, "motion, at the end"));
  EXPECT_NO_THROW(column(j, "motion, largest"));
  EXPECT_EQ(j["cases"]["shown"].size(), 40u);
  // Each case that failed says why, and those that passed do not.
  std::int64_t energy = 0;
  for (size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(j["cases"]["failed"][i].empty(), j["cases"]["verdicts"][i] == 1) << i;
    for (const Json& check : j["cases"]["failed"][i]) energy += check == "energy";
  }
  EXPECT_EQ(energy, j["ensemble"]["failed_checks"].value("energy", 0));
}

TEST_F(EnsemblePage, HasTheNumbersOfItsCases) {
  const Json j = Json::parse(report_json(out()));
  std::vector<double> rows(80);
  scene::Hdf5Reader(out() / "ensemble.h5").read("inputs", rows.data());
  // base64 of little-endian floats: the first four bytes are in the first six letters.
  const std::string text = column(j, "initial.joints.ja.position")["v"];
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::uint64_t bits = 0;
  for (int k = 0; k < 6; ++k) bits = bits << 6 | letters.find(text[size_t(k)]);
  const std::uint32_t big = std::uint32_t(bits >> 4), little = __builtin_bswap32(big);
  float first;
  std::memcpy(&first, &little, sizeof first);
  EXPECT_EQ(first, float(rows[0]));
}

TEST_F(EnsemblePage, NamesWhatIsDamaged) {
  fs::resize_file(out() / "ensemble.h5", fs::file_size(out() / "ensemble.h5") / 2);
  Json j = Json::parse(report_json(out()));
  EXPECT_EQ(j["status"]["state"], "damaged");
  EXPECT_TRUE(says(j["missing"][0].get<std::string>(), "ensemble.h5 is damaged"));
  EXPECT_EQ(j["ensemble"]["cases"], 40) << "what can be read is there";
  write_bytes(out() / "ensemble.json", "{}");
  j = Json::parse(report_json(out()));
  EXPECT_TRUE(says(j["missing"][0].get<std::string>(), "ensemble.json is damaged"));
}

}  // namespace
}  // namespace porthos::report::ensemble_page_test
