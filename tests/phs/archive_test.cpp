// One function counts, saves and loads.
#include "phs/system/archive.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/bounds.h"

namespace porthos::archive_test {
namespace {

using test::refusal;

struct Thing {
  double x = 1.5;
  bool flag = true;
  int count = 7;
  std::int64_t steps = 1LL << 40;
  std::vector<double> values{0.1, -0.0, std::numeric_limits<double>::infinity()};
  phs::Quad quad = 0.25;

  void carry(Archive& a) {
    a(x);
    a(flag);
    a(count, 0, 10);
    a(steps);
    a(values);
    a(quad);
  }
};

TEST(Archive, LoadsWhatItSaved) {
  const Thing one;
  std::vector<double> m;
  save_carried(one, m);
  EXPECT_EQ(m.size(), 8u);
  Thing other{0, false, 0, 0, {0, 0, 0}, 0};
  load_carried(other, m, "thing");
  std::vector<double> again;
  save_carried(other, again);
  EXPECT_EQ(again, m);
  EXPECT_TRUE(std::signbit(other.values[1]));
}

TEST(Archive, RefusesSizesAndCountsThatDoNotFit) {
  Thing thing;
  std::vector<double> m;
  save_carried(thing, m);
  for (const size_t size : {size_t(0), m.size() - 1, m.size() + 1}) {
    m.resize(size);
    EXPECT_NE(refusal([&] { load_carried(thing, m, "thing"); }).find("expected 8"),
              std::string::npos);
  }
  m.resize(8);
  for (const double count : {-1.0, 11.0, std::numeric_limits<double>::quiet_NaN()}) {
    m[2] = count;
    EXPECT_NE(refusal([&] { load_carried(thing, m, "thing"); }), "");
  }
}

}  // namespace
}  // namespace porthos::archive_test
