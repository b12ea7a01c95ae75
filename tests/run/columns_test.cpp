// One list of columns: what run.h5 has, what the report reads from a log, what Python shows.
#include "scene/run/columns.h"

#include <atomic>
#include <set>

#include "scene/files/hdf5_reader.h"
#include "scene/session/records.h"
#include "tests/run/scenes.h"

namespace porthos::test::columns_test {
namespace {

std::set<std::string> names_of(const std::vector<scene::Column>& columns) {
  std::set<std::string> names;
  for (const auto& c : columns) EXPECT_TRUE(names.insert(c.name).second) << c.name << " twice";
  return names;
}

TEST(Columns, TheFileHasThemAndNoOthers) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 2);
  c.scene.extrema = scene::Extrema::all;
  scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto& d = c.assembly.model->description();
  const scene::RecordLayout layout(d, c.scene.extrema);
  const auto columns = scene::columns_of(d, layout);

  std::set<std::string> in_file;
  const scene::Hdf5Reader file(folder / "out" / "run.h5");
  for (const auto& [name, what] : file.datasets())
    if (!name.starts_with("provenance/")) in_file.insert(name);
  EXPECT_EQ(names_of(columns), in_file);
  for (const auto& column : columns) {
    const auto& shape = file.dataset(column.name).shape;
    EXPECT_EQ(shape.size(), column.matrix ? 2 : 1) << column.name;
    if (column.matrix) {
      EXPECT_EQ(shape[1], std::int64_t(column.columns)) << column.name;
    }
  }
}

TEST(Columns, EveryNumberOfARecordIsInOne) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  const auto& d = c.assembly.model->description();
  for (const auto extrema : {scene::Extrema::none, scene::Extrema::state, scene::Extrema::all}) {
    const scene::RecordLayout layout(d, extrema);
    std::vector<int> seen(layout.size(), 0);
    for (const auto& column : scene::columns_of(d, layout))
      for (size_t k = 0; k < column.columns; ++k) ++seen[column.first + k];
    EXPECT_EQ(seen, std::vector<int>(layout.size(), 1)) << int(extrema);
  }
}

// On a fixed base no momentum is an invariant: zeros would read as one kept without an error.
TEST(Columns, AMomentumThatIsNoInvariantHasNoError) {
  TemporaryFolder folder;
  const auto names = [](const Case& c) {
    const auto& d = c.assembly.model->description();
    return names_of(scene::columns_of(d, {d, c.scene.extrema}));
  };
  Case fixed = pendulum(folder, 0.3);
  fixed.scene.extrema = scene::Extrema::all;
  const std::set<std::string> floating = names(floating_arm(folder));
  for (const char* name : {"linear_momentum_error", "angular_momentum_error"}) {
    EXPECT_FALSE(names(fixed).contains(name));
    EXPECT_FALSE(names(fixed).contains(std::string("minimum/") + name));
    EXPECT_TRUE(floating.contains(name));  // control
  }
  EXPECT_TRUE(names(fixed).contains("minimum/energy_error"));

  scene::run(fixed.scene, fixed.assembly, into(folder / "out"));
  const scene::Hdf5Reader file(folder / "out" / "run.h5");
  for (const auto& [name, what] : file.datasets())
    EXPECT_EQ(name.find("momentum_error"), std::string::npos) << name;
}

TEST(Columns, ALogHasWhatTheFileHas) {
  TemporaryFolder folder;
  Case c = pendulum(folder, 0.3);
  std::atomic<bool> stop = true;
  auto options = into(folder / "out");
  options.stop = &stop;
  ASSERT_TRUE(scene::run(c.scene, c.assembly, options).interrupted);
  const auto& d = c.assembly.model->description();
  const auto log =
      scene::open_log(folder / "out" / "checkpoint" / "records.bin", d, {d, c.scene.extrema});
  for (const auto& column : scene::columns_of(d, {d, c.scene.extrema}))
    EXPECT_TRUE(log->has(column.name)) << column.name;
  EXPECT_EQ(log->names("momentum").size(), 2u);
  EXPECT_FALSE(log->has("momentum/nothing"));
}

}  // namespace
}  // namespace porthos::test::columns_test
