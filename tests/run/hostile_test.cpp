// Results from somebody else are input like any other: whatever stands in them, it is read, or
// refused by a sentence.
#include <hdf5.h>

#include <nlohmann/json.hpp>
#include <random>

#include "report/report.h"
#include "scene/files/hdf5_reader.h"
#include "scene/run/checkpoint.h"
#include "scene/run/statistics.h"
#include "scene/session/replot.h"
#include "scene/session/report_reader.h"
#include "tests/run/scenes.h"

namespace porthos::test::hostile_test {
namespace {

/// A finished run whose files are exchanged.
struct Results {
  Results() {
    Case c = pendulum(folder, 0.3);
    c.scene.duration = 0.5;
    scene::run(c.scene, c.assembly, into(out));
  }
  std::string refused() const {
    return refusal([&] { scene::replot(out); });
  }
  TemporaryFolder folder;
  fs::path out = folder / "out";
};

/// Puts a dataset of another shape in the place of one.
void exchange(const fs::path& path, const char* name, hid_t type, std::vector<hsize_t> shape) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(H5Ldelete(file, name, H5P_DEFAULT), 0);
  const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
  const std::vector<hsize_t> chunk(shape.size(), 2);
  H5Pset_chunk(create, int(chunk.size()), chunk.data());
  const hid_t space = H5Screate_simple(int(shape.size()), shape.data(), nullptr);
  const hid_t data = H5Dcreate2(file, name, type, space, H5P_DEFAULT, create, H5P_DEFAULT);
  ASSERT_GE(data, 0);
  if (H5Tget_class(type) == H5T_STRING) {
    const std::string filled(shape[0] * H5Tget_size(type), 'x');
    H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, filled.data());
  }
  H5Dclose(data);
  H5Sclose(space);
  H5Pclose(create);
  H5Fclose(file);
}

TEST(HostileResults, ADeclaredSizeIsNotAllocated) {
  const Results r;
  exchange(r.out / "run.h5", "energy_error", H5T_NATIVE_DOUBLE, {hsize_t(1) << 45});
  EXPECT_TRUE(
      says(r.refused(), "'energy_error' is damaged: it is declared larger than what is there"));
}

TEST(HostileResults, AnArrayOfTextsIsNoText) {
  const Results r;
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, 64);
  exchange(r.out / "run.h5", "provenance/scene", type, {1000});
  H5Tclose(type);
  EXPECT_EQ(scene::Hdf5Reader(r.out / "run.h5").text("provenance/scene"), "");
}

TEST(HostileResults, SeriesOfOtherLengthsAreRefused) {
  const Results r;
  exchange(r.out / "run.h5", "time", H5T_NATIVE_DOUBLE, {2});
  EXPECT_TRUE(says(r.refused(), "'time' is damaged"));  // nothing was written into it
}

/// Other values in the place of one of a tree, and of one after the other.
template <class F>
void with_each_exchanged(nlohmann::json& all, nlohmann::json& at, int& tried, F&& f) {
  for (const char* other : {"null", "1e300", "-1", "\"\"", "[]", "{}"}) {
    const nlohmann::json kept = at;
    at = nlohmann::json::parse(other);
    f(all);
    ++tried;
    at = kept;
  }
  if (at.is_structured())
    for (auto& child : at) with_each_exchanged(all, child, tried, f);
}

TEST(HostileResults, ASummaryOfAnythingIsReadOrRefused) {
  const Results r;
  const fs::path path = r.out / "summary.json";
  nlohmann::json all = nlohmann::json::parse(read_bytes(path));
  int tried = 0, refused = 0;
  with_each_exchanged(all, all, tried, [&](const nlohmann::json& j) {
    write_bytes(path, j.dump());
    try {
      scene::replot(r.out);
    } catch (const InvalidArgument&) {
      ++refused;
    }
    (void)report::report_json(r.out);  // says what it misses
  });
  std::printf("  %d summaries, %d refused by replot, none by the report\n", tried, refused);
  EXPECT_GT(tried, 300);
  EXPECT_GT(refused, 30);
}

TEST(HostileResults, AReportOfAnythingIsReadOrRefused) {
  const Results r;
  const fs::path path = r.out / "summary.json";
  nlohmann::json all = nlohmann::json::parse(read_bytes(path));
  EXPECT_NO_THROW(scene::read_report(r.out, {}));
  int tried = 0, refused = 0;
  const auto attempt = [&](const std::string& text) {
    write_bytes(path, text);
    ++tried;
    try {
      scene::read_report(r.out, {});
    } catch (const InvalidArgument&) {
      ++refused;
    }
  };
  int exchanged = 0;
  with_each_exchanged(all, all, exchanged, [&](const nlohmann::json& j) { attempt(j.dump()); });
  for (const auto& [key, value] : all.items()) {
    nlohmann::json without = all;
    without.erase(key);
    attempt(without.dump());
  }
  attempt("");
  attempt("{");
  std::printf("  %d summaries, %d refused\n", tried, refused);
  EXPECT_GT(tried, 300);
  EXPECT_GT(refused, 100);
}

TEST(HostileResults, BytesTurnedOverAreReadOrRefused) {
  const Results r;
  const fs::path path = r.out / "run.h5";
  const std::string whole = read_bytes(path);
  std::mt19937_64 random(4);
  int refused = 0;
  for (int k = 0; k < 150; ++k) {
    std::string bad = whole;
    for (int n = 0; n < 1 + k % 8; ++n) bad[random() % bad.size()] = char(random());
    write_bytes(path, bad);
    try {
      scene::replot(r.out);
    } catch (const InvalidArgument&) {
      ++refused;
    }
  }
  std::printf("  150 damaged files, %d refused\n", refused);
  EXPECT_GT(refused, 0);
}

TEST(HostileResults, AForgedCheckpointIsContinuedOrRefused) {
  const TemporaryFolder folder;
  Case c = floating_arm(folder, 2, "gauss8");
  std::atomic<bool> stop = true;
  auto options = into(folder / "out");
  options.stop = &stop;
  scene::run(c.scene, c.assembly, options);
  const fs::path at = folder / "out/checkpoint";
  const scene::Checkpoint good = scene::read_checkpoint(at);
  int tried = 0, refused = 0;
  for (size_t k = 0; k < good.memory.size() + good.statistics.size(); ++k)
    for (const double x : {1e300, -7.0, std::nan("")}) {
      scene::Checkpoint bad = good;
      (k < good.memory.size() ? bad.memory[k] : bad.statistics[k - good.memory.size()]) = x;
      scene::write_checkpoint(at, bad);  // with a checksum that fits
      auto again = into(folder / "out", true);
      again.stop = &stop;
      ++tried;
      try {
        scene::run(c.scene, c.assembly, again);
      } catch (const InvalidArgument& e) {
        ++refused;
        EXPECT_TRUE(says(e.what(), "checkpoint"));
      }
    }
  std::printf("  %d forged checkpoints, %d refused\n", tried, refused);
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace porthos::test::hostile_test
