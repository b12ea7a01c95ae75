#include <hdf5.h>

#include <cmath>

#include "tests/run/shipped.h"

// Smallest and largest values between the records: what a coarse record would not show.
namespace porthos::test::extrema_test {
namespace {

std::vector<double> dataset(const fs::path& h5, const std::string& name) {
  const hid_t f = H5Fopen(h5.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT),
              d = H5Dopen2(f, name.c_str(), H5P_DEFAULT);
  EXPECT_GE(d, 0) << name;
  const hid_t s = H5Dget_space(d);
  std::vector<double> v(size_t(H5Sget_simple_extent_npoints(s)));
  H5Dread(d, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.data());
  H5Sclose(s);
  H5Dclose(d);
  H5Fclose(f);
  return v;
}

TEST(Extrema, OfAWindowAreThoseOfItsSteps) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 40);
  c.scene.record_every = c.scene.step;
  scene::run(c.scene, c.assembly, into(folder / "fine"));
  const size_t every = 100;
  c.scene.record_every = double(every) * c.scene.step;
  c.scene.extrema = scene::Extrema::all;
  scene::run(c.scene, c.assembly, into(folder / "coarse"));
  const auto fine = folder / "fine" / "run.h5", coarse = folder / "coarse" / "run.h5";
  const auto turns = dataset(fine, "turns");
  for (const std::string name : {"state/shoulder", "momentum/elbow", "state/elbow", "energy_error",
                                 "stored/links.kinetic", "quaternion_norm_error"}) {
    auto all = dataset(fine, name);
    const size_t joint = name == "state/shoulder" ? 0 : name == "state/elbow" ? 1 : 2;
    if (joint < 2)  // true angles
      for (size_t i = 0; i < all.size(); ++i)
        all[i] += turns[2 * i + joint] * 6.283185307179586476925;
    const auto low = dataset(coarse, "minimum/" + name), high = dataset(coarse, "maximum/" + name);
    ASSERT_EQ(low.size(), (all.size() - 1) / every + 1);
    int hidden = 0;
    for (size_t k = 0; k < low.size(); ++k) {
      const size_t from = k == 0 ? 0 : (k - 1) * every + 1, to = k * every;
      const auto [a, b] = std::minmax_element(all.begin() + long(from), all.begin() + long(to) + 1);
      ASSERT_EQ(low[k], *a) << name << " window " << k;
      ASSERT_EQ(high[k], *b) << name << " window " << k;
      hidden += *a < std::min(all[from], all[to]) || *b > std::max(all[from], all[to]);
    }
    std::printf("  %-24s %d of %zu windows hold a peak that their ends do not show\n", name.c_str(),
                hidden, low.size());
    EXPECT_GT(hidden, 0) << name;
  }
}

TEST(Extrema, OfTheStateAloneCostNoMeasurement) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 40);
  c.scene.record_every = 2;
  c.scene.extrema = scene::Extrema::state;
  scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto h5 = folder / "out" / "run.h5";
  EXPECT_FALSE(dataset(h5, "minimum/state/elbow").empty());
  const hid_t f = H5Fopen(h5.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  EXPECT_GT(H5Lexists(f, "minimum/state", H5P_DEFAULT), 0);
  EXPECT_EQ(H5Lexists(f, "minimum/energy_error", H5P_DEFAULT), 0);
  EXPECT_GT(H5Aexists_by_name(f, "minimum", "window", H5P_DEFAULT), 0);
  EXPECT_GT(H5Aexists_by_name(f, "minimum/state/elbow", "unit", H5P_DEFAULT), 0);
  H5Fclose(f);
}

TEST(Extrema, AStoppedRunContinuesThem) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 1200);
  c.scene.record_every = 100;
  c.scene.extrema = scene::Extrema::all;
  scene::run(c.scene, c.assembly, into(folder / "whole"));
  std::atomic<bool> stop = false;
  auto o = into(folder / "parts");
  o.stop = &stop;
  o.progress = [&](double, double, double) { stop = true; };
  int parts = 0;
  for (bool on = true; on && parts < 100; ++parts, o.resume = true) {
    stop = parts == 0;
    on = scene::run(c.scene, c.assembly, o).interrupted;
  }
  std::printf("  in %d parts\n", parts);
  EXPECT_GT(parts, 1);
  EXPECT_TRUE(read_bytes(folder / "whole" / "run.h5") == read_bytes(folder / "parts" / "run.h5"));
}

/// A wheel is sized by its largest momentum. Control: of records that are far apart.
TEST(Extrema, MomentaOfWheelsAreThoseOfAllSteps) {
  const auto wheel_z = [](const std::string& every, const std::string& extrema) {
    TemporaryFolder folder;
    const auto s = shipped(folder, "slew", 120,
                           {{"record_every = 1.0", "record_every = " + every + "\n" + extrema}});
    const auto a = scene::assemble(s);
    const auto r = scene::run(s, a, into(folder / "out"));
    const auto row = std::ranges::find(r.momentum, "wheel_z", &scene::MomentumRow::name);
    EXPECT_NE(row, r.momentum.end());
    return *row;
  };
  const auto all = wheel_z("0.1", ""), far = wheel_z("60.0", ""),
             seen = wheel_z("60.0", "extrema = \"state\"");
  std::printf("  largest of wheel_z: %.6g, every 60 s %.6g, with extrema %.6g N m s\n", all.largest,
              far.largest, seen.largest);
  EXPECT_FALSE(far.at_steps || all.at_steps);
  EXPECT_TRUE(seen.at_steps);
  EXPECT_DOUBLE_EQ(seen.largest, all.largest);  // the same run, seen at every step
  EXPECT_LT(far.largest, 0.5 * all.largest);
}

}  // namespace
}  // namespace porthos::test::extrema_test
