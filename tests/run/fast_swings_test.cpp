// A note where records are too far apart for the swings between them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"

namespace porthos::test::fast_swings_test {
namespace {

/// The notes on swings of a double pendulum whose records are so far apart. step: of it, 0: its own
std::vector<std::string> notes_of(double record_every, const std::string& extrema = "",
                                  double step = 0) {
  const TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.duration = 60;
  c.scene.record_every = record_every;
  if (step > 0) c.scene.step = step;
  if (extrema == "state") c.scene.extrema = scene::Extrema::state;
  auto notes = scene::run_in_memory(c.scene, c.assembly, {}).notes;
  std::erase_if(notes, [](const std::string& n) { return n.find("swings of") == n.npos; });
  return notes;
}

TEST(FastSwings, AreNotedWhereRecordsAreTooFarApart) {
  const auto far = notes_of(0.9);
  ASSERT_EQ(far.size(), 1u);
  std::printf("  %s\n", far[0].c_str());
  EXPECT_NE(far[0].find("records every 0.9 s"), std::string::npos);
  EXPECT_NE(far[0].find("'elbow'"), std::string::npos);
  EXPECT_TRUE(far[0].ends_with("take a smaller record_every")) << "the step is shorter";
  const auto each = notes_of(0.6, "", 0.6);
  ASSERT_EQ(each.size(), 1u);
  EXPECT_TRUE(each[0].ends_with("take a smaller step, which is recorded each time")) << each[0];
  EXPECT_LE(far[0].size(), 220u);
  EXPECT_TRUE(notes_of(0.05).empty());          // resolved
  const auto watched = notes_of(0.9, "state");  // pictures do not draw what is in the file
  ASSERT_EQ(watched.size(), 1u);
  EXPECT_NE(watched[0].find("are in minimum/ and maximum/"), std::string::npos);
}

}  // namespace
}  // namespace porthos::test::fast_swings_test
