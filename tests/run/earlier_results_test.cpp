// A run into a folder that holds the results of another.
#include <gtest/gtest.h>

#include <set>

#include "scene/session/run.h"
#include "tests/run/scenes.h"

namespace porthos::test::earlier_results_test {
namespace {

std::set<std::string> files_of(const fs::path& folder) {
  std::set<std::string> all;
  for (const auto& e : fs::directory_iterator(folder)) all.insert(e.path().filename());
  return all;
}

void run_arm(const TemporaryFolder& folder, const std::string& out, bool with_event) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              std::string("[model]\nurdf = 'arm.urdf'\nbase = 'free'\n") +
                  (with_event ? "[[event]]\nat = 0.1\ntype = 'lock'\njoint = 'elbow'\n" : "") +
                  "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 0.2\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  scene::run(s, scene::assemble(s), into(folder / out));
}

/// The files of a run are those that it would have in a new folder. Control: a file of the user's
/// own stays.
TEST(EarlierResults, AreReplacedAlsoWhereEventsCameOrWent) {
  TemporaryFolder folder;
  run_arm(folder, "single", false);
  run_arm(folder, "phases", true);
  const auto single = files_of(folder / "single"), phases = files_of(folder / "phases");
  EXPECT_TRUE(single.contains("run.h5") && !single.contains("phase_1"));
  EXPECT_TRUE(!phases.contains("run.h5") && phases.contains("phase_2"));

  write_bytes(folder / "single" / "notes.txt", "mine");
  run_arm(folder, "single", true);
  auto with_notes = phases;
  with_notes.insert("notes.txt");
  EXPECT_EQ(files_of(folder / "single"), with_notes);
  run_arm(folder, "phases", false);
  EXPECT_EQ(files_of(folder / "phases"), single);
}

TEST(EarlierResults, AnUnfinishedRunWithEventsIsNotOverwrittenByOneWithout) {
  TemporaryFolder folder;
  run_arm(folder, "out", true);
  fs::remove(folder / "out" / "summary.json");  // as if killed before the end
  try {
    run_arm(folder, "out", false);
    ADD_FAILURE();
  } catch (const InvalidArgument& e) {
    EXPECT_TRUE(says(e.what(), "holds an unfinished run: use --resume")) << e.what();
  }
}

}  // namespace
}  // namespace porthos::test::earlier_results_test
