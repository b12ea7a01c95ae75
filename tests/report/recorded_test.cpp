// What the report and the results of a judged trajectory say of its making.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "report/detail/pages.h"
#include "report/report.h"
#include "scene/files/digest.h"
#include "scene/files/hdf5_reader.h"
#include "scene/judge/judge_file.h"
#include "scene/run/provenance.h"
#include "tests/run/recorded_table.h"
#include "tests/run/scenes.h"

namespace porthos::test::recorded_report_test {
namespace {

TEST(RecordedReport, NothingIsSaidToHaveBeenIntegrated) {
  TemporaryFolder folder;
  const Case c = pendulum(folder);
  (void)scene::run(c.scene, c.assembly, into(folder / "out"));
  write_bytes(folder / "run.csv", csv_of(c, folder / "out"));
  (void)scene::judge_file({(folder / "run.csv").string(), (folder / "model.urdf").string(), "",
                           (folder / "judged").string()});
  const auto texts = [&](const char* of) {
    const auto s = nlohmann::json::parse(read_bytes(folder / of / "summary.json"));
    return report::credibility(s, {}, nullptr).dump();
  };
  const std::string judged = texts("judged"), run = texts("out");
  for (const char* of_a_run : {"porthos verify does", "porthos compare does", "integrated by"}) {
    EXPECT_FALSE(says(judged, of_a_run));
    EXPECT_TRUE(says(run, of_a_run)) << "control";
  }
  EXPECT_TRUE(says(judged, "of a trajectory that another program made"));
  const std::string scene =
      scene::Hdf5Reader(folder / "judged" / "run.h5").text("provenance/scene");
  EXPECT_TRUE(says(scene, "nothing is integrated"));
  EXPECT_TRUE(says(scene, "method = \"recorded\""));
}

TEST(RecordedReport, ThePageKnowsWhereRowsAreMissing) {
  TemporaryFolder folder;
  const Case c = pendulum(folder);
  (void)scene::run(c.scene, c.assembly, into(folder / "out"));
  const std::string all = csv_of(c, folder / "out");
  const auto holes = [&](size_t missing) {
    std::istringstream in(all);
    std::string kept, line;
    for (size_t row = 0; std::getline(in, line); ++row)
      if (row < 20 || row >= 20 + missing) kept += line + "\n";
    write_bytes(folder / "run.csv", kept);
    (void)scene::judge_file({(folder / "run.csv").string(), (folder / "model.urdf").string(), "",
                             (folder / "judged").string()});
    const auto page = nlohmann::json::parse(report::report_json((folder / "judged").string()));
    return page["phases"][0]["motion"]["holes"].get<std::string>().size();
  };
  EXPECT_EQ(holes(5), 12u);  // one number of eight bytes in base64
  EXPECT_EQ(holes(0), 0u) << "control";
}

TEST(RecordedReport, DigestsOfFilesThatAreNotKeptAreProvenance) {
  scene::Scene s;
  s.digests = {{"trajectory_sha256", "ab"}};
  const auto is = [](const auto& one) { return one.first == "trajectory_sha256"; };
  const auto all = scene::provenance(s), none = scene::provenance({});
  const auto at = std::ranges::find_if(all, is);
  ASSERT_NE(at, all.end());
  EXPECT_EQ(at->second, "ab");
  EXPECT_EQ(std::ranges::count_if(none, is), 0) << "control";
}

}  // namespace
}  // namespace porthos::test::recorded_report_test
