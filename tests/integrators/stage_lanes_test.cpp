#include "integrators/core/stage_lanes.h"

#include <gtest/gtest.h>

#include <random>

namespace porthos::integrators::stage_lanes_test {
namespace {

/// The tree of comparisons finds what a loop over the lanes finds, wherever the largest is.
template <int W>
void finds_the_largest_of_each() {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::array<Magnitudes<W>, W> x;
    for (auto& pack : x)
      for (int i = 0; i < W; ++i) pack.set(i, number(rng));
    const auto largest = largest_of_each<W>(x);
    for (int k = 0; k < W; ++k) EXPECT_EQ(largest[k], largest_of(x[size_t(k)])) << k;
  }
}
TEST(StageLanes, LargestOfEach) {
  finds_the_largest_of_each<2>();
  finds_the_largest_of_each<4>();
  finds_the_largest_of_each<8>();
}

}  // namespace
}  // namespace porthos::integrators::stage_lanes_test
