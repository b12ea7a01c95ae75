// Which records a picture shows.
#include "scene/plot/shown.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "scene/plot/apart_by_size.h"

namespace porthos::test::shown_test {
namespace {

using scene::Shown;

TEST(Shown, RecordsAreEquallyFarApart) {
  EXPECT_EQ(scene::evenly(3, 5), (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_EQ(scene::evenly(9, 5), (std::vector<std::int64_t>{0, 2, 4, 6, 8}));
  EXPECT_EQ(scene::evenly(1, 5), (std::vector<std::int64_t>{0}));
  EXPECT_TRUE(scene::evenly(0, 5).empty());
}

// Of a swing that is faster than a picture has records neighbours are as good as independent; at
// equal distances (control) it is drawn as a slow one.
TEST(Shown, ThinnedRecordsShowNoSlowSwingThatIsNotThere) {
  constexpr std::int64_t count = 320001, most = 1500;
  const double period = double(count - 1) / (most - 1) * 1.002;
  const auto alike = [&](const std::vector<std::int64_t>& rows) {
    EXPECT_EQ(rows.size(), size_t(most));
    EXPECT_EQ(rows.front(), 0);
    EXPECT_EQ(rows.back(), count - 1);
    double sum = 0;
    for (size_t k = 1; k < rows.size(); ++k) {
      EXPECT_LT(rows[k - 1], rows[k]);
      const auto y = [&](size_t i) {
        return std::sin(2 * std::numbers::pi * double(rows[i]) / period);
      };
      sum += 2 * y(k) * y(k - 1) / double(rows.size());
    }
    return sum;
  };
  const double thinned = alike(scene::thinned(count, most)),
               even = alike(scene::evenly(count, most));
  std::printf("  correlation of neighbours: %.3f   bound 0.1; at equal distances %.3f\n", thinned,
              even);
  EXPECT_LT(std::fabs(thinned), 0.1);
  EXPECT_GT(even, 0.9);
  for (const std::int64_t n : {3, 4, 5, 7, 10, 1501})
    EXPECT_EQ(scene::thinned(n, 1500).size(), size_t(std::min<std::int64_t>(n, 1500)));
  EXPECT_EQ(scene::thinned(1501, 1500), scene::thinned(1501, 1500));
}

/// The rows of a sine with so many periods in 320 001 records.
std::vector<double> sine(const Shown& shown, double periods) {
  std::vector<double> v;
  for (const auto row : shown.rows())
    v.push_back(std::sin(2 * std::numbers::pi * periods * double(row) / 320000));
  return v;
}

// A swing faster than the picture fills its band, in every part; one that is slow is itself.
// Control: of single records the parts are narrower.
TEST(Shown, BandsHaveTheLeastAndTheLargestOfEachPart) {
  constexpr std::int64_t count = 320001, most = 1500;
  const Shown bands = Shown::bands(count, most), records = Shown::records(count, most);
  const auto narrowest = [&](const std::vector<double>& v) {
    double least = 2;
    for (size_t k = 0; k + 1 < v.size(); k += 2)
      least = std::min(least, std::fabs(v[k + 1] - v[k]));
    return least;
  };
  const double fast = narrowest(bands.values(sine(bands, 13337.7))),
               single = narrowest(records.values(sine(records, 13337.7)));
  std::printf("  narrowest part of a fast sine: %.2f of 2   bound 1; of single records %.1e\n",
              fast, single);
  EXPECT_GT(fast, 1);  // of 16 random places in a part
  EXPECT_LT(single, 0.1);
  std::vector<double> t;
  for (const auto row : bands.rows()) t.push_back(double(row));
  const auto times = bands.times(t), slow = bands.values(sine(bands, 2));
  ASSERT_EQ(times.size(), size_t(most));
  EXPECT_EQ(times.front(), 0);
  EXPECT_EQ(times.back(), count - 1);
  EXPECT_TRUE(std::ranges::is_sorted(times));
  double off = 0;  // a part is 427 records long, two periods are 320000
  for (size_t k = 0; k < times.size(); ++k)
    off = std::max(off, std::fabs(slow[k] - std::sin(4 * std::numbers::pi * times[k] / 320000)));
  std::printf("  slow sine off by %.1e   bound %.1e\n", off, 4 * std::numbers::pi * 427 / 320000);
  EXPECT_LT(off, 4 * std::numbers::pi * 427 / 320000);
}

TEST(Shown, FewRecordsAreShownAsTheyAre) {
  for (const std::int64_t count : {0, 1, 2, 1500}) {
    const Shown all = Shown::bands(count, 1500);
    const std::vector<double> v = sine(all, 3);
    EXPECT_EQ(all.rows().size(), size_t(count));
    EXPECT_EQ(all.values(v), v);
  }
  const Shown one_more = Shown::bands(5, 4);  // nan only where a part has no other
  const auto v = one_more.values({std::nan(""), 2, 3, std::nan(""), 1});
  EXPECT_EQ(v, (std::vector<double>{2, 2, 3, 1}));
}

/// "what: a b" of every panel, with its note.
std::vector<std::string> told(const std::vector<scene::TracePanel>& panels) {
  std::vector<std::string> all;
  for (const auto& p : panels) {
    std::string text = p.what + ":";
    for (const auto& l : p.lines) text += " " + l.name;
    all.push_back(text + (p.others.empty() ? "" : " (" + p.others + ")"));
  }
  return all;
}
scene::TraceLine line(const char* name, double size) {
  return {name, {0, 1, 2}, {0, -size, std::nan("")}};
}

// Controls: what is a hundred times smaller at most, 0 or rounding stays, and so do other panels.
TEST(ApartBySize, SmallLinesHaveAPanelOfTheirOwn) {
  using Told = std::vector<std::string>;
  const auto of = [](const char* what, std::vector<scene::TraceLine> lines) {
    return told(scene::apart_by_size({{what, std::move(lines)}}));
  };
  EXPECT_EQ(
      of("outputs [N]", {line("a", 2), line("b", 900), line("c", 9.1), line("d", 0)}),
      (Told{"outputs [N]: b c d (1 other is in 'outputs, smaller')", "outputs, smaller [N]: a"}));
  EXPECT_EQ(
      of("torques of motors [N m]",
         {line("a", 1e-5), line("b", 1e3), line("c", 1), line("d", 1e-4), line("e", 1e-7)}),
      (Told{"torques of motors [N m]: b e (3 others are in 'torques of motors, smaller')",
            "torques of motors, smaller [N m]: c", "torques of motors, smaller 2 [N m]: a d"}));
  EXPECT_EQ(of("powers of motors [W]", {line("a", 1), line("b", 99)}),
            (Told{"powers of motors [W]: a b"}));
  EXPECT_EQ(of("joints [rad]", {line("a", 1), line("b", 900)}), (Told{"joints [rad]: a b"}));
  EXPECT_EQ(of("outputs [N]", {}), (Told{"outputs [N]:"}));
}

}  // namespace
}  // namespace porthos::test::shown_test
