// The page's data of what porthos identify found, and of a damaged folder.
#include <nlohmann/json.hpp>

#include "report/report.h"
#include "scene/identification/identification.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::report::identification_page_test {
namespace {

using namespace porthos::test;

scene::Identification identified(const fs::path& to) {
  const std::string example = std::string(PORTHOS_SOURCE_DIR) + "/examples/identification/";
  auto s = scene::read_scene(example + "scene.toml");
  scene::IdentificationRequest request;
  request.parameters = {"spring.stiffness", "bearing.viscous"};
  request.noise.of_all = 1e-3;
  auto r = scene::identify(s, example + "log.csv", request);
  scene::write_identification(to.string(), s, r);
  return r;
}

}  // namespace

TEST(IdentificationPage, HasWhatWasFoundAndTheSizesOfWhatIsLeft) {
  TemporaryFolder folder;
  const auto r = identified(folder / "out");
  const auto j = nlohmann::json::parse(report_json(folder / "out"));
  EXPECT_EQ(j["kind"], "identification");
  EXPECT_EQ(j["status"]["state"], "complete");
  const auto& i = j["identification"];
  EXPECT_EQ(i["parameters"][0]["found"].get<double>(), r.found[0].value);
  EXPECT_EQ(i["surprise"].get<double>(), r.surprise());
  EXPECT_TRUE(i["noise_known"].get<bool>());
  ASSERT_EQ(i["residuals"]["t"].size(), r.times.size());  // up to 1000 times, each
  double sum = 0;
  for (const double x : i["residuals"]["after"][0]) sum += x * x;
  EXPECT_NEAR(sum, r.chi_square, 1e-9 * r.chi_square);
  EXPECT_GT(i["residuals"]["before"][0][300].get<double>(), 10);
  EXPECT_FALSE(j["texts"]["scene"].get<std::string>().empty()) << "found.toml";
}

TEST(IdentificationPage, DamageIsNamed) {
  TemporaryFolder folder;
  fs::create_directories(folder / "out");
  for (const char* text : {"{\"parameters\": [", "[]", "{\"parameters\": []}"}) {
    write_bytes(folder / "out/identify.json", text);
    const auto j = nlohmann::json::parse(report_json(folder / "out"));
    EXPECT_EQ(j["status"]["state"], "damaged") << text;
    EXPECT_TRUE(j["identification"].is_null());
    EXPECT_EQ(j["missing"].size(), 1u);
  }
}

}  // namespace porthos::report::identification_page_test
